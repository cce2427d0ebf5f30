"""What all bodies share: closed surfaces put together from faces with names."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import ClassVar

from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.scene.placement import HERE, Frame
from etendue.scene.shapes.shape import BESIDE_A_SHAPE, Record


@dataclasses.dataclass(frozen=True)
class Face:
    """One face of a body, in the body's coordinates.

    Parameters
    ----------
    name : str
        Within the body.
    shape : mapping
        As the core takes it.
    frame : Frame
        Where the shape stands.
    flip : bool
        Whether the shape's own normal points into the body.
    group : str, optional
        A name that it shares with like faces.
    doubts : tuple of str
        What makes one doubt that the body is closed.
    notes : tuple of str
        What the user should know of it.
    facet_notes : tuple of str
        Likewise, if light passes the face.

    Examples
    --------
    >>> Face("base", {"kind": "flat", "outline": {"kind": "whole"}}).flip
    False
    """

    name: str
    shape: Record
    frame: Frame = HERE
    flip: bool = False
    group: str | None = None
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    facet_notes: tuple[str, ...] = ()


class Body(Description, abc.ABC):
    """A shape of a solid: a closed surface, in local coordinates.

    Bodies with a base stand on the plane z = 0; the others lie around the origin.
    """

    INSTEAD: ClassVar[Mapping[str, str]] = BESIDE_A_SHAPE

    @abc.abstractmethod
    def faces(self, files: Files) -> tuple[Face, ...]:
        """All faces; together they leave no gap."""
