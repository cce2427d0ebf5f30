"""A pilot sample: some of a set's rays, enough to size a surface or to choose a grid."""

from __future__ import annotations

import weakref

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.arguments import require
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream, squares_hold

STRETCH = 256
"""Rays that are read in one piece. A file may be written source by source, or have what is odd at its end: many short pieces
hold of each part what is due to it."""

PLACES = 0x504C_4143
"""Seed of where in its part of the set each piece lies: a file may have a period."""

LOOKED_AT = 1 << 14
"""Rays whose lines tell how large the source is."""

FEWEST = 25
"""Rays below which no comparison means anything."""

SINGLE = 4e-7
"""Distance between lines, against that of their start points and coordinates, which single precision can make of nothing:
some roundings of 6e-8."""

SMALLEST = 1e-6
"""Radius [mm] below which no source is that emits light: a thousandth of a wavelength or so."""

ALMOST_ALL = 0.999
"""Share of the lines that must pass the point; the others are strays."""


_SAMPLES: weakref.WeakKeyDictionary[RaySet, float] = weakref.WeakKeyDictionary()
"""Pilot samples that exist, and selections from them: all of their rays carry flux, and none need be read again. Beside each
stands what share of the rays that were read for it carry flux."""


def pilot_sample(rays: RayStream, at_most: int) -> RaySet:
    """Up to `at_most` rays that carry flux, from pieces spread evenly over the set, in its own scale of flux.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux, or so little or so much that its squares are no numbers.

    Examples
    --------
    >>> import etendue as et
    >>> len(pilot_sample(et.RingSource(rays=100_000), 16_384)), len(pilot_sample(et.RingSource(rays=1000), 16_384))
    (16384, 1000)
    """
    require(rays, RayStream, "rays", "rays, of a file et.read_rays(path)")
    if not rays.has_position:
        raise ArgumentError("these rays have no positions (a far-field set), so no surface can carry them.")
    if isinstance(rays, RaySet) and len(rays) <= at_most and rays in _SAMPLES:
        return rays
    source, n = rays.core_source(), len(rays)
    pieces = max(at_most // STRETCH, 2)
    if n <= pieces * STRETCH:
        ends = [(0, n)] if n else []
    else:
        # One piece in each of as many equal parts of the set.
        parts_begin = np.arange(pieces) * n // pieces
        room = n // pieces - STRETCH + 1
        starts = parts_begin + np.random.default_rng(PLACES).integers(0, room, pieces)
        ends = [(start, start + STRETCH) for start in starts.tolist()]
    position, direction, flux = _core.read_pieces(source, ends)
    carry = flux > 0
    if carry.any():
        _check_squares(flux[carry], rays)
        kept = (position, direction, flux) if carry.all() else (position[carry], direction[carry], flux[carry])
        sample = RaySet(*kept, flux_unit=rays.flux_unit, provenance=rays.provenance)
        _SAMPLES[sample] = float(carry.mean())
        return sample
    raise ArgumentError("these rays carry no flux, so no light field can be fitted to them.")


def lit_rays(rays: RayStream, sample: RaySet) -> int:
    """About how many rays of a set carry flux, by a pilot sample of it: all of them exactly, if it read all.

    Examples
    --------
    >>> rays = RaySet([[0, 0, 0]] * 3, [[0, 0, 1]] * 3, [1.0, 0.0, 2.0])
    >>> lit_rays(rays, pilot_sample(rays, 1000))
    2
    """
    return len(rays) if sample is rays else round(len(rays) * _SAMPLES[sample])


def _check_squares(flux: npt.NDArray[np.float64], rays: RayStream) -> None:
    """Refuse fluxes whose squares, on which every error rests, are no numbers."""
    with np.errstate(over="ignore", under="ignore"):
        if squares_hold(float(np.square(flux).sum())):
            return
    raise ArgumentError(
        f"{rays.provenance.source}: its rays carry {flux.min():.4g} to {flux.max():.4g} {rays.flux_unit}, whose squares, on "
        "which errors rest, are no numbers; state another total flux: --flux, in Python rays.with_total_flux."
    )


def selected_rays(rays: RaySet, which: npt.NDArray[np.bool_]) -> RaySet:
    """Some of the rays of a set in memory, without their colours.

    Examples
    --------
    >>> rays = RaySet([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0, 1]], [1.0, 2.0])
    >>> selected_rays(rays, np.array([False, True])).flux.tolist()
    [2.0]
    """
    at = np.flatnonzero(which)
    selected = RaySet(rays.position[at], rays.direction[at], rays.flux[at], flux_unit=rays.flux_unit)
    if rays in _SAMPLES and len(at):
        _SAMPLES[selected] = 1.0
    return selected


def check_near_field(rays: RayStream) -> None:
    """Refuse rays whose lines all pass one point: they tell an intensity distribution, and no luminance.

    Such are files of a point source, and far-field data written as rays that start at one point or on a sphere about it.

    Raises
    ------
    ArgumentError
        If so, or if the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> check_near_field(et.RingSource(rays=1000))
    """
    some = pilot_sample(rays, LOOKED_AT)
    focus = some.virtual_focus
    if len(some) < FEWEST or not focus.determined:
        return
    point = np.array(focus.point)
    away = some.position - point
    off = float(np.quantile(np.linalg.norm(np.cross(away, some.direction), axis=1), ALMOST_ALL))
    reach = float(np.abs(away).max() + np.abs(some.position).max())
    if off > max(SINGLE * reach, SMALLEST):
        return
    place = ", ".join(f"{x:.4g}" for x in point + 0.0)
    raise ArgumentError(
        f"{rays.provenance.source}: the lines of its rays pass one point, ({place}) mm, to within {off:.1g} mm: the set "
        "has no near field, and a point has no finite luminance. Its intensity distribution is what it tells (etendue "
        "intensity); in a scene that can be the intensity of a source. For luminance ask for a ray file with positions."
    )


def even_density(rays: RaySet) -> float:
    """The density in étendue that is the same on all lines through a ball which all rays pass [1/(mm² sr)]: 1/(4 π² R²).

    The ball is the smallest about the virtual focus of the rays. The density depends on the rays alone, so that fields on
    different surfaces can be compared by what they say of rays that do not meet one of them.

    Examples
    --------
    >>> import etendue as et
    >>> cross = et.RaySet([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], [[0, 0, 1]] * 2 + [[0.6, 0, 0.8]] * 2, [1] * 4)
    >>> round(even_density(cross) * 4 * np.pi**2, 3)
    1.0
    """
    away = rays.position - np.array(rays.virtual_focus.point)
    radius = float(np.linalg.norm(np.cross(away, rays.direction), axis=1).max())
    least = SINGLE * float(np.abs(rays.position).max()) + SMALLEST
    return 1.0 / (4.0 * np.pi**2 * max(radius, least) ** 2)
