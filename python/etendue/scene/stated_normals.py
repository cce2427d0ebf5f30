"""Whether a mesh file states normals at its vertices, from its text or its header."""

from __future__ import annotations

import re

_OBJ_NORMAL = re.compile(rb"^[ \t]*vn[ \t]", re.MULTILINE)
_OBJ_CORNER_WITH_NORMAL = re.compile(rb"^[ \t]*f[ \t][^\n]*?[0-9]/-?[0-9]*/-?[0-9]", re.MULTILINE)
_PLY_END = re.compile(rb"^\s*end_header\b", re.MULTILINE)
# Attributes hold numbers only, so that the first brace ends them.
_GLTF_NORMAL = re.compile(rb'"attributes"\s*:\s*\{[^{}]*"NORMAL"\s*:')


def states_normals(name: str, raw: bytes) -> bool:
    r"""Whether a file has normals at its vertices: normals of triangles, which STL has, are none.

    Parameters
    ----------
    name : str
        Of the format, a key of `etendue.scene.mesh_files.MESH_FORMATS`.
    raw : bytes
        The whole file.

    Examples
    --------
    >>> states_normals("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")
    True
    """
    match name:
        case "obj":
            return bool(_OBJ_NORMAL.search(raw) and _OBJ_CORNER_WITH_NORMAL.search(raw))
        case "ply":
            return _ply_vertices_have_normals(raw)
        case "gltf":
            return bool(_GLTF_NORMAL.search(raw))
        case "glb":
            # The JSON text is the first chunk: 12 bytes of header, then its length and its kind.
            return bool(_GLTF_NORMAL.search(raw, 20, 20 + int.from_bytes(raw[12:16], "little")))
        case _:
            return False


def _ply_vertices_have_normals(raw: bytes) -> bool:
    end = _PLY_END.search(raw)
    element, properties = "", set()
    for line in raw[: end.start() if end else 0].decode("latin-1").splitlines():
        words = line.split()
        if words[:1] == ["element"]:
            element = words[1]
        elif words[:1] == ["property"] and element == "vertex":
            properties.add(words[-1])
    return {"nx", "ny", "nz"} <= properties
