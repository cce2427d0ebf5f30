"""The threshold of the gridded algorithm judged twice: as the thesis does, and by rays that were kept back."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.goniophotometry.comparison import compare_intensities
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.lightfield.carrier import Surface
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.fitting import Batches, Bins, LitPixels, all_batches, fill_bins, lit_pixels, patches_of
from etendue.lightfield.gridded.gridded_source import GriddedSource, check_threshold, pixels_for
from etendue.lightfield.gridded.pixelated import CentreOn, PixelatedSurface
from etendue.lightfield.gridded.sampling import RECORD
from etendue.quantities.arguments import SURFACE, as_numbers, require, require_callable, require_number
from etendue.quantities.intensity_nodes import check_steps
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayBatch, RayStream, checked_seed
from etendue.quantities.spool import spool
from etendue.quantities.threshold_sweep import ThresholdSweep
from etendue.units import MM2_PER_M2

THRESHOLDS = (5.0, 2.1, 1.0, 0.5, 0.2, 0.1, 0.05, 0.021, 0.01)
"""[%]; 2.1 and 0.021 are those of section 3.2.4 of the thesis, 0.01 that of section 3.3.3."""

PARTS = 10
"""One in so many rays is kept back to judge."""

UNIFORM = 1e-4
"""Share of a uniform light field in every density that is judged: a ray where no light was expected costs 9.2 nats."""


def threshold_sweep(
    rays: RayStream,
    surface: Surface,
    pixel: float = 1.0,
    thresholds: Sequence[float] = THRESHOLDS,
    parallels: int | None = None,
    *,
    centre_on: CentreOn = "auto",
    c_planes: int = 36,
    gamma_step: float = 2.5,
    seed: int = 1,
    progress: Progress | None = None,
) -> ThresholdSweep:
    """Sample rays into patches with one threshold after the other, and judge each: figs. 3.8, 3.9 and 3.13 of the thesis.

    The thesis compares the far field of all patches together with that of the rays. That says little about luminance:
    what is wrong with one patch is made good by the next. Beside it stands a criterion that luminance cannot hide from:
    one ray in ten is kept back, the others are sampled into patches, and the score is the mean logarithm of the
    probability density that these patches give to the rays they have not seen. The difference of two scores is by how
    many nats per ray one light field is nearer to the truth than the other.

    Parameters
    ----------
    rays, surface, pixel, parallels, centre_on
        As of `GriddedSource.fit`.
    thresholds : sequence of float
        [%]
    c_planes : int
        Half planes C in which far fields are compared.
    gamma_step : float
        [°] between the angles γ in which they are compared.
    seed : int
        Chooses the rays that are kept back.
    progress : callable, optional
        Called with the number of rays done, counted over all passes together.

    Returns
    -------
    ThresholdSweep

    Raises
    ------
    ArgumentError
        If a number is out of its domain, or as `GriddedSource.fit` says; also if there are too few rays to keep some back.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> sweep = threshold_sweep(et.RingSource(rays=100_000), Disk(radius=30), pixel=10, thresholds=(5, 0.5, 0.01))
    >>> bool(np.ptp(sweep["ncc"]) < 0.01), float(sweep["threshold"][sweep.best("score")])
    (True, 5.0)
    """
    require(rays, RayStream, "threshold_sweep: rays", "rays, of a file et.read_rays(path)")
    require(surface, Surface, "threshold_sweep: surface", SURFACE)
    require_callable(progress)
    thresholds = as_numbers(thresholds, "threshold_sweep: thresholds", "flux errors in percent").ravel().tolist()
    if not thresholds:
        raise ArgumentError("threshold_sweep: give at least one threshold.")
    for threshold in thresholds:
        check_threshold(threshold)
    checked_seed(seed)
    require(c_planes, int, "threshold_sweep: c_planes", "a whole number of planes")
    require_number(gamma_step, "threshold_sweep: gamma_step", "an angle above 0° and up to 90°")
    check_steps(c_planes, gamma_step)  # refuses what is no grid before the work begins
    pixels = pixels_for(rays, surface, pixel, parallels, centre_on)
    passes = 6
    first = None if progress is None else lambda done: progress(done // passes)
    reference = intensity_distribution(rays, c_planes, gamma_step, progress=first)
    batches = all_batches(rays, passes, progress, done=len(rays))
    models = _Models.of(batches, pixels, thresholds)
    judged = _Models.of(_dealt(batches, seed, held_out=False), pixels, thresholds)
    judges = _gathered(_dealt(batches, seed, held_out=True), rays)
    rows = []
    for number, threshold in enumerate(thresholds):
        model = models.source(number, rays, pixel, threshold)
        far_field = compare_intensities(model.intensity(c_planes, gamma_step), reference)
        score, score_error, held_out = held_out_score(judged.source(number, rays, pixel, threshold), judges)
        flux, patches = model.total_flux, model.patches
        rows.append(
            {
                "threshold": float(threshold),
                "bins": float(patches.bins.mean()),
                "unreached": float((patches.error > threshold).sum()),
                "error": float((patches.error * patches.flux).sum()) / flux,
                "table_flux": model.table_flux / flux,
                "ncc": far_field.ncc,
                "nrmse_thesis": far_field.nrmse_thesis,
                "nrmse": far_field.nrmse,
                "score": score,
                "score_error": score_error,
            }
        )
    on_surface = models.lit.account.rays - models.lit.account.missed
    step = f"threshold swept over {len(thresholds)} values on {pixels.surface.spec}, pixel {pixel:g} mm, seed {seed}"
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return ThresholdSweep(columns, len(models.lit.pixel), on_surface, held_out, rays.provenance.then(step))


@dataclasses.dataclass(frozen=True, eq=False)
class _Models:
    """Gridded sources of the same rays, one for each threshold, in the bins that any of them needs."""

    lit: LitPixels
    bins: Bins
    steps: npt.NDArray[np.intp]

    @classmethod
    def of(cls, batches: Batches, pixels: PixelatedSurface, thresholds: Sequence[float]) -> _Models:
        lit = lit_pixels(batches, pixels)
        steps = np.stack([angular.first_within(lit.errors, threshold) for threshold in thresholds])
        wanted = (steps[:, None, :] == np.arange(len(lit.sequence))[:, None]).any(axis=0)
        return cls(lit, fill_bins(batches, lit, wanted), steps)

    def source(self, number: int, rays: RayStream, pixel: float, threshold: float) -> GriddedSource:
        patches = patches_of(self.lit, self.bins, self.steps[number], rays.flux_unit, rays.provenance)
        # The tables themselves are judged, as the thesis has them.
        return GriddedSource(self.lit.surface, patches, self.lit.account, pixel, threshold).as_printed


def _dealt(batches: Batches, seed: int, held_out: bool) -> Batches:
    """The rays that are kept back, or all others: a ray's lot depends on its number and the seed alone."""

    def some() -> Iterator[RayBatch]:
        for batch in batches():
            lots = _core.deal_parts(batch.start, batch.start + len(batch.usable), PARTS, seed)
            chosen = ((lots == 0) == held_out) & batch.usable
            among = chosen[batch.usable]
            yield RayBatch(batch.start, chosen, batch.position[among], batch.direction[among], batch.flux[among])

    return some


def _gathered(batches: Batches, rays: RayStream) -> RaySet:
    """The rays as a set that can be read again without the others: in memory, or in a temporary file if they are many."""

    def records() -> Iterator[npt.NDArray[Any]]:
        for batch in batches():
            found = np.zeros(len(batch.flux), dtype=RECORD)
            for name in ("position", "direction", "flux"):
                found[name] = getattr(batch, name)
            yield found

    return RaySet.from_records(spool(records(), RECORD), RaySetMeaning(flux_unit=rays.flux_unit))


def held_out_score(source: GriddedSource, judges: RayStream) -> tuple[float, float, int]:
    """Mean of ln(density / uniform density) over rays on the surface.

    Parameters
    ----------
    source : GriddedSource
        Patches.
    judges : RayStream
        Rays that the patches were not made of.

    Returns
    -------
    float, float, int
        The mean by flux [nat per ray], its standard error, and the number of rays.

    Raises
    ------
    ArgumentError
        If none of the rays is on the surface.

    Examples
    --------
    >>> import etendue as et
    >>> grid = et.GriddedSource.fit(et.RingSource(rays=100_000), et.Disk(radius=30), pixel=10, threshold=5)
    >>> score, error, rays = held_out_score(grid, et.RingSource(rays=20_000, seed=2))
    >>> score > 0.1, rays
    (True, 20000)
    """
    surface = source.surface
    # Luminance over flux is the density in étendue, 1 over the étendue of the surface the uniform one.
    scale = surface.etendue / (source.table_flux * MM2_PER_M2)
    rays, flux, total, sums = 0, 0.0, 0.0, np.zeros(3)
    for batch in judges.batches():
        here = (surface.owner(batch.position, batch.direction) >= 0) & (batch.flux > 0.0)
        seen, weight = source.luminance(batch.position[here], batch.direction[here]), batch.flux[here]
        log = np.log((1.0 - UNIFORM) * scale * seen + UNIFORM)
        rays, flux = rays + len(log), flux + float(weight.sum())
        total = total + float((weight * log).sum())
        sums += [float((weight**2 * log**power).sum()) for power in (0, 1, 2)]
    if not rays:
        raise ArgumentError("threshold_sweep: too few rays on the surface to keep some of them back.")
    mean = total / flux
    # Σ w² (ln p - mean)², from its moments.
    variance = float(sums @ [mean * mean, -2.0 * mean, 1.0])
    return mean, math.sqrt(max(variance, 0.0)) / flux, rays
