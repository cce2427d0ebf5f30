"""Which carrier surface suits a ray set: the meaning of ``surface="auto"``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from etendue.concurrency import on_one_blas_thread
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Disk, Dome, Hemisphere, Plane, Surface
from etendue.lightfield.carrier.part import Triple
from etendue.lightfield.carrier.sizing import SLACK
from etendue.lightfield.carrier.towards import direction_found, upright
from etendue.lightfield.focusing import focused_about
from etendue.lightfield.pilot_sample import FEWEST, even_density, pilot_sample
from etendue.lightfield.selection.front import mean_direction, start_normal
from etendue.lightfield.selection.line_search import golden_section, round_numbers_near
from etendue.lightfield.selection.scorer import WITH_IMAGES, HeldOutScore, SurfaceScorer
from etendue.lightfield.selection.settings import DEFAULT, Grid, SelectionSettings
from etendue.lightfield.selection.trial_surfaces import FLATS, TrialSurfaces
from etendue.lightfield.trees import holding_memory
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream, checked_threads


@dataclasses.dataclass(frozen=True)
class SurfaceScore:
    """One surface that was tried.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    score, score_error : float
        Mean ln of the density in étendue [1/(mm² sr)] at held-out rays, and its standard error.
    lag, lag_error : float
        By how much the score lies below that of the chosen surface, and the standard error of the difference.
    unmet : float
        Share of the flux that does not meet the surface.
    """

    surface: Surface
    score: float
    score_error: float
    lag: float
    lag_error: float
    unmet: float


@dataclasses.dataclass(frozen=True)
class SurfaceChoice:
    """The carrier surface that suits a ray set, and why.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    table : tuple of SurfaceScore
        The best surface of each kind, the best score first.
    depths : tuple of float, or None
        The depths tried that come next to the chosen one, below and above, and are worse for sure [mm]; what lies between
        cannot be told from it. The lowest and highest that were tried, if none is worse; None if no depth was sought.
    notes : tuple of str
        The choice in words.
    others : tuple of Surface
        The others that take up the light, the best score first.
    """

    surface: Surface
    table: tuple[SurfaceScore, ...]
    depths: tuple[float, float] | None
    notes: tuple[str, ...]
    others: tuple[Surface, ...] = ()


@on_one_blas_thread
@holding_memory
def choose_surface(
    rays: RayStream,
    *,
    seed: int = 1,
    threads: int | None = None,
    settings: SelectionSettings = DEFAULT,
    step: Callable[[], None] = lambda: None,
) -> SurfaceChoice:
    """The surface on which the light field predicts held-out rays best; of several as good, the simplest.

    Luminance is the same all along a ray, so any surface that all rays meet can carry the field, and which one it is, is a
    matter of how few rays tell it: one on which place and direction have sharp edges of their own, and no room is wasted.
    Tried are, the simplest first,

    - a rectangle and a disk, at the depth at which the source is sharpest, if no more than half the light heads
      towards −Z;
    - a rectangle about what is bright, in the focus that suits each inclination, with frames for what lies beside it and a
      sphere for all other lines;
    - a hemisphere that all rays come out of, about the centre of the smallest ball that their lines pass, or of the
      sphere on which they start, whichever is the smaller;
    - a dome about the same centre: a window at the depth of the rectangle, and a hemisphere for what does not pass it;
    - a sphere about it;
    - a cylinder along X, Y or Z: the smallest that all lines meet, or about their start points;
    - a box about their start points, or a small one that nearly all lines meet.

    A field of up to 2¹⁶ cells per part, on a uniform base, is fitted to four fifths of some 130 thousand rays and scored on
    the others; see `SurfaceScorer`. A surface replaces a simpler one if it leads by three standard errors of the difference.
    None is chosen that leaves more than a hundredth of the flux unmet, beside that of strays far off, which may be as much
    again, unless all do. If the field then turns out to blur where some of the light comes from, `LightField.fit` tries the
    next ones. Of a source that looks aside, flat surfaces that emit there are tried as well.

    Parameters
    ----------
    rays : RayStream
        With positions.
    seed : int
        Of which rays are held out.
    threads : int, optional
        All cores if None. The choice is the same for any number.
    settings : SelectionSettings
        How many rays are used, on which grids, and what counts as better.
    step : callable
        Called again and again, with nothing, as the search goes on.

    Raises
    ------
    ArgumentError
        If the rays have no position, carry no flux, or fewer than 25 do.

    Examples
    --------
    >>> import etendue as et
    >>> choice = choose_surface(et.RingSource(rays=20_000))
    >>> choice.surface.NAME, choice.surface.z, round(choice.surface.radius, 1)
    ('disk', 0.0, 30.0)
    """
    threads = checked_threads(threads)
    some = pilot_sample(rays, settings.compared_rays)
    if len(some) < FEWEST:
        raise ArgumentError(
            f"{len(some)} rays with flux are too few to choose a carrier surface by; state one, such as sphere."
        )
    return _Search(some, seed, threads, settings, step).choice()


@dataclasses.dataclass(frozen=True, eq=False)
class _Scored:
    """A surface and its score."""

    surface: Surface
    held_out: HeldOutScore

    @property
    def mean(self) -> float:
        return self.held_out.score.mean


class _Search:
    """The surfaces that are tried, and the two scorers: one with some of the rays for the search, one with all."""

    def __init__(
        self, rays: RaySet, seed: int, threads: int | None, settings: SelectionSettings, step: Callable[[], None]
    ) -> None:
        self.settings, self.step = settings, step
        self.rays = rays
        self.trials = TrialSurfaces(rays, seed, settings)
        even = even_density(rays)
        self.scorer = SurfaceScorer.of(rays, even, seed, threads, settings.one_fold_from, settings)
        few = pilot_sample(rays, settings.search_rays)
        self.coarse_scorer = SurfaceScorer.of(few, even, seed, threads, settings.search_one_fold_from, settings)
        self.less = settings.coarser(len(rays))
        strays = 1.0 - float(self.trials.rays.flux.sum() / rays.flux.sum())
        # More light than that is no stray light, however far off: a lamp has a glow about its chip.
        self.most_unmet = settings.most_unmet + (strays if strays <= settings.most_unmet else 0.0)

    def choice(self) -> SurfaceChoice:
        """Try all kinds, then take the simplest that none beats."""
        kinds: list[Sequence[Surface]] = []
        depths = None
        trials, flux = self.trials, self.trials.rays.flux
        backwards = float(flux[~trials.up].sum() / flux.sum())
        if backwards <= self.settings.most_backwards and np.count_nonzero(trials.up) >= FEWEST:
            z, depths = self.depth()
            kinds += [*self.flat_kinds(z), trials.hemispheres(z), trials.domes(z)]
        kinds += filter(None, [trials.spheres(), trials.cylinders(), trials.boxes()])
        finalists = self.finals([self.best(kind) for kind in kinds])
        able = [f for f in finalists if f.held_out.unmet <= self.most_unmet]
        # Closed surfaces are sized without strays: where these are more, and nothing takes them up, what takes up most does.
        least = min(f.held_out.unmet for f in finalists) + self.settings.most_unmet
        able = able or [f for f in finalists if f.held_out.unmet <= least]
        winner = self.simplest(able)
        if (aside := self.aside(winner)) is not None:
            winner, depths = aside
            finalists, able = [winner, *finalists], [winner, *able]
        table = _table(finalists, winner)
        others = sorted((f for f in able if f is not winner), key=lambda f: -f.mean)
        notes = tuple(self.notes(winner, table, depths))
        return SurfaceChoice(winner.surface, table, depths, notes, tuple(f.surface for f in others))

    def flat_kinds(self, z: float) -> list[Sequence[Plane | Disk]]:
        """Rectangles and disks at a depth, and the rectangle in focus, if there is one."""
        flats = self.trials.flats(z)
        kinds: list[Sequence[Plane | Disk]] = [[s for s in flats if isinstance(s, kind)] for kind in (Plane, Disk)]
        sharp = focused_about(z, self.rays, self.trials.seed, self.scorer.threads)
        return kinds if sharp is None else [*kinds, [sharp]]

    def simplest(self, able: Sequence[_Scored]) -> _Scored:
        """The first one that no later one surpasses for sure."""
        winner = able[0]
        for challenger in able[1:]:
            if challenger.held_out.leads(winner.held_out, self.settings):
                winner = challenger
        return winner

    def best(self, kind: Sequence[Surface]) -> Surface:
        """Of surfaces of one kind the best; of those that meet enough of the flux, if there are any."""
        self.step()
        scores = self.coarse_scorer.score_all([(surface.parts(), self.settings.coarse_grid) for surface in kind])
        tried = [_Scored(surface, score) for surface, score in zip(kind, scores, strict=True)]
        able = [t for t in tried if t.held_out.unmet <= self.most_unmet]
        return max(able or tried, key=lambda t: t.mean).surface

    def reduced(self, grid: Grid) -> Grid:
        """A grid as so few rays fill it."""
        place, turn = grid
        return max(place - self.less, 1), max(turn - self.less, 1)

    def finals(self, surfaces: list[Surface]) -> list[_Scored]:
        """The surfaces scored with all rays, each on the grid that suits it; finer ones unless it is hopeless."""
        finer = dict(self.settings.kind_grids)

        def scored(pairs: list[tuple[Surface, Grid]]) -> dict[tuple[Surface, Grid], HeldOutScore]:
            self.step()
            grids = [(surface.parts(), self.reduced(grid)) for surface, grid in pairs]
            return dict(zip(pairs, self.scorer.score_all(grids, WITH_IMAGES), strict=True))

        seen = scored([(surface, grid) for surface in surfaces for grid in finer])
        best = {s: max(finer, key=lambda grid: seen[s, grid].score.mean) for s in surfaces}
        enough = max(score.score.mean for score in seen.values()) - self.settings.hopeless_lag
        hopeful = [(s, grid) for s, grid in best.items() if seen[s, grid].score.mean > enough]
        seen |= scored([(s, fine) for s, grid in hopeful for fine in finer[grid]])
        return [
            _Scored(s, max((v for (t, _), v in seen.items() if t == s), key=lambda v: v.score.mean)) for s in surfaces
        ]

    # --- depth ---------------------------------------------------------------------------------------------------------

    def depth(self) -> tuple[float, tuple[float, float]]:
        """The simplest of the depths that are as good as any, and those next to it that are not [mm].

        Nested rectangles, which fit any source well enough, tell with some of the rays where it is about. There the
        rectangle or disk decides that suits the source best: its own edge is what tells depths apart best.
        """
        settings, trials = self.settings, self.trials
        about, steps = self.about()
        flats = {f: trials.flat(*f, about, trials.few) for f in FLATS}
        kind, within = max(
            flats, key=lambda f: self.coarse_scorer.score(flats[f].parts(), settings.coarse_grid).score.mean
        )
        seen: dict[float, HeldOutScore] = {}
        grid = self.reduced(settings.depth_grid)

        def score(z: float) -> float:
            self.step()
            seen[z] = self.scorer.score(trials.flat(kind, within, z, trials.few).parts(), grid)
            return seen[z].score.mean

        window, tolerance = settings.depth_window * steps, settings.depth_tolerance * steps
        golden_section(score, about - window, about + window, tolerance)
        sharpest = max(seen, key=lambda z: seen[z].score.mean)
        simple = round_numbers_near(sharpest, window, tolerance)
        if np.ptp(trials.position[:, 2]) <= SLACK * trials.radius:
            simple.insert(0, float(trials.position[0, 2]))
        for z in simple:
            score(z)
            if not seen[sharpest].leads(seen[z], settings):
                break
        else:
            z = sharpest
        alike = [z for z, held_out in seen.items() if not seen[sharpest].leads(held_out, settings)]
        below, above = [z for z in seen if z < min(alike)], [z for z in seen if z > max(alike)]
        return z, (max(below, default=min(alike)), min(above, default=max(alike)))

    def about(self) -> tuple[float, float]:
        """About where the source is sharpest, and the length of two steps [mm]: by some rays, over the whole range."""
        settings, trials = self.settings, self.trials
        near = np.arange(-1.0, 1.0 + settings.depth_step, settings.depth_step)
        far = 2.0 ** np.arange(1, settings.depth_doublings + 1)
        places = trials.centre[2] + trials.radius * np.concatenate([-far[::-1], near, far])
        scores = self.coarse_scorer.score_all([(trials.nested(z), settings.coarse_grid) for z in places])
        at = int(np.clip(np.argmax([held_out.score.mean for held_out in scores]), 1, len(places) - 2))
        low, high = float(places[at - 1]), float(places[at + 1])

        def score(z: float) -> float:
            self.step()
            return self.coarse_scorer.score(trials.nested(z), settings.coarse_grid).score.mean

        return golden_section(score, low, high, settings.depth_window * (high - low)), high - low

    # --- in words --------------------------------------------------------------------------------------------------------

    def compared(self, row: SurfaceScore) -> str:
        """A surface that was not chosen: how well it predicts against the chosen one, and why it was not if it is better."""
        told = f"{row.surface.NAME} {-row.lag:+.4f} ± {row.lag_error:.4f}".replace("-", "−")
        if row.unmet > self.most_unmet:
            return f"{told}, but {row.unmet:.2%} of the flux does not meet it"
        return told if row.lag > 0.0 else f"{told}, not for sure better and less simple"

    def notes(
        self, winner: _Scored, table: tuple[SurfaceScore, ...], depths: tuple[float, float] | None
    ) -> Iterator[str]:
        """What the user should know of the choice."""
        others = ", ".join(self.compared(row) for row in table if row.surface != winner.surface)
        yield (
            f"carrier surface {winner.surface.told}: of those that take up the light, the simplest that none surpasses "
            f"for sure in predicting rays held out of the fit ({len(self.scorer.flux):,} rays, the same for all; ln "
            f"likelihood per ray against it: {others})"
        )
        if depths is not None and isinstance(winner.surface, Plane | Disk | Dome):
            low, high = told_apart(*depths)
            yield f"depths between {low} and {high} mm cannot be told from that of {winner.surface.told}"
        yield from self.notes_of_front(winner)

    def notes_of_front(self, winner: _Scored) -> Iterator[str]:
        """What is to be said of a source that looks aside, and has no flat surface that does so too."""
        mean = mean_direction(self.trials.direction, self.trials.rays.flux)
        length, aslant = float(np.linalg.norm(mean)), self.settings.aslant
        looks = getattr(winner.surface, "towards", None) is not None
        if aslant < length and mean[2] < aslant * length and not looks:
            towards = "({:.2f}, {:.2f}, {:.2f})".format(*(mean / length + 0.0))
            yield (
                f"the light heads towards {towards} on average; hemispheres and domes shine towards +Z: if one of these "
                "would suit the source, turn the rays (etendue convert --rotate, in Python rays.rotated)"
            )

    # --- sources that look aside -----------------------------------------------------------------------------------------

    def aside(self, winner: _Scored) -> tuple[_Scored, tuple[float, float]] | None:
        """A flat surface that emits where the source looks, if it is better for sure than what was found; and its depths.

        Where it looks is told exactly by the plane on which rays start, if they do, and else about by their mean direction.
        """
        trials, settings = self.trials, self.settings
        mean = mean_direction(trials.direction, trials.rays.flux)
        length = float(np.linalg.norm(mean))
        if length <= settings.aslant:
            return None
        normal = start_normal(trials.position, mean)
        towards = direction_found(mean / length if normal is None else normal)
        flat = isinstance(winner.surface, Plane | Disk | Hemisphere | Dome)
        if towards is None or (normal is None and flat):
            return None
        if math.degrees(math.atan2(math.hypot(*towards[:2]), towards[2])) <= settings.least_tilt:
            return None
        found = self.flat_aside(towards)
        return found if found is not None and found[0].held_out.leads(winner.held_out, settings) else None

    def flat_aside(self, towards: Triple) -> tuple[_Scored, tuple[float, float]] | None:
        """The best flat surface that emits in a direction, and its depths; None if none takes up the light.

        Sought among the rays as they are for whoever looks there. Nothing that is compared changes where everything is
        turned: neither densities in étendue nor who is held out.
        """
        search = _Search(upright(self.rays, towards), self.trials.seed, self.scorer.threads, self.settings, self.step)
        if np.count_nonzero(search.trials.up) < FEWEST:
            return None
        z, depths = search.depth()
        kinds = search.flat_kinds(z)
        found = [f for f in search.finals([search.best(k) for k in kinds]) if f.held_out.unmet <= search.most_unmet]
        if not found:
            return None
        best = search.simplest(found)
        assert isinstance(best.surface, Plane | Disk)  # noqa: S101 - flat kinds are
        return _Scored(dataclasses.replace(best.surface, towards=towards), best.held_out), depths


def told_apart(low: float, high: float) -> tuple[str, str]:
    """Two numbers to four digits, or to as many as give their difference three.

    Examples
    --------
    >>> told_apart(-0.0026812, 0.0071653), told_apart(-10_000.0026812, -9999.9928347)
    (('-0.002681', '0.007165'), ('-10000.00268', '-9999.992835'))
    """
    apart, largest = high - low, max(abs(low), abs(high))
    digits = max(4, math.ceil(math.log10(largest / apart)) + 3) if 0.0 < apart < largest else 4
    return f"{low:.{digits}g}", f"{high:.{digits}g}"


def _table(finalists: list[_Scored], winner: _Scored) -> tuple[SurfaceScore, ...]:
    """One row for each kind."""
    rows = []
    for tried in sorted(finalists, key=lambda t: -t.mean):
        score = tried.held_out.score
        lag, lag_error = winner.held_out.score.lead(score)
        rows.append(SurfaceScore(tried.surface, score.mean, score.error, lag, lag_error, tried.held_out.unmet))
    return tuple(rows)
