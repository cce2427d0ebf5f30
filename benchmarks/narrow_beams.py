"""Luminance within narrow beams, by light fields with cells of direction for the beam alone and without.

A rectangle of 8 mm × 5 mm shines into a beam that leans by 6°, evenly into a disk of direction cosines or by a Gauss
function. Its luminance is known. Lines from even places and directions in the beam are read in fields of several seeds: how
far off they are (root mean square), what is stated, and the mean square of deviations over stated errors, which should be 1.

python benchmarks/narrow_beams.py [--rays 1e4 1e5] [--half-angles 2 4 8] [--seeds 3]
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import etendue as et
import numpy as np

Array = Any
MIDDLE, SIDES, CENTRE = (0.1, 0.05), (8.0, 5.0), (1.0, -0.5)
FLUX = 100.0

WIDTH = 1.5
"""Standard deviations of the Gauss function in the sine of the half-angle."""

LINES = 2000


def draw(count: int, sine: float, kind: str, random: np.random.Generator) -> Array:
    """Direction cosines."""
    if kind == "Gauss":
        return sine / WIDTH * random.normal(size=(count, 2)) + MIDDLE
    rho, phi = sine * np.sqrt(random.random(count)), 2 * np.pi * random.random(count)
    return np.column_stack([rho * np.cos(phi), rho * np.sin(phi)]) + MIDDLE


def luminance(cosines: Array, sine: float, kind: str) -> Array:
    """Flux over étendue [lm/(mm² sr)]."""
    square = ((cosines - MIDDLE) ** 2).sum(axis=1)
    area = SIDES[0] * SIDES[1]
    if kind == "Gauss":
        variance = (sine / WIDTH) ** 2
        return FLUX / (area * 2 * math.pi * variance) * np.exp(-square / (2 * variance))
    return np.where(square < sine**2, FLUX / (area * math.pi * sine**2), 0.0)


def lines(cosines: Array, random: np.random.Generator, share: float = 1.0) -> tuple[Array, Array]:
    """Points even over the rectangle, or over a share of its sides, and unit vectors."""
    place = (random.random(cosines.shape) - 0.5) * np.array(SIDES) * share + CENTRE
    up = np.sqrt(1.0 - (cosines**2).sum(axis=1))
    return np.column_stack([place, np.zeros(len(place))]), np.column_stack([cosines, up])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", nargs="+", type=float, default=[1e4, 1e5])
    parser.add_argument("--half-angles", nargs="+", type=float, default=[2, 4, 8], help="[°]")
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    print("beam, half-angle, rays | cells for the beam: off, stated, χ²/n | without: off, stated, χ²/n | ratio of both")
    for rays in map(int, options.rays):
        for half in options.half_angles:
            for kind in ("even", "Gauss"):
                compare(rays, half, kind, options.seeds)


def compare(rays: int, half: float, kind: str, seeds: int) -> None:
    """Prints a row."""
    sine = math.sin(math.radians(half))
    random = np.random.default_rng(1)
    cosines = (draw(4 * LINES, sine, "even", random) - MIDDLE) * 0.8 + MIDDLE
    point, direction = lines(cosines[:LINES], random, 0.8)
    truth = luminance(cosines[:LINES], sine, kind)
    told, means = [], []
    for beam in (None, (0.0, 0.0, 1.0)):
        off, stated, chi2 = [], [], []
        for seed in range(seeds):
            own = np.random.default_rng([seed, 7])
            x, k = lines(draw(rays, sine, kind, own), own)
            field = et.LightField.fit(et.RaySet(x, k, np.full(rays, FLUX / rays)), et.Plane(z=0.0, beam=beam))
            found, error = (v * 1e-6 for v in field.luminance(point, direction))
            off.append(((found - truth) ** 2).mean())
            stated.append((error**2).mean())
            chi2.append((((found - truth) / error) ** 2).mean())
        peak = luminance(np.array([MIDDLE]), sine, kind)[0]
        means.append(math.sqrt(np.mean(off)))
        told.append(f"{means[-1] / peak:6.2%} {math.sqrt(np.mean(stated)) / peak:6.2%} {np.mean(chi2):7.2f}")
    print(f"{kind:>5} {half:4g}° {rays:9,} | {told[0]} | {told[1]} | {means[1] / means[0]:.1f}", flush=True)


if __name__ == "__main__":
    main()
