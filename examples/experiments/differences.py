"""Maps beside a reference, their percentage differences (eq. 3.4), and cuts: figures 3.3 to 3.7, 3.10, 3.14 and 3.15."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import etendue as et
import numpy as np
from experiments.panels import FAINT, INK, new_figure, save, scale, show_map
from matplotlib.colors import LogNorm
from matplotlib.ticker import MultipleLocator

GREATEST = 50.0
"""Of the colours of differences [%]."""

Row = tuple[str, et.LuminanceMap, Sequence[et.LuminanceMap]]
"""What is seen, the reference, and the maps of each method."""


def draw_differences(
    path: Path, reference: str, methods: Sequence[str], rows: Sequence[Row], kind: str = "linear", size: float = 1.75
) -> None:
    """One row for each observer: the reference, then each method's map and its difference from the reference."""
    columns = 1 + 2 * len(methods)
    made = new_figure(size * columns + 1.6, size * len(rows) + 0.6)
    grid = made.subplots(len(rows), columns, squeeze=False)
    for panels, (name, truth, maps) in zip(grid, rows, strict=True):
        norm = scale(truth, kind)
        image = show_map(panels[0], truth, norm)
        panels[0].set_ylabel(name, fontsize=9, color=INK)
        for axes, beside, lmap in zip(panels[1::2], panels[2::2], maps, strict=True):
            show_map(axes, lmap, norm)
            difference = et.compare(lmap, truth).difference
            w, h = lmap.screen.width / 2, lmap.screen.height / 2
            off = beside.imshow(
                difference, cmap="viridis", vmin=0.0, vmax=GREATEST, extent=(-w, w, -h, h), interpolation="nearest"
            )
            beside.set_facecolor("#dddddd")
            beside.tick_params(labelsize=7, color=FAINT, labelcolor=FAINT)
        bar = made.colorbar(image, ax=panels[0], fraction=0.05, extend="max", location="right")
        bar.formatter.set_powerlimits((-2, 4))
        bar.ax.yaxis.get_offset_text().set(size=7)
        bar.ax.tick_params(labelsize=7)
        bar.set_label(truth.unit, fontsize=7)
        for axes in panels[1:]:
            axes.set_yticklabels([])
    bar = made.colorbar(off, ax=grid[:, -1], extend="max", fraction=0.05, aspect=15 * len(rows))
    bar.ax.tick_params(labelsize=7)
    bar.set_label("difference, eq. 3.4 [%] (grey: both dark)", fontsize=7)
    titles = [reference, *(title for name in methods for title in (name, "difference"))]
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=9, color=INK)
    for panels in grid[:-1]:
        for axes in panels:
            axes.set_xticklabels([])
    save(made, path)


def draw_cuts(
    path: Path, panels: Mapping[str, Sequence[tuple[str, et.CrossSection, str, str]]], columns: int = 2
) -> None:
    """Cuts through maps: label, cut, format (``"-"`` for the steps of its pixels) and colour, panel by panel."""
    rows = -(-len(panels) // columns)
    made = new_figure(3.6 * columns + 0.6, 2.7 * rows + 0.4)
    thousand = max(np.nanmax(cut.values) for curves in panels.values() for _, cut, _, _ in curves) < 1e6
    unit, name = (1e3, "10³") if thousand else (1e6, "10⁶")
    for axes, (title, curves) in zip(made.subplots(rows, columns, squeeze=False).flat, panels.items(), strict=True):
        for label, cut, how, colour in curves:
            values, edges = cut.values / unit, np.append(cut.position - cut.pitch / 2, cut.position[-1] + cut.pitch / 2)
            if how == "-":
                axes.stairs(values, edges, baseline=None, color=colour, label=label, linewidth=1.2)
            else:
                axes.plot(cut.position, values, how, color=colour, label=label, markersize=3.5, fillstyle="none")
        axes.set_title(title, fontsize=10, color=INK)
        axes.set_xlabel(f"{cut.axis} on the screen [mm]", fontsize=9)
        axes.tick_params(labelsize=8)
        axes.set_ylim(bottom=0.0)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_ylabel(f"luminance [{name} cd/m²]", fontsize=9)
    handles, labels = made.axes[0].get_legend_handles_labels()
    made.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=8)
    save(made, path)


def draw_decades(path: Path, maps: Mapping[str, et.LuminanceMap], decades: float, size: float = 2.7) -> None:
    """Maps in false colour on one logarithmic scale: what the last one's brightest pixels are, and so many decades below."""
    last = list(maps.values())[-1]
    top = float(np.nanquantile(last.values, 0.999))
    norm = LogNorm(top / 10**decades, top)
    made = new_figure(size * len(maps) + 0.9, size + 0.3)
    panels = made.subplots(1, len(maps), squeeze=False)[0]
    for axes, (title, lmap) in zip(panels, maps.items(), strict=True):
        w, h = lmap.screen.width / 2, lmap.screen.height / 2
        values = np.maximum(np.nan_to_num(lmap.values), norm.vmin)
        image = axes.imshow(values, cmap="turbo", norm=norm, extent=(-w, w, -h, h), interpolation="nearest")
        axes.set_title(title, fontsize=9, color=INK)
        axes.tick_params(labelsize=7, color=FAINT, labelcolor=FAINT)
        axes.xaxis.set_major_locator(MultipleLocator(1.0))
        axes.yaxis.set_major_locator(MultipleLocator(1.0))
    for axes in panels[1:]:
        axes.set_yticklabels([])
    panels[0].set_ylabel("mm", fontsize=8)
    bar = made.colorbar(image, ax=panels[-1], fraction=0.05, extend="both")
    bar.ax.tick_params(labelsize=7)
    bar.set_label(last.unit, fontsize=8)
    save(made, path)
