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
from experiments.checks import agree

SIDE, FLUX, INDEX, CURVATURE, RADIUS = 1.0, 100.0, 1.49, 15.0, 8.0
FOCUS = CURVATURE / (INDEX - 1.0)
LENS = {
    "name": "lens",
    "medium": "clear",
    "shape": {
        "kind": "lens",
        "radius": RADIUS,
        "thickness": 4,
        "front": {"radius_of_curvature": CURVATURE, "conic": -(INDEX**2)},
    },
    "finishes": {"edge": "absorber"},
}


def main() -> None:
    scene = et.Scene(
        name="die and lens",
        media={"clear": {"index": INDEX}},
        sources=[{"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX}],
        solids=[LENS],
    )
    places = np.sort([*np.arange(10.0, 50.1, 2.5), FOCUS])
    # From so far away that it is no matter where the lens stands.
    eye, screen = et.Observer(0, 0, 1e7), et.Screen(17, 17, 34, 34)
    table = et.sweep(scene, {"lens.at.2": places}, "intensity", eye, screen, rays_per_pixel=64)
    found = float(table["intensity"][places == FOCUS][0])
    die = FLUX / (math.pi * (SIDE * 1e-3) ** 2)
    limit = die * math.pi * (RADIUS * 1e-3) ** 2 * (1.0 - ((INDEX - 1.0) / (INDEX + 1.0)) ** 2) ** 2
    # The margin of the lens reflects more than its middle, by 1 %, and pixels on its rim are shared.
    agree("intensity with the die in the focus [cd]", found, limit, 0.01 * limit)
    if table["intensity"].max() > 1.005 * limit:
        raise SystemExit("a lens in air raises no luminance")
    best = table.best("intensity")["lens.at.2"]
    print(
        f"largest of the sweep: {table['intensity'].max():,.0f} cd at {best:.2f} mm; the die is in focus at {FOCUS:.2f} mm"
    )
    et.plot_sweep(table, "sweep.png", title="A lens over a die: intensity on the axis")
    print("picture: sweep.png")


if __name__ == "__main__":
    main()
