"""Drawings of the algorithm of thesis chapter 3: figures 3.1, 3.2, 3.11 and 3.12, from the program's own bins and cells.

    python examples/chapter_3_drawings.py             # in seconds

docs/formats/patches.md shows them beside the algorithm.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.plot import style
from etendue.quantities.patches import AngularGrid
from experiments.panels import FAINT, INK, LINES, new_figure, save
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

BLUE, RED, *_ = LINES
PALE = "#e8eef3"
TITLES = {"size": style.LABEL_SIZE, "color": INK, "weight": "bold"}

Array = npt.NDArray[np.float64]


def solid(made: Figure, place: Any, size: float, height: tuple[float, float], view: tuple[float, float]) -> Any:
    """Axes in space without frame, of the same scale along x, y and z."""
    axes = made.add_subplot(place, projection="3d")
    axes.set(xlim=(-size, size), ylim=(-size, size), zlim=height)
    axes.set_box_aspect((2 * size, 2 * size, height[1] - height[0]), zoom=1.25)
    axes.view_init(*view)
    axes.set_axis_off()
    return axes


def on_sphere(theta: Array | float, phi: Array | float) -> Array:
    """Unit vectors from angles [rad], shape (..., 3)."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def draw_bins(path: Path) -> None:
    """Figure 3.1: the edges of the angular bins on the hemisphere, and the nodes of the table."""
    made = new_figure(8.4, 4.0, layout=None)
    for place, grid in ((121, AngularGrid(30, 90)), (122, AngularGrid(18, 72))):
        axes = solid(made, place, 1.0, (0.0, 1.0), (32, -52))
        around, up = np.linspace(0, 2 * np.pi, 181), np.linspace(0, np.pi / 2, 61)
        lines = [on_sphere(np.radians(edge), around) for edge in angular.edges(grid)[1:]]
        sides = np.radians((np.arange(grid.shape[1]) + 0.5) * grid.phi_step)
        lines += [on_sphere(up, side) for side in sides]
        # What the hemisphere itself would hide is pale.
        eye = on_sphere(np.radians(90.0 - axes.elev), np.radians(axes.azim))
        pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
        near = pieces.mean(axis=1) @ eye > 0.0
        axes.add_collection3d(Line3DCollection(pieces[~near], colors="#c3ced8", linewidths=1.0))
        axes.add_collection3d(Line3DCollection(pieces[near], colors=BLUE, linewidths=1.1))
        nodes = on_sphere(*(np.radians(v).ravel() for v in np.meshgrid(grid.theta[:-1], grid.phi)))
        axes.scatter(*nodes[nodes @ eye > 0.0].T, color=RED, s=14, depthshade=False)
        axes.set_title(f"Δθ = {grid.theta_step}°, Δφ = {grid.phi_step}°: {grid.bins} bins", **TITLES, y=0.96)
    save(made, path)


STEPS = (
    "1   Rays cross the carrier surface\nand start there",
    "2, 3   Cut the surface into pixels of equal area;\nadd up the flux of each pixel's rays",
    "4a   θ and φ of each ray in the axes of its pixel",
    "4b-4e   Count flux in bins Δθ × Δφ;\nintensity = flux / solid angle (eq. 3.1)",
    "4f, 4g   Flux of the table by the trapezium rule (eq. 3.2);\nits error E (eq. 3.3)",
    "4h   E ≤ threshold, or finest bins?",
    "4i   Keep the pixel's table: a surface source\nwith its intensity distribution",
)


def draw_flow(path: Path) -> None:
    """Figure 3.2: the algorithm as a flowchart; steps 4 run for every lit pixel."""
    made = new_figure(6.4, 6.6, layout=None)
    axes = made.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-1.0, 1.45), ylim=(-0.4, len(STEPS) - 0.6))
    axes.set_axis_off()
    for i, text in enumerate(STEPS):
        y = len(STEPS) - 1 - i
        question = text.startswith("4h")
        box: Any
        if question:
            box = Polygon(
                [(-0.85, y), (0, y + 0.4), (0.85, y), (0, y - 0.4)], facecolor=PALE, edgecolor=RED, linewidth=1.2
            )
        else:
            box = FancyBboxPatch((-0.85, y - 0.27), 1.7, 0.54, boxstyle="round,pad=0,rounding_size=0.06")
            box.set(facecolor="white", edgecolor=BLUE, linewidth=1.2)
        axes.add_patch(box)
        axes.text(0, y, text, ha="center", va="center", fontsize=9, color=INK)
        if i:
            last = 0.4 if STEPS[i - 1].startswith("4h") else 0.27
            arrow = {"arrowstyle": "-|>", "color": FAINT, "linewidth": 1.1}
            axes.annotate("", (0, y + (0.4 if question else 0.27)), (0, y + 1 - last), arrowprops=arrow)
    asked, bins = 1, 3
    axes.plot([0.85, 1.15, 1.15], [asked, asked, bins], color=FAINT, linewidth=1.1)
    axes.annotate("", (0.85, bins), (1.15, bins), arrowprops={"arrowstyle": "-|>", "color": FAINT, "linewidth": 1.1})
    axes.text(
        1.27, 2, "no: next divisors\nof 90° and 360°", fontsize=9, color=INK, ha="center", va="center", rotation=90
    )
    axes.text(0.06, 0.5, "yes", fontsize=9, color=INK, va="center")
    save(made, path)


def outlines(pixels: PixelatedSurface, part: int) -> list[Array]:
    """Corners of all cells of a part."""
    offset, count = int(pixels.offsets[part]), pixels.pixels[part].count
    return list(pixels.cells(np.arange(offset, offset + count)).outline)


def draw_pixelations(path: Path) -> None:
    """Figure 3.11: the flat and the curved part of a dome of radius 2.5 mm."""
    dome = PixelatedSurface.cut(et.Dome(radius=2.5), pixel=0.5, parallels=5)
    made = new_figure(8.4, 4.1, layout=None)
    flat = made.add_subplot(121)
    around = np.linspace(0, 2 * np.pi, 181)
    squares = outlines(dome, 0)
    # Those that the disk touches can have light.
    touched = [cell for cell in squares if np.hypot(*np.abs(cell[:, :2]).min(axis=0)) < 2.5 - 1e-9]
    for cell in touched:
        flat.add_patch(Polygon(cell[:, :2], facecolor=PALE, edgecolor=BLUE, linewidth=0.8))
    flat.plot(2.5 * np.cos(around), 2.5 * np.sin(around), color=RED, linewidth=1.3)
    flat.set(xlim=(-2.8, 2.8), ylim=(-2.8, 2.8), xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    flat.set_title(f"flat part: {len(touched)} squares of 0.5 mm on the disk", **TITLES)
    axes = solid(made, 122, 2.6, (0.0, 2.6), (35, -60))
    cells = outlines(dome, 1)
    axes.add_collection3d(Poly3DCollection(cells, facecolors=PALE, edgecolors=BLUE, linewidths=0.7))
    axes.set_title(f"hemisphere: {len(cells)} cells by N = 5 parallels", **TITLES, y=0.98)
    save(made, path)


def draw_axes(path: Path) -> None:
    """Figure 3.12: local axes of one curved pixel: y = z × zproj, x = y × z."""
    dome = PixelatedSurface.cut(et.Dome(radius=2.5), pixel=0.5, parallels=5)
    curved = dome.pixels[1]
    made = new_figure(5.6, 4.6, layout=None)
    axes = solid(made, 111, 2.6, (0.0, 2.9), (24, -38))
    cells = outlines(dome, 1)
    edges = [np.vstack([cell, cell[:1]]) for cell in cells]
    axes.add_collection3d(Line3DCollection(edges, colors=FAINT, linewidths=0.4))
    # A cell in front, in the third ring below the cap.
    pixel = 25 + 24 - 4
    chosen = curved.cells(np.array([pixel]))
    axes.add_collection3d(Poly3DCollection([chosen.outline[0]], facecolors=RED, alpha=0.45, edgecolors=RED))
    centre, frame = chosen.centre[0], chosen.axes[0]
    for name, direction, color in zip("xyz", frame, (BLUE, BLUE, RED), strict=True):
        axes.quiver(*centre, *(1.3 * direction), color=color, arrow_length_ratio=0.12, linewidth=1.6)
        axes.text(*(centre + 1.62 * direction), name, color=color, fontsize=11, ha="right")
    for (name, direction), at in zip((("X", (1, 0, 0)), ("Y", (0, 1, 0)), ("Z", (0, 0, 1))), itertools.repeat(3.2)):
        axes.quiver(0, 0, 0, *(at * np.array(direction)), color=INK, arrow_length_ratio=0.06, linewidth=0.8)
        axes.text(*(1.06 * at * np.array(direction)), name, color=INK, fontsize=10, ha="center")
    foot = np.array([frame[2, 0], frame[2, 1], 0.0])
    start = np.array([centre[0], centre[1], 0.0])
    axes.quiver(*start, *(1.3 * foot), color=RED, arrow_length_ratio=0.15, linewidth=1.0, linestyle="--")
    axes.text(*(start + 1.75 * foot), "zproj", color=RED, fontsize=9, ha="center")
    save(made, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("chapter-3"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for name, draw in (
        ("figure-3.1.png", draw_bins),
        ("figure-3.2.png", draw_flow),
        ("figure-3.11.png", draw_pixelations),
        ("figure-3.12.png", draw_axes),
    ):
        draw(options.output / name)
        print(f"{options.output / name}")


if __name__ == "__main__":
    main()
