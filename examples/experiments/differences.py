"""Maps beside a reference, their percentage differences (eq. 3.4), and cuts: figures 3.3 to 3.7, 3.10, 3.14 and 3.15."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot import style
from experiments.panels import ROOT, legend_below, map_grid, new_figure, put_bar_at, save, scale
from matplotlib.colors import LogNorm, Normalize

GREATEST = 50.0
"""Of the colours of differences [%]."""

Row = tuple[str, et.LuminanceMap, Sequence[et.LuminanceMap]]
"""What is seen, the reference, and the maps of each method."""


def draw_differences(
    path: Path,
    heading: str,
    reference: str,
    methods: Sequence[str],
    rows: Sequence[Row],
    kind: str = "linear",
    size: float = 1.75,
) -> None:
    """One row for each observer: the reference, then each method's map and its difference from the reference."""
    titles = [reference, *(title for name in methods for title in (name, "difference"))]
    last = len(titles) - 1
    grid = map_grid(
        (size, size),
        titles,
        [name for name, _, _ in rows],
        {0: "each", last: "all"},
        heading=heading,
        facts=[*([ROOT] if kind == "root" else []), "difference by eq. 3.4; grey where both are dark"],
    )
    for row, (_, truth, maps) in enumerate(rows):
        norm = scale(truth, kind)
        image = grid.show(row, 0, truth, norm)
        put_bar_at(grid.bars[0][row], image, truth.values, truth.quantity, truth.unit)
        for k, lmap in enumerate(maps):
            grid.show(row, 2 * k + 1, lmap, norm)
            difference = et.compare(lmap, truth).difference, truth.screen
            off = grid.show(row, 2 * k + 2, difference, Normalize(0.0, GREATEST), colours="size of difference")
    # Somewhere a difference is larger than the colours reach.
    put_bar_at(grid.bars[last][0], off, np.array([2.0 * GREATEST]), "difference", "%")
    grid.save(path)


def draw_cuts(
    path: Path,
    heading: str,
    panels: Mapping[str, Sequence[tuple[str, et.CrossSection, str, str]]],
    columns: int = 2,
) -> None:
    """Cuts through maps: label, cut, format (``"-"`` for the steps of its pixels) and colour, panel by panel."""
    rows = -(-len(panels) // columns)
    made = new_figure(3.6 * columns + 0.6, 2.7 * rows + 0.7, heading)
    for axes, (title, curves) in zip(made.subplots(rows, columns, squeeze=False).flat, panels.items(), strict=True):
        for label, cut, how, colour in curves:
            edges = np.append(cut.position - cut.pitch / 2, cut.position[-1] + cut.pitch / 2)
            if how == "-":
                axes.stairs(cut.values, edges, baseline=None, color=colour, label=label, linewidth=1.2)
            else:
                axes.plot(cut.position, cut.values, how, color=colour, label=label, markersize=3.5, fillstyle="none")
        style.put_title(axes, title)
        name = style.HORIZONTAL if cut.axis == "x" else style.VERTICAL
        style.put_numbers(axes.xaxis, name, "mm", edges[0], edges[-1])
        axes.set_ylim(bottom=0.0)
        style.put_numbers(axes.yaxis, cut.quantity, cut.unit, *axes.get_ylim())
    legend_below(made, made.axes[0])
    save(made, path)


def draw_decades(
    path: Path, heading: str, maps: Mapping[str, et.LuminanceMap], decades: float, size: float = 2.7
) -> None:
    """Maps in false colour on one logarithmic scale: what the last one's brightest pixels are, and so many decades below."""
    last = list(maps.values())[-1]
    top = float(np.nanquantile(last.values, 0.999))
    grid = map_grid((size, size), list(maps), [""], {len(maps) - 1: "each"}, heading=heading)
    for column, lmap in enumerate(maps.values()):
        image = grid.show(0, column, lmap, LogNorm(top / 10**decades, top))
    put_bar_at(grid.bars[len(maps) - 1][0], image, last.values, last.quantity, last.unit)
    grid.save(path)
