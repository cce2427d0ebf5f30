"""Meshes: files of every format, written here byte by byte, and what is done to their triangles."""

from __future__ import annotations

import base64
import importlib.util
import itertools
import json
import logging
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.description.files import Files
from etendue.errors import FormatError, MissingLibraryError, SceneError, SceneWarning
from etendue.scene import Scene, bodies, compile_scene
from etendue.scene.mesh_files import MESH_FORMATS, read_mesh
from etendue.scene.triangles import directed_areas, open_edges, smooth_normals, volume, welded
from oracles import step
from oracles.meshes import divided_sphere
from oracles.scenes import OCTAHEDRON, OCTANTS

CORNERS = np.array(OCTAHEDRON)


def stl(scale: float) -> bytes:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *(CORNERS[list(t)].ravel() * scale), 0) for t in OCTANTS)
    return b"solid but binary".ljust(80) + struct.pack("<I", len(OCTANTS)) + rows


def stl_ascii(scale: float) -> bytes:
    facets = []
    for t in OCTANTS:
        vertices = "\n".join("vertex {:g} {:g} {:g}".format(*(CORNERS[i] * scale)) for i in t)
        facets.append(f"facet normal 0 0 0\nouter loop\n{vertices}\nendloop\nendfacet")
    return ("solid octahedron\n" + "\n".join(facets) + "\nendsolid octahedron\n").encode()


def obj(scale: float) -> bytes:
    lines = ["# an octahedron", *("v {:g} {:g} {:g}".format(*(c * scale)) for c in CORNERS)]
    return "\n".join([*lines, *("f {} {} {}".format(*(i + 1 for i in t)) for t in OCTANTS), ""]).encode()


def ply(scale: float) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(CORNERS)}\nproperty double x\nproperty double y\nproperty double z\n"
    head += f"element face {len(OCTANTS)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = ["{:g} {:g} {:g}".format(*(c * scale)) for c in CORNERS] + ["3 {} {} {}".format(*t) for t in OCTANTS]
    return (head + "\n".join(rows) + "\n").encode()


def gltf_parts(scale: float) -> tuple[dict[str, Any], bytes]:
    data = (CORNERS * scale).astype("<f4").tobytes() + np.array(OCTANTS, dtype="<u2").tobytes()
    corners = len(CORNERS) * 12
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": corners},
        {"buffer": 0, "byteOffset": corners, "byteLength": 48},
    ]
    low, high = (CORNERS.min(axis=0) * scale).tolist(), (CORNERS.max(axis=0) * scale).tolist()
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(CORNERS), "type": "VEC3", "min": low, "max": high},
        {"bufferView": 1, "componentType": 5123, "count": len(OCTANTS) * 3, "type": "SCALAR"},
    ]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return tree, data


def gltf(scale: float) -> bytes:
    tree, data = gltf_parts(scale)
    tree["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(tree).encode()


def glb(scale: float) -> bytes:
    tree, data = gltf_parts(scale)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


WRITERS: dict[str, Callable[[float], bytes]] = {
    "stl": stl, "stl_ascii": stl_ascii, "obj": obj, "ply": ply, "gltf": gltf, "glb": glb
}  # fmt: skip


def welded_file(path: Path) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    mesh = read_mesh(path, None)
    return welded(mesh.vertices, mesh.triangles)


def test_every_format_is_tested() -> None:
    assert {*WRITERS, "step"} == set(MESH_FORMATS)


@pytest.mark.parametrize("name", WRITERS)
def test_an_octahedron_comes_back_from_every_format(name: str, tmp_path: Path) -> None:
    """The content tells the format, whatever the name; the unit is the format's, and 4/3 r³ is the volume with it."""
    path = tmp_path / "body.cad"
    path.write_bytes(WRITERS[name](1e-3 if name in ("gltf", "glb") else 1.0))
    vertices, triangles = welded_file(path)
    assert len(vertices) == 6
    assert len(triangles) == 8
    assert not len(open_edges(triangles))
    assert volume(vertices, triangles) == pytest.approx(4 / 3 * 8, rel=1e-6)
    path.write_bytes(WRITERS[name](1.0))
    inches = bodies.Mesh(file="body.cad", unit="inch", scale=0.5).faces(Files(tmp_path))[0].shape["vertices"]
    assert np.abs(inches).max() == pytest.approx(25.4, rel=1e-6)


@pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="STEP files need the extra [step]")
def test_step_files_are_read(tmp_path: Path) -> None:
    """A tetrahedron with legs of 30 mm, as a faceted boundary representation: 30³/6 mm³."""
    (tmp_path / "body.step").write_text(step.tetrahedron(30.0), encoding="ascii")
    vertices, triangles = welded_file(tmp_path / "body.step")
    assert volume(vertices, triangles) == pytest.approx(30**3 / 6, rel=1e-5)
    with pytest.raises(FormatError, match="state their unit themselves"):
        read_mesh(tmp_path / "body.step", "mm")


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="STEP files need the extra [step]")
@pytest.mark.parametrize("tolerance", [None, 0.1, 0.002])
def test_step_surfaces_are_met_within_the_tolerance(tolerance: float | None, tmp_path: Path) -> None:
    """A sphere of 10 mm: corners lie on it, and the volume is short of 4/3 π R³ by at most area times tolerance."""
    (tmp_path / "ball.step").write_text(step.sphere(10.0), encoding="ascii")
    shape = {"kind": "mesh", "file": "ball.step"} | ({} if tolerance is None else {"tolerance": tolerance})
    scene = Scene.from_dict({"solids": [{"shape": shape, "medium": "BK7"}]}, folder=tmp_path)
    (face,) = compile_scene(scene).record["faces"]
    assert np.linalg.norm(face["shape"]["vertices"], axis=1) == pytest.approx(10.0, rel=1e-6)
    whole = 4 / 3 * np.pi * 1000
    found = volume(face["shape"]["vertices"], face["shape"]["triangles"])
    assert whole - 400 * np.pi * (tolerance or 0.01) < found < whole


def test_tolerances_are_for_surfaces_that_are_no_triangles_yet(tmp_path: Path) -> None:
    (tmp_path / "body").write_bytes(stl(1.0))
    with pytest.raises(FormatError, match="made of triangles already"):
        read_mesh(tmp_path / "body", None, 0.1)


def test_step_without_its_library_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "body.step").write_text(step.tetrahedron(30.0), encoding="ascii")
    monkeypatch.setitem(sys.modules, "cascadio", None)
    with pytest.raises(MissingLibraryError, match=r"pip install 'etendue\[step\]'"):
        read_mesh(tmp_path / "body.step", None)


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"\0" * 100, "begins no mesh file"),
        (b"", "begins no mesh file"),
        (b"ply\nformat", "damaged"),
        (b"glTF" + b"\xff" * 40, "damaged"),
        (b'{"asset": ', "damaged"),
        (b"solid nothing\nendsolid\n", "no triangles"),
        (b"v 0 0 0\nv 1 0 0\nf 1 2 9\n\n", "damaged"),
        (b"v 0 0 nan\nv 1 0 0\nv 1 1 0\nf 1 2 3\n\n", "not finite"),
        (stl(1.0)[:200], "begins no mesh file|damaged|no triangles"),
    ],
)
def test_files_that_are_no_meshes(raw: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / "bad").write_bytes(raw)
    with pytest.raises(FormatError, match=words):
        read_mesh(tmp_path / "bad", None)


@pytest.mark.parametrize("name", WRITERS)
def test_truncated_files_are_refused_or_smaller(name: str, tmp_path: Path) -> None:
    """Cut anywhere, a file is an error of ours, or fewer triangles that are those of the file."""
    whole = WRITERS[name](1.0)
    for cut in range(0, len(whole), max(1, len(whole) // 23)):
        (tmp_path / "cut").write_bytes(whole[:cut])
        try:
            mesh = read_mesh(tmp_path / "cut", "mm")
        except FormatError:
            continue
        assert len(mesh.triangles) <= 8
        assert np.abs(mesh.vertices).max() <= 2.0


def obj_mesh(folder: Path, text: str) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    (folder / "body.obj").write_text(text, encoding="utf-8")
    mesh = read_mesh(folder / "body.obj", None)
    return mesh.vertices, mesh.triangles


def test_vertices_of_obj_files_are_counted_from_either_end(tmp_path: Path) -> None:
    """Bodies that name their own vertices by numbers below 0 lie apart: together they have twice the volume of one.

    In between stand remarks, blanks, tabs, a line that goes on in the next one, and a file's mark of its encoding.
    """
    text = "\ufeff# " + "a remark " * 300 + "\n"
    for k in range(2):
        text += f"o body {k}\n" + "".join(f"v {c[0] + 9 * k:g} {c[1]:g} {c[2]:g} # a corner\n" for c in CORNERS)
        text += "".join(f"  f\t{a - 6}/1 \\\n {b - 6}//2 {c - 6}\n" for a, b, c in OCTANTS)
    vertices, triangles = obj_mesh(tmp_path, text)
    assert volume(vertices, triangles) == pytest.approx(2 * volume(CORNERS, np.array(OCTANTS)), rel=1e-12)
    assert not len(open_edges(triangles))


def test_polygons_of_obj_files_may_have_reentrant_corners(tmp_path: Path) -> None:
    """Triangles of a polygon do not overlap: their areas add up to its own, ½ |Σ p × p'|, whichever corner comes first.

    A star without symmetry, tilted in space; and a square with a hole, joined to the rim by an edge that is there twice.
    """
    angle = np.arange(14) * 2 * np.pi / 14
    star = np.stack([np.cos(angle), np.sin(angle)]) * np.where(np.arange(14) % 2, 0.3, 1 + 0.1 * np.arange(14))
    frame = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
    for corners in (star.T, np.array(frame, dtype=np.float64)):
        x, y = corners.T
        area = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        tilted = corners @ np.array([[0.6, 0, 0.8], [0, 1, 0]])
        for first in range(len(corners)):
            order = np.roll(np.arange(len(corners)), first)
            text = "".join("v {!r} {!r} {!r}\n".format(*p.tolist()) for p in tilted)
            vertices, triangles = obj_mesh(tmp_path, text + "f " + " ".join(str(i + 1) for i in order) + "\n")
            doubled, _ = directed_areas(vertices, triangles)
            assert 0.5 * np.linalg.norm(doubled, axis=1).sum() == pytest.approx(area, rel=1e-12)
            assert (doubled @ doubled[0] > 0.0).all()
            assert len(triangles) == len(corners) - 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("v 0 0 1,5\n\n", "line 1: 'v 0 0 1,5' is no vertex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4: 'f 1 2' is no face"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4: 'f 1 2 0' is no face"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 -4\n", "line 5: a face names a vertex that is not there"),
        (f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {1 << 63}\n", "line 4: a face names a vertex that is not there"),
        (f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -{1 << 70}\n", "line 4: a face names a vertex that is not there"),
        ("v 0 0 0\nv 4 3 0\nv 4 0 0\nv 0 2 0\nf 1 2 3 4\n", "line 5: a polygon crosses itself"),
    ],
)
def test_obj_files_that_are_damaged(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=words):
        obj_mesh(tmp_path, text)


def test_text_stl_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    """Its first solid is whole: without the second one the body would be another."""
    two = stl_ascii(1.0) + stl_ascii(2.0)
    (tmp_path / "cut").write_bytes(two[: int(0.8 * len(two))])
    with pytest.raises(FormatError, match=r"1\d facets begin, and 8 of them can be read"):
        read_mesh(tmp_path / "cut", None)
    (tmp_path / "loud").write_bytes(two.upper())
    assert len(read_mesh(tmp_path / "loud", None).triangles) == 16


def test_normals_of_stl_files_that_are_no_numbers_are_passed_over_in_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Triangles without area have such normals from some programs; the library logs a traceback over them."""
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    (tmp_path / "odd").write_bytes(stl_ascii(2.0).replace(b"normal 0 0 0", b"normal -1.#IND 0 0", 1))
    assert len(read_mesh(tmp_path / "odd", None).triangles) == 8
    assert capsys.readouterr().err == ""


def test_open_and_twisted_meshes_are_doubted() -> None:
    """A missing triangle, and one that is turned over, leave three edges each."""
    for triangles in (OCTANTS[1:], [tuple(reversed(OCTANTS[0])), *OCTANTS[1:]]):
        mesh = {"kind": "mesh", "vertices": OCTAHEDRON, "triangles": triangles}
        scene = Scene(solids=[{"name": "gem", "shape": mesh, "medium": "BK7"}])
        with pytest.warns(SceneWarning, match=r'solids\[0\] "gem": the mesh is open: 3 edges'):
            compiled = compile_scene(scene)
        assert "the mesh is open" in compiled.notes[0]


def test_a_mesh_inside_out_is_turned() -> None:
    """Its face is flipped; that of a proper one is not."""
    for triangles, flip in ((OCTANTS, False), ([t[::-1] for t in OCTANTS], True)):
        mesh = {"kind": "mesh", "vertices": OCTAHEDRON, "triangles": triangles}
        (face,) = compile_scene(Scene(solids=[{"shape": mesh, "medium": "BK7"}])).record["faces"]
        assert face["flip"] is flip


def test_each_shell_of_a_mesh_is_turned_outwards() -> None:
    """Whatever the senses that a file has: the volume is that of two octahedra and a hollow one with a body in its cavity.

    An octahedron of half-diagonals 2 s has 32 s³/3. Cavities run the other way than what is around them.
    """
    parts = ((1.0, (5.0, 0, 0)), (0.5, (-5.0, 0, 0)), (3.0, (0.0, 9, 0)), (2.0, (0.0, 9, 0)), (1.0, (0.1, 9, 0)))
    true = np.array([1, 1, 1, -1, 1])
    expected = 32 / 3 * sum(sense * size**3 for sense, (size, _) in zip(true, parts, strict=True))
    for wrong in itertools.product((1, -1), repeat=3):
        # The parts of the hollow one are turned together, as files have them.
        senses = true * [wrong[0], wrong[1], *[wrong[2]] * 3]
        corners = np.concatenate([CORNERS * size + at for size, at in parts])
        rows = [np.array(OCTANTS)[:, ::sense] + len(CORNERS) * k for k, sense in enumerate(senses)]
        mesh = {"kind": "mesh", "vertices": corners.tolist(), "triangles": np.concatenate(rows).tolist()}
        (face,) = compile_scene(Scene(solids=[{"shape": mesh, "medium": "BK7"}])).record["faces"]
        found = volume(face["shape"]["vertices"], face["shape"]["triangles"].astype(np.int64))
        assert (-found if face["flip"] else found) == pytest.approx(expected, rel=1e-12)


def test_a_shell_within_one_of_the_same_sense_is_doubted() -> None:
    corners = np.concatenate([CORNERS * 2, CORNERS])
    rows = np.concatenate([OCTANTS, np.array(OCTANTS) + len(CORNERS)])
    mesh = {"kind": "mesh", "vertices": corners.tolist(), "triangles": rows.tolist()}
    with pytest.warns(SceneWarning, match="lies within another part that runs the same way"):
        compile_scene(Scene(solids=[{"shape": mesh, "medium": "BK7"}]))


def test_welding_keeps_the_surface() -> None:
    """Eight triangles with corners of their own, one of them twice and one without an area: 6 corners, 8 triangles."""
    corners = CORNERS[np.array(OCTANTS).ravel()]
    corners = np.concatenate([corners, [[0.0, 0, 0], [-0.0, 0, 0], [1, 0, 0]]])
    vertices, triangles = welded(corners, np.arange(27).reshape(9, 3))
    assert len(vertices) == 6
    assert len(triangles) == 8
    assert volume(vertices, triangles) == pytest.approx(4 / 3 * 8, rel=1e-15)


def tube(facets: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A closed prism of many sides about the z axis, radius 1, height 1, with two lids."""
    angle = 2 * np.pi * np.arange(facets) / facets
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(facets)], axis=1)
    vertices = np.concatenate([ring, np.add(ring, [0, 0, 1]), [[0, 0, 0], [0, 0, 1]]])
    i, j = np.arange(facets), (np.arange(facets) + 1) % facets
    sides = [np.stack([i, j, j + facets], axis=1), np.stack([i, j + facets, i + facets], axis=1)]
    lids = [np.stack([j, i, np.full(facets, 2 * facets)], 1), np.stack([i, j, np.full(facets, 1)], 1) + facets]
    lids[1][:, 2] = 2 * facets + 1
    return vertices, np.concatenate([*sides, *lids])


def test_normals_of_a_tube_are_radial_and_its_lids_stay_flat() -> None:
    """With a crease of 30°, sides of 7.5° each are smooth: at every corner the normal is radial (theirs is, by symmetry),
    or along the axis. The lids meet the sides at 90°, so each corner of a ring is there twice.
    """
    vertices, triangles = tube(48)
    assert not len(open_edges(triangles))
    split, faces, normals = smooth_normals(vertices, triangles, 30.0)
    assert len(split) == 4 * 48 + 2
    assert np.array_equal(split[faces], vertices[triangles])
    radial = np.abs(normals[:, 2]) < 0.5
    assert np.allclose(normals[radial, :2], split[radial, :2], atol=1e-12)
    assert np.allclose(np.abs(normals[~radial]), [0, 0, 1], atol=1e-12)
    # Without smoothing every side has its own normals, and with everything smooth every corner has one.
    assert len(smooth_normals(vertices, triangles, 5.0)[0]) == 2 * 48 * 2 + 2 * 48 + 2
    assert len(smooth_normals(vertices, triangles, 180.0)[0]) == len(vertices)


def test_normals_of_a_sphere() -> None:
    """An octahedron divided four times, on the unit sphere: normals differ from the radius by less than a facet does."""
    vertices, triangles = divided_sphere(4)
    split, _, normals = smooth_normals(vertices, triangles, 45.0)
    assert len(split) == len(vertices) == 1026
    cosine = np.einsum("ij,ij->i", split, normals)
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < 1.0


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "give either a 'file'"),
        ({"file": "a.stl", "vertices": OCTAHEDRON, "triangles": OCTANTS}, "give either a 'file'"),
        ({"vertices": OCTAHEDRON}, "belong together"),
        ({"vertices": OCTAHEDRON, "triangles": [(0, 1, 6)]}, "name vertex 6, and there are 6"),
        ({"vertices": OCTAHEDRON, "triangles": [(0, 1, -1)]}, "must be at least 0"),
        ({"vertices": OCTAHEDRON, "triangles": OCTANTS, "unit": "mm"}, "'unit' is that of a file"),
        ({"file": "a.stl", "unit": "ft"}, "unit: is 'ft'.* Known: nm, um, mm"),
    ],
)
def test_meshes_that_are_none(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        bodies.Mesh(**keys)


def test_meshes_that_cannot_be_used() -> None:
    flat = {"kind": "mesh", "vertices": OCTAHEDRON, "triangles": [(0, 0, 1)]}
    huge = {"kind": "mesh", "vertices": OCTAHEDRON, "triangles": OCTANTS, "scale": 1e9}
    trimmed = {"shape": {"kind": "mesh", "vertices": OCTAHEDRON, "triangles": OCTANTS}, "trim": {"radius": [0, 1]}}
    for thing, words in (
        ({"shape": flat}, "no triangle of the mesh has an area"),
        ({"shape": huge}, "check its unit"),
        (trimmed, "trimmed by z and half spaces only"),
    ):
        with pytest.raises(SceneError, match=words):
            compile_scene(Scene(surfaces=[{**thing, "finish": "mirror"}]))


SLANTED = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 0 0.6 0.8\n"
PLY_ROWS = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
PLY_HEAD = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
STL_TRIANGLE = """solid a
facet normal 0 .6 .8
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid
"""
PLY_NORMALS = "property float nx\nproperty float ny\nproperty float nz\n"


def one_triangle(normals: bool) -> dict[str, Any]:
    """A glTF tree of one triangle in a buffer of its own."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0.6, 0.8], [0, 0, 1]], dtype="<f4").tobytes()
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": 'a "NORMAL": b'}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0} | ({"NORMAL": 1} if normals else {})}]}],
        "accessors": [accessor, accessor | {"byteOffset": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 72}],
        "buffers": [
            {"byteLength": 72, "uri": "data:application/octet-stream;base64," + base64.b64encode(points).decode()}
        ],
    }


def binary_gltf(tree: dict[str, Any]) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


@pytest.mark.parametrize(
    ("raw", "stated"),
    [
        (SLANTED + "f 1//1 2//2 3//1\n", True),
        (SLANTED + "vt 0 0\nf -3/1/-2 -2/1/-1 -1/1/-2\n", True),
        (SLANTED + "f 1 2 3\n", False),
        (SLANTED + "vt 0 0\nf 1/1 2/1 3/1\n", False),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", False),
        (PLY_HEAD + PLY_NORMALS + PLY_ROWS + "0 0 0 0 0 1\n1 0 0 0 .6 .8\n0 1 0 0 0 1\n3 0 1 2\n", True),
        (PLY_HEAD + PLY_ROWS + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", False),
        # Normals of faces are those of facets.
        (PLY_HEAD + PLY_ROWS.replace("end_", PLY_NORMALS + "end_") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 0 0 1\n", False),
        (json.dumps(one_triangle(normals=True), indent=1), True),
        (json.dumps(one_triangle(normals=False)), False),
        (binary_gltf(one_triangle(normals=True)), True),
        (binary_gltf(one_triangle(normals=False)), False),
        (STL_TRIANGLE, False),
    ],
)  # fmt: skip
def test_vertex_normals_that_are_not_used_are_told(raw: str | bytes, stated: bool, tmp_path: Path) -> None:
    (tmp_path / "sheet").write_bytes(raw.encode() if isinstance(raw, str) else raw)
    for given, instead in (({}, "triangles are flat; crease_angle = 30 makes"), ({"crease_angle": 40}, "= 40 makes")):
        shape = {"kind": "mesh", "file": str(tmp_path / "sheet"), **given}
        scene = Scene(surfaces=[{"shape": shape, "finish": "mirror"}])
        notes = [note for note in compile_scene(scene).notes if "the file's vertex normals are not used" in note]
        assert len(notes) == stated
        assert all(instead in note for note in notes)
