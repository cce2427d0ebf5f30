"""From rays, from the light field fitted to them, or from a scene, to luminance maps."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypedDict, Unpack, cast, overload

from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.carrier import Surface
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.lightfield.pilot_sample import check_near_field
from etendue.luminance.cone_map import look_through_cone
from etendue.luminance.framing import Lines, beyond_notes, framed_screens, is_far, missed_notes, probe, shows_whole
from etendue.luminance.looking import look_at_field
from etendue.luminance.method_choice import choose_method
from etendue.luminance.methods import AnyMethod, Cone, FromField, MethodName, PathTracing
from etendue.luminance.opening import open_source
from etendue.luminance.scatter_map import look_at_events
from etendue.luminance.scene_map import look_at_scene
from etendue.luminance.source_kinds import kind_of_source
from etendue.quantities.arguments import require_callable
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.memory import require_memory
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, RayStream
from etendue.scene import Scene
from etendue.scene.observers import ObserverKeys
from etendue.scene.scatter_events import ScatterEvents

_Observers = Sequence[Observer] | list[str] | list[Observer | str] | tuple[Observer | str, ...]
"""Several, of a scene also by their names; a name alone is no sequence of them."""

Acceptance = float | Literal["auto"] | None

SCENE_PIXEL_BYTES, FIELD_PIXEL_BYTES, KEPT_PIXEL_BYTES = 250, 60, 50
"""Of a pixel in memory: while the map of a scene or of a light field is made, and as long as other maps follow. 290 and 76
together were measured."""


class _Options(TypedDict, total=False):
    """Of maps of any source."""

    cache: bool
    threads: int | None
    progress: Progress | None


class _AnyOptions(_Options, total=False):
    method: AnyMethod | MethodName


class _RayOptions(_Options, total=False):
    method: Cone | FromField | MethodName
    acceptance: Acceptance
    observer_radius: float | None
    surface: Surface | Literal["auto"]
    samples: int | None


class _SceneOptions(_Options, total=False):
    method: PathTracing | MethodName
    rays_per_pixel: int | None
    until: float | None
    seed: int | None
    forward_rays: float | None
    gather: bool | None


@overload
def luminance_map(
    source: RayStream | LightField | str | os.PathLike[str],
    observer: Observer,
    screen: Screen | None = ...,
    **options: Unpack[_RayOptions],
) -> LuminanceMap: ...
@overload
def luminance_map(
    source: RayStream | LightField | str | os.PathLike[str],
    observer: Sequence[Observer],
    screen: Screen | Sequence[Screen] | None = ...,
    **options: Unpack[_RayOptions],
) -> list[LuminanceMap]: ...
@overload
def luminance_map(
    source: RayStream | LightField | Scene | ScatterEvents,
    observer: Sequence[Observer],
    screen: Screen | Sequence[Screen] | None = ...,
    **options: Unpack[_AnyOptions],
) -> list[LuminanceMap]: ...
@overload
def luminance_map(
    source: Scene | ScatterEvents | str | os.PathLike[str],
    observer: Observer | str,
    screen: Screen | None = ...,
    **options: Unpack[_SceneOptions],
) -> LuminanceMap: ...
@overload
def luminance_map(
    source: Scene | ScatterEvents | str | os.PathLike[str],
    observer: _Observers | None = ...,
    screen: Screen | Sequence[Screen] | None = ...,
    **options: Unpack[_SceneOptions],
) -> list[LuminanceMap]: ...
def luminance_map(
    source: RayStream | LightField | Scene | ScatterEvents | str | os.PathLike[str],
    observer: Observer | str | _Observers | None = None,
    screen: Screen | Sequence[Screen] | None = None,
    *,
    method: AnyMethod | MethodName = "auto",
    acceptance: Acceptance = None,
    observer_radius: float | None = None,
    surface: Surface | Literal["auto"] = "auto",
    samples: int | None = None,
    rays_per_pixel: int | None = None,
    until: float | None = None,
    seed: int | None = None,
    forward_rays: float | None = None,
    gather: bool | None = None,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
    **unknown: object,
) -> LuminanceMap | list[LuminanceMap]:
    """What an observer sees of a source: luminance per pixel, with its standard error.

    Rays travel in free space, forwards and backwards along their lines: where on its line a ray starts has no influence.
    In a scene, lines of sight are followed from the eye through the optics to the sources; those that meet smooth surfaces
    only have no noise but that of the places within a pixel. Scatter events are connected to the eye past what stands in
    their scene: light that comes from diffuse surfaces directly.

    Parameters
    ----------
    source : RayStream, LightField, Scene, ScatterEvents or path
        A ray set, a source that draws its rays on demand, an index of rays, the light field that was fitted to one, a
        scene, or the scatter events of a trace. Ray sets in a scene are fitted first, since rays have no luminance that a
        line of sight could meet. Of a path, what the file holds: a scene (``.toml``), a light field or rays.
    observer : Observer or sequence of Observer
        Any number is served by one pass over the rays. Of a scene, a name stands for its observer of this name, who has a
        screen of his own; None: all its observers.
    screen : Screen or sequence of Screen
        One for all observers, or one each. None: for each observer one of 128 × 128 pixels about his target, on which he
        sees the whole scene, or all light that heads for him but strays. A screen that shows less than nine tenths of the
        light that rays or a field send to the observer says so in the map's notes.
    method : Cone, FromField, PathTracing, or their shorthands "cone", "lightfield", "pathtracing", or "auto"
        How luminance is estimated, with the method's own options: ``FromField(samples=64)`` fits a light field to all rays,
        then looks at it; ``Cone(acceptance=3)`` takes only rays that head for the observer, eqs. 2.2 to 2.4 of
        [Audenaert2014]_; ``PathTracing(until=0.01)`` is for scenes and scatter events. ``"auto"``: the method that has the
        options which are stated beside it; without any, the light field for rays, the cone for rays that are indexed
        (`RayIndex`), which makes it a matter of milliseconds.
    acceptance, observer_radius
        Shorthands for options of `Cone`.
    surface, samples
        Shorthands for options of `FromField`.
    rays_per_pixel, until, seed, forward_rays, gather
        Shorthands for options of `PathTracing`. Of scatter events, lines of sight are followed only if `rays_per_pixel` is
        stated, or the method.
    cache : bool
        Whether a light field that has to be fitted is taken from those fitted before (`etendue.cache_content`), and kept.
        The map is the same, bit by bit.
    threads : int, optional
        All cores if None. The result has the same bits for any number.
    progress : callable, optional
        Called with the number of rays done.
    **unknown
        None: a name that is no option is refused, and the nearest one is suggested.

    Returns
    -------
    LuminanceMap or list of LuminanceMap
        [cd/m²] for rays in lm, [W/(m² sr)] for rays in W.

    Raises
    ------
    ArgumentError
        If the rays have no position, an option is out of its domain, the numbers of observers and screens differ,
        options, method and source do not go together, or something is given that is no source, observer or screen.
    SceneError
        If a scene has mistakes.
    MemoryLimitError
        If there is no room for the maps.
    UnknownNameError
        If there is no such method or option, or the scene has no observer of that name.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=500_000, seed=1)
    >>> how = et.Cone(acceptance=5)
    >>> lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(20, 20, 1, 1), method=how)
    >>> truth = rays.luminance(0, 0)
    >>> bool(abs(lmap.values[0, 0] - truth) < 3 * lmap.standard_error[0, 0] + 0.25 * truth)
    True
    >>> sky = {"kind": "surface", "shape": {"kind": "sphere", "radius": 100}, "side": "back", "flux": 1000}
    >>> ball = et.Scene(sources=[sky], solids=[{"shape": {"kind": "ball", "radius": 3}, "medium": "BK7"}])
    >>> seen = et.luminance_map(ball, et.Observer(30, 20, 90), et.Screen(8, 8, 4, 4), rays_per_pixel=16)
    >>> float(seen.values.min() / seen.values.max()) > 1 - 1e-9     # glass in an even surround cannot be seen
    True
    """
    if isinstance(source, str | os.PathLike):
        source = open_source(source)
    require_callable(progress)
    options = {
        "acceptance": acceptance,
        "observer_radius": observer_radius,
        "surface": None if isinstance(surface, str) and surface == "auto" else surface,
        "samples": samples,
        "rays_per_pixel": rays_per_pixel,
        "until": until,
        "seed": seed,
        "forward_rays": forward_rays,
        "gather": gather,
    }
    stated = {name: value for name, value in options.items() if value is not None} | unknown
    how = choose_method(method, stated, kind_of_source(source))
    pairs = _pairs(source, observer, screen)
    if not isinstance(how, Cone):
        _require_memory(source, [screen for _, screen in pairs])
    # What `choose_method` gives is what the source takes.
    if isinstance(source, Scene):
        maps = look_at_scene(source, pairs, cast("PathTracing", how), progress, cache=cache, threads=threads)
    elif isinstance(source, ScatterEvents):
        lines = cast("PathTracing | None", how)
        maps = look_at_events(source, pairs, lines, progress, cache=cache, threads=threads)
    elif isinstance(source, LightField):
        samples = cast("FromField", how).samples
        maps = _with_missed(source, [look_at_field(source, o, s, samples, threads) for o, s in pairs])
    elif isinstance(how, FromField):
        for o, s in pairs:
            s.axes(o)  # a view without area is refused before the work
        field = fit_or_recall(source, how.surface, cache=cache, threads=threads, progress=progress)
        maps = _with_missed(source, [look_at_field(field, o, s, how.samples, threads) for o, s in pairs], field)
    else:
        check_near_field(source)
        maps = _with_missed(source, look_through_cone(source, pairs, cast("Cone", how), threads, progress))
    return maps[0] if isinstance(observer, Observer | str) else maps


def _require_memory(source: RayStream | LightField | Scene | ScatterEvents, screens: list[Screen]) -> None:
    """Refuse maps for which there is no room, before any work is done; the cone does so itself."""
    pixels = [screen.columns * screen.rows for screen in screens]
    sizes = ", ".join(f"{screen.columns} x {screen.rows}" for screen in screens[:4])
    what = (
        f"a map of {sizes} pixels"
        if len(screens) == 1
        else f"{len(screens)} maps of {sizes}{' …' * (len(screens) > 4)} pixels"
    )
    name = source.name if isinstance(source, Scene | ScatterEvents) else source.provenance.source
    while_made = SCENE_PIXEL_BYTES if isinstance(source, Scene | ScatterEvents) else FIELD_PIXEL_BYTES
    require_memory(while_made * max(pixels) + KEPT_PIXEL_BYTES * sum(pixels), f"{name or 'the scene'}: {what}")


def _pairs(
    source: RayStream | LightField | Scene | ScatterEvents,
    observer: Observer | str | _Observers | None,
    screen: Screen | Sequence[Screen] | None,
) -> list[tuple[Observer, Screen]]:
    """Each observer with his screen."""
    scene = source.scene if isinstance(source, ScatterEvents) else source
    if observer is None:
        if screen is not None or not isinstance(source, Scene | ScatterEvents):
            raise ArgumentError("give an observer.")
        if not isinstance(scene, Scene) or not scene.observers:
            raise ArgumentError("the scene has no observers; give one.")
        return [(keys.observer(), keys.screen.screen()) for keys in scene.observers]
    own = {keys.name: keys for keys in scene.observers if keys.name} if isinstance(scene, Scene) else {}
    known = [_observer(one, own) for one in _several(observer)]
    observers = [one for one, _ in known]
    if screen is None:
        others = [one for one, seen in known if seen is None]
        if others and scene is None:
            raise ArgumentError("the scene of these events is not known; give a screen.")
        framed = iter(framed_screens(scene, others) if others and scene is not None else ())
        screens = [next(framed) if seen is None else seen for _, seen in known]
    else:
        screens = _several(screen)
        if not all(isinstance(one, Screen) for one in screens):
            raise ArgumentError(
                f"screen is {screen!r}; give a Screen, e.g. et.Screen(30, 30, 64, 64), or one for each."
            )
        screens *= len(observers) if isinstance(screen, Screen) else 1
    if len(observers) != len(screens) or not observers:
        raise ArgumentError(f"{len(observers)} observers and {len(screens)} screens; give one screen, or one for each.")
    return list(zip(observers, screens, strict=True))


def _several(given: Any) -> list[Any]:
    """What is given, be it one or several."""
    return list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]


def _observer(given: Any, own: Mapping[str, ObserverKeys]) -> tuple[Observer, Screen | None]:
    """An observer; with his screen if the scene has both, by name."""
    if isinstance(given, Observer):
        return given, None
    if not isinstance(given, str) or not own:
        raise ArgumentError(f"the observer is {given!r}; give an Observer, e.g. et.Observer(30, 0, 1000), or several.")
    if given not in own:
        raise UnknownNameError("observer of the scene", given, own)
    return own[given].observer(), own[given].screen.screen()


def _with_missed(
    source: RayStream | LightField, maps: list[LuminanceMap], fitted: LightField | None = None
) -> list[LuminanceMap]:
    """The maps, with a note where a screen misses much of the light, or shows light that starts beyond the observer.

    What maps of a field that was `fitted` miss is of its own light, which may be wider than that of few rays.
    """
    if not source.total_flux > 0.0:
        return maps
    lit = source if fitted is None else fitted
    whole = [isinstance(lit, LightField) and shows_whole(lit, lmap) for lmap in maps]
    if isinstance(source, LightField) and all(whole) and all(is_far(source, lmap) for lmap in maps):
        return maps
    some = Lines.of(probe(source))
    seen = some if lit is source or all(whole) else Lines.of(probe(lit))
    notes = []
    for lmap, all_of_it in zip(maps, whole, strict=True):
        view = lmap.observer, lmap.screen
        notes.append((*(() if all_of_it else missed_notes(seen, *view)), *beyond_notes(some, *view)))
    return [lmap.replace(notes=(*lmap.notes, *more)) if more else lmap for lmap, more in zip(maps, notes, strict=True)]
