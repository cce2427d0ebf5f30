"""Measures of a scene over one of its numbers, or over two."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence, Sized
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.plot import style
from etendue.quantities.arguments import require
from etendue.quantities.powers_of_ten import common_power, ten_to
from etendue.sweeps.table import SweepTable
from etendue.units import (
    ILLUMINANCE_NAME,
    ILLUMINANCE_UNIT,
    INTENSITY_NAME,
    INTENSITY_UNIT,
    LUMINANCE_NAME,
    LUMINANCE_UNIT,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDTH, LEFT, RIGHT = 6.0, 0.95, 0.25
PANEL, GAP, LEGEND = 2.0, 0.62, 0.19
"""Of the figure, its diagrams and a line of a legend [inches]."""

MOST_PANELS, MOST_LINES = 12, 12
"""Diagrams of a picture, and lines in one of them."""

DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)))
"""After the colours are used up, lines are dashed."""

QUANTITIES: dict[str, str] = {"lm": "flux", "W": "flux"}
for _units, _names in (
    (LUMINANCE_UNIT, LUMINANCE_NAME),
    (ILLUMINANCE_UNIT, ILLUMINANCE_NAME),
    (INTENSITY_UNIT, INTENSITY_NAME),
):
    QUANTITIES |= {_units[flux_unit]: _names[flux_unit] for flux_unit in _units}
"""What several measures in one unit have in common."""

FEW = 40
"""Steps up to which each has a dot."""


class _Panel(NamedTuple):
    """A diagram: the measures in one unit."""

    unit: str
    measures: list[str]


@overload
def plot_sweep(
    table: SweepTable, path: str | os.PathLike[str] | None = None, *, title: str | None = None, ax: None = None
) -> Figure: ...


@overload
def plot_sweep(
    table: SweepTable, path: None = None, *, title: str | None = None, ax: Axes | Sequence[Axes] | npt.NDArray[Any]
) -> tuple[Axes, ...]: ...


def plot_sweep(
    table: SweepTable,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: Axes | Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw a sweep: lines with a band of ± one standard error, a diagram for each unit.

    Of two parameters the first runs along the diagrams, and each value of the second has a line; every measure then has a
    diagram of its own.

    Parameters
    ----------
    table : SweepTable
        Over one parameter or two, with at least one step done.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same table gives the same bytes.
    title : str, optional
        First line; where the sweep comes from if not given.
    ax : matplotlib.axes.Axes or a sequence of them, optional
        Where to draw, one for each diagram, in a figure of your own; there is no caption then.

    Returns
    -------
    matplotlib.figure.Figure or tuple of matplotlib.axes.Axes
        The figure, not registered with pyplot; or the axes of `ax`.

    Raises
    ------
    ArgumentError
        If there are more than two parameters, more than 12 diagrams or lines in one, or nothing was measured; `path` and
        `ax` are both given; or there are more or fewer axes than diagrams.
    UnknownNameError
        If the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> table = SweepTable({"lens.at.2": [5, 6]}, {"maximum": [3, 4]}, {"maximum": [0.1, 0.1]},
    ...                    {"lens.at.2": "mm", "maximum": "cd/m²"}, done=2)
    >>> figure = plot_sweep(table)
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('lens.at.2 [mm]', 'maximum [cd/m²]')
    """
    require(table, SweepTable, "plot_sweep: table", "what et.sweep(scene, parameters, measure) gives")
    panels = _panels(table)
    heading = title if title is not None else style.headed("Sweep", table.provenance.source)
    if ax is not None:
        axes = style.given_axes(ax, len(panels), path)
        for number, (one, panel) in enumerate(zip(axes, panels, strict=True)):
            _draw(one, table, panel, last=number == len(panels) - 1)
            if _lines(table, panel) > 1:
                style.put_legend(one, loc="best")
        style.put_title(axes[0], heading)
        return axes
    facts = style.wrapped(_facts(table), WIDTH - 0.6)
    legends = [_legend_rows(table, panel) for panel in panels]
    if len(table.parameters) > 1:
        # The lines are the same in all diagrams.
        legends[1:] = [0] * (len(legends) - 1)
    below = 0.3 + 0.15 * len(facts) + 0.2
    height = below + len(panels) * PANEL + (len(panels) - 1) * GAP * 0.4 + LEGEND * sum(legends) + 0.75
    figure = style.new_figure(WIDTH, height)
    top = height - 0.62
    for number, (panel, rows) in enumerate(zip(panels, legends, strict=True)):
        top -= LEGEND * rows
        axes_here = style.add_axes(figure, LEFT, top - PANEL, WIDTH - LEFT - RIGHT, PANEL)
        _draw(axes_here, table, panel, last=number == len(panels) - 1)
        if rows:
            columns = _legend_columns(table, panel)
            style.put_legend(axes_here, loc="lower left", bbox_to_anchor=(0.0, 1.02), ncols=columns)
        top -= PANEL + 0.4 * GAP
    style.add_text(figure, 0.3, height - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    for number, line in enumerate(reversed(facts)):
        style.add_text(figure, 0.3, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def require_drawable(parameters: Mapping[str, Sized], measures: int) -> None:
    """Refuse a picture of a sweep that would have no room, before the sweep is made.

    Of one parameter, how many diagrams there will be depends on the units of the measures; that is found when it is drawn.

    Parameters
    ----------
    parameters : mapping of str to values
        As of `sweep`.
    measures : int
        How many there are.

    Raises
    ------
    ArgumentError
        If there are more than two parameters, or of two more than 12 measures or 12 values of the second.

    Examples
    --------
    >>> require_drawable({"lens.at.2": [5, 6], "lamp.flux": [50, 100]}, 2)
    >>> require_drawable({"a": [1], "b": [1], "c": [1]}, 1)
    Traceback (most recent call last):
    etendue.errors.ArgumentError: a picture of a sweep has room for one or two parameters, not for a, b, c; save the table.
    """
    if len(parameters) > 2:
        raise ArgumentError(
            f"a picture of a sweep has room for one or two parameters, not for {', '.join(parameters)}; save the table."
        )
    if len(parameters) == 2:
        _, second = parameters.values()
        _require_few(measures, len(second))


def _require_few(panels: int, lines: int) -> None:
    if panels > MOST_PANELS:
        raise ArgumentError(
            f"{panels} diagrams in a picture of a sweep; draw {MOST_PANELS} at most, and save the rest as a table."
        )
    if lines > MOST_LINES:
        raise ArgumentError(f"{lines} lines in a diagram of a sweep; {MOST_LINES} can be told apart. Save the table.")


def _panels(table: SweepTable) -> list[_Panel]:
    """The diagrams: one for each unit, of two parameters one for each measure."""
    require_drawable(table.parameters, len(table.values))
    if not table.done or not table.values:
        raise ArgumentError("plot_sweep: no step is done; there is nothing to draw.")
    found: list[_Panel] = []
    for name in table.values:
        unit = table.unit(name)
        same = [panel for panel in found if panel.unit == unit and len(table.parameters) == 1]
        if same:
            same[0].measures.append(name)
        else:
            found.append(_Panel(unit, [name]))
    _require_few(len(found), max(_lines(table, panel) for panel in found))
    return found


def _lines(table: SweepTable, panel: _Panel) -> int:
    return len(panel.measures) if len(table.parameters) == 1 else table.shape[1]


def _curves(table: SweepTable, panel: _Panel) -> Iterator[tuple[str, Array, Array]]:
    """Name, values and errors of each line, those of steps to come left out."""
    if len(table.parameters) == 1:
        yield from ((name, table.values[name], table.standard_error[name]) for name in panel.measures)
        return
    (name,) = panel.measures
    (_, (other, held)) = table.parameters.items()
    for i, value in enumerate(held.tolist()):
        unit = f" {table.unit(other)}" if table.unit(other) else ""
        told = f"{other} = {style.plain(value)}{unit}"
        yield told, table.values[name][:, i], table.standard_error[name][:, i]


def _draw(axes: Axes, table: SweepTable, panel: _Panel, *, last: bool) -> None:
    """The lines of a diagram over the first parameter."""
    over, place = next(iter(table.parameters.items()))
    order = np.argsort(place, kind="stable")
    for number, (name, values, errors) in enumerate(_curves(table, panel)):
        colour = style.LINES[number % len(style.LINES)]
        line, error = values[order], np.nan_to_num(errors[order])
        axes.fill_between(place[order], line - error, line + error, color=colour, alpha=0.22, linewidth=0.0)
        axes.plot(
            place[order],
            line,
            color=colour,
            linestyle=DASHES[number // len(style.LINES) % len(DASHES)],
            linewidth=1.2,
            marker="o" if place.size <= FEW else None,
            markersize=3.0,
            label=name,
        )
    style.dress(axes)
    axes.margins(x=0.03, y=0.1)
    _begin_at_zero(axes)
    wide, high = style.inches_of(axes)
    axes.xaxis.set_major_locator(style.locator_for(wide))
    axes.yaxis.set_major_locator(style.locator_for(high))
    axes.grid(visible=True, color=style.RULE, linewidth=0.4)
    axes.set_axisbelow(True)
    what = panel.measures[0] if len(panel.measures) == 1 else QUANTITIES.get(panel.unit, "")
    _name(axes.yaxis, what, panel.unit, *axes.get_ylim())
    _name(axes.xaxis, over, table.unit(over), *axes.get_xlim())
    if not last:
        axes.set_xlabel("")
        axes.set_xticklabels([])


def _begin_at_zero(axes: Axes) -> None:
    """Let an axis begin at 0 unless its values differ by little: then the difference is what is looked at."""
    low, high = axes.get_ylim()
    if 0.0 < low < 0.5 * high or (
        low < 0.0 <= min(np.nanmin(np.asarray(line.get_ydata())) for line in axes.get_lines())
    ):
        axes.set_ylim(bottom=0.0)


def _name(axis: Any, name: str, unit: str, low: float, high: float) -> None:
    """Numbers and label of an axis; of what has no unit without brackets."""
    style.put_numbers(axis, name, unit, low, high)
    if not unit:
        power = common_power(low, high)
        axis.set_label_text(f"{name} / {ten_to(power)}" if power else name)
    elif not name:
        axis.set_label_text(f"[{style.in_powers(unit, common_power(low, high))}]")


def _legend_columns(table: SweepTable, panel: _Panel) -> int:
    longest = max(len(name) for name, _, _ in _curves(table, panel))
    return int(max(1, min(4, (WIDTH - LEFT - RIGHT) * 16.0 // (longest + 6))))


def _legend_rows(table: SweepTable, panel: _Panel) -> int:
    lines = _lines(table, panel)
    return 0 if lines == 1 and len(table.parameters) == 1 else -(-lines // _legend_columns(table, panel))


def _facts(table: SweepTable) -> Iterator[str]:
    """What the picture rests on."""
    yield f"{table.steps:,} steps" if table.complete else f"{table.done:,} of {table.steps:,} steps"
    yield "bands are ± one standard error of each value"
    yield from table.provenance.steps[-1:]
