"""From a ray set to its light field, without tuning parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Literal

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.calibration import calibrate
from etendue.lightfield.candidate import (
    Candidate,
    Score,
    choose_concentrations,
    grow_candidate,
    product_bases,
    score_densities,
    uniform_bases,
)
from etendue.lightfield.counting import EtendueCounts, FloatArray, Fold, count_rays
from etendue.lightfield.etendue_density import EtendueDensity, FitReport
from etendue.lightfield.expected_loss import loss_of_gamma
from etendue.lightfield.pilot_sample import check_near_field, pilot_sample
from etendue.lightfield.selection.search import choose_surface
from etendue.lightfield.surfaces import Surface
from etendue.lightfield.symmetry import fold, order, proven_symmetry
from etendue.lightfield.trees import POSITIONS, Base, Tree
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_threads

Depths = tuple[int, int, int, int]

PILOT_RAYS = 1 << 20
"""Rays on which the shape of the grid and the concentrations are chosen."""

FINEST = 8
"""Halvings of the fine grids over place and over direction for sets of 65 536 rays and more: 256 × 256 cells each."""

SHAPES = (-2, -1, 0, 1, 2)
"""Halvings per coordinate that the place may lend to the direction."""

LEAD = 3.0
"""Standard errors by which the score of a product base must lead to be taken."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """What was chosen before all rays are counted: halvings of the grid, and concentrations by base measure and part."""

    depths: Depths
    concentrations: dict[str, tuple[float, ...]]


def fit_light_field(
    rays: RayStream,
    surface: Surface | Literal["auto"],
    *,
    symmetry: str = "none",
    depths: Depths | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: Progress | None = None,
) -> EtendueDensity:
    """See `LightField.fit`."""
    threads = checked_threads(threads)
    check_near_field(rays)
    notes: tuple[str, ...] = ()
    if isinstance(surface, str):
        if surface != "auto":
            raise ArgumentError(f"surface is {surface!r}; give a Surface, or 'auto'. For text there is parse_surface.")
        choice = choose_surface(rays, seed=seed, threads=threads)
        surface, notes = choice.surface, choice.notes
    surface = surface.sized_for(rays)
    plan = make_plan(rays, surface, depths, seed, threads)
    fine = fine_depths(len(rays), plan.depths)
    counts = count_rays(rays, surface, plan.depths, fine, seed=seed, threads=threads, progress=progress)
    if symmetry == "auto":
        symmetry = proven_symmetry(counts)
        told = "no symmetry is borne out" if symmetry == "none" else f"the rays bear out the symmetry {symmetry}"
        notes = (*notes, f"{told} (χ² of counts and images, 1e-3)")
    if symmetry != "none":
        counts = fold(counts, symmetry)
    field = fit_counts(rays, counts, plan, seed, threads)
    spectrum = rays.total_spectrum(threads=threads)
    return field.replace(notes=(*notes, *field.notes, *notes_of_rays(rays)), spectrum=spectrum)


def notes_of_rays(rays: RayStream) -> tuple[str, ...]:
    """What a field says of its rays, last of all: how many have no wavelength, and their own notes."""
    colours = rays.colours() if isinstance(rays, RaySet) else None
    if colours is None or not colours.unknown_rays:
        return rays.notes
    told = f"{colours.unknown_rays:,} rays with {colours.unknown_share:.3%} of the flux state no wavelength"
    return (f"{told}; the spectrum of the field is that of the others", *rays.notes)


def default_bits(rays: int) -> int:
    """Halvings of the grid in all: the number of cells follows that of the rays."""
    return 16 if rays < 30_000 else 20 if rays < 5_000_000 else 22 if rays < 200_000_000 else 24


def fine_depths(rays: int, depths: Depths) -> tuple[int, int]:
    """Halvings of the fine grids: about one ray in each cell suffices, and none is coarser than the grid itself."""
    wanted = min(FINEST, max(rays, 1).bit_length() // 2)
    return max(wanted, *depths[:2]), max(wanted, *depths[2:])


def make_plan(rays: RayStream, surface: Surface, depths: Depths | None, seed: int, threads: int | None) -> Plan:
    """Choose, on some of the rays, what predicts held-out rays best: the shape of the grid unless it is given.

    From the even shape the search goes on as long as the score rises, on the base measure that is the better one there.
    The grids compared have a quarter of the cells of the one to be filled: what is gained by finer cells along one axis
    and lost by coarser ones along another shows in them, too.
    """
    some = pilot_sample(rays, PILOT_RAYS)
    bits = default_bits(len(rays))
    lends = (0,) if depths else SHAPES
    options = {lend: depths or _depths(min(bits, 20) - 2, lend) for lend in lends}
    fine = fine_depths(len(some), tuple(max(axis) for axis in zip(*options.values(), strict=True)))
    counts = count_rays(some, surface, options[0], fine, seed=seed, threads=threads)
    bases = {
        "uniform": uniform_bases(counts["fitted"]),
        "product": product_bases(counts["fitted"], threads, counts.symmetry),
    }
    concentrations = {name: choose_concentrations(counts["fitted"], b, threads) for name, b in bases.items()}

    def score(counts: EtendueCounts, name: str) -> float:
        candidate = grow_candidate(counts, "fitted", bases[name], concentrations[name], threads, POSITIONS[:1])
        return candidate.score(counts).mean

    if depths:
        return Plan(depths, concentrations)
    first = {name: score(counts, name) for name in bases}
    name = max(first, key=lambda name: first[name])
    best, reached = 0, first[name]
    for step in (1, -1):
        while best * step >= 0 and best + step in options:
            trial = count_rays(some, surface, options[best + step], fine, seed=seed, threads=threads)
            tried = score(trial, name)
            if tried <= reached:
                break
            best, reached = best + step, tried
    return Plan(_depths(bits, best), concentrations)


def _depths(bits: int, lend: int) -> Depths:
    place = bits // 4 - lend
    direction = bits // 2 - place
    return (place, place, direction, direction)


def fit_counts(rays: RayStream, counts: EtendueCounts, plan: Plan, seed: int, threads: int | None) -> EtendueDensity:
    """The field of counted rays: base measures compared on the held-out rays, the better one grown on all."""

    def bases(name: str, fold: Fold) -> tuple[Base, ...]:
        return (
            uniform_bases(counts[fold]) if name == "uniform" else product_bases(counts[fold], threads, counts.symmetry)
        )

    scores: dict[str, Score] = {}
    for name in ("uniform", "product"):
        concentrations = plan.concentrations[name]
        candidate = grow_candidate(counts, "fitted", bases(name, "fitted"), concentrations, threads, POSITIONS[:1])
        scores[name] = candidate.score(counts)
    lead, error = scores["product"].lead(scores["uniform"])
    name = "product" if lead > LEAD * error else "uniform"
    score = scores[name]
    final = grow_candidate(counts, "all", bases(name, "all"), plan.concentrations[name], threads)
    final = dataclasses.replace(final, trees=tuple(_calibrated(counts, final, seed, threads)))
    histogram = score_densities(counts, _histogram(counts))
    report = FitReport(
        rays=counts.rays,
        unmet_rays=counts.unmet_rays,
        unmet_flux=counts.unmet_flux,
        bases=tuple(base.name for base in final.bases),
        concentrations=final.concentrations,
        log_evidence=final.log_evidence,
        score=score.mean,
        score_error=score.error,
        histogram_score=histogram.mean,
        effective_cells=_effective_cells(counts, final),
        symmetry=counts.symmetry,
        effective_rays=counts.tally.effective_rays,
    )
    return EtendueDensity(
        surface=counts.surface,
        parts=final.fields(counts),
        flux_unit=rays.flux_unit,
        report=report,
        provenance=rays.provenance.then(f"light field on {counts.surface.spec}"),
        notes=_notes(counts),
    )


def _calibrated(counts: EtendueCounts, candidate: Candidate, seed: int, threads: int | None) -> Iterator[Tree]:
    """The trees with error bars that also hold the Poisson error of the part's flux."""
    charts = counts.surface.parts()
    parts = zip(charts, counts["all"], candidate.bases, candidate.trees, candidate.concentrations, strict=True)
    for chart, part, base, tree, concentration in parts:
        if part.grid.rays == 0:
            yield tree
            continue
        calibrated = calibrate(chart, part, base, tree, concentration, counts.symmetry, seed, threads)
        deviation = np.sqrt(calibrated.deviation**2 + tree.ratio**2 * order(counts.symmetry) / part.grid.rays)
        yield dataclasses.replace(tree, deviation=deviation)


def _histogram(counts: EtendueCounts) -> FloatArray:
    """At each of some held-out rays the density of the fitted rays in its cell [flux unit/(mm² sr)]."""
    rays = counts.some_held_out
    total = sum(float(part.grid.weight.sum()) for part in counts["fitted"])
    density = np.zeros(len(rays.part))
    for index, (part, chart) in enumerate(zip(counts["fitted"], counts.surface.parts(), strict=True)):
        mine = rays.part == index
        shape = np.array(part.grid.weight.shape)
        cells = np.minimum((rays.coordinates[mine] * shape).astype(np.intp), shape - 1)
        density[mine] = part.grid.weight[tuple(cells.T)] * (part.grid.weight.size / chart.etendue)
    density *= sum(counts.part_flux) / total
    return density


def _effective_cells(counts: EtendueCounts, candidate: Candidate) -> float:
    """2 N Σ m (ψ(k + 1) - ln k) over the cells, k = (L/σ)², m their share of the flux; theory eq. 41."""
    total = 0.0
    for part, base, tree in zip(counts["all"], candidate.bases, candidate.trees, strict=True):
        space, direction = base.masses(tree.ratio.shape)
        mass = tree.ratio * space[:, :, None, None] * direction[None, None]
        sure = np.divide(tree.ratio, tree.deviation, out=np.full_like(tree.ratio, np.inf), where=tree.deviation > 0)
        rays = part.grid.rays / order(counts.symmetry)
        total += 2.0 * rays * float((mass * loss_of_gamma(np.square(sure))).sum())
    return total


def _notes(counts: EtendueCounts) -> tuple[str, ...]:
    notes = []
    if counts.unmet_rays:
        whole = counts.unmet_flux + sum(counts.part_flux)
        notes.append(
            f"{counts.unmet_rays:,} of {counts.rays:,} rays ({counts.unmet_flux / whole:.3%} of the flux) do not meet "
            f"{counts.surface.spec} and are not in the field"
        )
    if counts.tally.unusable:
        notes.append(f"{counts.tally.unusable:,} rays cannot be used and were left out; see the ray set's complaints")
    return tuple(notes)
