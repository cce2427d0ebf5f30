"""One way to explain the counts: a base measure and a tree for each part; and how well it predicts held-out rays."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from etendue import _core
from etendue.denoising.shifted_trees import LATTICE
from etendue.lightfield.counting import EtendueCounts, FloatArray, Fold, PartCounts, Sums
from etendue.lightfield.etendue_density import PartField, core_part
from etendue.lightfield.nodes import node_values
from etendue.lightfield.symmetry import order, sum_of_images
from etendue.lightfield.trees import POSITIONS, Base, Tree, grow_averaged, log_evidence

CONCENTRATIONS = {"uniform": (1.0, 3.0, 10.0), "product": (10.0, 30.0, 100.0)}
"""Concentrations c among which the evidence chooses, by base measure: one that was taken from the data is believed more."""

FLOOR = 1e-3
"""Share of a uniform density in the factors of a product base: where they are wrongly dark, the data can still say so."""

MIXED_IN = 1e-4
"""Least share of the even density in every score, so that one cell that is wrongly dark cannot decide it."""

FINE_POSITIONS = tuple((k * LATTICE[0] % 1.0, k * LATTICE[1] % 1.0) for k in range(16))
"""Positions of the fine grids over which the factors of a product base are averaged: evenly spread."""


def uniform_bases(counts: Sequence[PartCounts]) -> tuple[Base, ...]:
    """Nothing is known beforehand: every cell has the same luminance."""
    return tuple(Base() for _ in counts)


def product_bases(
    counts: Sequence[PartCounts],
    threads: int | None,
    symmetry: str = "none",
    positions: Sequence[tuple[float, ...]] = FINE_POSITIONS,
) -> tuple[Base, ...]:
    """Exitance times intensity: what the fine counts over place and over direction tell, each by itself.

    Either is a tree of its own, averaged over positions of the fine grid.
    """

    def density(sums: Sums) -> FloatArray:
        found = grow_symmetric(sums, Base(), 1.0, threads, positions, symmetry).ratio
        lifted: FloatArray = found * (1.0 - FLOOR) + FLOOR
        return lifted

    return tuple(
        Base(density(part.space), density(part.direction)) if part.space.rays > 0 else Base() for part in counts
    )


def grow_symmetric(
    counts: Sums,
    base: Base,
    concentration: float,
    threads: int | None,
    positions: Sequence[tuple[float, ...]],
    symmetry: str,
) -> Tree:
    """The average of trees of folded counts: as symmetric as they are, which grids that are moved are not."""
    tree = grow_averaged(counts, base, concentration, threads, positions)
    ratio, deviation = (sum_of_images(cells, symmetry) / order(symmetry) for cells in (tree.ratio, tree.deviation))
    return dataclasses.replace(tree, ratio=ratio, deviation=deviation)


def unit_field(base: Base, tree: Tree) -> PartField:
    """What a tree on a base measure tells of a part's light, up to a factor."""
    ratio, deviation = (node_values(v).astype(np.float32) for v in (tree.ratio, tree.deviation))
    return PartField(ratio, deviation, base.space, base.direction, 1.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """Base measure, concentration and tree of each part."""

    bases: tuple[Base, ...]
    concentrations: tuple[float, ...]
    trees: tuple[Tree, ...]

    @property
    def log_evidence(self) -> float:
        """Against the base measures, summed over the parts."""
        return sum(tree.log_evidence for tree in self.trees)

    def fields(self, counts: EtendueCounts) -> tuple[PartField, ...]:
        """The parts' fields, each with the flux that was counted on it."""
        charts = counts.surface.parts()
        fields = []
        for chart, base, tree, flux in zip(charts, self.bases, self.trees, counts.part_flux, strict=True):
            unit = unit_field(base, tree)
            integral = _core.LightField([core_part(chart.core(), unit)]).flux()[0]
            fields.append(dataclasses.replace(unit, level=flux / integral))
        return tuple(fields)

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


def choose_concentrations(
    counts: Sequence[PartCounts], bases: tuple[Base, ...], threads: int | None
) -> tuple[float, ...]:
    """For each part the concentration of greatest evidence."""

    def choose(part: PartCounts, base: Base) -> float:
        options = CONCENTRATIONS[base.name]
        evidence = [log_evidence(part.grid, base, c, threads) for c in options]
        return options[int(np.argmax(evidence))]

    return tuple(choose(part, base) for part, base in zip(counts, bases, strict=True))


def grow_candidate(
    counts: EtendueCounts,
    fold: Fold,
    bases: tuple[Base, ...],
    concentrations: Sequence[float],
    threads: int | None,
    positions: Sequence[tuple[float, ...]] = POSITIONS,
) -> Candidate:
    """The candidate's trees, on the counts of a fold, averaged over positions of the grid."""
    trees = [
        grow_symmetric(part.grid, base, c, threads, positions, counts.symmetry)
        for part, base, c in zip(counts[fold], bases, concentrations, strict=True)
    ]
    return Candidate(bases, tuple(concentrations), tuple(trees))
