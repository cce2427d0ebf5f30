"""Radiance and Mitsuba: a ray file's patches rendered by both, pixel by pixel as étendue sees them.

    python examples/radiance_mitsuba.py

A lamp of two emitters is cut into patches, each with an intensity table of its own, as chapter 3 of the thesis does, and
written as a scene for each program. Both are asked for the luminance of every pixel; they must answer what étendue's own
read-out of the patches says. A program that is not installed (pyradiance, mitsuba) is named and left out.
"""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue.units import RADIANCE_WHITE_EFFICACY
from experiments.checks import agree
from experiments.panels import map_grid, put_bar_at
from matplotlib.colors import Normalize

SIDE, PIXELS = 14.0, 48
DISTANCE = 60.0
CLOSE = 1e-6
"""Of the maximum: Mitsuba computes in single precision."""


def lamp() -> et.RaySet:
    first = et.RingSource(radii=(2.0, 4.0), flux=(90, 40), rays=60_000, seed=1).ray_set().moved((-1.5, 0.5, 0))
    second = et.RingSource(radii=(1.5,), flux=(50,), rays=30_000, seed=2).ray_set().moved((4.2, -2, 0))
    return et.RaySet.merge([first, second])


def with_radiance(folder: Path, points: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Luminance along lines, by the program rtrace."""
    radiance: Any = importlib.import_module("pyradiance")
    eyes = np.concatenate([points - DISTANCE * towards, towards], axis=1)
    # The scene names its tables from where it stands.
    with contextlib.chdir(folder):
        Path("scene.oct").write_bytes(radiance.oconv("scene.rad"))
        answer = radiance.rtrace(
            eyes.tobytes(), "scene.oct", header=False, inform="d", outform="d", params=["-ab", "0"]
        )
    return RADIANCE_WHITE_EFFICACY * np.frombuffer(answer).reshape(-1, 3)[:, 1]


def with_mitsuba(folder: Path, points: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Luminance along lines, by Mitsuba's integrator."""
    mi: Any = importlib.import_module("mitsuba")
    mi.set_variant("scalar_rgb")
    sys.path.insert(0, str(folder))
    importlib.import_module("gridded_area")  # the plugin that stands beside the scene
    scene = mi.load_file(str(folder / "scene.xml"))
    integrator, sampler = scene.integrator(), mi.load_dict({"type": "independent"})
    starts = points - DISTANCE * towards
    seen = [
        integrator.sample(scene, sampler, mi.RayDifferential3f(mi.Point3f(start), mi.Vector3f(line)))[0]
        for start, line in zip(starts, towards, strict=True)
    ]
    return np.array(seen)[:, 1]


PROGRAMS: dict[str, tuple[str, Callable[[Path, np.ndarray, np.ndarray], np.ndarray]]] = {
    "radiance": ("pyradiance", with_radiance),
    "mitsuba": ("mitsuba", with_mitsuba),
}


def main() -> None:
    source = et.GriddedSource.fit(lamp(), et.Disk(radius=7), pixel=1.0, threshold=1.0)
    source.save_patches("patches", scenes=list(PROGRAMS))
    # A pinhole far away at 35°: one line for the middle of each pixel of the plane of the lamp.
    middle = (np.arange(PIXELS) + 0.5) / PIXELS * SIDE - SIDE / 2
    x, y = np.meshgrid(middle, middle[::-1])
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    out = np.array([np.sin(np.radians(35)), 0.0, np.cos(np.radians(35))])
    lines = np.tile(out, (len(points), 1))
    found = {"étendue": source.luminance(points=points, directions=lines)}
    for name, (package, render) in PROGRAMS.items():
        try:
            importlib.import_module(package)
        except ImportError:
            print(f"{name}: {package} is not installed, nothing compared")
            continue
        found[name] = render(Path("patches") / name, points, -lines)
        worst = float(np.abs(found[name] - found["étendue"]).max() / found["étendue"].max())
        agree(f"{name}: largest difference of a pixel, of the maximum", worst, 0.0, CLOSE)
    screen, last = et.Screen(SIDE, SIDE, PIXELS, PIXELS), len(found) - 1
    grid = map_grid((2.2, 2.2), list(found), [""], {last: "each"}, heading="Patches of a lamp, seen from 35°")
    norm = Normalize(0.0, float(found["étendue"].max()))
    for column, values in enumerate(found.values()):
        image = grid.show(0, column, (values.reshape(PIXELS, PIXELS), screen), norm)
    put_bar_at(grid.bars[last][0], image, found["étendue"], "luminance", "cd/m²")
    grid.save(Path("radiance-mitsuba.png"))
    print("picture: radiance-mitsuba.png")


if __name__ == "__main__":
    main()
