"""Chapter 2 of the thesis, what surrounds its experiment: the set-up, the map without noise, and maps without uniform zones.

    python examples/chapter_2_details.py              # in seconds

Draws figures 2.1, 2.5 and 2.7, prints how wide the transitions of the map without noise are at several resolutions, and
which filter does best where no part of the map is uniform. docs/chapter-2.md discusses the output.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from experiments.panels import FAINT, INK, LINES, new_figure, save

OBSERVER = et.Observer(theta=0, phi=0, distance=150)
SIZE = 70.0  # of the screen [mm]
RESOLUTIONS = (32, 128, 512)
FILTERS = ("average", "weighted", "selective", "selective-weighted")
GAMMAS = (0.1, 0.2, 0.4)
GRAIN, TRUTH, *_ = LINES

Array = npt.NDArray[np.float64]


def measure(
    axes: Any, start: tuple[float, float], end: tuple[float, float], text: str, aside: tuple[float, float]
) -> None:
    """A double arrow with its length."""
    axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "color": FAINT, "linewidth": 0.9})
    middle = (np.array(start) + np.array(end)) / 2 + np.array(aside)
    axes.text(*middle, text, color=INK, fontsize=9, ha="center", va="center")


def draw_set_up(path: Path) -> None:
    """Figures 2.1 and 2.5, seen from the side: observer, screen, ray collecting surface and lamp, with the measures."""
    made = new_figure(8.4, 3.9)
    left, right = made.subplots(1, 2, width_ratios=[1.25, 1])
    # Figure 2.1, not to scale: rays of the lamp are kept where they cross the collecting surface.
    rng = np.random.default_rng(2)
    left.plot([0, 0], [-1, 1], color=TRUTH, linewidth=5, solid_capstyle="butt")
    left.plot([0.7, 0.7], [-1.7, 1.7], color=GRAIN, linewidth=1.6)
    left.plot([3.2, 3.2], [-1.4, 1.4], color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
    left.plot([7, 7], [-0.35, 0.35], color=INK, linewidth=4, solid_capstyle="butt")
    for y, slope in zip(rng.uniform(-0.9, 0.9, 14), rng.uniform(-1.1, 1.1, 14), strict=True):
        at = y + 0.7 * slope
        left.plot([0, 0.7], [y, at], color=FAINT, linewidth=0.8)
        left.plot(0.7, at, "o", color=GRAIN, markersize=3)
    for y in (-0.6, 0.1, 0.75):
        left.annotate("", (7, 0), (0.7, y), arrowprops={"arrowstyle": "->", "color": GRAIN, "linewidth": 0.9})
    for x, y, text, color in (
        (0, -1.35, "lamp", TRUTH),
        (1.15, 1.95, "ray collecting\nsurface", GRAIN),
        (3.2, 1.8, "screen of pixels", INK),
        (6.8, 0.75, "observer", INK),
    ):
        left.text(x, y, text, color=color, ha="center", va="center", fontsize=9)
    style.put_title(left, "Figure 2.1: rays that head for the observer, not to scale")
    left.set(xlim=(-0.8, 7.8), ylim=(-2.4, 2.4))
    # Figure 2.5, to scale.
    right.plot([-35, 35], [0.9, 0.9], color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
    for inner, outer, shade in ((20, 30, 0.35), (10, 20, 0.6), (0, 10, 1.0)):
        for side in (-1, 1):
            right.plot(
                [side * inner, side * outer], [0, 0], color=TRUTH, alpha=shade, linewidth=5, solid_capstyle="butt"
            )
    right.plot(0, 150, "o", color=INK, markersize=6)
    right.plot([-35, 0, 35], [0, 150, 0], color=FAINT, linewidth=0.7, linestyle=":")
    right.text(7, 151, "observer", fontsize=9, va="center")
    measure(right, (48, 0), (48, 150), "150 mm", (18, 0))
    measure(right, (-35, -12), (35, -12), "screen 70 × 70 mm", (0, -8))
    measure(right, (-30, -32), (30, -32), "rings: radii 10, 20, 30 mm", (0, -8))
    right.set_aspect("equal")
    right.set(xlim=(-60, 90), ylim=(-48, 162))
    style.put_title(right, "Figure 2.5: the set-up, to scale")
    for axes in (left, right):
        axes.set_axis_off()
    save(made, path)


def exact_map(source: et.RingSource, pixels: int) -> tuple[Array, Array]:
    """Positions [mm] and luminance [cd/m²] of the horizontal cut through the middle of the map without noise."""
    # The two rows of pixels on both sides of the middle; no other is looked at.
    screen = et.Screen(SIZE, 2 * SIZE / pixels, pixels, 2)
    return screen.x, source.pixel_luminance(OBSERVER, screen)[1]


def transition(x: Array, values: Array, edge: float) -> float:
    """Width [mm] over which the luminance changes from one zone to the next about an edge: pixels that have neither's."""
    inner, outer = values[np.argmin(np.abs(x - edge + 4))], values[np.argmin(np.abs(x - edge - 4))]
    between = (np.abs(x - edge) < 4) & (values < inner * (1 - 1e-6)) & (values > outer * (1 + 1e-6) + 1e-9)
    return float(between.sum() * (x[1] - x[0]))


def draw_cut(path: Path, source: et.RingSource) -> None:
    """Figure 2.7: the cut, and what a higher resolution does to its transitions."""
    made = new_figure(8.4, 3.3, "Figure 2.7: horizontal cut through three Lambertian rings, no noise")
    whole, near = made.subplots(1, 2, width_ratios=[1.5, 1])
    print("Map without noise: width of the transitions between the zones [mm]")
    for pixels, color in zip(RESOLUTIONS, (FAINT, GRAIN, TRUTH), strict=True):
        x, values = exact_map(source, pixels)
        near.step(x, values, where="mid", color=color, linewidth=1.1, label=f"{pixels} × {pixels}")
        if pixels == 128:
            whole.plot(x, values, color=GRAIN, linewidth=1.1)
        widths = ", ".join(f"{transition(x, values, edge):.2f}" for edge in (10.0, 20.0, 30.0))
        print(f"  {pixels:3} × {pixels:<3} pixels of {SIZE / pixels:.3f} mm: {widths} at r = 10, 20, 30 mm")
    style.put_title(whole, "128 × 128 pixels")
    style.put_title(near, "transition at r = 10 mm")
    near.set_xlim(6.5, 13.5)
    style.put_legend(near)
    for axes in (whole, near):
        axes.set_xlabel(f"{style.HORIZONTAL} [mm]")
    whole.set_ylabel("luminance [cd/m²]")
    save(made, path)


def print_filters(seed: int) -> None:
    """Whether a selective weighted filter is better where nothing is uniform, as the end of section 2.3.3 expects.

    Counts are drawn from the Poisson distribution that those of the cone estimator have, 100 rays per pixel in the mean.
    """
    screen = et.Screen(SIZE, SIZE, 128, 128)
    x, y = screen.x[None, :] / 35, screen.y[:, None] / 35
    smooth = np.exp(-2 * ((x - 0.3) ** 2 + (y + 0.2) ** 2)) + 0.4 * np.exp(-9 * ((x + 0.5) ** 2 + (y - 0.4) ** 2))
    ripples = 1 + 0.5 * np.cos(2 * np.pi * (x * 5 + 0.6 * np.sin(3 * y)))
    rng = np.random.default_rng(seed)
    blank = et.luminance_map(et.RingSource(rays=1000), OBSERVER, screen, method="cone")
    print("\nMaps without uniform zones, 100 rays per pixel in the mean: true NRMSE after 5 × 5 filters [%]")
    print(f"  {'map':<18}{'γ':>6}{'none':>8}" + "".join(f"{kind:>20}" for kind in FILTERS))
    for name, shape in (("smooth", smooth), ("smooth + ripples", smooth * ripples)):
        mean = shape * 100 / shape.mean()
        counts = rng.poisson(mean)
        # Errors, of which nothing is said here, would be worked out anew for each filter.
        unknown = np.full(mean.shape, np.nan)
        truth, noisy = (blank.replace(values=v * 1000.0, standard_error=unknown) for v in (mean, counts))
        for gamma in GAMMAS:
            found = [et.compare(et.filter_map(noisy, kind, size=5, gamma=gamma), truth).nrmse for kind in FILTERS]
            print(
                f"  {name:<18}{gamma:6g}{100 * et.compare(noisy, truth).nrmse:8.3f}"
                + "".join(f"{100 * error:20.3f}" for error in found)
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the drawn counts")
    parser.add_argument("--output", type=Path, default=Path("chapter-2"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    draw_set_up(options.output / "figure-2.1-2.5.png")
    draw_cut(options.output / "figure-2.7.png", et.RingSource())
    print_filters(options.seed)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
