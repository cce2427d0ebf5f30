"""Three estimates of an image from its counts, each at its best where the others are not."""

from __future__ import annotations

import dataclasses
from concurrent.futures import Executor

import numpy as np

from etendue.denoising.directional_filters import DirectionalFrame, shrunk_rings
from etendue.denoising.fourier_plane import Array, FourierPlane, blurred
from etendue.denoising.shifted_trees import ShiftedTrees, TreeAverage

NAMES = ("tree", "edges", "rings")
"""What the estimates are called: tree average, filter along edges, shrunk rings of frequencies."""

LEAST = 0.1
"""A linear filter may undershoot beside a bright edge: it is given at least this fraction of the tree's value there."""

QUANTUM_WIDTH = 8.0
"""Width over which the flux of a typical ray is averaged [cells]."""


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates:
    """Masses that the three estimators find, each with the total that was counted.

    Parameters
    ----------
    masses : array, shape (3, rows, columns)
        In the order of `NAMES`.
    tree : TreeAverage
        The first of them, with its variances.
    edge_variance : array, shape (rows, columns)
        Variance of the second that its noise leaves, were its gains exact.
    """

    masses: Array
    tree: TreeAverage
    edge_variance: Array


class Estimator:
    """All that the counts of one image share.

    Parameters
    ----------
    trees : ShiftedTrees
        The tree average, its concentration chosen.
    base : array, shape (rows, columns)
        Relative measure of each cell; 0 where nothing can be.
    quantum : array, shape (rows, columns)
        Σ w² over Σ w, typical of each cell: the variance of a cell's weight is its mean times this.
    """

    def __init__(self, trees: ShiftedTrees, base: Array, quantum: Array) -> None:
        self.trees, self.base, self.quantum = trees, base, quantum
        self.supported = base > 0
        self.plane = FourierPlane((base.shape[0], base.shape[1]))
        self.frame = DirectionalFrame(self.plane)

    def __call__(self, weight: Array, weight_squared: Array, shifts: int, pool: Executor) -> Estimates:
        """Estimate the image from these sums, the tree at this many positions of its grid."""
        tree = self.trees.average(weight, weight_squared, shifts, pool)
        level = self.density(tree.mass)
        safe = np.where(self.supported, self.base, 1.0)
        noisy = np.where(self.supported, weight / safe, level)
        variance = np.where(self.supported, tree.mass * self.quantum / safe**2, 0.0)
        pilot = np.maximum(self.frame.filtered(noisy, variance, level, pool)[0], LEAST * level)
        edges, left = self.frame.filtered(noisy, variance, level, pool, pilot)
        rings = shrunk_rings(self.plane, noisy, variance, level)
        linear = [np.maximum(values, LEAST * level) * self.base for values in (edges, rings)]
        total = weight.sum()
        return Estimates(
            masses=np.array([tree.mass, *(mass * (total / mass.sum()) for mass in linear)]),
            tree=tree,
            edge_variance=left * self.base**2,
        )

    def density(self, mass: Array) -> Array:
        """Mass over base; cells without base go on as their surroundings do."""
        value = np.divide(mass, self.base, out=np.zeros_like(mass), where=self.supported)
        missing, width = ~self.supported, 1.0
        while missing.any():
            near = blurred(self.base, width)
            known = missing & (near > 1e-6 * self.base.max())
            value[known] = np.maximum(blurred(mass, width)[known], 0.0) / near[known]
            missing &= ~known
            width *= 2
        return value


def ray_quantum(weight: Array, weight_squared: Array) -> Array:
    """Σ w² over Σ w around each cell; far from all rays, that of the whole image."""
    far = 1e-6 / weight.size
    above, below = (
        np.maximum(blurred(sums, QUANTUM_WIDTH), 0.0) + far * sums.sum() for sums in (weight_squared, weight)
    )
    quantum: Array = above / below
    return quantum
