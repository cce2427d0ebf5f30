"""Many observers: one light field, looked at from a dozen directions in milliseconds.

    python examples/many_observers.py

Each map's luminance times apparent area adds up to an intensity. That of each map is compared with what lines of sight
through the parts of the LED find, which know nothing of its rays or of the light field: two ways to the same number.
"""

from __future__ import annotations

import math
import time
from pathlib import Path

import etendue as et
from experiments import led
from experiments.checks import agree, map_error, table_error
from experiments.panels import QUICK, draw_maps

ANGLES = [(theta, phi) for theta in (0, 25, 50, 70) for phi in (0, 120, 240)]


def main() -> None:
    rays = led.ray_file(100_000)
    field = et.LightField.fit(rays, et.Disk(z=led.DIE_TOP), depths=QUICK)
    observers = [et.Observer(theta, phi, 1e4, target=(0, 0, led.DIE_TOP)) for theta, phi in ANGLES]
    begun = time.perf_counter()
    maps = et.luminance_map(field, observers, et.Screen(4, 4, 64, 64))
    print(f"{len(maps)} maps in {1e3 * (time.perf_counter() - begun):.0f} ms")
    table = field.intensity()
    lines = et.luminance_map(
        led.recorded(), observers, et.Screen(4, 4, 32, 32), method=et.PathTracing(rays_per_pixel=16)
    )
    for (theta, phi), found, other in zip(ANGLES, maps, lines, strict=True):
        error = math.hypot(table_error(table, phi, theta), map_error(other))
        agree(f"intensity at θ = {theta}°, φ = {phi}° [cd]", found.intensity, other.intensity, error)
    seen = dict(zip(ANGLES, maps, strict=True))
    thetas, phis = (sorted({angles[k] for angles in ANGLES}) for k in range(2))
    rows = [(f"φ = {phi}°", [seen[theta, phi] for theta in thetas]) for phi in phis]
    heading = "An LED with a silicone dome: one light field"
    titles = [f"θ = {theta}°" for theta in thetas]
    draw_maps(Path("many-observers.png"), heading, titles, rows, "root", 1.65, together=True)
    print("picture: many-observers.png")


if __name__ == "__main__":
    main()
