"""OBJ files as triangles: vertices by number from either end, and polygons with reentrant corners."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

MOST_CORNERS = 10_000
"""Of a polygon with a reentrant corner, which takes a time that grows with the square of them."""

THIN = 1e-5
"""Width over length of a polygon that may have none, in the six or seven digits that files have."""

MOST_VERTICES = 1 << 62
"""Larger numbers of vertices fit no array."""

_CONTINUED = re.compile(r"\\\s*$")


def read_obj(path: Path, raw: bytes) -> tuple[Array, Triangles]:
    r"""Vertices, in the unit of the file, and triangles, by numbers of vertices.

    Convex polygons become fans, others are cut along diagonals that lie in them. Lines, points, colours, textures and
    normals are left out.

    Raises
    ------
    FormatError
        If a vertex or a face is none, or a polygon crosses itself.

    Examples
    --------
    >>> vertices, triangles = read_obj(Path("arrow.obj"), b"v 0 0 0\nv 2 -1 0\nv 1 0 0\nv 2 1 0\nf -4 -3 -2 -1\n")
    >>> len(vertices), triangles.tolist()
    (4, [[0, 1, 2], [0, 2, 3]])
    """
    vertices, polygons, lines = _rows(path, raw)
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    parts = [np.zeros((0, 3), dtype=np.int64)]
    for size in sorted(polygons):
        faces = np.array(polygons.pop(size), dtype=np.int64)
        wrong = np.flatnonzero(((faces < 0) | (faces >= len(points))).any(axis=1))
        if wrong.size:
            place = f"line {lines[size][wrong[0]]}"
            raise FormatError(path, place, "a face names a vertex that is not there", "The file is damaged.")
        parts += _triangles(path, points, faces, lines[size])
    return points, np.concatenate(parts)


def _rows(
    path: Path, raw: bytes
) -> tuple[list[tuple[float, float, float]], dict[int, list[list[int]]], dict[int, list[int]]]:
    """Vertices; polygons by how many corners they have, and the line of each."""
    vertices: list[tuple[float, float, float]] = []
    polygons: dict[int, list[list[int]]] = {}
    lines: dict[int, list[int]] = {}
    before = ""
    for number, text in enumerate(io.TextIOWrapper(io.BytesIO(raw), "utf-8-sig", "replace"), 1):
        line = before + text.partition("#")[0]
        continued = _CONTINUED.search(line)
        if continued:
            before = line[: continued.start()] + " "
            continue
        before = ""
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(_point(path, number, words))
        elif words[:1] == ["f"]:
            corners = _corners(path, number, words, len(vertices))
            polygons.setdefault(len(corners), []).append(corners)
            lines.setdefault(len(corners), []).append(number)
    return vertices, polygons, lines


def _point(path: Path, number: int, words: list[str]) -> tuple[float, float, float]:
    try:
        x, y, z = (float(word) for word in words[1:4])
    except ValueError:
        raise FormatError(
            path, f"line {number}", f"{' '.join(words)[:60]!r} is no vertex", "The file is damaged."
        ) from None
    return x, y, z


def _corners(path: Path, number: int, words: list[str], known: int) -> list[int]:
    """Numbers of vertices from 0; those below 0 count back from the last one that stands before."""
    try:
        named = [int(word.partition("/")[0]) for word in words[1:]]
    except ValueError:
        named = []
    if len(named) < 3 or 0 in named:
        raise FormatError(path, f"line {number}", f"{' '.join(words)[:60]!r} is no face", "The file is damaged.")
    if max(map(abs, named)) > MOST_VERTICES:
        raise FormatError(path, f"line {number}", "a face names a vertex that is not there", "The file is damaged.")
    return [i - 1 if i > 0 else known + i for i in named]


def _triangles(path: Path, points: Array, faces: Triangles, lines: list[int]) -> list[Triangles]:
    """Polygons of equally many corners as triangles."""
    if faces.shape[1] == 3:
        return [faces]
    corner = points[faces]
    corner -= corner[:, :1]
    areas = np.cross(corner[:, 1:-1], corner[:, 2:])  # of the triangles of a fan, twice, times their normals
    normal = areas.sum(axis=1)
    convex = (np.einsum("ijk,ik->ij", areas, normal) >= 0.0).all(axis=1)
    del areas  # large, of one large polygon
    side = np.diff(corner, axis=1, append=corner[:, :1])
    convex &= (np.einsum("ijk,ik->ij", np.cross(np.roll(side, 1, axis=1), side), normal) > 0.0).all(axis=1)
    fans = faces[convex]
    first = np.broadcast_to(fans[:, :1], fans[:, 2:].shape)
    found = [np.stack([first, fans[:, 1:-1], fans[:, 2:]], axis=2).reshape(-1, 3)]
    for k in np.flatnonzero(~convex):
        flat = np.delete(corner[k], np.abs(normal[k]).argmax(), axis=1)
        found.append(faces[k][_cut(path, flat, lines[k])])
    return found


def _cut(path: Path, flat: Array, line: int) -> Triangles:
    """A plane polygon (n, 2) as triangles: ears are cut off, corners that turn its way with no other corner within."""
    if len(flat) > MOST_CORNERS:
        found = f"a polygon with a reentrant corner, of {len(flat):,} corners"
        raise FormatError(path, f"line {line}", found, "Export triangles instead of polygons.")
    sense = np.sign(_turn(flat, np.roll(flat, -1, axis=0), np.zeros(2)).sum())
    left, cut = list(range(len(flat))), []
    at, passed = 0, 0
    while len(left) > 2:
        n = len(left)
        a, b, c = (left[(at + i) % n] for i in range(3))
        if _is_ear(flat, left, (a, b, c), sense):
            cut.append((a, b, c))
            del left[(at + 1) % n]
            at, passed = at % (n - 1), 0
            continue
        at, passed = (at + 1) % n, passed + 1
        if passed > n:
            if _is_thin(flat[left]):
                cut += [(left[0], left[i], left[i + 1]) for i in range(1, n - 1)]
                break
            raise FormatError(path, f"line {line}", "a polygon crosses itself", "Export triangles instead of polygons.")
    return np.array(cut, dtype=np.int64).reshape(-1, 3)


def _is_thin(rest: Array) -> bool:
    """Whether corners are on one line, but for what single precision makes of it."""
    away = rest - rest[0]
    far = away[np.einsum("ij,ij->i", away, away).argmax()]
    return bool(np.abs(_turn(np.zeros(2), far, away)).max() <= THIN * (far @ far))


def _turn(a: Array, b: Array, c: Array) -> Array:
    """Twice the area of triangles, above 0 if they run counter-clockwise."""
    ab, ac = b - a, c - a
    return np.asarray(ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0])


def _is_ear(flat: Array, left: list[int], corners: tuple[int, int, int], sense: float) -> bool:
    """Whether a corner can be cut off: no other corner lies in its triangle, but for those in the place of its own."""
    a, b, c = (flat[i] for i in corners)
    if not sense * _turn(a, b, c) > 0.0:
        return False
    p = flat[left]
    inside = np.minimum(np.minimum(sense * _turn(a, b, p), sense * _turn(b, c, p)), sense * _turn(c, a, p)) >= 0.0
    own = (p == a).all(axis=1) | (p == b).all(axis=1) | (p == c).all(axis=1)
    return not (inside & ~own).any()
