"""The cone estimator, ray by ray, from the definitions of observer and screen alone."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.quantities.ray_stream import RayBatch


def plain_statement(
    rays: et.RaySet | RayBatch, observer: et.Observer, screen: et.Screen, acceptance: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Luminance, standard error (0 where dead) and number of rays by eqs. 2.2 to 2.4, each of shape (rows, columns)."""
    theta, phi = np.radians([observer.theta, observer.phi])
    o = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    if screen.plane == "view":
        axis = np.array([-np.sin(phi), np.cos(phi), 0.0])
        right, up = (
            e * np.cos(theta) + np.cross(axis, e) * np.sin(theta) + axis * (axis @ e) * (1 - np.cos(theta))
            for e in (np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
        )
    else:
        right, up = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    n = np.cross(right, up)
    target = np.array(observer.target)
    x, k, w = rays.position, rays.direction, rays.flux
    t = ((target - x) @ n) / (k @ n)
    hit = x + t[:, None] * k - target
    column = np.floor((hit @ right / screen.width + 0.5) * screen.columns)
    row = np.floor((0.5 - hit @ up / screen.height) * screen.rows)
    inside = (column >= 0) & (column < screen.columns) & (row >= 0) & (row < screen.rows)
    column, row, k, w = column[inside].astype(int), row[inside].astype(int), k[inside], w[inside]
    centre_x = ((column + 0.5) / screen.columns - 0.5) * screen.width
    centre_y = (0.5 - (row + 0.5) / screen.rows) * screen.height
    s = observer.distance * o - centre_x[:, None] * right - centre_y[:, None] * up
    s /= np.linalg.norm(s, axis=1)[:, None]
    angle = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", s, k), -1, 1)))
    seen = angle < acceptance
    etendue = (
        2 * np.pi * (1 - np.cos(np.radians(acceptance)))
        * (screen.width * screen.height / screen.columns / screen.rows * 1e-6) * np.abs(s @ n)
    )  # fmt: skip
    luminance, variance = np.zeros(screen.shape), np.zeros(screen.shape)
    count = np.zeros(screen.shape, dtype=np.int64)
    at = (row[seen], column[seen])
    np.add.at(luminance, at, w[seen] / etendue[seen])
    np.add.at(variance, at, (w[seen] / etendue[seen]) ** 2)
    np.add.at(count, at, 1)
    return luminance, np.sqrt(variance), count
