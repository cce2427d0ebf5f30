"""Rays drawn from patches, exactly: the inverse of the gridded algorithm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.lightfield.gridded.pixels import Array, Indices
from etendue.quantities.patches import AngularGrid, Patches

BATCH = 1 << 18
"""Rays drawn at once; those of batch k depend on (seed, k) alone."""

RECORD = np.dtype([("position", "<f8", (3,)), ("direction", "<f8", (3,)), ("flux", "<f8")])


def sampled_records(
    surface: PixelatedSurface, patches: Patches, flux: float, n: int, seed: int
) -> Iterator[npt.NDArray[Any]]:
    """Records of n rays of equal flux, batch by batch.

    A bilinear table is the sum of hat functions about its nodes. A ray chooses a node by the flux of its hat, then θ and φ
    from the hat: φ from the sum of two uniform numbers, θ by rejection against sin θ; and then a point of the pixel, by the
    cosine with which it sees the ray.

    Parameters
    ----------
    surface : PixelatedSurface
        What the patches are pixels of.
    patches : Patches
        At least one of them has light.
    flux : float
        Of all rays together.
    n : int
        Rays.
    seed : int
        0 to 2⁶⁴ - 1.
    """
    weight = np.zeros(len(patches.values))
    for _, chosen, solid_angle in patches.by_grid():
        for i in chosen:
            table = slice(patches.start[i], patches.start[i + 1])
            weight[table] = patches.values[table] * solid_angle
    up_to = np.cumsum(weight)
    for batch, start in enumerate(range(0, n, BATCH)):
        rng = np.random.Generator(np.random.Philox(key=np.array([seed, batch], dtype=np.uint64)))
        count = min(BATCH, n - start)
        # The largest number below 1 times the total may be rounded up to the total, beyond the last node.
        node = np.searchsorted(up_to, rng.random(count) * up_to[-1], side="right")
        node = np.minimum(node, np.flatnonzero(weight)[-1]) if node.max() == len(weight) else node
        patch = np.searchsorted(patches.start, node, side="right") - 1
        local = _directions(patches, patch, node - patches.start[patch], rng)
        axes = patches.axes[patch]
        records = np.zeros(count, dtype=RECORD)
        records["direction"] = np.einsum("mij,mi->mj", axes, local)
        records["position"] = surface.points_on(patches.pixel[patch], records["direction"], axes[:, 2], rng)
        records["flux"] = flux / n
        yield records


def _directions(patches: Patches, patch: Indices, node: Indices, rng: np.random.Generator) -> Array:
    """A direction from the hat function about a node of each patch, in the patch's axes."""
    turn = patches.phi_step[patch]
    row, column = np.divmod(node, 360 // turn)
    theta = np.zeros(len(patch))
    for step in np.unique(patches.theta_step[patch]):
        here = np.flatnonzero(patches.theta_step[patch] == step)
        theta[here] = _theta(AngularGrid(int(step), 360), row[here], rng)
    u, v = rng.random((2, len(patch)))
    phi = np.radians((column + u + v - 1.0) * turn)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def _theta(grid: AngularGrid, row: Indices, rng: np.random.Generator) -> Array:
    """θ [rad] with a density proportional to sin θ times the hat about row `row` of a grid."""
    nodes = np.radians(grid.theta)
    low, middle = nodes[np.maximum(row - 1, 0)], nodes[row]
    high = nodes[row + 1]
    result, open_ = np.zeros(len(row)), np.arange(len(row))
    pole = row == 0
    while open_.size:
        a, b, c, at_pole = low[open_], middle[open_], high[open_], pole[open_]
        # About the pole θ (1 - θ/Δθ), the median of three uniform numbers; elsewhere the hat itself.
        u = rng.random((4, open_.size))
        falling = u[0] * (c - a) > b - a
        hat = b + np.where(falling, c - b, a - b) * (1.0 - np.sqrt(u[1]))
        theta = np.where(at_pole, c * np.median(u[:3], axis=0), hat)
        bound = np.where(at_pole, theta, np.sin(c))
        taken = u[3] * bound < np.sin(theta)
        result[open_[taken]] = theta[taken]
        open_ = open_[~taken]
    return result
