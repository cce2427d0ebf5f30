"""What the examples of the thesis' experiments share: rows of maps in one picture, curves, and tables as text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure

INK, FAINT = "#1b1b1b", "#6b6b76"
LINES = ("#1f5aa6", "#d1622b", "#3c8d5a", "#8a4fa3", "#b8942b")
"""Told apart by the colour-blind too."""


QUICK = (3, 3, 3, 3)
"""Halvings of a light field's grid by place and direction, when seconds count more than sharpness."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] outside matplotlib's global state."""
    made = Figure(figsize=(width, height), dpi=110, layout="constrained")
    FigureCanvasAgg(made)
    return made


def save(made: Figure, path: Path) -> None:
    """Write a picture whose bytes are the same in every run."""
    made.savefig(path, bbox_inches="tight", pad_inches=0.1, metadata={"Software": None})


def scale(reference: et.LuminanceMap, kind: str) -> Normalize:
    """Colours from 0 to the reference's brightest pixels, of which a few may be outliers: ``"linear"`` or ``"root"``."""
    top = float(np.nanquantile(reference.values[reference.values > 0.0], 0.99)) * 1.1
    return PowerNorm(0.5, 0.0, top) if kind == "root" else Normalize(0.0, top)


def show_map(axes: Any, lmap: et.LuminanceMap, norm: Normalize) -> Any:
    """A map in false colour, mm along its sides."""
    w, h = lmap.screen.width / 2, lmap.screen.height / 2
    axes.tick_params(labelsize=7, color=FAINT, labelcolor=FAINT)
    values = np.nan_to_num(lmap.values)
    return axes.imshow(values, cmap="inferno", norm=norm, extent=(-w, w, -h, h), interpolation="nearest")


def draw_maps(
    path: Path,
    titles: Sequence[str],
    rows: Sequence[tuple[str, Sequence[et.LuminanceMap]]],
    kind: str = "linear",
    size: float = 2.1,
) -> None:
    """One row of maps for each observer, one column for each method; the last map of a row sets its colours.

    What is brighter than the scale has its brightest colour.
    """
    made = new_figure(size * len(titles) + 1.2, size * len(rows) + 0.4)
    grid = made.subplots(len(rows), len(titles), squeeze=False)
    for panels, (name, maps) in zip(grid, rows, strict=True):
        norm = scale(maps[-1], kind)
        for axes, lmap in zip(panels, maps, strict=True):
            image = show_map(axes, lmap, norm)
        panels[0].set_ylabel(name, fontsize=9, color=INK)
        bar = made.colorbar(image, ax=panels[-1], fraction=0.05, extend="max")
        bar.formatter.set_powerlimits((-2, 4))
        bar.ax.yaxis.get_offset_text().set(size=7)
        bar.ax.tick_params(labelsize=7)
        bar.set_label(maps[0].unit, fontsize=7)
        for axes in panels[1:]:
            axes.set_yticklabels([])
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=9, color=INK)
    for panels in grid[:-1]:
        for axes in panels:
            axes.set_xticklabels([])
    save(made, path)


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
