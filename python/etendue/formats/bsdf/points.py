"""Single directions of a measurement: the grid that they make, or the part of the hemisphere that each stands for."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LATTICE = 20_000
"""Points of the hemisphere, even in projected solid angle, that are given to the nearest direction."""


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
