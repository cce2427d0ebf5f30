"""A collimator: a lens makes the die look as large as itself, and no brighter.

    python examples/collimator.py

A small die stands in the focus of a lens with a hyperbolic face. Seen along the axis from afar, the lens is filled with the
light of the die. A lens cannot raise luminance: what is seen is that of the die, less the reflections at both faces.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
from experiments.checks import agree
from experiments.panels import draw_maps

SIDE, FLUX, INDEX, RADIUS = 1.0, 100.0, 1.49, 15.0
"""Die [mm, lm]; index of the lens and its radius of curvature [mm]: a hyperboloid that faces the die."""

FOCUS = RADIUS / (INDEX - 1.0)
LENS = {"kind": "lens", "radius": 8, "thickness": 4, "front": {"radius_of_curvature": RADIUS, "conic": -(INDEX**2)}}


def main() -> None:
    scene = et.Scene(
        name="collimator",
        media={"clear": {"index": INDEX}},
        sources=[
            {"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX},
        ],
        solids=[{"name": "lens", "medium": "clear", "at": [0, 0, FOCUS], "shape": LENS}],
    )
    die = FLUX / (math.pi * (SIDE * 1e-3) ** 2)
    once = ((INDEX - 1.0) / (INDEX + 1.0)) ** 2
    truth = die * (1.0 - once) ** 2
    screen, lines = et.Screen(20, 20, 64, 64), et.PathTracing(rays_per_pixel=16)
    looks = {theta: et.Observer(theta, 90, 1e5, target=(0, 0, FOCUS)) for theta in (0.0, 1.5)}
    maps = [et.luminance_map(scene, eye, screen, method=lines) for eye in looks.values()]
    middle = maps[0].values[26:38, 26:38]
    print(f"the die alone has {die:,.0f} cd/m²")
    # Near the axis both faces stand within a few degrees of the light: Fresnel's reflectance changes by less than 0.1 %.
    agree("luminance in the lens, on the axis [cd/m²]", float(middle.mean()), truth, 0.001 * truth)
    if max(float(lmap.values.max()) for lmap in maps) > die:
        raise SystemExit("a lens in air raises no luminance")
    print("nowhere brighter than the die")
    draw_maps(Path("collimator.png"), [f"{theta:g}° off the axis" for theta in looks], [("[mm]", maps)], size=3.4)
    print("picture: collimator.png")


if __name__ == "__main__":
    main()
