"""The optional Pólya tree on an image, averaged over positions of its dyadic grid."""

from __future__ import annotations

import dataclasses
import math
from concurrent.futures import Executor

import numpy as np
import numpy.typing as npt

from etendue import _core

Array = npt.NDArray[np.float64]

CONCENTRATIONS = (1.0, 3.0, 10.0, 30.0)
"""Concentrations c of the Beta priors among which the evidence chooses."""

LATTICE = (0.7548776662466927, 0.5698402909980532)
"""Steps of the two-dimensional golden lattice, 1/g and 1/g² with g³ = g + 1: shifts spread evenly for any number of them."""


@dataclasses.dataclass(frozen=True, eq=False)
class TreeAverage:
    """What the trees find together.

    Parameters
    ----------
    mass : array, shape (rows, columns)
        Posterior mean, averaged over the positions; it adds up to the weight.
    variance : array, shape (rows, columns)
        Posterior variance at a single position, averaged over them.
    spread : array, shape (rows, columns)
        Variance of the single means about their average.
    """

    mass: Array
    variance: Array
    spread: Array


class ShiftedTrees:
    """Trees over images on one grid of cells.

    Parameters
    ----------
    base : array, shape (rows, columns)
        Relative measure of each cell.
    """

    def __init__(self, base: Array) -> None:
        self.base = base / base.sum()
        self.depths = [_depth(n) for n in base.shape]
        self.concentration = CONCENTRATIONS[0]

    def choose_concentration(self, weight: Array, weight_squared: Array, pool: Executor) -> None:
        """Use the concentration with the greatest evidence from now on."""
        rays, squared, base = (self._padded(values, (0, 0)) for values in (weight, weight_squared, self.base))
        evidence = list(
            pool.map(lambda c: _core.polya_evidence(self.depths, rays, squared, base, c, 1), CONCENTRATIONS)
        )
        self.concentration = CONCENTRATIONS[int(np.argmax(evidence))]

    def average(self, weight: Array, weight_squared: Array, shifts: int, pool: Executor) -> TreeAverage:
        """Average over this many positions of the dyadic grid."""

        def tree(corner: tuple[int, int]) -> tuple[Array, Array]:
            rays, squared, base = (self._padded(values, corner) for values in (weight, weight_squared, self.base))
            mean, square, _ = _core.polya_posterior(self.depths, rays, squared, base, self.concentration, 1)
            shape, window = [2**d for d in self.depths], self._window(corner)
            return mean.reshape(shape)[window], square.reshape(shape)[window]

        mean, mean_square, square = (np.zeros_like(weight) for _ in range(3))
        for first, second in pool.map(tree, self._corners(shifts)):
            mean += first / shifts
            mean_square += first**2 / shifts
            square += second / shifts
        total = weight.sum() * self.base
        return TreeAverage(
            mass=mean * total,
            variance=np.maximum(square - mean_square, 0.0) * total**2,
            spread=np.maximum(mean_square - mean**2, 0.0) * total**2,
        )

    def _window(self, corner: tuple[int, int]) -> tuple[slice, ...]:
        return tuple(slice(at, at + n) for at, n in zip(corner, self.base.shape, strict=True))

    def _padded(self, values: Array, corner: tuple[int, int]) -> Array:
        grid = np.zeros([2**d for d in self.depths])
        grid[self._window(corner)] = values
        return grid.ravel()

    def _corners(self, shifts: int) -> list[tuple[int, int]]:
        """Where the image lies in the grid, for each shift."""
        steps = np.outer(np.arange(shifts), LATTICE) % 1.0
        room = [2**d - n for d, n in zip(self.depths, self.base.shape, strict=True)]
        return [(int(a * (room[0] + 1)), int(b * (room[1] + 1))) for a, b in steps]


def _depth(n: int) -> int:
    """Halvings of a grid that holds n cells at more than one position."""
    return max(1, math.ceil(math.log2(n + 1))) if n > 1 else 0
