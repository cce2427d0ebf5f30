"""Figures 2.1 and 2.6 of the thesis: the ring source traced forwards to a ray collecting surface, and backwards.

    python examples/rings_traced.py              # four million rays and a coarse light field, a few seconds
    python examples/rings_traced.py --full       # twelve runs of ten million and a fine light field: docs/chapter-2.md
    python examples/rings_traced.py --runs 28 --rays 50000000                   # as many as the thesis, five minutes

The scene holds the rings and, just in front of them, a ray collecting surface. Forwards: the rays that crossed it go
through the cone estimator and into a light field. Backwards: lines of sight are followed from the eye to the rings. All
must see the same, Φ/(πA) in each zone.
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from experiments.panels import QUICK, draw_maps, print_table
from scipy.stats import chi2

Mask = npt.NDArray[np.bool_]

SCENE = et.Scene(
    name="rings",
    sources=[{"kind": "rings", "radii": [10, 20, 30], "flux": [300, 200, 100]}],
    detectors=[
        # Just in front of the source (section 2.2.2).
        {"kind": "rays", "name": "rcs", "shape": {"kind": "rectangle", "width": 70, "height": 70}, "at": [0, 0, 0.01]}
    ],
)
OBSERVERS = [et.Observer(theta=0, phi=0, distance=150), et.Observer(theta=40, phi=25, distance=150)]
SCREEN = et.Screen(70, 70, 32, 32, plane="xy")
ACCEPTANCE = 1.5  # α of section 2.3.2 [°]
FEWEST = 5.0
"""Expected rays of a pixel below which χ² is not taken of its count."""


def forward(runs: int, rays: int, *, full: bool) -> tuple[list[et.LuminanceMap], list[et.LuminanceMap], float]:
    """Cone maps of all runs together, maps of the light field of the last one, and the flux of a ray."""
    maps = []
    for seed in range(1, runs + 1):
        incident = et.trace(SCENE, rays=rays, seed=seed).rays["rcs"]
        maps.append(et.luminance_map(incident, OBSERVERS, SCREEN, method=et.Cone(acceptance=ACCEPTANCE)))
    joined = [et.combine_maps(list(same)) for same in zip(*maps, strict=True)] if runs > 1 else maps[0]
    field = et.LightField.fit(incident, et.Disk(radius=30, z=0), depths=None if full else QUICK)
    return joined, et.luminance_map(field, OBSERVERS, SCREEN), 600.0 / (runs * rays)


def expected_rays(reverse: et.LuminanceMap, ray_flux: float) -> npt.NDArray[np.float64]:
    """Rays in the cone of each pixel if it has the luminance of the reverse map: L A cos θ π sin²α / flux of a ray."""
    etendue = math.pi * math.sin(math.radians(ACCEPTANCE)) ** 2 * reverse.screen.pixel_area * 1e-6
    return reverse.values * etendue * reverse.screen.cosine(reverse.observer) / ray_flux


def zone_masks() -> list[Mask]:
    """Pixels that lie wholly in each zone."""
    half = math.hypot(SCREEN.width / SCREEN.columns, SCREEN.height / SCREEN.rows) / 2
    r = np.hypot(SCREEN.x[None, :], SCREEN.y[:, None])
    return [(r + half < outer) & (r - half > inner) for inner, outer in ((-99, 10), (10, 20), (20, 30))]


def print_zones(cone: et.LuminanceMap, field: et.LuminanceMap, reverse: et.LuminanceMap, ray_flux: float) -> None:
    """Mean luminance of the zones, forwards, backwards and in closed form."""
    rows = []
    for zone, (mask, truth) in enumerate(zip(zone_masks(), et.RingSource().zone_luminance, strict=True), 1):
        forwards = float(np.nan_to_num(cone.values)[mask].mean())
        error = truth / math.sqrt(expected_rays(reverse, ray_flux)[mask].sum())
        worst = float(np.abs(reverse.values[mask] / truth - 1).max())
        rows.append(
            [
                f"{zone}",
                f"{truth:,.0f}",
                f"{forwards:,.0f} ± {error:,.0f}",
                f"{(forwards - truth) / error:+.1f}",
                f"{field.values[mask].mean():,.0f}",
                f"{reverse.values[mask].mean():,.0f}",
                f"{worst:.0e}",
            ]
        )
    heads = ["zone", "Φ/(πA)", "cone", "z", "light field", "reverse", "largest error of a reverse pixel"]
    print_table(heads, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=4_000_000, help="rays per run")
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="twelve runs of ten million rays, fine grids")
    parser.add_argument("--output", type=Path, default=Path("rings-traced"), help="folder for the figure")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    runs, rays = (12, 10_000_000) if options.full else (options.runs, options.rays)
    start = time.perf_counter()
    cones, fields, ray_flux = forward(runs, rays, full=options.full)
    middle = time.perf_counter()
    reverses = et.luminance_map(SCENE, OBSERVERS, SCREEN, method=et.PathTracing(rays_per_pixel=1024))
    end = time.perf_counter()
    print(f"{runs * rays:,} rays traced, mapped and fitted in {middle - start:.1f} s; reverse in {end - middle:.1f} s")
    for observer, cone, field, reverse in zip(OBSERVERS, cones, fields, reverses, strict=True):
        print(f"\nseen from θ = {observer.theta:g}°, φ = {observer.phi:g}° [cd/m²]\n")
        print_zones(cone, field, reverse, ray_flux)
        expected = expected_rays(reverse, ray_flux)
        used = expected > FEWEST
        chi = float(((cone.rays - expected)[used] ** 2 / expected[used]).sum())
        p = chi2.sf(chi, used.sum())
        print(f"\nrays of each pixel against the reverse map: χ² = {chi:.1f} over {used.sum()} pixels, p = {p:.2f}")
        for name, lmap in (("cone", cone), ("light field", field)):
            c = et.compare(lmap, reverse)
            print(
                f"{name} against reverse: NCC {c.ncc:.3%}, NRMSE {c.nrmse_thesis:.3%} (eq. 3.6), {c.nrmse:.3%} (true)"
            )
    titles = [
        f"cone {ACCEPTANCE}°, {style.plain(runs * rays)} rays",
        f"light field, {style.plain(rays)} rays",
        "lines of sight backwards",
    ]
    rows = [
        (f"θ = {o.theta:g}°, φ = {o.phi:g}°", maps) for o, *maps in zip(OBSERVERS, cones, fields, reverses, strict=True)
    ]
    heading = "Three Lambertian rings, traced"
    draw_maps(options.output / "rings-traced.png", heading, titles, rows, kind="root")
    print(f"\nfigure: {options.output}/")


if __name__ == "__main__":
    main()
