"""Sweeping: a scene is built, traced and looked at once for each step, and every step leaves a valid table."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from etendue.errors import ArgumentError
from etendue.luminance.estimate import luminance_map
from etendue.luminance.framing import framed_screens
from etendue.luminance.methods import PathTracing
from etendue.luminance.regions import AnyRegion
from etendue.luminance.scene_map import Fits, with_fields
from etendue.quantities.arguments import require, require_callable
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.scene import Scene, compile_scene
from etendue.sweeps.measures import Found, Measure, Step, measures_of
from etendue.sweeps.parameter import MOST_STEPS, Parameter
from etendue.sweeps.table import SweepTable
from etendue.tracing.result import TraceResult
from etendue.tracing.running import trace_rounds

RAYS, LINES, PIXELS = 1_000_000, 64, (128, 128)
"""Rays of a trace, lines of sight per pixel of a map, and pixels of a screen that is framed, at each step."""

Values = Sequence[float] | np.ndarray


def sweep(
    scene: Scene | str | os.PathLike[str],
    parameters: Mapping[str, Values],
    measure: str | Sequence[str],
    observer: Observer | Sequence[Observer] | None = None,
    screen: Screen | tuple[int, int] | None = None,
    *,
    region: AnyRegion | None = None,
    rays: float = RAYS,
    rays_per_pixel: int = LINES,
    seed: int = 1,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SweepTable:
    """Measure a scene over one of its numbers, or over a grid of several.

    All steps have the same seed, so that rays and lines of sight that meet nothing that changed go the same ways: a curve
    is smoother, and a difference of two steps is mostly sharper, than the errors say. What is stated is the standard error
    of each value by itself; that of a difference is at most the sum of both, and how much less it is, only other seeds
    tell.

    Parameters
    ----------
    scene : Scene or path
        With at least one source; of a path, the scene in that file.
    parameters : mapping of str to numbers
        Values by the path of the number: ``lens.at.2`` begins with the name of a source, solid, surface, detector,
        observer, medium or finish, ``solids.lens.at.2`` and ``solids.0.at.2`` with its family. Of several parameters every
        combination is a step; the last one changes fastest. 10 000 steps at most.
    measure : str or sequence of str
        What is measured: of all the light ``escaped``, ``efficiency``, ``emitted``, ``absorbed``, also ``absorbed:wall``;
        of a detector ``flux:desk``, ``peak:far``; of the map of an observer or of a detector ``mean``, ``maximum``,
        ``minimum``, ``uniformity``, ``mean:desk``; towards an observer ``intensity``.
    observer : Observer or sequence of Observer, optional
        Who looks; the observers of the scene if None, whose numbers can be parameters too.
    screen : Screen or (columns, rows), optional
        Of `observer`. Columns and rows alone, 128 × 128 if None: a screen about the target, the same at all steps, on which
        the scene is seen whole at each.
    region : Region or PolygonRegion, optional
        The part of observers' maps that mean, extremes and uniformity are of.
    rays : int
        Of each trace; a scene is traced only if a measure needs it.
    rays_per_pixel : int
        Lines of sight of each map, as of `PathTracing`; maps are made only if a measure needs them.
    seed : int
        Of every step.
    cache : bool
        Whether light fields are taken from those fitted before. Each ray file is fitted once in any case.
    threads : int, optional
        All cores if None. The table has the same bits for any number.
    progress : callable, optional
        Called with the number of steps done.

    Returns
    -------
    SweepTable

    Raises
    ------
    SceneError
        If the scene has mistakes, or would have at some step.
    UnknownNameError
        If a part, key, measure, detector or observer does not exist.
    ArgumentError
        If values are no numbers, or too many; or a measure cannot be measured here.
    KeyboardInterrupt
        Upon Ctrl-C; who wants to keep the steps done uses `sweep_steps`.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"name": "lamp", "kind": "point", "flux": 100}
    >>> wall = {"name": "wall", "shape": {"kind": "sphere", "radius": 10}, "finish": "absorber"}
    >>> hall = et.Scene(sources=[lamp], surfaces=[wall])
    >>> table = et.sweep(hall, {"lamp.flux": [50, 100, 200]}, "absorbed:wall", rays=1000)
    >>> table["absorbed:wall"].round(9).tolist(), table.unit("lamp.flux")
    ([50.0, 100.0, 200.0], 'lm')
    """
    require_callable(progress)
    table = None
    steps = sweep_steps(
        scene,
        parameters,
        measure,
        observer,
        screen,
        region=region,
        rays=rays,
        rays_per_pixel=rays_per_pixel,
        seed=seed,
        cache=cache,
        threads=threads,
    )
    for table in steps:
        if progress is not None:
            progress(table.done)
    assert table is not None  # noqa: S101 - there is at least one step
    return table


def sweep_steps(
    scene: Scene | str | os.PathLike[str],
    parameters: Mapping[str, Values],
    measure: str | Sequence[str],
    observer: Observer | Sequence[Observer] | None = None,
    screen: Screen | tuple[int, int] | None = None,
    *,
    region: AnyRegion | None = None,
    rays: float = RAYS,
    rays_per_pixel: int = LINES,
    seed: int = 1,
    cache: bool = True,
    threads: int | None = None,
) -> Steps:
    """Sweep, and yield the table so far after each step.

    Each table is complete in itself and does not change any more: keep the last one, whatever stops the loop. The
    parameters are those of `sweep`; mistakes in them are found at once, also in scenes of later steps.

    Returns
    -------
    Steps
        An iterator of `SweepTable`, the last of which is what `sweep` returns; ``len`` is the number of steps.

    Raises
    ------
    SceneError, UnknownNameError, ArgumentError
        As `sweep`.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"name": "lamp", "kind": "point", "flux": 100}
    >>> steps = et.sweep_steps(et.Scene(sources=[lamp]), {"lamp.flux": [50, 100]}, "escaped", rays=1000)
    >>> first = next(steps)
    >>> len(steps), first.done, first.complete, first["escaped"].round(9).tolist()
    (2, 1, False, [50.0, nan])
    """
    base = scene if isinstance(scene, Scene) else Scene.load(scene)
    axes = _axes(parameters)
    flux_unit = compile_scene(base).flux_unit if any("flux" in path for path in axes) else "lm"
    places = [Parameter.find(base, path, flux_unit) for path in axes]
    _refuse_twice(places)
    looked = _Looking(observer, screen, base)
    require(measure, (str, Sequence), "sweep: measure", "a name such as 'luminance', or several in a list")
    names = [measure] if isinstance(measure, str) else list(measure)
    for name in names:
        require(name, str, "sweep: one of the measures", "a name such as 'luminance'")
    detectors = [detector.name or f"detectors[{i}]" for i, detector in enumerate(base.detectors)]
    measures = measures_of(names, detectors, looked.names)
    how = PathTracing(rays_per_pixel=rays_per_pixel, seed=seed)
    scenes = []
    for values in itertools.product(*axes.values()):
        changed = base
        for place, value in zip(places, values, strict=True):
            changed = place.changed(changed, value)
        scenes.append(changed)
    if any(one.reads in ("map", "observer") for one in measures):
        looked.frame(scenes)
    return Steps(
        axes, places, scenes, measures, looked, region, how, rays, cache=cache, threads=checked_threads(threads)
    )


class Steps(Iterator[SweepTable]):
    """The steps of a sweep, each of which is computed when its table is asked for; see `sweep_steps`.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = et.Scene(sources=[{"name": "lamp", "kind": "point", "flux": 1}])
    >>> [table.done for table in et.sweep_steps(lamp, {"lamp.flux": [1, 2]}, "escaped", rays=100)]
    [1, 2]
    """

    def __init__(
        self,
        axes: Mapping[str, list[float]],
        places: Sequence[Parameter],
        scenes: Sequence[Scene],
        measures: Sequence[Measure],
        looked: _Looking,
        region: AnyRegion | None,
        how: PathTracing,
        rays: float,
        *,
        cache: bool,
        threads: int | None,
    ) -> None:
        self._axes = axes
        self._units = {place.path: place.unit for place in places}
        self._scenes = scenes
        self._measures = measures
        self._looked = looked
        self._region = region
        self._how = how
        self._rays = rays
        self._cache = cache
        self._threads = threads
        self._fits: Fits = {}
        self._found: list[list[Found]] = []
        self._notes: list[list[str]] = []

    def __len__(self) -> int:
        """Number of steps, done or not."""
        return len(self._scenes)

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of what is measured at each step."""
        return tuple(measure.label for measure in self._measures)

    def __next__(self) -> SweepTable:
        """The table after one step more."""
        if len(self._found) == len(self._scenes):
            raise StopIteration
        step, notes = self._step(self._scenes[len(self._found)])
        found = [measure.at(step) for measure in self._measures]
        self._found.append(found)
        self._notes.append(notes)
        return self._table()

    def _step(self, scene: Scene) -> tuple[Step, list[str]]:
        result: TraceResult | None = None
        notes: list[str] = []
        seen = [m for m in self._measures if m.of in self._looked.names and m.reads in ("map", "observer")]
        if len(seen) < len(self._measures):
            *_, result = trace_rounds(scene, self._rays, self._how.seed, threads=self._threads)
            notes += result.notes
            for name in dict.fromkeys(m.of for m in self._measures if m.reads == "map" and m not in seen):
                notes += result.notes_of(name)
        maps = {}
        if seen:
            seeable, told = with_fields(scene, self._threads, cache=self._cache, fits=self._fits)
            notes += told
            wanted = [name for name in self._looked.names if name in {m.of for m in seen}]
            pairs = [self._looked.of(scene)[name] for name in wanted]
            observers, screens = [observer for observer, _ in pairs], [screen for _, screen in pairs]
            found = luminance_map(
                seeable, observers, screens, method=self._how, cache=self._cache, threads=self._threads
            )
            maps = dict(zip(wanted, found, strict=True))
            for lmap in found:
                notes += [note for note in lmap.notes if note not in notes]
        return Step(scene, result, maps, self._region), notes

    def _table(self) -> SweepTable:
        shape = tuple(len(values) for values in self._axes.values())
        columns = np.full((2, len(self._measures), len(self._scenes)), np.nan)
        for number, row in enumerate(self._found):
            columns[0, :, number] = [found.value for found in row]
            columns[1, :, number] = [found.error for found in row]
        values, errors = (
            {measure.label: array.reshape(shape) for measure, array in zip(self._measures, part, strict=True)}
            for part in columns
        )
        units = {measure.label: found.unit for measure, found in zip(self._measures, self._found[-1], strict=True)}
        over = " × ".join(f"{path} ({len(held)})" for path, held in self._axes.items())
        base = self._scenes[0]
        return SweepTable(
            {path: np.array(held) for path, held in self._axes.items()},
            values,
            errors,
            {**self._units, **units},
            len(self._found),
            Provenance(base.name or "scene", "scene").then(f"sweep over {over}, seed {self._how.seed}"),
            tuple(self._told()),
        )

    def _told(self) -> Iterator[str]:
        """What the steps had to say, each thing once, however its numbers differ."""
        if len(self._found) < len(self._scenes):
            yield f"{len(self._found):,} of {len(self._scenes):,} steps were made"
        yield f"every step has the seed {self._how.seed}; errors are those of each value, differences are mostly sharper"
        first: dict[str, tuple[int, str, set[str]]] = {}
        counts: dict[str, int] = {}
        for number, notes in enumerate(self._notes):
            for note in dict.fromkeys(notes):
                pattern = NUMBER.sub("#", note)
                _, _, spellings = first.setdefault(pattern, (number, note, set()))
                spellings.add(note)
                counts[pattern] = counts.get(pattern, 0) + 1
        for pattern, (number, note, spellings) in first.items():
            everywhere = counts[pattern] >= len(self._notes)
            if everywhere and len(spellings) == 1:
                yield note
            else:
                others = counts[pattern] - 1
                more = f"; likewise at {others:,} more" if others else ""
                yield f"at {self._called(number)}{more}: {note}"

    def _called(self, number: int) -> str:
        place = next(itertools.islice(itertools.product(*self._axes.values()), number, None))
        return ", ".join(f"{path} = {value:g}" for path, value in zip(self._axes, place, strict=True))


NUMBER = re.compile(r"\d[\d.,]*(?:e[+-]?\d+)?")
"""In notes: what differs from step to step."""


class _Looking:
    """Who looks at the scenes of a sweep: stated observers, the same at all steps, or those of each scene."""

    def __init__(
        self, observer: Observer | Sequence[Observer] | None, screen: Screen | tuple[int, int] | None, base: Scene
    ) -> None:
        if observer is None and screen is not None:
            raise ArgumentError(
                "screen: of which observer? Give one, or leave it out: those of the scene have their own."
            )
        wanted = "an et.Observer(theta, phi, distance), or several in a list"
        require(observer, (Observer, Sequence, type(None)), "sweep: observer", wanted)
        stated = [observer] if isinstance(observer, Observer) else None if observer is None else list(observer)
        self._stated = None if stated is None else _named(stated)
        self._screen = screen
        self._screens: dict[str, Screen] = {}
        self.names = [*_of_scene(base)] if self._stated is None else [*self._stated]

    def frame(self, scenes: Sequence[Scene]) -> None:
        """Choose the screens of stated observers: the largest that one of the scenes asks for."""
        if self._stated is None:
            return
        if isinstance(self._screen, Screen):
            self._screens = dict.fromkeys(self._stated, self._screen)
            return
        observers = list(self._stated.values())
        needed = [framed_screens(scene, observers, *(self._screen or PIXELS)) for scene in scenes]
        for name, screens in zip(self._stated, zip(*needed, strict=True), strict=True):
            self._screens[name] = max(screens, key=lambda one: one.width * one.height)

    def of(self, scene: Scene) -> dict[str, tuple[Observer, Screen]]:
        """Each observer with his screen, by name."""
        if self._stated is None:
            return _of_scene(scene)
        return {name: (observer, self._screens[name]) for name, observer in self._stated.items()}


def _of_scene(scene: Scene) -> dict[str, tuple[Observer, Screen]]:
    return {
        keys.name or f"observers[{i}]": (keys.observer(), keys.screen.screen())
        for i, keys in enumerate(scene.observers)
    }


def _named(observers: Sequence[Observer]) -> dict[str, Observer]:
    """Observers by their angles, and by their number where these are the same."""
    found: dict[str, Observer] = {}
    for number, one in enumerate(observers):
        require(one, Observer, "sweep: observer", "an et.Observer(theta, phi, distance), or several in a list")
        name = f"{one.theta:g},{one.phi:g}"
        found[name if name not in found else f"{name} ({number})"] = one
    return found


def _axes(parameters: Mapping[str, Values]) -> dict[str, list[float]]:
    """The values of each parameter as numbers.

    Raises
    ------
    ArgumentError
        If there are none, or too many.
    """
    require(parameters, Mapping, "sweep: parameters", "a dict of rows of values, as {'lens.at.2': [5, 6, 7]}")
    if not parameters:
        raise ArgumentError("sweep: give at least one parameter with its values, e.g. {'lens.at.2': [5, 6, 7]}.")
    axes: dict[str, list[float]] = {}
    for path, values in parameters.items():
        try:
            axis = np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            axis = np.array([np.nan])
        if axis.ndim != 1 or not axis.size or not np.isfinite(axis).all():
            raise ArgumentError(f"{path}: {values!r} is no row of finite numbers; give one or more, e.g. [5, 6, 7].")
        axes[path.strip()] = axis.tolist()
    steps = 1
    for held in axes.values():
        steps *= len(held)
    if steps > MOST_STEPS:
        raise ArgumentError(f"sweep: {steps:,} steps; take {MOST_STEPS:,} at most: fewer values, or larger steps.")
    return axes


def _refuse_twice(places: Sequence[Parameter]) -> None:
    """Refuse two parameters that are the same number, of which one would undo the other."""
    for one, other in itertools.combinations(places, 2):
        if one.words == other.words:
            raise ArgumentError(f"{one.path} and {other.path} are the same number of the scene; leave one out.")
