"""Maps of a scene: lines of sight followed from the eye through the optics to the sources."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.luminance.caustics import SPOT_RAYS, Forward, LightImages, Plan, bright_spots, plan
from etendue.luminance.gathering import (
    FIRST_CHECK,
    LEAST_LINES,
    MOST_FACES,
    MOST_SEGMENTS,
    NOT_TAKEN,
    PILOT,
    SCOUTS,
    UNKNOWN,
    Comparison,
    Look,
    Pilot,
    common_spread,
    survey_notes,
)
from etendue.luminance.methods import PathTracing
from etendue.luminance.passes import MOST_TIMES, Passes
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.scatter.building import core_scene
from etendue.scene import Compiled, Scene, compile_scene
from etendue.scene.compiling import Record
from etendue.scene.placement import Placement
from etendue.scene.sources.from_files import Field, Rays
from etendue.scene.sources.gridded import Gridded
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]
Left = Literal["nothing", "caustics", "scattered"]
"""Light that lines of sight leave to rays traced forwards."""

LINES_AT_ONCE = 1 << 20
"""Lines of sight after which progress is told, or one pass: passes that are made at once share threads and memory."""

MOST_EVENTS = 10_000
"""Surfaces that a line of sight may meet."""

GIVEN_UP = 1e-4
"""Share of the weight of all lines that may be given up, or lost, without a word."""

SPOTS = (
    "of what diffuse surfaces see, a part is looked for at small bright places of others, as beside a lamp, which "
    f"{SPOT_RAYS:,} rays forwards found"
)


class SeenScene:
    """A scene that is ready to be looked at, from one observer or from many, one after the other.

    Parameters
    ----------
    scene : Scene
    cache : bool
        Whether light fields of its rays may be taken from those fitted before.
    threads : int, optional

    Raises
    ------
    SceneError
        If the scene has mistakes.
    ArgumentError
        If it has no sources.
    """

    def __init__(self, scene: Scene, *, cache: bool = True, threads: int | None = None) -> None:
        seeable, self.notes = with_fields(scene, checked_threads(threads), cache=cache)
        self.compiled = compile_scene(seeable)
        if not self.compiled.record["sources"]:
            raise ArgumentError(f"{scene.name or 'the scene'} has no source: there is nothing to see.")
        self._threads = threads
        self.core = core_scene({**self.compiled.record, "detectors": []})
        self.origin = Provenance(scene.name or "scene", "traced scene", fingerprint(self.compiled.record))

    @cached_property
    def spots(self) -> _core.BrightSpots:
        """Small bright places of its surfaces."""
        return bright_spots(self.compiled.record, self._threads)


def look_at_scene(
    scene: Scene | SeenScene,
    pairs: Sequence[tuple[Observer, Screen]],
    how: PathTracing,
    progress: Progress | None = None,
    scattered: Sequence[Forward] | None = None,
    *,
    cache: bool = True,
    threads: int | None = None,
) -> list[LuminanceMap]:
    """The maps of a scene for observers with their screens; see `luminance_map`.

    `scattered`, if given, has all light that reaches each observer directly from diffuse surfaces; only the rest is looked
    for.

    Raises
    ------
    SceneError
        If the scene has mistakes.
    ArgumentError
        If it has no sources, or a screen has no apparent area.
    """
    threads = checked_threads(threads)
    views = [screen.core_view(observer) for observer, screen in pairs]
    seen = scene if isinstance(scene, SeenScene) else SeenScene(scene, cache=cache, threads=threads)
    compiled, core = seen.compiled, seen.core
    forward = _forward(core, compiled, views, how, threads, wanted=scattered is None)
    images = forward.images
    notes = [*compiled.notes, *seen.notes, *_unseen(compiled, forwards=scattered is not None or images is not None)]
    notes += [] if scattered is not None else forward.notes(how)
    spots = None if how.forward_rays == 0 else seen.spots
    notes += [SPOTS] if spots is not None and spots.exist() else []
    left: Left = "scattered" if scattered is not None else "caustics" if images is not None else "nothing"
    surveys = _Surveys(core, compiled.record, how.seed, threads)
    maps, done = [], 0
    for number, ((observer, screen), view, small) in enumerate(zip(pairs, views, forward.plan.glints, strict=True)):
        given_up = lost = 0.0

        def look(
            first: int,
            last: int,
            known: _core.Survey | None,
            view: _core._View = view,
            small: _core.Glints = small,
        ) -> list[list[Array]]:
            nonlocal given_up, lost
            guides = forward.shared, forward.plan.guide, small, spots
            *found, weights = _core.look_at_scene(
                core, view, how.paths, how.seed, MOST_EVENTS, left, first, last, threads, known, *guides
            )
            ended = np.array(weights) / ((last - first) * view["columns"] * view["rows"])
            given_up, lost = np.maximum((given_up, lost), ended).tolist()
            return [list(sums) for sums in zip(*found, strict=True)]

        def advance(passes: int, lines: int = how.paths * screen.columns * screen.rows) -> None:
            nonlocal done
            done += passes * lines
            if progress is not None:
                progress(done)

        image = None if scattered is None else scattered[number]
        rows, columns = (slice(*ends) for ends in core.window(view))
        window = rows, columns
        eye = _Eye(look, advance, how, screen, screen.cosine(observer), window, images, number, image)
        passes, common, about = eye.best(surveys)
        image = eye.image
        paths = how.paths * passes.done
        told = [
            f"{paths:,} lines of sight per pixel, in {passes.done} independent passes",
            *passes.notes(how.until, image),
        ]
        if small.pixels():
            told.append(
                f"lamps are small against the pixel in {small.pixels():,} of them, directly, in mirrors or through lenses: "
                "at least as many lines of sight again look there; what the search for them missed is left to chance, and a "
                "pixel that no line of sight lit states no error"
            )
        told += about
        values, error = passes.total(image)
        if not values.any():
            told.append("the map is dark")
        if given_up > GIVEN_UP:
            told.append(
                f"lines of sight that met {MOST_EVENTS:,} surfaces were given up; they had {given_up:.2g} of the weight of "
                "all lines left: the map is too low by what they would still have seen, and no error says so"
            )
        if lost > GIVEN_UP:
            told.append(
                f"lines of sight with {lost:.2g} of the weight of all were lost: they met faces that contradict the solids "
                "they came from, as at edges and where solids are not closed or reach into each other, or were in more than "
                "four solids at once; the map is too low by what they would have seen, and no error says so"
            )
        if image is not None:
            told.append(image.note)
        if images is not None:
            told[-1] += f", beside {paths * screen.columns * screen.rows:,} lines of sight"
        maps.append(
            LuminanceMap(
                values * MM2_PER_M2,
                np.hypot(error, common * values) * MM2_PER_M2,
                np.full(screen.shape, paths),
                observer,
                screen,
                compiled.flux_unit,
                seen.origin.then(f"luminance by {paths:,} lines of sight per pixel, seed {how.seed}"),
                (*told, *notes),
                math.hypot(common, passes.stated_error(image)),
            )
        )
    return maps


class _Surveys:
    """The patches of a scene, surveyed when they are first asked for."""

    def __init__(self, core: _core.Scene, record: Record, seed: int, threads: int | None) -> None:
        self._made_of = core, seed, MOST_EVENTS, threads
        self._few = len(record["faces"]) <= MOST_FACES

    @cached_property
    def may_pay(self) -> bool:
        """Whether to try them unasked: of few faces, and rays that come to an end."""
        core, seed, events, threads = self._made_of
        if not self._few:
            return False
        segments = _core.work_unit(core, SCOUTS, seed, events, 0, 1, threads)["ledger"]["segments"]
        return bool(segments <= MOST_SEGMENTS * SCOUTS)

    @cached_property
    def found(self) -> _core.Survey:
        """The survey."""
        return _core.Survey(*self._made_of)


@dataclasses.dataclass(eq=False)
class _Eye:
    """The map of one observer in the making.

    Parameters
    ----------
    look : callable
        The sums of passes.
    advance : callable
        Called with the number of passes that have been added to the map.
    how : PathTracing
        What was asked for.
    screen : Screen
        Its pixels.
    area : ndarray
        Their apparent area, up to a factor.
    window : pair of slices
        Rows and columns outside of which there is nothing to see.
    images : LightImages, optional
        Rays forwards, which keep their number for each line of sight.
    number : int
        Of the observer among those of the rays forwards.
    image : Forward, optional
        What comes by another route.
    """

    look: Look
    advance: Callable[[int], None]
    how: PathTracing
    screen: Screen
    area: Array
    window: tuple[slice, slice]
    images: LightImages | None
    number: int
    image: Forward | None

    def best(self, surveys: _Surveys) -> tuple[Passes, float, list[str]]:
        """The passes of the map, what all its pixels may err by in common (relative), and notes about both.

        Lines of sight end at patches if that is asked for, or if nothing is said and a pilot finds it better. The passes of
        the pilot are those of the map, or what the map is compared with.
        """
        if self.how.gather:
            survey = surveys.found
            passes, told = self._followed(survey), survey_notes(survey)
            if not survey.patches()[0]:
                return passes, 0.0, told
            others = [sums[0] for sums in self.look(FIRST_CHECK, FIRST_CHECK + PILOT, None)]
            seen = Comparison.of(passes.blocks, others)
            if seen is None:
                return passes, common_spread(passes.blocks), [*told, UNKNOWN]
            return passes, seen.bias, [*told, seen.sentence + (seen.warning if seen.differs else "")]
        if not self._may_gather() or not surveys.may_pay:
            return self._followed(None), 0.0, []
        exact = self.look(0, PILOT, None)
        survey = surveys.found
        if not survey.patches()[1]:
            return self._followed(None, exact), 0.0, []
        pilot = Pilot.of(exact, self.look, survey, self.area)
        if not pilot.pays:
            return self._followed(None, exact), 0.0, []
        passes = self._followed(survey, pilot.gathered, PILOT)
        seen = Comparison.of(passes.blocks, [found[0] for found in exact])
        if seen is None or seen.differs:
            return self._followed(None, exact), 0.0, [NOT_TAKEN]
        return passes, seen.bias, [*survey_notes(survey), pilot.sentence, seen.sentence]

    def _may_gather(self) -> bool:
        """Whether to try patches unasked: not beside light by another route, which is shared out differently then."""
        lines = self.how.paths * self.how.passes * self.screen.columns * self.screen.rows
        return self.how.gather is None and self.images is None and self.image is None and lines >= LEAST_LINES

    def _followed(self, known: _core.Survey | None, made: Sequence[list[Array]] = (), first: int = 0) -> Passes:
        """As many passes as the map needs, from number `first` on; those that are made already come before others."""
        how, passes = self.how, Passes(self.screen.shape, self.area, self.window, compared=known is not None)
        wanted, most = how.passes, how.passes * (1 if how.until is None else MOST_TIMES)
        at_once = max(1, LINES_AT_ONCE // (how.paths * self.screen.columns * self.screen.rows))
        while passes.done < wanted:
            begin = passes.done
            some = made[begin:] or self.look(first + begin, first + min(begin + at_once, wanted), known)
            for sums in some:
                passes.add(*sums)
            self.advance(len(some))
            if passes.done == wanted:
                if self.images is not None:
                    # Rays forwards keep their number for each line of sight.
                    self.images.trace(-(-passes.done // how.passes))
                    self.image = self.images.seen(self.number)
                if how.until is not None:
                    wanted = passes.wanted(how.until, most, self.image)
        return passes


@dataclasses.dataclass(frozen=True, eq=False)
class _Forward:
    """The part of rays forwards in a map: their plan, what they show, and how they share light with lines of sight."""

    plan: Plan
    images: LightImages | None
    shared: float | None
    possible: bool

    def notes(self, how: PathTracing) -> list[str]:
        """What is left to lines of sight, that these find by chance only."""
        if not self.possible or self.images is not None:
            return []
        if how.forward_rays == 0:
            note = (
                "no rays forwards, as forward_rays is 0: light that smooth surfaces send to diffuse ones is found by "
                "chance only, and where it is not found the map is too low and its error too small"
            )
        else:
            note = (
                f"none of {self.plan.beforehand:,} rays forwards sent light through smooth surfaces to diffuse ones that "
                "are seen directly; what there is of it, lines of sight find by chance"
            )
        return [note]


def _forward(
    core: _core.Scene,
    compiled: Compiled,
    views: list[_core._View],
    how: PathTracing,
    threads: int | None,
    *,
    wanted: bool,
) -> _Forward:
    """Rays forwards as the scene asks for them, or the user; none where lines of sight find all light well."""
    possible = core.may_focus()
    glints = [_core.Glints(core, view, MOST_EVENTS, threads) for view in views]
    if not possible or how.forward_rays == 0:
        return _Forward(Plan(0, None, glints, 0), None, None, possible)
    lines = how.paths * how.passes
    asked = None if how.forward_rays is None and wanted else int(how.forward_rays or 0)
    found = plan(compiled.record, views, glints, how.seed, MOST_EVENTS, lines, asked, threads)
    images, shared = None, None
    if found.rays and wanted:
        # Where lines of sight end at patches, these do not tell what they hold of each source.
        shared = None if how.gather else found.rays / lines
        images = LightImages(compiled.record, views, found, shared, how.seed, MOST_EVENTS, threads)
    return _Forward(found, images, shared, possible)


Fits = dict[tuple[object, ...], LightField]
"""Light fields by the rays that they were fitted to."""


def with_fields(
    scene: Scene, threads: int | None = None, *, cache: bool = True, fits: Fits | None = None
) -> tuple[Scene, list[str]]:
    """The scene with a light field in the place of each ray set, which has no luminance that could be seen; and notes.

    The patches of gridded sources have one of their own. Fits that are handed over are used, and joined by those that are
    made: a scene with the same rays elsewhere waits for none.

    Raises
    ------
    SceneError, ArgumentError, FormatError, OSError
        If rays cannot be read or fitted.
    """
    sources, notes = [], []
    for i, source in enumerate(scene.sources):
        if not isinstance(source, Rays):
            sources.append(source.seen(scene.files) if isinstance(source, Gridded) else source)
            continue
        name = source.name or f"sources[{i}]"
        seen, field, share = _fitted(source, scene, threads, {} if fits is None else fits, cache=cache)
        sources.append(seen)
        lost = f"; {share:.2%} of the flux does not come from it" if share > 1e-4 else ""
        # What the field says of itself, and of its rays, is in the notes of the scene with it.
        notes.append(f"{name}: a light field on {field.surface.told} was fitted to its rays{lost}")
    return scene.replace(sources=tuple(sources)), notes


def _fitted(
    source: Rays, scene: Scene, threads: int | None, fits: Fits, *, cache: bool
) -> tuple[Field, LightField, float]:
    """The light field of a ray source in its place, as it was fitted, and the share of the flux it does not hold."""
    rays = source.ray_stream(scene.files)
    unit = source.flux_unit if source.flux_unit is not None else rays.flux_unit
    (emitter,) = source.emitters(scene.files)
    # Only the flux in another unit is not a mere factor.
    origin = id(source.rays) if source.file is None else scene.files.find(source.file)
    key = (origin, source.flux_unit, None if source.flux_unit is None else rays.total_flux)
    field = fits[key] if key in fits else fit_or_recall(rays, cache=cache, threads=threads)
    fits[key] = field
    scale = emitter.record["flux"] / rays.total_flux
    place = {key: getattr(source, key) for key in Placement.model_fields}
    seen = Field(
        name=source.name,
        field=field.replace(flux_unit=unit),
        flux=field.total_flux * scale,
        wavelength=source.wavelength,
        spectrum=source.spectrum,
        **place,
    )
    return seen, field, 1.0 - field.total_flux / rays.total_flux


def _unseen(compiled: Compiled, *, forwards: bool) -> list[str]:
    """What the eye cannot see of the sources, though they shine."""
    names: dict[str, list[str]] = {"point": [], "beam": []}
    for name, source in zip(compiled.source_names, compiled.record["sources"], strict=True):
        if source["kind"] in names:
            names[source["kind"]].append(name)
    notes = []
    if names["point"]:
        notes.append(
            f"{', '.join(names['point'])}: a point has no finite luminance and is not seen itself; what it lights through "
            + (
                "lenses and mirrors is seen directly, not through or in others"
                if forwards
                else "lenses and mirrors is not seen"
            )
        )
    if names["beam"]:
        notes.append(
            f"{', '.join(names['beam'])}: parallel light is met by no line of sight and is not seen itself; what it lights "
            + ("is seen directly, not through lenses or in mirrors" if forwards else "is not seen")
        )
    return notes
