"""Chapter 2 of the thesis, whole: 28 runs of 50 million rays through the cone estimator, filtered and judged.

    python examples/chapter_2.py                      # 1.4e9 rays, a quarter of a minute on two cores
    python examples/chapter_2.py --rays 500000        # the same in a second, with ten times the noise

Makes figures 2.6 to 2.11 and prints table 2.1, the measured pixel noise beside its exact Poisson prediction, and what
each filter, and the denoiser that came after the thesis, do to noise, edges and flux. The rays are never stored.
docs/chapter-2.md discusses the output.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import time
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from experiments.panels import LINES, ROOT, legend_below, map_grid, new_figure, put_bar_at, save
from matplotlib.colors import PowerNorm
from matplotlib.patches import Rectangle

ACCEPTANCE = 1.5  # α of section 2.3.2 [°]
OBSERVER = et.Observer(theta=0, phi=0, distance=150)
FINE, COARSE = et.Screen(70, 70, 128, 128), et.Screen(70, 70, 32, 32)
FILTERS = ("average", "weighted", "selective", "selective-weighted")
SOURCE = "three Lambertian rings"
GRAIN, TRUTH = LINES[:2]


@dataclasses.dataclass(frozen=True)
class Runs:
    """Maps of the first half of the runs and of all of them, at both resolutions [cd/m²]."""

    half: et.LuminanceMap
    fine: et.LuminanceMap
    coarse: et.LuminanceMap


def trace(source: et.RingSource, seeds: int) -> Runs:
    """Both halves of the runs, each in one pass for both resolutions; the halves joined."""
    halves = []
    for first, count in ((1, seeds // 2), (1 + seeds // 2, seeds - seeds // 2)):
        runs = et.RingSource(rays=sum(source.allocation), runs=count, seed=first)
        halves.append(et.luminance_map(runs, [OBSERVER] * 2, [FINE, COARSE], method=et.Cone(acceptance=ACCEPTANCE)))
    if seeds % 2:
        raise SystemExit("give an even number of seeds: figure 2.10 compares half of them with all")
    (half, half_coarse), (other, other_coarse) = halves
    return Runs(half, et.combine_maps([half, other]), et.combine_maps([half_coarse, other_coarse]))


def zone_masks(source: et.RingSource, screen: et.Screen) -> list[npt.NDArray[np.bool_]]:
    """Pixels that lie wholly in each zone, shape (rows, columns)."""
    half = math.hypot(screen.width / screen.columns, screen.height / screen.rows) / 2
    r = np.hypot(screen.x[None, :], screen.y[:, None])
    return [(r + half < b) & ((r - half > a) | (a == 0)) for a, b in zip(source.edges, source.edges[1:], strict=False)]


def predicted_noise(source: et.RingSource, screen: et.Screen, seeds: int) -> list[float]:
    """Relative noise 1/√μ of a pixel in each zone: μ is the exact expectation of the Poisson count, near the axis.

    A Lambertian pixel sends the share sin²α of its rays into the cone; see docs/theory.md.
    """
    rays_per_area = [n * seeds / a for n, a in zip(source.allocation, source.ring_area, strict=True)]
    share = math.sin(math.radians(ACCEPTANCE)) ** 2
    noise = []
    for density, mask in zip(rays_per_area, zone_masks(source, screen), strict=True):
        # The projected solid angle of the cone shrinks with the cosine of the line of sight, off the axis.
        mu = density * screen.pixel_area * share * screen.cosine(OBSERVER)[mask]
        noise.append(float(np.sqrt((1 / mu).mean())))
    return noise


def measured_noise(source: et.RingSource, lmap: et.LuminanceMap) -> list[float]:
    """Root mean square deviation from the true luminance of the pixels in each zone, relative."""
    masks = zone_masks(source, lmap.screen)
    values = np.nan_to_num(lmap.values)
    return [
        float(np.sqrt(((values[m] / t - 1) ** 2).mean())) for m, t in zip(masks, source.zone_luminance, strict=True)
    ]


def print_tables(
    source: et.RingSource, runs: Runs, smooth: dict[str, et.LuminanceMap], truth: et.LuminanceMap, seeds: int
) -> None:
    print("\nTable 2.1: rays per run, eqs. 2.7 and 2.8")
    for zone, (flux, area, rays) in enumerate(zip(source.ring_flux, source.ring_area, source.allocation, strict=True)):
        luminance = source.zone_luminance[zone]
        print(f"  zone {zone + 1}: {flux:.0f} lm, {area * 1e-6:.6f} m², {rays:,} rays, L = {luminance:,.0f} cd/m²")
    print("\nPixel noise, measured / exact Poisson prediction, zones 1, 2, 3")
    for title, lmap, count in (
        (f"{seeds // 2} seeds, 128 × 128", runs.half, seeds // 2),
        (f"{seeds} seeds, 128 × 128", runs.fine, seeds),
        (f"{seeds} seeds, 32 × 32", runs.coarse, seeds),
    ):
        pairs = zip(measured_noise(source, lmap), predicted_noise(source, lmap.screen, count), strict=True)
        print(f"  {title:<22}" + "   ".join(f"{m:7.2%} / {p:6.2%}" for m, p in pairs))
    print("\n128 × 128 pixels, all seeds, against the true map")
    print(f"  {'filter':<20}{'NCC':>9}{'NRMSE 3.6':>11}{'NRMSE':>9}   zone error 1 / 2 / 3        intensity [cd]")
    for name, lmap in {"none": runs.fine, **smooth}.items():
        c = et.compare(lmap, truth)
        zones = " / ".join(f"{m:6.2%}" for m in measured_noise(source, lmap))
        print(f"  {name:<20}{c.ncc:9.3%}{c.nrmse_thesis:11.3%}{c.nrmse:9.3%}   {zones}   {lmap.intensity:9.3f}")
    print(f"  {'truth':<20}{'':29}   {'':24}   {truth.intensity:9.3f}")


def true_map(source: et.RingSource, lmap: et.LuminanceMap) -> et.LuminanceMap:
    """The map without noise, by following the line of sight: what figure 2.6 made by reverse ray tracing."""
    values = source.pixel_luminance(lmap.observer, lmap.screen)
    return lmap.replace(
        values=values, standard_error=np.zeros_like(values), rays=np.full(values.shape, -1), notes=("exact",)
    )


def draw_maps(path: Path, heading: str, rows: list[tuple[str, et.LuminanceMap]], top: float) -> None:
    """Figures 2.6, 2.8, 2.9: each map, and a magnified part of it."""
    names = [name for name, _ in rows]
    grid = map_grid(
        (2.7, 2.7), ["whole", "magnified"], names, {1: "each"},
        heading=f"{heading}, {SOURCE}", facts=[ROOT], apart=(0.65, 0.55),
    )  # fmt: skip
    # So that the third zone, 15 times darker than the first, is seen.
    norm = PowerNorm(0.5, vmin=0, vmax=top)
    for row, (_, lmap) in enumerate(rows):
        whole, part = (grid.panels[row, k] for k in range(2))
        image = [grid.show(row, k, lmap, norm, own=True) for k in range(2)][-1]
        part.set(xlim=(2, 24), ylim=(-11, 11), ylabel="")
        whole.add_patch(Rectangle((2, -11), 22, 22, fill=False, edgecolor="white", linewidth=0.9))
        put_bar_at(grid.bars[1][row], image, lmap.values, lmap.quantity, lmap.unit)
    grid.save(path)


def draw_sections(
    path: Path, heading: str, panels: list[tuple[str, et.LuminanceMap]], truth: et.LuminanceMap, columns: int
) -> None:
    """Figures 2.10, 2.11: the horizontal cut through the middle, over the true one."""
    rows = math.ceil(len(panels) / columns)
    made = new_figure(4.4 * columns, 2.6 * rows + 0.6, f"{heading}: horizontal cut through {SOURCE}")
    grid = made.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    exact = et.cross_section(truth, y=0)
    for axes, (title, lmap) in zip(grid.ravel(), panels, strict=True):
        cut = et.cross_section(lmap, y=0)
        values, errors = np.nan_to_num(cut.values), np.nan_to_num(cut.standard_error)
        axes.fill_between(cut.position, values - errors, values + errors, color=GRAIN, alpha=0.25, linewidth=0)
        axes.plot(cut.position, values, color=GRAIN, linewidth=1.0, label="estimate, ±1 standard error")
        axes.plot(exact.position, exact.values, color=TRUTH, linewidth=0.9, label="truth")
        style.put_title(axes, title)
    for axes in grid[-1]:
        axes.set_xlabel(f"{style.HORIZONTAL} [mm]")
    for axes in grid[:, 0]:
        axes.set_ylabel(f"{truth.quantity} [{truth.unit}]")
    legend_below(made, grid[0, 0])
    save(made, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=50_000_000, help="rays per run")
    parser.add_argument("--seeds", type=int, default=28, help="runs, an even number")
    parser.add_argument("--output", type=Path, default=Path("chapter-2"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    source = et.RingSource(rays=options.rays)
    start = time.perf_counter()
    runs = trace(source, options.seeds)
    total = options.rays * options.seeds
    seconds = time.perf_counter() - start
    rate = total / seconds / 1e6
    print(f"{total:,} rays drawn and mapped at two resolutions in {seconds:.1f} s: {rate:.1f} million rays/s")
    smooth = {kind: et.filter_map(runs.fine, kind, size=5, gamma=0.2) for kind in FILTERS}
    truth = true_map(source, runs.fine)
    print_tables(source, runs, {**smooth, "opt": et.denoise_map(runs.fine)}, truth, options.seeds)
    top = 1.15 * source.zone_luminance[0]
    draw_maps(options.output / "figure-2.6.png", "Figure 2.6: no noise", [("lines of sight", truth)], top)
    estimates = [("128 × 128 pixels", runs.fine), ("32 × 32 pixels", runs.coarse)]
    draw_maps(options.output / "figure-2.8-2.9.png", f"Figures 2.8 and 2.9: cone of {ACCEPTANCE}°", estimates, top)
    seeds = options.seeds
    halves = [(f"{seeds // 2} seeds", runs.half), (f"{seeds} seeds", runs.fine)]
    draw_sections(options.output / "figure-2.10.png", "Figure 2.10", halves, truth, 2)
    panels = [(f"{kind} 5 × 5" + (", γ = 0.2" if "selective" in kind else ""), m) for kind, m in smooth.items()]
    draw_sections(options.output / "figure-2.11.png", f"Figure 2.11, {seeds} seeds, filtered", panels, truth, 2)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
