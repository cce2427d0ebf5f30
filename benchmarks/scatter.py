"""What scatter costs and how exact a table is, beside Lambert's law and closed quadratures in the same run.

1. A known BRDF, 0.3/π + a Gaussian of σ = 0.15 in direction cosines with a share of 0.4, is tabled at 0, 15 … 75° in 3 136
   points each; its directional-hemispherical reflectance is held against the quadrature of the function.
2. Samples and values per second of each model and of the table, and the chamber of thesis chapter 4 traced forwards with
   each, all beside a Lambertian surface of the same reflectance.

python benchmarks/scatter.py [--rays 1e6]
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.quantities.bsdf_data import BsdfData, BsdfSlice, PolarGrid, direction
from timing import best

Array = npt.NDArray[np.float64]

FLOOR, LOBE, SIGMA = 0.3, 0.4, 0.15
ANGLES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 82.5)
SAMPLES = 1_000_000


def row(job: str, value: str, ratio: str = "") -> None:
    print(f"{job:<52} {value:>28} {ratio:>30}".rstrip(), flush=True)


def known(incident: Array, scattered: Array) -> Array:
    off = incident[..., :2] + scattered[..., :2]
    return FLOOR / math.pi + LOBE / (2 * math.pi * SIGMA**2) * np.exp(-0.5 * np.sum(off * off, axis=-1) / SIGMA**2)


def exact(theta: float) -> float:
    """Gauss and Legendre over the unit disk of direction cosines."""
    x, w = np.polynomial.legendre.leggauss(400)
    r, a = 0.5 * (x + 1.0), np.arange(1440) * (2.0 * math.pi / 1440)
    beta = np.stack([r[:, None] * np.cos(a), r[:, None] * np.sin(a)], axis=-1)
    scattered = np.concatenate([beta, np.sqrt(1.0 - r * r)[:, None, None] * np.ones((1, a.size, 1))], axis=-1)
    return float(np.sum(known(direction(theta, 180.0), scattered).mean(axis=1) * 2.0 * math.pi * r * 0.5 * w))


def table() -> et.BsdfTable:
    slices = []
    for theta in np.linspace(0.0, 75.0, 6):
        incident = direction(theta, 180.0)
        grid = PolarGrid("normal", np.linspace(0.0, 89.9, 56), np.arange(56) * (360.0 / 56))
        slices.append(BsdfSlice(incident, known(incident, grid.directions(incident, transmitted=False)), grid=grid))
    return et.BsdfTable(BsdfData(tuple(slices)))


def chamber(finish: Mapping[str, Any]) -> et.Scene:
    disk = {"kind": "disk", "radius": 2.5}
    lamps = [
        {"kind": "surface", "shape": disk, "flux": 0.96, "at": [x, y, 0.1]} for x in (-4.5, 4.5) for y in (-4.5, 4.5)
    ]
    walls = [
        {"shape": {"kind": "cylinder", "radius": 21.5, "height": 21.4}, "finish": finish},
        {"shape": {"kind": "disk", "radius": 21.5}, "finish": finish},
    ]
    return et.Scene(sources=lamps, surfaces=walls)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=float, default=1e6)
    rays = int(parser.parse_args().rays)

    measured = table()
    for theta in ANGLES:
        truth, found = exact(theta), float(measured.reflectance(theta))
        row(
            f"reflectance of the table at {theta:g}°",
            f"{found:.4f} of {truth:.4f}",
            f"{100 * (found / truth - 1):+.2f} %",
        )

    bsdfs: dict[str, et.Bsdf] = {
        "lambertian": et.bsdf.Lambertian(reflectance=0.7),
        "gaussian": et.bsdf.Gaussian(peak=LOBE / (2 * math.pi * SIGMA**2), sigma=SIGMA),
        "coated": et.bsdf.Coated(index=1.5, base_reflectance=0.8),
        "rough-metal": et.bsdf.RoughMetal(roughness=0.2, index=0.96, extinction=6.69),
        "rough-coat": et.bsdf.RoughCoat(roughness=0.2, index=1.5, base_reflectance=0.8),
        "table": measured,
    }
    incident, to = (
        direction(40.0, 180.0),
        et.bsdf.Lambertian(reflectance=1.0).sample(direction(40.0, 0.0), SAMPLES, seed=1),
    )
    units: dict[str, tuple[float, ...]] = {}
    for name, bsdf in bsdfs.items():
        bsdf.sample(incident, 10, seed=1)
        drawn = best(lambda bsdf=bsdf: bsdf.sample(incident, SAMPLES, seed=2), 3)
        asked = best(lambda bsdf=bsdf: bsdf.evaluate(incident, to), 3)
        finish = {"kind": "bsdf", "bsdf": bsdf}
        scene = chamber(finish)
        ledger = et.trace(scene, rays=1000, seed=1).ledger
        traced = best(lambda scene=scene: et.trace(scene, rays=rays, seed=1), 3)
        units[name] = (drawn, asked, traced)
        ratios = [ours / base for ours, base in zip(units[name], units["lambertian"], strict=True)]
        row(f"{name}: a sample", f"{1e9 * drawn / SAMPLES:.0f} ns", f"{ratios[0]:.1f} × lambertian")
        row(f"{name}: a value", f"{1e9 * asked / SAMPLES:.0f} ns", f"{ratios[1]:.1f} × lambertian")
        row(f"{name}: a ray of the chamber", f"{1e9 * traced / rays:.0f} ns", f"{ratios[2]:.1f} × lambertian")
        assert ledger.closes  # noqa: S101 - what does not close is no benchmark


if __name__ == "__main__":
    main()
