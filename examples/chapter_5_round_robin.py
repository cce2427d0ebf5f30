"""Section 6.2 of the thesis, a round robin: five instruments measure three materials, before and after deconvolution.

    python examples/chapter_5_round_robin.py           # one round, broad lobes in coarse steps, seconds
    python examples/chapter_5_round_robin.py --full    # ten rounds: docs/chapter-5.md

Each instrument has its own beam, aperture, distance and noise, and lays the sample its own way. In one plane it takes out
what its own scan of the bare beam shows, in two dimensions what its geometry makes of a lobe at 60°.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import etendue as et
import numpy as np
from etendue.instruments.agreement import Agreement
from etendue.plot import style
from experiments.luminaire import holographic
from experiments.panels import INK, LINES, legend_below, new_figure, print_table, save


@dataclasses.dataclass(frozen=True)
class Laboratory:
    """An instrument, and the steps in which it scans [°]."""

    goniometer: et.ScatterGoniometer
    step: float


LABORATORIES: Mapping[str, Laboratory] = {
    "A": Laboratory(et.ScatterGoniometer(14, 25, 886, photons=1e6), 0.1),
    "B": Laboratory(et.ScatterGoniometer(8, 10, 600, divergence=0.1, photons=3e5), 0.1),
    "C": Laboratory(
        et.ScatterGoniometer(20, 24, 500, aperture="ring", inner_diameter=10, divergence=-0.2, photons=3e6), 0.2
    ),
    "D": Laboratory(et.ScatterGoniometer(5, 5, 1000, profile="gaussian", photons=1e6, dark=20), 0.1),
    "E": Laboratory(et.ScatterGoniometer(30, 30, 1200, divergence=0.3, photons=1e6, drift=0.01), 0.15),
}
"""A is the thesis'."""

WINDOW = 0.5
"""Step of windows [°]."""

LAID = 0.05
"""By which a sample, and the scan of the bare beam, may stand aside [°]."""


@dataclasses.dataclass(frozen=True)
class Material:
    """A sample, how it is lit [°], to which angles it is scanned, and how: rings or slice in one plane, or a window."""

    bsdf: et.Bsdf
    theta: float
    span: float
    operator: str


LOPSIDED = et.bsdf.Mixture(parts=[et.bsdf.Gaussian(peak=400, sigma=0.012), et.bsdf.Gaussian(peak=8, sigma=0.08)])
"""Lit at 60°, where a lobe that is even in direction cosines is not in angles."""


MATERIALS: Mapping[str, Material] = {
    "diffuser of 0.5°": Material(holographic(0.5), 0.0, 5.0, "rings"),
    "broad lobe with tails": Material(et.bsdf.HarveyShack(b0=60, l=0.03, s=-3, way="transmitted"), 0.0, 12.0, "rings"),
    "lopsided, in one plane": Material(LOPSIDED, 60.0, 16.0, "slice"),
    "lopsided, in two dimensions": Material(LOPSIDED, 60.0, 8.0, "window"),
}


@dataclasses.dataclass(frozen=True)
class Round:
    """Scans of one material in the plane of incidence, and what deconvolution makes of them."""

    scans: Sequence[et.GoniometerScan]
    found: Sequence[et.GoniometerScan | et.Deconvolution]
    before: Agreement
    after: Agreement


Scan = et.GoniometerScan | et.DirectionalScan


def exact(material: Material, *, coarse: bool) -> list[tuple[Scan, et.GoniometerScan]]:
    """Scans of the sample and of the bare beam, by each instrument without its noise; or in coarse steps."""
    pairs: list[tuple[Scan, et.GoniometerScan]] = []
    for one in LABORATORIES.values():
        silent = dataclasses.replace(one.goniometer, photons=None, dark=0.0, drift=0.0)
        if material.operator == "window":
            step = WINDOW * (3.2 if coarse else 1)
            wide = silent.measure_window(material.bsdf, material.theta, step, material.span, method="quadrature")
            pairs.append((wide, silent.instrument_function(0.5 * one.step)))
            continue
        step = one.step * (1 if not coarse else 2 if material.span <= 5.0 else 8)
        options = {"theta": material.theta, "step": step, "span": material.span}
        scan = silent.measure(material.bsdf, method="quadrature", **options)  # type: ignore[arg-type]
        pairs.append((scan, silent.instrument_function(0.5 * one.step)))
    return pairs


def noisy(scan: Scan, goniometer: et.ScatterGoniometer, rng: np.random.Generator) -> Scan:
    """With the counts, the dark and the drift of the instrument, and a little aside in the plane of incidence."""
    photons = goniometer.photons or 1.0
    flux = scan.flux * (1 + goniometer.drift * np.linspace(0, 1, scan.flux.size))
    counts = rng.poisson(np.maximum(flux, 0.0) * photons + goniometer.dark)
    aside = rng.uniform(-LAID, LAID)
    if isinstance(scan, et.GoniometerScan):
        moved = dataclasses.replace(scan, angle=scan.angle + aside)
    else:
        c, s = np.cos(np.radians(aside)), np.sin(np.radians(aside))
        moved = dataclasses.replace(scan, direction=scan.direction @ [[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return dataclasses.replace(
        moved,
        flux=(counts - goniometer.dark) / photons,
        standard_error=np.sqrt(np.maximum(counts, 1)) / photons,
        background=goniometer.dark / photons,
    )


def in_plane(scan: et.DirectionalScan) -> et.GoniometerScan:
    """The positions in the plane of incidence."""
    x, y, z = scan.direction.T
    row = np.flatnonzero(np.abs(y) < 1e-9)
    row = row[np.argsort(x[row])]
    angle = np.degrees(np.arctan2(x, z))[row]
    more = {"solid_angle": scan.solid_angle, "incidence": scan.incidence, "way": scan.way}
    return et.GoniometerScan(angle, scan.flux[row], **more)  # type: ignore[arg-type]


def section(material: Material, f: Callable[[np.ndarray], np.ndarray]) -> et.GoniometerScan:  # type: ignore[type-arg]
    """A lobe in two dimensions as a scan in the plane of incidence by a detector without size."""
    reach = material.span - 0.5
    angle = np.linspace(material.theta - reach, material.theta + reach, 601)
    t = np.radians(angle)
    values = f(np.column_stack([np.sin(t), np.zeros(t.size), np.cos(t)]))
    known = np.isfinite(values)
    flux = (values * np.cos(t))[known]
    return et.GoniometerScan(angle[known], flux, solid_angle=1.0, incidence=material.theta, way="reflected")


def measure(material: Material, pairs: Sequence[tuple[Scan, et.GoniometerScan]], seed: int) -> Round:
    """One round: every scan and every bare beam with noise of its own."""
    rng = np.random.default_rng(seed)
    scans: list[et.GoniometerScan] = []
    found: list[et.GoniometerScan | et.Deconvolution] = []
    for (scan, bare), laboratory in zip(pairs, LABORATORIES.values(), strict=True):
        measured = noisy(scan, laboratory.goniometer, rng)
        if isinstance(measured, et.DirectionalScan):
            scans.append(in_plane(measured))
            found.append(section(material, et.deconvolve_directions(measured, regular=False, replicates=0).evaluate))
            continue
        signature = noisy(bare, laboratory.goniometer, rng)
        scans.append(measured)
        found.append(et.deconvolve(measured, signature, operator=material.operator, replicates=0))  # type: ignore[arg-type]
    return Round(scans, found, et.agreement(scans), et.agreement(found))


def print_instruments() -> None:
    """What differs."""
    rows = []
    for name, one in LABORATORIES.items():
        g = one.goniometer
        bare = g.instrument_function(0.02)
        spread = (
            f"edge {g.divergence:g}°"
            if g.divergence
            else f"source {g.source_angle:g}°"
            if g.source_angle
            else "parallel"
        )
        rest = [f"{g.photons:.0e}", f"{g.dark:g}", f"{100 * g.drift:g} %", f"{one.step:g}°"]
        beam = f"{g.beam_diameter:g} mm, {g.profile}, {spread}"
        rows.append(
            [
                name,
                beam,
                f"{g.aperture} of {g.aperture_diameter:g} mm",
                f"{g.distance:g} mm",
                f"{bare.fwhm:.2f}°",
                *rest,
            ]
        )
    print_table(["", "beam", "aperture", "distance", "FWHM of S", "photons", "dark", "drift", "step"], rows)


def told(values: Sequence[float]) -> str:
    """Mean and worst of some rounds [%]."""
    return f"{np.mean(values):.1f}" + (f" ({np.max(values):.1f})" if len(values) > 1 else "")


def draw(path: Path, rounds: Mapping[str, Round]) -> None:
    """A column for each material: as measured above, deconvolved below, the truth in black."""
    made = new_figure(12.0, 5.6, "Five scatter goniometers, three materials")
    grid = made.subplots(2, len(rounds), sharex="col")
    for column, (name, one) in zip(grid.T, rounds.items(), strict=True):
        material = MATERIALS[name]
        first = one.scans[0]
        angle = np.linspace(-material.span, material.span, 801) + first.regular
        angle = angle[np.abs(angle) < 89.0]
        truth = lobe(material, angle)
        reach = {"diffuser of 0.5°": 2.5, "lopsided, in one plane": 12.0}.get(name, 8.0)
        for axes, lobes in zip(column, (one.scans, one.found), strict=True):
            axes.plot(angle - first.regular, truth, color=INK, lw=2.2, alpha=0.35, label="truth")
            for each, laboratory, colour in zip(lobes, LABORATORIES, LINES, strict=False):
                values = each.bsdf if isinstance(each, et.GoniometerScan) else each.values
                axes.plot(each.angle - first.regular, values, color=colour, lw=1.0, label=laboratory)
            axes.set(xlim=(-reach, reach), yscale="log", ylim=(1e-3 * truth.max(), 2 * truth.max()))
        style.put_title(column[0], name)
        column[1].set_xlabel("angle from the regular direction [°]")
    grid[0, 0].set_ylabel("measured f [1/sr]")
    grid[1, 0].set_ylabel("deconvolved f [1/sr]")
    legend_below(made, grid[0, 0])
    save(made, path)


def lobe(material: Material, angle: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """F in the plane of incidence [1/sr]."""
    behind = material.bsdf.ways[3] or material.bsdf.ways[1]
    t, i = np.radians(angle), np.radians(material.theta)
    to = np.column_stack([np.sin(t), np.zeros(t.size), -np.cos(t) if behind else np.cos(t)])
    return np.asarray(material.bsdf.evaluate([-np.sin(i), 0.0, np.cos(i)], to))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="ten rounds")
    parser.add_argument("--rounds", type=int, help="how often all is measured")
    parser.add_argument("--output", type=Path, default=Path("chapter-5"), help="folder for the figure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    count = options.rounds or (10 if options.full else 1)
    print_instruments()
    rows, last = [], {}
    for name, material in MATERIALS.items():
        pairs = exact(material, coarse=not options.full)
        rounds = [measure(material, pairs, seed) for seed in range(1, count + 1)]
        last[name] = rounds[0]
        row = [name]
        for what in ("peak", "fwhm", "over_angles"):
            row += [
                told([getattr(one.before, what) for one in rounds]),
                told([getattr(one.after, what) for one in rounds]),
            ]
        angle = rounds[0].found[0].angle
        top = float(lobe(material, np.linspace(angle[0], angle[-1], 4001)).max())
        highest = [d.bsdf.max() if isinstance(d, et.GoniometerScan) else d.peak for one in rounds for d in one.found]
        row += [f"{100 * (np.mean(highest) / top - 1):+.1f}"]
        rows.append(row)
    print()
    titles = [
        f"{what}, {when}" for what in ("CV of peak [%]", "of FWHM", "of f") for when in ("measured", "deconvolved")
    ]
    print_table([f"{count} rounds, mean (worst)", *titles, "mean peak less the truth [%]"], rows)
    draw(options.output / "chapter-5-round-robin.png", last)
    print(f"\nfigure: {options.output}/")


if __name__ == "__main__":
    main()
