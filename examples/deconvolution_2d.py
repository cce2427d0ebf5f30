"""Lobes that are not round, at 60°, behind an instrument: measured in two dimensions, and taken out of it in four ways.

``--full`` measures all lobes with many seeds, which takes minutes; the default looks at one lobe and one seed.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.instruments.turned_sample import TurnedSample
from etendue.plot import style
from etendue.scatter.appearance import distinctness_of_image, haze_index, reflection_haze, specular_gloss
from experiments.panels import FAINT, INK, LINES, new_figure, print_table, save

Array = npt.NDArray[np.float64]
THETA, TURN = 60.0, 30.0
PEAK_COUNTS = 1e4
METHODS = ("richardson-lucy", "total-variation", "parametric", "matrix")
LIT = 0.05
"""Of the largest f: where bands are asked whether they hold."""


def on_floor(lobe: et.Bsdf, mirrored: float = 0.0) -> et.Bsdf:
    """A lobe on a Lambertian floor, and what is mirrored."""
    parts = [lobe, et.bsdf.Lambertian(reflectance=0.3)]
    return et.bsdf.Mixture(parts=parts + ([et.bsdf.Mirror(reflectance=mirrored)] if mirrored else []))


LOBES: Mapping[str, tuple[et.Bsdf, float, float]] = {
    "Gaussian": (on_floor(et.bsdf.Gaussian(peak=60.0, sigma=0.008, aspect=2.0)), 0.5, 6.0),
    "sharp Gaussian": (on_floor(et.bsdf.Gaussian(peak=600.0, sigma=0.004, aspect=1.5)), 0.25, 3.0),
    "ABg": (on_floor(et.bsdf.ABg(a=0.003, b=1e-4, g=2.2, aspect=1.7)), 0.5, 6.0),
    "brushed metal": (et.bsdf.RoughMetal(roughness=0.03, roughness_across=0.015, reflectance=0.7), 0.5, 6.0),
}
"""Samples, turned by 30° against the plane of incidence, with the step and the span of their windows [°]."""


def counted(clean: et.DirectionalScan, peak: float, seed: int) -> et.DirectionalScan:
    """Poisson counts about an exact scan."""
    photons = peak / float(clean.flux.max())
    counts = np.random.default_rng(seed).poisson(np.maximum(clean.flux, 0.0) * photons)
    return dataclasses.replace(clean, flux=counts / photons, standard_error=np.sqrt(np.maximum(counts, 1)) / photons)


def true_values(sample: et.Bsdf, scan: et.DirectionalScan) -> Array:
    """F [1/sr] at the positions of a scan."""
    return TurnedSample(sample, TURN).evaluate(scan.incident, scan.direction)


def error_of(found: et.DirectionalDeconvolution) -> Array:
    """Standard errors of the values; all scans here know their noise."""
    return np.zeros(found.values.shape) if found.standard_error is None else found.standard_error


def loss(values: Array, truth: Array) -> float:
    """Relative L2 error [%]."""
    return 100.0 * float(np.linalg.norm(values - truth) / np.linalg.norm(truth))


def compare_methods(seeds: int, names: tuple[str, ...], coarser: float) -> None:
    """Errors, coverage of the bands and least values of all methods."""
    rows = []
    for name in names:
        sample, step, span = LOBES[name]
        step *= coarser
        clean = et.ScatterGoniometer().measure_window(sample, THETA, step, span, turn=TURN, method="quadrature")
        truth = true_values(sample, clean)
        lit = truth > LIT * truth.max()
        found: dict[str, list[list[float]]] = {method: [] for method in METHODS}
        raw = []
        for seed in range(seeds):
            scan = counted(clean, PEAK_COUNTS, seed)
            raw.append(loss(scan.bsdf, truth))
            for method in METHODS:
                if method == "matrix" and seed > 1:
                    continue
                start = time.process_time()
                one = et.deconvolve_directions(scan, method=method, regular=False)  # type: ignore[arg-type]
                seconds = time.process_time() - start
                inside = 100.0 * float(np.mean(np.abs(one.values - truth)[lit] < error_of(one)[lit]))
                found[method].append([loss(one.values, truth), inside, float(one.values.min()), seconds])
        for method, values in found.items():
            error, inside, _, seconds = np.mean(values, axis=0)
            spread = np.std([value[1] for value in values], ddof=1) / len(values) ** 0.5 if len(values) > 1 else np.nan
            lowest = np.min([value[2] for value in values])
            cells = [
                name,
                f"{np.mean(raw):.1f} %",
                method,
                f"{error:.2f} %",
                f"{inside:.0f} %" if np.isnan(spread) else f"{inside:.0f} ± {spread:.0f} %",
                f"{lowest:.2g}",
                f"{seconds:.1f} s",
            ]
            rows.append(cells)
    print_table(["lobe", "measured", "method", "L2 error", "within the band", "least f [1/sr]", "CPU"], rows)


def look_for_mirrors(seeds: int) -> None:
    """A share in a single direction under lobes of two widths, and none."""
    rows = []
    lobes = {
        "broad": et.bsdf.Gaussian(peak=5.0, sigma=0.05, aspect=1.5),
        "narrow": et.bsdf.Gaussian(peak=60.0, sigma=0.02, aspect=2.0),
    }
    cases = [("broad", 0.04), ("narrow", 0.02), ("narrow", 0.0)]
    for name, share in cases:
        sample = on_floor(lobes[name], share)
        clean = et.ScatterGoniometer().measure_window(sample, THETA, 0.5, 6, turn=TURN, method="quadrature")
        truth = true_values(sample, clean)
        told: dict[str, list[str]] = {}
        for method in ("richardson-lucy", "parametric"):
            pairs, errors = [], []
            for seed in range(seeds):
                one = et.deconvolve_directions(counted(clean, PEAK_COUNTS, seed), method=method, replicates=0)  # type: ignore[arg-type]
                pairs.append((one.regular.share, one.regular.error))
                errors.append(loss(one.values, truth))
            found, error = np.mean(pairs, axis=0)
            told[method] = [f"{found:.4f} ± {error:.4f}", f"{np.mean(errors):.1f} %"]
        alone = np.mean([
            loss(et.deconvolve_directions(counted(clean, PEAK_COUNTS, s), regular=False, replicates=0).values, truth)
            for s in range(seeds)
        ])  # fmt: skip
        rows.append([name, f"{share:g}", *told["richardson-lucy"], *told["parametric"], f"{alone:.0f} %"])
    heads = ["lobe", "mirrored", "found, RL", "L2 of f", "found, parametric", "L2 of f", "L2 of f, RL alone"]
    print_table(heads, rows)


def appearances(table: et.Bsdf) -> list[float]:
    """What the instruments of the standards say, of what three incidences tell."""
    return [
        specular_gloss(table, 20),
        specular_gloss(table, 60),
        reflection_haze(table),
        distinctness_of_image(table),
        haze_index(table, 2),
    ]


def look_at_gloss(seed: int) -> None:
    """A satin coat at 20, 30 and 60°: gloss, haze and distinctness of image, as measured and without the instrument."""
    coat = et.bsdf.RoughCoat(roughness=0.012, index=1.5, base_reflectance=0.3)
    rows = [["truth", *(f"{value:.1f}" for value in appearances(coat))]]
    scans: list[et.DirectionalScan] = []
    founds: dict[str, list[et.DirectionalDeconvolution]] = {"richardson-lucy": [], "parametric": []}
    for theta in (20.0, 30.0, 60.0):
        clean = et.ScatterGoniometer().measure_window(coat, theta, 0.4, 6, method="quadrature")
        scans.append(counted(clean, 1e5, seed))
        for method, found in founds.items():
            found.append(et.deconvolve_directions(scans[-1], method=method, regular=False))  # type: ignore[arg-type]
    rows.append(["measured", *(f"{value:.1f}" for value in appearances(et.bsdf_table(scans)))])
    for method, found in founds.items():
        rows.append([method, *(f"{value:.1f}" for value in appearances(et.bsdf_table(found)))])
    print_table(["", "gloss 20°", "gloss 60°", "reflection haze", "DOI [%]", "haze index 2° [%]"], rows)


def draw_cuts(path: Path, names: tuple[str, ...], coarser: float) -> None:
    """Each lobe along the plane of incidence: truth, scan, and ways back."""
    wide = len(names) > 1
    heading = "Lobes at 60°, scanned, and without the instrument" if wide else ""
    made = new_figure(3.0 * len(names) + 0.6, 3.2, heading)
    for axes, name in zip(made.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        sample, step, span = LOBES[name]
        step *= coarser
        clean = et.ScatterGoniometer().measure_window(sample, THETA, step, span, turn=TURN, method="quadrature")
        scan = counted(clean, PEAK_COUNTS, 0)
        cut = np.abs(scan.direction[:, 1]) < 1e-9
        angle = np.degrees(np.arctan2(scan.direction[cut, 0], scan.direction[cut, 2])) - THETA
        fine = np.linspace(angle.min(), angle.max(), 241)
        to = np.stack([np.sin(np.radians(fine + THETA)), 0 * fine, np.cos(np.radians(fine + THETA))], axis=-1)
        truth = TurnedSample(sample, TURN).evaluate(scan.incident, to)
        found = et.deconvolve_directions(scan, regular=False)
        fitted = et.deconvolve_directions(scan, method="parametric", regular=False)
        inverse = et.deconvolve_directions(scan, method="matrix", regular=False)
        axes.plot(fine, truth, color=INK, lw=1.8, label="truth")
        axes.plot(angle, scan.bsdf[cut], "--", color=LINES[1], lw=1.0, label="measured")
        axes.plot(angle, inverse.values[cut], ":", color=FAINT, lw=0.9, label="matrix")
        axes.plot(fine, fitted.evaluate(to), "-.", color=LINES[2], lw=1.0, label="parametric")
        band = error_of(found)[cut]
        axes.fill_between(angle, found.values[cut] - band, found.values[cut] + band, color=LINES[0], alpha=0.3, lw=0)
        axes.plot(fine, found.evaluate(to), color=LINES[0], lw=1.1, label="Richardson-Lucy")
        reach = min(span, float(np.abs(fine[truth > 0.01 * truth.max()]).max()) * 1.1)
        axes.set(xlim=(-reach, reach), ylim=(-0.15 * truth.max(), 1.45 * truth.max()))
        style.put_title(axes, name)
        axes.set_xlabel("from the regular direction [°]")
    made.axes[0].set_ylabel("f [1/sr]")
    style.put_legend(made.axes[0], loc="upper left", ncols=2)
    save(made, path)


def draw_metal(path: Path, coarser: float) -> None:
    """The brushed metal, as `etendue deconvolve` would draw it."""
    sample, step, span = LOBES["brushed metal"]
    clean = et.ScatterGoniometer().measure_window(sample, THETA, coarser * step, span, turn=TURN, method="quadrature")
    found = et.deconvolve_directions(counted(clean, PEAK_COUNTS, 0), regular=False)
    et.plot_directions(found, path, title="Brushed metal, turned by 30°")


PARTS = ("methods", "mirrors", "gloss", "figures")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all lobes, forty seeds, gloss and mirrors")
    parser.add_argument("--only", choices=("methods", "mirrors", "gloss", "figures"), help="one part of it")
    parser.add_argument("--seeds", type=int, help="scans of each lobe")
    parser.add_argument("--output", type=Path, default=Path("deconvolution-2d"), help="folder for the figures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    seeds = options.seeds or (40 if options.full else 1)
    names = tuple(LOBES) if options.full else ("Gaussian",)
    coarser = 1.0 if options.full else 2.0
    parts = (options.only,) if options.only else PARTS if options.full else ("methods", "figures")
    if "methods" in parts:
        compare_methods(seeds, names, coarser)
    if "mirrors" in parts:
        look_for_mirrors(min(seeds, 4))
    if "gloss" in parts:
        look_at_gloss(1)
    if "figures" in parts:
        draw_metal(options.output / "deconvolution-2d-metal.png", coarser)
        draw_cuts(options.output / "deconvolution-2d-cuts.png", names, coarser)
    print(f"\nfigures: {options.output}/")


if __name__ == "__main__":
    main()
