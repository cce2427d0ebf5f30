"""A spot lamp: a small source in a paraboloid, which from afar looks like a full disk of light.

    python examples/reflector_spot.py

A flat source faces the mirror from its focus. Along the axis every place of the mirror shows the source, times the mirror's
reflectance; so the luminance is known, and with it the intensity: luminance times the area of the mirror. Off the axis the
mirror empties from one side: the source is round, and so is the beam.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree, map_error
from experiments.panels import draw_maps

FOCAL, RADIUS, SOURCE, RHO, FLUX = 12.0, 24.0, 1.5, 0.9, 200.0


def main() -> None:
    scene = et.Scene(
        name="spot",
        sources=[
            {
                "kind": "surface",
                "shape": {"kind": "disk", "radius": SOURCE},
                "flux": FLUX,
                "at": [0, 0, FOCAL],
                "toward": [0, 0, -1],
            }
        ],
        surfaces=[
            {
                "shape": {"kind": "paraboloid", "focal_length": FOCAL, "radius": RADIUS},
                "finish": {"kind": "mirror", "reflectance": RHO},
            }
        ],
    )
    luminance = FLUX / (math.pi**2 * (SOURCE * 1e-3) ** 2)
    # The rim sees the source edge-on: only from very far away it is as bright as the rest.
    observers = [et.Observer(theta, 0, 1e8, target=(0, 0, FOCAL)) for theta in (0, 2, 4)]
    screen, lines = et.Screen(52, 52, 64, 64), et.PathTracing(rays_per_pixel=16)
    maps = et.luminance_map(scene, observers, screen, method=lines)
    r = np.hypot(screen.x[None, :], screen.y[:, None])
    ring = maps[0].values[(r > 4) & (r < 20)]
    agree("luminance of the mirror [cd/m²]", float(ring.mean()), RHO * luminance, 1e-6 * luminance)
    area = math.pi * (RADIUS**2) * 1e-6
    print(f"the whole mirror at that luminance would give {RHO * luminance * area:,.0f} cd")
    agree("intensity on the axis [cd]", maps[0].intensity, RHO * luminance * area, map_error(maps[0]))
    titles = [f"{eye.theta:g}° off the axis" for eye in observers]
    draw_maps(Path("reflector-spot.png"), "A disk in a paraboloid", titles, [("", maps)], size=2.3)
    print("picture: reflector-spot.png")


if __name__ == "__main__":
    main()
