"""Section 5.6 of the thesis, figures 5.10 and 5.11: a luminaire with its diffuser as it was measured, and as it is.

    python examples/chapter_5_luminaire.py           # 50 × 50 pixels and few lines of sight, seconds
    python examples/chapter_5_luminaire.py --full    # 100 × 100 pixels, 10⁴ lines each: docs/chapter-5.md

A virtual goniometer measures a diffuser that is known. The map with its scan is L_H, that with the deconvolved scan L_W; the
map with the diffuser itself is what both should be.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Mapping
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from experiments.luminaire import FLUX, FOCUS, HEIGHT, RADIUS, REFLECTANCE, SIDE, holographic, look, luminaire
from experiments.panels import FAINT, INK, LINES, map_grid, measures, print_table, put_bar_at
from matplotlib.colors import Normalize

Array = npt.NDArray[np.float64]

FWHM = 0.6
"""Of the stand-in [°]: the spread over four apertures is then that which the thesis measured (docs/chapter-5.md)."""

PHOTONS = 1e6
RINGS = np.arange(0.0, 9.0, 0.5)
"""Distances from the axis [mm] between which maps are averaged."""

LIT = 0.01
"""Of the maximum of a map: rings that have less are dark."""

THESIS = {"L_H": (1.69e7, 4.71e6), "L_W": (1.69e7 / 0.92, 4.71e6 / 0.91)}
"""Maximum and mean; of L_W from "8 % and 9 %"."""


@dataclasses.dataclass(frozen=True)
class Measured:
    """The diffuser as tables, and deconvolutions of scans that noise might have made as well."""

    raw: et.Bsdf
    thesis: et.Bsdf
    ours: et.Bsdf
    centre: et.Bsdf
    again: list[et.Bsdf]


def measure(replicates: int) -> Measured:
    """Scan the diffuser and the bare beam; take the instrument out, and once more out of scans drawn about what was found.

    The lobe of four times as many iterations stands for the truth of these, as it does in `deconvolve`.
    """
    goniometer = et.ScatterGoniometer(photons=PHOTONS)
    bare = goniometer.instrument_function(seed=2)
    scan = goniometer.measure(holographic(FWHM), span=5, method="quadrature", seed=3)
    ours = et.deconvolve(scan, bare, stop="held-out", replicates=0)
    thesis = et.deconvolve(scan, bare, operator="slice", stop="thesis", replicates=0)
    further = et.deconvolve(scan, bare, stop=4 * ours.iterations, replicates=0)
    rng = np.random.default_rng(4)
    again = []
    for _ in range(replicates):
        counts = rng.poisson(further.fitted * PHOTONS)
        error = np.sqrt(np.maximum(counts, 1)) / PHOTONS
        drawn = dataclasses.replace(scan, flux=counts / PHOTONS, standard_error=error)
        found = et.deconvolve(drawn, bare, stop=ours.iterations, replicates=0)
        again.append(et.revolved(drawn, found.values, middle=found.middle))
    print(f"iterations: {thesis.iterations} (slice, the thesis' rule), {ours.iterations} (rings, held-out counts)")
    for name, one in (("thesis' way", thesis), ("ours", ours)):
        print(
            f"{name}: peak {one.peak:.0f} /sr, FWHM {one.fwhm:.3f}°; measured {scan.bsdf.max():.0f}, {scan.fwhm:.2f}°"
        )
    tables = [et.revolved(scan, one.values, middle=one.middle) for one in (thesis, ours, further)]
    return Measured(et.revolved(scan), *tables, again)


def by_ring(lmap: et.LuminanceMap, values: Array) -> Array:
    """Means of values of pixels between the distances of RINGS from the axis."""
    distance = np.hypot(lmap.screen.x[None, :], lmap.screen.y[:, None])
    ring = np.digitize(distance, RINGS) - 1
    return np.array([values[ring == k].mean() for k in range(RINGS.size - 1)])


def sampling_error(lmap: et.LuminanceMap) -> tuple[float, Array]:
    """What lines of sight leave to chance: of the mean of the map, and of the mean of each ring."""
    distance = np.hypot(lmap.screen.x[None, :], lmap.screen.y[:, None])
    ring = np.digitize(distance, RINGS) - 1
    parts = [lmap.standard_error[ring == k] for k in range(RINGS.size - 1)]
    whole = float(np.sqrt((lmap.standard_error**2).sum())) / lmap.values.size
    return whole, np.array([np.sqrt((part**2).sum()) / part.size for part in parts])


@dataclasses.dataclass(frozen=True)
class Band:
    """Standard error of L_W that comes from the noise of the scan and from the stop: of its mean, and of each ring."""

    mean: float
    ring: Array


def band(measured: Measured, pixels: int, lines: int) -> Band:
    """Spread of the maps of all replicates, and how far their mean is from that of the lobe that they are drawn about."""
    centre = look(measured.centre, pixels, lines)
    maps = [look(one, pixels, lines) for one in measured.again]
    mean = np.array([one.values.mean() for one in maps])
    ring = np.stack([by_ring(one, one.values) for one in maps])

    def error(drawn: Array, truth: Array | float) -> Array:
        return np.asarray(np.sqrt(drawn.var(axis=0, ddof=1) + (drawn.mean(axis=0) - truth) ** 2))

    return Band(float(error(mean, centre.values.mean())), error(ring, by_ring(centre, centre.values)))


def print_maps(maps: Mapping[str, et.LuminanceMap], spread: Band) -> None:
    """Maximum and mean of each, and how they stand to the truth."""
    truth, ours = maps["truth"], maps["L_W"]
    rows = []
    for name, lmap in maps.items():
        printed = THESIS.get(name)
        top, mean = float(lmap.values.max()), float(lmap.values.mean())
        error = float(np.hypot(sampling_error(lmap)[0], spread.mean if name == "L_W" else 0.0))
        off = mean / float(truth.values.mean()) - 1
        row = [name, f"{top:.3g}", "" if printed is None else f"{printed[0]:.3g}", f"{mean:.4g} ± {error:.1g}"]
        row += ["" if printed is None else f"{printed[1]:.3g}"]
        row += [
            f"{100 * (top / float(ours.values.max()) - 1):+.1f} %",
            f"{100 * (mean / ours.values.mean() - 1):+.1f} %",
        ]
        row += ["", "", ""] if name == "truth" else [f"{100 * off:+.2f} %", *measures(lmap, truth)[::2]]
        rows.append(row)
    heads = ["", "maximum", "thesis", "mean [cd/m²]", "thesis", "maximum to L_W", "mean to L_W"]
    print_table([*heads, "mean to truth", "NCC [%]", "NRMSE [%]"], rows)
    chance = np.hypot(sampling_error(truth)[0], sampling_error(ours)[0])
    for name in ("L_H", "L_W, thesis' way", "L_W"):
        error = float(np.hypot(chance, spread.mean))
        off = float(maps[name].values.mean() - truth.values.mean())
        print(f"mean of {name} less that of the truth: {off:+.3g} cd/m², {off / error:+.1f} standard errors of L_W")
    lit = by_ring(truth, truth.values) > LIT * truth.values.max()
    error = np.sqrt(spread.ring**2 + sampling_error(truth)[1] ** 2 + sampling_error(ours)[1] ** 2)[lit]
    off = (by_ring(ours, ours.values) - by_ring(truth, truth.values))[lit] / error
    low = by_ring(maps["L_H"], maps["L_H"].values)[lit] / by_ring(truth, truth.values)[lit]
    print(
        f"rings of 0.5 mm with light: {(np.abs(off) < 1).sum()} of {off.size} within one standard error of L_W, ",
        end="",
    )
    print(
        f"{(np.abs(off) < 2).sum()} within two; L_H is {100 * (low.min() - 1):+.0f} to {100 * (low.max() - 1):+.0f} %"
    )


def draw(path: Path, maps: Mapping[str, et.LuminanceMap], spread: Band) -> None:
    """Figure 5.11, with what the thesis could not have: the truth, and by how much the maps miss it."""
    truth, size, below = maps["truth"], 1.95, 3.0
    last = len(maps) - 1
    grid = map_grid(
        (size, size), list(maps), [""], {last: "each"}, heading="LED, parabola and diffuser (fig. 5.11)", below=below
    )
    norm = Normalize(0.0, 1.02 * float(np.quantile(truth.values, 0.999)))
    for column, lmap in enumerate(maps.values()):
        image = grid.show(0, column, lmap, norm)
    data = np.stack([lmap.values for lmap in maps.values()])
    put_bar_at(grid.bars[last][0], image, data, truth.quantity, truth.unit)
    width = (grid.figure.get_figwidth() - 2.0) / 2
    left, right = (style.add_axes(grid.figure, x, 0.8, width, below - 1.1) for x in (0.7, width + 1.6))
    middle = 0.5 * (RINGS[1:] + RINGS[:-1])
    for (name, lmap), colour in zip(maps.items(), (LINES[1], LINES[2], LINES[0], INK), strict=True):
        cut = et.cross_section(lmap, y=0.1)
        left.plot(cut.position, cut.values, color=colour, lw=1.0, label=name)
        ring = by_ring(lmap, lmap.values)
        known = by_ring(truth, truth.values)
        if name == "truth":
            continue
        lit = known > LIT * truth.values.max()
        ratio = 100 * (ring / np.where(lit, known, 1.0) - 1)
        right.plot(middle, np.where(lit, ratio, np.nan), "o-", ms=3, color=colour, lw=1.0, label=name)
        if name == "L_W":
            error = 100 * spread.ring / np.where(lit, known, 1.0)
            right.fill_between(middle, ratio - error, ratio + error, where=lit, color=colour, alpha=0.25, lw=0)
    right.axhline(0.0, color=FAINT, lw=0.6)
    left.set(xlabel=f"{style.HORIZONTAL} [mm]", ylim=(0, None))
    right.set(xlabel="distance from the axis [mm]", ylabel="ring, less the truth [%]", xlim=(0, 9))
    right.text(2.5, 0.5, "dark", fontsize=8, color=FAINT, ha="center", va="bottom")
    for axes, title in (
        (left, "Cut through the middle"),
        (right, "Means of rings of 0.5 mm, and the standard error of L_W"),
    ):
        style.dress(axes)
        style.put_title(axes, title)
    style.put_numbers(left.yaxis, truth.quantity, truth.unit, *left.get_ylim())
    handles, labels = left.get_legend_handles_labels()
    place = {"loc": "lower center", "ncols": len(labels), "frameon": False}
    grid.figure.legend(handles, labels, **place, fontsize=style.TICK_SIZE, labelcolor=INK)
    grid.save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="100 × 100 pixels, 10⁴ lines of sight each, 16 replicates")
    parser.add_argument("--lines", type=int, help="lines of sight per pixel")
    parser.add_argument("--output", type=Path, default=Path("chapter-5"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    pixels, usual, replicates = (100, 10_000, 16) if options.full else (50, 64, 4)
    lines = options.lines or usual
    print(
        f"LED of {FLUX:g} lm, {SIDE:g} mm square, in the focus of a parabola, f = {FOCUS:g} mm, reflectance {REFLECTANCE:g},"
    )
    print(f"opening of {2 * RADIUS:g} mm, {HEIGHT:.2f} mm over the vertex; diffuser of {FWHM:g}°")
    measured = measure(replicates)
    maps = {
        "L_H": look(measured.raw, pixels, lines),
        "L_W, thesis' way": look(measured.thesis, pixels, lines),
        "L_W": look(measured.ours, pixels, lines),
        "truth": look(holographic(FWHM), pixels, lines),
    }
    spread = band(measured, pixels, max(lines // 20, 64))
    print_maps(maps, spread)
    et.draw_scene(
        luminaire(holographic(FWHM)),
        options.output / "chapter-5-luminaire-section.png",
        section=["y=0"],
        rays=24,
        window=(-9.5, 9.5, -0.5, 14),
        title="LED, parabola and diffuser (fig. 5.10)",
    )
    draw(options.output / "chapter-5-luminaire.png", maps, spread)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
