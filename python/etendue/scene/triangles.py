"""Triangle meshes: welding, open edges, volume, smooth normals, and how far they are from the surfaces they stand for."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

MOST_PAIRS = 1 << 34
"""Pairs of triangles around one vertex, of all vertices together: a minute. Bodies have some twenty per triangle."""

PLANE = 3e-6
"""Normals in single precision that differ by less from that of a triangle are its own."""

DIGITS = 7
"""Of numbers in single precision, whose neighbours are 6·10⁻⁸ to 1.2·10⁻⁷ of them away."""

TEN_DIGITS = (1e-12, 1e12)
"""Sizes of numbers that have so many digits by exact powers of ten."""

SMALLEST_TURN = 0.05
"""[°] Neighbours that turn by less are one plane, as files in single precision store it."""

CURVED = 0.1
"""Of the area of a mesh: less is a fillet, which says little of what the body does to light."""


def welded(vertices: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """The same triangles over vertices of which no two coincide; triangles without an area are left out.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm]
    triangles : array of int, shape (m, 3)
        Numbers of vertices, counter-clockwise seen from outside.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> kept, faces = welded(corners, np.arange(6).reshape(2, 3))
    >>> len(kept), faces.tolist()
    (4, [[0, 2, 1], [2, 3, 1]])
    """
    kept, corners = _core.weld_mesh(_points(vertices), _corners(triangles))
    return vertices[kept], corners.astype(np.int64)


def as_written(numbers: Array) -> Array:
    """Numbers of single precision as they were before they were stored: those that seven digits tell, by these digits.

    A face at 3.1 mm is at 3.0999999 mm in a file of single precision, and does not coincide with one at 3.1 mm any more: a
    film of air between both reflects what two touching bodies let pass.

    Parameters
    ----------
    numbers : array
        Those that single precision does not hold, and those that seven digits do not tell, stay what they are.

    Examples
    --------
    >>> as_written(np.array([np.float32(3.1), np.float32(np.pi), 3.1000001, 0.0])).tolist()
    [3.1, 3.1415927410125732, 3.1000001, 0.0]
    """
    size = np.abs(numbers)
    with np.errstate(over="ignore"):  # what single precision does not hold becomes infinite, and is not equal
        # Beyond these limits powers of ten are no exact doubles.
        stored = (size > TEN_DIGITS[0]) & (size < TEN_DIGITS[1]) & (numbers.astype(np.float32) == numbers)
    size = np.where(stored, size, 1.0)
    powers = 10.0 ** (DIGITS - 1.0 - np.floor(np.log10(size)))
    digits = np.copysign(np.rint(size * powers), numbers)
    rounded = np.where(powers >= 1.0, digits / powers, digits * np.rint(1.0 / powers))
    found: Array = np.where(stored & (rounded.astype(np.float32) == numbers), rounded, numbers)
    return found


def directed_areas(vertices: Array, triangles: Triangles) -> tuple[Array, Array]:
    """Twice the area of each triangle times its normal [mm²], and its first corner [mm], both of shape (m, 3).

    Examples
    --------
    >>> directed_areas(np.eye(3), np.array([[0, 1, 2]]))[0].tolist()
    [[1.0, 1.0, 1.0]]
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a), a


def volume(vertices: Array, triangles: Triangles) -> float:
    """Volume within a closed mesh [mm³]; negative if its triangles run clockwise seen from outside.

    By the divergence theorem, ∮ x·n dA / 3, from the middle of the mesh so that a far-off body loses no digits.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> round(6 * volume(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])), 12)
    1.0
    """
    doubled, corner = directed_areas(vertices, triangles)
    return float(np.einsum("ij,ij->", doubled, corner - vertices.mean(axis=0)) / 6.0)


def open_edges(triangles: Triangles) -> Triangles:
    """Edges that are not shared by two triangles with opposite senses, shape (k, 2).

    Examples
    --------
    >>> open_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
    [[0, 1], [0, 2], [1, 3], [2, 3]]
    """
    return _core.open_edges(_corners(triangles)).astype(np.int64)


def smooth_normals(vertices: Array, triangles: Triangles, crease_angle: float) -> tuple[Array, Triangles, Array]:
    """Normals at the corners: the mean over the neighbours whose normals differ by less than a crease.

    A corner's normal is the mean of the normals of the triangles around its vertex, weighted by their angles there
    [ThuermerWuethrich1998]_, over those within `crease_angle` of the corner's own triangle. A vertex on a crease becomes
    several in one place.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm], no two alike.
    triangles : array of int, shape (m, 3)
        None without an area.
    crease_angle : float
        [°]

    Returns
    -------
    vertices, triangles, normals
        With one unit normal for each vertex.

    Raises
    ------
    ArgumentError
        If so many triangles meet at one vertex that comparing them would take hours.

    Examples
    --------
    >>> roof = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0.1], [-1, 0, 0.1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3]])
    >>> len(smooth_normals(roof, faces, 30)[0]), len(smooth_normals(roof, faces, 5)[0])
    (4, 6)
    """
    valences = np.bincount(triangles.reshape(-1))
    pairs = int((valences.astype(np.float64) ** 2).sum())
    if pairs > MOST_PAIRS:
        raise ArgumentError(
            f"up to {valences.max():,} triangles of the mesh meet at one vertex: {pairs:,} pairs of them would have to be "
            f"compared for smooth normals, and {MOST_PAIRS:,} are allowed. Export the body anew, or leave crease_angle out."
        )
    least = float(np.cos(np.radians(crease_angle)))
    vertex, split, normals = _core.smooth_normals(_points(vertices), _corners(triangles), least)
    return vertices[vertex], split.astype(np.int64), normals


def smooth_where_round(vertices: Array, triangles: Triangles, normals: Array) -> Array | None:
    """Unit normals at the vertices, exactly those of the triangles where these are plane; None if all are.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm]
    triangles : array of int, shape (m, 3)
        Those of plane and of curved faces have no vertex in common.
    normals : array, shape (n, 3)
        At the vertices, in single precision; a normal that is none becomes that of a triangle.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> smooth_where_round(corners, np.array([[0, 1, 2]]), np.array([[0, 0, 1.0]] * 3)) is None
    True
    """
    doubled, _ = directed_areas(vertices, triangles)
    length = np.linalg.norm(doubled, axis=1, keepdims=True)
    real = length[:, 0] > 0.0
    flat = np.divide(doubled, length, out=np.zeros_like(doubled), where=length > 0.0)
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    found: Array = np.divide(normals, size, out=np.zeros_like(normals), where=size > 0.5)
    turned = np.linalg.norm(found[triangles] - flat[:, None], axis=2)
    plane = real & (turned < PLANE).all(axis=1)
    if (plane | ~real).all():
        return None
    none = (size[:, 0] <= 0.5) | ~np.isfinite(size[:, 0])
    for corner in range(3):
        at = triangles[:, corner]
        taken = real & (plane | none[at])
        found[at[taken]] = flat[taken]
    return found


def chord_error(vertices: Array, triangles: Triangles, normals: Array) -> float:
    """Largest distance between triangles and the surface whose normals they have at their corners.

    Exact but for terms of fourth order in the size of the triangles, if the surface is quadratic along each side.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm]
    triangles : array of int, shape (m, 3)
        Numbers of vertices.
    normals : array, shape (n, 3)
        Unit vectors.

    Returns
    -------
    float
        [mm]

    Examples
    --------
    Half a side of the octagon in a circle of radius 1 is 1 - cos 22.5° = 0.076 inside of it:

    >>> angle = np.radians([0.0, 45.0, 22.5])
    >>> ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> round(chord_error(ring, np.array([[0, 1, 1]]), ring), 3)
    0.073
    """
    return _core.chord_error(_points(vertices), _points(normals), _corners(triangles))


def facet_angle(vertices: Array, triangles: Triangles, crease_angle: float) -> float:
    """By how much neighbours of a curved surface turn from each other [°]: the median over its area.

    Of the edges between two triangles those count that turn by more than `SMALLEST_TURN` and less than `crease_angle`; 0 if
    less than `CURVED` of the area has such an edge.

    Examples
    --------
    >>> roof = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0.1], [-1, 0, 0.1]])
    >>> round(facet_angle(roof, np.array([[0, 2, 1], [0, 1, 3]]), 30), 1)
    11.4
    """
    limits = SMALLEST_TURN / 360.0, crease_angle / 360.0
    area, turns = _core.mesh_facets(_points(vertices), _corners(triangles), limits)
    largest = 360.0 * turns
    if area[largest > 0.0].sum() < CURVED * area.sum():
        return 0.0
    curved = np.flatnonzero(largest > 0.0)
    curved = curved[np.argsort(largest[curved])]
    sums = np.cumsum(area[curved])
    return float(largest[curved[np.searchsorted(sums, sums[-1] / 2.0)]])


def _points(places: Array) -> Array:
    """Places, or normals, as the core takes them."""
    return np.ascontiguousarray(places, dtype=np.float64)


def _corners(triangles: Triangles) -> npt.NDArray[np.uint32]:
    """Numbers of vertices as the core takes them."""
    return np.ascontiguousarray(triangles, dtype=np.uint32)
