"""Fields of other rays of the same light: what a number made of a field would have been with them.

Errors of cells and pixels say nothing of what they err together, and sums over many of them have errors that hang on just
that. Counts are drawn from the field, as many as it rests on, and fitted as its own were (parametric bootstrap,
[EfronTibshirani1993]_ chapter 6): whatever is made of all these fields varies as it does over sets of rays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from etendue.concurrency import on_one_blas_thread
from etendue.lightfield.calibration import dealt_to_fine
from etendue.lightfield.candidate import Images, PartEstimate, grow_part, images_of
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import EtendueDensity, PartField
from etendue.lightfield.symmetry import order, sum_of_images
from etendue.lightfield.trees import POSITIONS, holding_memory

PURPOSE = 0x5245_4452
"""Keeps these random numbers apart from all others."""


def redrawn_parts(
    field: EtendueDensity, count: int, seed: int, threads: int | None = None
) -> Iterator[tuple[PartField, ...]]:
    """The parts of fields fitted to rays that are drawn from a field: as many equal ones as its own are worth.

    The surface, its grids and the recipes are those of the field. The flux of all parts together is that of the field, and
    is shared out among them as the rays are. Trees stand in one position of the grid: a little rougher than an average.

    Parameters
    ----------
    field : EtendueDensity
        With a report of how it was fitted.
    count : int
        Number of fields.
    seed : int
        Of the rays that are drawn.
    threads : int, optional
        All cores if None. The result has the same bits for any number.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=5000), et.Disk(radius=30), depths=(2, 2, 2, 2))
    >>> others = [field.replace(parts=parts) for parts in redrawn_parts(field, 2, 1)]
    >>> [round(other.total_flux, 6) for other in others]
    [600.0, 600.0]
    """
    images: list[Images] | None = None
    known = _known(field, threads)
    for number in range(count):
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, PURPOSE, number))))
        estimates, rays = _fitted(field, known, images, rng, threads)
        # The concentrations of images are those of the first: all are of the same light.
        images = images or [estimate.images for estimate in estimates]
        flux_per_ray = field.total_flux / max(sum(rays), 1.0)
        yield tuple(found.field(own * flux_per_ray) for found, own in zip(estimates, rays, strict=True))


def rays_worth(field: EtendueDensity) -> float:
    """How many equal rays tell as much as those that a field rests on.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=5000), et.Disk(radius=30), depths=(2, 2, 2, 2))
    >>> round(rays_worth(field))                                                  # of unequal flux
    3324
    """
    report = field.report
    worth = report.effective_rays if math.isfinite(report.effective_rays) else float(report.rays)
    return worth * field.total_flux / (field.total_flux + report.unmet_flux)


def _known(field: EtendueDensity, threads: int | None) -> list[FloatArray]:
    """Of each part the rays that are expected in each cell."""
    expected = []
    for index, part in enumerate(field.parts):
        means = field.core.cell_means(index, threads)[0].reshape(part.ratio.shape)
        whole = float(means.sum())
        share = field.part_flux[index] / field.total_flux
        expected.append(means * (share * rays_worth(field) / whole) if whole > 0.0 else np.zeros_like(means))
    return expected


@on_one_blas_thread
@holding_memory
def _fitted(
    field: EtendueDensity,
    known: list[FloatArray],
    like: list[Images] | None,
    rng: np.random.Generator,
    threads: int | None,
) -> tuple[list[PartEstimate], list[float]]:
    """What is found of the light of each part from drawn counts, and how many rays it has."""
    report, estimates, rays = field.report, [], []
    for index, (chart, part) in enumerate(zip(field.surface.parts(), field.parts, strict=True)):
        counts, images = _drawn(known[index], part, report.symmetry, rng), Images()
        if part.space is not None and part.direction is not None:
            before = None if like is None else like[index]
            images = images_of(counts, chart, threads, report.symmetry, like=before)
        recipe, concentration = report.bases[index], report.concentrations[index]
        one = POSITIONS[:1]
        estimates.append(grow_part(counts, chart, recipe, images, concentration, threads, report.symmetry, one))
        rays.append(float(counts.grid.weight.sum()))
    return estimates, rays


def _drawn(known: FloatArray, part: PartField, symmetry: str, rng: np.random.Generator) -> PartCounts:
    """Counts of a part; of a symmetric field fewer rays are drawn, and folded as those of its own were."""
    grid = rng.poisson(known / order(symmetry)).astype(np.float64)
    fine = (
        dealt_to_fine(grid.sum(axis=(2, 3)), part.space, rng),
        dealt_to_fine(grid.sum(axis=(0, 1)), part.direction, rng),
    )
    return PartCounts(*(Sums(sum_of_images(cells, symmetry), None) for cells in (grid, *fine)))
