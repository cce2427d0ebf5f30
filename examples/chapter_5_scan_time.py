"""Section 6.2 of the thesis: how long the scan of a whole BSDF takes, by a CCD behind filters and by a photometer.

    python examples/chapter_5_scan_time.py           # 321 directions, seconds
    python examples/chapter_5_scan_time.py --full    # 2 562 directions: docs/chapter-5.md

The virtual goniometer of the thesis tells the flux in its aperture at directions all over the hemisphere; each detector then
reads it. What the detectors are like is typical, and stands below.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.instruments.detectors import Readings
from etendue.plot import style
from etendue.quantities.bsdf_directions import direction
from experiments.panels import LINES, legend_below, new_figure, print_table, save

Array = npt.NDArray[np.float64]

GONIOMETER = et.ScatterGoniometer()
THETA, LAST = 45.0, 88.0
"""Angle of incidence, and the largest angle of the detector from the normal [°]."""

MATERIALS: Mapping[str, et.Bsdf] = {
    "microcellular PET": et.bsdf.RoughCoat(roughness=0.035, index=1.575, base_reflectance=0.9938),
    "black gloss paint": et.bsdf.RoughCoat(roughness=0.02, index=1.5, base_reflectance=0.003),
}
"""The stand-in of chapter 4, and a surface "that exhibits a very low diffuse component"."""

BAFFLE = et.Baffle(opening=24.0, length=200.0)
"""Sees the spot at 45°, 20 mm long, in full."""

ROOM, WALLS = 54e6, 0.05
"""Area [mm²] and reflectance of the walls around the instrument: 3 m × 3 m × 3 m, black."""

CCD = et.Detector(
    rate=3e9,  # a spectrometer behind a fibre: light of one nanometre
    full_well=3e5,
    read_noise=10.0,
    dark=2.0,
    shortest=0.01,
    longest=60.0,
    filters=(1.0, 0.1, 0.01, 1e-3, 1e-4),
    filter_error=0.005,
    pause=2.5,  # one second to move on and settle; filter wheel, trial exposure and readout
)
PHOTOMETER = et.Detector(
    rate=1e14,  # a photodiode behind V(λ): light of all wavelengths
    full_well=1e14 * 0.1,
    read_noise=5e3,  # of the amplifier, 8 fA in a tenth of a second
    shortest=0.1,
    longest=0.1,
    pause=1.0,
)


def directions(count: int) -> Array:
    """The regular direction, and others evenly over the hemisphere up to LAST, on a spiral."""
    k = np.arange(count - 1)
    height = 1.0 - (1.0 - math.cos(math.radians(LAST))) * (k + 0.5) / (count - 1)
    azimuth = np.degrees(k * math.pi * (3.0 - math.sqrt(5.0)))
    return np.concatenate([direction([THETA], 0.0), direction(np.degrees(np.arccos(height)), azimuth)])


def detectors(bsdf: et.Bsdf) -> Mapping[str, et.Detector]:
    """Each with the stray light of the room that it sees: what the sample scatters, off the walls."""
    radiance = float(bsdf.reflectance(THETA)) * WALLS / (math.pi * ROOM * (1.0 - WALLS))
    bare = math.pi * GONIOMETER.solid_angle * GONIOMETER.distance**2
    baffled = radiance * BAFFLE.etendue(GONIOMETER.aperture_diameter)
    ccd = dataclasses.replace(CCD, stray=baffled)
    return {
        "CCD, up to 60 s": ccd,
        "CCD, up to 2 h": dataclasses.replace(ccd, longest=7200.0),
        "CCD, always 1 s, filter 10⁻³": dataclasses.replace(ccd, shortest=1.0, longest=1.0, filters=(1e-3,), pause=1.5),
        "CCD, always 1 s, no filter": dataclasses.replace(ccd, shortest=1.0, longest=1.0, filters=(1.0,), pause=1.5),
        "photometer, no baffle": dataclasses.replace(PHOTOMETER, stray=radiance * bare),
        "photometer, baffle": dataclasses.replace(PHOTOMETER, stray=baffled),
    }


def told(name: str, readings: Readings, flux: Array, at: Array) -> list[str]:
    """A row: time, relative errors of f, and of the reflectance that the scan adds up to."""
    off = np.abs(readings.flux / flux - 1.0)
    grazing = at[:, 2] < math.cos(math.radians(80.0))
    # Each direction but the first stands for the same solid angle.
    share = float(readings.flux[1:].sum() / flux[1:].sum() - 1.0)
    cells = [f"{readings.hours:.2f}", f"{readings.seconds.max():.0f}", f"{readings.saturated.sum()}"]
    quantiles = (np.quantile(off, 0.5), np.quantile(off, 0.95), np.quantile(off[grazing], 0.5), (off > 0.05).mean())
    return [name, *cells, *(f"{100 * one:.2g}" for one in quantiles), f"{100 * share:+.2f}"]


def draw(path: Path, found: Mapping[str, tuple[Array, Array, Mapping[str, Readings]]]) -> None:
    """Error and time of each position by its angle from the normal."""
    shown = (
        "CCD, up to 60 s",
        "CCD, always 1 s, no filter",
        "photometer, no baffle",
        "photometer, baffle",
        "CCD, up to 2 h",
    )
    made = new_figure(9.6, 5.8, "Readings of a scatter goniometer, by detector")
    grid = made.subplots(2, len(found), sharex=True, sharey="row")
    for column, (material, (at, flux, readings)) in zip(grid.T, found.items(), strict=True):
        theta = np.degrees(np.arccos(at[:, 2]))
        edges = np.linspace(0.0, LAST, 23)
        band = np.clip(np.digitize(theta, edges) - 1, 0, edges.size - 2)
        middle = 0.5 * (edges[1:] + edges[:-1])
        for name, colour in zip(shown, LINES, strict=False):
            off = 100 * np.abs(readings[name].flux / flux - 1.0)
            for axes, values in ((column[0], off), (column[1], readings[name].seconds)):
                curve = [np.median(values[band == k]) if (band == k).any() else np.nan for k in range(middle.size)]
                axes.semilogy(middle, curve, "o-", ms=3, lw=1.1, color=colour, label=name)
        style.put_title(column[0], material)
        column[1].set_xlabel("angle from the normal [°]")
    grid[0, 0].set_ylabel("error of f, median [%]")
    grid[1, 0].set_ylabel("time of a position, median [s]")
    legend_below(made, grid[0, 0])
    save(made, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="2 562 directions")
    parser.add_argument("--output", type=Path, default=Path("chapter-5"), help="folder for the figure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    at = directions(2562 if options.full else 321)
    print(f"one angle of incidence, {THETA:g}°; {len(at)} directions up to {LAST:g}° from the normal")
    full, any_ = BAFFLE.field(GONIOMETER.aperture_diameter, GONIOMETER.distance)
    spot = GONIOMETER.beam_diameter / math.cos(math.radians(THETA))
    print(f"spot {spot:.1f} mm long; behind the baffle {full:.1f} mm are seen in full, nothing beyond {any_:.0f} mm")
    print(f"dynamic range at one time: CCD {CCD.dynamic_range:.1e}, photometer {PHOTOMETER.dynamic_range:.1e}")
    found: dict[str, tuple[Array, Array, Mapping[str, Readings]]] = {}
    for material, bsdf in MATERIALS.items():
        flux, _ = GONIOMETER.flux_at(bsdf, at, THETA, method="quadrature")
        readings = {name: one.read(flux, seed=7) for name, one in detectors(bsdf).items()}
        found[material] = at, flux, readings
        print(f"\n{material}: flux in the aperture from {flux.min():.1e} to {flux.max():.1e} of the beam\n")
        heads = ["hours", "longest [s]", "saturated", "error of f, median [%]", "95 % below", "median beyond 80°"]
        rows = [told(name, one, flux, at) for name, one in readings.items()]
        print_table(["", *heads, "positions off by more than 5 % [%]", "reflectance [%]"], rows)
    draw(options.output / "chapter-5-scan-time.png", found)
    print(f"\nfigure: {options.output}/")


if __name__ == "__main__":
    main()
