"""A mixing chamber: a sphere with a white wall, whose port has the same luminance everywhere.

    python examples/integrating_sphere.py

A lamp lights the wall of a white sphere, and the light that leaves through the port has been reflected often. After the
first reflection the wall is lit evenly, so that its luminance is known from a geometric series: the exitance is
Φρ² / (A (1 - ρ (1 - f))), f being the port's share of the sphere.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import draw_maps

RADIUS, PORT, RHO, FLUX = 25.0, 8.0, 0.95, 300.0


def main() -> None:
    height = math.sqrt(RADIUS**2 - PORT**2)
    share = (1.0 - height / RADIUS) / 2.0
    scene = et.Scene(
        name="mixing chamber",
        # A beam onto the wall beside the axis, where nobody sees its spot through the port.
        sources=[
            {"kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": FLUX, "toward": [1, 0.2, 0.1]},
        ],
        surfaces=[
            {
                "name": "wall",
                "shape": {"kind": "sphere", "radius": RADIUS},
                "trim": {"z": [-RADIUS, height]},
                "finish": {"kind": "lambertian", "reflectance": RHO},
            }
        ],
    )
    sphere = 4.0 * math.pi * (RADIUS * 1e-3) ** 2
    wall = FLUX * RHO**2 / (sphere * (1.0 - RHO * (1.0 - share)))
    truth = wall / math.pi
    observers = [et.Observer(theta, 30, 1000, target=(0, 0, height)) for theta in (0, 20, 40)]
    screen, lines = et.Screen(20, 20, 24, 24), et.PathTracing(rays_per_pixel=64)
    maps = et.luminance_map(scene, observers, screen, method=lines)
    inside = np.hypot(screen.x[None, :], screen.y[:, None]) < PORT - 1.0
    values = maps[0].values[inside]
    error = float(np.sqrt((maps[0].standard_error[inside] ** 2).sum())) / values.size
    agree("luminance in the port [cd/m²]", float(values.mean()), truth, max(error, 0.002 * truth))
    print(f"least over largest in the port: {values.min() / values.max():.3f}")
    titles = [f"θ = {eye.theta:g}°" for eye in observers]
    draw_maps(Path("integrating-sphere.png"), "Port of a mixing chamber", titles, [("", maps)], size=2.3)
    print("picture: integrating-sphere.png")


if __name__ == "__main__":
    main()
