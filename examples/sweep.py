"""A sweep: the lens is moved, and the beam is measured at each place.

    python examples/sweep.py

A scene is a value: `scene.replace` gives the same with another part, and a loop is a sweep. The intensity on the axis grows
until the lens is filled with the image of the die; it can never exceed the luminance of the die times the area of the lens,
times what both faces let through.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import INK, LINES, new_figure, save

SIDE, FLUX, INDEX, CURVATURE, RADIUS = 1.0, 100.0, 1.49, 15.0, 8.0
FOCUS = CURVATURE / (INDEX - 1.0)
LENS = {
    "kind": "lens",
    "radius": RADIUS,
    "thickness": 4,
    "front": {"radius_of_curvature": CURVATURE, "conic": -(INDEX**2)},
}
PLACES = np.arange(10.0, 40.1, 2.5)


def main() -> None:
    bare = et.Scene(
        media={"clear": {"index": INDEX}},
        sources=[{"kind": "surface", "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE}, "flux": FLUX}],
    )
    lines, screen = et.PathTracing(rays_per_pixel=16), et.Screen(17, 17, 34, 34)
    found = []
    for z in (*PLACES, FOCUS):
        lens = {
            "name": "lens",
            "medium": "clear",
            "at": [0, 0, float(z)],
            "shape": LENS,
            "finishes": {"edge": "absorber"},
        }
        eye = et.Observer(0, 0, 1e5, target=(0, 0, float(z)))
        found.append(et.luminance_map(bare.replace(solids=[lens]), eye, screen, method=lines).intensity)
    *curve, focused = found
    die = FLUX / (math.pi * (SIDE * 1e-3) ** 2)
    limit = die * math.pi * (RADIUS * 1e-3) ** 2 * (1.0 - ((INDEX - 1.0) / (INDEX + 1.0)) ** 2) ** 2
    # The margin of the lens reflects more than its middle, by 1 %, and pixels on its rim are shared.
    agree("intensity with the die in the focus [cd]", focused, limit, 0.01 * limit)
    if max(curve) > 1.005 * limit:
        raise SystemExit("a lens in air raises no luminance")
    print(f"best of the sweep: {max(curve):,.0f} cd at {PLACES[int(np.argmax(curve))]:g} mm")
    made = new_figure(6.2, 3.2)
    axes = made.subplots()
    axes.plot(PLACES, curve, "o-", color=LINES[0], markersize=4)
    axes.axhline(limit, color=LINES[1], linestyle="--", label="luminance × area × transmittance")
    axes.axvline(FOCUS, color=LINES[2], linestyle=":", label="die in the focus")
    axes.set_xlabel("place of the lens [mm]", color=INK)
    axes.set_ylabel("intensity on the axis [cd]", color=INK)
    axes.legend(frameon=False, fontsize=8)
    save(made, Path("sweep.png"))
    print("picture: sweep.png")


if __name__ == "__main__":
    main()
