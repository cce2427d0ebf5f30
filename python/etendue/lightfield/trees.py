"""Optional Pólya trees over the étendue cells of one part: one candidate for its light."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

import numpy as np

from etendue import _core
from etendue.lightfield.counting import FloatArray, Sums

Result = TypeVar("Result")
Given = ParamSpec("Given")

TILE_BITS = 22
"""Halvings of a grid that one tree takes: 4 million cells, whose boxes fill some 2 GB. Larger grids are cut into tiles."""


Position = tuple[float, ...]
"""Shares of each axis by which a grid is moved."""


def even_positions(steps: Sequence[int]) -> tuple[Position, ...]:
    """Sixteen positions of a grid along as many axes as there are steps, even beside the boxes of every size.

    Trees err by where the edges of their boxes lie, so positions must spread evenly over a box of each of the sizes 1, ½, ¼
    … of the axis: 17 j/256 does for j from 0 to 15, since it moves on by j/256 of the axis whenever j/16 comes round to the
    same place in a box. A step that is odd takes all j, in another order; with 3, 5, 11 and 13 the first four are as even as
    four can be.

    Examples
    --------
    >>> position = np.array(even_positions((3,)))[:, 0]
    >>> [round(float(np.diff(np.sort(position % box)).max()) * 16 / box, 2) for box in (1, 0.5, 0.25)]
    [1.06, 1.12, 1.25]
    """
    return tuple(tuple(17 * (step * k % 16) / 256 for step in steps) for k in range(16))


POSITIONS = even_positions((3, 5, 11, 13))[:4]
"""Those of the trees over place and direction that are averaged."""

ELSEWHERE = (0.27, 0.09, 0.41, 0.88)
"""A position that is none of these."""


@dataclasses.dataclass(frozen=True)
class Base:
    """What a tree falls back on: a product of a density over the place and one over the direction.

    Parameters
    ----------
    space, direction : array, shape (n, n), or None
        Densities at the centres of fine cells, mean 1; None: 1 everywhere.
    """

    space: FloatArray | None = None
    direction: FloatArray | None = None

    @property
    def name(self) -> str:
        """``"uniform"`` or ``"product"``."""
        return "uniform" if self.space is None and self.direction is None else "product"

    def masses(self, shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Mass of the coarse cells over place and over direction; each adds up to one. A grid of two axes has one direction.

        Examples
        --------
        >>> place, direction = Base().masses((2, 2))
        >>> place.tolist(), direction.tolist()
        ([[0.25, 0.25], [0.25, 0.25]], [[1.0]])
        """
        return _coarse(self.space, shape[:2]), _coarse(self.direction, shape[2:] or (1, 1))

    def cells(self, shape: tuple[int, ...]) -> FloatArray:
        """Mass of every coarse cell; all together one."""
        space, direction = self.masses(shape)
        product: FloatArray = space[:, :, None, None] * direction[None, None]
        return product

    def rolled(self, shift: tuple[int, ...], shape: tuple[int, ...]) -> Base:
        """The base for a grid of this shape whose cells are moved cyclically, forwards or backwards."""

        def roll(values: FloatArray | None, axes: slice) -> FloatArray | None:
            if values is None:
                return None
            steps = [s * values.shape[0] // n for s, n in zip(shift[axes], shape[axes], strict=True)]
            moved: FloatArray = np.roll(values, steps, (0, 1))
            return moved

        return Base(roll(self.space, slice(0, 2)), roll(self.direction, slice(2, 4)))


@dataclasses.dataclass(frozen=True)
class Tree:
    """Posterior of a tree on the cells of a part.

    Parameters
    ----------
    ratio, deviation : array, shape of the grid
        Mean and standard deviation of mass over base mass.
    log_evidence : float
        ln of the evidence against the base measure.
    """

    ratio: FloatArray
    deviation: FloatArray
    log_evidence: float


def _coarse(values: FloatArray | None, shape: tuple[int, ...]) -> FloatArray:
    if values is None:
        return np.full(shape, 1.0 / (shape[0] * shape[1]))
    rows, columns = shape
    n = values.shape[0]
    if n < max(rows, columns):  # a factor coarser than the grid: each of its cells is shared out evenly
        values = values.repeat(max(rows, columns) // n, axis=0).repeat(max(rows, columns) // n, axis=1)
        n = values.shape[0]
    blocks = values.reshape(rows, n // rows, columns, n // columns).sum(axis=(1, 3))
    mass: FloatArray = blocks / blocks.sum()
    return mass


def holding_memory(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The function, during which trees leave their memory to those that are grown after them: for work that grows many.

    To fetch the memory of a tree of a million cells from the system, and to clear it, takes up to as long as to grow it.

    Parameters
    ----------
    function : callable
        Whatever it takes and gives, it does so afterwards.

    Examples
    --------
    >>> counts = Sums(np.ones((4, 4)), None)
    >>> holding_memory(log_evidence)(counts, Base(), 1.0, 1) == log_evidence(counts, Base(), 1.0, 1)
    True
    """

    @functools.wraps(function)
    def holding(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        with _core.TreeMemory():
            return function(*args, **kwargs)

    return holding


def log_evidence(counts: Sums, base: Base, concentration: float, threads: int | None) -> float:
    """Ln of the evidence of a tree against its base measure."""
    if sum(_depths(counts)) > TILE_BITS:
        return grow(counts, base, concentration, threads).log_evidence
    return _core.polya_evidence(*_problem(counts, base), concentration, threads)


def grow(counts: Sums, base: Base, concentration: float, threads: int | None) -> Tree:
    """The tree's posterior; grids of more than 2^`TILE_BITS` cells by tiles over the place.

    Tiles are first halves of the first two axes, taken for certain: what they hold is shared out by one Dirichlet trial
    with the tree's concentration, theory eq. 40.
    """
    depths = _depths(counts)
    if sum(depths) <= TILE_BITS:
        ratio, squared, evidence = _core.polya_posterior(*_problem(counts, base), concentration, threads)
        deviation = np.sqrt(np.maximum(squared - ratio**2, 0.0))
        shape = counts.weight.shape
        return Tree(ratio.reshape(shape), deviation.reshape(shape), evidence)
    return _tiled(counts, base, concentration, threads)


def grow_averaged(
    counts: Sums,
    base: Base,
    concentration: float,
    threads: int | None,
    positions: Sequence[Position] = POSITIONS,
) -> Tree:
    """The average of the trees on a grid that is moved cyclically to each of some positions; theory section 14.

    A dyadic grid knows edges best where its own coarse boxes end. Averaging takes that preference away, and what the
    trees differ by shows in the deviation. The evidence is that of the mixture of the trees, each with the same share.
    """
    shape = counts.weight.shape
    shifts = [tuple(round(share * n) for share, n in zip(position, shape, strict=True)) for position in positions]
    if sum(_depths(counts)) <= TILE_BITS:
        mean, square, evidence = _core.polya_average(*_problem(counts, base), concentration, shifts, threads)
        mean, square = mean.reshape(shape), square.reshape(shape)
    else:
        mean, square, evidence = np.zeros(shape), np.zeros(shape), []
        for shift in shifts:
            tree = grow_moved(counts, base, shift, concentration, threads)
            evidence.append(tree.log_evidence)
            mean += tree.ratio / len(shifts)
            square += (tree.deviation**2 + tree.ratio**2) / len(shifts)
    highest = max(evidence)
    mixed = highest + math.log(sum(math.exp(e - highest) for e in evidence) / len(evidence))
    return Tree(mean, np.sqrt(np.maximum(square - mean**2, 0.0)), mixed)


def grow_moved(counts: Sums, base: Base, shift: tuple[int, ...], concentration: float, threads: int | None) -> Tree:
    """The tree on the grid whose cells are moved cyclically by so many steps, with its cells moved back."""
    if not any(shift):
        return grow(counts, base, concentration, threads)
    axes = tuple(range(len(shift)))
    back = tuple(-s for s in shift)
    moved = counts.map(lambda cells: np.roll(cells, shift, axes))
    tree = grow(moved, base.rolled(shift, counts.weight.shape), concentration, threads)
    return Tree(np.roll(tree.ratio, back, axes), np.roll(tree.deviation, back, axes), tree.log_evidence)


def _tiled(counts: Sums, base: Base, concentration: float, threads: int | None) -> Tree:
    shape = counts.weight.shape
    cuts = [0, 0]
    while sum(_depths(counts)) - sum(cuts) > TILE_BITS:
        axis = int(np.argmax([shape[0] >> cuts[0], shape[1] >> cuts[1]]))
        cuts[axis] += 1
    steps = [n >> c for n, c in zip(shape[:2], cuts, strict=True)]
    space, direction = base.masses(shape)
    total = counts.rays
    ratio, deviation = np.zeros(shape), np.zeros(shape)
    evidence = 0.0
    for i, j in itertools.product(*(range(0, n, s) for n, s in zip(shape, steps, strict=False))):
        window = (slice(i, i + steps[0]), slice(j, j + steps[1]))
        part = counts.map(_cut, window)
        prior = float(space[window].sum())
        if prior == 0.0:
            continue
        factors = None if base.name == "uniform" else [(2, space[window].ravel()), (2, direction.ravel())]
        ratios, squares, log_tile = _core.polya_posterior(
            _depths(part),
            part.weight.ravel(),
            None if part.squared is None else part.squared.ravel(),
            factors,
            concentration,
            threads,
        )
        points = total * float(part.weight.sum()) / float(counts.weight.sum()) if total else 0.0
        alpha, everything = concentration * prior + points, concentration + total
        first, second = alpha / everything, alpha * (alpha + 1) / (everything * (everything + 1))
        ratio[window] = (ratios * first / prior).reshape(part.weight.shape)
        variance = squares * second / prior**2 - (ratios * first / prior) ** 2
        deviation[window] = np.sqrt(np.maximum(variance, 0.0)).reshape(part.weight.shape)
        evidence += log_tile + _log_trial(concentration, prior, points)
    evidence -= _log_trial(concentration, 1.0, total)
    return Tree(ratio, deviation, evidence)


def _cut(values: FloatArray, window: tuple[slice, slice]) -> FloatArray:
    return np.ascontiguousarray(values[window])


def _log_trial(c: float, prior: float, points: float) -> float:
    """One tile's part of ln of the evidence of the Dirichlet trial."""
    return math.lgamma(c * prior + points) - math.lgamma(c * prior) - points * math.log(prior)


def _depths(counts: Sums) -> list[int]:
    return [n.bit_length() - 1 for n in counts.weight.shape]


def _problem(
    counts: Sums, base: Base
) -> tuple[list[int], FloatArray, FloatArray | None, list[tuple[int, FloatArray]] | None]:
    """The arguments of the core that describe data and base."""
    factors = None
    if base.name != "uniform":
        space, direction = base.masses(counts.weight.shape)
        factors = [(2, space.ravel()), (2, direction.ravel())]
    squared = None if counts.squared is None else counts.squared.ravel()
    return _depths(counts), counts.weight.ravel(), squared, factors
