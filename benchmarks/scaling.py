"""How the cost grows with the work: solids, triangles, patches of a source, observers, reflections.

    python benchmarks/scaling.py [--only solids,observers] [--most 1e5] [--triangles 1e6]

Each line is one family, from small to large: the number, what is measured at it, and at the end the exponent of its growth
from the second number to the last, by least squares of the logarithms. 0: it costs nothing; 1: as much as there is of it.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import trimesh
from etendue import _core
from etendue.scene import compile_scene
from scenes import LENS, glass, lattice
from timing import best, cores, load, timed


def told(family: str, unit: str, numbers: Sequence[float], values: Sequence[float]) -> None:
    """Print a family with its exponent."""
    first = 1 if len(numbers) > 2 else 0
    x, y = np.log(numbers[first:]), np.log(values[first:])
    exponent = float(np.polyfit(x, y, 1)[0]) if len(x) > 1 else math.nan
    points = "  ".join(f"{number:,.0f}: {value:.3g}" for number, value in zip(numbers, values, strict=True))
    print(f"{family} [{unit}]: {points}; exponent {exponent:.2f}", flush=True)


def segment_time(core: _core.Scene, rays: int = 500_000) -> float:
    """Nanoseconds of a segment on all cores."""
    batches = -(-rays // _core.batch_size())
    found = []
    for _ in range(3):
        seconds, result = timed(lambda: _core.work_unit(core, rays, 1, 1_000_000, 0, batches))
        found.append(seconds / result["ledger"]["segments"])
    return min(found) * 1e9


def powers(most: float) -> list[int]:
    """10, 100 … up to a number."""
    return [10**k for k in range(1, round(math.log10(most)) + 1)]


def solids(options: argparse.Namespace) -> None:
    """Glass balls and blocks on a lattice above a lamp."""
    numbers = powers(options.most)
    for kind in ("ball", "block"):
        setting, tracing = [], []
        for count in numbers:
            places, pitch = lattice(count)
            size = (
                {"radius": 0.35 * pitch} if kind == "ball" else dict.fromkeys(("width", "height", "depth"), 0.5 * pitch)
            )

            shape = {"kind": kind, **size}
            seconds, core = timed(lambda shape=shape, places=places: glass(shape, places))
            setting.append(seconds)
            tracing.append(segment_time(core))
        told(f"set-up of {kind}s", "s", numbers, setting)
        told(f"a segment among {kind}s", "ns", numbers, tracing)


def triangles(options: argparse.Namespace) -> None:
    """A dented ball of glass above a lamp, cut finer and finer."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 4}, "flux": 1, "at": [0, 0, -20]}
    numbers, setting, tracing = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        level = 1
        while 20 * 4**level <= options.triangles:
            ball = trimesh.creation.icosphere(subdivisions=level, radius=10)
            ball.apply_scale([1.0, 0.8, 0.9])
            path = Path(folder) / f"ball{level}.ply"
            ball.export(path)
            solid = {"shape": {"kind": "mesh", "file": str(path)}, "medium": "PMMA"}

            def made(solid: dict[str, Any] = solid) -> _core.Scene:
                return _core.Scene(compile_scene(et.Scene(sources=[lamp], solids=[solid])).record)

            seconds, core = timed(made)
            numbers.append(len(ball.faces))
            setting.append(seconds)
            tracing.append(segment_time(core))
            level += 2
    told("set-up of a mesh, by triangles", "s", numbers, setting)
    told("a segment at a mesh, by triangles", "ns", numbers, tracing)


def patches(_: argparse.Namespace) -> None:
    """Rays of a gridded source of more and more patches through a lens."""
    numbers, drawing = [], []
    for pixel in (20.0, 1.7, 0.165):
        gridded = et.GriddedSource.fit(et.RingSource(rays=2_000_000), et.Disk(radius=30), pixel=pixel, threshold=5.0)
        source = {"kind": "gridded", "gridded": gridded, "draws": 1_000_000}
        core = _core.Scene(compile_scene(et.Scene(sources=[source], solids=[LENS])).record)
        numbers.append(len(gridded.patches))
        drawing.append(segment_time(core, 1_000_000))
    told("a segment of a gridded source, by patches", "ns", numbers, drawing)


def observers(_: argparse.Namespace) -> None:
    """Maps for more and more observers at once, per observer."""
    rays = (
        et.RingSource(rays=2_000_000).ray_set() if hasattr(et.RingSource, "ray_set") else et.RingSource(rays=2_000_000)
    )
    field = et.LightField.fit(et.RingSource(rays=500_000), et.Disk(radius=30), depths=(5, 5, 4, 4))
    scene = et.Scene(sources=[{"kind": "light-field", "field": field}])
    screen, numbers = et.Screen(70, 70, 64, 64), (1, 2, 8, 64)
    looks: dict[str, tuple[Any, dict[str, Any]]] = {
        "a cone map": (rays, {"method": et.Cone(acceptance=3)}),
        "a map of a field": (field, {}),
        "a map of a scene": (scene, {"rays_per_pixel": 64}),
    }
    for title, (source, how) in looks.items():

        def seen(count: int, source: Any = source, how: dict[str, Any] = how) -> float:
            eyes = [et.Observer(80 * i / count, 30 * i, 1000) for i in range(count)]
            return best(lambda: et.luminance_map(source, eyes, screen, **how), 2) / count * 1e3

        told(f"{title}, by observers, each", "ms", numbers, [seen(count) for count in numbers])


def depth(_: argparse.Namespace) -> None:
    """Segments in a white box with a small opening, by how many there are of each ray."""
    numbers, tracing = [], []
    for reflectance in (0.5, 0.8, 0.95, 0.99, 0.998):
        white = {"kind": "lambertian", "reflectance": reflectance}
        lamp = {
            "kind": "surface",
            "shape": {"kind": "disk", "radius": 2},
            "flux": 1,
            "at": [0, 0, -9],
            "toward": [0, 0, 1],
        }
        wall = {"shape": {"kind": "sphere", "radius": 10}, "trim": {"z": [-11, 9.9]}, "finish": white}
        core = _core.Scene(compile_scene(et.Scene(sources=[lamp], surfaces=[wall])).record)
        rays = 200_000
        ledger = _core.work_unit(core, rays, 1, 1_000_000, 0, -(-rays // _core.batch_size()))["ledger"]
        numbers.append(ledger["segments"] / rays)
        tracing.append(segment_time(core, rays))
    told("a segment in a white ball, by segments of a ray", "ns", numbers, tracing)


JOBS: dict[str, Callable[[argparse.Namespace], None]] = {
    "solids": solids, "triangles": triangles, "patches": patches, "observers": observers, "depth": depth,
}  # fmt: skip


def chosen(names: str) -> Iterator[Callable[[argparse.Namespace], None]]:
    """Jobs by their names."""
    for name in names.split(","):
        if name not in JOBS:
            raise SystemExit(f"no such job: {name}; known: {', '.join(JOBS)}")
        yield JOBS[name]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(JOBS))
    parser.add_argument("--most", type=float, default=1e4, help="solids")
    parser.add_argument("--triangles", type=float, default=1e6)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{load()}, {cores()} of them used")
    for job in list(chosen(options.only)):
        job(options)


if __name__ == "__main__":
    main()
