"""The diagnostics of a light field: its characteristic curve, what more rays would bring, where it is least certain."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from etendue.lightfield.characteristic import CharacteristicCurve
from etendue.lightfield.diagnostics import Diagnostics, UncertainSpot
from etendue.lightfield.forecast import Forecast
from etendue.plot import style
from etendue.quantities.arguments import require
from etendue.quantities.measured import measured
from etendue.quantities.powers_of_ten import rounded
from etendue.units import LUMINANCE_NAME, LUMINANCE_UNIT, FluxUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, LEFT, RIGHT = 7.6, 0.85, 0.3
"""Of the figure and its margins [inches]."""

PANEL, GAP, UNDER, ABOVE = 2.35, 0.95, 0.55, 0.8
"""Height of a diagram, and room between two side by side, under each and above the first [inches]."""

ROW = 0.165
"""Height of a line of the table [inches]."""

MOST_SPOTS = 8
"""Lines of the table."""

AHEAD = 64.0
"""How many times the rays the forecast is drawn for."""

BRIGHTEST, LIT = 1e-3, 0.999
"""Shares of the flux: the logarithmic étendue axis begins with the first, the linear one ends with the second."""


@overload
def plot_characteristic(
    diagnostics: Diagnostics, path: str | os.PathLike[str] | None = None, *, title: str | None = None, ax: None = None
) -> Figure: ...


@overload
def plot_characteristic(
    diagnostics: Diagnostics, path: None = None, *, title: str | None = None, ax: Sequence[Axes] | npt.NDArray[Any]
) -> tuple[Axes, ...]: ...


def plot_characteristic(
    diagnostics: Diagnostics,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw what `etendue.diagnose` found of a light field.

    Parameters
    ----------
    diagnostics : Diagnostics
        With or without a forecast.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same diagnostics give the same bytes.
    title : str, optional
        First line; "Light field" if not given.
    ax : sequence of matplotlib.axes.Axes, optional
        The axes to draw on, in a figure of your own: luminance, flux, and the forecast if there is one; there is no
        table and no caption then.

    Returns
    -------
    matplotlib.figure.Figure or tuple of matplotlib.axes.Axes
        The figure, not registered with pyplot; or the axes of `ax`.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist, `path` and `ax` are both given, or there are more or fewer axes.
    UnknownNameError
        If the extension of `path` is none of a picture.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.diagnostics import diagnose
    >>> from etendue.lightfield.light_field import LightField
    >>> from etendue.lightfield.carrier import Disk
    >>> field = LightField.fit(et.RingSource(rays=5_000), Disk(radius=30), depths=(4, 4, 2, 2))
    >>> [axes.get_ylabel() for axes in plot_characteristic(diagnose(field)).axes]
    ['luminance [cd/m²]', 'flux [lm]']
    """
    require(diagnostics, Diagnostics, "plot_characteristic: diagnostics", "what et.diagnose(field) gives")
    forecast = diagnostics.forecast
    heading = title if title is not None else "Light field"
    if ax is not None:
        given = style.given_axes(ax, 2 if forecast is None else 3, path)
        _draw_luminance(given[0], diagnostics.curve, diagnostics.flux_unit)
        _draw_flux(given[1], diagnostics.curve, diagnostics.flux_unit)
        if forecast is not None:
            _draw_forecast(given[2], forecast, diagnostics.expected_error)
        style.put_title(given[0], heading)
        return given
    table = diagnostics.spots[:MOST_SPOTS]
    facts = style.wrapped(_facts(diagnostics), WIDTH - 0.6)
    under_table = 0.3 + 0.15 * len(facts) + 0.12
    under_panels = under_table + (ROW * (len(table) + 1) + 0.3 if table else 0.0) + UNDER
    top = under_panels + (PANEL + UNDER + 0.1 if forecast is not None else 0.0)
    height = top + PANEL + ABOVE
    figure = style.new_figure(WIDTH, height)
    wide = (WIDTH - LEFT - RIGHT - GAP) / 2
    first, second = (style.add_axes(figure, LEFT + n * (wide + GAP), top, wide, PANEL) for n in (0, 1))
    _draw_luminance(first, diagnostics.curve, diagnostics.flux_unit)
    _draw_flux(second, diagnostics.curve, diagnostics.flux_unit)
    if forecast is not None:
        below = style.add_axes(figure, LEFT, under_panels, WIDTH - LEFT - RIGHT, PANEL)
        _draw_forecast(below, forecast, diagnostics.expected_error)
    style.add_text(figure, 0.3, height - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    on = re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.4g}", f"on {diagnostics.surface}")
    style.add_text(figure, 0.3, height - 0.54, on, size=style.LABEL_SIZE, color=style.FAINT)
    if table:
        _write_table(figure, under_table, table, diagnostics.flux_unit)
    for number, line in enumerate(reversed(facts)):
        style.add_text(figure, 0.3, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def _open(axes: Axes) -> None:
    """The house look with two sides and a grid."""
    style.dress(axes)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.grid(visible=True, color=style.RULE, linewidth=0.4)
    axes.set_axisbelow(True)


def _draw_luminance(axes: Axes, curve: CharacteristicCurve, unit: FluxUnit) -> None:
    _open(axes)
    # A step is drawn over its extent, from where the one before ended.
    starts = np.append(0.0, curve.etendue[:-1])
    middles = (starts + curve.etendue) / 2
    low, high = curve.luminance - curve.standard_error, curve.luminance + curve.standard_error
    colour = style.LINES[0]
    axes.fill_between(middles, np.maximum(low, 0.0), high, color=colour, alpha=0.22, linewidth=0.0)
    axes.plot(middles, curve.luminance, color=colour, linewidth=1.2)
    # A bright spot and a dim surround are powers of ten apart.
    left, right = max(curve.etendue_of(BRIGHTEST), middles[0]), curve.total_etendue
    axes.set_xscale("log")
    axes.set_xlim(left, right)
    axes.xaxis.set_major_formatter(style.log_formatter())
    axes.set_xlabel("étendue, brightest first [mm² sr]")
    shown = high[middles >= left]
    axes.set_ylim(0.0, 1.05 * float(shown.max()) or 1.0)
    style.put_numbers(axes.yaxis, LUMINANCE_NAME[unit], LUMINANCE_UNIT[unit], *axes.get_ylim())


def _draw_flux(axes: Axes, curve: CharacteristicCurve, unit: FluxUnit) -> None:
    _open(axes)
    axes.plot(np.append(0.0, curve.etendue), np.append(0.0, curve.flux), color=style.LINES[0], linewidth=1.2)
    axes.set_xlim(0.0, curve.etendue_of(LIT))
    axes.set_ylim(0.0, 1.05 * float(curve.flux[-1]))
    style.put_numbers(axes.xaxis, "étendue, brightest first", "mm² sr", *axes.get_xlim())
    style.put_numbers(axes.yaxis, "flux", unit, *axes.get_ylim())
    half = curve.etendue_of(0.5)
    axes.plot([half], [0.5 * curve.flux[-1]], "o", color=style.LINES[1], markersize=4)
    axes.annotate(
        f"half in {style.plain(float(f'{half:.3g}'))} mm² sr", (half, 0.5 * curve.flux[-1]), (7, -5),
        textcoords="offset points", size=style.TICK_SIZE, color=style.LINES[1], va="top",
    )  # fmt: skip


def _draw_forecast(axes: Axes, forecast: Forecast, expected_error: float) -> None:
    """The error over the number of rays; the error bars as an upper bound where no gain from more is measurable."""
    _open(axes)
    n = np.geomspace(forecast.rays[0], AHEAD * forecast.field_rays, 97)
    if forecast.measurable:
        _draw_law(axes, forecast, n)
    else:
        _draw_bound(axes, forecast.field_rays, 100.0 * expected_error)
    axes.set_xscale("log")
    axes.set_xlim(n[0] / 1.15, n[-1])
    axes.xaxis.set_major_formatter(style.log_formatter())
    axes.set_xlabel("rays")
    axes.set_ylabel("relative error at a ray [%]")
    axes.legend(loc="lower left", frameon=False, fontsize=style.TICK_SIZE, labelcolor=style.INK, handlelength=1.6)


def _draw_bound(axes: Axes, rays: int, percent: float) -> None:
    """The error bars of the field, with an arrow downwards."""
    axes.errorbar(
        [rays], [percent], yerr=[percent / 2], uplims=True, fmt="o", color=style.INK, markersize=4.5, capsize=3,
        label="the error bars of this field, an upper bound: no gain from more rays is measurable",
    )  # fmt: skip
    if percent > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(percent / 10.0, percent * 3.0)
        style.put_log_numbers(axes.yaxis)


def _draw_law(axes: Axes, forecast: Forecast, n: npt.NDArray[np.float64]) -> None:
    value, low, high = (100.0 * np.array(column) for column in zip(*map(forecast.error, n), strict=True))
    colour = style.LINES[0]
    axes.set_yscale("log")
    axes.fill_between(n, low, high, color=colour, alpha=0.22, linewidth=0.0)
    axes.plot(n, value, color=colour, linewidth=1.2, label="error and its 68 % interval")
    now, then = forecast.error(), forecast.factor(0.5)
    axes.plot([forecast.field_rays], [100 * now.value], "o", color=style.INK, markersize=4.5, label="this field")
    # From a rung to the end of the law the loss falls by the gains on the way: those were measured.
    top = forecast.loss(forecast.rays[-1]).value
    losses = top + np.append(np.cumsum(forecast.gains[::-1])[::-1], 0.0)
    measured = 100.0 * np.sqrt(2.0 * np.maximum(losses, 0.0))
    axes.plot(forecast.rays, measured, "s", color=style.LINES[1], markersize=3.5, label="fits to parts of the rays")
    wanted = 50.0 * now.value
    reach = [forecast.field_rays * factor for factor in (then.low, then.high)]
    axes.plot(reach, [wanted, wanted], color=style.LINES[2], linewidth=2.0, solid_capstyle="butt")
    times, least, most = (rounded(factor, 2) for factor in then)
    axes.plot(
        [forecast.field_rays * then.value], [wanted], "D", color=style.LINES[2], markersize=4.5,
        label=f"half the error: {times} times the rays ({least} to {most})",
    )  # fmt: skip
    style.put_log_numbers(axes.yaxis)


def _write_table(figure: Figure, bottom: float, spots: tuple[UncertainSpot, ...], unit: FluxUnit) -> None:
    """Where the field is least certain, the worst first."""
    names = ("x, y, z [mm]", "on the", "θ [°]", "φ [°]", f"{LUMINANCE_NAME[unit]} [{LUMINANCE_UNIT[unit]}]", "share")
    stops = (0.3, 2.35, 3.75, 4.35, 4.95, WIDTH - RIGHT)
    alignment = ("left", "left", "right", "right", "left", "right")
    top = bottom + ROW * (len(spots) + 1)
    heading = (
        "Least certain: boxes of places and directions by their share of the expected loss, each with its worst cell"
    )
    style.add_text(figure, 0.3, top + 0.03, heading, size=style.TICK_SIZE, color=style.INK)
    for number, row in enumerate([names, *map(_row, spots)]):
        y = top - ROW * (number + 1) + 0.02
        for x, text, side in zip(stops, row, alignment, strict=True):
            style.add_text(figure, x, y, text, size=style.CAPTION_SIZE, color=style.FAINT, ha=side)


def _row(spot: UncertainSpot) -> tuple[str, ...]:
    return (
        ", ".join(f"{c:.4g}" for c in spot.point).replace("-", "−"),
        spot.part,
        f"{spot.theta:.1f}",
        f"{spot.phi:.1f}",
        measured(spot.luminance, spot.standard_error, "").rstrip(),
        style.percent(100.0 * spot.share),
    )


def _facts(diagnostics: Diagnostics) -> Iterator[str]:
    """What the picture rests on, fact by fact."""
    report, curve = diagnostics.report, diagnostics.curve
    yield f"flux {style.plain(diagnostics.flux)} {diagnostics.flux_unit}"
    yield f"{style.grouped(str(report.rays - report.unmet_rays))} rays"
    if report.unmet_rays:
        yield f"{style.grouped(str(report.unmet_rays))} more do not meet the surface"
    score, lead = (text.replace("-", "−") for text in (report.score_text, f"{diagnostics.lead:+.4f}"))
    yield f"held-out score {score}"
    yield f"{lead} against the equal-étendue histogram"
    yield f"{style.grouped(f'{report.effective_cells:.0f}')} effective degrees of freedom"
    yield f"error bars predict a relative error of {style.percent(100 * diagnostics.expected_error)} at a ray"
    yield f"99 % of the flux in {style.plain(float(f'{curve.etendue_of(0.99):.3g}'))} mm² sr"
    yield f"recipe {', '.join(dict.fromkeys(report.bases))}"
    yield Path(diagnostics.source).name
