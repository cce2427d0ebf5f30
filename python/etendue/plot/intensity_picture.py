"""An intensity distribution as the curves of its principal planes, polar or Cartesian."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.plot import style
from etendue.quantities.arguments import INTENSITY, require, require_known
from etendue.quantities.data_sheet import DataSheet, data_sheet
from etendue.quantities.intensity import Intensity
from etendue.quantities.measured import measured, measured_peak

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]
IntensityKind = Literal["polar", "cartesian"]
INTENSITY_KINDS: tuple[IntensityKind, ...] = get_args(IntensityKind)

WIDTH = 5.6
"""Of the figure [inches]."""

STEP = 0.5
"""Degrees between the points of a curve, beside the nodes: a straight line in a table is none in a polar diagram."""

DARK = 1e-3
"""Share of the maximum below which the backward half of the sphere is not worth half of the picture."""

ABOVE = {"polar": 0.92, "cartesian": 0.72}
"""Height of the heading [inches]."""


class _Curve(NamedTuple):
    """The cut of the distribution with a plane through the axis: C on the right, C + 180° on the left."""

    label: str
    gamma: Array  # [°] from -180 (the left half plane) to 180
    values: Array
    error: Array
    edges: tuple[float, ...] = ()  # signed γ at which the beam ends [°]

    def times(self, factor: float) -> _Curve:
        return self._replace(values=self.values * factor, error=self.error * factor)


@overload
def plot_intensity(
    intensity: Intensity,
    path: str | os.PathLike[str] | None = None,
    kind: IntensityKind = "polar",
    *,
    per_klm: bool = False,
    title: str | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_intensity(
    intensity: Intensity,
    path: None = None,
    kind: IntensityKind = "polar",
    *,
    per_klm: bool = False,
    title: str | None = None,
    ax: Axes,
) -> Axes: ...


def plot_intensity(
    intensity: Intensity,
    path: str | os.PathLike[str] | None = None,
    kind: IntensityKind = "polar",
    *,
    per_klm: bool = False,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure | Axes:
    """Draw the curves of C0-C180, of C90-C270 and of the plane of the maximum, with a band of ± one standard error.

    Parameters
    ----------
    intensity : Intensity
        The distribution.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same distribution gives the same bytes.
    kind : {"polar", "cartesian"}
        The diagram of a data sheet, γ = 0° pointing down; or intensity over γ.
    per_klm : bool
        Draw cd/klm: per 1 000 lm of the lamps where their flux is known, else of the luminaire.
    title : str, optional
        First line; "Luminous intensity" or "Radiant intensity" if not given.
    ax : matplotlib.axes.Axes, optional
        Where to draw, in a figure of your own: plain axes, for either kind; there is no caption then.

    Returns
    -------
    matplotlib.figure.Figure or matplotlib.axes.Axes
        The figure, not registered with pyplot; or `ax`. The half γ > 90° is left out if it is dark.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist, `path` and `ax` are both given, `ax` is polar itself, or cd/klm are
        asked of a distribution in W/sr or without flux.
    UnknownNameError
        If `kind` or the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> lambertian = Intensity(c=[0], gamma=range(91), values=[np.cos(np.radians(range(91)))])
    >>> [line.get_label() for line in plot_intensity(lambertian, kind="cartesian").axes[0].lines]
    ['all C']
    """
    require_known(kind, INTENSITY_KINDS, "kind of diagram")
    require(intensity, Intensity, "plot_intensity: intensity", INTENSITY)
    sheet = data_sheet(intensity)
    unit, factor = intensity.unit, 1.0
    if per_klm:
        if not math.isfinite(sheet.per_klm):
            raise ArgumentError(f"{intensity.unit} cannot be drawn as cd/klm: that takes a luminous flux above 0.")
        unit, factor = "cd/klm", sheet.per_klm
    reach = _reach(intensity)
    ends: dict[float, tuple[float, ...]] = {one.plane: () for one in sheet.beam}
    for one in sheet.beam:
        ends[one.plane] += (one.left, one.right) if 0.0 < one.angle < 360.0 else ()
    curves = [
        curve.times(factor)._replace(edges=ends.get(90.0 * number, ()) if number < len(ends) else ())
        for number, curve in enumerate(_curves(intensity, reach))
    ]
    draw, high = (_polar, (4.5 if reach > 90.0 else 2.55)) if kind == "polar" else (_cartesian, 3.0)
    heading = title if title is not None else intensity.quantity.capitalize()
    if ax is not None:
        style.given_axes(ax, 1, path)
        draw(ax, curves, (intensity.quantity, unit), reach)
        style.put_title(ax, heading)
        if kind == "polar":
            style.put_legend(ax, loc="upper center", bbox_to_anchor=(0.5, 0.0))
        else:
            style.put_legend(ax, loc="best")
        return ax
    told = [*_facts(intensity, sheet, per_klm=per_klm)]
    if kind == "polar" and any((curve.values < 0.0).any() for curve in curves):
        told.insert(-1, "values below 0 are drawn as 0")
    facts = style.wrapped(told, WIDTH - 0.6)
    below = 0.3 + 0.15 * len(facts)
    left, bottom = (0.3, below) if kind == "polar" else (0.85, below + 0.42)
    height = bottom + high + ABOVE[kind]
    figure = style.new_figure(WIDTH, height)
    axes = style.add_axes(figure, left, bottom, WIDTH - left - (0.3 if kind == "polar" else 0.25), high)
    draw(axes, curves, (intensity.quantity, unit), reach)
    style.add_text(figure, 0.3, height - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    for number, line in enumerate(reversed(facts)):
        style.add_text(figure, 0.3, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    handles = axes.get_legend_handles_labels()
    figure.legend(
        *handles,
        loc="upper left",
        bbox_to_anchor=(0.3 / WIDTH, (height - 0.4) / height),
        ncols=3,
        frameon=False,
        fontsize=style.TICK_SIZE,
        labelcolor=style.INK,
        handlelength=1.6,
        columnspacing=1.4,
        borderaxespad=0.0,
        borderpad=0.0,
    )
    return style.finish(figure, path)


def _reach(intensity: Intensity) -> float:
    """The largest γ that is drawn [°]."""
    behind = intensity.values[:, intensity.gamma > 90.0]
    return 180.0 if behind.max(initial=0.0) > DARK * intensity.maximum else 90.0


def _curves(intensity: Intensity, reach: float) -> Iterator[_Curve]:
    """The principal planes, and that of the maximum if it is another."""
    if intensity.symmetry() == "rotational":
        yield _curve(intensity, 0.0, reach, "all C")
        return
    for c in (0.0, 90.0):
        yield _curve(intensity, c, reach, f"C{c:g} – C{c + 180:g}")
    c, row = _peak(intensity)
    if intensity.gamma[row] not in (0.0, 180.0) and intensity.c[c] % 90.0 != 0.0:
        plane = float(intensity.c[c]) % 180.0
        # The largest of all nodes may be so by noise, and lie in another plane.
        kind = "maximum" if intensity.peak[0] % 180.0 == plane else "largest that is sure"
        yield _curve(intensity, plane, reach, f"C{plane:g} – C{plane + 180:g} ({kind})")


def _peak(intensity: Intensity) -> tuple[int, int]:
    """Plane and row of the largest intensity that is sure: small cells about the poles are bright by noise."""
    sure = intensity.values - 2.0 * np.nan_to_num(intensity.standard_error)
    plane, row = np.unravel_index(int(sure.argmax()), sure.shape)
    return int(plane), int(row)


def _curve(intensity: Intensity, c: float, reach: float, label: str) -> _Curve:
    gamma = np.union1d(np.arange(0.0, reach + STEP / 2, STEP), intensity.gamma)
    gamma = gamma[gamma <= reach]
    # Beside the end of the table the function is 0; the drop shall be seen as one.
    end = intensity.gamma[-1]
    gamma = np.sort(np.append(gamma, end + 1e-6)) if end < reach else gamma
    # Between the nodes the error of the mean of two is at most the mean of their errors.
    uncertain = intensity.replace(values=np.nan_to_num(intensity.standard_error))
    values, errors = (
        np.concatenate([function.at(c + 180.0, gamma[::-1]), function.at(c, gamma)])
        for function in (intensity, uncertain)
    )
    return _Curve(label, np.concatenate([-gamma[::-1], gamma]), values, errors)


def _polar(axes: Axes, curves: list[_Curve], names: tuple[str, str], reach: float) -> None:
    """Circles of equal intensity, spokes of equal γ, and the curves, on plain axes of equal scale."""
    top = max(float((curve.values + curve.error).max()) for curve in curves)
    circles = _circles(top)
    rim = circles[-1]
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(-1.16 * rim, 1.16 * rim)
    axes.set_ylim(-1.12 * rim, 1.12 * rim if reach > 90.0 else 0.12 * rim)
    arc = np.radians(np.linspace(-reach, reach, 361))
    wide, high = style.inches_of(axes)
    every = _labelled(circles, names[1], min(wide / 2.32, high / (2.24 if reach > 90.0 else 1.24)))
    for number, radius in enumerate(circles[::-1]):
        axes.plot(
            radius * np.sin(arc),
            -radius * np.cos(arc),
            color=style.RULE,
            linewidth=0.8 if radius == rim else 0.4,
            zorder=1,
        )
        if number % every:
            continue
        label = style.plain(radius) + (f" {names[1]}" if radius == rim else "")
        axes.text(
            radius, 0.015 * rim, label, size=style.TICK_SIZE - 0.5, color=style.FAINT, ha="center", va="bottom", zorder=4,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
        )  # fmt: skip
    for degrees in np.arange(-reach, reach + 1, 15.0):
        x, y = np.sin(np.radians(degrees)), -np.cos(np.radians(degrees))
        axes.plot([0, rim * x], [0, rim * y], color=style.RULE, linewidth=0.4 if degrees % 30 == 0 else 0.2, zorder=1)
        if degrees % 30 == 0 and abs(degrees) < 180 and abs(degrees) != 90:
            axes.text(
                1.06 * rim * x, 1.06 * rim * y, f"{abs(degrees):g}°",
                size=style.TICK_SIZE, color=style.FAINT, ha="center", va="center",
            )  # fmt: skip
    if reach > 90.0:
        axes.text(0, 1.06 * rim, "180°", size=style.TICK_SIZE, color=style.FAINT, ha="center", va="center")
    for side in (-1, 1):
        axes.text(
            side * 1.02 * rim, -0.035 * rim, "90°", size=style.TICK_SIZE, color=style.FAINT, va="top",
            ha="left" if side > 0 else "right",
        )  # fmt: skip
    for number, curve in enumerate(curves):
        angle, colour = np.radians(curve.gamma), style.LINES[number]
        inner, outer = (np.maximum(curve.values + sign * curve.error, 0.0) for sign in (-1.0, 1.0))
        edge, back = np.concatenate([outer, inner[::-1]]), np.concatenate([angle, angle[::-1]])
        axes.fill(edge * np.sin(back), -edge * np.cos(back), color=colour, alpha=0.22, linewidth=0.0, zorder=2)
        # A radius below 0 would be light in the opposite direction.
        radius = np.maximum(curve.values, 0.0)
        axes.plot(
            radius * np.sin(angle), -radius * np.cos(angle),
            color=colour, linewidth=1.2, label=curve.label, zorder=3,
        )  # fmt: skip
        for edge in np.radians([one for one in curve.edges if abs(one) <= reach]):
            axes.plot(
                [0, rim * np.sin(edge)], [0, -rim * np.cos(edge)],
                color=colour, linewidth=0.7, linestyle=(0, (1, 2)), zorder=2,
            )  # fmt: skip
    _name_sides(axes, curves, rim)


def _name_sides(axes: Axes, curves: list[_Curve], rim: float) -> None:
    """The half planes, where the readers of data sheets look for them; in small diagrams beside the numbers at the rim."""
    sides = [curve.label.split(" (")[0].split(" – ") for curve in curves if " – " in curve.label]
    if not sides:
        return
    wide, high = style.inches_of(axes)
    inches = min(wide / float(np.ptp(axes.get_xlim())), high / float(np.ptp(axes.get_ylim()))) * rim
    # The number at 0° is beside them, and in small diagrams also that at 30°.
    inner = style.width_of("30°") / 2 + style.LETTER
    if inches * (1.1 - 1.06 * math.cos(math.radians(30.0))) < 1.6 * style.TICK_SIZE / 72.0:
        inner += 1.06 * math.sin(math.radians(30.0)) * inches
    for side, which in ((-1, 1), (1, 0)):
        text = ", ".join(side_names[which] for side_names in sides)
        fits = inner + style.width_of(text) <= 1.14 * inches
        place, outward = (1.14 * rim, False) if fits else (inner / inches * rim, True)
        axes.text(
            side * place, -1.1 * rim, text, size=style.TICK_SIZE, color=style.FAINT, va="bottom",
            ha="left" if (side < 0) != outward else "right",
        )  # fmt: skip


def _labelled(circles: Array, unit: str, inches: float) -> int:
    """Every how many circles, from the outermost, which has the unit, there is room for a number; of this radius [inches].

    >>> _labelled(np.array([1.0, 2.0, 3.0, 4.0]), "cd", 1.8), _labelled(np.array([1e4, 2e4, 3e4, 4e4]), "cd", 0.9)
    (1, 3)
    """
    widths = [style.width_of(style.plain(radius)) for radius in circles[::-1]]
    widths[0] += style.width_of(f" {unit}")
    places = inches * circles[::-1] / circles[-1]
    for every in range(1, circles.size):
        shown = list(zip(places, widths, strict=True))[::every]
        # The first of a pair is the outer one.
        if all(a - b > (w + v) / 2 + style.LETTER for (a, w), (b, v) in itertools.pairwise(shown)):
            return every
    return int(circles.size)


def _circles(top: float) -> Array:
    """Round radii, the last of which holds everything."""
    from matplotlib.ticker import MaxNLocator

    top = top if top > 0.0 else 1.0
    ticks = np.asarray(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, top))
    circles: Array = ticks[(ticks > 0.0) & (ticks < top + (ticks[1] - ticks[0]))]
    return circles


def _cartesian(axes: Axes, curves: list[_Curve], names: tuple[str, str], reach: float) -> None:
    style.dress(axes)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.grid(visible=True, axis="y", color=style.RULE, linewidth=0.4)
    axes.set_axisbelow(True)
    axes.set_xlim(-reach, reach)
    axes.set_xticks(np.arange(-reach, reach + 1, reach / 6.0))
    low = min(0.0, *(float(curve.values.min()) for curve in curves))
    top = max(float((curve.values + curve.error).max()) for curve in curves)
    axes.set_ylim(low, top + 0.05 * (top - low) if top > low else low + 1.0)
    for number, curve in enumerate(curves):
        colour = style.LINES[number]
        low_edge, high_edge = curve.values - curve.error, curve.values + curve.error
        axes.fill_between(curve.gamma, low_edge, high_edge, color=colour, alpha=0.22, linewidth=0.0)
        axes.plot(curve.gamma, curve.values, color=colour, linewidth=1.2, label=curve.label)
    axes.set_xlabel("γ [°], to the left in the plane C + 180°")
    style.put_numbers(axes.yaxis, *names, *axes.get_ylim())


def _facts(intensity: Intensity, sheet: DataSheet, *, per_klm: bool) -> Iterator[str]:
    """What the picture rests on, fact by fact."""
    unit = intensity.flux_unit
    flux = measured(intensity.flux, intensity.flux_error, unit)
    yield f"{'luminous' if unit == 'lm' else 'radiant'} flux {flux}"
    c, gamma = intensity.peak
    where = f"γ = {gamma:g}°"
    if intensity.c.size > 1 and gamma not in (0.0, 180.0):
        where = f"C = {c:g}°, {where}"
    yield f"peak {measured_peak(intensity)} at {where}"
    known = np.isfinite(intensity.standard_error) & (intensity.values > 0.0)
    if known.any():
        share = 100.0 * float(np.median(intensity.standard_error[known] / intensity.values[known]))
        yield f"median standard error {style.percent(share)}"
    yield from sheet.lines()[:2]
    if per_klm:
        yield f"per 1\u202f000 lm of the {sheet.reference}"
    planes = "one plane" if intensity.c.size == 1 else f"{intensity.c.size} planes"
    yield f"{planes} × {intensity.gamma.size} angles"
    yield Path(intensity.provenance.source).name
