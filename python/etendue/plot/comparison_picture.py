"""Two maps beside their difference, with the figures of their agreement."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.luminance.comparison import Comparison
from etendue.plot import style
from etendue.plot.colour_scale import Scale, choose_scale, colour_map, normalisation, signed_normalisation
from etendue.plot.map_picture import NARROWEST, axis_names, bar_beside, draw_colour_bar, draw_screen, picture_within
from etendue.plot.region_marks import draw_outline
from etendue.quantities.arguments import require, require_known
from etendue.quantities.observer import Screen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

Array = npt.NDArray[np.float64]
Difference = Literal["maximum", "sigma", "thesis"]
DIFFERENCES: tuple[Difference, ...] = get_args(Difference)

NARROWEST_COLUMN = 2.1
"""Room for the lines of text under three narrow maps [inches]."""

GREATEST_DIFFERENCE = 200.0
"""What eq. 3.4 gives where one map is black [%]."""


@overload
def plot_comparison(
    comparison: Comparison,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    difference: Difference = "maximum",
    labels: tuple[str, str] = ("test", "reference"),
    title: str | None = None,
    cmap: str | Colormap | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_comparison(
    comparison: Comparison,
    path: None = None,
    scale: Scale = "auto",
    *,
    difference: Difference = "maximum",
    labels: tuple[str, str] = ("test", "reference"),
    title: str | None = None,
    cmap: str | Colormap | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any],
) -> tuple[Axes, ...]: ...


def plot_comparison(
    comparison: Comparison,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    difference: Difference = "maximum",
    labels: tuple[str, str] = ("test", "reference"),
    title: str | None = None,
    cmap: str | Colormap | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw both maps with the same colours, their signed difference, and the measures of agreement (cf. fig. 3.3).

    Parameters
    ----------
    comparison : Comparison
        What `etendue.compare` gave.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    scale : {"auto", "linear", "log"}
        Scale of the luminance colours; ``"auto"`` is that of `plot_map`. Those of the difference are linear, alike on both
        sides of 0, and end at the 99th percentile of its size.
    difference : {"maximum", "sigma", "thesis"}
        Test less reference, in per cent of the reference's maximum or in standard errors of that difference; or the size of
        the difference in per cent of the mean of both (eq. 3.4), as the thesis has it.
    labels : pair of str
        Names of the two maps.
    title : str, optional
        First line; the names of both files if not given.
    cmap : str or matplotlib.colors.Colormap, optional
        The colours of the luminance, as matplotlib calls them.
    ax : sequence of matplotlib.axes.Axes, optional
        The three axes to draw on, in a figure of your own: the maps and their difference, each with its colour bar; there
        are no figures of agreement and no `title` then.

    Returns
    -------
    matplotlib.figure.Figure or tuple of matplotlib.axes.Axes
        The figure, not registered with pyplot; or the axes of `ax`. The region compared is outlined, the difference is
        grey outside it, and where both maps are dead; the lines below say how many pixels are.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist, `path` and `ax` are both given, or there are not three axes.
    UnknownNameError
        If `scale`, `difference`, `cmap` or the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> from etendue.luminance.comparison import compare
    >>> from etendue.quantities.luminance_map import LuminanceMap
    >>> from etendue.quantities.observer import Observer
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[3.0, 1.0]], [[0.1, 0.1]], [[900, 300]], Observer(0, 0, 1000), Screen(2, 1, 2, 1),
    ...                     provenance=Provenance(software="example"))
    >>> [axes.get_title(loc="left") for axes in plot_comparison(compare(lmap, lmap)).axes[:3]]
    ['test', 'reference', 'test − reference']
    """
    require(comparison, Comparison, "plot_comparison: comparison", "what et.compare(test, reference) gives")
    require_known(difference, DIFFERENCES, "difference")
    reference = comparison.reference
    chosen = choose_scale(np.stack((comparison.test.values, reference.values)), scale)
    require(labels, (tuple, list), "plot_comparison: labels", "two names, as ('test', 'reference')")
    for one in labels:
        require(one, str, "plot_comparison: one of the labels", "a name for each map")
    if len(labels) != 2:
        raise ArgumentError(f"plot_comparison: {len(labels)} labels for two maps; give one for each.")
    shown = _shown(comparison, difference, labels)
    names = axis_names(reference)
    if ax is not None:
        given = style.given_axes(ax, 3, path)
        for axes, name, (image, data, label) in zip(
            given,
            (*labels, shown.title),
            _draw_panels(
                given, comparison, chosen.name, shown, cmap, picture_within(given[0], reference.screen), names
            ),
            strict=True,
        ):
            axes.set_aspect("equal")
            style.put_title(axes, name)
            draw_colour_bar(image, data, *label, bar_beside(axes, reference.screen))
        return given
    lines = [*_figures(comparison, labels, chosen.why), *_grey(comparison, shown.data)]
    layout = _Layout.around(reference.screen, len(lines))
    figure = style.new_figure(layout.width, layout.height)
    panels = [style.add_axes(figure, *place) for place in layout.panels]
    drawn = _draw_panels(panels, comparison, chosen.name, shown, cmap, layout.panels[0][2:], names)
    # Both maps have the same colours: one bar for them.
    for (image, data, label), place in zip(drawn[1:], layout.bars, strict=True):
        draw_colour_bar(image, data, *label, style.add_axes(figure, *place))
    for axes, name in zip(panels, (*labels, shown.title), strict=True):
        short = style.shortened(name, int(11.0 * layout.pitch))
        axes.set_title(short, loc="left", size=style.LABEL_SIZE, color=style.INK, pad=4)
    for axes in panels[1:]:
        axes.set_yticklabels([])
        axes.set_ylabel("")
    heading = title if title is not None else _heading(comparison)
    left, top = layout.panels[0][0], layout.height
    style.add_text(figure, left, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    observers = [style.describe_observer(lmap.observer) for lmap in (comparison.test, reference)]
    seen = f"seen at {observers[1]}"
    if observers[0] != observers[1]:
        seen = f"first seen at {observers[0]}; second at {observers[1]}"
    style.add_text(figure, left, top - 0.54, seen, size=style.LABEL_SIZE, color=style.FAINT)
    for number, line in enumerate(reversed(lines)):
        style.add_text(figure, left, 0.14 + 0.16 * number, line, size=style.TICK_SIZE, color=style.FAINT)
    return style.finish(figure, path)


class _Shown(NamedTuple):
    """How the third panel shows where the maps differ."""

    data: Array
    norm: Normalize
    colours: str  # a key of `style.COLOUR_MAPS`
    title: str
    label: tuple[str, str]  # of the colour bar, with its unit


def _shown(comparison: Comparison, difference: str, labels: tuple[str, str]) -> _Shown:
    # A pixel that is dead in both maps counts as 0 in both, or not at all: nobody knows of a difference.
    unknown = _dead(comparison).all(axis=0)
    if difference == "thesis":
        data = np.where(unknown, np.nan, comparison.difference)
        defined = data[~np.isnan(data)]
        end = float(np.percentile(defined, 99)) if defined.size else 0.0
        norm = normalisation(data, "linear", 0.0, end if end > 0.0 else GREATEST_DIFFERENCE)
        return _Shown(data, norm, "size of difference", "size of the difference", ("difference (eq. 3.4)", "%"))
    plain = labels == ("test", "reference")
    title = "test − reference" if plain else "first − second"
    if difference == "sigma":
        data = np.where(unknown, np.nan, comparison.difference_in_sigma)
        return _Shown(data, signed_normalisation(data, 1.0), "difference", title, ("difference", "standard errors"))
    data = np.where(unknown, np.nan, comparison.signed_difference)
    return _Shown(data, signed_normalisation(data, 1.0), "difference", title, ("difference", "% of max"))


def _dead(comparison: Comparison) -> npt.NDArray[np.bool_]:
    """Where the maps are dead, shape (2, rows, columns)."""
    return np.isnan(np.stack((comparison.test.values, comparison.reference.values)))


def _grey(comparison: Comparison, data: Array) -> list[str]:
    """What is grey in the third panel, and what of the dead pixels is not, as lines of the caption."""
    dead, shown = _dead(comparison), ~np.isnan(data)
    region = comparison.region
    inside = np.ones(data.shape, np.bool_) if region is None else region.mask(comparison.reference.screen)
    left = inside & ~shown
    reasons = (
        (inside & dead.all(axis=0), "dead in both maps"),
        (left & (dead.sum(axis=0) == 1), "dead in one of them"),
        (left & ~dead.any(axis=0), "without a difference that is known"),
        (~inside, "outside the region"),
    )
    found = [f"{style.grouped(str(int(which.sum())))} pixels {words}" for which, words in reasons if which.any()]
    facts = [f"grey: {found[0]}", *found[1:]] if found else []
    as_black = int((shown & (dead.sum(axis=0) == 1)).sum())
    counted = f"{style.grouped(str(as_black))} pixels are dead in one of the maps and count as 0 there"
    return style.wrapped([*facts, *([counted] if as_black else [])], 3 * NARROWEST_COLUMN)


def _heading(comparison: Comparison) -> str:
    one, other = (Path(lmap.provenance.source).name for lmap in (comparison.test, comparison.reference))
    what = f"{comparison.reference.quantity.capitalize()} compared"
    both = f"{style.shortened(one, 33)} against {style.shortened(other, 33)}"
    return style.headed(what, one, 6.0) if one == other else both


def _draw_panels(
    panels: Sequence[Axes],
    comparison: Comparison,
    scale: str,
    shown: _Shown,
    cmap: str | Colormap | None,
    inches: tuple[float, float],
    names: tuple[str, str],
) -> list[tuple[AxesImage, Array, tuple[str, str]]]:
    """Both maps and their difference: the pictures, with what their colour bars say."""
    test, reference = comparison.test, comparison.reference
    both = np.stack((test.values, reference.values))
    norm = normalisation(both, scale, None, None, np.stack((test.standard_error, reference.standard_error)))
    luminance = (reference.quantity, reference.unit)
    colours = colour_map("value", cmap)
    of_difference = colour_map(shown.colours)
    drawn = [
        (draw_screen(panels[0], test.values, test.screen, colours, norm, inches, names), both, luminance),
        (draw_screen(panels[1], reference.values, reference.screen, colours, norm, inches, names), both, luminance),
        (
            draw_screen(panels[2], shown.data, reference.screen, of_difference, shown.norm, inches, names),
            shown.data,
            shown.label,
        ),
    ]
    for axes in panels:
        _outline(axes, comparison)
    return drawn


def _outline(axes: Axes, comparison: Comparison) -> None:
    """The region compared."""
    if comparison.region is not None:
        draw_outline(axes, np.array(comparison.region.corners))


def _figures(comparison: Comparison, labels: tuple[str, str], why: str) -> list[str]:
    """The lines below the pictures: agreement, each map, and why the colours are what they are."""
    maps = zip(labels, (comparison.test_statistics, comparison.reference_statistics), strict=True)
    unit = comparison.reference.unit
    agreement = (
        f"NCC {_per_cent(comparison.ncc)}",
        f"NRMSE {_per_cent(comparison.nrmse)} of the reference's max",
        f"eq. 3.6 {_per_cent(comparison.nrmse_thesis)}",
        f"χ²/N {style.plain(comparison.reduced_chi_square)}",
        f"intensity ratio {style.plain(comparison.intensity_ratio)}",
    )
    lines = [style.SEPARATOR.join(agreement)]
    for name, figures in maps:
        facts = (
            f"{name}: mean {style.plain(figures.mean)} {unit}",
            f"max {style.plain(figures.maximum)}",
            f"uniformity {style.plain(figures.uniformity)}",
            f"{style.grouped(str(figures.dead_pixels))} dead pixels",
        )
        lines.append(style.SEPARATOR.join(facts))
    return [*lines, why] if why else lines


def _per_cent(fraction: float) -> str:
    return "undefined" if math.isnan(fraction) else f"{style.plain(100.0 * fraction)} %"


class _Layout(NamedTuple):
    """Places [inches]: of the figure, and (left, bottom, width, height) of the three panels and two colour bars."""

    width: float
    height: float
    panels: list[tuple[float, float, float, float]]
    bars: list[tuple[float, float, float, float]]
    pitch: float

    @classmethod
    def around(cls, screen: Screen, lines: int) -> _Layout:
        """Three maps of this screen above so many lines of text."""
        aspect = screen.width / screen.height
        # Beyond these limits the pixels are drawn out of proportion rather than invisibly thin.
        wide = float(np.clip(4.2 * aspect, NARROWEST, 3.1))
        high = float(np.clip(wide / aspect, 0.3, 4.2))
        # Numbers at the ends of neighbouring axes need the gap.
        left, gap, bottom, top, bar = 0.7, 0.34, 1.34 + 0.16 * lines, 0.98, 0.72
        pitch = max(wide + gap, NARROWEST_COLUMN)
        panels = [(left + column * pitch, bottom, wide, high) for column in range(3)]
        under = bottom - bar
        bars = [(left, under, 2 * pitch - gap, 0.13), (panels[2][0], under, pitch - gap, 0.13)]
        return cls(left + 3 * pitch + 0.1, bottom + high + top, panels, bars, pitch)
