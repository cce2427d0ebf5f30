"""From a ray set to its light field, without tuning parameters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from etendue.concurrency import on_one_blas_thread
from etendue.errors import ArgumentError
from etendue.lightfield.beam_search import with_beam
from etendue.lightfield.calibration import calibrate
from etendue.lightfield.candidate import (
    FINE_POSITIONS,
    RECIPES,
    Candidate,
    Images,
    PartEstimate,
    Score,
    all_images,
    choose_concentrations,
    grow_candidate,
    grow_candidates,
    score_densities,
)
from etendue.lightfield.carrier import Disk, Plane, Surface
from etendue.lightfield.close_lines import TOLD, blurred_share, crowding, told_of_blur
from etendue.lightfield.counting import Depths, EtendueCounts, FloatArray, PartGrids, count_rays
from etendue.lightfield.etendue_density import EtendueDensity, FitReport
from etendue.lightfield.expected_loss import loss_of_gamma
from etendue.lightfield.fit_progress import FitProgress, Step
from etendue.lightfield.focusing import focused
from etendue.lightfield.narrow_beams import told_of_narrow_beams
from etendue.lightfield.pilot_sample import check_near_field, lit_rays, pilot_sample
from etendue.lightfield.selection.search import choose_surface
from etendue.lightfield.symmetry import SYMMETRIES, fold, order, proven_symmetry, refutation
from etendue.lightfield.trees import POSITIONS, holding_memory
from etendue.quantities.arguments import (
    SURFACE,
    as_numbers,
    as_whole,
    require,
    require_callable,
    require_known,
    require_number,
)
from etendue.quantities.distinct_rays import DistinctRays
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_seed, checked_threads

PILOT_RAYS = 1 << 20
"""Rays on which the shape of the grid and the concentrations are chosen."""

FINEST = 9
"""Halvings of the fine grids over place and over direction for sets of 262 144 rays and more: 512 × 512 cells each."""

FINEST_DIRECTION = 8
"""Halvings of the fine grids over direction, whose images are never as sharp."""

MOST_FINEST = 12
"""Halvings of the fine grid over place that may be asked for: 4096 × 4096 cells, which take some gigabytes."""

PILOT_FINEST = 8
"""The same where shapes of the grid are compared: how sharp the images are is the same for all of them."""

SHAPES = (-2, -1, 0, 1, 2)
"""Halvings per coordinate that the place may lend to the direction."""

FEW = 1.0 / 16.0
"""Share of the rays of the part that has the most below which a part gets a grid of its own."""

FEWEST_BITS, MOST_PILOT_BITS = 16, 20
"""Halvings in all of the grids that are compared, in steps of 4. Where images tell most, few cells do as well as many, in
a sixteenth of the time; sets of very many rays may fill more than the pilot's."""

LEAST_LEAD = 1e-3
"""[nat per ray] A smaller lead of a finer grid shows in no map."""

LEAST_GAIN = 1.0
"""[nat] What another shape of the grid has to gain on all held-out rays together. Where the images tell all there is, no
shape does better than another, and roundings would lead to the longest one, which serves later steps badly."""

LEAD = 3.0
"""Standard errors by which the score of a finer grid must lead a coarser one's to be taken."""


MOST_TRIED = 2
"""Surfaces that are tried in place of one that blurs some of the light, until one is taken: each takes as long as it."""

LESS_BLURRED = 0.5
"""Share of the light blurred by another surface, against the chosen one, below which it is taken instead."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """What was chosen before all rays are counted.

    Parameters
    ----------
    grids : tuple of PartGrids
        Those of each part.
    concentrations : dict
        By recipe, of each part.
    recipes : tuple of str
        Those that some of the rays leave open: one, if it leads the others for sure.
    """

    grids: tuple[PartGrids, ...]
    concentrations: dict[str, tuple[float, ...]]
    recipes: tuple[str, ...] = tuple(RECIPES)


@on_one_blas_thread
@holding_memory
def fit_light_field(
    rays: RayStream,
    surface: Surface | Literal["auto"],
    *,
    symmetry: str = "none",
    depths: Depths | None = None,
    max_resolution: float | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: Progress | None = None,
) -> EtendueDensity:
    """See `LightField.fit`."""
    threads, seed = checked_threads(threads), checked_seed(seed)
    require(rays, RayStream, "LightField.fit: rays", "rays, of a file et.read_rays(path)")
    if max_resolution is not None:
        require_number(max_resolution, "max_resolution", "the side of the finest cells in mm, or None")
    if max_resolution is not None and not 0.0 < max_resolution < math.inf:
        raise ArgumentError(f"max_resolution is {max_resolution}; give the side of the finest cells, a length in mm.")
    require_known(symmetry, (*SYMMETRIES, "none", "auto"), "symmetry")
    depths = None if depths is None else _checked_depths(depths)
    require_callable(progress)
    require(surface, (str, Surface), "LightField.fit: surface", f"'auto', or {SURFACE}")
    check_near_field(rays)
    told = FitProgress(progress, len(rays), isinstance(surface, str))
    # Of copies some would be held out and others fitted, so that a field that remembers rays would seem to predict them.
    given, distinct = rays, DistinctRays.of(rays)
    rays, repeated = distinct.rays, _told_of_copies(distinct)
    notes: tuple[str, ...] = ()
    others: tuple[Surface, ...] = ()
    if isinstance(surface, str):
        if surface != "auto":
            raise ArgumentError(f"surface is {surface!r}; give a Surface, or 'auto'. For text there is parse_surface.")
        told.begin("surface")
        choice = choose_surface(rays, seed=seed, threads=threads, step=told.step)
        surface, notes, others = choice.surface, choice.notes, choice.others
        # The search has tried a focus, and has taken it or not.
    else:
        told.begin("focus")
        surface = focused(surface, rays, seed, threads) if isinstance(surface, Plane) else surface.sized_for(rays)

    def fitted(surface: Surface) -> tuple[EtendueDensity, FloatArray]:
        field = _fit_on(rays, surface, symmetry, depths, max_resolution, seed, threads, told)
        return field, crowding(rays, field)

    if isinstance(surface, Plane | Disk):
        surface = with_beam(surface, rays, seed, threads, is_centred=symmetry != "none")
    field, crowded = fitted(surface)
    if others and blurred_share(crowded) >= TOLD:
        # Scores are means over all light: a surface that blurs some of it far too much may have the best one.
        before = blurred_share(crowded)
        tries = ((*fitted(other), other.told) for other in others[:MOST_TRIED])
        better = next((found for found in tries if blurred_share(found[1]) < LESS_BLURRED * before), None)
        if better is not None:
            field, crowded, name = better
            now = blurred_share(crowded)
            notes = (*notes, f"{name} in its place, which blurs {now:.0%} of the light and not {before:.0%}")
    spectrum = given.total_spectrum(threads=threads)
    told.end()
    notes = (*notes, *field.notes, *told_of_blur(field.surface, crowded), *repeated, *notes_of_rays(given))
    return field.replace(notes=notes, spectrum=spectrum)


def _checked_depths(given: Depths) -> Depths:
    """Four whole numbers, as a tuple of Python's own."""
    # The images have as many halvings at least, along both of their sides.
    what, wanted = "LightField.fit: depths", f"four whole numbers from 0 to {MOST_FINEST}, or None"
    shape = as_numbers(given, what, wanted).shape
    if shape != (4,):
        raise ArgumentError(f"{what} has shape {shape}; give {wanted}.")
    s1, s2, a, b = (as_whole(one, f"{what}: one of them", 0, MOST_FINEST) for one in given)
    return s1, s2, a, b


def _fit_on(
    rays: RayStream,
    surface: Surface,
    symmetry: str,
    depths: Depths | None,
    max_resolution: float | None,
    seed: int,
    threads: int | None,
    told: FitProgress,
) -> EtendueDensity:
    """The field on one surface."""
    told.begin("grid")
    plan = make_plan(rays, surface, depths, seed, threads, finest_for(surface, max_resolution), told.step)
    notes = tuple(not_so_fine(surface, max_resolution, plan.grids[0].fine[0]))
    counts = count_rays(rays, surface, plan.grids, seed=seed, threads=threads, progress=told.counted)
    if symmetry == "auto":
        symmetry = proven_symmetry(counts)
        found = "no symmetry is borne out" if symmetry == "none" else f"the rays bear out the symmetry {symmetry}"
        notes = (*notes, f"{found} (χ² of counts and images, 1e-3)")
    elif symmetry != "none" and (refuted := refutation(counts, symmetry)) is not None:
        notes = (*notes, refuted)
    if symmetry != "none":
        counts = fold(counts, symmetry)
    field = fit_counts(rays, counts, plan, seed, threads, told)
    return field.replace(notes=(*notes, *field.notes))


def _told_of_copies(distinct: DistinctRays) -> tuple[str, ...]:
    if distinct.told is None:
        return ()
    if distinct.excess > 1.0:
        return (f"{distinct.told}: errors and resolution take each for a ray of its own, and are too good",)
    return (f"{distinct.told}: the field rests on {len(distinct.rays):,} rays, each with the flux of all its copies",)


def finest_for(surface: Surface, max_resolution: float | None) -> int:
    """Halvings of the fine grid over place so that no side of the first part's cells is longer [mm], or the most."""
    return FINEST if max_resolution is None else min(_wanted_halvings(surface, max_resolution), MOST_FINEST)


def _wanted_halvings(surface: Surface, max_resolution: float) -> int:
    side = max(surface.parts()[0].sides)
    return max(math.ceil(math.log2(side / max_resolution) - 1e-9), 1)


def not_so_fine(surface: Surface, max_resolution: float | None, halvings: int) -> Iterator[str]:
    """What is to be said where a fine grid of so many halvings has to do, and finer cells were asked for."""
    if max_resolution is None or halvings >= _wanted_halvings(surface, max_resolution):
        return
    side = max(surface.parts()[0].sides) / 2**halvings
    if halvings >= MOST_FINEST:
        yield (
            f"cells of {max_resolution:g} mm would be more than {2**MOST_FINEST:,} × {2**MOST_FINEST:,} on "
            f"{surface.told}: they have {side:.3g} mm; state a smaller surface for finer ones"
        )
    else:
        yield f"cells of {max_resolution:g} mm would be more than there are rays: they have {side:.3g} mm"


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


def grids_for(rays: int, depths: Depths, finest: int = FINEST) -> PartGrids:
    """The grids of a part with so many rays: fine ones have about one in each cell, and are not coarser than the others."""
    wanted = max(rays, 1).bit_length() // 2
    place, direction = min(finest, wanted), min(finest, FINEST_DIRECTION, wanted)
    return PartGrids(depths, (max(place, *depths[:2]), max(direction, *depths[2:])))


def make_plan(
    rays: RayStream,
    surface: Surface,
    depths: Depths | None,
    seed: int,
    threads: int | None,
    finest: int = FINEST,
    step: Step = lambda: None,
) -> Plan:
    """Choose, on some of the rays, what predicts held-out rays best: the shape of the grid unless it is given.

    From an even shape the search goes on as long as the score rises, by the recipe that is the best one there; then from
    its best shape with sixteen times the cells, as long as these predict better for sure. The grids compared have a quarter
    of the cells of the one to be filled: what is gained by finer cells along one axis and lost by coarser ones along another
    shows in them, too. Parts with few rays have grids of their own, no larger than these fill; where the grid is given, only
    those of a plane, whose frames are found and not stated.
    """
    some = pilot_sample(rays, PILOT_RAYS)
    first_look = count_rays(some, surface, PartGrids((1, 1, 1, 1), (1, 1)), seed=seed, threads=threads)
    # Rays without flux and those that cannot be used make no grid finer.
    lit = lit_rays(rays, some)
    bits = default_bits(lit)
    shares = np.array([part.grid.rays for part in first_look["all"]]) / first_look.rays
    few = (shares < FEW * shares.max()) & (depths is None or isinstance(surface, Plane))

    def grids(number: int, own: Depths, finest: int = finest) -> tuple[PartGrids, ...]:
        return tuple(
            grids_for(round(share * number), depths_for(round(share * number)) if is_few else own, finest)
            for share, is_few in zip(shares, few, strict=True)
        )

    def counted(own: Depths) -> EtendueCounts:
        step()
        return count_rays(some, surface, grids(first_look.rays, own, PILOT_FINEST), seed=seed, threads=threads)

    if depths:
        trial = counted(depths)
        return Plan(grids(lit, depths), choose_concentrations(trial, _pilot_images(trial, threads), threads))
    chosen = _search(counted, min(bits, FEWEST_BITS), 0, threads)
    while chosen.bits < min(bits, MOST_PILOT_BITS):
        if not _leads(_finer_score(counted, chosen, threads), chosen.score):
            break
        chosen = _search(counted, chosen.bits + 4, chosen.lend, threads)
    if chosen.bits == MOST_PILOT_BITS:
        chosen = dataclasses.replace(chosen, bits=bits)
    return Plan(grids(lit, _depths(chosen.bits, chosen.lend)), chosen.concentrations, chosen.recipes)


@dataclasses.dataclass(frozen=True)
class _Shape:
    """A shape of the grid, what is best on it, and how well that predicts."""

    bits: int
    lend: int
    concentrations: dict[str, tuple[float, ...]]
    score: Score
    recipes: tuple[str, ...]


def _search(counted: Callable[[Depths], EtendueCounts], bits: int, lend: int, threads: int | None) -> _Shape:
    """The best shape of a grid of so many halvings, from one shape on as long as the score gains anything."""
    trial = counted(_depths(bits - 2, lend))
    images = _pilot_images(trial, threads)
    concentrations = choose_concentrations(trial, images, threads)
    scores = {name: c.score(trial) for name, c in grow_candidates(trial, images, concentrations, threads).items()}
    recipe = max(scores, key=lambda name: scores[name].mean)
    best, reached = lend, scores[recipe]
    for step in (1, -1):
        while (best - lend) * step >= 0 and best + step in SHAPES:
            trial = counted(_depths(bits - 2, best + step))
            c = concentrations[recipe]
            tried = grow_candidate(trial, "fitted", recipe, images, c, threads, POSITIONS[:1]).score(trial)
            if not (tried.mean - reached.mean) * len(tried.values) > LEAST_GAIN:
                break
            best, reached = best + step, tried
    return _Shape(bits, best, concentrations, reached, _not_beaten(scores))


def _finer_score(counted: Callable[[Depths], EtendueCounts], chosen: _Shape, threads: int | None) -> Score:
    """What a grid of the same shape with sixteen times the cells predicts, by the recipe that is best there."""
    trial = counted(_depths(chosen.bits + 2, chosen.lend))
    grown = grow_candidates(trial, _pilot_images(trial, threads), chosen.concentrations, threads)
    return max((c.score(trial) for c in grown.values()), key=lambda score: score.mean)


def _not_beaten(scores: dict[str, Score]) -> tuple[str, ...]:
    """Recipes that the best one does not lead for sure, itself among them."""
    best = max(scores.values(), key=lambda score: score.mean)
    return tuple(name for name, score in scores.items() if not _leads(best, score))


def _leads(finer: Score, coarser: Score) -> bool:
    lead, error = finer.lead(coarser)
    return lead > max(LEAD * error, LEAST_LEAD)


def _pilot_images(counts: EtendueCounts, threads: int | None) -> tuple[Images, ...]:
    return all_images(counts, "fitted", threads, FINE_POSITIONS[:4])


def depths_for(rays: int) -> Depths:
    """An even grid for a part with few rays: about as many cells as rays, and at most those that others have."""
    bits = 4 * max(2, (max(rays, 1).bit_length() + 1) // 4)
    return _depths(min(bits, default_bits(rays)), 0)


def _depths(bits: int, lend: int) -> Depths:
    place = bits // 4 - lend
    direction = bits // 2 - place
    return (place, place, direction, direction)


def fit_counts(
    rays: RayStream, counts: EtendueCounts, plan: Plan, seed: int, threads: int | None, told: FitProgress
) -> EtendueDensity:
    """The field of counted rays: recipes compared on the held-out rays, the best one followed with all."""
    told.begin("recipe")
    images = all_images(counts, "fitted", threads, FINE_POSITIONS[:4])
    candidates = grow_candidates(counts, images, plan.concentrations, threads, plan.recipes)
    scores = {name: candidate.score(counts) for name, candidate in candidates.items()}
    recipe = max(scores, key=lambda name: scores[name].mean)
    score, c = scores[recipe], plan.concentrations[recipe]
    told.begin("field")
    final = grow_candidate(counts, "all", recipe, all_images(counts, "all", threads, like=images), c, threads)
    told.begin("errors")
    final = Candidate(tuple(_calibrated(counts, final, seed, threads, told.step)))
    histogram = score_densities(counts, _histogram(counts))
    report = FitReport(
        rays=counts.rays,
        unmet_rays=counts.unmet_rays,
        unmet_flux=counts.unmet_flux,
        bases=tuple(part.recipe for part in final.parts),
        concentrations=tuple(part.concentration for part in final.parts),
        log_evidence=final.log_evidence,
        score=score.mean,
        score_error=score.error,
        histogram_score=histogram.mean,
        effective_cells=_effective_cells(counts, final),
        symmetry=counts.symmetry,
        effective_rays=counts.tally.effective_rays,
    )
    parts = final.fields(counts)
    return EtendueDensity(
        surface=counts.surface,
        parts=parts,
        flux_unit=rays.flux_unit,
        report=report,
        provenance=rays.provenance.then(f"light field on {counts.surface.spec}"),
        notes=(*_notes(counts), *told_of_narrow_beams(counts.surface.parts(), parts, counts.part_flux)),
    )


def _calibrated(
    counts: EtendueCounts, candidate: Candidate, seed: int, threads: int | None, step: Step
) -> Iterator[PartEstimate]:
    """The estimates with error bars that also hold the Poisson error of the part's flux."""
    for found, part in zip(candidate.parts, counts["all"], strict=True):
        if part.grid.rays == 0:
            yield found
            continue
        tree, errors = calibrate(found, part, counts.symmetry, seed, threads, step)
        deviation = np.sqrt(tree.deviation**2 + tree.ratio**2 * order(counts.symmetry) / part.grid.rays)
        yield dataclasses.replace(found, tree=dataclasses.replace(tree, deviation=deviation), errors=errors)


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
    """2 N Σ m (ψ(k + 1) - ln k) over the cells, k = (L/σ)², m their share of the flux; theory eq. 43."""
    total = 0.0
    for part, found in zip(counts["all"], candidate.parts, strict=True):
        tree = found.tree
        space, direction = found.base.masses(tree.ratio.shape)
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
            f"{counts.surface.told} and are not in the field"
        )
    if counts.tally.unusable:
        notes.append(f"{counts.tally.unusable:,} rays cannot be used and were left out; see the ray set's complaints")
    return tuple(notes)
