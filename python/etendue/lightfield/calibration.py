"""Error bars that hold: the posterior's, calibrated on counts of a known field much like the one that was found.

A tree's posterior tells how uncertain the shares of its boxes are; that the truth varies within a box it knows only as
far as its prior foresees. How far off the whole estimate is, is therefore tried out: counts are drawn from a known field,
one tree on a grid in yet another position, whose edges are as sharp as the rays tell and lie between those of the
estimate's boxes. The estimate is made again from these counts, and the errors of what it shows are compared with its error
bars, separately for cells that are sure or unsure of themselves and for cells in smooth or in rough surroundings
(parametric bootstrap, [EfronTibshirani1993]_ chapter 6). Theory section 14.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.lightfield.candidate import FINE_POSITIONS, Images, PartEstimate, base_of, grow_part, images_of
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import FineErrors, core_part
from etendue.lightfield.symmetry import order, sum_of_images
from etendue.lightfield.trees import ELSEWHERE, Base, Tree, grow, grow_moved

STRATA = 12
"""Classes by either feature: about 7000 of a million cells in each. Those of both are told apart by eight bits."""

ONE_SIGMA, TWO_SIGMA = 0.6827, 0.9545
"""Shares of a normal distribution within one and two standard deviations."""

FEWEST = 50
"""Cells that a class needs to speak for itself."""

KNOWN_POSITIONS = FINE_POSITIONS[:4]
"""Positions over which the margins of the known field are averaged: so few that they are less smooth than an estimate."""

IN_COMMON = 0.2
"""Share of the variance of errors that no averaging takes away. The edges of the known field lie between cells; those of the
truth, which do not, err on one side over many cells. Of sources of known luminance (`benchmarks/error_bars.py`), shares from
0.1 to 0.3 cover large pixels about as well as small ones."""

DARK = 1e-12
"""Share of the largest mean below which cells are all as dark."""

BRIGHT = 0.01
"""Share of the largest mean from which on squares tell how errors average out."""

FINEST_ERRORS = 256
"""Cells along either side of the errors within cells."""

PURPOSE = 0x424F_4F54
"""Keeps the random numbers of the trial apart from all others."""


@dataclasses.dataclass(frozen=True, eq=False)
class Masses:
    """Share of each cell in the flux of its part, with a standard deviation yet to be calibrated."""

    mean: FloatArray
    deviation: FloatArray

    def features(self) -> tuple[FloatArray, FloatArray]:
        """What the trust in a cell hangs on: logarithms of its relative deviation, and of the relative spread around."""
        mean = np.maximum(self.mean, DARK * max(float(self.mean.max()), np.finfo(np.float64).tiny / DARK))
        certainty = np.log(np.maximum(self.deviation / mean, 1e-12))
        average = _around(mean)
        spread = np.sqrt(np.maximum(_around(mean**2) - average**2, 0.0)) / mean
        return certainty.ravel(), np.log(np.maximum(spread, 1e-6)).ravel()


def calibrate(
    found: PartEstimate,
    counts: PartCounts,
    symmetry: str,
    seed: int,
    threads: int | None,
    step: Callable[[], None] = lambda: None,
) -> tuple[Tree, FineErrors]:
    """The tree of an estimate with calibrated standard deviations, and what errors there are beside them.

    `step` is called four times as the work goes on.
    """
    step()
    own = _masses(found, counts.grid, threads)
    known, within = _elsewhere(found, counts, symmetry, threads)
    step()
    drawn = _draw(known, counts, within, symmetry, seed)
    images = (
        images_of(drawn, found.chart, threads, symmetry, like=found.images) if _uses_images(found) else found.images
    )
    step()
    again = grow_part(drawn, found.chart, found.recipe, images, found.concentration, threads, symmetry)
    step()
    retried = _masses(again, drawn.grid, threads)
    errors = retried.mean - known
    factors, tried = _factors(retried, np.abs(errors) / np.maximum(retried.deviation, _tiny(known)), own)
    left = _left(errors, retried.deviation * tried, known, known.shape[0] // 2, in_common_below=known.shape[0])
    # What a cell is off by, as a share of what it shows, is what the ratio is off by.
    relative = np.divide(own.deviation * factors, own.mean, out=np.zeros_like(own.mean), where=own.mean > 0)
    tree = dataclasses.replace(found.tree, deviation=relative * found.tree.ratio)
    if not _uses_images(found):
        return tree, FineErrors(cells_left=left)
    (place, turn), (place_again, turn_again) = _margins(found.images), _margins(images)
    space, within_left = _within(place, place_again, within.space, known.shape[:2])
    direction, _ = _within(turn, turn_again, within.direction, known.shape[2:])
    return tree, FineErrors(space, direction, left, within_left)


def _margins(images: Images) -> tuple[Masses, Masses]:
    """The densities over place and direction with their deviations."""

    def masses(density: FloatArray, deviation: FloatArray | None) -> Masses:
        return Masses(density, np.zeros_like(density) if deviation is None else deviation)

    space, direction = images.densities()
    return masses(space, images.space_deviation), masses(direction, images.direction_deviation)


def _within(
    found: Masses, again: Masses, known: FloatArray | None, cells: tuple[int, ...]
) -> tuple[FloatArray | None, tuple[float, ...]]:
    """Relative deviations of a density against its mean over each cell, and what averaging leaves of them.

    Whether the mean is right is a question of the cells' own errors.
    """
    n = len(found.mean)
    if known is None or n <= max(cells):
        return None, (1.0,)
    shown, true = _shape(again.mean, cells), _shape(known, cells)
    errors = np.divide(shown - true, shown, out=np.zeros_like(shown), where=shown > 0) * again.mean
    factors, tried = _factors(again, np.abs(errors) / np.maximum(again.deviation, _tiny(again.mean)), found)
    # Over a whole cell these errors add up to nothing, over one and two halves of its neighbours to little.
    per_cell = n // max(cells)
    off_the_cells = (max(per_cell // 3, 1),) * 2
    off, deviation, mean = (
        np.roll(values, off_the_cells, (0, 1)) for values in (errors, again.deviation * tried, again.mean)
    )
    left = _left(off, deviation, mean, n // 2, in_common_below=per_cell)
    variance = (
        np.divide(found.deviation * factors, found.mean, out=np.zeros_like(found.mean), where=found.mean > 0) ** 2
    )
    side = min(n, FINEST_ERRORS)
    averaged = variance.reshape(side, n // side, side, n // side).mean(axis=(1, 3))
    return np.sqrt(averaged), left[(n // side).bit_length() - 1 :]


def _shape(density: FloatArray, cells: tuple[int, ...]) -> FloatArray:
    """A density over its mean in each cell; 1 where that is 0."""
    n, (rows, columns) = len(density), cells
    mean = density.reshape(rows, n // rows, columns, n // columns).mean(axis=(1, 3))
    level = mean.repeat(n // rows, axis=0).repeat(n // columns, axis=1)
    shape: FloatArray = np.divide(density, level, out=np.ones_like(density), where=level > 0)
    return shape


def _left(
    errors: FloatArray, deviation: FloatArray, mean: FloatArray, largest: int, *, in_common_below: int
) -> tuple[float, ...]:
    """What is left of calibrated deviations where errors are averaged over 1, 2, 4, … cells along the first two axes.

    Squares of fewer cells along a side than `in_common_below` have errors that no averaging takes away.
    """
    left, side = [1.0], 2
    first = _width(np.sort(np.abs(errors / np.maximum(deviation, _tiny(mean)))[mean > BRIGHT * mean.max()]))
    while side <= min(largest, *(n // 2 for n in mean.shape[:2])):
        e, d, m = (_squares(values, side) for values in (errors, deviation, mean))
        lit = m > BRIGHT * m.max()
        share = (
            min(_width(np.sort(np.abs(e[lit]) / np.maximum(d[lit], _tiny(mean)))) / first, 1.0) if first > 0 else 1.0
        )
        in_common = IN_COMMON if side < in_common_below else 0.0
        left.append(min(math.sqrt(in_common + (1.0 - in_common) * share**2), left[-1]))
        side *= 2
    return tuple(left)


def _squares(values: FloatArray, side: int) -> FloatArray:
    """Sums over squares of the first two axes."""
    rows, columns, *rest = values.shape
    sums: FloatArray = values.reshape(rows // side, side, columns // side, side, *rest).sum(axis=(1, 3))
    return sums


def _uses_images(estimate: PartEstimate) -> bool:
    return estimate.recipe != "uniform" or estimate.chart.is_shared


def _shown(estimate: PartEstimate, threads: int | None) -> FloatArray:
    """The share of each cell in the flux of the field that users are shown."""
    field = _core.LightField([core_part(estimate.chart.core(), estimate.unit)])
    means = field.cell_means(0, threads)[0].reshape(estimate.tree.ratio.shape)
    shares: FloatArray = means / means.sum()
    return shares


def _masses(estimate: PartEstimate, counts: Sums, threads: int | None) -> Masses:
    """What cells show, with the relative deviations of the tree and, where images are used, of its margins."""
    tree = estimate.tree
    mean = _shown(estimate, threads)
    relative = np.divide(tree.deviation, tree.ratio, out=np.zeros_like(tree.ratio), where=tree.ratio > 0)
    variance = (mean * relative) ** 2
    if _uses_images(estimate):
        for axes, shape in (((2, 3), (slice(None), slice(None), None, None)), ((0, 1), (None, None))):
            margin = grow(counts.map(np.sum, axes), Base(), 1.0, threads)
            variance = variance + (mean * (margin.deviation / margin.ratio)[shape]) ** 2
    return Masses(mean, np.sqrt(variance))


def _elsewhere(found: PartEstimate, counts: PartCounts, symmetry: str, threads: int | None) -> tuple[FloatArray, Base]:
    """The masses that a grid in another position finds, and the fine densities within its cells."""
    shape = counts.grid.weight.shape
    shift = tuple(round(share * n) for share, n in zip(ELSEWHERE, shape, strict=True))
    if _uses_images(found):
        # Edges of the margins, too, are found anew: on the old grid they would lie where its boxes end.
        fine = [
            sums.map(np.roll, _fine_steps(s, n, sums.weight.shape[0]), (0, 1))
            for sums, s, n in ((counts.space, shift[:2], shape[:2]), (counts.direction, shift[2:], shape[2:]))
        ]
        there = images_of(
            PartCounts(counts.grid, *fine), found.chart.whole, threads, positions=KNOWN_POSITIONS, like=found.images
        )
        images = there.rolled(tuple(-s for s in shift), shape)
        # The rolled images are floored; where nothing can be, nothing is drawn.
        images = Base(
            _where_lit(images.space, found.images.space), _where_lit(images.direction, found.images.direction)
        )
    else:
        images = found.images
    base = base_of(found.chart, found.recipe, images)
    tree = grow_moved(counts.grid, base, shift, found.concentration, threads)
    known = PartEstimate(found.chart, found.recipe, Images(images.space, images.direction), found.concentration, tree)
    # What the rays cannot tell from darkness may be dark: with k = (mean/deviation)² rays' worth of knowledge, k/(k + 1) is
    # left of it. The estimate itself has no cell darker than its prior, and so would find its errors there too small.
    unsure = np.divide(tree.deviation, tree.ratio, out=np.zeros_like(tree.ratio), where=tree.ratio > 0) ** 2
    mass = sum_of_images(_shown(known, threads) / (1.0 + unsure) ** 2, symmetry)
    return mass / mass.sum(), Base(known.unit.space, known.unit.direction)


def _where_lit(density: FloatArray | None, like: FloatArray | None) -> FloatArray | None:
    return density if density is None or like is None else np.where(like > 0, density, 0.0)


def _fine_steps(shift: tuple[int, ...], shape: tuple[int, ...], fine: int) -> list[int]:
    return [s * fine // n for s, n in zip(shift, shape, strict=True)]


def _draw(known: FloatArray, counts: PartCounts, base: Base, symmetry: str, seed: int) -> PartCounts:
    """Counts of as many equal rays as the set is worth, from the known field; the fine ones follow from the base.

    Of a symmetric field fewer rays are drawn, and folded as those of the set were.
    """
    generator = np.random.Generator(np.random.Philox(key=np.array([seed, PURPOSE], dtype=np.uint64)))
    grid = generator.poisson(known * (counts.grid.rays / order(symmetry))).astype(np.float64)
    if base.name == "uniform":
        return PartCounts(Sums(sum_of_images(grid, symmetry), None), counts.space, counts.direction)
    space = dealt_to_fine(grid.sum(axis=(2, 3)), base.space, generator)
    direction = dealt_to_fine(grid.sum(axis=(0, 1)), base.direction, generator)
    return PartCounts(*(Sums(sum_of_images(cells, symmetry), None) for cells in (grid, space, direction)))


def dealt_to_fine(coarse: FloatArray, fine: FloatArray | None, generator: np.random.Generator) -> FloatArray:
    """The counts of coarse cells dealt out to the fine cells within them, by the fine density."""
    if fine is None:
        return coarse
    (rows, columns), n = coarse.shape, fine.shape[0]
    blocks = fine.reshape(rows, n // rows, columns, n // columns).transpose(0, 2, 1, 3)
    shares = blocks.reshape(rows * columns, -1)
    sums = shares.sum(axis=1, keepdims=True)
    shares = np.where(sums > 0, shares / np.where(sums > 0, sums, 1.0), 1.0 / shares.shape[1])
    dealt = generator.multinomial(coarse.astype(np.int64).ravel(), shares)
    back = dealt.reshape(rows, columns, n // rows, n // columns).transpose(0, 2, 1, 3)
    refined: FloatArray = back.reshape(n, n).astype(np.float64)
    return refined


def _factors(tried: Masses, errors: FloatArray, found: Masses) -> tuple[FloatArray, FloatArray]:
    """Factors for the deviations of the found and of the tried cells: what the errors of the tried ones of a class show."""
    features = tried.features()
    edges = [np.quantile(f, np.linspace(0, 1, STRATA + 1)[1:-1]) for f in features]
    classes, targets = _classes(features, edges), _classes(found.features(), edges)
    order = np.argsort(classes, kind="stable")
    sorted_by_class, bounds = errors.ravel()[order], np.searchsorted(classes[order], np.arange(STRATA**2 + 1))
    table = np.full(STRATA**2, np.nan)
    for index, (start, stop) in enumerate(itertools.pairwise(bounds)):
        if stop - start >= FEWEST:
            table[index] = _width(np.sort(sorted_by_class[start:stop]))
    if np.isnan(table).any():
        table[np.isnan(table)] = _width(np.sort(sorted_by_class))
    factors: FloatArray = table[targets].reshape(found.mean.shape)
    own: FloatArray = table[classes].reshape(tried.mean.shape)
    return factors, own


def _width(ranked: FloatArray) -> float:
    """The standard deviation that rising absolute errors show: once and twice of it hold the shares that they should.

    Where tails are heavier than a normal distribution's, no width does both. It is then the one that misses both equally,
    in units of 5 % and of 3 % of the errors.
    """
    once = np.arange(1, len(ranked) + 1) / len(ranked) - ONE_SIGMA
    twice = np.searchsorted(ranked, 2.0 * ranked, "right") / len(ranked) - TWO_SIGMA
    return float(ranked[np.argmax(once / 5.0 + twice / 3.0 >= 0.0)])


def _classes(features: tuple[FloatArray, FloatArray], edges: list[FloatArray]) -> npt.NDArray[np.uint8]:
    """The class of each cell; so few are sorted digit by digit."""
    classes = np.zeros(features[0].shape, np.uint8)
    # Counting the edges below is several times as fast as to search among so few.
    for step, f, rising in zip((STRATA, 1), features, edges, strict=True):
        for edge in rising:
            classes += np.uint8(step) * (f > edge)
    return classes


def _around(values: FloatArray) -> FloatArray:
    """Average over each cell and its neighbours, ½ of its own value and ¼ of either neighbour's along each axis."""
    for axis in range(values.ndim):
        if values.shape[axis] > 1:
            values = 0.5 * values + 0.25 * (np.roll(values, 1, axis) + np.roll(values, -1, axis))
    return values


def _tiny(known: FloatArray) -> float:
    return float(np.finfo(np.float64).tiny) + 1e-12 / known.size
