"""Flat carrier surfaces that emit towards any direction: turned from +Z about the origin, by the shortest way."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import Part, Triple, triple
from etendue.quantities.ray_set import RaySet

FloatArray = npt.NDArray[np.float64]

DIGITS = 6
"""Of a direction that is found: written out and read again, it is the same."""


def checked_towards(towards: Triple | None, kind: str) -> Triple | None:
    """The direction, None for +Z itself.

    Raises
    ------
    ArgumentError
        If it has no length.

    Examples
    --------
    >>> checked_towards((0.0, 0.0, 2.0), "Disk"), checked_towards((3.0, 0.0, 0.0), "Disk")
    (None, (3.0, 0.0, 0.0))
    """
    if towards is None:
        return None
    if not any(towards):
        raise ArgumentError(f"{kind}: towards is {towards!r}, which has no length; give a direction, e.g. (1, 0, 0).")
    return None if towards[0] == towards[1] == 0.0 < towards[2] else towards


def shortest_turn(towards: Triple) -> tuple[Triple, float]:
    """Axis and angle [°] of the shortest rotation that takes +Z to a direction; to -Z about X.

    Examples
    --------
    >>> shortest_turn((3.0, 0.0, 0.0)), shortest_turn((0.0, 0.0, -1.0))
    (((0.0, 1.0, 0.0), 90.0), ((1.0, 0.0, 0.0), 180.0))
    """
    x, y, z = towards
    across = math.hypot(x, y)
    axis = (-y / across + 0.0, x / across, 0.0) if across > 0.0 else (1.0, 0.0, 0.0)
    return axis, math.degrees(math.atan2(across, z))


def upright(rays: RaySet, towards: Triple) -> RaySet:
    """The rays as they are for whoever looks along `towards` as others do along +Z.

    Examples
    --------
    >>> upright(RaySet([[5, 2, 1]], [[1, 0, 0]], [1.0]), (1, 0, 0)).position.round(9).tolist()
    [[-1.0, 2.0, 5.0]]
    """
    axis, angle = shortest_turn(towards)
    return rays.rotated(axis, -angle)


def turned(part: Part, towards: Triple | None) -> Part:
    """A part of a surface that emits towards +Z, as one of the surface that emits towards another direction.

    Examples
    --------
    >>> from etendue.lightfield.carrier.part import WORLD
    >>> part = turned(Part("disk", "disk", (0, 2, 5), WORLD, (1.0, 0.0)), (1.0, 0.0, 0.0))
    >>> part.centre, part.axes[2]
    ((5.0, 2.0, 0.0), (1.0, 0.0, 0.0))
    """
    if towards is None:
        return part
    rotation = _matrix(towards)
    x, y, z = (triple(rotation @ np.array(axis)) for axis in part.axes)
    return dataclasses.replace(part, centre=triple(rotation @ np.array(part.centre)), axes=(x, y, z))


def _matrix(towards: Triple) -> FloatArray:
    """The rotation as a matrix: with k the unit vector, v = ẑ × k and c = kz it is c + [v]ₓ + v vᵀ/(1 + c)."""
    x, y, z = np.array(towards) / math.hypot(*towards)
    if x == y == 0.0:
        return np.diag([1.0, math.copysign(1.0, z), math.copysign(1.0, z)])
    # 1/(1 + c), which is (1 - c)/s²: whichever has not lost its digits.
    b = 1.0 / (1.0 + z) if z > 0.0 else (1.0 - z) / (x * x + y * y)
    rotation: FloatArray = np.array([[z + b * y * y, -b * x * y, x], [-b * x * y, z + b * x * x, y], [-x, -y, z]])
    return rotation


def direction_found(front: npt.ArrayLike) -> Triple | None:
    """A direction as it is stated where it was found, to `DIGITS`; None for +Z.

    Examples
    --------
    >>> direction_found([0.6, 1e-9, 0.8]), direction_found([1e-9, 0, 1.0])
    ((0.6, 0.0, 0.8), None)
    """
    x, y, z = triple(np.round(np.asarray(front, dtype=np.float64), DIGITS) + 0.0)
    return checked_towards((x, y, z), "direction")
