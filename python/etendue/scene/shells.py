"""Closed meshes of several shells: which lies within which, and which are inside out."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.scene.triangles import directed_areas

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

MOST_SHELLS = 1 << 13
"""Each is compared with each; of a mesh of more, the volume of the whole decides for all."""

MOST_ANGLES = 1 << 28
"""Solid angles of triangles that are worked out to tell what lies within what: some ten seconds."""


class Senses(NamedTuple):
    """What is inside out in a closed mesh.

    Parameters
    ----------
    inward : array of bool, shape (m,)
        The triangles whose normals lead into the body.
    twice : array, shape (3,), or None
        A point of a shell that runs the same way as the one around it [mm]: what is within is inside twice.

    Examples
    --------
    >>> Senses(np.array([True]), None).inward.all()
    np.True_
    """

    inward: npt.NDArray[np.bool_]
    twice: Array | None


def senses(vertices: Array, triangles: Triangles) -> Senses:
    """Which triangles of a closed mesh run clockwise seen from outside, shell by shell.

    A shell that lies in no other one is the outside of a body: its volume tells whether it is inside out. One that lies in
    another is a cavity of it, or a body in a cavity, if it runs the other way, and is turned if that one is.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm], no two alike.
    triangles : array of int, shape (m, 3)
        Each edge is shared by two with opposite senses.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> senses(np.concatenate([corners, corners + 5]), np.concatenate([faces, faces[:, ::-1] + 4])).inward.tolist()
    [False, False, False, False, True, True, True, True]
    """
    shell = _core.mesh_shells(np.ascontiguousarray(triangles, dtype=np.uint32)).astype(np.intp)
    doubled, corner = directed_areas(vertices, triangles)
    volumes = np.bincount(shell, np.einsum("ij,ij->i", doubled, corner - vertices.mean(axis=0)))
    around = _around(vertices, triangles, shell, doubled) if 1 < len(volumes) <= MOST_SHELLS else None
    if around is None:
        return Senses(np.full(len(triangles), volumes.sum() < 0.0), None)
    inward, twice = volumes < 0.0, None
    # A shell is smaller than the one around it, which is so decided before.
    for k in np.argsort(-np.abs(volumes), kind="stable"):
        outer = around[k]
        if outer < 0:
            continue
        if twice is None and (volumes[k] < 0.0) == (volumes[outer] < 0.0):
            twice = vertices[triangles[shell == k][0, 0]]
        inward[k] = inward[outer]
    return Senses(inward[shell], twice)


def _around(
    vertices: Array, triangles: Triangles, shell: npt.NDArray[np.intp], doubled: Array
) -> npt.NDArray[np.intp] | None:
    """The smallest shell that each lies in, -1 if in none; None if it takes too long to tell."""
    order = np.argsort(shell, kind="stable")
    starts = np.searchsorted(shell[order], np.arange(shell.max() + 2))
    corners = vertices[triangles[order]]
    low = np.minimum.reduceat(corners.min(axis=1), starts[:-1])
    high = np.maximum.reduceat(corners.max(axis=1), starts[:-1])
    area = np.linalg.norm(doubled, axis=1)[order]
    size, found, worked = np.prod(high - low, axis=1), np.full(len(low), -1), 0
    for k in range(len(low)):
        boxes = np.flatnonzero((low <= low[k]).all(axis=1) & (high >= high[k]).all(axis=1))
        boxes = boxes[boxes != k]
        worked += int((starts[boxes + 1] - starts[boxes]).sum())
        if worked > MOST_ANGLES:
            return None
        # The middle of a large triangle: corners may lie on the other shell.
        point = corners[starts[k] + area[starts[k] : starts[k + 1]].argmax()].mean(axis=0)
        for j in boxes[np.argsort(size[boxes])]:
            if _within(point, corners[starts[j] : starts[j + 1]]):
                found[k] = j
                break
    return found


def _within(point: Array, corners: Array) -> bool:
    """Whether a closed shell is around a point: its triangles are seen under ±4π from there, and under 0 from outside.

    The solid angle of a triangle by tan(Ω/2) = a·(b × c)/(abc + (a·b) c + (b·c) a + (c·a) b) [VanOosteromStrackee1983].
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    over = np.einsum("ij,ij->i", a, np.cross(b, c))
    under = x * y * z + (a * b).sum(axis=1) * z + (b * c).sum(axis=1) * x + (c * a).sum(axis=1) * y
    return bool(abs(2.0 * np.arctan2(over, under).sum()) > 2.0 * math.pi)
