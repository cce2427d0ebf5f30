"""From rays, from the light field fitted to them, or from a scene, to luminance maps."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal, get_args, overload

import numpy as np

from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.rays.ray_index import RayIndex
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.lightfield.probe import check_near_field
from etendue.lightfield.surfaces import Surface
from etendue.luminance.acceptance import LADDER, AcceptanceChoice, choose_acceptance, comparison_screen
from etendue.luminance.cone import ConeEstimate, ConeView, check_acceptance, cone_estimates
from etendue.luminance.framing import framed_screens, missed_notes, probe, shows_whole
from etendue.luminance.looking import look_at_field
from etendue.luminance.opening import open_source
from etendue.luminance.scatter_map import look_at_events
from etendue.luminance.scene_map import Looking, look_at_scene
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.memory import require_memory
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, RayStream, Tally
from etendue.scene import Scene
from etendue.scene.scatter_events import ScatterEvents

Method = Literal["auto", "cone", "lightfield"]
METHODS: tuple[str, ...] = get_args(Method)

DEFAULT_ACCEPTANCE = 1.5
"""Half-angle [°] of the cone in [Audenaert2014]_ section 2.3.2."""

Acceptance = float | Literal["auto"] | None


SCENE_PIXEL_BYTES, FIELD_PIXEL_BYTES, KEPT_PIXEL_BYTES = 250, 60, 50
"""Of a pixel in memory: while the map of a scene or of a light field is made, and as long as other maps follow. 290 and 76
together were measured."""

DEFAULT_SAMPLES = 16
"""Points per pixel at which a light field is read."""


@overload
def luminance_map(
    source: RayStream | LightField | str | os.PathLike[str],
    observer: Observer,
    screen: Screen | None = ...,
    *,
    method: Method = ...,
    acceptance: Acceptance = ...,
    surface: Surface | Literal["auto"] = ...,
    samples: int | None = ...,
    cache: bool = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> LuminanceMap: ...
@overload
def luminance_map(
    source: RayStream | LightField | str | os.PathLike[str],
    observer: Sequence[Observer],
    screen: Screen | Sequence[Screen] | None = ...,
    *,
    method: Method = ...,
    acceptance: Acceptance = ...,
    surface: Surface | Literal["auto"] = ...,
    samples: int | None = ...,
    cache: bool = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> list[LuminanceMap]: ...
@overload
def luminance_map(
    source: Scene | ScatterEvents | str | os.PathLike[str],
    observer: Observer,
    screen: Screen | None = ...,
    *,
    rays_per_pixel: int | None = ...,
    until: float | None = ...,
    seed: int | None = ...,
    forward_rays: float | None = ...,
    gather: bool = ...,
    cache: bool = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> LuminanceMap: ...
@overload
def luminance_map(
    source: Scene | ScatterEvents | str | os.PathLike[str],
    observer: Sequence[Observer] | None = ...,
    screen: Screen | Sequence[Screen] | None = ...,
    *,
    rays_per_pixel: int | None = ...,
    until: float | None = ...,
    seed: int | None = ...,
    forward_rays: float | None = ...,
    gather: bool = ...,
    cache: bool = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> list[LuminanceMap]: ...
def luminance_map(
    source: RayStream | LightField | Scene | ScatterEvents | str | os.PathLike[str],
    observer: Observer | Sequence[Observer] | None = None,
    screen: Screen | Sequence[Screen] | None = None,
    *,
    method: Method = "auto",
    acceptance: Acceptance = None,
    surface: Surface | Literal["auto"] = "auto",
    samples: int | None = None,
    rays_per_pixel: int | None = None,
    until: float | None = None,
    seed: int | None = None,
    forward_rays: float | None = None,
    gather: bool = False,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
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
        Any number is served by one pass over the rays. Of a scene, None: its own observers with their screens.
    screen : Screen or sequence of Screen
        One for all observers, or one each. None: for each observer one of 128 × 128 pixels about his target, on which he
        sees the whole scene, or all light that heads for him but strays. A screen that shows less than nine tenths of the
        light that rays or a field send to the observer says so in the map's notes.
    method : {"auto", "cone", "lightfield"}
        ``"lightfield"``: fit a light field to all rays, then look at it. ``"cone"``: only rays that head for the observer,
        eqs. 2.2 to 2.4 of [Audenaert2014]_. ``"auto"``: the light field, unless an acceptance is given or the rays are
        indexed (`RayIndex`), which makes the cone a matter of milliseconds.
    acceptance : float, "auto" or None
        Half-angle α of the cone [°]; None: 1.5; ``"auto"``: the one of least estimated error, and the map's notes say why.
    surface : Surface or "auto"
        Carrier surface of the light field; ``"auto"``: the one that foretells held-out rays best.
    samples : int, optional
        Points per pixel at which a light field is read; 16 if None.
    rays_per_pixel : int, optional
        Of a scene: lines of sight per pixel, in 16 independent passes (at least 4) whose spread gives the standard error;
        256 if None. Of scatter events: so many are followed for what the events leave out, sources that are seen directly,
        in mirrors or through lenses, and diffuse surfaces seen so; none if None.
    until : float, optional
        Of a scene: more passes are made until the sampling error, weighted by flux (`RelativeError`), is below it, by both
        routes together, up to 64 times `rays_per_pixel`. What light fields do not know of themselves does not count here,
        but in the map's errors.
    seed : int, optional
        Of a scene; 1 if None.
    forward_rays : int, optional
        Of a scene: so many rays are traced forwards besides, and what they send to the eye from diffuse surfaces is added:
        light that reaches these through lenses and mirrors (caustics), which lines of sight find by chance only, or not
        at all if it comes from points, and that of beams. No light is counted twice. If None, a pilot finds out whether
        there is such light, and how many rays balance its error with that of the rest; 0: none, and the map's notes say
        that it may be too low. With `until` their number grows with that of the lines of sight.
    gather : bool, optional
        Of a scene: lines of sight end at the second diffuse surface, whose light is then known from rays traced forwards,
        as a mean over small patches. Many times as fast where light goes to and fro between diffuse surfaces. Patches
        that light does not reach evenly are not used; the map's notes tell how it compares with lines that go on.
    cache : bool
        Whether a light field that has to be fitted is taken from those fitted before (`etendue.cache_content`), and kept.
        The map is the same, bit by bit.
    threads : int, optional
        All cores if None. The result has the same bits for any number.
    progress : callable, optional
        Called with the number of rays done.

    Returns
    -------
    LuminanceMap or list of LuminanceMap
        [cd/m²] for rays in lm, [W/(m² sr)] for rays in W.

    Raises
    ------
    ArgumentError
        If the rays have no position, an angle is out of its domain, the numbers of observers and screens differ, or an
        option belongs to another kind of source.
    SceneError
        If a scene has mistakes.
    MemoryLimitError
        If there is no room for the maps.
    UnknownNameError
        If there is no such method.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=500_000, seed=1)
    >>> lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(20, 20, 1, 1), method="cone", acceptance=5)
    >>> truth = rays.luminance(0, 0)
    >>> bool(abs(lmap.values[0, 0] - truth) < 3 * lmap.standard_error[0, 0] + 0.25 * truth)
    True
    >>> sky = {"kind": "surface", "shape": {"kind": "sphere", "radius": 100}, "side": "back", "flux": 1000}
    >>> ball = et.Scene(sources=[sky], solids=[{"shape": {"kind": "ball", "radius": 3}, "medium": "BK7"}])
    >>> seen = et.luminance_map(ball, et.Observer(30, 20, 90), et.Screen(8, 8, 4, 4), rays_per_pixel=16)
    >>> float(np.ptp(seen.values) / seen.values.max()) < 1e-9        # glass in an even surround cannot be seen
    True
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS)
    if isinstance(source, str | os.PathLike):
        source = open_source(source)
    for_scenes = {
        "rays_per_pixel": rays_per_pixel,
        "until": until,
        "seed": seed,
        "forward_rays": forward_rays,
        "gather": gather or None,
    }
    for_others = {
        "method": None if method == "auto" else method,
        "acceptance": acceptance,
        "surface": None if surface == "auto" else surface,
        "samples": samples,
    }
    is_scene = isinstance(source, Scene | ScatterEvents)
    needless = [name for name, value in (for_others if is_scene else for_scenes).items() if value is not None]
    if needless:
        owner, here = ("rays and light fields", "scene") if is_scene else ("scenes", "ray set or light field")
        raise ArgumentError(f"{', '.join(needless)}: for {owner}, and the source is a {here}; leave it out.")
    pairs = _pairs(source, observer, screen)
    # A stated acceptance asks for the cone, and so does an index, which was built for nothing else.
    by_cone = method == "cone" or (method == "auto" and (acceptance is not None or isinstance(source, RayIndex)))
    if not by_cone:
        _require_memory(source, [screen for _, screen in pairs])
    if isinstance(source, Scene | ScatterEvents):
        given = {name: value for name, value in for_scenes.items() if value is not None}
        how = Looking(**given, cache=cache, threads=threads)  # type: ignore[arg-type]
        if isinstance(source, Scene):
            maps = look_at_scene(source, pairs, how, progress)
        else:
            _check_events(given)
            maps = look_at_events(source, pairs, how, progress, whole=rays_per_pixel is not None)
        return maps[0] if isinstance(observer, Observer) else maps
    samples = DEFAULT_SAMPLES if samples is None else samples
    if isinstance(source, LightField):
        if by_cone:
            raise ArgumentError("a light field has no rays that a cone could accept; leave method and acceptance out.")
        maps = [look_at_field(source, o, s, samples, threads) for o, s in pairs]
    elif not by_cone:
        if acceptance is not None:
            raise ArgumentError(
                f"method 'lightfield' uses all rays and has no acceptance ({acceptance}); leave it out."
            )
        for o, s in pairs:
            s.axes(o)  # a view without area is refused before the work
        field = fit_or_recall(source, surface, cache=cache, threads=threads, progress=progress)
        maps = [look_at_field(field, o, s, samples, threads) for o, s in pairs]
    else:
        check_near_field(source)
        maps = _by_cone(source, pairs, acceptance, threads, progress)
    maps = _with_missed(source, maps)
    return maps[0] if isinstance(observer, Observer) else maps


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
    observer: Observer | Sequence[Observer] | None,
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
    observers = [observer] if isinstance(observer, Observer) else list(observer)
    if screen is None:
        if scene is None:
            raise ArgumentError("the scene of these events is not known; give a screen.")
        screen = framed_screens(scene, observers)
    screens = [screen] * len(observers) if isinstance(screen, Screen) else list(screen)
    if len(observers) != len(screens) or not observers:
        raise ArgumentError(f"{len(observers)} observers and {len(screens)} screens; give one screen, or one for each.")
    return list(zip(observers, screens, strict=True))


def _with_missed(source: RayStream | LightField, maps: list[LuminanceMap]) -> list[LuminanceMap]:
    """The maps, with a note where a screen misses much of the light."""
    if not source.total_flux > 0.0:
        return maps
    if isinstance(source, LightField) and all(shows_whole(source, lmap) for lmap in maps):
        return maps
    some = probe(source)
    notes = [missed_notes(some, lmap.observer, lmap.screen) for lmap in maps]
    return [lmap.replace(notes=(*lmap.notes, *more)) if more else lmap for lmap, more in zip(maps, notes, strict=True)]


def _check_events(given: Mapping[str, object]) -> None:
    """Refuse options that mean nothing for scatter events."""
    if "forward_rays" in given:
        raise ArgumentError("forward_rays: scatter events are rays traced forwards already; leave it out.")
    needless = [name for name in given if name != "rays_per_pixel"]
    if needless and "rays_per_pixel" not in given:
        raise ArgumentError(f"{', '.join(needless)}: for lines of sight; give rays_per_pixel too, or leave it out.")


def _by_cone(
    rays: RayStream,
    pairs: list[tuple[Observer, Screen]],
    acceptance: Acceptance,
    threads: int | None,
    progress: Progress | None,
) -> list[LuminanceMap]:
    """The maps of rays that head for the observers."""
    if acceptance == "auto":
        return _automatic(rays, pairs, threads, progress)
    angle = check_acceptance(DEFAULT_ACCEPTANCE if acceptance is None else acceptance)
    estimates, tally = cone_estimates(rays, [ConeView(o, s, (angle,)) for o, s in pairs], threads, progress)
    return [_map(rays, estimate, 0, tally, None) for estimate in estimates]


def _automatic(
    rays: RayStream, pairs: list[tuple[Observer, Screen]], threads: int | None, progress: Progress | None
) -> list[LuminanceMap]:
    """Compare the acceptances of the ladder; a second pass only for maps with more pixels than the comparison had."""
    ladder = [ConeView(o, comparison_screen(s), LADDER) for o, s in pairs]
    compared, tally = cone_estimates(rays, ladder, threads, progress)
    choices = [choose_acceptance(e, s) for e, (_, s) in zip(compared, pairs, strict=True)]
    fine = [i for i, (e, (_, s)) in enumerate(zip(compared, pairs, strict=True)) if e.view.screen != s]
    views = [ConeView(*pairs[i], (choices[i].acceptance,)) for i in fine]
    refined = dict(zip(fine, cone_estimates(rays, views, threads, progress)[0] if fine else [], strict=True))
    return [
        _map(rays, refined[i], 0, tally, choice) if i in refined else _map(rays, estimate, choice.index, tally, choice)
        for i, (estimate, choice) in enumerate(zip(compared, choices, strict=True))
    ]


def _map(
    rays: RayStream, estimate: ConeEstimate, index: int, tally: Tally, choice: AcceptanceChoice | None
) -> LuminanceMap:
    counts = estimate.rays[index]
    dead = counts == 0
    values = np.where(dead, np.nan, estimate.luminance[index])
    error = np.where(dead, np.nan, np.sqrt(estimate.variance[index]))
    angle = estimate.view.acceptances[index]
    notes = [
        f"{counts.sum():,} of {tally.rays:,} rays head for the observer within {angle:.4g}° through the screen",
        f"{int(dead.sum()):,} of {dead.size:,} pixels are dead (no ray): NaN",
    ]
    if isinstance(rays, RayIndex):
        notes.append(f"by the index: {estimate.looked:,} rays were looked at, and no other can be seen")
    notes.append(
        "standard errors hold the noise of the rays alone; what the cone blurs, over the angle and by parallax at the edges "
        "of the source, is not in them"
    )
    if tally.unusable:
        notes.append(f"{tally.unusable:,} rays cannot be used and were left out; see the ray set's complaints")
    if choice is not None:
        notes.append(choice.reason)
    notes += rays.notes
    method = "cone" if choice is None else "cone, automatic acceptance"
    return LuminanceMap(
        values=values,
        standard_error=error,
        rays=counts,
        observer=estimate.view.observer,
        screen=estimate.view.screen,
        flux_unit=rays.flux_unit,
        provenance=rays.provenance.then(f"luminance by {method}, acceptance {angle:.6g}°"),
        notes=tuple(notes),
    )
