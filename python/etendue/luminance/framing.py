"""Where the light that heads for an observer comes from: a screen that shows it, and how much of it a screen shows."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.lightfield.light_field import LightField
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.quantities.vectors import lengths
from etendue.quantities.weighted_quantile import weighted_quantile
from etendue.scene import Scene, compile_scene
from etendue.scene.compiling import Compiled
from etendue.scene.framing import corners_of, framed_screen

Array = npt.NDArray[np.float64]

PROBED = 1 << 16
"""Rays that are looked at."""

CONES = (1.5, 3.0, 6.0, 12.0, 25.0)
"""Half-angles [°] about the line to the observer within which rays head for him; the first with `ENOUGH` rays is taken,
else the last."""

ENOUGH = 1000

SHOWN = 0.995
"""Share of the light along each axis of the screen that a framed screen shows; the rest are strays."""

MARGIN = 1.1
"""How much larger than that the screen is."""

POINTS = 48
"""Points along each coordinate of a part over which the intensity of a field towards an observer is summed."""

CLOSE = 0.03
"""Share of it below which a map need not be looked at more closely: quadrature, and observers that are near."""

FEW_SEEN = 30
"""Rays that tell a share to a tenth or so."""

MOST_BEYOND = 0.01
"""Share of the light on a screen that may start beyond the observer without a note."""

MOST_MISSED = 0.1
"""Share of the light towards the observer that a screen may miss without a note."""


@dataclasses.dataclass(frozen=True, eq=False)
class Lines:
    """Rays with their columns at hand, which a set forms anew each time that it is asked for them.

    Parameters
    ----------
    position, direction : array, shape (n, 3)
        [mm], unit vectors.
    flux : array, shape (n,)
        [flux unit of the rays]
    focus : array, shape (3,)
        The point that the lines come closest to [mm].
    source : str
        Where the rays come from.
    """

    position: Array
    direction: Array
    flux: Array
    focus: Array
    source: str

    @classmethod
    def of(cls, rays: RaySet | Lines) -> Lines:
        """Those of a set; of lines themselves.

        Examples
        --------
        >>> import etendue as et
        >>> lines = Lines.of(et.RingSource(rays=1000).ray_set())
        >>> lines.position.shape, Lines.of(lines) is lines
        ((1000, 3), True)
        """
        if isinstance(rays, Lines):
            return rays
        focus = np.array(rays.virtual_focus.point)
        return cls(rays.position, rays.direction, rays.flux, focus, rays.provenance.source)


@dataclasses.dataclass(frozen=True)
class Light:
    """Rays that head for an observer, where they cross a plane.

    Parameters
    ----------
    right, up : array, shape (n,)
        Along the axes of the screen, from the observer's target [mm].
    flux : array, shape (n,)
        [flux unit of the rays]
    cone : float
        Half-angle [°] within which they head for him.
    """

    right: Array
    up: Array
    flux: Array
    cone: float

    def share(self, screen: Screen) -> float:
        """Of the flux: what crosses the screen; NaN if there is none."""
        within = (np.abs(self.right) <= screen.width / 2) & (np.abs(self.up) <= screen.height / 2)
        total = float(self.flux.sum())
        return float(self.flux[within].sum()) / total if total > 0 else np.nan


def probe(source: RayStream | LightField) -> RaySet:
    """Some rays of a source, or rays drawn from a field."""
    return source.sample(PROBED) if isinstance(source, LightField) else pilot_sample(source, PROBED)


def light_towards(rays: RaySet | Lines, observer: Observer, screen: Screen) -> Light:
    """Those of the rays that head for the observer, where their lines cross the plane of the screen.

    Examples
    --------
    >>> import etendue as et
    >>> rings = et.RingSource(rays=200_000).ray_set()
    >>> screen = et.Screen(20, 20, 1, 1)                                     # as wide as the innermost ring
    >>> light = light_towards(rings, et.Observer(0, 0, 1000), screen)
    >>> abs(light.share(screen) - 100 / np.pi * 300 / 600 * np.pi / 100) < 0.05, light.cone
    (True, 6.0)
    """
    lines = Lines.of(rays)
    right, up, normal = screen.axes(observer)
    direction = lines.direction
    # From where on its line a ray heads somewhere: from where it comes closest to the middle of the light.
    along = np.einsum("ij,ij->i", lines.position - lines.focus, direction)
    start = lines.position - along[:, None] * direction
    towards = observer.position - start
    cosine = np.einsum("ij,ij->i", towards, direction) / np.maximum(lengths(towards), np.finfo(float).tiny)
    cone = next((a for a in CONES if (cosine > np.cos(np.radians(a))).sum() >= ENOUGH), CONES[-1])
    heading = cosine > np.cos(np.radians(cone))
    crossing = _crossing(start[heading] - np.asarray(observer.target), direction[heading], normal)
    across, upwards = (np.nan_to_num(crossing @ axis, nan=np.inf) for axis in (right, up))
    return Light(across, upwards, lines.flux[heading], cone)


def _crossing(start: Array, direction: Array, normal: Array) -> Array:
    """Where lines cross the plane through the origin with this normal, shape (n, 3) [mm]; NaN if they run along it."""
    slope = direction @ normal
    return np.asarray(start - ((start @ normal) / np.where(slope == 0.0, np.nan, slope))[:, None] * direction)


def framed(rays: RaySet | Lines, observer: Observer, columns: int = 128, rows: int = 128) -> Screen:
    """The smallest screen of square pixels, about the observer's target, that shows the light which heads for him.

    Strays do not count: along each axis 0.5 % of the light may lie beyond. The size is rounded up to two digits.

    Raises
    ------
    ArgumentError
        If none of the rays heads for the observer.

    Examples
    --------
    >>> import etendue as et
    >>> framed(et.RingSource(rays=200_000).ray_set(), et.Observer(0, 0, 1000), 64, 32)
    Screen(width=130.0, height=65.0, columns=64, rows=32, plane='view')
    """
    lines = Lines.of(rays)
    light = light_towards(lines, observer, Screen(1.0, 1.0, columns, rows))
    if not light.flux.any():
        raise ArgumentError(
            f"no ray of {lines.source} heads for the observer at θ {observer.theta:g}°, φ {observer.phi:g}°: "
            "from there the source is dark. Choose another observer, or state the screen's size."
        )
    reach = [weighted_quantile(np.abs(axis), light.flux, SHOWN) for axis in (light.right, light.up)]
    side = max(2.0 * MARGIN * max(reach[0] / columns, reach[1] / rows), np.finfo(np.float64).tiny)
    pixel = _rounded_up(side * columns) / columns
    return Screen(pixel * columns, pixel * rows, columns, rows)


def framed_screens(
    source: RayStream | LightField | Scene, observers: Sequence[Observer], columns: int = 128, rows: int = 128
) -> list[Screen]:
    """A screen for each observer, about his target, on which he sees the whole scene, or all light but strays.

    Scenes of nothing but measured sources have no other end than their light.

    Raises
    ------
    ArgumentError
        As `framed`, or `etendue.scene.framing.framed_screen`.
    SceneError
        If the scene has mistakes.

    Examples
    --------
    >>> import etendue as et
    >>> [screen.width for screen in framed_screens(et.RingSource(rays=200_000), [et.Observer(0, 0, 1000)])]
    [63.0]
    """
    if isinstance(source, Scene):
        compiled = compile_scene(source)
        measured = None if len(corners_of(compiled)) else light_of_sources(source, compiled)
        if measured is None:
            return [framed_screen(compiled, observer, columns, rows) for observer in observers]
        some = measured
    else:
        some = probe(source)
    return [framed(some, observer, columns, rows) for observer in observers]


def light_of_sources(scene: Scene, compiled: Compiled) -> RaySet | None:
    """Some rays of those sources of a scene whose extent nothing else tells, in their places; None if there are none.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "rays", "rays": et.RingSource(rays=1000), "at": [0, 0, 5], "flux": 3}
    >>> scene = et.Scene(sources=[lamp])
    >>> some = light_of_sources(scene, compile_scene(scene))
    >>> round(some.total_flux, 9), some.position[:, 2].tolist() == [5.0] * 1000
    (3.0, True)
    """
    parts = []
    for source, record in zip(scene.sources, compiled.record["sources"], strict=True):
        some = source.some_rays(scene.files, max(PROBED // len(scene.sources), 1))
        if some is None:
            continue
        frame = source.frame()
        flux = some.flux * (record["flux"] / some.total_flux)
        parts.append((some.position @ frame.axes.T + frame.origin, some.direction @ frame.axes.T, flux))
    if not parts:
        return None
    position, direction, flux = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return RaySet(
        position, direction, flux, flux_unit=compiled.flux_unit, provenance=Provenance(scene.name or "the scene")
    )


def shows_whole(field: LightField, lmap: LuminanceMap) -> bool:
    """Whether the map has the intensity of the field towards its observer, as far as he is away: then nothing is missed."""
    towards = lmap.observer.position - np.asarray(lmap.observer.target)
    intensity = float(field.core.intensity(np.ascontiguousarray(towards[None, :]), POINTS)[0])
    return lmap.intensity > (1.0 - CLOSE) * intensity


def is_far(field: LightField, lmap: LuminanceMap) -> bool:
    """Whether the observer is for sure farther from his target than any part of the field's surface."""
    target = np.asarray(lmap.observer.target)
    reach = [np.linalg.norm(np.asarray(p.centre) - target) + np.linalg.norm(p.size) for p in field.surface.parts()]
    return bool(max(reach) < lmap.observer.distance)


def centre_of_light(rays: RaySet | Lines) -> tuple[float, float, float]:
    """The point to look at [mm]: the one that the lines of the rays come closest to, or the middle of where they start.

    Rounded to a hundredth of the distance at which the lines pass it.

    Examples
    --------
    >>> import etendue as et
    >>> centre_of_light(et.RingSource(rays=100_000).ray_set().moved((3, 0, 7)))
    (3.0, 0.0, 7.0)
    """
    lines = Lines.of(rays)
    point = lines.focus
    off = lengths(np.cross(lines.position - point, lines.direction))
    step = 10.0 ** np.floor(np.log10(max(weighted_quantile(off, lines.flux, SHOWN), 1e-6))) / 10.0
    x, y, z = np.round(point / step) * step + 0.0
    return (float(f"{x:.12g}"), float(f"{y:.12g}"), float(f"{z:.12g}"))


def beyond_notes(rays: RaySet | Lines, observer: Observer, screen: Screen) -> tuple[str, ...]:
    """What is to be said of rays that start beyond the observer, as seen from the screen, but whose lines pass him.

    Where on its line a ray starts has no influence on a map: rays are often recorded on a surface about their source, which
    may be wider than the observer is away. Of a second lamp behind him he would see nothing.

    Examples
    --------
    >>> import etendue as et
    >>> lamps = et.RingSource(rays=200_000).ray_set()
    >>> beyond_notes(lamps, et.Observer(0, 0, 300), et.Screen(60, 60, 1, 1))
    ()
    >>> beyond_notes(lamps.moved((0, 0, 600)), et.Observer(0, 0, 300), et.Screen(200, 200, 1, 1))[0][:56]
    'about 100% of the light that the map shows starts beyond'
    """
    lines = Lines.of(rays)
    right, up, normal = screen.axes(observer)
    beyond = np.einsum("ij,ij->i", lines.position - observer.position, lines.direction) > 0.0
    if not beyond.any():
        return ()
    start, direction = lines.position - np.asarray(observer.target), lines.direction
    crossing = _crossing(start, direction, normal)
    on_screen = (np.abs(crossing @ right) <= screen.width / 2) & (np.abs(crossing @ up) <= screen.height / 2)
    towards = observer.position - np.asarray(observer.target) - crossing
    cosine = np.einsum("ij,ij->i", towards, direction) / lengths(towards)
    seen = (on_screen & (cosine > np.cos(np.radians(cone))) for cone in CONES)
    shown = next(
        (some for some in seen if some.sum() >= FEW_SEEN), on_screen & (cosine > np.cos(np.radians(CONES[-1])))
    )
    total = float(lines.flux[shown].sum())
    share = float(lines.flux[shown & beyond].sum()) / total if total > 0.0 else 0.0
    if not share > MOST_BEYOND:
        return ()
    told = (
        f"about {share:.0%} of the light that the map shows starts beyond the observer and is seen along the lines of its "
        "rays, as if it came through the screen: right if they were recorded on a surface about their source, wrong of a "
        "lamp that is behind him; leave that one out, or put both into a scene"
    )
    return (told,)


def missed_notes(rays: RaySet | Lines, observer: Observer, screen: Screen) -> tuple[str, ...]:
    """What is to be said of a screen that does not show nine tenths of the light towards its observer.

    Nothing from within the source: there the light comes from all sides, and no screen shows most of it.
    """
    lines = Lines.of(rays)
    light = light_towards(lines, observer, screen)
    if light.share(screen) >= 1.0 - MOST_MISSED:
        return ()
    middle = centre_of_light(lines)
    from_middle = lengths(lines.position - np.asarray(middle))
    if np.linalg.norm(observer.position - np.asarray(middle)) < weighted_quantile(from_middle, lines.flux, SHOWN):
        return ()
    there = dataclasses.replace(observer, target=middle)
    if not (light.flux.any() and light_towards(lines, there, screen).flux.any()):
        return ("of the rays that were looked at none heads for the observer: from there the source is dark",)
    whole = framed(lines, there, screen.columns, screen.rows)
    place = ",".join(f"{x:g}" for x in middle)
    shown = f"{light.share(screen):.1%} of the light that heads for the observer (rays within {light.cone:g}°)"
    size = f"{whole.width:g} × {whole.height:g} mm"
    return (f"the screen shows {shown}; one of {size} about the target {place} shows it",)


def _rounded_up(value: float) -> float:
    """Up to two digits."""
    step = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(f"{np.ceil(value / step - 1e-9) * step:.12g}")
