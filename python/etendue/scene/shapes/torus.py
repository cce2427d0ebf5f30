"""The torus, as a surface."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import Length
from etendue.errors import ArgumentError
from etendue.scene.shapes.shape import Record, Shape, Sheet, Trim


class Torus(Shape):
    """A ring about the z axis around the origin; its normal points out of the tube. As a solid it has the face ``surface``.

    Parameters
    ----------
    major_radius : number
        From the axis to the middle of the tube [mm].
    minor_radius : number
        Of the tube [mm], less than `major_radius`.

    Examples
    --------
    >>> Torus(major_radius=5, minor_radius=1).record()
    {'kind': 'torus', 'major': 5.0, 'minor': 1.0}
    """

    kind: Literal["torus"] = "torus"
    major_radius: Length
    minor_radius: Length

    @model_validator(mode="after")
    def _is_a_ring(self) -> Self:
        if not self.minor_radius < self.major_radius:
            raise ValueError(f"'minor_radius' is {self.minor_radius:g}; it must be less than 'major_radius'")
        return self

    def record(self) -> Record:
        """Both radii."""
        return {"kind": "torus", "major": self.major_radius, "minor": self.minor_radius}

    def sheet(self, trim: Trim, files: Files) -> Sheet:  # noqa: ARG002 - other shapes come from files
        """The torus within half spaces; ranges of z are half spaces too."""
        if trim.radius is not None:
            raise ArgumentError("trim.radius: a torus is trimmed by z and half spaces only")
        return Sheet(self.record(), [*trim.planes(), *trim.planes_of_z()])
