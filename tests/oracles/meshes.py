"""Triangle meshes of known bodies: an octahedron divided and blown up, with corners on the body."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from etendue.scene.triangles import welded

from oracles.scenes import OCTAHEDRON, OCTANTS

Array = npt.NDArray[np.float64]


def divided_sphere(times: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """The unit sphere in 8 · 4ⁿ triangles."""
    vertices, triangles = np.array(OCTAHEDRON) / 2, np.array(OCTANTS)
    for _ in range(times):
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        middles = [(p + q) / np.linalg.norm(p + q, axis=1, keepdims=True) for p, q in ((a, b), (b, c), (c, a))]
        parts = [(a, middles[0], middles[2]), (b, middles[1], middles[0]), (c, middles[2], middles[1]), tuple(middles)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts]).reshape(-1, 3)
        vertices, triangles = welded(corners, np.arange(len(corners)).reshape(-1, 3))
    return vertices, triangles


def _ball(p: Array) -> Array:
    return 10.0 * p


def _lens(p: Array) -> Array:
    return p * [10.0, 10.0, 3.0]


def _pebble(p: Array) -> Array:
    x, y, z = p.T
    return p * (1 + 0.25 * x * y + 0.2 * z**3 + 0.15 * x)[:, None] * [10.0, 7.0, 5.0]


ROUND_BODIES: dict[str, Callable[[Array], Array]] = {"ball": _ball, "lens": _lens, "pebble": _pebble}
"""Where the points of the unit sphere go, in mm; all within 14 mm. The pebble has no symmetry."""


def smooth_mesh(body: str, times: int) -> dict[str, Any]:
    """A body of a scene, with interpolated normals all over."""
    vertices, triangles = divided_sphere(times)
    corners = ROUND_BODIES[body](vertices)
    return {"kind": "mesh", "vertices": corners.tolist(), "triangles": triangles.tolist(), "crease_angle": 180}
