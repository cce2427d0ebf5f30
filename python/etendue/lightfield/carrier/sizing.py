"""How rays reach carrier surfaces, and how large a surface that is given without its dimensions has to be for them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.lightfield.carrier.part import FLAT, Focus, Triple
from etendue.lightfield.carrier.towards import upright
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

FloatArray = npt.NDArray[np.float64]

PILOT_RAYS = 1 << 18
"""Rays looked at to size a surface that was given without its dimensions."""

STRAY = 1e-4
"""Share of the rays, on each side, that a surface sized from the rays may leave out when they lie far off."""

SLACK = 1e-6
"""A surface sized from the rays is larger than they need by this factor, so that rounding loses none."""


def sizing_rays(rays: RayStream) -> RaySet:
    """Some of the rays, all of which carry flux.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> len(sizing_rays(et.RingSource(rays=1000)))
    1000
    """
    return pilot_sample(rays, PILOT_RAYS)


def hits_upwards(
    rays: RayStream, z: float, name: str, focus: Focus = FLAT, towards: Triple | None = None
) -> tuple[FloatArray, FloatArray]:
    """Places on a height, taken at its focus, of rays that head towards +Z [mm], shape (m, 2), and their flux, (m,).

    If a direction is given, it is upwards in place of +Z (see `etendue.lightfield.carrier.towards`).

    Raises
    ------
    ArgumentError
        If there are no such rays.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RaySet([[0, 0, 0], [0, 0, 0]], [[0.6, 0, 0.8], [0, 0, -1]], [1, 1])
    >>> hits_upwards(rays, 4.0, "Plane")[0].tolist()
    [[3.0, 0.0]]
    """
    some = sizing_rays(rays) if towards is None else upright(sizing_rays(rays), towards)
    up = np.flatnonzero(some.direction[:, 2] > 0)
    if not len(up):
        there = "+Z" if towards is None else towards
        raise ArgumentError(f"{name}: no ray heads towards {there}; turn the rays, or choose a sphere or cylinder.")
    x, k = some.position[up], some.direction[up]
    sharp = z + np.polynomial.polynomial.polyval(1.0 - k[:, 2], focus)
    hits: FloatArray = x[:, :2] + ((sharp - x[:, 2]) / k[:, 2])[:, None] * k[:, :2]
    return hits, np.asarray(some.flux, float)[up]


def span(values: FloatArray, centre: float | None) -> tuple[float, float]:
    """The interval that holds the values, shape (m,), but for strays far off: `STRAY` on each side.

    About a `centre` it is as long on both sides.

    Examples
    --------
    >>> span(np.array([1.0, 2.0, 4.0]), None), span(np.array([1.0, 2.0, 4.0]), 2.0)
    ((1.0, 4.0), (0.0, 4.0))
    """
    inner = np.quantile(values, [STRAY, 1 - STRAY])
    low, high = float(values.min()), float(values.max())
    if high - low > 1.5 * (inner[1] - inner[0]) > 0:
        low, high = float(inner[0]), float(inner[1])
    if centre is not None:
        half = max(high - centre, centre - low)
        low, high = centre - half, centre + half
    if high == low:  # all rays through one point: any extent will do
        low, high = low - 0.5e-3, high + 0.5e-3
    return low, high


def extent(values: FloatArray, flux: FloatArray, centre: float | None, size: float | None) -> tuple[float, float]:
    """Where along a line a surface lies that is for light at the values, shape (m,), with their flux, (m,).

    Of a stated `size` without a centre: where it holds the most light. Else the `span`.

    Examples
    --------
    >>> light = np.array([0.0, 1.0, 1.5, 9.0])
    >>> extent(light, np.ones(4), None, 2.0), extent(light, np.ones(4), None, None)
    ((-0.25, 1.75), (0.0, 9.0))
    """
    if centre is None and size is not None:
        middle = fullest(values, flux, size)
        return middle - size / 2, middle + size / 2
    return span(values, centre)


def fullest(values: FloatArray, flux: FloatArray, size: float) -> float:
    """The middle of the interval of length `size` that holds the most flux, of light at the values, shape (m,) each.

    The middle of what it holds, so that it lies evenly about a source that is smaller than it.

    Examples
    --------
    >>> fullest(np.array([0.0, 1.0, 1.5, 9.0]), np.ones(4), 2.0)
    0.75
    """
    order = np.argsort(values, kind="stable")
    place = values[order]
    upto = np.concatenate([[0.0], np.cumsum(flux[order])])
    end = np.searchsorted(place, place + size, side="right")
    first = int(np.argmax(upto[end] - upto[:-1]))
    return float(place[first] + place[end[first] - 1]) / 2


def radius_for(distances: FloatArray) -> float:
    """The radius that holds the distances [mm], shape (m,), but for strays far off, and a little more.

    Examples
    --------
    >>> round(radius_for(np.array([0.5, 2.0])), 4)
    2.0
    """
    inner = float(np.quantile(distances, 1 - STRAY))
    reach = float(distances.max())
    reach = inner if reach > 1.5 * inner > 0 else reach
    return (reach or 0.5e-3) * (1 + SLACK)


def sphere_radius(rays: RayStream, centre: Triple) -> float:
    """The radius of the sphere about `centre` that the rays' lines meet [mm], but for strays far off.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RaySet([[3, 0, 0], [0, 1, 5]], [[0, 0, 1], [0, 0, 1]], [1, 1])
    >>> round(sphere_radius(rays, (0, 0, 0)), 4)
    3.0
    """
    some = sizing_rays(rays)
    offset = some.position - np.asarray(centre)
    return radius_for(np.linalg.norm(np.cross(offset, some.direction), axis=1))
