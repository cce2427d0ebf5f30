"""A scene in sections, to scale, with a few rays: to see that it is what one meant."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from etendue.extras import require
from etendue.plot import style
from etendue.plot.scene_drawing import draw_view
from etendue.plot.scene_layout import DEFAULT_SECTIONS, SceneLayout, lay_out_scene
from etendue.plot.scene_legend import legend_handles
from etendue.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDEST, HIGHEST = 8.6, 5.4
"""Of all sections together [inches]."""
LEFT, RIGHT, GAP = 0.72, 0.2, 0.3
"""Room beside the sections [inches]."""
NARROWEST = 6.0
"""Of the figure [inches]."""
LEGEND_LINE, CAPTION_LINE = 0.185, 0.15
"""Heights of lines [inches]."""


@overload
def draw_scene(
    scene: Scene,
    path: str | os.PathLike[str] | None = None,
    *,
    section: str | Sequence[str] = DEFAULT_SECTIONS,
    rays: int = 30,
    seed: int = 1,
    window: Sequence[float] | None = None,
    title: str | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def draw_scene(
    scene: Scene,
    path: None = None,
    *,
    section: str | Sequence[str] = DEFAULT_SECTIONS,
    rays: int = 30,
    seed: int = 1,
    window: Sequence[float] | None = None,
    title: str | None = None,
    ax: Axes | Sequence[Axes] | npt.NDArray[Any],
) -> tuple[Axes, ...]: ...


def draw_scene(
    scene: Scene,
    path: str | os.PathLike[str] | None = None,
    *,
    section: str | Sequence[str] = DEFAULT_SECTIONS,
    rays: int = 30,
    seed: int = 1,
    window: Sequence[float] | None = None,
    title: str | None = None,
    ax: Axes | Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw sections of a scene to scale, with a few rays.

    Solids have the colour of their medium, faces the line of what their finish mostly does, sources are warm with their
    light on the side where it leaves, detectors are dashed. Rays are chosen that begin near a section and along it, and
    are projected onto it; what leads out of the section is fainter, and so is each further part of a ray.

    Parameters
    ----------
    scene : Scene
        What is drawn; all its mistakes are told first.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same scene gives the same bytes.
    section : str or sequence of str
        Planes across one of the axes, e.g. ``"y=0"``; up to three.
    rays : int
        Rays in each section, 0 to 1000.
    seed : int
        0 to 2⁶⁴ − 1.
    window : left, right, bottom, top, optional
        What each section shows [mm]; by default everything that has an end, and detectors that are not too far.
    title : str, optional
        First line; the name of the scene if not given.
    ax : matplotlib.axes.Axes, or a sequence of them, optional
        Axes to draw on, one for each section, in a figure of your own; the legend stands under the first of them, and there
        is no caption and no `title`.

    Returns
    -------
    matplotlib.figure.Figure or tuple of matplotlib.axes.Axes
        The figure, not registered with pyplot; or the axes of `ax`.

    Raises
    ------
    SceneError
        With every mistake in the scene.
    ArgumentError
        If a section, a number or the window is out of its domain, `path` and `ax` are both given, or there are not as
        many axes as sections.
    UnknownNameError
        If the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> lens = {"shape": {"kind": "lens", "radius": 5, "thickness": 4}, "medium": "BK7"}
    >>> figure = draw_scene(Scene(solids=[lens]), section="x=0")
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('y [mm]', 'z [mm]')
    """
    require("matplotlib")
    layout = lay_out_scene(scene, section, rays=rays, seed=seed, window=window)
    if ax is None:
        return plot_layout(layout, path, title=title)
    given = style.given_axes(ax, len(layout.views), path)
    for axes, view in zip(given, layout.views, strict=True):
        left, right, bottom, top = view.window
        wide, high = style.inches_of(axes)
        scale = min(wide / (right - left), high / (top - bottom))
        draw_view(axes, view, layout, (scale * (right - left), scale * (top - bottom)), labelled=True)
        axes.set_aspect("equal")
        style.put_title(axes, str(view.section))
    if handles := legend_handles(layout):
        style.put_legend(
            given[0],
            handles=[handle for handle, _ in handles],
            labels=[text for _, text in handles],
            loc="upper left",
            bbox_to_anchor=(0.0, -0.2),
            handlelength=2.2,
        )
    return given


def plot_layout(layout: SceneLayout, path: str | os.PathLike[str] | None = None, *, title: str | None = None) -> Figure:
    """Draw what `lay_out_scene` found; see `draw_scene`.

    Examples
    --------
    >>> len(plot_layout(lay_out_scene(Scene())).axes)
    2
    """
    require("matplotlib")
    places = _Places.of(layout)
    figure = style.new_figure(places.width, places.height)
    handles = legend_handles(layout)
    for number, (view, (left, bottom, width, height)) in enumerate(zip(layout.views, places.views, strict=True)):
        axes = style.add_axes(figure, left, bottom, width, height)
        shares_height = number > 0 and places.side_by_side and view.section.up == layout.views[number - 1].section.up
        draw_view(axes, view, layout, (width, height), labelled=not shares_height)
        # In the middle: at the upper left, the axis may say its power of ten.
        middle, over = left + width / 2, bottom + height + 0.07
        style.add_text(figure, middle, over, str(view.section), ha="center", size=style.LABEL_SIZE, color=style.INK)
    heading = title if title is not None else layout.scene.name or "Scene"
    top = places.height
    style.add_text(figure, LEFT, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    if handles:
        figure.legend(
            handles=[handle for handle, _ in handles],
            labels=[text for _, text in handles],
            loc="upper left",
            bbox_to_anchor=(LEFT / places.width, places.legend_top / places.height),
            ncols=places.legend_columns,
            frameon=False,
            fontsize=style.TICK_SIZE,
            labelcolor=style.INK,
            handlelength=2.2,
            columnspacing=1.6,
            labelspacing=0.45,
            borderaxespad=0.0,
            borderpad=0.0,
        )
    for number, line in enumerate(reversed(places.caption)):
        y = 0.14 + CAPTION_LINE * number
        style.add_text(figure, LEFT, y, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def _facts(layout: SceneLayout) -> list[str]:
    """What the picture rests on."""
    facts = []
    shown = max((len(view.trails) for view in layout.views), default=0)
    if shown:
        facts.append(f"{shown} rays in each section, chosen near it and projected, seed {layout.seed}")
    if any(part.medium is not None for view in layout.views for part in view.solids):
        facts.append(f"n at {style.plain(layout.wavelength)} nm")
    if layout.uncut:
        facts.append(f"not cut: {_listed(layout.uncut)}")
    if layout.beyond:
        facts.append(f"farther away: {_listed(layout.beyond)}")
    return facts


def _listed(names: Sequence[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


class _Places(NamedTuple):
    """Places [inches]: of the figure, and (left, bottom, width, height) of each section."""

    width: float
    height: float
    views: list[tuple[float, float, float, float]]
    side_by_side: bool
    legend_top: float
    legend_columns: int
    caption: list[str]

    @classmethod
    def of(cls, layout: SceneLayout) -> _Places:
        spans = [(w[1] - w[0], w[3] - w[2]) for w in (view.window for view in layout.views)]
        count = len(spans)
        # All sections have one scale; side by side or one above the other, whichever makes it larger.
        beside = min((WIDEST - GAP * (count - 1)) / sum(w for w, _ in spans), HIGHEST / max(h for _, h in spans))
        above = min(WIDEST / max(w for w, _ in spans), (HIGHEST + 1.6 - 0.75 * (count - 1)) / sum(h for _, h in spans))
        side_by_side = count == 1 or beside >= 0.7 * above
        scale = beside if side_by_side else above
        sizes = [(scale * w, scale * h) for w, h in spans]
        # A section with an upright axis of its own has its numbers beside it.
        ups = [view.section.up for view in layout.views]
        gaps = [GAP if a == b else LEFT for a, b in itertools.pairwise(ups)]
        across = sum(w for w, _ in sizes) + sum(gaps) if side_by_side else max(w for w, _ in sizes)
        width = max(NARROWEST, LEFT + across + RIGHT)
        caption = style.wrapped(_facts(layout), width - LEFT - RIGHT)
        texts = [text for _, text in legend_handles(layout)]
        columns = max(
            1, min(len(texts), int((width - LEFT - RIGHT) / (0.65 + 0.062 * max(map(len, texts), default=1))))
        )
        lines = -(-len(texts) // columns)
        below = 0.3 + CAPTION_LINE * len(caption) + LEGEND_LINE * lines
        legend_top = below - 0.1
        bottom = below + 0.5
        views = []
        if side_by_side:
            left = LEFT
            for (w, h), gap in zip(sizes, [*gaps, 0.0], strict=True):
                views.append((left, bottom, w, h))
                left += w + gap
            high = max(h for _, h in sizes)
        else:
            at = bottom
            for w, h in reversed(sizes):
                views.insert(0, (LEFT, at, w, h))
                at += h + 0.75
            high = at - 0.75 - bottom
        return cls(width, bottom + high + 0.72, views, side_by_side, legend_top, columns, caption)
