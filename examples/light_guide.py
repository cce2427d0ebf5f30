"""A light guide: a rod of glass keeps all light that enters its end, however often it meets the wall.

    python examples/light_guide.py

Light that enters a polished rod of index above √2 through its end cannot leave through its side. So what comes out at the
other end is a matter of the two ends alone, (1 - R)/(1 + R) at each angle, and does not depend on the length of the rod.
Seen through it, a square of light becomes a pattern of its mirror images.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import draw_maps

RADIUS, INDEX, RAYS = 4.0, 1.5, 400_000


def guide(length: float) -> et.Scene:
    return et.Scene(
        media={"glass": {"index": INDEX}},
        sources=[
            {
                "kind": "surface",
                "shape": {"kind": "rectangle", "width": 3, "height": 2},
                "at": [0, 0.5, -0.01],
                "flux": 1,
            }
        ],
        solids=[{"medium": "glass", "shape": {"kind": "rod", "radius": RADIUS, "height": length}}],
        detectors=[{"name": "out", "kind": "rays", "shape": {"kind": "disk", "radius": 60}, "at": [0, 0, length + 1]}],
    )


def transmittance() -> float:
    """Of Lambertian light, unpolarised at each face: over cos θ dΩ, with all reflections between the ends."""
    square = (np.arange(20_000) + 0.5) / 20_000  # sin²θ, evenly: Lambertian light
    c, inside = np.sqrt(1 - square), np.sqrt(1 - square / INDEX**2)
    s = ((c - INDEX * inside) / (c + INDEX * inside)) ** 2
    p = ((INDEX * c - inside) / (INDEX * c + inside)) ** 2
    r = (s + p) / 2
    return float(np.mean((1 - r) / (1 + r)))


def main() -> None:
    truth = transmittance()
    for length in (10.0, 60.0):
        found = et.trace(guide(length), rays=RAYS, seed=1).rays["out"].total_flux
        agree(f"through {length:g} mm of rod", found, truth, math.sqrt(truth * (1 - truth) / RAYS))
    screen, lines = et.Screen(9, 9, 64, 64), et.PathTracing(rays_per_pixel=32)
    maps = [
        et.luminance_map(guide(length), et.Observer(8, 30, 300, target=(0, 0, length)), screen, method=lines)
        for length in (10.0, 30.0, 60.0)
    ]
    titles = ["10 mm of rod", "30 mm", "60 mm"]
    draw_maps(Path("light-guide.png"), "A light guide, seen from 8°", titles, [("", maps)], size=2.3)
    print("picture: light-guide.png")


if __name__ == "__main__":
    main()
