"""Mesh files that declare more than they hold, or that no memory holds, refused before memory is set aside for them."""

from __future__ import annotations

import base64
import dataclasses
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from etendue.errors import FormatError
from etendue.formats.strict_json import strict_json
from etendue.quantities.memory import require_memory

LARGEST_FILE = 1 << 31
"""Most bytes of a mesh file, and of what a smaller one may become in memory."""

LARGEST_STEP = LARGEST_FILE >> 3
"""Of a STEP file, whose exact surfaces take several times their text in memory."""

COPIES = 1024
"""Bytes in memory for a byte of a glTF file, at most: one body placed some hundred times, or one buffer seen in many
ways. A triangle of 6 bytes becomes one of 24."""

FREE_BYTES = 1 << 26
"""Up to here any number of copies is harmless."""

CORNER_BYTES = 24
"""Of a vertex, and of a triangle, in memory."""

WORD_BYTES = 112
"""Of a word of a text in memory, while the words become numbers. 110 were measured: polygons, and PLY of short numbers."""

RECORD_FACTOR = 6
"""Bytes in memory for a byte of a binary file, while it is read. 5 were measured, of STL."""

TRIANGLE_BYTES = 1100
"""Of a triangle, while the mesh is welded and its normals are made smooth. 590 (PLY) to 1090 (STL) were measured."""

STRETCH = 1 << 22
"""Bytes whose words are counted at a time."""

DEEPEST = 256
"""Most nodes above a node: assemblies nest some ten deep, and each level is gone through for each node below."""

DAMAGED = "The file is damaged, or made to do harm; export it again."

COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
INSTANCING = "EXT_mesh_gpu_instancing"

_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6

_PLY_BYTES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64", "int64", "uint64", "long", "ulong"), 8),
}


def check_mesh(path: Path, name: str, raw: bytes) -> None:
    r"""Refuse a mesh file whose declared sizes its bytes cannot fill.

    Parameters
    ----------
    path : Path
        For messages, and for the files beside it that a glTF file names.
    name : str
        Of the format, a key of `etendue.scene.mesh_files.MESH_FORMATS`. Formats that declare nothing pass.
    raw : bytes
        The whole file.

    Raises
    ------
    FormatError
        If it declares more than it holds, or is stored in a way that is not read.
    MemoryLimitError
        If there is no room for what is in it.

    Examples
    --------
    >>> header = b"ply\nformat ascii 1.0\nelement vertex 99999999\nproperty float x\nend_header\n0\n"
    >>> try:
    ...     check_mesh(Path("sheet.ply"), "ply", header)
    ... except FormatError as error:
    ...     print(error.place, "|", error.found)
    element vertex | 99,999,999 of them, and 2 bytes left for them
    """
    if name == "ply":
        _check_ply(path, raw)
        text = b"format ascii" in raw[:STRETCH]
    else:
        text = name in {"obj", "stl_ascii"}
    needed = len(raw) + WORD_BYTES * _words(raw) if text else RECORD_FACTOR * len(raw)
    require_memory(needed, f"{path}: to read a mesh of {len(raw):,} bytes")
    if name in {"glb", "gltf"}:
        _Gltf.of(path, name, raw).check()
    elif name == "step" and len(raw) > LARGEST_STEP:
        raise FormatError(path, "size", f"{len(raw):,} bytes", f"A STEP file may have {LARGEST_STEP:,}; export less.")


def require_mesh_memory(path: Path, triangles: int) -> None:
    """Refuse a mesh for whose triangles there is no room, before they are welded.

    Raises
    ------
    MemoryLimitError
        If so.

    Examples
    --------
    >>> require_mesh_memory(Path("sheet.stl"), 100_000)
    """
    require_memory(TRIANGLE_BYTES * triangles, f"{path}: a mesh of {triangles:,} triangles")


def _words(raw: bytes) -> int:
    """Words of a text; what stands between slashes counts, too."""
    # Nothing below the digits but signs and points stands within a number.
    apart = np.ones(256, dtype=bool)
    apart[[*range(ord("0"), 256), ord("+"), ord("-"), ord(".")]] = False
    count, before = 0, True
    for start in range(0, len(raw), STRETCH):
        now = apart[np.frombuffer(raw, np.uint8, min(STRETCH, len(raw) - start), start)]
        count += int(np.count_nonzero(now[:-1] & ~now[1:])) + int(before and not now[0])
        before = bool(now[-1])
    return count


def _check_ply(path: Path, raw: bytes) -> None:
    """Each element of the header against the bytes that follow: an empty list takes its length alone."""
    end = re.search(rb"^\s*end_header\b[^\n]*\n", raw, re.MULTILINE)
    if end is None:
        raise FormatError(path, "header", "it does not end", DAMAGED)
    lines = raw[: end.start()].decode("latin-1").splitlines()
    ascii_rows = any(line.split()[:2] == ["format", "ascii"] for line in lines)
    left = len(raw) - end.end()
    elements: dict[str, tuple[int, int]] = {}
    element = ""
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if words[:1] == ["element"]:
            # Fifteen digits count more than any file holds, and fewer than Python refuses to convert.
            if len(words) != 3 or not re.fullmatch(r"[0-9]{1,15}", words[2]) or words[1] in elements:
                raise FormatError(path, f"line {number}", f"{line[:80]!r} declares no new element", DAMAGED)
            element = words[1]
            elements[element] = int(words[2]), 0
        elif words[:1] == ["property"]:
            kind = words[2] if words[1:2] == ["list"] and len(words) == 5 else words[1] if len(words) == 3 else ""
            if element not in elements or kind not in _PLY_BYTES:
                raise FormatError(path, f"line {number}", f"{line[:80]!r} declares no property", DAMAGED)
            count, least = elements[element]
            elements[element] = count, least + (2 if ascii_rows else _PLY_BYTES[kind])
    for element, (count, least) in elements.items():
        # The last row of a text may do without the end of its line.
        if count * max(least, 1) > left + ascii_rows:
            found = f"{count:,} of them, and {left:,} bytes left for them"
            raise FormatError(path, f"element {element}", found, DAMAGED)
        left -= count * least


@dataclasses.dataclass(frozen=True)
class _Gltf:
    """The JSON text of a glTF file, and the lengths of its buffers."""

    path: Path
    data: dict[str, Any]
    stored: int
    """Bytes of the file and of those that it names."""
    buffers: tuple[int, ...]

    @classmethod
    def of(cls, path: Path, name: str, raw: bytes) -> _Gltf:
        text, chunks = _glb_chunks(path, raw) if name == "glb" else (raw, [])
        try:
            data = strict_json(text.decode("utf-8-sig"))
        except (ValueError, RecursionError) as error:
            raise FormatError(path, "JSON", f"it cannot be read ({error})", DAMAGED) from None
        if not isinstance(data, dict):
            raise FormatError(path, "JSON", "it is no object", DAMAGED)
        gltf = cls(path, data, len(raw), ())
        lengths: list[int] = []
        stored = len(raw)
        for i, buffer in enumerate(gltf.items("buffers")):
            place = f"buffers/{i}"
            if "uri" in buffer:
                length, beside = gltf.linked(place, buffer["uri"])
                stored += beside
            elif chunks:
                length = chunks.pop(0)
            else:
                raise FormatError(path, place, "it is neither in the file nor beside it", DAMAGED)
            declared = gltf.whole(place, buffer, "byteLength")
            if declared > length:
                raise FormatError(path, place, f"{declared:,} bytes are declared, and there are {length:,}", DAMAGED)
            lengths.append(length)
        return cls(path, data, stored, tuple(lengths))

    def check(self) -> None:
        """Everything that sets memory aside: views, accessors, meshes, and how often they are placed."""
        self._check_extensions()
        views = [self._view(i, view) for i, view in enumerate(self.items("bufferViews"))]
        self._within("bufferViews", sum(length for length, _ in views))
        accessors = [self._accessor(i, accessor, views) for i, accessor in enumerate(self.items("accessors"))]
        self._within("accessors", sum(length for _, length in accessors))
        counts = [count for count, _ in accessors]
        meshes = [self._mesh(i, mesh, counts) for i, mesh in enumerate(self.items("meshes"))]
        placed = sum(meshes)
        for i, node in enumerate(self._nodes()):
            if "mesh" in node:
                placed += meshes[self.index(f"nodes/{i}", node, "mesh", len(meshes))]
        self._within("nodes", placed)

    def items(self, name: str) -> list[dict[str, Any]]:
        """A list of objects of the JSON text; empty where there is none."""
        stored = self.data.get(name, [])
        if not isinstance(stored, list) or not all(isinstance(item, dict) for item in stored):
            raise FormatError(self.path, name, "it is no list of objects", DAMAGED)
        return stored

    def whole(self, place: str, item: dict[str, Any], name: str, missing: int | None = None) -> int:
        """A whole number, 0 or more."""
        value = item.get(name, missing)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise FormatError(self.path, f"{place}/{name}", f"{str(value)[:40]!r} is no count", DAMAGED)
        return value

    def index(self, place: str, item: dict[str, Any], name: str, length: int) -> int:
        """The number of something in a list of this length."""
        value = self.whole(place, item, name)
        if value >= length:
            raise FormatError(self.path, f"{place}/{name}", f"{value}, and there are {length}", DAMAGED)
        return value

    def linked(self, place: str, uri: Any) -> tuple[int, int]:
        """Bytes behind a URI, and how many of them are in another file."""
        if not isinstance(uri, str):
            raise FormatError(self.path, f"{place}/uri", "it is no text", DAMAGED)
        start = uri.find("base64,")
        if start >= 0:
            try:
                return len(base64.b64decode(uri[start + 7 :])), 0
            except ValueError as error:
                raise FormatError(self.path, f"{place}/uri", str(error), DAMAGED) from None
        folder = self.path.parent.resolve()
        try:
            file = next(p for p in ((folder / u.strip()).resolve() for u in (uri, unquote(uri))) if p.is_file())
        except (OSError, ValueError, StopIteration):
            found = f"there is no file {uri[:80]!r} beside it"
            raise FormatError(self.path, f"{place}/uri", found, "Put it there, or export as .glb.") from None
        if not file.is_relative_to(folder):
            found = f"{uri[:80]!r} leads out of the folder of the file"
            raise FormatError(self.path, f"{place}/uri", found, "Put it beside the file, or export as .glb.")
        size = file.stat().st_size
        if size > LARGEST_FILE:
            raise FormatError(self.path, f"{place}/uri", f"{size:,} bytes", f"A mesh may have {LARGEST_FILE:,}.")
        return size, size

    def _within(self, place: str, needed: int) -> None:
        most = min(LARGEST_FILE, max(FREE_BYTES, COPIES * self.stored))
        if needed > most:
            found = f"they need {needed:,} bytes, made of {self.stored:,}; {most:,} are allowed"
            raise FormatError(self.path, place, found, "Export a coarser mesh, or fewer copies of it.")

    def _check_extensions(self) -> None:
        named = (
            set(self.data.get("extensionsRequired", ())) if _texts(self.data.get("extensionsRequired", ())) else set()
        )
        for kind in ("bufferViews", "nodes"):
            for item in self.items(kind):
                named |= _names(item)
        for mesh in self.items("meshes"):
            primitives = mesh.get("primitives", [])
            for primitive in primitives if isinstance(primitives, list) else ():
                named |= _names(primitive)
        for name in COMPRESSIONS:
            if name in named:
                raise FormatError(self.path, name, "meshes compressed so are not read", "Export without compression.")
        if INSTANCING in named:
            raise FormatError(self.path, INSTANCING, "copies stored so are not read", "Export each copy as a node.")

    def _view(self, i: int, view: dict[str, Any]) -> tuple[int, int]:
        """Length and stride (0: none) of a buffer view."""
        place = f"bufferViews/{i}"
        buffer = self.index(place, view, "buffer", len(self.buffers))
        length = self.whole(place, view, "byteLength")
        end = self.whole(place, view, "byteOffset", 0) + length
        if end > self.buffers[buffer]:
            found = f"it ends at byte {end:,} of a buffer of {self.buffers[buffer]:,}"
            raise FormatError(self.path, place, found, DAMAGED)
        return length, self.whole(place, view, "byteStride", 0)

    def _accessor(self, i: int, accessor: dict[str, Any], views: list[tuple[int, int]]) -> tuple[int, int]:
        """Number of elements and their bytes in memory."""
        place = f"accessors/{i}"
        count = self.whole(place, accessor, "count")
        component, kind = accessor.get("componentType"), accessor.get("type")
        if component not in _COMPONENT_BYTES or kind not in _COMPONENTS:
            raise FormatError(self.path, place, f"elements of {str(kind)[:20]} of {str(component)[:20]}", DAMAGED)
        element = _COMPONENT_BYTES[component] * _COMPONENTS[kind]
        if "bufferView" not in accessor:
            if "sparse" not in accessor:
                raise FormatError(self.path, place, f"{count:,} elements without a buffer", DAMAGED)
            return count, count * element
        length, stride = views[self.index(place, accessor, "bufferView", len(views))]
        if 0 < stride < element:
            raise FormatError(self.path, place, f"elements of {element} bytes every {stride}", DAMAGED)
        end = self.whole(place, accessor, "byteOffset", 0) + (count - 1) * (stride or element) + element
        if count and end > length:
            found = f"{count:,} elements end at byte {end:,} of a buffer view of {length:,}"
            raise FormatError(self.path, place, found, DAMAGED)
        return count, count * element

    def _mesh(self, i: int, mesh: dict[str, Any], counts: list[int]) -> int:
        """Bytes of the vertices and triangles of a mesh in memory."""
        primitives, needed = mesh.get("primitives"), 0
        if not isinstance(primitives, list):
            raise FormatError(self.path, f"meshes/{i}", "it has no list of primitives", DAMAGED)
        accessors = self.items("accessors")
        for k, primitive in enumerate(primitives):
            place = f"meshes/{i}/primitives/{k}"
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            if not isinstance(attributes, dict):
                raise FormatError(self.path, place, "it has no attributes", DAMAGED)
            used = [self.index(f"{place}/attributes", attributes, "POSITION", len(counts))]
            if "indices" in primitive:
                used.append(self.index(place, primitive, "indices", len(counts)))
            for at in used:
                if "sparse" in accessors[at]:
                    advice = "Export without sparse accessors."
                    raise FormatError(
                        self.path, f"accessors/{at}", "a sparse accessor of a surface is not read", advice
                    )
            corners = counts[used[-1]]
            triangles = corners if primitive.get("mode", _TRIANGLES) in {_STRIP, _FAN} else corners // 3
            needed += CORNER_BYTES * (counts[used[0]] + triangles)
        return needed

    def _nodes(self) -> list[dict[str, Any]]:
        """The nodes, of which the standard wants that they are trees."""
        nodes = self.items("nodes")
        children = [self._children(i, node, len(nodes)) for i, node in enumerate(nodes)]
        parent: dict[int, int] = {}
        for i, below in enumerate(children):
            for child in below:
                if child in parent:
                    found = f"it hangs under node {parent[child]} and under node {i}"
                    raise FormatError(self.path, f"nodes/{child}", found, "Export each copy as a node of its own.")
                parent[child] = i
        reached, level = 0, [i for i in range(len(nodes)) if i not in parent]
        for _ in range(DEEPEST):
            reached += len(level)
            level = [child for i in level for child in children[i]]
        if level:
            raise FormatError(self.path, f"nodes/{level[0]}", f"it is nested more than {DEEPEST} deep", DAMAGED)
        if reached < len(nodes):
            raise FormatError(self.path, "nodes", "some are below themselves", DAMAGED)
        return nodes

    def _children(self, i: int, node: dict[str, Any], length: int) -> list[int]:
        stored = node.get("children", [])
        if not isinstance(stored, list):
            raise FormatError(self.path, f"nodes/{i}/children", "it is no list", DAMAGED)
        return [self.index(f"nodes/{i}/children", {"child": child}, "child", length) for child in stored]


def _texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _names(item: Any) -> set[str]:
    """Extensions of an object."""
    extensions = item.get("extensions") if isinstance(item, dict) else None
    return set(extensions) if isinstance(extensions, dict) else set()


def _glb_chunks(path: Path, raw: bytes) -> tuple[bytes, list[int]]:
    """The JSON text of a binary file, and the lengths of the binary chunks behind it."""
    chunks = list(_chunks(path, raw))
    if not chunks or chunks[0][0] != b"JSON":
        raise FormatError(path, "byte 12", "there is no JSON chunk", DAMAGED)
    _, start, length = chunks[0]
    return raw[start : start + length], [size for kind, _, size in chunks[1:] if kind == b"BIN\0"]


def _chunks(path: Path, raw: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Kind, first byte and length of each chunk."""
    at = 12
    while at + 8 <= len(raw):
        length, kind = struct.unpack_from("<I4s", raw, at)
        if at + 8 + length > len(raw):
            found = f"a chunk of {length:,} bytes in a file of {len(raw):,}"
            raise FormatError(path, f"byte {at}", found, DAMAGED)
        yield kind, at + 8, length
        at += 8 + length
