"""Cross sections of maps in one diagram, each with its error band."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.comparison import CrossSection
from etendue.plot import style
from etendue.plot.colour_scale import Scale, choose_scale
from etendue.quantities.arguments import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT, LEFT = 6.4, 3.9, 0.85
"""Of the figure with one line of legend, and of the diagram's left side [inches]."""

LEGEND_ROOM = 80
"""Characters in one line of the legend."""

DASHES = ("-", "--", ":")
"""Told apart by colour first, then by dashes."""


@overload
def plot_cross_sections(
    sections: Sequence[CrossSection],
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_cross_sections(
    sections: Sequence[CrossSection],
    path: None = None,
    scale: Scale = "auto",
    *,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    ax: Axes,
) -> Axes: ...


def plot_cross_sections(
    sections: Sequence[CrossSection],
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    labels: Sequence[str] | None = None,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure | Axes:
    """Draw cross sections over position, as steps as wide as the pixels, with a band of ± one standard error.

    Parameters
    ----------
    sections : sequence of CrossSection
        At least one; all along the same axis and in the same unit.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    scale : {"auto", "linear", "log"}
        Scale of the luminance; ``"auto"`` is that of `plot_map`.
    labels : sequence of str, optional
        One name per section; by default where it was cut, with the map's origin where these differ. With labels the title
        tells where, if that is one place.
    title : str, optional
        First line; "Cross section" and where the map comes from if not given.
    ax : matplotlib.axes.Axes, optional
        Where to draw, in a figure of your own.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, not registered with pyplot; or `ax`. A line breaks where a pixel is dead.

    Raises
    ------
    ArgumentError
        If there is no section, the sections differ in axis or unit, or the labels in number, or `path` and `ax` are both
        given.
    UnknownNameError
        If `scale` or the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> line = CrossSection("x", 0.0, np.arange(3.0), 1.0, np.array([1.0, 3.0, 2.0]), np.full(3, 0.1), "luminance", "cd/m²")
    >>> plot_cross_sections([line]).axes[0].get_ylabel()
    'luminance [cd/m²]'
    """
    _check(sections, labels)
    scale = choose_scale(np.concatenate([section.values for section in sections]), scale).name
    sources = {section.source for section in sections}
    names = labels if labels is not None else [_place(section, of_several=len(sources) > 1) for section in sections]
    what = "Cross section" + ("s" if len(sections) > 1 else "")
    places = {f", {'y' if section.axis == 'x' else 'x'} = {style.plain(section.at)} mm" for section in sections}
    # Labels do not tell where.
    where = places.pop() if labels is not None and len(places) == 1 else ""
    source = sources.pop() if len(sources) == 1 else ""
    heading = title if title is not None else style.headed(what, source, 4.4 - 0.1 * len(where)) + where
    if ax is not None:
        style.given_axes(ax, 1, path)
        _draw_all(ax, sections, names, scale)
        for line in ax.patches:
            line.set_clip_on(True)  # whose axes they are may look at a part
        style.put_title(ax, heading)
        style.put_legend(ax, loc="best")
        return ax
    legend_columns = max(1, min(len(names), LEGEND_ROOM // (max(map(len, names)) + 6)))
    height = HEIGHT + 0.18 * (-(-len(names) // legend_columns) - 1)
    figure = style.new_figure(WIDTH, height)
    axes = style.add_axes(figure, LEFT, 0.55, WIDTH - LEFT - 0.2, HEIGHT - 1.2)
    _draw_all(axes, sections, names, scale)
    style.add_text(figure, LEFT, height - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    style.put_legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=legend_columns)
    return style.finish(figure, path)


def _draw_all(axes: Axes, sections: Sequence[CrossSection], names: Sequence[str], scale: str) -> None:
    _prepare(axes, sections, scale)
    for number, (section, name) in enumerate(zip(sections, names, strict=True)):
        _draw(axes, section, name, number)
    edges = _edges(sections[0])
    name = style.HORIZONTAL if sections[0].axis == "x" else style.VERTICAL
    style.put_numbers(axes.xaxis, name, "mm", edges[0], edges[-1])


def _place(section: CrossSection, *, of_several: bool) -> str:
    """Where a section was cut, and of which map if there are several."""
    place = f"at {style.plain(section.at)} mm {'up' if section.axis == 'x' else 'right'}"
    return f"{Path(section.source).name}, {place}" if of_several and section.source else place


def _prepare(axes: Axes, sections: Sequence[CrossSection], scale: str) -> None:
    """Limits and scales, before anything is drawn."""
    style.dress(axes)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.grid(visible=True, axis="y", color=style.RULE, linewidth=0.4)
    axes.set_axisbelow(True)
    edges = np.concatenate([_edges(section) for section in sections])
    axes.set_xlim(edges.min(), edges.max())
    shown = np.concatenate([section.values for section in sections])
    bands = np.concatenate([_band(section)[1] for section in sections])
    shown = shown[np.isfinite(shown)]
    top = float(np.max(bands, where=np.isfinite(bands), initial=shown.max(initial=0.0)))
    if scale == "log":
        axes.set_yscale("log", nonpositive="mask")
        positive = shown[shown > 0.0]
        if positive.size:
            low, high = positive.min() / 2.0, 2.0 * top
            axes.set_ylim(low, high)
            style.put_log_numbers(axes.yaxis)
        axes.set_ylabel(f"{sections[0].quantity} [{sections[0].unit}]")
    else:
        low = min(0.0, float(shown.min(initial=0.0)))
        axes.set_ylim(low, top + 0.05 * (top - low) if top > low else low + 1.0)
        # The power of ten stands at the axis: over the diagram it would lie on the legend.
        style.put_numbers(axes.yaxis, sections[0].quantity, sections[0].unit, *axes.get_ylim())


def _draw(axes: Axes, section: CrossSection, name: str, number: int) -> None:
    """One section. A pixel holds the mean over its extent, so it is drawn over its extent."""
    colour = style.LINES[number % len(style.LINES)]
    dashes = DASHES[number // len(style.LINES) % len(DASHES)]
    edges = _edges(section)
    low, high = _band(section)
    if axes.get_yscale() == "log":
        low = np.where(np.isnan(low), np.nan, np.maximum(low, axes.get_ylim()[0]))
    axes.stairs(high, edges, baseline=low, fill=True, color=colour, alpha=0.22, linewidth=0.0)
    line = axes.stairs(section.values, edges, baseline=None, color=colour, linestyle=dashes, linewidth=1.1, label=name)
    if axes.get_yscale() != "log":  # all of it is within the limits, and nothing at all lies on the axis
        line.set(clip_on=False, zorder=3)


def _band(section: CrossSection) -> tuple[Array, Array]:
    """Plus and minus one standard error; NaN where there is none."""
    error = np.where(np.isfinite(section.values), section.standard_error, np.nan)
    return section.values - error, section.values + error


def _edges(section: CrossSection) -> Array:
    return np.append(section.position - section.pitch / 2, section.position[-1] + section.pitch / 2)


def _check(sections: Sequence[CrossSection], labels: Sequence[str] | None) -> None:
    require(
        sections, (list, tuple), "plot_cross_sections: sections", "a list of them, e.g. [et.cross_section(lmap, y=0)]"
    )
    for one in sections:
        require(one, CrossSection, "plot_cross_sections: a section", "what et.cross_section(lmap, y=0) gives")
    if not sections:
        raise ArgumentError("plot_cross_sections: no section was given; make some with cross_section(map, y=0).")
    kinds = sorted({f"{section.quantity} [{section.unit}] along {section.axis}" for section in sections})
    if len(kinds) > 1:
        raise ArgumentError(f"plot_cross_sections: cannot share axes: {'; '.join(kinds)}. Draw them one by one.")
    if labels is not None:
        require(labels, (tuple, list), "plot_cross_sections: labels", "a list with a name for each section, or None")
        for label in labels:
            require(label, str, "plot_cross_sections: one of the labels", "a name, or None instead of all labels")
    if labels is not None and len(labels) != len(sections):
        raise ArgumentError(
            f"plot_cross_sections: {len(labels)} labels for {len(sections)} sections; give one for each."
        )
