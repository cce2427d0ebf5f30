"""One section of a scene, drawn: fills, faces, sources, detectors, observers, rays, names."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from etendue.plot import style
from etendue.plot.labels import LabelPlacer
from etendue.plot.scene_layout import SceneLayout
from etendue.plot.scene_legend import DETECTOR, FINISH_LINES, OBSERVER, OPAQUE, RAY, SOURCE, fill_colours, shortened
from etendue.plot.scene_parts import FINISH_KINDS, Glow, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

NEAR = 0.15
"""Of the frame: rays that start so far from the section are drawn with 1/e of the opacity."""
STRONGEST, FADE, FAINTEST = 0.85, 0.85, 0.06
"""Opacity of a ray where it starts; what is left of it from one part to the next, beside the square of the cosine between
the part and the section; and where the ray is given up: a scattered one soon is, one that stays in the section is not."""
EMISSION = 0.035
"""Length of the light drawn at a source, as a share of the frame's smaller side."""
DIRECTIONS = 16
"""Strokes at a source that is no surface."""
MOST_LABELS = 16
LABEL_SIZE = 7.5


def draw_view(axes: Axes, view: View, layout: SceneLayout, inches: tuple[float, float], *, labelled: bool) -> None:
    """Draw a section on axes of this width and height; `labelled`: with numbers at its upright axis."""
    left, right, bottom, top = view.window
    axes.set(xlim=(left, right), ylim=(bottom, top))
    style.dress(axes)
    section = view.section
    for axis, length, name, low, high in (
        (axes.xaxis, inches[0], section.across, left, right),
        (axes.yaxis, inches[1], section.up, bottom, top),
    ):
        axis.set_major_locator(style.locator_for(length))
        style.put_numbers(axis, name, "mm", low, high)
    if not labelled:
        axes.set_ylabel("")
        axes.tick_params(labelleft=False)
    placer = LabelPlacer(*inches, LABEL_SIZE)
    _fill(axes, view, layout)
    _faces(axes, view, placer)
    _detectors(axes, view, placer)
    _trails(axes, view, placer)
    for glow in view.sources:
        _glow(axes, view, glow, placer)
    _observers(axes, view, layout, placer)
    _names(axes, view, placer)
    if not (view.faces or view.sources or view.detectors):
        axes.text(
            0.5, 0.5, "nothing is cut here", transform=axes.transAxes, ha="center", va="center", color=style.FAINT
        )


def _fill(axes: Axes, view: View, layout: SceneLayout) -> None:
    """Solids in their order: the later one fills the space, as it does for the tracer."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    colours = fill_colours(layout)
    for part in view.solids:
        rings = _turned(part.rings)
        if rings:
            path = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
            colour = OPAQUE if part.medium is None else colours[part.medium]
            axes.add_patch(PathPatch(path, facecolor=colour, linewidth=0.0, zorder=1.0))


MOST_NESTED = 300
"""Rings of which it is worked out which lies in which."""


def _turned(rings: list[Array]) -> list[Array]:
    """Rings turned so that those within an odd number of others are holes."""
    from matplotlib.path import Path

    paths = [Path(ring) for ring in rings] if len(rings) <= MOST_NESTED else []
    turned = []
    for i, ring in enumerate(rings):
        depth = sum(path.contains_point(ring[0]) for j, path in enumerate(paths) if j != i)
        x, y = (ring - ring[0]).T
        forward = float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum()) > 0.0
        turned.append(ring if forward == (depth % 2 == 0) else ring[::-1])
    return turned


def _inches(view: View, placer: LabelPlacer, points: Array) -> Array:
    left, right, bottom, top = view.window
    scale = np.array([placer.width / (right - left), placer.height / (top - bottom)])
    scaled: Array = (points - (left, bottom)) * scale
    return scaled


def _faces(axes: Axes, view: View, placer: LabelPlacer) -> None:
    from matplotlib.collections import LineCollection

    for kind in FINISH_KINDS:
        curves = [curve for face in view.faces if face.kind == kind for curve in face.curves]
        if curves:
            # Butt ends, so that a face is as long as it is.
            axes.add_collection(
                LineCollection(curves, **FINISH_LINES[kind], capstyle="butt", zorder=3.0), autolim=False
            )
        for curve in curves:
            placer.draw(_inches(view, placer, _thinned(curve)))


def _thinned(curve: Array, most: int = 60) -> Array:
    step = max(1, len(curve) // most)
    return np.concatenate([curve[:-1:step], curve[-1:]])


def _detectors(axes: Axes, view: View, placer: LabelPlacer) -> None:
    for part in view.detectors:
        for curve in part.curves:
            axes.plot(*curve.T, color=DETECTOR, linewidth=1.2, linestyle="--", zorder=2.8)
            placer.draw(_inches(view, placer, _thinned(curve)))


def _trails(axes: Axes, view: View, placer: LabelPlacer) -> None:
    """Rays, cut at the frame: with an arrow where they leave it or are last seen on their way, a dot where they end."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_rgb

    left, right, bottom, top = view.window
    segments, colours = [], []
    aside = [abs(float(view.section.depth(points[0]))) for points in view.trails]
    size = max(right - left, top - bottom)
    for points, away in zip(view.trails, aside, strict=True):
        # Where no source lies in the section, the nearest one counts as if it did.
        strength = STRONGEST * float(np.exp(-(away - min(aside)) / (NEAR * size)))
        flat = view.section.flat(points)
        length = np.maximum(np.linalg.norm(np.diff(points, axis=0), axis=1), np.finfo(np.float64).tiny)
        along = np.hypot(*np.diff(flat, axis=0).T) / length
        last = None
        for a, b, share in zip(flat, flat[1:], along, strict=False):
            strength *= share * share
            if strength < FAINTEST:
                break
            inside = _clip(a, b, view.window)
            if inside is not None:
                segments.append(inside)
                colours.append((*to_rgb(RAY), strength))
                last = inside, strength
                placer.draw(_inches(view, placer, inside), 0.25)
            strength *= FADE
        else:
            if left < flat[-1, 0] < right and bottom < flat[-1, 1] < top:
                axes.plot(*flat[-1], marker="o", markersize=2.2, color=RAY, markeredgewidth=0.0, zorder=4.1)
            elif last is not None:
                _arrow(axes, last[0], last[1], view)
    axes.add_collection(LineCollection(segments, colors=colours, linewidths=0.7, zorder=4.0), autolim=False)


def _arrow(axes: Axes, segment: Array, alpha: float, view: View) -> None:
    """An arrowhead in the outer half of a segment."""
    along = segment[1] - segment[0]
    size = max(view.window[1] - view.window[0], view.window[3] - view.window[2])
    if np.hypot(*along) < 0.02 * size:
        return
    # A triangle turned by 0 points up.
    turn = np.degrees(np.arctan2(along[1], along[0])) - 90.0
    at = segment[0] + 0.72 * along
    axes.plot(*at, marker=(3, 0, float(turn)), markersize=4.2, color=RAY, markeredgewidth=0.0, alpha=alpha, zorder=4.1)


def _clip(a: Array, b: Array, window: tuple[float, float, float, float]) -> Array | None:
    """The part of a segment within a window, by Liang and Barsky's way of clipping."""
    left, right, bottom, top = window
    step = b - a
    start, end = 0.0, 1.0
    for k, (low, high) in enumerate(((left, right), (bottom, top))):
        if step[k] == 0.0:
            if not low <= a[k] <= high:
                return None
            continue
        t = sorted(((low - a[k]) / step[k], (high - a[k]) / step[k]))
        start, end = max(start, t[0]), min(end, t[1])
    return np.array([a + start * step, a + end * step]) if start < end else None


def _glow(axes: Axes, view: View, glow: Glow, placer: LabelPlacer) -> None:
    """A source: its own line, or the points from which its rays start; and short strokes where its light leaves."""
    from matplotlib.collections import LineCollection

    left, right, bottom, top = view.window
    reach = EMISSION * min(right - left, top - bottom)
    strokes: list[Array] = []
    if glow.curves:
        for curve in glow.curves:
            axes.plot(*curve.T, color=SOURCE, linewidth=2.6, solid_capstyle="butt", zorder=5.0)
            strokes += _strokes(curve, glow, reach)
            placer.draw(_inches(view, placer, _thinned(curve)))
    elif len(glow.start) and not glow.near:
        axes.scatter(glow.start[:, 0], glow.start[:, 1], s=2.0, color=SOURCE, linewidths=0.0, alpha=0.25, zorder=2.0)
    elif len(glow.start):
        spread = float(np.ptp(glow.start, axis=0).max())
        if spread <= 1e-3 * reach:
            axes.plot(*glow.start[0], marker="o", markersize=4.5, color=SOURCE, markeredgewidth=0.0, zorder=5.0)
            strokes += _rays_of_a_point(glow, reach)
        else:
            axes.scatter(glow.start[:, 0], glow.start[:, 1], s=2.0, color=SOURCE, linewidths=0.0, alpha=0.7, zorder=5.0)
            few = zip(glow.start[:DIRECTIONS], glow.direction[:DIRECTIONS], strict=True)
            strokes += [np.array([p, p + min(reach, spread) * d]) for p, d in few]
        for point in glow.start[:24]:
            placer.draw(_inches(view, placer, np.array([point, point])))
    axes.add_collection(LineCollection(strokes, colors=SOURCE, linewidths=0.8, zorder=5.0, alpha=0.9), autolim=False)


def _rays_of_a_point(glow: Glow, reach: float) -> list[Array]:
    """Strokes around a point source, the longer the more light goes their way."""
    angle = np.arctan2(glow.direction[:, 1], glow.direction[:, 0])
    sector = np.floor(angle * DIRECTIONS / (2.0 * np.pi) + 0.5).astype(np.int64) % DIRECTIONS
    flux = np.bincount(sector, np.hypot(*glow.direction.T), DIRECTIONS)
    found = []
    for number, share in enumerate(flux / flux.max()):
        turn = 2.0 * np.pi * number / DIRECTIONS
        toward = np.array([np.cos(turn), np.sin(turn)])
        if share > 0.02:
            found.append(glow.start[0] + np.outer([0.8 * reach, (1.0 + share) * reach], toward))
    return found


def _strokes(curve: Array, glow: Glow, reach: float) -> list[Array]:
    """Short lines off a luminous line, on the side to which the rays go that start near."""
    steps = np.hypot(*np.diff(curve, axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(np.clip(way[-1] / (1.2 * reach), 1, 60))
    found = []
    for at in (np.arange(count) + 0.5) * way[-1] / count:
        i = int(np.clip(np.searchsorted(way, at) - 1, 0, len(steps) - 1))
        along = (curve[i + 1] - curve[i]) / max(steps[i], np.finfo(np.float64).tiny)
        point = curve[i] + along * (at - way[i])
        normal = np.array([-along[1], along[0]])
        near = np.argsort(np.hypot(*(glow.start - point).T))[:9]
        side = float(np.sign((glow.direction[near] @ normal).sum()))
        found.append(np.array([point, point + side * reach * normal]))
    return found


def _observers(axes: Axes, view: View, layout: SceneLayout, placer: LabelPlacer) -> None:
    """An arrow from the eye, or from the frame in its direction; a ring where it looks straight onto the section."""
    left, right, bottom, top = view.window
    reach = 0.07 * max(right - left, top - bottom)
    for number, keys in enumerate(layout.scene.observers):
        observer = keys.observer()
        name = keys.name or f"observers[{number}]"
        target = view.section.flat(np.asarray(observer.target))
        toward = view.section.flat(observer.direction)
        if not (left <= target[0] <= right and bottom <= target[1] <= top):
            continue
        if np.hypot(*toward) < 0.2:
            axes.plot(*target, marker="o", markersize=6.0, markerfacecolor="none", color=OBSERVER, zorder=6.0)
            axes.plot(*target, marker="o", markersize=1.6, color=OBSERVER, zorder=6.0)
            _name(axes, view, placer, name, [np.array([target, target])], OBSERVER)
            continue
        viewpoint = view.section.flat(observer.position)
        inside = _clip(target, viewpoint, view.window)
        if inside is None:
            continue
        unit = toward / np.hypot(*toward)
        start = inside[1] - 0.02 * reach * unit
        axes.annotate(
            "",
            xy=tuple(start - reach * unit),
            xytext=tuple(start),
            arrowprops={"arrowstyle": "-|>", "color": OBSERVER, "linewidth": 1.1, "mutation_scale": 8.0},
            zorder=6.0,
        )
        shaft = np.array([start, start - reach * unit])
        placer.draw(_inches(view, placer, shaft))
        far = "" if (inside[1] == viewpoint).all() else f", {style.plain(observer.distance)} mm"
        _name(axes, view, placer, f"{name}{far}", [shaft], OBSERVER)


def _names(axes: Axes, view: View, placer: LabelPlacer) -> None:
    """Names of sources, detectors, surfaces and solids, the larger ones first if there are too many."""
    near = _merged([glow for glow in view.sources if glow.near])
    things = [(glow.name, glow.curves or [glow.start], SOURCE) for glow in near]
    things += [(part.name, part.curves, DETECTOR) for part in view.detectors]
    solids = {part.name for part in view.solids}
    surfaces = [face for face in view.faces if not any(face.name.startswith(f"{name}.") for name in solids)]
    rest = [(part.name, part.curves, style.INK) for part in (*surfaces, *view.solids)]
    rest.sort(key=lambda thing: -_extent(thing[1]))
    for name, curves, colour in [*things, *rest][:MOST_LABELS]:
        _name(axes, view, placer, name, curves, colour)


def _merged(glows: list[Glow]) -> list[Glow]:
    """Sources with several emitters as one: rings are."""
    found: dict[str, Glow] = {}
    for glow in glows:
        name = glow.name.split(".ring ")[0]
        if name in found:
            held = found[name]
            start = np.concatenate([held.start, glow.start])
            direction = np.concatenate([held.direction, glow.direction])
            found[name] = Glow(name, held.curves + glow.curves, start, direction, near=True)
        else:
            found[name] = dataclasses.replace(glow, name=name)
    return list(found.values())


def _extent(curves: list[Array]) -> float:
    return float(np.ptp(np.concatenate(curves), axis=0).max())


def _name(axes: Axes, view: View, placer: LabelPlacer, text: str, curves: list[Array], colour: str) -> None:
    import matplotlib.patheffects as effects

    text = shortened(text, 28)
    label = placer.place(text, [_inches(view, placer, curve) for curve in curves if len(curve)])
    if label is None:
        return
    size = np.array([placer.width, placer.height])
    at, anchor = np.array([label.x, label.y]) / size, np.array(label.anchor) / size
    if label.leads:
        axes.plot(*np.array([anchor, at]).T, transform=axes.transAxes, color=colour, linewidth=0.4, zorder=6.5)
    axes.text(
        float(at[0]),
        float(at[1]),
        text,
        transform=axes.transAxes,
        ha="center",
        va="center",
        size=LABEL_SIZE,
        color=colour,
        zorder=7.0,
        path_effects=[effects.withStroke(linewidth=2.0, foreground="white", alpha=0.85)],
    )
