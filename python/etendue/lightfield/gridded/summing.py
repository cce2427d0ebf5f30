"""The far field of patches: their tables added up over all directions."""

from __future__ import annotations

import math

import numpy as np

from etendue.lightfield.gridded.pixels import Array
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import Nodes
from etendue.quantities.patches import Patches, interpolated

WORK = 1 << 24
"""Table look-ups that a distribution may cost: some two seconds."""

MOST_POINTS = 6
"""Points between two nodes, along C and along γ, that means are taken over, at most."""


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
        The mean around each node, weighted by its hat function, as `etendue.intensity_distribution` has it of rays.

    Raises
    ------
    ArgumentError
        If there are no such planes or steps.
    """
    nodes, rows = Nodes.even(c_planes, gamma_step), round(180.0 / gamma_step)
    tables = _added_up(patches)
    points = int(np.clip(math.isqrt(WORK // max(1, len(tables) * len(nodes))), 1, MOST_POINTS))
    # Midpoints of even steps in C and γ, a number of them between any two nodes.
    c: Array = (np.arange(points * c_planes, dtype=np.float64) + 0.5) * (2.0 * np.pi / (points * c_planes))
    gamma: Array = (np.arange(points * rows, dtype=np.float64) + 0.5) * (np.pi / (points * rows))
    direction = _directions(c, gamma)
    total = np.zeros(len(direction))
    for axes, theta_step, phi_step, table in tables:
        front = np.flatnonzero(direction @ axes[2] > 0.0)
        total[front] += interpolated(table, 0, theta_step, phi_step, np.einsum("mj,ij->mi", direction[front], axes))
    # Each point is a ray of its intensity and solid angle.
    weight = np.sin(gamma) * (np.pi / gamma.size) * (2.0 * np.pi / c.size)
    sums, solid_angle = np.zeros(len(nodes)), np.zeros(len(nodes))
    spare, count = np.zeros(len(nodes)), np.zeros(len(nodes), dtype=np.uint64)
    nodes.core().add(direction, (total.reshape(c.size, gamma.size) * weight).ravel(), sums, spare, count)
    nodes.core().add(direction, np.tile(weight, c.size), solid_angle, spare, count)
    values, _ = nodes.tables(sums[:-1] / solid_angle[:-1] * nodes.solid_angle, np.zeros(len(nodes) - 1))
    return Intensity(
        np.array(nodes.planes),
        np.array(nodes.table),
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


def _directions(c: Array, gamma: Array) -> Array:
    """Unit vectors for each C and each γ [rad]."""
    x, y = (np.outer(f(c), np.sin(gamma)) for f in (np.cos, np.sin))
    return np.stack([x, y, np.broadcast_to(np.cos(gamma), x.shape)], axis=-1).reshape(-1, 3)
