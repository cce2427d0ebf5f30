"""Flat carrier surfaces that emit towards any direction: turned from +Z about the origin, by the shortest rotation."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import Part, Triple, triple
from etendue.quantities.ray_set import RaySet
from etendue.quantities.vectors import shortest_rotation

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


def upright(rays: RaySet, towards: Triple) -> RaySet:
    """The rays as they are for whoever looks along `towards` as others do along +Z, without their colours.

    Examples
    --------
    >>> upright(RaySet([[5, 2, 1]], [[1, 0, 0]], [1.0]), (1, 0, 0)).position.round(9).tolist()
    [[-1.0, 2.0, 5.0]]
    """
    rotation = shortest_rotation(towards)
    turned_back = rays.position @ rotation, rays.direction @ rotation
    return RaySet(*turned_back, rays.flux, flux_unit=rays.flux_unit, provenance=rays.provenance)


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
    rotation = shortest_rotation(towards)
    x, y, z = (triple(rotation @ np.array(axis)) for axis in part.axes)
    return dataclasses.replace(part, centre=triple(rotation @ np.array(part.centre)), axes=(x, y, z))


def direction_found(front: npt.ArrayLike) -> Triple | None:
    """A direction as it is stated where it was found, to `DIGITS`; None for +Z.

    Examples
    --------
    >>> direction_found([0.6, 1e-9, 0.8]), direction_found([1e-9, 0, 1.0])
    ((0.6, 0.0, 0.8), None)
    """
    x, y, z = triple(np.round(np.asarray(front, dtype=np.float64), DIGITS) + 0.0)
    return checked_towards((x, y, z), "direction")
