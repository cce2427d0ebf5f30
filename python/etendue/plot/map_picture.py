"""A luminance map in false colour."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args, overload

import numpy as np
import numpy.typing as npt

from etendue.luminance.regions import AnyRegion, check_region
from etendue.plot import style
from etendue.plot.colour_scale import Scale, choose_scale, colour_map, normalisation
from etendue.plot.region_marks import draw_marks, marks_of
from etendue.quantities.arguments import LUMINANCE_OR_ILLUMINANCE, require, require_known, require_number
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Screen
from etendue.quantities.powers_of_ten import common_power

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

Array = npt.NDArray[np.float64]
Show = Literal["value", "relative-error"]
SHOWS: tuple[str, ...] = get_args(Show)

DARK = 1e-3
"""Share of the brightest pixel below which the relative error of a pixel is not shown: it says nothing of the lamp."""

MOST_ERROR = 100.0
"""Relative error [%] at which its colours end at the latest."""


@overload
def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    regions: Sequence[AnyRegion] = (),
    ax: None = None,
) -> Figure: ...


@overload
def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: None = None,
    scale: Scale = "auto",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    regions: Sequence[AnyRegion] = (),
    ax: Axes,
) -> Axes: ...


def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "auto",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    regions: Sequence[AnyRegion] = (),
    ax: Axes | None = None,
) -> Figure | Axes:
    """Draw a map in false colour with its geometry, unit and error.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        The map.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same map gives the same bytes.
    scale : {"auto", "linear", "log"}
        Scale of the colours. ``"auto"``: logarithmic if the median of the lit pixels is less than a thirtieth of the
        maximum, and so next to black on a linear scale; the caption says which, and why.
    vmin, vmax : float, optional
        What the ends of the colour bar mean, in the unit shown. By default 0 (or the lowest value, if that is below 0;
        four decades under the highest on a logarithmic scale, at most down to the lowest that is two standard errors above
        0) and the highest value; of the relative error 100 % at most.
        Values beyond get the colour of the end, and the colour bar an arrow.
    title : str, optional
        First line; the quantity and where it comes from if not given.
    show : {"value", "relative-error"}
        The value, or its standard error in per cent of it.
    regions : sequence of Region or PolygonRegion
        Nine at most; they are outlined and numbered, and the caption has their mean with its error, extremes and uniformity
        (`etendue.region_statistics`).
    cmap : str or matplotlib.colors.Colormap, optional
        The colours, as matplotlib calls them.
    ax : matplotlib.axes.Axes, optional
        Where to draw the picture with its colour bar, in a figure of your own; there is no caption then.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, not registered with pyplot; or `ax`. Pixels without a number (dead; for the error also those with
        less than 0.1 % of the maximum, or with unknown error) are grey, and the caption counts them.

    Raises
    ------
    ArgumentError
        If `vmin` and `vmax` are no range for this scale, the directory of `path` does not exist, `path` and `ax` are
        both given, there are more than nine regions, or one holds no live pixel.
    UnknownNameError
        If `scale`, `show`, `cmap` or the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> from etendue.quantities.observer import Observer
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[3.0, 1.0]], [[0.1, 0.1]], [[900, 300]], Observer(0, 0, 1000), Screen(2, 1, 2, 1),
    ...                     provenance=Provenance(software="example"))
    >>> plot_map(lmap, scale="log").axes[0].get_xlabel()
    'horizontal on the screen [mm]'
    """
    require_known(show, SHOWS, "thing to show")
    require(lmap, (LuminanceMap, IlluminanceMap), "plot_map: lmap", LUMINANCE_OR_ILLUMINANCE)
    for name, end in (("vmin", vmin), ("vmax", vmax)):
        if end is not None:
            require_number(end, f"plot_map: {name}", f"a number in {lmap.unit}")
    require(
        regions, (list, tuple), "plot_map: regions", "a list of regions, e.g. [et.Region(left, right, bottom, top)]"
    )
    for region in regions:
        check_region(region, "plot_map")
    shown = _shown(lmap, show, scale, vmin, vmax)
    marked = marks_of(lmap, regions)
    heading = title if title is not None else style.headed(shown.heading, lmap.provenance.source, 4.0)
    colours = colour_map(shown.colours, cmap)
    across, up = axis_names(lmap)
    if ax is not None:
        style.given_axes(ax, 1, path)
        place = picture_within(ax, lmap.screen)
        image = draw_screen(ax, shown.data, lmap.screen, colours, shown.norm, place, (across, up))
        ax.set_aspect("equal")
        style.put_title(ax, heading)
        draw_marks(ax, marked)
        if shown.something:
            draw_colour_bar(image, shown.data, shown.name, shown.unit, bar_beside(ax, lmap.screen))
        else:
            _write_why_dark(ax, lmap)
        return ax
    layout = MapLayout.around(lmap.screen, [*_facts(lmap, shown, show)], [mark.line for mark in marked])
    figure = style.new_figure(layout.width, layout.height)
    axes = style.add_axes(figure, *layout.picture)
    image = draw_screen(axes, shown.data, lmap.screen, colours, shown.norm, layout.picture[2:], (across, up))
    draw_marks(axes, marked)
    if shown.something:
        draw_colour_bar(image, shown.data, shown.name, shown.unit, style.add_axes(figure, *layout.bar))
    else:
        _write_why_dark(axes, lmap)
    left, top = layout.text_left, layout.height
    style.add_text(figure, left, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    style.add_text(figure, left, top - 0.54, _geometry(lmap), size=style.LABEL_SIZE, color=style.FAINT)
    for number, line in enumerate(reversed(layout.caption)):
        style.add_text(figure, left, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


class _Shown(NamedTuple):
    """What the pixels show: numbers, how they become colours, and the words for them."""

    data: Array
    norm: Normalize
    colours: str  # a key of `style.COLOUR_MAPS`
    name: str  # of the colour bar
    unit: str
    heading: str
    why: str  # the scale was chosen; empty if it was asked for
    something: bool  # there is something to show


def _shown(
    lmap: LuminanceMap | IlluminanceMap, show: str, scale: str, vmin: float | None, vmax: float | None
) -> _Shown:
    if show == "value":
        chosen = choose_scale(lmap.values, scale)
        norm = normalisation(lmap.values, chosen.name, vmin, vmax, lmap.standard_error)
        data, heading = lmap.values, lmap.quantity.capitalize()
        colours, name, unit, why = "value", lmap.quantity, lmap.unit, chosen.why
    else:
        data, heading = _relative_error(lmap), f"Relative error of {lmap.quantity}"
        # Errors of one map seldom differ by powers of ten; that of a single dark pixel shall not set the scale.
        name = "linear" if scale == "auto" else choose_scale(data, scale).name
        largest = float(data[np.isfinite(data)].max(initial=0.0))
        norm = normalisation(data, name, vmin, vmax if vmax is not None or largest <= MOST_ERROR else MOST_ERROR)
        colours, name, unit, why = "error", f"standard error / {lmap.quantity}", "%", ""
    linear = norm.vmin is not None and norm.vmin <= 0.0
    something = bool((np.isfinite(data) & ((data > 0.0) | linear)).any())
    return _Shown(data, norm, colours, name, unit, heading, why, something)


def axis_names(lmap: LuminanceMap | IlluminanceMap) -> tuple[str, str]:
    """What runs across and up in the picture of a map: sides of what an observer sees, or coordinates on a fixed plane."""
    if isinstance(lmap, IlluminanceMap):
        return "right in the plane", "up in the plane"
    if lmap.screen.plane == "xy":
        return ("x", "y") if not any(lmap.observer.target) else ("x from the target", "y from the target")
    return style.HORIZONTAL, style.VERTICAL


def _geometry(lmap: LuminanceMap | IlluminanceMap) -> str:
    if isinstance(lmap, IlluminanceMap):
        centre, normal = (", ".join(f"{x:.4g}" for x in point) for point in (lmap.centre, lmap.normal))
        return f"around ({centre}) mm, facing ({normal})"
    plane = ", on the fixed XY plane" if lmap.screen.plane == "xy" else ""
    return f"seen at {style.describe_observer(lmap.observer)}{plane}"


def _write_why_dark(axes: Axes, lmap: LuminanceMap | IlluminanceMap) -> None:
    message = "no ray reached the screen" if np.isnan(lmap.values).all() else "nothing to show on this scale"
    axes.text(0.5, 0.5, message, transform=axes.transAxes, ha="center", va="center", color="white", size=9)


NARROWEST = 0.5
"""Width of a picture [inches] on which its numbers have room."""

NARROW = 1.6
"""Length of an axis [inches] on which there is no room for more than the first word of its name."""


def draw_screen(
    axes: Axes,
    data: Array,
    screen: Screen,
    colours: Colormap,
    norm: Normalize,
    inches: tuple[float, float],
    names: tuple[str, str],
) -> AxesImage:
    """The pixels in their place [mm], each a rectangle of one colour, on axes of this width and height and these names."""
    # Values at or below 0 have no logarithm; they are dark, not missing.
    clipped = np.where(np.isnan(data), np.nan, np.maximum(data, -np.inf if norm.vmin is None else norm.vmin))
    crisp = inches[0] * style.DPI >= screen.columns and inches[1] * style.DPI >= screen.rows
    image = axes.imshow(
        np.ma.masked_invalid(clipped),
        cmap=colours,
        norm=norm,
        extent=(-screen.width / 2, screen.width / 2, -screen.height / 2, screen.height / 2),
        aspect="auto",
        origin="upper",
        # Fewer printed dots than pixels: average their luminance, so that no bright pixel is left out by chance.
        interpolation="nearest" if crisp else "antialiased",
        interpolation_stage="data",
    )
    style.dress(axes)
    for axis, length, name, size in zip(
        (axes.xaxis, axes.yaxis), inches, names, (screen.width, screen.height), strict=True
    ):
        axis.set_major_locator(style.locator_for(length))
        if axis is axes.xaxis:
            style.keep_apart(axis, length, -size / 2, size / 2)
        elif length < THREE_LINES:  # three numbers are the fewest that are asked for
            axis.set_ticks([0.0])
        style.put_numbers(axis, name if length >= NARROW else name.split()[0], "mm", -size / 2, size / 2)
    return image


THREE_LINES = 0.42
"""Height of three numbers one over the other [inches]."""

LYING = 2.0
"""Width over height of a picture above which its colour bar lies under it."""


def picture_within(axes: Axes, screen: Screen) -> tuple[float, float]:
    """Width and height [inches] of a picture, its sides to scale, in axes that a colour bar takes some room from."""
    aspect, (wide, high) = screen.width / screen.height, style.inches_of(axes)
    # matplotlib gives 0.15 to a bar, and 0.05 or 0.15 to the gap.
    wide, high = (wide, 0.7 * high) if aspect > LYING else (0.8 * wide, high)
    return min(wide, high * aspect), min(high, wide / aspect)


def bar_beside(axes: Axes, screen: Screen) -> Axes:
    """Axes for a colour bar as long as the picture in axes of somebody else, which give it some of their room."""
    from matplotlib.colorbar import make_axes

    (wide, high), picture = style.inches_of(axes), picture_within(axes, screen)
    lying = screen.width / screen.height > LYING
    shrink = picture[0] / wide if lying else picture[1] / high
    bar, _ = make_axes(axes, location="bottom" if lying else "right", shrink=shrink, aspect=25 * shrink)
    return bar


def draw_colour_bar(image: AxesImage, data: Array, name: str, unit: str, axes: Axes) -> None:
    """A bar in `axes`, upright or lying as these are, with arrows where values lie beyond its ends."""
    from matplotlib.colors import LogNorm

    lowest, highest = image.get_clim()
    below, above = bool((data < (lowest or 0.0)).any()), bool((data > (highest or 0.0)).any())
    ends = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    place = axes.get_window_extent()
    upright = place.height > place.width
    bar = style.figure_of(axes).colorbar(
        image,
        cax=axes,
        orientation="vertical" if upright else "horizontal",
        extend=ends[below, above],
        extendfrac=0.03,
    )
    if isinstance(image.norm, LogNorm):
        bar.formatter = bar.minorformatter = style.log_formatter()
        power = 0
    else:
        # Numbers side by side need more room than one above the other.
        bar.locator = style.locator_for((place.height if upright else 0.85 * place.width) / style.figure_of(axes).dpi)
        power = common_power(lowest or 0.0, highest or 0.0)
        bar.formatter = style.number_formatter(power)
    bar.update_ticks()
    bar.set_label(f"{name} [{style.in_powers(unit, power)}]", size=style.LABEL_SIZE, color=style.INK)
    bar.outline.set_linewidth(0.0)
    style.dress(axes)


def draw_slim_bar(image: ScalarMappable, unit: str, beside: Axes) -> None:
    """A narrow bar at the right edge of a diagram that has little room, its unit above it."""
    from matplotlib.colors import LogNorm

    place, figure = beside.get_position(), style.figure_of(beside)
    axes = figure.add_axes((place.x1 + 0.006, place.y0, 0.009, place.height))
    bar = figure.colorbar(image, cax=axes)
    if isinstance(image.norm, LogNorm):
        bar.formatter = bar.minorformatter = style.log_formatter()
        bar.update_ticks()
    bar.outline.set_linewidth(0.0)
    style.dress(axes)
    style.put_title(axes, unit)


def _relative_error(lmap: LuminanceMap | IlluminanceMap) -> Array:
    """Standard error in per cent of the value; NaN where there is no value, or next to none."""
    brightest = float(lmap.values[np.isfinite(lmap.values)].max(initial=0.0))
    positive = (lmap.values > 0.0) & (lmap.values >= DARK * brightest) & np.isfinite(lmap.values)
    result = np.full(lmap.values.shape, np.nan)
    result[positive] = 100.0 * lmap.standard_error[positive] / lmap.values[positive]
    return result


def _facts(lmap: LuminanceMap | IlluminanceMap, shown: _Shown, show: str) -> Iterator[str]:
    """What the picture rests on, fact by fact."""
    lit = (lmap.values > 0.0) & np.isfinite(lmap.values)
    if lit.any():
        rays = lmap.rays[lit & (lmap.rays >= 0)]
        count = style.grouped(f"{np.median(rays):.0f}") if rays.size else ""
        yield f"median {count} rays per lit pixel" if rays.size else "number of rays unknown"
        error = lmap.relative_error
        known = "" if error is None else style.percent(100.0 * error.flux_weighted)
        yield f"standard error {known}, weighted by flux" if known else "standard errors unknown"
    missing = int(np.isnan(shown.data).sum())
    if missing:
        what = (
            "dead pixels" if show == "value" else "pixels without a relative error, or darker than 0.1 % of the maximum"
        )
        yield f"{style.grouped(str(missing))} {what} (grey, {style.percent(100.0 * missing / shown.data.size)})"
    if shown.why:
        yield shown.why
    yield f"{lmap.screen.columns} × {lmap.screen.rows} pixels"
    yield Path(lmap.provenance.source).name


class MapLayout(NamedTuple):
    """Places [inches]: of the figure, and (left, bottom, width, height) of what is in it.

    Examples
    --------
    >>> MapLayout.around(Screen(2, 1, 2, 1), ["one fact"], []).caption
    ['one fact']
    """

    width: float
    height: float
    picture: tuple[float, float, float, float]
    bar: tuple[float, float, float, float]
    text_left: float
    caption: list[str]

    @classmethod
    def around(cls, screen: Screen, facts: list[str], lines_of_regions: list[str]) -> MapLayout:
        """A picture of this screen, its colour bar, and the lines below it."""
        aspect = screen.width / screen.height
        lying = aspect > 2.0
        # Beyond these limits the pixels are drawn out of proportion rather than invisibly thin.
        wide = 7.2 if lying else float(np.clip(4.6 * aspect, NARROWEST, 5.0))
        high = float(np.clip(wide / aspect, 0.3, 5.2))
        left, right, bottom, top = 0.72, 0.2, 0.62, 0.78
        gap, thick, room = 0.14, 0.15, 0.85
        block = wide if lying else wide + gap + thick + room
        width = max(left + block + right, 4.9)
        shift = (width - left - block - right) / 2
        # The text stands over the picture, or at the edge of a figure that is wide for the sake of the text.
        text_left = left + shift if shift < 0.3 else 0.3
        text = width - text_left - right
        lines = [line for whole in lines_of_regions for line in style.wrapped(whole.split(style.SEPARATOR), text)]
        lines += style.wrapped(facts, text)
        below = bottom + 0.15 * len(lines) + (0.72 if lying else 0.0)
        picture = (left + shift, below, wide, high)
        bar = (picture[0], below - 0.72, wide, thick) if lying else (picture[0] + wide + gap, below, thick, high)
        return cls(width, below + high + top, picture, bar, text_left, lines)
