"""A map from a table of 32⁴ cells in numba, for `run_all.py`: quadrilinear, on all cores, without errors of the pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import etendue as et
import numba
import numpy as np
from light_field_speed import LATTICE, SAMPLES

Array = Any


@numba.njit(parallel=True, fastmath=True)
def _look(table: Array, points: Array, eye: Array, centre: Array, size: Array, z: float, out: Array) -> None:
    n = table.shape[0]
    for i in numba.prange(points.shape[0]):
        total = 0.0
        for j in range(points.shape[1]):
            dx, dy, dz = eye[0] - points[i, j, 0], eye[1] - points[i, j, 1], eye[2] - points[i, j, 2]
            inverse = 1 / np.sqrt(dx * dx + dy * dy + dz * dz)
            dx, dy, dz = dx * inverse, dy * inverse, dz * inverse
            t = (z - points[i, j, 2]) / dz
            u = (points[i, j, 0] + t * dx - centre[0]) / size[0] + 0.5
            v = (points[i, j, 1] + t * dy - centre[1]) / size[1] + 0.5
            if u < 0 or u > 1 or v < 0 or v > 1:
                continue
            wide = abs(dx) > abs(dy)
            along, across = (dx, dy) if wide else (dy, dx)
            r = np.copysign(np.sqrt(dx * dx + dy * dy), along)
            other = r * np.arctan(across / (along if along != 0 else 1.0)) * (4 / np.pi)
            a, b = ((r if wide else other) / 2 + 0.5, (other if wide else r) / 2 + 0.5)
            c0, c1, c2, c3 = u * n - 0.5, v * n - 0.5, a * n - 0.5, b * n - 0.5
            k0, k1, k2, k3 = int(np.floor(c0)), int(np.floor(c1)), int(np.floor(c2)), int(np.floor(c3))
            for corner in range(16):
                b0, b1, b2, b3 = corner & 1, (corner >> 1) & 1, (corner >> 2) & 1, (corner >> 3) & 1
                weight = (c0 - k0 if b0 else 1 - c0 + k0) * (c1 - k1 if b1 else 1 - c1 + k1)
                weight *= (c2 - k2 if b2 else 1 - c2 + k2) * (c3 - k3 if b3 else 1 - c3 + k3)
                place = min(max(k0 + b0, 0), n - 1), min(max(k1 + b1, 0), n - 1)
                total += weight * table[place[0], place[1], min(max(k2 + b2, 0), n - 1), min(max(k3 + b3, 0), n - 1)]
        out[i] = total / points.shape[1]


def look_at_plane(plane: et.Plane, observer: et.Observer, screen: et.Screen) -> Callable[[], Array]:
    """The map of some table on a plane; compiled by the time this returns."""
    right, up, _ = screen.axes(observer)
    columns, rows = np.meshgrid(np.arange(screen.columns), np.arange(screen.rows))
    u = ((columns[..., None] + LATTICE[:, 0]) / screen.columns - 0.5) * screen.width
    v = (0.5 - (rows[..., None] + LATTICE[:, 1]) / screen.rows) * screen.height
    points = np.asarray(observer.target) + u[..., None] * right + v[..., None] * up
    points = np.ascontiguousarray(points.reshape(-1, SAMPLES, 3))
    table = np.random.default_rng(1).random((32,) * 4)
    (part,) = plane.parts()
    eye, out = np.asarray(observer.position, float), np.zeros(len(points))
    centre, size = np.asarray(part.centre, float), np.asarray(part.size, float)

    def look() -> Array:
        _look(table, points, eye, centre, size, float(plane.z), out)
        return out

    look()
    return look
