"""One way to explain the counts: images, a base measure and a tree for each part; and how well it predicts held-out rays."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from etendue import _core
from etendue.lightfield.carrier import Part
from etendue.lightfield.counting import EtendueCounts, FloatArray, Fold, PartCounts, Sums
from etendue.lightfield.etendue_density import FineErrors, PartField, core_part
from etendue.lightfield.marginals import scaled
from etendue.lightfield.nodes import node_values
from etendue.lightfield.symmetry import order, sum_of_images
from etendue.lightfield.trees import POSITIONS, Base, Position, Tree, even_positions, grow_averaged, log_evidence

CONCENTRATIONS = {"uniform": (1.0, 3.0, 10.0), "product": (10.0, 30.0, 100.0)}
"""Concentrations c among which the evidence chooses, by base measure: one that was taken from the data is believed more."""

IMAGE_CONCENTRATIONS = (1.0, 3.0, 10.0)
"""Those among which the evidence chooses for the trees of images."""

FLOOR = 1e-3
"""Share of a uniform density in the images: where they are wrongly dark, the data can still say so."""

MIXED_IN = 1e-4
"""Least share of the even density in every score, so that one cell that is wrongly dark cannot decide it."""

UNFLATTENED = 0.05
"""Standard deviation of the Gauss function by which what a tree flattens in a lobe is smoothed, in sides of the square of
directions. Of 0.02, 0.05 and 0.1 it predicts smooth lobes best, and no source worse than without."""

FINE_POSITIONS = even_positions((3, 5))
"""Positions of the fine grids over which images are averaged."""


class Recipe(NamedTuple):
    """How a part's light is estimated.

    Parameters
    ----------
    product : bool
        Whether the tree's base measure is the product of the images over place and direction; if not, it is uniform.
    scaled : bool
        Whether the field's marginals are made those of the images.
    """

    product: bool
    scaled: bool


RECIPES: dict[str, Recipe] = {
    "uniform": Recipe(product=False, scaled=False),
    "scaled": Recipe(product=False, scaled=True),
    "product": Recipe(product=True, scaled=True),
}
"""By name, the simplest first. Images are sharp where place and direction go apart, the tree where they do not."""


@dataclasses.dataclass(frozen=True)
class Images(Base):
    """Densities over the place and over the direction, with their standard deviations and the trees' concentrations."""

    space_deviation: FloatArray | None = None
    direction_deviation: FloatArray | None = None
    concentrations: tuple[float, float] | None = None

    def densities(self) -> tuple[FloatArray, FloatArray]:
        """Both densities; 1 where there were no rays to tell."""
        one = np.ones((1, 1))
        return one if self.space is None else self.space, one if self.direction is None else self.direction


def images_of(
    counts: PartCounts,
    chart: Part,
    threads: int | None,
    symmetry: str = "none",
    positions: Sequence[Position] = FINE_POSITIONS,
    like: Images | None = None,
    *,
    unflattened: bool = True,
) -> Images:
    """Densities over the place and over the direction: what the fine counts tell, each by itself.

    Either is a tree of its own, averaged over positions of the fine grid; what that takes from the top of a smooth lobe of
    directions is put back, unless it shall not be. Where other parts take all light first, nothing is left. The
    concentrations are those of greatest evidence, or those of other images of the same light.
    """
    if counts.space.rays == 0:
        return Images()

    def concentration(sums: Sums) -> float:
        return max(IMAGE_CONCENTRATIONS, key=lambda c: log_evidence(sums, Base(), c, threads))

    def density(sums: Sums, c: float) -> tuple[FloatArray, FloatArray]:
        found = grow_symmetric(sums, Base(), c, threads, positions, symmetry)
        return found.ratio * (1.0 - FLOOR) + FLOOR, found.deviation

    known = None if like is None else like.concentrations
    of_place, of_turn = known or (concentration(counts.space), concentration(counts.direction))
    (space, of_space), (direction, of_direction) = density(counts.space, of_place), density(counts.direction, of_turn)
    if unflattened:
        # The tree of what the found image brings on average is flatter than it by about as much as it is than the light:
        # twicing, [Tukey1977]_.
        expected = Sums(direction * (counts.direction.rays / direction.size), None)
        flatter, _ = density(expected, of_turn)
        factor = _smooth_ratio(direction, flatter)
        direction, of_direction = direction * factor, of_direction * factor
        level = direction.mean()
        direction, of_direction = direction / level, of_direction / level
    space, direction = space * _outside(len(space), chart.hole), direction * _not_taken(len(direction), chart)
    return Images(space, direction, of_space, of_direction, (of_place, of_turn))


def _smooth_ratio(density: FloatArray, other: FloatArray) -> FloatArray:
    """The ratio of two densities over direction, its logarithm averaged around each direction by what light there is."""
    n = len(density)
    steps = np.arange(n)
    kernel = np.exp(-0.5 * ((steps[:, None] - steps) / (UNFLATTENED * n)) ** 2)
    light = kernel @ density @ kernel.T
    ratio: FloatArray = np.exp(kernel @ (density * np.log(density / other)) @ kernel.T / light)
    return ratio


def _outside(n: int, hole: float) -> FloatArray:
    """1 at the centres of those of n × n cells that lie outside a hole of this share of the sides, 0 within."""
    beside = np.abs((np.arange(n) + 0.5) / n - 0.5) >= hole / 2.0
    return (beside[:, None] | beside[None, :]).astype(np.float64)


@functools.lru_cache(maxsize=8)
def _not_taken(n: int, chart: Part) -> FloatArray:
    """1 in those of n × n cells of direction of which other parts do not take all light first, 0 in the others."""
    p, q, radius = chart.taken
    if radius == 0.0:
        return np.ones((n, n))
    # A cell lies within the disk, which is convex, if its corners and the middles of its sides do.
    steps = np.arange(2 * n + 1) / (2.0 * n)
    a, b = np.meshgrid(steps, steps, indexing="ij")
    middle = np.full(a.size, 0.5)
    _, k = _core.rays_of_part(chart.core(), np.column_stack([middle, middle, a.ravel(), b.ravel()]))
    x, y = (k @ np.array(axis) for axis in chart.axes[:2])
    beside = (np.hypot(x - p, y - q) > radius).reshape(a.shape)
    parts = (beside[i : i + 2 * n - 1 : 2, j : j + 2 * n - 1 : 2] for i in range(3) for j in range(3))
    left: FloatArray = np.any(list(parts), axis=0).astype(np.float64)
    return left


def grow_symmetric(
    counts: Sums,
    base: Base,
    concentration: float,
    threads: int | None,
    positions: Sequence[Position],
    symmetry: str,
) -> Tree:
    """The average of trees of folded counts: as symmetric as they are, which grids that are moved are not."""
    tree = grow_averaged(counts, base, concentration, threads, positions)
    ratio, deviation = (sum_of_images(cells, symmetry) / order(symmetry) for cells in (tree.ratio, tree.deviation))
    return dataclasses.replace(tree, ratio=ratio, deviation=deviation)


@dataclasses.dataclass(frozen=True, eq=False)
class PartEstimate:
    """What is found of the light of one part.

    Parameters
    ----------
    chart : Part
    recipe : str
        A name in `RECIPES`.
    images : Images
        Over place and direction.
    concentration : float
    tree : Tree
        On the recipe's base measure.
    errors : FineErrors
        Beside those of the tree.
    """

    chart: Part
    recipe: str
    images: Images
    concentration: float
    tree: Tree
    errors: FineErrors = dataclasses.field(default_factory=FineErrors)

    @property
    def base(self) -> Base:
        """The base measure of the tree."""
        return base_of(self.chart, self.recipe, self.images)

    @functools.cached_property
    def unit(self) -> PartField:
        """The field, up to a factor."""
        ratio, deviation = (node_values(v).astype(np.float32) for v in (self.tree.ratio, self.tree.deviation))
        field = PartField(ratio, deviation, self.base.space, self.base.direction, 1.0, self.errors)
        if RECIPES[self.recipe].scaled or self.chart.is_shared:
            return scaled(field, self.images, self.chart.shape == "tube")
        return field

    def field(self, flux: float) -> PartField:
        """The field with this flux."""
        integral = _core.LightField([core_part(self.chart.core(), self.unit)]).flux()[0]
        return dataclasses.replace(self.unit, level=flux / integral)


def base_of(chart: Part, recipe: str, images: Base) -> Base:
    """The base measure of a recipe's tree; where other parts take light first it is that of the images, which know of it."""
    return images if RECIPES[recipe].product or chart.is_shared else Base()


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """An estimate of each part's light, all by one recipe."""

    parts: tuple[PartEstimate, ...]

    @property
    def log_evidence(self) -> float:
        """Of the trees against their base measures, summed over the parts."""
        return sum(part.tree.log_evidence for part in self.parts)

    def by(self, recipe: str) -> Candidate:
        """The same trees by another recipe with the same base measure."""
        return Candidate(tuple(dataclasses.replace(part, recipe=recipe) for part in self.parts))

    def fields(self, counts: EtendueCounts) -> tuple[PartField, ...]:
        """The parts' fields, each with the flux that was counted on it."""
        return tuple(part.field(flux) for part, flux in zip(self.parts, counts.part_flux, strict=True))

    def score(self, counts: EtendueCounts) -> Score:
        """Ln of the density in étendue [1/(mm² sr)] at the held-out rays; see `score_densities`."""
        charts = counts.surface.parts()
        core = _core.LightField(
            [core_part(chart.core(), part) for chart, part in zip(charts, self.fields(counts), strict=True)]
        )
        rays = counts.some_held_out
        density = np.zeros(len(rays.part))
        for index, chart in enumerate(charts):
            mine = rays.part == index
            x, k = _core.rays_of_part(chart.core(), np.ascontiguousarray(rays.coordinates[mine]))
            # What other parts send along the same line counts too: luminance is theirs together.
            density[mine] = core.luminance(x, k)[0]
        return score_densities(counts, density)


def score_densities(counts: EtendueCounts, luminance: FloatArray) -> Score:
    """The score of a field that has these luminances at some held-out rays [flux unit/(mm² sr)].

    The density of a ray is (1 - u) L/Φ + u e, with u the share of the flux that does not meet the surface and e the even
    density over all lines through the source (`even_density`). It adds up to one over all lines whatever the surface is.
    Held-out rays that do not meet the surface count with u e, in the share that they have of all rays.
    """
    met = sum(counts.part_flux)
    unmet = max(counts.unmet_flux / (met + counts.unmet_flux), MIXED_IN)
    values = np.log((1.0 - unmet) * luminance / met + unmet * counts.even)
    weights = counts.some_held_out.weight
    if counts.unmet_rays and len(values):
        outside = max(round(len(values) * counts.unmet_rays / (counts.rays - counts.unmet_rays)), 1)
        share = float(weights.sum()) * counts.unmet_flux / met
        values = np.concatenate([values, np.full(outside, np.log(unmet * counts.even))])
        weights = np.concatenate([weights, np.full(outside, share / outside)])
    return Score(values, weights)


@dataclasses.dataclass(frozen=True, eq=False)
class Score:
    """How well held-out rays were predicted.

    Parameters
    ----------
    values : array, shape (n,)
        ln of the density at each ray.
    weights : array, shape (n,)
        Relative flux of each.
    """

    values: FloatArray
    weights: FloatArray

    @property
    def mean(self) -> float:
        """Flux-weighted mean; NaN if no ray was held out."""
        return float(np.average(self.values, weights=self.weights)) if len(self.values) else float("nan")

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return _standard_error(self.values, self.weights)

    def lead(self, other: Score) -> tuple[float, float]:
        """By how much the mean lies above another's on the same rays, and the standard error of that difference."""
        difference = self.values - other.values
        mean = float(np.average(difference, weights=self.weights)) if len(difference) else 0.0
        return mean, _standard_error(difference, self.weights)


def _standard_error(values: FloatArray, weights: FloatArray) -> float:
    if len(values) < 2:
        return float("inf")
    mean = np.average(values, weights=weights)
    return float(np.sqrt(np.sum((weights * (values - mean)) ** 2)) / weights.sum())


def all_images(
    counts: EtendueCounts,
    fold: Fold,
    threads: int | None,
    positions: Sequence[Position] = FINE_POSITIONS,
    like: Sequence[Images] | None = None,
) -> tuple[Images, ...]:
    """The images of each part, from the counts of a fold; see `images_of`."""
    parts = zip(counts[fold], counts.surface.parts(), like or itertools.repeat(None), strict=False)
    return tuple(images_of(part, chart, threads, counts.symmetry, positions, other) for part, chart, other in parts)


def grow_candidates(
    counts: EtendueCounts,
    images: Sequence[Images],
    concentrations: Mapping[str, Sequence[float]],
    threads: int | None,
    recipes: Iterable[str] = tuple(RECIPES),
) -> dict[str, Candidate]:
    """The candidates of recipes on the rays that are fitted, with trees in one position; equal trees are grown once."""
    grown: dict[bool, Candidate] = {}
    candidates = {}
    for name in recipes:
        recipe = RECIPES[name]
        if recipe.product not in grown:
            c = concentrations[name]
            grown[recipe.product] = grow_candidate(counts, "fitted", name, images, c, threads, POSITIONS[:1])
        candidates[name] = grown[recipe.product].by(name)
    return candidates


def choose_concentrations(
    counts: EtendueCounts, images: Sequence[Images], threads: int | None
) -> dict[str, tuple[float, ...]]:
    """By recipe for each part the concentration of greatest evidence, on the rays that are fitted."""
    chosen: dict[bool, tuple[float, ...]] = {}
    for name, recipe in RECIPES.items():
        if recipe.product not in chosen:
            chosen[recipe.product] = _of_greatest_evidence(counts, name, images, threads)
    return {name: chosen[recipe.product] for name, recipe in RECIPES.items()}


def _of_greatest_evidence(
    counts: EtendueCounts, recipe: str, images: Sequence[Images], threads: int | None
) -> tuple[float, ...]:

    def choose(part: PartCounts, base: Base) -> float:
        options = CONCENTRATIONS[base.name]
        evidence = [log_evidence(part.grid, base, c, threads) for c in options]
        return options[int(np.argmax(evidence))]

    charts = counts.surface.parts()
    return tuple(
        choose(part, base_of(chart, recipe, own))
        for part, chart, own in zip(counts["fitted"], charts, images, strict=True)
    )


def grow_candidate(
    counts: EtendueCounts,
    fold: Fold,
    recipe: str,
    images: Sequence[Images],
    concentrations: Sequence[float],
    threads: int | None,
    positions: Sequence[Position] = POSITIONS,
) -> Candidate:
    """The candidate of a recipe on the counts of a fold, its trees averaged over positions of the grid."""
    parts = zip(counts[fold], counts.surface.parts(), images, concentrations, strict=True)
    return Candidate(
        tuple(
            grow_part(part, chart, recipe, own, c, threads, counts.symmetry, positions) for part, chart, own, c in parts
        )
    )


def grow_part(
    counts: PartCounts,
    chart: Part,
    recipe: str,
    images: Images,
    concentration: float,
    threads: int | None,
    symmetry: str,
    positions: Sequence[Position] = POSITIONS,
) -> PartEstimate:
    """The estimate of one part."""
    base = base_of(chart, recipe, images)
    tree = grow_symmetric(counts.grid, base, concentration, threads, positions, symmetry)
    return PartEstimate(chart, recipe, images, concentration, tree)
