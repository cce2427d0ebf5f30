"""Single directions of a measurement: the grid that they make, or the part of the hemisphere that each stands for."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_directions import NORMAL, direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

LATTICE = 20_000
"""Points of the hemisphere, even in projected solid angle, that are given to the nearest direction."""

SAME = 1e-4
"""Angles of incidence that differ by less are one, and scattered directions [°]."""

RIM = 0.02
"""Angle to the surface [°] below which rounding decides on which side a scattered direction lies: f counts for both."""

IN_PLANE = 1e-3
"""Sine of the angle to the plane of incidence below which a direction lies in it."""

TURN = 15.0
"""Step of azimuth about the specular direction [°] of what was measured in one plane."""

SHARP, WIDE = 0.2, 5.0
"""Part of the largest f below which it has fallen at both neighbouring azimuths, and how far they are apart [°], if the grid
does not resolve a lobe."""


def slices_of(
    angles: Array,
    values: Array,
    complaints: list[Complaint],
    *,
    wavelength: float | None = None,
    errors: Array | None = None,
) -> list[BsdfSlice]:
    """A slice for each incidence and way of single measured directions.

    Parameters
    ----------
    angles : array, shape (n, 4)
        θ and φ of the incident and of the scattered direction [°], both away from the surface; θ beyond 90° is behind it.
        Of directions that stand there several times the mean counts.
    values : array, shape (n,)
        f [1/sr]. Values below 0 stay as they are, as noise about a dark level has them: they count in means and in shares.
    complaints : list of Complaint
        What is to be told is added to it.
    wavelength : float, optional
        In nm.
    errors : array, shape (n,), optional
        Standard errors of the values [1/sr].

    Returns
    -------
    list of BsdfSlice
        What was measured in the plane of incidence alone turns about the specular direction; else on a grid about the normal
        where the directions make one, else points that stand for what is nearest to them.
    """
    angles, values, errors, several = _merged(angles, values, errors)
    told = {one.found for one in complaints}
    if several and SEVERAL not in told:
        complaints.append(Complaint("note", "data", SEVERAL))
    found = []
    of = np.round(angles[:, :2] / SAME)
    for key in np.unique(of, axis=0):
        own = (np.abs(of - key) < 2.0).all(axis=1)
        theta, phi = angles[np.flatnonzero(own)[0], :2]
        behind = bool(theta > 90.0)
        incident = light_from(180.0 - theta if behind else theta, phi, behind=behind)
        rim = np.abs(angles[:, 2] - 90.0) < RIM
        for transmitted in (False, True):
            below = behind != transmitted
            there = own & ~rim & ((angles[:, 2] > 90.0) == below)
            if not there.any():
                continue
            there |= own & rim
            polar, azimuth = angles[there, 2], angles[there, 3]
            polar = np.minimum(180.0 - polar if below else polar, 90.0)
            error = None if errors is None else errors[there]
            one = slice_of(incident, polar, azimuth, values[there], transmitted, wavelength=wavelength, errors=error)
            if one is None:
                points = direction(polar, azimuth, behind=below)
                one = BsdfSlice(
                    incident,
                    values[there],
                    transmitted,
                    points=points,
                    projected=projected_solid_angles(points),
                    wavelength=wavelength,
                    standard_error=error,
                )
            complaints += [each for each in doubts(one) if str(each) not in map(str, complaints)]
            found.append(one)
    return found


def below_zero(values: Array, place: str = "values") -> list[Complaint]:
    """What is to be told of values below 0, if there are any; NaN where nothing was measured.

    Every reader keeps them: taken for 0 they would leave the mean of the noise of a dark sample, more light than there is.

    Examples
    --------
    >>> print(*below_zero(np.array([0.2, -0.1, 0.3])))
    note: values: 1 of 3 below 0, down to -0.1, as noise about a dark level may be; they count in the share of the light
    """
    count = int((values < 0.0).sum())
    if not count:
        return []
    found = f"{count} of {values.size} below 0, down to {np.nanmin(values):.3g}, as noise about a dark level may be"
    return [Complaint("note", place, f"{found}; they count in the share of the light")]


SEVERAL = "directions that stand there several times, as for two polarisations, became their mean"


def _merged(angles: Array, values: Array, errors: Array | None) -> tuple[Array, Array, Array | None, bool]:
    """Each direction once, with the mean of its values."""
    place = np.round(angles / SAME) % np.array([np.inf, 360.0 / SAME, np.inf, 360.0 / SAME])
    _, first, of = np.unique(place, axis=0, return_index=True, return_inverse=True)
    of = of.ravel()
    count = np.bincount(of)
    mean = np.bincount(of, values) / count
    # Uncertainties of an instrument are mostly common to all values: they do not fall with the number of these.
    error = None if errors is None else np.bincount(of, errors) / count
    return angles[first], mean, error, bool(count.max() > 1)


def slice_of(
    incident: Array,
    polar: Array,
    azimuth: Array,
    values: Array,
    transmitted: bool,
    *,
    wavelength: float | None = None,
    errors: Array | None = None,
) -> BsdfSlice | None:
    """A slice on a grid, of directions on one side by their angles [°]; None if they make none."""
    plane = _in_plane(incident, polar, azimuth, transmitted=transmitted)
    if plane is not None:
        at, row = plane
        known = None if errors is None else row(errors)
        return BsdfSlice(
            incident,
            row(values),
            transmitted,
            grid=at,
            wavelength=wavelength,
            standard_error=known,
            interpolated=True,
        )
    grid = on_grid(polar, azimuth, values)
    if grid is None:
        return None
    radial, around, table = grid
    error = None if errors is None else on_grid(polar, azimuth, errors)
    return BsdfSlice(
        incident,
        table,
        transmitted,
        grid=PolarGrid("normal", radial, around),
        wavelength=wavelength,
        standard_error=None if error is None else error[2],
    )


def _in_plane(
    incident: Array, polar: Array, azimuth: Array, *, transmitted: bool
) -> tuple[PolarGrid, Callable[[Array], Array]] | None:
    """A grid about the specular direction for oblique light whose directions all lie in its plane, and values on it.

    On each side f is linear in |β − β₀|, and between them in the azimuth about β₀: polished surfaces and rough ones scatter
    alike all around in direction cosines. Beyond the last direction of one side it is that of the other.
    """
    across = float(np.hypot(*incident[:2]))
    if across < np.radians(NORMAL) or polar.size < 2:
        return None
    points = direction(polar, azimuth, behind=(incident[2] > 0.0) == transmitted)
    if np.abs(points[:, 0] * incident[1] - points[:, 1] * incident[0]).max() > IN_PLANE * across:
        return None
    # Along the plane, onwards from the specular direction.
    x, first = np.unique(np.round(-points[:, :2] @ incident[:2] / across - across, 9), return_index=True)
    middle = [0.0] if x[0] < 0.0 < x[-1] else []
    grid = PolarGrid("cosines", np.unique([*np.abs(x), *middle]), np.arange(0.0, 360.0, TURN))
    beyond = np.isnan(grid.directions(incident, transmitted=transmitted)[..., 0])
    back = np.abs(grid.azimuth[:, None] - 180.0)

    def row(values: Array) -> Array:
        sides = [np.interp(way * grid.radial, x, values[first], left=np.nan, right=np.nan) for way in (1.0, -1.0)]
        on, returning = (np.where(np.isnan(one), other, one) for one, other in (sides, sides[::-1]))
        return np.where(beyond, np.nan, (back * on + (180.0 - back) * returning) / 180.0)

    return grid, row


def doubts(one: BsdfSlice) -> list[Complaint]:
    """What is to be told of a slice on a grid: that it was measured in one plane, or does not resolve its lobe."""
    grid, place = one.grid, f"{one.theta:g}° of incidence"
    if grid is None or one.theta < NORMAL:
        return []
    if grid.frame == "cosines":
        found = "measured in the plane of incidence alone: outside it f is that at the same |β − β₀|"
        return [Complaint("note", place, found)]
    k, i = np.unravel_index(int(np.nanargmax(one.values)), grid.shape)
    beside = float(np.nan_to_num(one.values[[k - 1, (k + 1) % grid.azimuth.size], i], nan=np.inf).max())
    step = min(np.diff(np.append(grid.azimuth, grid.azimuth[0] + 360.0))[[k - 1, k]])
    apart = float(step * np.sin(np.radians(grid.radial[i])))
    if grid.azimuth.size < 2 or apart < WIDE or beside >= SHARP * float(one.values[k, i]):
        return []
    found = f"azimuths {step:g}° apart do not resolve the lobe: f is linear between them, and its share too large"
    return [Complaint("warning", place, found)]


def on_grid(polar: Array, azimuth: Array, values: Array) -> tuple[Array, Array, Array] | None:
    """Polar angles [°], azimuths [°] and values of shape (azimuths, polar angles); NaN where there is none.

    Along the normal all azimuths are one direction. None if fewer than half of the directions of the grid are there, or
    azimuths span more than a turn.
    """
    polar, azimuth = np.round(polar, 7), np.round(azimuth, 7)
    off = polar > 0.0
    radial, around = np.unique(polar), np.unique(azimuth[off] if off.any() else azimuth)
    there = int(off.sum()) + around.size * int((~off).any())
    if np.ptp(around) > 360.0 or 2 * there < radial.size * around.size:
        return None
    grid = np.full((around.size, radial.size), np.nan)
    grid[np.searchsorted(around, azimuth[off]), np.searchsorted(radial, polar[off])] = values[off]
    if (~off).any():
        grid[:, 0] = values[~off].mean()
    if np.ptp(around) == 360.0:
        around, grid = around[:-1], grid[:-1]
    return radial, around, grid


def projected_solid_angles(points: Array) -> Array:
    """Of each direction on one side, shape (n, 3), the part of π sr that is nearest to it in direction cosines [sr]."""
    k = np.arange(LATTICE)
    r, a = np.sqrt((k + 0.5) / LATTICE), k * math.pi * (3.0 - math.sqrt(5.0))
    beta = np.column_stack([r * np.cos(a), r * np.sin(a)])
    counts = np.zeros(len(points))
    step = max(1, (1 << 22) // len(points))
    for start in range(0, LATTICE, step):
        x, y = (beta[start : start + step, None, axis] - points[:, axis] for axis in (0, 1))
        counts += np.bincount((x * x + y * y).argmin(axis=1), minlength=len(points))
    return np.asarray(counts * (math.pi / LATTICE))
