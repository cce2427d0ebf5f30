"""A plane that cuts a scene."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Self

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require

Array = npt.NDArray[np.float64]

AXES = "xyz"
SHOWN = {"y": (0, 2), "x": (1, 2), "z": (0, 1)}
"""By the axis that stands upright on the section: which coordinates run to the right and up."""


@dataclasses.dataclass(frozen=True)
class Section:
    """A plane across one of the axes, seen so that the other two run to the right and up.

    Parameters
    ----------
    axis : {"x", "y", "z"}
        The axis that it cuts.
    at : float
        Where it cuts it [mm].

    Examples
    --------
    >>> Section.parse("y=-2.5")
    Section(axis='y', at=-2.5)
    >>> Section("y", 0.0).flat(np.array([[1.0, 2.0, 3.0]])).tolist()
    [[1.0, 3.0]]
    """

    axis: str
    at: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """A section from its equation, as ``y=0``.

        Raises
        ------
        ArgumentError
            If the text is no such equation.
        """
        require(text, str, "section", "the plane across one of the axes, in mm, e.g. y=0 or z=12.5")
        match = re.fullmatch(r"\s*([xyz])\s*=\s*(\S+)\s*", text)
        try:
            at = float(match[2]) if match else math.nan
        except ValueError:
            at = math.nan
        if match is None or not math.isfinite(at):
            raise ArgumentError(f"section {text!r}: give the plane across one of the axes, in mm, e.g. y=0 or z=12.5.")
        return cls(match[1], at + 0.0)

    def __str__(self) -> str:
        """Its equation, with the unit."""
        return f"{self.axis} = {self.at:g} mm".replace("-", "−")

    @property
    def across(self) -> str:
        """The axis that runs to the right."""
        return AXES[SHOWN[self.axis][0]]

    @property
    def up(self) -> str:
        """The axis that runs up."""
        return AXES[SHOWN[self.axis][1]]

    @property
    def index(self) -> int:
        """Number of the axis that it cuts."""
        return AXES.index(self.axis)

    def flat(self, points: Array) -> Array:
        """Points projected onto the section, shape (…, 2) [mm]."""
        return points[..., SHOWN[self.axis]]

    def depth(self, points: Array) -> Array:
        """How far points lie from the section along its axis [mm]."""
        depth: Array = points[..., self.index] - self.at
        return depth

    def points(self, flat: Array) -> Array:
        """Points of the section in space, shape (…, 3) [mm]."""
        points = np.full((*flat.shape[:-1], 3), self.at)
        points[..., SHOWN[self.axis]] = flat
        return points

    def directions(self, flat: Array) -> Array:
        """Directions within the section in space, shape (…, 3)."""
        directions = np.zeros((*flat.shape[:-1], 3))
        directions[..., SHOWN[self.axis]] = flat
        return directions
