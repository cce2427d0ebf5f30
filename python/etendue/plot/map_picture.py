"""A luminance map in false colour."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.plot import style
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Screen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

Array = npt.NDArray[np.float64]
Scale = Literal["linear", "log"]
Show = Literal["value", "relative-error"]
SCALES: tuple[str, ...] = get_args(Scale)
SHOWS: tuple[str, ...] = get_args(Show)

DECADES = 4
"""How far a logarithmic scale reaches down from the brightest pixel unless `vmin` says otherwise."""


@overload
def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "linear",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: None = None,
    scale: Scale = "linear",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    ax: Axes,
) -> Axes: ...


def plot_map(
    lmap: LuminanceMap | IlluminanceMap,
    path: str | os.PathLike[str] | None = None,
    scale: Scale = "linear",
    *,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    show: Show = "value",
    cmap: str | Colormap | None = None,
    ax: Axes | None = None,
) -> Figure | Axes:
    """Draw a map in false colour with its geometry, unit and error.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        The map.
    path : path, optional
        Where to write the picture, .png or .pdf. The same map gives the same bytes.
    scale : {"linear", "log"}
        Scale of the colours.
    vmin, vmax : float, optional
        What the ends of the colour bar mean, in the unit shown. By default 0 (or the lowest value, if that is below 0;
        four decades under the highest on a logarithmic scale, at most down to the lowest) and the highest value.
        Values beyond get the colour of the end, and the colour bar an arrow.
    title : str, optional
        First line; the name of the quantity if not given.
    show : {"value", "relative-error"}
        The value, or its standard error in per cent of it.
    cmap : str or matplotlib.colors.Colormap, optional
        The colours, as matplotlib calls them.
    ax : matplotlib.axes.Axes, optional
        Where to draw the picture with its colour bar, in a figure of your own; there is no caption then.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, not registered with pyplot; or `ax`. Pixels without a number (dead; for the error also black ones
        and those with unknown error) are grey, and the caption counts them.

    Raises
    ------
    ArgumentError
        If `vmin` and `vmax` are no range for this scale, the directory of `path` does not exist, or `path` and `ax` are
        both given.
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
    'x [mm]'
    """
    for kind, name, known in (("colour scale", scale, SCALES), ("thing to show", show, SHOWS)):
        if name not in known:
            raise UnknownNameError(kind, name, known)
    if show == "value":
        data, colours, label = lmap.values, "value", f"{lmap.quantity} [{lmap.unit}]"
    else:
        data, colours, label = _relative_error(lmap), "error", f"standard error / {lmap.quantity} [%]"
    heading = title if title is not None else lmap.quantity.capitalize()
    something = bool((np.isfinite(data) & ((data > 0.0) | (scale == "linear"))).any())
    if ax is not None:
        style.given_axes(ax, 1, path)
        norm = normalisation(data, scale, vmin, vmax)
        place = picture_within(ax, lmap.screen)
        image = draw_screen(ax, data, lmap.screen, colour_map(colours, cmap), norm, place)
        ax.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        style.put_title(ax, heading)
        if something:
            draw_colour_bar(image, data, label, bar_beside(ax, lmap.screen))
        else:
            _write_why_dark(ax, lmap)
        return ax
    layout = _Layout.around(lmap.screen, list(_facts(lmap, data, show)))
    figure = style.new_figure(layout.width, layout.height)
    norm = normalisation(data, scale, vmin, vmax)
    axes = style.add_axes(figure, *layout.picture)
    image = draw_screen(axes, data, lmap.screen, colour_map(colours, cmap), norm, layout.picture[2:])
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
    if something:
        draw_colour_bar(image, data, label, style.add_axes(figure, *layout.bar))
    else:
        _write_why_dark(axes, lmap)
    left, top = layout.text_left, layout.height
    style.add_text(figure, left, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    style.add_text(figure, left, top - 0.54, _geometry(lmap), size=style.LABEL_SIZE, color=style.FAINT)
    for number, line in enumerate(reversed(layout.caption)):
        style.add_text(figure, left, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def _geometry(lmap: LuminanceMap | IlluminanceMap) -> str:
    if isinstance(lmap, IlluminanceMap):
        centre, normal = (", ".join(f"{x:.4g}" for x in point) for point in (lmap.centre, lmap.normal))
        return f"around ({centre}) mm, facing ({normal})"
    plane = ", on the fixed XY plane" if lmap.screen.plane == "xy" else ""
    return f"seen at {style.describe_observer(lmap.observer)}{plane}"


def _write_why_dark(axes: Axes, lmap: LuminanceMap | IlluminanceMap) -> None:
    message = "no ray reached the screen" if np.isnan(lmap.values).all() else "nothing to show on this scale"
    axes.text(0.5, 0.5, message, transform=axes.transAxes, ha="center", va="center", color="white", size=9)


def colour_map(colours: str, wanted: str | Colormap | None = None) -> Colormap:
    """The colours that are wanted, or those of `style.COLOUR_MAPS`, with the colour of missing numbers.

    Raises
    ------
    UnknownNameError
        If matplotlib knows no colours of this name.
    """
    import matplotlib as mpl

    name = style.COLOUR_MAPS[colours] if wanted is None else wanted
    if isinstance(name, str) and name not in mpl.colormaps:
        raise UnknownNameError("colour map", name, mpl.colormaps)
    return mpl.colormaps.get_cmap(name).with_extremes(bad=style.DEAD)


def normalisation(data: Array, scale: str, vmin: float | None, vmax: float | None) -> Normalize:
    """From numbers to colours; the defaults are those of `plot_map`."""
    from matplotlib.colors import LogNorm, Normalize

    finite = data[np.isfinite(data)]
    if scale == "log":
        finite = finite[finite > 0.0]
        high = float(finite.max(initial=0.0)) or 1.0 if vmax is None else vmax
        low = max(float(finite.min(initial=high)), high * 10.0**-DECADES) if vmin is None else vmin
        if vmin is None and low >= high:
            low = high / 10.0
    else:
        low = min(0.0, float(finite.min(initial=0.0))) if vmin is None else vmin
        high = float(finite.max(initial=low)) if vmax is None else vmax
        if vmax is None and high <= low:
            high = low + 1.0
    if not (math.isfinite(low) and math.isfinite(high) and low < high and (scale == "linear" or low > 0.0)):
        above = " above 0" if scale == "log" else ""
        raise ArgumentError(f"plot: the colours would span {low:g} to {high:g}; give finite vmin < vmax{above}.")
    return LogNorm(low, high) if scale == "log" else Normalize(low, high)


def draw_screen(
    axes: Axes, data: Array, screen: Screen, colours: Colormap, norm: Normalize, inches: tuple[float, float]
) -> AxesImage:
    """The pixels in their place [mm], each one a rectangle of one colour, on axes of this width and height."""
    lowest = norm.vmin or 0.0
    # Values at or below 0 have no logarithm; they are dark, not missing.
    clipped = np.where(np.isnan(data), np.nan, np.maximum(data, lowest))
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
    for axis, length in zip((axes.xaxis, axes.yaxis), inches, strict=True):
        axis.set_major_locator(style.locator_for(length))
        axis.set_major_formatter(style.number_formatter())
    return image


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


def draw_colour_bar(image: AxesImage, data: Array, label: str, axes: Axes) -> None:
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
        bar.formatter = bar.minorformatter = style.log_formatter(lowest or 0.0, highest or 0.0)
    else:
        # Numbers side by side need more room than one above the other.
        bar.locator = style.locator_for((place.height if upright else 0.85 * place.width) / style.figure_of(axes).dpi)
        bar.formatter = style.number_formatter()
    bar.update_ticks()
    bar.set_label(label, size=style.LABEL_SIZE, color=style.INK)
    bar.outline.set_linewidth(0.0)
    style.dress(axes)


def _relative_error(lmap: LuminanceMap | IlluminanceMap) -> Array:
    """Standard error in per cent of the value; NaN where there is no value above 0."""
    positive = (lmap.values > 0.0) & np.isfinite(lmap.values)
    result = np.full(lmap.values.shape, np.nan)
    result[positive] = 100.0 * lmap.standard_error[positive] / lmap.values[positive]
    return result


def _facts(lmap: LuminanceMap | IlluminanceMap, data: Array, show: str) -> Iterator[str]:
    """What the picture rests on, fact by fact."""
    lit = (lmap.values > 0.0) & np.isfinite(lmap.values)
    if lit.any():
        rays = lmap.rays[lit & (lmap.rays >= 0)]
        count = style.grouped(f"{np.median(rays):.0f}") if rays.size else ""
        yield f"median {count} rays per lit pixel" if rays.size else "number of rays unknown"
        error = lmap.relative_error
        known = "" if error is None else style.percent(100.0 * error.flux_weighted)
        yield f"standard error {known}, weighted by flux" if known else "standard errors unknown"
    missing = int(np.isnan(data).sum())
    if missing:
        what = "dead pixels" if show == "value" else "pixels without a relative error"
        yield f"{style.grouped(str(missing))} {what} (grey, {style.percent(100.0 * missing / data.size)})"
    yield f"{lmap.screen.columns} × {lmap.screen.rows} pixels"
    yield Path(lmap.provenance.source).name


class _Layout(NamedTuple):
    """Places [inches]: of the figure, and (left, bottom, width, height) of what is in it."""

    width: float
    height: float
    picture: tuple[float, float, float, float]
    bar: tuple[float, float, float, float]
    text_left: float
    caption: list[str]

    @classmethod
    def around(cls, screen: Screen, facts: list[str]) -> _Layout:
        aspect = screen.width / screen.height
        lying = aspect > 2.0
        # Beyond these limits the pixels are drawn out of proportion rather than invisibly thin.
        wide = 7.2 if lying else float(np.clip(4.6 * aspect, 0.3, 5.0))
        high = float(np.clip(wide / aspect, 0.3, 5.2))
        left, right, bottom, top = 0.72, 0.2, 0.62, 0.78
        gap, thick, room = 0.14, 0.15, 0.85
        block = wide if lying else wide + gap + thick + room
        width = max(left + block + right, 4.9)
        shift = (width - left - block - right) / 2
        # The text stands over the picture, or at the edge of a figure that is wide for the sake of the text.
        text_left = left + shift if shift < 0.3 else 0.3
        lines = style.wrapped(facts, width - text_left - right)
        below = bottom + 0.15 * len(lines) + (0.72 if lying else 0.0)
        picture = (left + shift, below, wide, high)
        bar = (picture[0], below - 0.72, wide, thick) if lying else (picture[0] + wide + gap, below, thick, high)
        return cls(width, below + high + top, picture, bar, text_left, lines)
