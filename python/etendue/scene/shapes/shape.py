"""What all shapes of surfaces share: they become one record for the core, cut to size by a trim."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Self

from annotated_types import MaxLen
from pydantic import Field, model_validator

from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.description.values import AsRow, Coordinate, Interval, Vector

Record = dict[str, Any]
Plane = tuple[float, float, float, float]

UNBOUNDED = (-math.inf, math.inf)


class HalfSpace(Description):
    """The points p with ``normal · p ≤ distance``, where `normal` counts as a unit vector.

    Parameters
    ----------
    normal : 3 numbers
        Points to the side that is cut away; of any length.
    distance : number
        From the local origin to the cut, along the normal [mm].

    Examples
    --------
    >>> HalfSpace(normal=(0, 0, 2), distance=5).plane()
    (0.0, 0.0, 1.0, 5.0)
    """

    normal: Vector
    distance: Coordinate = 0.0

    @model_validator(mode="after")
    def _is_a_direction(self) -> Self:
        if not 1e-150 < math.hypot(*self.normal) < 1e150:
            raise ValueError(f"'normal' is {list(self.normal)}, which is no direction")
        return self

    def plane(self) -> Plane:
        """Unit normal and distance."""
        length = math.hypot(*self.normal)
        x, y, z = (c / length for c in self.normal)
        return (x, y, z, self.distance)


class Trim(Description):
    """What is kept of a surface, in its local coordinates.

    Parameters
    ----------
    z : 2 numbers, optional
        Kept between these heights [mm]; ``inf`` leaves an end open.
    radius : 2 numbers, optional
        Kept between these distances from the local z axis [mm].
    half_spaces : sequence of HalfSpace
        Kept on the inner side of each.

    Examples
    --------
    >>> Trim(z=(0, 5)).z
    (0.0, 5.0)
    """

    z: Interval | None = None
    radius: Interval | None = None
    half_spaces: Annotated[tuple[HalfSpace, ...], MaxLen(64), AsRow] = Field(default=())

    @model_validator(mode="after")
    def _are_ranges(self) -> Self:
        for name in ("z", "radius"):
            value = getattr(self, name)
            if value is not None and not value[0] < value[1]:
                raise ValueError(f"{name!r} is {list(value)}; give the smaller limit first")
        if self.radius is not None and self.radius[0] < 0.0:
            raise ValueError(f"'radius' is {list(self.radius)}; a distance from the axis is not negative")
        return self

    def planes(self) -> list[Plane]:
        """The half spaces alone, as the core takes them."""
        return [half.plane() for half in self.half_spaces]

    def planes_of_z(self) -> list[Plane]:
        """The range of z as half spaces."""
        low, high = self.z or UNBOUNDED
        found: list[Plane] = []
        if high < math.inf:
            found.append((0.0, 0.0, 1.0, high))
        if low > -math.inf:
            found.append((0.0, 0.0, -1.0, -low))
        return found


WHOLE = Trim()


@dataclasses.dataclass(frozen=True)
class Sheet:
    """A surface as the core takes it: a shape, the half spaces that trim it, and what the user should know of it.

    Examples
    --------
    >>> Sheet({"kind": "flat", "outline": {"kind": "whole"}}).trims
    []
    """

    shape: Record
    trims: list[Plane] = dataclasses.field(default_factory=list)
    notes: tuple[str, ...] = ()


BESIDE_A_SHAPE = MappingProxyType({
    **dict.fromkeys(("at", "position", "centre", "center"), "the place beside the shape: at = {}"),
    **dict.fromkeys(("normal", "toward", "direction"), "the direction beside the shape: toward = {}"),
    "diameter": "a radius, which is half of {}",
})  # fmt: skip
"""What is meant by keys that shapes do not have."""


class Shape(Description, abc.ABC):
    """A shape of a surface without thickness, in local coordinates.

    Every kind has its field ``kind`` and says where its origin is and on which side its normal stands.
    """

    INSTEAD: ClassVar[Mapping[str, str]] = BESIDE_A_SHAPE

    @abc.abstractmethod
    def sheet(self, trim: Trim, files: Files) -> Sheet:
        """The shape, cut to size.

        Raises
        ------
        ArgumentError
            If nothing is left, or the shape cannot be cut like that.
        """


def is_bounded(shape: Record) -> bool:
    """Whether a shape, as the core takes it, has an end in all directions; half spaces do not count.

    Examples
    --------
    >>> is_bounded({"kind": "flat", "outline": {"kind": "whole"}})
    False
    """
    if shape["kind"] == "flat":
        return bool(shape["outline"]["kind"] != "whole")
    if shape["kind"] != "quadric" or shape["r"][1] < math.inf:
        return True
    r2, z2, z1, z0 = (shape[name] for name in ("r2", "z2", "z1", "z0"))
    # Far up and far down, r² = -(z2 z² + z1 z + z0)/r2 has the sign of its leading term; below 0 there is no surface.
    for end, sign in zip(shape["z"], (-1.0, 1.0), strict=True):
        leading = -(z2 or z1 * sign or z0) / r2
        if math.isinf(end) and leading > 0.0:
            return False
    return True


def overlap(own: tuple[float, float], other: tuple[float, float] | None) -> tuple[float, float]:
    """The part that two ranges have in common; empty ranges end before they begin.

    Examples
    --------
    >>> overlap((0, 5), (2, 9))
    (2, 5)
    """
    return own if other is None else (max(own[0], other[0]), min(own[1], other[1]))
