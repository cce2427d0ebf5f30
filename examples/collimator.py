"""A collimator: a lens makes the die look as large as itself, and no brighter.

    python examples/collimator.py

A small die stands in the focus of a lens with a hyperbolic face. Seen along the axis from afar, the lens is filled with the
light of the die. A lens cannot raise luminance: what is seen is that of the die, less the reflections at both faces.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.collimating_lens import APERTURE, INDEX, focal_length, shape, transmittance
from experiments.panels import draw_maps

SIDE, FLUX = 1.0, 100.0
"""Of the die [mm, lm]."""

CURVATURE = 15.0
"""Radius of curvature of the lens [mm]."""


def main() -> None:
    focus = focal_length(CURVATURE)
    scene = et.Scene(
        name="collimator",
        media={"clear": {"index": INDEX}},
        sources=[
            {"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX},
        ],
        solids=[{"name": "lens", "medium": "clear", "at": [0, 0, focus], "shape": shape(CURVATURE)}],
    )
    die = FLUX / (math.pi * (SIDE * 1e-3) ** 2)
    screen, lines = et.Screen(20, 20, 64, 64), et.PathTracing(rays_per_pixel=16)
    looks = {theta: et.Observer(theta, 90, 1e5, target=(0, 0, focus)) for theta in (0.0, 1.5)}
    maps = [et.luminance_map(scene, eye, screen, method=lines) for eye in looks.values()]
    r = np.hypot(screen.x[None, :], screen.y[:, None])
    print(f"the die alone has {die:,.0f} cd/m²")
    # What is reflected twice in the lens and still meets the die is seen near the axis, what the rim cuts near the rim.
    for low, high in ((1.0, 3.0), (3.0, 5.0), (5.0, APERTURE - 0.3)):
        ring = (r > low) & (r < high)
        truth = die * float(transmittance(r[ring], CURVATURE).mean())
        error = float(np.sqrt((maps[0].standard_error[ring] ** 2).sum())) / int(ring.sum())
        agree(
            f"luminance {low:g} to {high:g} mm from the axis [cd/m²]", float(maps[0].values[ring].mean()), truth, error
        )
    # Where small images of the die, reflected twice in the lens, lie on the large one, pixels have some noise.
    brightest = max(float((lmap.values - 5.0 * np.nan_to_num(lmap.standard_error)).max()) for lmap in maps)
    if brightest > die:
        raise SystemExit("a lens in air raises no luminance")
    print("nowhere brighter than the die by more than the noise")
    titles = [f"{theta:g}° off the axis" for theta in looks]
    draw_maps(Path("collimator.png"), "A die behind a collimating lens", titles, [("", maps)], size=2.6)
    print("picture: collimator.png")


if __name__ == "__main__":
    main()
