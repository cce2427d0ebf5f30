"""Single directions of a measurement: the grid that they make, or the part of the hemisphere that each stands for."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_data import BsdfSlice, PolarGrid, direction, light_from

Array = npt.NDArray[np.float64]

LATTICE = 20_000
"""Points of the hemisphere, even in projected solid angle, that are given to the nearest direction."""

SAME = 1e-4
"""Angles of incidence that differ by less are one [°]."""


def slices_of(
    angles: Array, values: Array, *, wavelength: float | None = None, errors: Array | None = None
) -> list[BsdfSlice]:
    """A slice for each incidence and way of single measured directions.

    Parameters
    ----------
    angles : array, shape (n, 4)
        θ and φ of the incident and of the scattered direction [°], both away from the surface; θ beyond 90° is behind it.
    values : array, shape (n,)
        f [1/sr]; values below 0 become 0.
    wavelength : float, optional
        In nm.
    errors : array, shape (n,), optional
        Standard errors of the values [1/sr].

    Returns
    -------
    list of BsdfSlice
        On a grid about the normal where the directions make one, else points that stand for what is nearest to them.
    """
    found = []
    of = np.round(angles[:, :2] / SAME)
    for key in np.unique(of, axis=0):
        own = (np.abs(of - key) < 2.0).all(axis=1)
        theta, phi = angles[np.flatnonzero(own)[0], :2]
        behind = bool(theta > 90.0)
        incident = light_from(180.0 - theta if behind else theta, phi, behind=behind)
        for transmitted in (False, True):
            below = behind != transmitted
            there = own & ((angles[:, 2] > 90.0) == below)
            if not there.any():
                continue
            polar, azimuth = angles[there, 2], angles[there, 3]
            polar = 180.0 - polar if below else polar
            f = np.maximum(values[there], 0.0)
            grid = on_grid(polar, azimuth, f)
            if grid is not None:
                radial, around, table = grid
                error = None if errors is None else on_grid(polar, azimuth, errors[there])
                at = PolarGrid("normal", radial, around)
                known = None if error is None else error[2]
                one = BsdfSlice(incident, table, transmitted, grid=at, wavelength=wavelength, standard_error=known)
            else:
                points = direction(polar, azimuth, behind=below)
                projected = projected_solid_angles(points)
                one = BsdfSlice(
                    incident,
                    f,
                    transmitted,
                    points=points,
                    projected=projected,
                    wavelength=wavelength,
                    standard_error=None if errors is None else errors[there],
                )
            found.append(one)
    return found


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
        apart = np.sum((beta[start : start + step, None] - points[:, :2]) ** 2, axis=-1)
        np.add.at(counts, apart.argmin(axis=1), 1.0)
    return np.asarray(counts * (math.pi / LATTICE))
