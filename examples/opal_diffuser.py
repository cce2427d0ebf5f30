"""An opal diffuser over nine LEDs: how far off it must be until the LEDs are no longer seen.

    python examples/opal_diffuser.py

A Lambertian sheet shows the illuminance on its back: L = τE/π, the same from everywhere. Under small Lambertian LEDs E is a
sum of I cos⁴γ / h², so the map of the sheet is known at each place, and its uniformity at each height.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import draw_maps

PITCH, SIDE, FLUX, TAU = 12.0, 0.4, 30.0, 0.6
PLACES = [(x * PITCH, y * PITCH) for y in (-1, 0, 1) for x in (-1, 0, 1)]


def sheet(height: float) -> et.Scene:
    led = {"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX}
    return et.Scene(
        sources=[{**led, "at": [x, y, 0]} for x, y in PLACES],
        surfaces=[
            {
                "shape": {"kind": "rectangle", "width": 36, "height": 36},
                "at": [0, 0, height],
                "finish": {"kind": "lambertian", "reflectance": 0.0, "transmittance": TAU},
            }
        ],
    )


def truth(height: float, screen: et.Screen) -> np.ndarray:
    total = np.zeros((screen.rows, screen.columns))
    for x, y in PLACES:
        square = height**2 + (screen.x[None, :] - x) ** 2 + (screen.y[:, None] - y) ** 2
        total += FLUX / math.pi * height**2 / square**2 * 1e6
    return TAU * total / math.pi


def main() -> None:
    heights, screen, maps = (4.0, 8.0, 16.0), et.Screen(36, 36, 36, 36), []
    for height in heights:
        eye = et.Observer(0, 0, 1000, target=(0, 0, height))
        lmap = et.luminance_map(sheet(height), eye, screen, method=et.PathTracing(rays_per_pixel=64))
        expected, maps = truth(height, screen), [*maps, lmap]
        error = float(np.sqrt((lmap.standard_error**2).sum())) / lmap.values.size
        # A pixel shows its mean and the formula its middle; LEDs have a size: together less than 0.3 % of the mean.
        mean = float(expected.mean())
        agree(
            f"mean luminance, {height:g} mm [cd/m²]",
            float(lmap.values.mean()),
            mean,
            math.hypot(error, 3e-3 * mean / 4),
        )
        middle = lmap.values[12:24, 12:24]
        print(f"  least over largest of the middle field: {middle.min() / middle.max():.3f}")
    titles = [f"{height:g} mm above the LEDs" for height in heights]
    draw_maps(Path("opal-diffuser.png"), "An opal diffuser over nine LEDs", titles, [("", maps)], size=2.3)
    print("picture: opal-diffuser.png")


if __name__ == "__main__":
    main()
