"""Mesh files that declare more than they hold."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, MemoryLimitError
from etendue.quantities import memory
from etendue.scene.mesh_files import read_mesh
from etendue.scene.mesh_limits import LARGEST_STEP, WORD_BYTES, check_mesh
from etendue.scene.triangles import smooth_normals
from oracles.little_memory import told

FLOAT, UINT16, UINT32 = 5126, 5123, 5125
SPARE = 400 << 20


def gltf(vertices: int = 4, triangles: int = 2, **changes: Any) -> dict[str, Any]:
    """A file of this many vertices and triangles, all in its text."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(vertices, 3)).astype("<f4").tobytes()
    faces = rng.integers(0, vertices, (triangles, 3)).astype("<u4").tobytes()
    text = base64.b64encode(corners + faces).decode()
    return {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(corners + faces), "uri": f"data:application/octet-stream;base64,{text}"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(corners)},
            {"buffer": 0, "byteOffset": len(corners), "byteLength": len(faces)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": vertices, "type": "VEC3"},
            {"bufferView": 1, "componentType": UINT32, "count": 3 * triangles, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        **changes,
    }


def glb(content: dict[str, Any], binary: bytes = b"") -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary if binary else b""
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def declared(**changes: Any) -> dict[str, Any]:
    """With other facts in the accessor of the vertices."""
    content = gltf()
    content["accessors"][0] |= changes
    return content


def without_buffer(count: int, **changes: Any) -> dict[str, Any]:
    content = gltf()
    content["accessors"][0] = {"componentType": FLOAT, "count": count, "type": "VEC3", **changes}
    return content


def seen_often() -> dict[str, Any]:
    content = gltf(20_000, 10_000)
    content["bufferViews"] += [{"buffer": 0, "byteLength": 240_000}] * 5000
    return content


def placed_often() -> dict[str, Any]:
    return gltf(4000, 8000, nodes=[{"mesh": 0}] * 20_000, scenes=[{"nodes": list(range(20_000))}])


def drawn_often() -> dict[str, Any]:
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    return gltf(4000, 8000, meshes=[{"primitives": [primitive] * 20_000}])


def doubled() -> dict[str, Any]:
    """2³⁰ copies, if each node were placed below both of its parents."""
    nodes: list[dict[str, Any]] = [{"children": [i + 1, i + 1]} for i in range(30)]
    return gltf(nodes=[*nodes, {"mesh": 0}])


def chain(length: int) -> dict[str, Any]:
    return gltf(nodes=[*({"children": [i + 1]} for i in range(length - 1)), {"mesh": 0}])


def ply(head: str, rows: bytes, form: str = "ascii") -> bytes:
    return f"ply\nformat {form} 1.0\n{head}\nend_header\n".encode() + rows


XYZ = "property float x\nproperty float y\nproperty float z"
FACES = "element face {}\nproperty list uchar int vertex_indices"
BINARY = "binary_little_endian"
BOMBS: dict[str, tuple[bytes, str]] = {
    "no-buffer.glb": (glb(without_buffer(60_000_000)), "accessors/0: 60,000,000 elements without a buffer"),
    "sparse.glb": (glb(without_buffer(60_000_000, sparse={"count": 1})), "accessors: they need 720,000,024 bytes"),
    "small-sparse.glb": (glb(without_buffer(4, sparse={"count": 1})), "accessors/0: a sparse accessor"),
    "count.gltf": (json.dumps(declared(count=60_000_000)).encode(), "accessors/0: 60,000,000 elements end at byte"),
    "offset.glb": (glb(declared(byteOffset=4)), "accessors/0: 4 elements end at byte 52"),
    "negative.glb": (glb(declared(count=-1)), "accessors/0/count"),
    "fraction.glb": (glb(declared(count=1.5)), "accessors/0/count"),
    "buffer.glb": (glb(gltf(buffers=[{"byteLength": 1 << 31}]), b"1234"), "buffers/0: 2,147,483,648 bytes are decl"),
    "view.glb": (glb(gltf(bufferViews=[{"buffer": 0, "byteLength": 1 << 31}] * 2)), "bufferViews/0: it ends at byte"),
    "seen-often.glb": (glb(seen_often()), "bufferViews: they need 1,200,"),
    "placed-often.glb": (glb(placed_often()), "nodes: they need 5,760,"),
    "drawn-often.glb": (glb(drawn_often()), "nodes: they need 11,520,"),
    "doubled.glb": (glb(doubled()), "nodes/1: it hangs under node 0 and under node 0"),
    "below-itself.glb": (glb(gltf(nodes=[{"children": [1]}, {"children": [0]}])), "nodes: some are below themselves"),
    "chain.glb": (glb(chain(5000)), "nodes/256: it is nested more than 256 deep"),
    "nested.gltf": (b'{"a":' + b"[" * 200_000, "JSON: it cannot be read"),
    "endless.gltf": (json.dumps(gltf(buffers=[{"byteLength": 84, "uri": "/dev/zero"}])).encode(), "buffers/0/uri"),
    "draco.glb": (glb(gltf(extensionsRequired=["KHR_draco_mesh_compression"])), "KHR_draco_mesh_compression: meshes"),
    "vertices.ply": (ply(f"element vertex 99999999999\n{XYZ}", b"0 0 0\n"), "element vertex: 99,999,999,999 of them"),
    "binary.ply": (ply(f"element vertex 3\n{XYZ}\n{FACES.format(10**9)}", bytes(46), BINARY), "element face: 1,000,"),
    "empty.ply": (ply(f"element a 9999999999\nelement vertex 1\n{XYZ}", bytes(12), BINARY), "element a: 9,999,999,999"),
    "digits.ply": (ply(f"element vertex {'9' * 6000}\n{XYZ}", b"0 0 0\n"), "line 3: 'element vertex 999"),
}


@pytest.mark.slow
def test_what_a_file_cannot_hold_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    for name, (content, _) in BOMBS.items():
        (tmp_path / name).write_bytes(content)
    imports = "import trimesh, scipy.spatial\nfrom etendue.scene.mesh_files import read_mesh"
    found = told(imports=imports, call="read_mesh(path, None)", paths=[tmp_path / name for name in BOMBS], spare=SPARE)
    for line, (name, (_, place)) in zip(found, BOMBS.items(), strict=True):
        assert f"{name}: {place}" in line


def test_honest_large_meshes_are_read() -> None:
    """A million triangles, a board of 300 bodies, a nested assembly, and attributes side by side in one view."""
    rows = np.zeros(500_000, "<f4,<f4,<f4").tobytes() + np.zeros(1_000_000, "u1,<i4,<i4,<i4").tobytes()
    head = f"element vertex 500000\n{XYZ}\n{FACES.format(10**6)}"
    check_mesh(Path("a.ply"), "ply", ply(head, rows, BINARY))
    check_mesh(Path("a.glb"), "glb", glb(gltf(500_000, 1_000_000)))
    check_mesh(Path("a.glb"), "glb", glb(gltf(5000, 10_000, nodes=[{"mesh": 0}] * 300)))
    check_mesh(Path("a.glb"), "glb", glb(chain(100)))
    views = [{"buffer": 0, "byteLength": 96, "byteStride": 24}]
    side_by_side = [
        {"bufferView": 0, "byteOffset": offset, "componentType": FLOAT, "count": 4, "type": "VEC3"}
        for offset in (0, 12)
    ]
    meshes = [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}}]}]
    content = gltf(buffers=[{"byteLength": 96}], bufferViews=views, accessors=side_by_side, meshes=meshes)
    check_mesh(Path("a.glb"), "glb", glb(content, bytes(96)))


def test_a_text_ends_without_a_line_end(tmp_path: Path) -> None:
    path = tmp_path / "sheet.ply"
    path.write_bytes(ply(f"element vertex 3\n{XYZ}\n{FACES.format(1)}", b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2"))
    assert len(read_mesh(path, None).triangles) == 1


@pytest.mark.parametrize("escape", ["../secret.bin", "%2e%2e/secret.bin"])
def test_buffers_lie_beside_the_file(escape: str, tmp_path: Path) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    content = gltf()
    data = base64.b64decode(content["buffers"][0]["uri"].split(",")[1])
    for uri in ("mesh.bin", escape):
        content["buffers"][0]["uri"] = uri
        (tmp_path / "secret.bin").write_bytes(data)
        (folder / "mesh.bin").write_bytes(data)
        (folder / "mesh.gltf").write_text(json.dumps(content))
        if uri == escape:
            with pytest.raises(FormatError, match=r"buffers/0/uri: .* leads out of the folder"):
                read_mesh(folder / "mesh.gltf", None)
        else:
            assert len(read_mesh(folder / "mesh.gltf", None).triangles) == 2


def test_step_files_are_bounded() -> None:
    with pytest.raises(FormatError, match="A STEP file may have"):
        check_mesh(Path("a.step"), "step", bytes(LARGEST_STEP + 1))


POINTS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
FACET = b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
ROWS = b"0 0 0\n" * 1_000_000 + b"3 0 1 2\n" * 500_000
TEXTS: dict[str, bytes] = {
    "polygon.obj": POINTS + b"f " + b"1 2 3 " * 1_200_000 + b"\n",
    "faces.obj": POINTS + b"f 1//1 2//1 3//1\n" * 500_000,
    "long.stl": b"solid a\n" + FACET * 250_000,
    "short.ply": ply(f"element vertex 1000000\n{XYZ}\n{FACES.format(500_000)}", ROWS),
}


@pytest.mark.slow
def test_texts_that_no_memory_holds_name_file_and_size(tmp_path: Path) -> None:
    """Texts of some 10 MB that become half a gigabyte while they are read."""
    for name, content in TEXTS.items():
        (tmp_path / name).write_bytes(content)
    imports = "import trimesh, scipy.spatial\nfrom etendue.scene.mesh_files import read_mesh"
    found = told(
        imports=imports, call="read_mesh(path, None)", paths=[tmp_path / name for name in TEXTS], spare=250 << 20
    )
    for line, (name, content) in zip(found, TEXTS.items(), strict=True):
        assert line.startswith(f"MemoryLimitError {tmp_path / name}: to read a mesh of {len(content):,} bytes"), line


def test_triangles_that_no_memory_holds_are_refused_before_they_are_welded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """300 000 triangles of 15 MB, which take 330 MB until they are welded and smooth."""
    path = tmp_path / "large.stl"
    path.write_bytes(bytes(80) + struct.pack("<I", 300_000) + bytes(50 * 300_000))
    monkeypatch.setattr(memory, "available_memory", lambda: 300 << 20)
    with pytest.raises(MemoryLimitError, match=r"large\.stl: a mesh of 300,000 triangles needs 0\.3 GB"):
        read_mesh(path, None)


@pytest.mark.slow
def test_what_is_asked_for_covers_what_is_taken(tmp_path: Path) -> None:
    """With as much memory as is asked for, and the room that libraries take, it becomes triangles."""
    content = POINTS + b"f " + b"1 2 3 " * 300_000 + b"\n"
    path = tmp_path / "polygon.obj"
    path.write_bytes(content)
    imports = "import trimesh, scipy.spatial\nfrom etendue.scene.mesh_files import read_mesh"
    asked = len(content) + WORD_BYTES * 900_000
    (found,) = told(imports=imports, call="read_mesh(path, None)", paths=[path], spare=asked + (64 << 20))
    assert found.startswith(f"MemoryLimitError {path}: a mesh of 899,998 triangles needs"), found


def test_a_vertex_that_all_triangles_share_is_no_smooth_surface() -> None:
    """200 000 triangles around one point: 4·10¹⁰ pairs."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200_001)
    rim = np.stack([np.cos(turn), np.sin(turn), 0.1 * np.sin(9 * turn)], axis=1)
    ring = np.arange(200_000)
    triangles = np.stack([ring, ring + 1, np.full_like(ring, 200_001)], axis=1)
    with pytest.raises(ArgumentError, match="200,000 triangles of the mesh meet at one vertex"):
        smooth_normals(np.concatenate([rim, [[0.0, 0, 0]]]), triangles, 30.0)
