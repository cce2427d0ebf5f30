"""A sweep: the lens is moved, and the beam is measured at each place.

    python examples/sweep.py

`et.sweep` goes over numbers of a scene by their paths, here the height of the lens, `lens.at.2`. The intensity on the axis
grows until the lens is filled with the image of the die; it can never exceed the luminance of the die times the area of the
lens, times what both faces let through.
"""

from __future__ import annotations

import math

import etendue as et
import numpy as np
from experiments.checks import WIDE, agree
from experiments.collimating_lens import INDEX, apparent_area, focal_length, shape

SIDE, FLUX, CURVATURE = 1.0, 100.0, 15.0
"""Of the die [mm, lm], and radius of curvature of the lens [mm]."""


def main() -> None:
    scene = et.Scene(
        name="die and lens",
        media={"clear": {"index": INDEX}},
        sources=[{"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX}],
        solids=[{"name": "lens", "medium": "clear", "shape": shape(CURVATURE), "finishes": {"edge": "absorber"}}],
    )
    focus = focal_length(CURVATURE)
    places = np.sort([*np.arange(10.0, 50.1, 2.5), focus])
    # From so far away that it is no matter where the lens stands.
    eye, screen = et.Observer(0, 0, 1e7), et.Screen(17, 17, 34, 34)
    table = et.sweep(scene, {"lens.at.2": places}, "intensity", eye, screen, rays_per_pixel=64)
    there = int(np.flatnonzero(places == focus)[0])
    limit = FLUX / (math.pi * SIDE**2) * apparent_area(CURVATURE)
    error = float(table.standard_error["intensity"][there])
    agree("intensity with the die in the focus [cd]", float(table["intensity"][there]), limit, error)
    if np.any(table["intensity"] > limit + WIDE * table.standard_error["intensity"]):
        raise SystemExit("a lens in air raises no luminance")
    best = table.best("intensity")["lens.at.2"]
    print(
        f"largest of the sweep: {table['intensity'].max():,.0f} cd at {best:.2f} mm; the die is in focus at {focus:.2f} mm"
    )
    et.plot_sweep(table, "sweep.png", title="A lens over a die: intensity on the axis")
    print("picture: sweep.png")


if __name__ == "__main__":
    main()
