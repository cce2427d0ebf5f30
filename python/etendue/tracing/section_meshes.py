"""Meshes cut by a plane, triangle by triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.tracing.section import Section
from etendue.tracing.section_chains import chains

Array = npt.NDArray[np.float64]


def mesh_curves(shape: dict[str, Any], origin: Array, axes: Array, section: Section) -> list[Array]:
    """The curves in which a section cuts a mesh.

    A corner that lies in the section counts as lying below it, everywhere: so the curves of a closed mesh are closed.

    Parameters
    ----------
    shape : mapping
        ``vertices`` (n, 3) and ``triangles`` (m, 3).
    origin, axes : arrays, shapes (3,) and (3, 3)
        Where the mesh stands; the rows are the images of its x, y and z.
    section : Section
        The plane.

    Returns
    -------
    list of arrays, each of shape (k, 2)

    Examples
    --------
    >>> from etendue.tracing.section import Section
    >>> kite = {"vertices": [[0, -1, 0], [1, 1, 0], [0, 1, 1]], "triangles": [[0, 1, 2]]}
    >>> [c.tolist() for c in mesh_curves(kite, np.zeros(3), np.eye(3), Section("y", 0.0))]
    [[[0.5, 0.0], [0.0, 0.5]]]
    """
    corners = np.asarray(shape["vertices"], dtype=np.float64) @ axes + origin
    triangles = np.asarray(shape["triangles"], dtype=np.int64)
    depth = section.depth(corners)
    above = depth[triangles] > 0.0
    cut = triangles[above.any(axis=1) & ~above.all(axis=1)]
    if not len(cut):
        return []
    # Two sides of each triangle are cut; they are told by the numbers of their ends, which neighbours share.
    sides = np.sort(np.stack([cut, np.roll(cut, -1, axis=1)], axis=2), axis=2)
    crossed = (depth[sides[..., 0]] > 0.0) != (depth[sides[..., 1]] > 0.0)
    ends, number = np.unique(sides[crossed], axis=0, return_inverse=True)
    links = number.reshape(-1, 2)
    a, b = depth[ends[:, 0]], depth[ends[:, 1]]
    flat = section.flat(corners)
    points = (b[:, None] * flat[ends[:, 0]] - a[:, None] * flat[ends[:, 1]]) / (b - a)[:, None]
    curves = [points[chain] for chain in chains(len(points), links)]
    return [curve for curve in map(_without_repeats, curves) if len(curve) > 1]


def _without_repeats(curve: Array) -> Array:
    moved = np.append(True, (np.diff(curve, axis=0) != 0.0).any(axis=1))
    distinct: Array = curve[moved]
    return distinct
