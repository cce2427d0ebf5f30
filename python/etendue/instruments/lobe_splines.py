"""A lobe in two dimensions as a sum of cubic B-splines in direction cosines, finer where positions are denser."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

COARSER = 3
"""Times the cells of a level are as wide as those of the level before."""

DENSE = 1.6
"""Times a step up to which positions are dense enough for the splines of that step."""


@dataclasses.dataclass(frozen=True, eq=False)
class Level:
    """Splines of one size on an even grid in direction cosines.

    Parameters
    ----------
    origin : array, shape (2,)
        Projection of the regular direction on the surface.
    size : array, shape (2,)
        Of the cells: in the plane of incidence and across it.
    low : (int, int)
        Numbers of the first splines along both, 0 being at the origin.
    number : array of int, shape (m, n)
        Of each spline among all unknowns; −1: there is none.
    """

    origin: Array
    size: Array
    low: tuple[int, int]
    number: Index

    def splines(self, beta: Array) -> tuple[Index, Array]:
        """Numbers of the 16 splines that are not 0 at each of n points, −1 where there is none, and their values."""
        at = (beta - self.origin) / self.size
        cell = np.floor(at).astype(np.intp)
        u = at - cell
        x, y = _cubic(u[:, 0]), _cubic(u[:, 1])
        # Four cells all around have no splines: what lies farther off is as far off as that.
        around = np.pad(self.number, 4, constant_values=-1)
        i, j = (
            np.clip(cell[:, k] - 1 - self.low[k], -4, self.number.shape[k])[:, None] + np.arange(4, 8) for k in (0, 1)
        )
        numbers = around[i[:, :, None], j[:, None, :]]
        values = np.stack(x, axis=1)[:, :, None] * np.stack(y, axis=1)[:, None, :]
        return numbers.reshape(-1, 16), values.reshape(-1, 16)

    def nodes(self, margin: int = 0) -> Array:
        """Middles of all splines of the grid and of a margin around it, shape (m, n, 2)."""
        m, n = (size + 2 * margin for size in self.number.shape)
        i, j = np.meshgrid(np.arange(m) + self.low[0] - margin, np.arange(n) + self.low[1] - margin, indexing="ij")
        return np.asarray(self.origin + np.stack([i, j], axis=-1) * self.size)


def _cubic(u: Array) -> tuple[Array, Array, Array, Array]:
    """Values of four neighbouring cubic B-splines between the second and third; none is below 0, their sum is 1."""
    v = 1.0 - u
    return v**3 / 6.0, (3.0 * u**3 - 6.0 * u**2 + 4.0) / 6.0, (3.0 * v**3 - 6.0 * v**2 + 4.0) / 6.0, u**3 / 6.0


@dataclasses.dataclass(frozen=True, eq=False)
class LobeSplines:
    """F [1/sr] at one incidence as a sum of B-splines.

    Parameters
    ----------
    levels : tuple of Level
        From fine to coarse.
    behind : bool
        Whether light goes to the other side.
    count : int
        Of splines.
    """

    levels: tuple[Level, ...]
    behind: bool
    count: int

    def rows(self, beta: Array) -> tuple[Index, Array]:
        """Numbers (−1: none) and values of all splines that are not 0 at n points, shape (n, 16 · levels)."""
        parts = [level.splines(beta) for level in self.levels]
        return np.concatenate([p[0] for p in parts], axis=1), np.concatenate([p[1] for p in parts], axis=1)

    def evaluate(self, weights: Array, directions: npt.ArrayLike) -> Array:
        """F [1/sr] at directions of shape (…, 3), NaN where no scan says anything; `weights` of shape (m,) or (m, k)."""
        d = np.asarray(directions, np.float64)
        flat = d.reshape(-1, 3)
        numbers, values = self.rows(flat[:, :2])
        there = numbers >= 0
        found = np.einsum("ns,ns...->n...", np.where(there, values, 0.0), weights[np.maximum(numbers, 0)])
        # Between splines that are there and others that are not, the sum falls to 0 without meaning it.
        known = np.zeros(len(flat), bool)
        for k in range(len(self.levels)):
            known |= there[:, 16 * k : 16 * (k + 1)].all(axis=1)
        found[~known] = np.nan
        return np.asarray(found.reshape(d.shape[:-1] + weights.shape[1:]))

    def matrix(self, directions: Array) -> Any:
        """From weights to f at directions of shape (n, 3): a sparse matrix."""
        numbers, values = self.rows(directions[:, :2])
        there = numbers >= 0
        rows = np.broadcast_to(np.arange(len(numbers))[:, None], numbers.shape)
        entries = (values[there], (rows[there], numbers[there]))
        return scipy_part("sparse").csr_array(entries, shape=(len(numbers), self.count))

    def only(self, kept: npt.NDArray[np.bool_]) -> LobeSplines:
        """Those of `kept`, shape (count,), under new numbers."""
        renumbered = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1)
        levels = tuple(dataclasses.replace(level, number=renumbered[level.number]) for level in self.levels)
        return LobeSplines(levels, self.behind, int(kept.sum()))

    def weights_of(self, f: Callable[[Array], Array]) -> Array:
        """Weights with which the sum is a smooth function of β − β₀ of shape (n, 2), to fourth order; of one level.

        A spline takes a sixth of the second difference from its neighbours along both axes.
        """
        (level,) = self.levels
        there = level.number >= 0
        near = np.pad(there, 1)
        for k, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
            near = near | np.roll(np.pad(there, 1), k, axis)
        values = np.zeros(near.shape)
        values[near] = f(level.nodes(margin=1)[near] - level.origin)
        around = values[2:, 1:-1] + values[:-2, 1:-1] + values[1:-1, 2:] + values[1:-1, :-2]
        own = values[1:-1, 1:-1]
        weights = np.zeros(self.count)
        weights[level.number[there]] = (own - (around - 4.0 * own) / 6.0)[there]
        return weights


@dataclasses.dataclass(frozen=True, eq=False)
class SplineLobe:
    """F [1/sr] at directions of shape (k, 3), as a sum of splines.

    Parameters
    ----------
    splines : LobeSplines
        m of them.
    weights : array, shape (m,)
        One for each.
    """

    splines: LobeSplines
    weights: Array

    def __call__(self, directions: Array) -> Array:
        """F; NaN where no scan says anything."""
        return self.splines.evaluate(self.weights, directions)


def splines_for(
    arms: Array, regular: Array, spacing: Array, cell: float, reach: float, *, even: bool = False
) -> LobeSplines:
    """Splines where positions are: of width `cell` [°] where they are dense, wider where they are not.

    Parameters
    ----------
    arms : array, shape (n, 3)
        Positions.
    regular : array, shape (3,)
        Where mirrored light goes.
    spacing : array, shape (n,)
        Angle from each position to its neighbour [°].
    cell : number
        Of the finest level [°].
    reach : number
        To which angle from its position the detector sees [°].
    even : bool
        One level everywhere, however far positions are apart: for lobes that are known between them.
    """
    step = float(np.quantile(spacing, 0.1))
    widest = float(np.quantile(spacing, 0.98))
    cosine = abs(float(regular[2]))
    tree = scipy_part("spatial").cKDTree
    levels: list[Level] = []
    count, scale = 0, 1.0
    while True:
        size = np.radians(cell * scale) * np.array([cosine, 1.0])
        dense = (spacing <= DENSE * step * scale) | even
        if dense.any():
            level = _level(arms[dense, :2], regular[:2], size, np.radians(reach), tree, count)
            levels.append(level)
            count += int((level.number >= 0).sum())
        if even or step * scale * DENSE >= widest:
            break
        scale *= COARSER
    return LobeSplines(tuple(levels), bool(regular[2] < 0.0), count)


def _level(beta: Array, origin: Array, size: Array, reach: float, tree: type, count: int) -> Level:
    # In units of cells: how far from a position its splines are.
    far = reach / size + 2.0
    at = (beta - origin) / size
    low = np.floor(at.min(axis=0) - far).astype(int)
    high = np.ceil(at.max(axis=0) + far).astype(int)
    i, j = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1), indexing="ij")
    nodes = np.stack([i, j], axis=-1).reshape(-1, 2)
    near = tree(at / far).query(nodes / far, k=1)[0] <= 1.0
    # Beyond the hemisphere only where the sum next to the rim needs it.
    square = np.sum(((np.abs(origin + nodes * size) - 2.0 * size).clip(min=0.0)) ** 2, axis=1)
    kept = near & (square < 1.0)
    number = np.full(len(nodes), -1, np.intp)
    number[kept] = count + np.arange(int(kept.sum()))
    return Level(origin, size, (int(low[0]), int(low[1])), number.reshape(i.shape))
