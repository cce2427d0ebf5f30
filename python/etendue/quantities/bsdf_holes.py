"""Values of a grid of a BSDF that were not measured: what stands there instead, and how much of the light that is."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

WIDE = 180.0
"""Gap between measured azimuths [°] from which on nothing is interpolated between them."""

NARROW, FAR = 1e-6, 1e9
"""Least gap between measured values, and that to where none is [°]."""


@dataclasses.dataclass(frozen=True, eq=False)
class Filled:
    """A grid without holes.

    Parameters
    ----------
    values : array, shape (m, n)
        NaN if nothing at all is known.
    between : array of bool, shape (m, n)
        Which of them were not measured and are interpolated between those that were.

    Examples
    --------
    >>> Filled(np.array([[1.0, 0.5, 0.25]]), np.array([[False, True, False]])).between.sum()
    np.int64(1)
    """

    values: Array
    between: Bools


def filled(values: Array, radial: Array, azimuth: Array, within: Bools, *, degrees: bool) -> Filled:
    """Values of a polar grid of f with those that were not measured interpolated between those that were.

    Between measured values along an azimuth, and through the pole to the opposite azimuth, ln f is linear in the radial
    coordinate (f, where one of the two is not above 0). So it is around the pole between measured azimuths less than `WIDE`
    apart. Of both the mean counts, each weighted by the inverse square of its gap. Beyond the last value of an azimuth f is
    that of the last.

    Parameters
    ----------
    values : array, shape (m, n)
        NaN: not measured.
    radial, azimuth : array
        Coordinates [°], azimuths increasing by at most a turn; of direction cosines the radial one has no unit.
    within : array of bool, shape (m, n)
        Which places are directions at all; the others continue the last before them.
    degrees : bool
        Whether the radial coordinate is an angle.

    Examples
    --------
    >>> hole = np.array([[1.0, np.nan, 0.01, np.nan]])
    >>> there = np.ones((1, 4), bool)
    >>> found = filled(hole, np.array([0.0, 1.0, 2.0, 3.0]), np.zeros(1), there, degrees=True)
    >>> found.values.round(9).tolist(), found.between.tolist()
    ([[1.0, 0.1, 0.01, 0.01]], [[False, True, False, False]])
    """
    known = within & ~np.isnan(values)
    if known.all() or not known.any():
        return Filled(np.where(known, values, np.nan), np.zeros(values.shape, bool))
    turning = _turning(azimuth)
    table = np.where(known, values, np.nan)
    sines = np.sin(np.radians(radial)) if degrees else radial
    along, gap_along = _along(table, radial, azimuth)
    around, gap_around = _around(table, azimuth, turning)
    # A step around the pole, in the unit of the radial coordinate.
    gap_around = gap_around * (sines if degrees else np.radians(1.0) * radial)
    one, other = (
        np.where(np.isnan(f), 0.0, np.maximum(gap, NARROW) ** -2.0)
        for f, gap in ((along, gap_along), (around, gap_around))
    )
    mean = _mixed(along, around, np.divide(other, one + other, out=np.zeros_like(one), where=one + other > 0.0))
    between = within & ~known & ~np.isnan(mean)
    table = np.where(between, mean, table)
    # Where nothing stands on both sides: the last before it, or the first after it.
    held = _held(table)
    empty: Bools = np.asarray(np.isnan(held).all(axis=1))
    if empty.any():
        held = np.where(empty[:, None], _nearest_rows(held, empty, azimuth, turning), held)
    return Filled(held, between)


def _turning(azimuth: Array) -> bool:
    """Whether the last azimuth is the first a turn later."""
    return azimuth.size > 1 and float(np.ptp(azimuth)) == 360.0


def _mixed(one: Array, other: Array, part: Array) -> Array:
    """A part of the way from one to the other, by logarithms where both are above 0; where one is NaN, the other."""
    both = ~(np.isnan(one) | np.isnan(other))
    with np.errstate(invalid="ignore", divide="ignore"):
        straight = (1.0 - part) * one + part * other
        bent = np.exp((1.0 - part) * np.log(one) + part * np.log(other))
    found = np.where((one > 0.0) & (other > 0.0), bent, straight)
    return np.asarray(np.where(both, found, np.where(np.isnan(one), other, one)))


def _ends(known: Bools) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Of each place in rows: the last known at or before it, −1 if there is none; the first at or after it, n if none."""
    n = known.shape[1]
    at = np.arange(n)
    before = np.maximum.accumulate(np.where(known, at, -1), axis=1)
    after = np.minimum.accumulate(np.where(known, at, n)[:, ::-1], axis=1)[:, ::-1]
    return before, after


def _along(table: Array, radial: Array, azimuth: Array) -> tuple[Array, Array]:
    """F between values of the same azimuth, or of this and the opposite one through the pole, and the width of the gap."""
    m, n = table.shape
    known = ~np.isnan(table)
    before, after = _ends(known)
    low, high = np.maximum(before, 0), np.minimum(after, n - 1)
    f_low, f_high = np.take_along_axis(table, low, axis=1), np.take_along_axis(table, high, axis=1)
    x_low, x_high = radial[low], radial[high]
    # Through the pole lies the opposite azimuth, or what is between the two that are nearest to it.
    pole, reach = _at_the_pole(table, radial, azimuth)
    leading = before < 0
    f_low = np.where(leading, pole, f_low)
    x_low = np.where(leading, 0.0, x_low)
    gap = np.where(leading, reach[:, None], x_high - x_low)
    f_low = np.where(after >= n, np.nan, f_low)
    width = x_high - x_low
    part = np.divide(radial - x_low, width, out=np.zeros((m, n)), where=width > 0.0)
    f_high = np.where((after >= n) | np.isnan(f_low), np.nan, f_high)
    return _mixed(f_low, f_high, part), gap


def _at_the_pole(table: Array, radial: Array, azimuth: Array) -> tuple[float, Array]:
    """F at the pole, the mean of the lines through it from azimuth to azimuth, and how long each of these is."""
    known = ~np.isnan(table)
    lit = known.any(axis=1)
    first = np.argmax(known, axis=1)
    start, f = radial[first], np.take_along_axis(table, first[:, None], axis=1)[:, 0]
    apart = np.abs((azimuth[:, None] - azimuth[None, :] + 180.0) % 360.0 - 180.0)
    apart[:, ~lit] = -1.0
    opposite = np.argmax(apart, axis=1)
    length = start + start[opposite]
    rows = np.flatnonzero(lit)
    at_pole = np.flatnonzero(lit & (start == 0.0))
    if at_pole.size:
        return float(f[at_pole].mean()), np.where(lit, start, FAR)
    part = start[rows] / length[rows]
    lines = _mixed(f[rows], f[opposite[rows]], part)
    pole = float(np.exp(np.log(lines).mean())) if (lines > 0.0).all() else float(lines.mean())
    return pole, np.where(lit, length, FAR)


def _around(table: Array, azimuth: Array, turning: bool) -> tuple[Array, Array]:
    """F between values of the same radial coordinate at azimuths on both sides, and the gap between these [°]."""
    nothing = np.full(table.shape, np.nan)
    if azimuth.size < 3:
        return nothing, np.full(table.shape, FAR)
    ring, angle = (table[:-1], azimuth[:-1]) if turning else (table, azimuth)
    m = angle.size
    thrice = np.concatenate([angle - 360.0, angle, angle + 360.0])
    rows = np.concatenate([ring, ring, ring]).T
    before, after = _ends(~np.isnan(rows))
    before, after = before[:, m : 2 * m], after[:, m : 2 * m]
    lit = (before >= 0) & (after < 3 * m)
    low, high = np.maximum(before, 0), np.minimum(after, 3 * m - 1)
    gap = np.where(lit, thrice[high] - thrice[low], FAR)
    part = np.divide(angle - thrice[low], gap, out=np.zeros(gap.shape), where=(gap > 0.0) & lit)
    f_low, f_high = np.take_along_axis(rows, low, axis=1), np.take_along_axis(rows, high, axis=1)
    found = np.where(gap < WIDE, _mixed(f_low, f_high, part), np.nan).T
    gap = gap.T
    return (np.vstack([found, found[:1]]), np.vstack([gap, gap[:1]])) if turning else (found, gap)


def _held(table: Array) -> Array:
    """The last value before each place, or the first after it; rows without any stay NaN."""
    n = table.shape[1]
    before, after = _ends(~np.isnan(table))
    at = np.where(before >= 0, before, np.minimum(after, n - 1))
    return np.asarray(np.take_along_axis(table, at, axis=1))


def _nearest_rows(held: Array, empty: Bools, azimuth: Array, turning: bool) -> Array:
    """Rows at azimuths where nothing was measured: between those on both sides, however far apart they are."""
    lit = np.flatnonzero(~empty)
    if turning:
        lit = lit[azimuth[lit] < azimuth[-1]] if lit.size > 1 else lit
    angle = np.concatenate([azimuth[lit] - 360.0, azimuth[lit], azimuth[lit] + 360.0])
    above = np.searchsorted(angle, azimuth, side="right")
    below = np.clip(above - 1, 0, angle.size - 1)
    above = np.clip(above, 0, angle.size - 1)
    width = angle[above] - angle[below]
    part = np.divide(azimuth - angle[below], width, out=np.zeros(azimuth.size), where=width > 0.0)
    return _mixed(held[lit[below % lit.size]], held[lit[above % lit.size]], np.broadcast_to(part[:, None], held.shape))
