"""Maps of a scene: lines of sight followed from the eye through the optics to the sources."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.luminance.caustics import Forward, LightImages, Plan, at_least_nearby, plan
from etendue.luminance.gathering import CHECKS, FIRST_CHECK, blocks, comparison_note, survey_notes
from etendue.luminance.methods import PathTracing
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.quantities.relative_error import RelativeError
from etendue.scatter.building import core_scene
from etendue.scene import Compiled, Scene, compile_scene
from etendue.scene.placement import Placement
from etendue.scene.sources.from_files import Field, Rays
from etendue.scene.sources.gridded import Gridded
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]
Left = Literal["nothing", "caustics", "scattered"]
"""Light that lines of sight leave to rays traced forwards."""

MOST_TIMES = 64
"""How many times `rays_per_pixel` are followed at most to reach `until`."""

MOST_EVENTS = 10_000
"""Surfaces that a line of sight may meet."""


def look_at_scene(
    scene: Scene,
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
    seeable, notes = with_fields(scene, threads, cache=cache)
    compiled = compile_scene(seeable)
    if not compiled.record["sources"]:
        raise ArgumentError(f"{scene.name or 'the scene'} has no source: there is nothing to see.")
    core = core_scene({**compiled.record, "detectors": []})
    survey = _core.Survey(core, how.seed, MOST_EVENTS, threads) if how.gather else None
    forward = _forward(core, compiled, views, how, threads, wanted=scattered is None)
    images = forward.images
    notes = [*compiled.notes, *notes, *_unseen(compiled, forwards=scattered is not None or images is not None)]
    notes += [] if survey is None else survey_notes(survey)
    notes += [] if scattered is not None else forward.notes(how)
    left: Left = "scattered" if scattered is not None else "caustics" if images is not None else "nothing"
    origin = Provenance(scene.name or "scene", "traced scene", fingerprint(compiled.record))
    maps, done = [], 0
    for number, ((observer, screen), view, small) in enumerate(zip(pairs, views, forward.plan.glints, strict=True)):
        passes, gathered = _Passes(screen.shape, screen.cosine(observer)), []

        def look(
            number: int, known: _core.Survey | None, view: _core._View = view, small: _core.Glints = small
        ) -> list[Array]:
            guides = forward.shared, forward.plan.guide, small
            return _core.look_at_scene(
                core, view, how.paths, how.seed, MOST_EVENTS, left, number, number + 1, threads, known, *guides
            )

        wanted, most = how.passes, how.passes * (1 if how.until is None else MOST_TIMES)
        image = None if scattered is None else scattered[number]
        while passes.done < wanted:
            sum_, chance, deviation, *met = look(passes.done, survey)
            passes.add(sum_, chance, deviation, *met)
            gathered.append(blocks(sum_))
            done += how.paths * screen.columns * screen.rows
            if progress is not None:
                progress(done)
            if passes.done == wanted:
                if images is not None:
                    # Rays forwards keep their number for each line of sight.
                    images.trace(-(-passes.done // how.passes))
                    image = images.seen(number)
                if how.until is not None:
                    wanted = passes.wanted(how.until, most, image)
        paths = how.paths * passes.done
        told = [
            f"{paths:,} lines of sight per pixel, in {passes.done} independent passes",
            *passes.notes(how.until, image),
        ]
        if small.pixels():
            told.append(
                f"lamps are small against the pixel in {small.pixels():,} of them, directly, in mirrors or through lenses: "
                "as many lines of sight again look there; what the search for them missed is left to chance, and a pixel "
                "that no line of sight lit states no error"
            )
        if survey is not None and survey.patches()[0]:
            told.append(comparison_note(gathered, [look(FIRST_CHECK + i, None)[0] for i in range(CHECKS)]))
        values, error = passes.total(image)
        if not values.any():
            told.append("the map is dark")
        if image is not None:
            told.append(image.note)
        if images is not None:
            told[-1] += f", beside {paths * screen.columns * screen.rows:,} lines of sight"
        maps.append(
            LuminanceMap(
                values * MM2_PER_M2,
                error * MM2_PER_M2,
                np.full(screen.shape, paths),
                observer,
                screen,
                compiled.flux_unit,
                origin.then(f"luminance by {paths:,} lines of sight per pixel, seed {how.seed}"),
                (*told, *notes),
            )
        )
    return maps


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


class _Passes:
    """Mean and spread of independent passes, updated pass by pass (Welford): no difference of large numbers."""

    def __init__(self, shape: tuple[int, int], area: Array) -> None:
        self.done = 0
        self._area = area
        self._all = _Spread(shape)
        self._chance = _Spread(shape)
        self._lucky = np.zeros(shape, dtype=np.int64)
        self._smooth = np.zeros(shape, dtype=bool)
        self._diffuse = np.zeros(shape, dtype=bool)
        self._deviation = np.zeros(shape)

    def add(self, values: Array, chance: Array, deviation: Array, smooth: Array, diffuse: Array) -> None:
        """One pass more.

        Its mean luminances, what of them was found by chance, the deviation that sources state of theirs, and the shares of
        the lines that met a smooth surface first, and that saw a diffuse one directly.
        """
        self.done += 1
        self._all.add(values, self.done)
        self._chance.add(chance, self.done)
        self._lucky += chance > 0.0
        self._smooth |= smooth > 0.0
        self._diffuse |= diffuse > 0.0
        self._deviation = self._deviation + (deviation - self._deviation) / self.done

    def total(self, image: Forward | None, *, known: bool = True) -> tuple[Array, Array]:
        """The luminance of both routes and its standard error; with what the sources know of their own, if `known`.

        What is found by chance, in few passes of a pixel, errs by no less than in its neighbourhood.
        """
        chance = self._chance.variance(self.done)
        variance = self._all.variance(self.done) + (at_least_nearby(chance, self._lucky, self._smooth) - chance)
        values = self._all.mean
        if image is not None:
            values = values + image.values
            variance = variance + image.with_neighbours(self._diffuse).error ** 2
        return values, np.sqrt(variance + (self._deviation**2 if known else 0.0))

    def relative_error(self, image: Forward | None) -> float:
        """Sampling error over the luminance, weighted by flux (`RelativeError`); 0 if there is no light."""
        found = RelativeError.of(*self.total(image, known=False), self._area)
        return 0.0 if found is None else found.flux_weighted

    def wanted(self, until: float, most: int, image: Forward | None) -> int:
        """Passes that should be made to reach a relative error: as many as its fall with 1/√n asks for, twice at most."""
        error = self.relative_error(image)
        if error < until:
            return self.done
        return min(most, 2 * self.done, max(self.done + 1, math.ceil(1.1 * self.done * (error / until) ** 2)))

    def notes(self, until: float | None, image: Forward | None) -> list[str]:
        """How sure the map is."""
        values, _ = self.total(image)
        notes = [] if (self._all.mean > 0.0).any() else ["no line of sight met light"]
        if not (values > 0.0).any():
            return notes
        reached = self.relative_error(image)
        notes.append(
            f"sampling error {reached:.2%} of the luminance, weighted by flux; that of lines of sight has "
            f"{self.done - 1} degrees of freedom"
        )
        if until is not None and reached >= until:
            notes.append(f"stopped before {until:.2%} was reached, at {MOST_TIMES} times rays_per_pixel")
        rare = (self._lucky > 0) & (self._lucky < self.done / 2)
        if rare.any():
            part = float(self._chance.mean.sum() / values.sum())
            largest = np.unravel_index(np.argmax(np.where(rare, self._chance.mean, 0.0)), values.shape)
            row, column = (int(i) for i in largest)
            notes.append(
                f"{part:.2%} of the light was found by chance, behind lenses or in mirrors; pixels where fewer than half "
                f"of the passes found any: {int(rare.sum()):,}, most in row {row}, column {column} (from 0); single ones "
                "may err by more than their errors say"
            )
        return notes


class _Spread:
    """Mean of passes, and the sum of the squares of what they differ from it."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.mean = np.zeros(shape)
        self._squares = np.zeros(shape)

    def add(self, values: Array, number: int) -> None:
        off = values - self.mean
        self.mean = self.mean + off / number
        self._squares = self._squares + off * (values - self.mean)

    def variance(self, passes: int) -> Array:
        """Of the mean."""
        return self._squares / ((passes - 1) * passes)


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
        field, surface, share = _fitted(source, scene, threads, {} if fits is None else fits, cache=cache)
        sources.append(field)
        lost = f"; {share:.2%} of the flux does not come from it" if share > 1e-4 else ""
        notes.append(f"{name}: a light field on {surface} was fitted to its rays{lost}")
        notes += [f"{name}: {note}" for note in (source.rays.notes if source.rays is not None else ())]
    return scene.replace(sources=tuple(sources)), notes


def _fitted(source: Rays, scene: Scene, threads: int | None, fits: Fits, *, cache: bool) -> tuple[Field, str, float]:
    """The light field of a ray source in its place, its carrier surface, and the share of the flux it does not hold."""
    rays = source.ray_stream(scene.files)
    unit = source.flux_unit if source.flux_unit is not None else rays.flux_unit
    (emitter,) = source.emitters(scene.files)
    # Only the flux in another unit is not a mere factor.
    origin = id(source.rays) if source.file is None else scene.files.find(source.file)
    key = (origin, source.flux_unit, None if source.flux_unit is None else source.flux)
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
    return seen, field.surface.told, 1.0 - field.total_flux / rays.total_flux


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
