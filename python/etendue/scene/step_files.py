"""STEP files: their bodies by name, as triangles with the normals of the true surfaces, by Open CASCADE."""

from __future__ import annotations

import dataclasses
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import FormatError, UnknownNameError
from etendue.scene.open_cascade import OpenCascade
from etendue.scene.triangles import as_written, chord_error, open_edges, smooth_where_round, volume, welded
from etendue.units import MM_PER_LENGTH_UNIT

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

SHARE = 5e-4
"""Distance between a surface and its triangles that is asked for, as a part of the longest side of the box around the body:
unless a tolerance is given."""

TURN = 0.05
"""[rad] By which the normal may turn along a triangle, unless a tolerance is asked for: 126 sides to a full circle."""

COARSE_TURN = 0.5
"""[rad] Likewise, where the tolerance is asked for and alone says how fine the triangles are."""

MOST_TRIANGLES = 1 << 23
"""Of all bodies of a file."""

FIRST_LOOK = 0.1
"""Of a first look, which tells bodies and sizes: distance between a surface and its triangles as a part of each edge. One
length for the whole file would leave nothing of round faces of splines that are smaller than it."""


@dataclasses.dataclass(frozen=True, eq=False)
class StepBody:
    """One body of a STEP file.

    Parameters
    ----------
    name : str
        Unique in the file.
    vertices : array, shape (n, 3)
        [mm] Where faces meet a vertex is there once for each.
    triangles : array of int, shape (m, 3)
        Counter-clockwise seen from outside.
    normals : array, shape (n, 3), or None
        Of the true surface at each vertex; None if all faces are plane.
    chord_error : float
        Largest distance between the triangles and the true surfaces [mm], from the normals at the corners.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> body = StepBody("gem", corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), None, 0.0)
    >>> body.size.tolist(), round(6 * body.volume, 12), body.closed
    ([1.0, 1.0, 1.0], 1.0, True)
    """

    name: str
    vertices: Array
    triangles: Triangles
    normals: Array | None
    chord_error: float

    @property
    def size(self) -> Array:
        """Sides of the box around it [mm]."""
        sides: Array = np.ptp(self.vertices, axis=0)
        return sides

    @property
    def volume(self) -> float:
        """[mm³], if it is closed."""
        return volume(self.vertices, self.triangles)

    @property
    def closed(self) -> bool:
        """Whether every edge belongs to two triangles."""
        return not len(open_edges(welded(self.vertices, self.triangles)[1]))


def read_step(path: Path, raw: bytes, tolerance: float | None, name: str | None = None) -> list[StepBody]:
    """The bodies of a STEP file, in its order, or the one of a name.

    Parameters
    ----------
    path : Path
        For messages.
    raw : bytes
        What the file holds.
    tolerance : float, optional
        Distance between surfaces and triangles [mm] that is asked for; the reader may exceed it here and there, and
        `StepBody.chord_error` tells what came out. None: `SHARE` of the size of the smallest body that is asked
        for, and triangles along which normals turn by less than `TURN`.
    name : str, optional
        Of the body that is asked for; None: all.

    Raises
    ------
    MissingLibraryError
        If the library is not installed.
    FormatError
        If the file is damaged, so that Open CASCADE cannot read it or crashes, or has no body of that name, or the
        tolerance asks for more than `MOST_TRIANGLES`.

    Examples
    --------
    >>> from etendue.errors import FormatError
    >>> try:
    ...     bodies = read_step(Path("cut.step"), b"ISO-10303-21;HEADER;", tolerance=None)
    ... except FormatError as error:
    ...     print(str(error)[:8])
    cut.step
    """
    names = _Names(raw.decode("latin-1"))
    with OpenCascade(path, raw) as reader:
        return _read(path, reader, names, tolerance, name)


def _read(path: Path, reader: OpenCascade, names: _Names, tolerance: float | None, name: str | None) -> list[StepBody]:
    first = _bodies(path, reader.triangles(FIRST_LOOK, COARSE_TURN, relative=True), names)
    if name is not None and name not in [body.name for body in first]:
        wrong, told = f"unknown body {name!r}", str(UnknownNameError("body", name, [body.name for body in first]))
        raise FormatError(path, "body", wrong, told.removeprefix(f"{wrong}. "))
    wanted = [body for body in first if name in (None, body.name)]
    turn = TURN if tolerance is None else COARSE_TURN
    smallest = min(float(body.size.max()) for body in wanted)
    tolerance = min(FIRST_LOOK * smallest, SHARE * smallest if tolerance is None else tolerance)
    # Chord errors go with the area of triangles.
    needed = sum(len(body.triangles) * max(1.0, body.chord_error / tolerance) for body in first)
    if needed > MOST_TRIANGLES:
        raise FormatError(
            path,
            "tolerance",
            f"{tolerance:.3g} mm would take about {needed:.2g} triangles, and {MOST_TRIANGLES:,} is the most",
            "Give a larger 'tolerance'.",
        )
    found = _bodies(path, reader.triangles(tolerance, turn), names)
    if [body.name for body in found] != [body.name for body in first]:
        text = "its faces do not close in the same way when its triangles are finer"
        raise FormatError(path, "bodies", text, "Repair the bodies where they were drawn, and export them anew.")
    return [body for body in found if name in (None, body.name)]


# --- what the library gives: binary glTF -----------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True, eq=False)
class _Part:
    """One product where it stands: corners and normals as stored, triangles, and the face that each belongs to."""

    name: str
    vertices: Array
    normals: Array
    triangles: Triangles
    faces: Triangles

    def of(self, faces: Triangles) -> _Part:
        """Some of its faces."""
        kept = np.isin(self.faces, faces)
        used, number = np.unique(self.triangles[kept], return_inverse=True)
        return _Part(self.name, self.vertices[used], self.normals[used], number.reshape(-1, 3), self.faces[kept])


_TYPES: dict[int, np.dtype[Any]] = {
    5121: np.dtype("u1"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4"), 5126: np.dtype("<f4")
}  # fmt: skip
"""Component types of glTF 2.0, section 3.6.2.2."""


class _Gltf:
    """A binary glTF file as the library writes it: positions, normals and face numbers of all parts."""

    def __init__(self, raw: bytes) -> None:
        length = int.from_bytes(raw[12:16], "little")
        self.tree: dict[str, Any] = json.loads(raw[20 : 20 + length])
        self.data = raw[20 + length + 8 :]

    def array(self, number: int) -> npt.NDArray[Any]:
        accessor = self.tree["accessors"][number]
        view = self.tree["bufferViews"][accessor["bufferView"]]
        width = 3 if accessor["type"] == "VEC3" else 1
        kind, start = _TYPES[accessor["componentType"]], view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        if view.get("byteStride", kind.itemsize * width) != kind.itemsize * width:
            raise ValueError("numbers that do not lie side by side")
        return np.frombuffer(self.data, kind, accessor["count"] * width, start).reshape(-1, width)

    def parts(self) -> Iterator[_Part]:
        """Every mesh at each place where it stands."""
        nodes = self.tree.get("nodes", [])
        scene = self.tree["scenes"][self.tree.get("scene", 0)]
        waiting = [(number, np.eye(4)) for number in reversed(scene.get("nodes", []))]
        while waiting:
            number, frame = waiting.pop()
            node = nodes[number]
            frame = frame @ _placed(node)
            if "mesh" in node:
                yield from self._part(self.tree["meshes"][node["mesh"]], node.get("name", ""), frame)
            waiting += [(child, frame) for child in reversed(node.get("children", []))]

    def _part(self, mesh: dict[str, Any], name: str, frame: Array) -> Iterator[_Part]:
        vertices, normals, triangles, faces = [], [], [], []
        corners = numbered = 0
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) != 4:
                continue
            extension = primitive["extensions"]["TM_brep_faces"]
            vertices.append(as_written(self.array(primitive["attributes"]["POSITION"]).astype(np.float64)))
            normals.append(self.array(primitive["attributes"]["NORMAL"]).astype(np.float64))
            triangles.append(self.array(primitive["indices"]).astype(np.int64).reshape(-1, 3) + corners)
            faces.append(self.array(extension["faceIndices"]).astype(np.int64).reshape(-1) + numbered)
            corners += len(vertices[-1])
            numbered = int(faces[-1].max(initial=-1)) + 1
        if triangles:
            turn = frame[:3, :3]
            placed = np.concatenate(vertices) @ turn.T + frame[:3, 3]
            yield _Part(
                mesh.get("name") or name,
                placed * MM_PER_LENGTH_UNIT["m"],
                np.concatenate(normals) @ turn.T,
                np.concatenate(triangles),
                np.concatenate(faces),
            )


def _placed(node: dict[str, Any]) -> Array:
    """The frame of a node of glTF in its parent's."""
    frame = np.eye(4)
    if "matrix" in node:
        frame = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    else:
        x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        frame[:3, :3] = turn * node.get("scale", (1.0, 1.0, 1.0))
        frame[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return frame


# --- bodies of a part ------------------------------------------------------------------------------------------------


def _bodies(path: Path, made: bytes, names: _Names) -> list[StepBody]:
    try:
        parts = list(_Gltf(made).parts())
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise FormatError(path, "STEP", f"cannot be read ({error!r})", "The file is damaged, or no mesh.") from None
    named = []
    for part in parts:
        split = [part.of(faces) for faces in _closed_runs(part)]
        inner = names.of_solids(part.name, len(split))
        named += list(zip(inner, split, strict=True))
    if not named:
        raise FormatError(path, "whole file", "there are no triangles", "Export the body as a triangle mesh.")
    unique = _numbered([name for name, _ in named])
    return [_body(name, part) for name, (_, part) in zip(unique, named, strict=True)]


def _body(name: str, part: _Part) -> StepBody:
    normals = smooth_where_round(part.vertices, part.triangles, part.normals)
    error = 0.0 if normals is None else chord_error(part.vertices, part.triangles, normals)
    return StepBody(name, part.vertices, part.triangles, normals, error)


def _numbered(names: list[str]) -> list[str]:
    """Names of which no two are alike."""
    count, taken, found = Counter(names), set(names), []
    for name in names:
        unique, number = name, 0
        while count[name] > 1 and (number == 0 or unique in taken):
            number += 1
            unique = f"{name} {number}"
        taken.add(unique)
        found.append(unique)
    return found


def _closed_runs(part: _Part) -> list[Triangles]:
    """Faces of each body of a part. Faces are numbered body after body: one ends where its surface closes.

    What touches another body may share its corners, so corners alone do not tell. Holes within a body are surfaces of
    their own, inside out.
    """
    _, corner = _core.weld(np.ascontiguousarray(part.vertices))
    triangles = corner.astype(np.int64)[part.triangles]
    component = _components(triangles)[triangles[:, 0]]
    # Faces by what hangs together, and there in their order.
    faces, first, place = np.unique(part.faces, return_index=True, return_inverse=True)
    order = np.lexsort((faces, component[first]))
    rank = np.argsort(order)[place.reshape(-1)]
    ends, is_open = _where_closed(triangles, rank, len(faces))
    inner = component[first][order]
    parted = inner[1:] != inner[:-1]
    # What does not close is one open body.
    whole = np.isin(inner, inner[is_open])
    cuts = np.flatnonzero(parted | (ends[:-1] & ~whole[:-1])) + 1
    pieces = sorted(np.split(faces[order], cuts), key=lambda piece: int(piece[0]))
    bodies: list[Triangles] = []
    for piece in pieces:
        surface = part.of(piece)
        if bodies and volume(surface.vertices, surface.triangles) < 0.0:
            bodies[-1] = np.concatenate([bodies[-1], piece])
        else:
            bodies.append(piece)
    return bodies


def _components(triangles: Triangles) -> Triangles:
    """For each corner the lowest number of those that it hangs together with by triangles."""
    label = np.arange(int(triangles.max(initial=-1)) + 1)
    while True:
        found = label.copy()
        np.minimum.at(found, triangles.reshape(-1), label[triangles].min(axis=1).repeat(3))
        found = found[found]
        if np.array_equal(found, label):
            return label
        label = found


def _where_closed(triangles: Triangles, rank: Triangles, faces: int) -> tuple[npt.NDArray[np.bool_], Triangles]:
    """Whether all edges have met their opposites after each face, by rank; and the ranks of faces with edges without any."""
    real = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, rank = triangles[real], rank[real]
    directed = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    owner, forward = np.tile(rank, 3), directed[:, 0] < directed[:, 1]
    edges = np.sort(directed, axis=1)
    order = np.lexsort((owner, edges[:, 1], edges[:, 0]))
    edges, owner, forward = edges[order], owner[order], forward[order]
    new = np.ones(len(edges), dtype=bool)
    new[1:] = (edges[1:] != edges[:-1]).any(axis=1)
    # The first and the second of an edge belong together, the third and the fourth, …
    start = np.flatnonzero(new)
    within = np.arange(len(edges)) - start[np.cumsum(new) - 1]
    one = np.flatnonzero(within % 2 == 0)
    other = np.minimum(one + 1, len(edges) - 1)
    paired = (other > one) & ~new[other] & (forward[one] != forward[other])
    depth = np.zeros(faces + 1, dtype=np.int64)
    np.add.at(depth, owner[one[paired]], 1)
    np.add.at(depth, owner[other[paired]], -1)
    return np.cumsum(depth)[:-1] == 0, np.unique(owner[one[~paired]])


# --- names -----------------------------------------------------------------------------------------------------------

_ENTITY = re.compile(r"#(\d+)\s*=\s*([A-Z0-9_]+)\s*\(((?:'(?:[^']|'')*'|[^;'])*)\)\s*;")
_STRING = re.compile(r"'((?:[^']|'')*)'")
_NUMBER = re.compile(r"#(\d+)")
_WIDE = re.compile(r"\\X2\\([0-9A-F]+)\\X0\\")
_SOLIDS = {"MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP"}
_KINDS = _SOLIDS | {
    "PRODUCT",
    "PRODUCT_DEFINITION",
    "PRODUCT_DEFINITION_SHAPE",
    "SHAPE_DEFINITION_REPRESENTATION",
    "SHAPE_REPRESENTATION",
    "SHAPE_REPRESENTATION_RELATIONSHIP",
    "ADVANCED_BREP_SHAPE_REPRESENTATION",
    "FACETED_BREP_SHAPE_REPRESENTATION",
}


class _Names:
    """Names of products and of the solids in them (ISO 10303-21, clause 7; ISO 10303-41 and -42)."""

    def __init__(self, text: str) -> None:
        entities = {
            int(number): (kind, rest)
            for number, kind, rest in _ENTITY.findall(text)
            if kind.startswith("PRODUCT_DEFINITION_FORMATION") or kind in _KINDS
        }

        def linked(number: int) -> list[int]:
            return [int(n) for n in _NUMBER.findall(_STRING.sub("", entities[number][1]))]

        def kind_of(number: int) -> str:
            return entities[number][0] if number in entities else ""

        relations = [linked(n) for n in entities if kind_of(n) == "SHAPE_REPRESENTATION_RELATIONSHIP"]
        self.solids: dict[str, list[list[str]]] = {}
        for number in entities:
            if kind_of(number) != "SHAPE_DEFINITION_REPRESENTATION":
                continue
            pair = linked(number)
            if len(pair) != 2:
                continue
            at, representation = pair
            # From the shape to its definition, formation and product.
            for _ in range(3):
                at = next((n for n in (linked(at) if at in entities else []) if kind_of(n).startswith("PRODUCT")), -1)
            if kind_of(at) != "PRODUCT":
                continue
            same = [
                representation,
                *(n for pair in relations if representation in pair for n in pair if n != representation),
            ]
            items = [n for r in same if r in entities for n in linked(r) if kind_of(n) in _SOLIDS]
            texts = _STRING.findall(entities[at][1])
            product = _plain(texts[1] if len(texts) > 1 and texts[1] else texts[0] if texts else "")
            self.solids.setdefault(product, []).append(
                [_plain(next(iter(_STRING.findall(entities[n][1])), "")) for n in items]
            )

    def of_solids(self, product: str, count: int) -> list[str]:
        """Names of the bodies of a part: the part's if there is one, else those of the solids, where they have some."""
        own = product or "body"
        if count == 1:
            return [own]
        for names in self.solids.get(product, []):
            if len(names) == count:
                return [name or own for name in names]
        return [own] * count


def _plain(text: str) -> str:
    """A string of STEP without its quotes and escapes."""
    wide = _WIDE.sub(lambda found: bytes.fromhex(found[1]).decode("utf-16-be", "replace"), text.replace("''", "'"))
    return wide.strip()
