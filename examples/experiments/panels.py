"""What the examples share: pictures in the look of `etendue.plot`, maps beside each other, and tables as text."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from etendue.plot.colour_scale import colour_map
from etendue.plot.map_picture import axis_names, draw_colour_bar, draw_screen
from matplotlib.axes import Axes
from matplotlib.colorbar import make_axes
from matplotlib.colors import LogNorm, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator, ScalarFormatter

INK, FAINT, LINES = style.INK, style.FAINT, style.LINES
DPI = 110
"""Of the pictures on the pages."""

QUICK = (3, 3, 3, 3)
"""Halvings of a light field's grid by place and direction, when seconds count more than sharpness."""

ROOT = "square-root colours"
"""What a caption says of a scale of this kind; others can be read off the colour bar."""

Array = npt.NDArray[np.float64]


def new_figure(
    width: float, height: float, heading: str = "", facts: Sequence[str] = (), layout: str | None = "constrained"
) -> Figure:
    """An empty figure [inches] outside matplotlib's global state, with a heading above and facts below."""
    made = style.new_figure(width, height)
    made.set_dpi(DPI)
    if layout == "constrained":
        made.set_layout_engine(layout, w_pad=0.06, h_pad=0.07)
    if heading:
        made.suptitle(heading, x=0.01, ha="left", size=style.TITLE_SIZE, color=INK, weight="bold")
    if facts:
        lines = "\n".join(style.wrapped(facts, width - 0.3))
        made.supxlabel(lines, x=0.01, ha="left", size=style.CAPTION_SIZE, color=FAINT)
    return made


def save(made: Figure, path: Path) -> None:
    """Write a picture whose bytes are the same in every run, its axes and numbers in the house look."""
    for axes in made.axes:
        if axes.name == "3d":
            continue
        style.dress(axes)
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":
                style.put_log_numbers(axis)
            elif type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(style.number_formatter())
    made.savefig(path, dpi=DPI, bbox_inches="tight", pad_inches=0.1, metadata={"Software": None})


def legend_below(made: Figure, axes: Axes) -> None:
    """One legend for several diagrams, of the lines in this one."""
    handles, labels = axes.get_legend_handles_labels()
    place = {"loc": "outside lower center", "ncols": len(labels), "frameon": False}
    made.legend(handles, labels, **place, fontsize=style.TICK_SIZE, labelcolor=INK, handlelength=1.6)


def put_bar_at(place: Axes, image: Any, data: Array, name: str, unit: str) -> None:
    """A colour bar in axes of its own, with more numbers than a bar as short as these has elsewhere."""
    draw_colour_bar(image, data, name, unit, place)
    if not isinstance(image.norm, LogNorm):
        image.colorbar.locator = MaxNLocator(6 if isinstance(image.norm, PowerNorm) else 4, steps=[1, 2, 2.5, 5, 10])
        image.colorbar.update_ticks()


def put_bar(image: Any, data: Array, name: str, unit: str, beside: Axes | Sequence[Axes]) -> None:
    """A colour bar that takes its room from axes in a figure that lays itself out."""
    bar, _ = make_axes(beside, location="right", fraction=0.04, pad=0.02)
    put_bar_at(bar, image, data, name, unit)


def scale(reference: et.LuminanceMap, kind: str) -> Normalize:
    """Colours from 0 to the reference's brightest pixels, of which a few may be outliers: ``"linear"`` or ``"root"``."""
    top = float(np.nanquantile(reference.values[reference.values > 0.0], 0.99)) * 1.1
    return PowerNorm(0.5, 0.0, top) if kind == "root" else Normalize(0.0, top)


MARGIN, NAMED, GAP, BESIDE, THICK, NUMBERS = 0.62, 0.26, 0.28, 0.1, 0.13, 0.92
"""Left of the pictures, more of it for names of rows, between pictures; before a colour bar, its width, and after it."""
TOP, TITLE, BOTTOM, LINE = 0.42, 0.16, 0.52, 0.15
"""For the heading, a line of a title, the numbers below, and a line of the caption [inches]."""


@dataclasses.dataclass(frozen=True)
class Grid:
    """Places for pictures in rows and columns, with colour bars.

    Parameters
    ----------
    figure : Figure
    panels : array of Axes, shape (rows, columns)
    bars : dict of int to list of Axes
        By the column that they stand beside; one for each row, or a single one.
    inches : tuple of 2 floats
        Width and height of a picture.
    """

    figure: Figure
    panels: npt.NDArray[Any]
    bars: Mapping[int, Sequence[Axes]]
    inches: tuple[float, float]

    def show(
        self,
        row: int,
        column: int,
        what: et.LuminanceMap | tuple[Array, et.Screen],
        norm: Normalize,
        *,
        colours: str = "value",
        own: bool = False,
    ) -> AxesImage:
        """A map in its place [mm], dark where nothing is known of it; numbers at the edges of the grid, or at its own."""
        axes = self.panels[row, column]
        if isinstance(what, et.LuminanceMap):
            data, screen, names = np.nan_to_num(what.values), what.screen, axis_names(what)
        else:
            (data, screen), names = what, (style.HORIZONTAL, style.VERTICAL)
        # The whole name needs two inches.
        names = tuple(name if min(self.inches) > 2.0 else name.split()[0] for name in names)
        axes.set_axis_on()
        image = draw_screen(axes, data, screen, colour_map(colours), norm, self.inches, names)
        if not own and any(one.axison for one in self.panels[row, :column]):
            axes.set_ylabel("")
            axes.tick_params(labelleft=False)
        if not own and row + 1 < len(self.panels):
            axes.set_xlabel("")
            axes.tick_params(labelbottom=False)
        return image

    def save(self, path: Path) -> None:
        """Write the picture; what is drawn is in the house look already."""
        self.figure.savefig(path, dpi=DPI, metadata={"Software": None})


def map_grid(
    inches: tuple[float, float],
    titles: Sequence[str],
    rows: Sequence[str],
    bars: Mapping[int, Literal["each", "all"]],
    *,
    heading: str,
    facts: Sequence[str] = (),
    apart: tuple[float, float] = (GAP, 0.7 * GAP),
    below: float = 0.0,
) -> Grid:
    """A figure with room for pictures of this size, titles over the columns and names beside the rows.

    `bars` are the columns that have a colour bar on their right, for ``"each"`` row or ``"all"`` of them; `apart` is the
    room between columns and between rows, `below` more of it at the foot for other diagrams [inches].
    """
    wide, high = inches
    # A number stays with its sign.
    wrapped = [textwrap.wrap(title.replace(" %", "\u00a0%"), max(8, int(12.5 * wide))) for title in titles]
    top = TOP + TITLE * max(map(len, wrapped)) + 0.12
    left = MARGIN + (NAMED if any(rows) else 0.0)
    room = [BESIDE + THICK + NUMBERS if column in bars else 0.0 for column in range(len(titles))]
    starts = [left + column * (wide + apart[0]) + sum(room[:column]) for column in range(len(titles))]
    width = starts[-1] + wide + room[-1] + 0.12
    lines = style.wrapped(facts, width - 0.3)
    foot = below + BOTTOM + LINE * len(lines) + (0.1 if lines else 0.0)
    floors = [foot + (len(rows) - 1 - row) * (high + apart[1]) for row in range(len(rows))]
    made = new_figure(width, floors[0] + high + top, layout=None)
    panels = np.array([[style.add_axes(made, x, y, wide, high) for x in starts] for y in floors])
    for axes in panels.flat:
        axes.set_axis_off()
    for axes, title in zip(panels[0], wrapped, strict=True):
        axes.set_title("\n".join(title), loc="left", size=style.LABEL_SIZE, color=INK, weight="bold")
    found: dict[int, list[Axes]] = {}
    for column, how in bars.items():
        x, tall = starts[column] + wide + BESIDE, floors[0] - floors[-1] + high
        spans = [(floors[-1], min(tall, 4.0))] if how == "all" else [(y, high) for y in floors]
        found[column] = [style.add_axes(made, x, y, THICK, length) for y, length in spans]
    for y, name in zip(floors, rows, strict=True):
        style.add_text(
            made, 0.2, y + high / 2, name, size=style.LABEL_SIZE, color=INK, weight="bold",
            rotation=90, ha="center", va="center",
        )  # fmt: skip
    style.add_text(made, 0.15, made.get_figheight() - 0.28, heading, size=style.TITLE_SIZE, color=INK, weight="bold")
    for k, line in enumerate(reversed(lines)):
        style.add_text(made, 0.15, below + 0.12 + LINE * k, line, size=style.CAPTION_SIZE, color=FAINT)
    return Grid(made, panels, found, inches)


def draw_maps(
    path: Path,
    heading: str,
    titles: Sequence[str],
    rows: Sequence[tuple[str, Sequence[et.LuminanceMap]]],
    kind: str = "linear",
    size: float = 2.1,
    *,
    facts: Sequence[str] = (),
    together: bool = False,
) -> None:
    """One row of maps for each observer, one column for each method; the last map of a row sets its colours.

    What is brighter than the scale has its brightest colour. Or `together`: the first map of all sets the colours of all.
    """
    last = len(titles) - 1
    screen = rows[0][1][0].screen
    grid = map_grid(
        (size, size * screen.height / screen.width),
        titles,
        [name for name, _ in rows],
        {last: "all" if together else "each"},
        heading=heading,
        facts=[*facts, *([ROOT] if kind == "root" else [])],
    )
    for row, (_, maps) in enumerate(rows):
        norm = scale(rows[0][1][0] if together else maps[-1], kind)
        images = [grid.show(row, column, lmap, norm) for column, lmap in enumerate(maps)]
        if together and row:
            continue
        shown = [lmap for _, some in rows for lmap in some] if together else maps
        data = np.concatenate([lmap.values.ravel() for lmap in shown])
        put_bar_at(grid.bars[last][row], images[-1], data, maps[0].quantity, maps[0].unit)
    grid.save(path)


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table as Markdown."""
    widths = [max(len(head), *(len(row[i]) for row in rows)) for i, head in enumerate(heads)]
    for row in (heads, ["-" * width for width in widths], *rows):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |")


def measures(test: et.LuminanceMap, reference: et.LuminanceMap) -> list[str]:
    """NCC (eq. 3.5; an even map has none), NRMSE as printed (eq. 3.6), and true NRMSE, in percent."""
    c = et.compare(test, reference)
    return ["–" if np.isnan(value) else f"{100 * value:.2f}" for value in (c.ncc, c.nrmse_thesis, c.nrmse)]


def noise(reference: et.LuminanceMap) -> str:
    """What the standard errors of a reference alone add to a true NRMSE, in percent."""
    error = float(np.sqrt((reference.standard_error**2).mean()))
    return f"{100 * error / reference.values.max():.2f}"
