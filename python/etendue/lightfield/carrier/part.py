"""A part of a carrier surface: one shape with an equal-area map to the unit square."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue import _core

Shape = Literal["rectangle", "disk", "hemisphere", "tube"]
Focus = tuple[float, float, float, float]
Triple = tuple[float, float, float]

FLAT: Focus = (0.0, 0.0, 0.0, 0.0)
"""The focus of a part whose places lie in its plane whatever the direction."""

Beam = tuple[float, float, float]

ALL: Beam = (0.0, 0.0, 1.0)
"""The beam of a part that takes all directions."""

NO_BEAM: Beam = (0.0, 0.0, 0.0)

WORLD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Axes of a part whose light heads towards +Z."""

DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Axes of a part whose light heads towards -Z."""


@dataclasses.dataclass(frozen=True)
class Part:
    """One chart of a carrier surface: a shape with an equal-area map to the unit square.

    Light leaves a part on the side of its normal. Within a rectangle the chart is linear; a disk is mapped by the
    concentric map of [ShirleyChiu1997]_; a hemisphere is mapped to the disk by Lambert's equal-area azimuthal projection
    first; a tube is unrolled, azimuth first.

    Parameters
    ----------
    name : str
        What the part is within its surface: ``"window"``, ``"dome"``, ``"side"`` …
    shape : {"rectangle", "disk", "hemisphere", "tube"}
    centre : tuple of float, shape (3,)
        [mm]; of a hemisphere the centre of the sphere, of a tube the middle of its axis.
    axes : tuple of 3 tuples
        Orthonormal, right-handed x, y, z. z is the normal of a flat part, the pole of a hemisphere, the axis of a tube.
    size : tuple of float
        [mm] (width along x, height along y) of a rectangle, (radius, 0) of a disk or hemisphere, (radius, height) of a tube.
    focus : tuple of 4 floats
        Of a rectangle: the height above it at which the places of light under θ are taken, f₀ + f₁ (1 - cos θ) +
        f₂ (1 - cos θ)² + f₃ (1 - cos θ)³ [mm]. Rays start on the rectangle's plane all the same. Places that are shifted by
        direction alone leave étendue what it is: theory eq. 41.
    hole : float
        Share of both sides, about the middle, within which no ray is left for this part, as others take them first.
    beam : tuple of 3 floats
        The directions that the part takes: a disk of direction cosines along x and y, by its middle and its radius.
    taken : tuple of 3 floats
        Likewise the directions of which no ray is left for this part, as others take them first; of radius 0 if none.

    Examples
    --------
    >>> round(Part("dome", "hemisphere", (0, 0, 0), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (2.0, 0.0)).area, 3)
    25.133
    """

    name: str
    shape: Shape
    centre: Triple
    axes: tuple[Triple, Triple, Triple]
    size: tuple[float, float]
    focus: Focus = FLAT
    hole: float = 0.0
    beam: Beam = ALL
    taken: Beam = NO_BEAM

    @property
    def is_shared(self) -> bool:
        """Whether other parts take some of its light first."""
        return self.hole > 0.0 or self.taken[2] > 0.0

    @property
    def whole(self) -> Part:
        """The part as it is where no others take any of its light."""
        return dataclasses.replace(self, hole=0.0, taken=NO_BEAM)

    @property
    def area(self) -> float:
        """Surface area [mm²]."""
        a, b = self.size
        match self.shape:
            case "rectangle":
                return a * b
            case "disk":
                return math.pi * a * a
            case "hemisphere":
                return 2 * math.pi * a * a
            case "tube":
                return 2 * math.pi * a * b

    @property
    def sides(self) -> tuple[float, float]:
        """Lengths of the sides of the chart [mm]; of disks and hemispheres those of the square of their area."""
        a, b = self.size
        if self.shape == "rectangle":
            return a, b
        return (2 * math.pi * a, b) if self.shape == "tube" else (math.sqrt(self.area),) * 2

    @property
    def etendue(self) -> float:
        """That of all light that can leave the part on one side within its beam, π · radius² · area [mm² sr]."""
        return math.pi * self.beam[2] ** 2 * self.area

    def core(self) -> _core._Part:
        """The part as the compiled core takes it."""
        x, y, z = self.axes
        return {
            "shape": self.shape,
            "centre": self.centre,
            "x": x,
            "y": y,
            "z": z,
            "size": self.size,
            "focus": self.focus,
            "beam": self.beam,
        }


def triple(values: npt.ArrayLike) -> Triple:
    """Three coordinates as a part takes them, numbers of Python.

    Examples
    --------
    >>> triple(np.eye(3)[1])
    (0.0, 1.0, 0.0)
    """
    x, y, z = (float(v) for v in np.asarray(values))
    return (x, y, z)
