"""The scenes that several scripts trace: the cavity of thesis chapter 4, a lens, and equal solids on a lattice."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
from etendue import _core
from etendue.scene import compile_scene

Array = Any
RADIUS, HEIGHT, REFLECTANCE, HOLE, AWAY = 21.5, 21.4, 0.984, 2.5, 10.0
HOLES = ((AWAY, 0.0), (-AWAY, 0.0), (0.0, AWAY), (0.0, -AWAY))
FACETS = 512
FLUX = 0.96
LENS = {
    "name": "lens",
    "shape": {
        "kind": "lens",
        "radius": 40,
        "thickness": 20,
        "front": {"radius_of_curvature": 200},
        "back": {"radius_of_curvature": -60, "conic": -0.5},
    },
    "medium": "PMMA",
    "at": [0, 0, 10],
}
"""What stands before a light field and before patches."""


def cavity(walls: list[dict[str, Any]]) -> et.Scene:
    holes = [
        {"name": f"hole {i}", "shape": {"kind": "disk", "radius": HOLE}, "at": [x, y, 5e-4], "finish": "absorber"}
        for i, (x, y) in enumerate(HOLES)
    ]
    spot = {"kind": "disk", "radius": HOLE}
    lamps = [{"kind": "surface", "shape": spot, "flux": FLUX, "at": [x, y, 1e-3]} for x, y in HOLES]
    white = {"kind": "lambertian", "reflectance": REFLECTANCE}
    return et.Scene(sources=lamps, finishes={"white": white}, surfaces=[*walls, *holes])


def analytic() -> et.Scene:
    wall = {"name": "wall", "shape": {"kind": "cylinder", "radius": RADIUS, "height": HEIGHT}, "finish": "white"}
    base = {"name": "base", "shape": {"kind": "disk", "radius": RADIUS}, "finish": "white"}
    return cavity([wall, base])


def mesh() -> tuple[Array, Array]:
    """The wall in 12 rows, the base in 11 rings and a fan: vertices and 24 064 triangles."""
    turn = 2 * np.pi * np.arange(FACETS) / FACETS
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rows, rings = 12, 12
    levels = [np.column_stack([RADIUS * ring, np.full(FACETS, HEIGHT * k / rows)]) for k in range(rows, -1, -1)]
    levels += [np.column_stack([RADIUS * k / rings * ring, np.zeros(FACETS)]) for k in range(rings - 1, 0, -1)]
    vertices = np.concatenate([*levels, np.zeros((1, 3))])
    a = np.arange(FACETS)
    b = (a + 1) % FACETS
    triangles = []
    for k in range(len(levels) - 1):
        low, high = k * FACETS, (k + 1) * FACETS
        triangles += [np.stack([low + a, low + b, high + a], 1), np.stack([high + a, low + b, high + b], 1)]
    last = (len(levels) - 1) * FACETS
    triangles.append(np.stack([last + a, last + b, np.full(FACETS, len(vertices) - 1)], 1))
    return vertices, np.concatenate(triangles).astype(np.uint32)


def lattice(count: int) -> tuple[Any, float]:
    """Places of solids in a box of side 100 above a lamp, and their pitch."""
    side = math.ceil(count ** (1 / 3))
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)
    chosen = grid[np.random.default_rng(count).permutation(len(grid))[:count]]
    return (chosen + 0.5) * (100 / side) - [50, 50, -10], 100 / side


def glass(shape: dict[str, Any], places: Any) -> _core.Scene:
    """Equal solids above a Lambertian disk."""
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 40}, "flux": 1}
    things = [
        {"name": f"s{i}", "shape": shape, "medium": "PMMA", "at": list(at)} for i, at in enumerate(places.tolist())
    ]
    return _core.Scene(compile_scene(et.Scene(sources=[lamp], solids=things)).record)
