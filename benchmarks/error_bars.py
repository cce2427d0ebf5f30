"""How well error bars hold: pixels of maps, and cells of fields, within one and two standard errors of the truth.

Sources of known luminance: the families of `light_field.py`, and the packaged LED of `sharp_fields.py`, whose die is finer
than most cells. Maps are taken from directions spread evenly over the hemisphere, with large and with small pixels; a pixel
counts where its true luminance is above 1 % of the map's largest. A normal distribution has 68 and 95 %. All pixels of a map
share the errors of one direction, so that the shares of single maps differ: their range stands beside.

python benchmarks/error_bars.py [--rays 1e5 1e6] [--families limb film die dome led] [--maps 16] [--auto]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from light_field import coverage, families
from oracles.packaged_led import PackagedLed

Array = Any
PIXELS = (12, 48)
"""Columns and rows of the maps."""

FINE = 96
"""Points along either side of a map by which the truth is averaged, or as many times each pixel's."""

LIT = 0.01
"""Share of the largest luminance from which on a pixel counts."""

LOOKED_AT = {
    "limb": (26.0, (0.9, -0.5, 0.0)),
    "film": (26.0, (0.9, -0.5, 0.0)),
    "die": (3.2, (0.0, 0.0, 0.0)),
    "dome": (3.2, (0.0, 0.0, 0.3)),
    "led": (2.6, (0.0, 0.0, -0.45)),
}
"""Side of the screen and its middle [mm]."""


def sources() -> dict[str, tuple[Any, et.Surface, Any]]:
    """By name: the source, the surface to state, and what draws its rays."""
    found: dict[str, tuple[Any, et.Surface, Any]] = {
        name: (family.source, family.surface, family.ray_set) for name, family in families().items()
    }
    led = PackagedLed()

    def rays(n: int, seed: int) -> et.RaySet:
        position, direction = led.rays(n, seed=seed)
        return et.RaySet(position, direction, np.full(n, led.total_flux / n))

    return found | {"led": (led, et.Plane(z=-0.45), rays)}


def true_map(source: Any, observer: et.Observer, screen: et.Screen, points: int) -> Array:
    """Mean luminance of each pixel by points × points lines of sight."""
    n = screen.columns
    right, up, _ = screen.axes(observer)
    offsets = ((np.arange(points) + 0.5) / points - 0.5) * screen.width / n
    xx, yy = ((at[:, None] + offsets).ravel() for at in (screen.x, screen.y))
    at = np.asarray(observer.target) + yy[:, None, None] * up + xx[None, :, None] * right
    k = observer.position - at
    k /= np.linalg.norm(k, axis=-1, keepdims=True)
    luminance = source.luminance(points=at.reshape(-1, 3), directions=k.reshape(-1, 3))
    return luminance.reshape(n, points, n, points).mean(axis=(1, 3))


def pixels(field: et.LightField, source: Any, name: str, side: int, maps: int) -> list[Array]:
    """(L - true L)/σ of the lit pixels of each map."""
    rng = np.random.default_rng(3)
    width, target = LOOKED_AT[name]
    found = []
    for _ in range(maps):
        theta, phi = np.degrees(np.arcsin(np.sqrt(0.95 * rng.random()))), 360.0 * rng.random()
        observer = et.Observer(theta, phi, 1000, target=target)
        screen = et.Screen(width, width, side, side)
        lmap, truth = (
            et.luminance_map(field, observer, screen),
            true_map(source, observer, screen, max(FINE // side, 4)),
        )
        lit = (truth > LIT * truth.max()) & (lmap.standard_error > 0)
        found.append(((lmap.values - truth) / np.where(lit, lmap.standard_error, 1.0))[lit])
    return found


def within(deviations: Array, errors: float) -> float:
    """Share of them, in percent."""
    return 100.0 * float(np.mean(np.abs(deviations) < errors))


def main() -> None:
    """Print a row for each source and number of rays."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rays", nargs="+", type=float, default=[1e5])
    parser.add_argument("--families", nargs="+", choices=LOOKED_AT, default=list(LOOKED_AT))
    parser.add_argument("--maps", type=int, default=16)
    parser.add_argument("--auto", action="store_true", help="let the surface be chosen")
    arguments = parser.parse_args()
    print(
        "| source | rays | cells, 1σ/2σ | " + " | ".join(f"{n} × {n} pixels, 1σ/2σ (maps at 1σ)" for n in PIXELS) + " |"
    )
    print("|---|---|---|" + "---|" * len(PIXELS))
    for n in map(int, arguments.rays):
        for name in arguments.families:
            source, surface, rays = sources()[name]
            field = et.LightField.fit(rays(n, 1), "auto" if arguments.auto else surface)
            one, two = coverage(field, source)
            row = [name, f"{n:,}", f"{100 * one:.0f}/{100 * two:.0f} %"]
            for side in PIXELS:
                maps = pixels(field, source, name, side, arguments.maps)
                every, single = np.concatenate(maps), [within(m, 1.0) for m in maps]
                row.append(f"{within(every, 1):.0f}/{within(every, 2):.0f} % ({min(single):.0f} to {max(single):.0f})")
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
