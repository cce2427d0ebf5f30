"""The far field of patches: their tables added up over all directions."""

from __future__ import annotations

import math
import operator

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.gridded.pixels import Array
from etendue.quantities.intensity import Intensity
from etendue.quantities.patches import Patches, interpolated

WORK = 1 << 24
"""Table look-ups that a distribution may cost: some two seconds."""

MOST_POINTS = 6
"""Points along each side of a cell over which a mean is taken, at most."""


def summed_intensity(patches: Patches, c_planes: int, gamma_step: float) -> Intensity:
    """Intensity of all patches together, as means over the cells around the nodes.

    Parameters
    ----------
    patches : Patches
        Tables in axes of their own.
    c_planes : int
        Half planes C, from 0° in equal steps.
    gamma_step : float
        [°], a whole part of 180.

    Returns
    -------
    Intensity
        The mean over each cell, by points of equal solid angle, as `etendue.intensity_distribution` has it of rays; a node
        at γ = 0° or 180° is the centre of a cap that all planes share.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps.
    """
    c_planes = operator.index(c_planes)
    rows = round(180.0 / gamma_step) if math.isfinite(gamma_step) and gamma_step > 0.0 else 0
    if c_planes < 1:
        raise ArgumentError(f"c_planes is {c_planes}; give 1 or more.")
    if rows < 2 or not math.isclose(rows * gamma_step, 180.0, rel_tol=1e-9):
        raise ArgumentError(f"gamma_step is {gamma_step}°; give a whole part of 180°, at most 90°.")
    tables = _added_up(patches)
    cells = c_planes * (rows + 1)
    points = int(np.clip(math.isqrt(WORK // max(1, len(tables) * cells)), 1, MOST_POINTS))
    direction = _directions(c_planes, rows, points)
    total = np.zeros(len(direction))
    for axes, theta_step, phi_step, table in tables:
        front = np.flatnonzero(direction @ axes[2] > 0.0)
        total[front] += interpolated(table, 0, theta_step, phi_step, np.einsum("mj,ij->mi", direction[front], axes))
    values = total.reshape(c_planes, points, rows + 1, points).mean(axis=(1, 3))
    values[:, [0, -1]] = values[:, [0, -1]].mean(axis=0)
    return Intensity(
        np.arange(c_planes, dtype=np.float64) * (360.0 / c_planes),
        np.linspace(0.0, 180.0, rows + 1),
        values,
        flux_unit=patches.flux_unit,
        provenance=patches.provenance.then(f"summed in {c_planes} planes, γ in steps of {gamma_step:.9g}°"),
    )


def _added_up(patches: Patches) -> list[tuple[Array, int, int, Array]]:
    """Axes, Δθ, Δφ and table for all patches with the same axes and steps: squares of one plane are few in this sense."""
    steps = np.stack([patches.theta_step, patches.phi_step], axis=1)
    kinds, kind = np.unique(np.concatenate([patches.axes.reshape(-1, 9), steps], axis=1), axis=0, return_inverse=True)
    result = []
    order = np.argsort(kind, kind="stable")
    for members in np.split(order, np.cumsum(np.bincount(kind))[:-1]):
        table = np.zeros(patches.start[members[0] + 1] - patches.start[members[0]])
        for i in members:
            table += patches.values[patches.start[i] : patches.start[i + 1]]
        first = int(members[0])
        result.append((patches.axes[first], int(steps[first, 0]), int(steps[first, 1]), table))
    assert len(result) == len(kinds)  # noqa: S101 - every kind has a member
    return result


def _directions(c_planes: int, rows: int, points: int) -> Array:
    """Unit vectors: for each plane and each of its points, for each γ the points of its cell, in equal solid angles."""
    within = (np.arange(points) + 0.5) / points
    c = (np.arange(c_planes)[:, None] - 0.5 + within) * (2 * np.pi / c_planes)
    edges = np.concatenate([[0.0], (np.arange(rows) + 0.5) * (np.pi / rows), [np.pi]])
    top, bottom = np.cos(edges[:-1]), np.cos(edges[1:])
    cosine = (top[:, None] + within * (bottom - top)[:, None]).ravel()
    sine = np.sqrt((1.0 - cosine) * (1.0 + cosine))
    x, y = (np.outer(f(c.ravel()), sine) for f in (np.cos, np.sin))
    return np.stack([x, y, np.broadcast_to(cosine, x.shape)], axis=-1).reshape(-1, 3)
