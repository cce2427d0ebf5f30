"""STEP files: bodies by name, units, smooth normals and chord errors; maps through them against those of exact shapes."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError, SceneError
from etendue.quantities.luminance_map import LuminanceMap
from etendue.scene import Scene, compile_scene, open_cascade_process
from etendue.scene.mesh_files import read_mesh, step_bodies
from etendue.scene.step_files import read_step
from oracles import step
from oracles.meshes import smooth_mesh

pytestmark = pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="STEP files need the extra [step]")

LAMP = {"kind": "surface", "shape": {"kind": "rectangle", "width": 9, "height": 5}, "flux": 7, "exponent": 2,
        "at": [1, 2, -18]}  # fmt: skip


def stored(folder: Path, text: str) -> Path:
    (folder / "optics.step").write_text(text, encoding="ascii")
    return folder / "optics.step"


def glass(folder: Path, **shape: Any) -> Scene:
    return Scene.from_dict(
        {"sources": [LAMP], "solids": [{"name": "it", "shape": shape, "medium": "BK7"}]}, folder=folder
    )


def seen(scene: Scene) -> LuminanceMap:
    return et.luminance_map(scene, et.Observer(25, 200, 60), et.Screen(22, 22, 32, 32), rays_per_pixel=256, seed=1)


@pytest.mark.slow
def test_bodies_are_separate_and_named_even_where_they_touch(tmp_path: Path) -> None:
    """Two cubes have a square in common, a third lies on one of them: 2³, 1³, 2³ mm³, and 4/3 π 1.5³ but for the chords."""
    bodies = step_bodies(stored(tmp_path, step.optics()))
    assert bodies is not None
    assert [body.name for body in bodies] == ["block", "chip", "twin", "lens"]
    assert all(body.closed for body in bodies)
    volumes = [body.volume for body in bodies]
    assert volumes[:3] == pytest.approx([8.0, 1.0, 8.0], rel=1e-6)
    lost = 4.5 * np.pi - volumes[3]
    assert 0 < lost < 9 * np.pi * bodies[3].chord_error


@pytest.mark.slow
def test_names_that_are_alike_are_numbered(tmp_path: Path) -> None:
    text = step.optics()
    for name in ("chip", "twin"):
        text = text.replace(f"MANIFOLD_SOLID_BREP('{name}'", "MANIFOLD_SOLID_BREP('block'")
    bodies = step_bodies(stored(tmp_path, text))
    assert bodies is not None
    assert [body.name for body in bodies] == ["block 1", "block 2", "block 3", "lens"]
    nameless = step_bodies(stored(tmp_path, text.replace("BREP('block'", "BREP(''").replace("BREP('lens'", "BREP(''")))
    assert nameless is not None
    assert [body.name for body in nameless] == ["optics 1", "optics 2", "optics 3", "optics 4"]


@pytest.mark.slow
def test_one_of_several_bodies_is_chosen(tmp_path: Path) -> None:
    stored(tmp_path, step.optics())
    (face,) = compile_scene(glass(tmp_path, kind="mesh", file="optics.step", body="chip")).record["faces"]
    assert np.ptp(face["shape"]["vertices"], axis=0) == pytest.approx([1, 1, 1], rel=1e-6)
    with pytest.raises(
        SceneError, match=r"there are 4 bodies: 'block', 'chip', 'twin', 'lens'.*Name one of them with 'body'"
    ):
        compile_scene(glass(tmp_path, kind="mesh", file="optics.step"))
    with pytest.raises(
        SceneError, match=r"unknown body 'lense'\. Did you mean 'lens'\? Known: block, chip, lens, twin\.$"
    ):
        compile_scene(glass(tmp_path, kind="mesh", file="optics.step", body="lense"))


def test_a_product_that_is_placed_three_times_is_three_bodies(tmp_path: Path) -> None:
    """Moved and turned: bodies of 1 mm³ each, named and chosen one by one, with their corners where the file puts them."""
    bodies = step_bodies(stored(tmp_path, step.board()))
    assert bodies is not None
    assert [body.name for body in bodies] == ["wedge 1", "wedge 2", "wedge 3"]
    assert all(body.closed for body in bodies)
    assert [body.volume for body in bodies] == pytest.approx([1.0, 1.0, 1.0], rel=1e-5)
    boxes = [(body.vertices.min(axis=0), body.vertices.max(axis=0)) for body in bodies]
    # Turned by 90° about z, (x, y, z) is (-y, x, z).
    expected = [((0, 0, 0), (1, 2, 3)), ((10, 0, 0), (11, 2, 3)), ((-2, 20, 5), (0, 21, 8))]
    for (low, high), (least, most) in zip(boxes, expected, strict=True):
        assert low == pytest.approx(least, abs=1e-5)
        assert high == pytest.approx(most, abs=1e-5)
    (face,) = compile_scene(glass(tmp_path, kind="mesh", file="optics.step", body="wedge 2")).record["faces"]
    assert face["shape"]["vertices"].min(axis=0) == pytest.approx([10, 0, 0], abs=1e-5)


def test_a_void_belongs_to_the_body_around_it(tmp_path: Path) -> None:
    """4³ less 2³ mm³, in one closed body whose inner surface is inside out."""
    bodies = step_bodies(stored(tmp_path, step.hollow(4.0, hole=2.0)))
    assert bodies is not None
    (body,) = bodies
    assert (body.name, body.closed) == ("hollow", True)
    assert body.volume == pytest.approx(64.0 - 8.0, rel=1e-5)


def test_faces_of_splines_smaller_than_any_look_are_seen(tmp_path: Path) -> None:
    """A ball with a void, both of rational splines: 4/3 π (10³ − 6³) mm³, to within the chords' share of both surfaces.

    The tolerance for a whole file leaves two flat triangles of each, and with them no void.
    """
    for tolerance in (0.2, 1e6):
        (body,) = read_step(tmp_path, step.hollow_ball(10.0, hole=6.0).encode(), tolerance)
        assert (body.name, body.closed) == ("bubble", True)
        most = 4.0 * np.pi * (10.0**2 + 6.0**2) * body.chord_error
        assert 0.0 < body.chord_error < 2.0 * min(tolerance, 1.2)
        assert body.volume == pytest.approx(4.0 / 3.0 * np.pi * (10.0**3 - 6.0**3), abs=most)


@pytest.mark.parametrize("height", [0.2, -0.1])
def test_a_face_of_splines_is_met_where_it_is(height: float, tmp_path: Path) -> None:
    """z = 1 + 16 h x (1 - x) y (1 - y): its volume, every corner on it, and the normals of the surface."""
    bodies = step_bodies(stored(tmp_path, step.domed_box(height)))
    assert bodies is not None
    (body,) = bodies
    assert body.closed
    assert body.volume == pytest.approx(1.0 + 16.0 * height / 36.0, abs=2.0 * body.chord_error)
    assert body.normals is not None
    top = (np.abs(body.normals[:, 2]) > 0.3) & (body.vertices[:, 2] > 0.5)
    x, y, z = body.vertices[top].T
    assert z == pytest.approx(1.0 + 16.0 * height * x * (1 - x) * y * (1 - y), abs=1e-5)
    slope = 16.0 * height * np.array([(1 - 2 * x) * y * (1 - y), x * (1 - x) * (1 - 2 * y)])
    true = np.stack([-slope[0], -slope[1], np.ones_like(x)], axis=1)
    assert np.abs(body.normals[top] - true / np.linalg.norm(true, axis=1, keepdims=True)).max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "mm"), [("mm", 1.0), ("inch", 25.4), ("m", 1000.0)])
def test_units_of_the_file_count(unit: str, mm: float, tmp_path: Path) -> None:
    """A ball of radius 10 in each of them; its triangles follow its size."""
    bodies = step_bodies(stored(tmp_path, step.sphere(10.0, unit=unit, product="bead")))
    assert bodies is not None
    (body,) = bodies
    assert body.name == "bead"
    assert body.size[2] == pytest.approx(20 * mm, rel=1e-6)
    assert np.linalg.norm(body.vertices, axis=1) == pytest.approx(10 * mm, rel=1e-6)
    assert 10_000 < len(body.triangles) < 100_000


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [None, 0.1, 0.01])
def test_the_stated_chord_error_is_that_of_the_triangles(tolerance: float | None, tmp_path: Path) -> None:
    """Of a ball of radius R: R less the smallest distance of a point of its triangles from the middle, by many points."""
    mesh = read_mesh(stored(tmp_path, step.sphere(10.0)), None, tolerance)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    grid = [(i / 12, j / 12) for i in range(13) for j in range(13 - i)]
    least = min(float(np.linalg.norm(a + (b - a) * u + (c - a) * v, axis=1).min()) for u, v in grid)
    assert mesh.chord_error == pytest.approx(10.0 - least, rel=0.05)


@pytest.mark.slow
def test_a_step_ball_looks_as_the_exact_ball(tmp_path: Path) -> None:
    """Default settings; with flat triangles the map is off by more than ten times as much."""
    stored(tmp_path, step.sphere(10.0))
    exact = seen(glass(tmp_path, kind="ball", radius=10.0))
    smooth = seen(glass(tmp_path, kind="mesh", file="optics.step"))
    assert et.compare(smooth, exact).nrmse < 0.003
    assert abs(smooth.values.sum() / exact.values.sum() - 1.0) < 0.003
    flat = seen(glass(tmp_path, kind="mesh", file="optics.step", tolerance=0.03, crease_angle=0))
    assert et.compare(flat, exact).nrmse > 0.02


@pytest.mark.slow
def test_a_step_lens_keeps_its_sharp_rim(tmp_path: Path) -> None:
    """Half a ball looks as a dome; corners of its base have the normal of the plane, to the last bit."""
    stored(tmp_path, step.half_ball(10.0))
    scene = glass(tmp_path, kind="mesh", file="optics.step")
    assert et.compare(seen(scene), seen(glass(tmp_path, kind="dome", radius=10.0))).nrmse < 0.003
    (face,) = compile_scene(scene).record["faces"]
    vertices, normals = face["shape"]["vertices"], face["shape"]["normals"]
    base = normals[:, 2] < -0.5
    assert base.sum() > 50
    assert (normals[base] == [0, 0, -1]).all()
    radial = vertices[~base] / np.linalg.norm(vertices[~base], axis=1, keepdims=True)
    assert np.abs(normals[~base] - radial).max() < 1e-6


def test_plane_faces_stay_as_they_are(tmp_path: Path) -> None:
    stored(tmp_path, step.tetrahedron(30.0))
    compiled = compile_scene(glass(tmp_path, kind="mesh", file="optics.step"))
    assert compiled.record["faces"][0]["shape"]["normals"] is None
    assert not [note for note in compiled.notes if "triangles" in note]


def test_the_chord_error_is_told_wherever_the_body_is_used(tmp_path: Path) -> None:
    """In the notes of scene, trace and map."""
    stored(tmp_path, step.sphere(10.0))
    scene = glass(tmp_path, kind="mesh", file="optics.step", tolerance=0.1)
    words = "mm away from them (chord error)"
    lmap = et.luminance_map(scene, et.Observer(25, 200, 60), et.Screen(22, 22, 4, 4), rays_per_pixel=16)
    for notes in (compile_scene(scene).notes, et.trace(scene, rays=1000, seed=1).notes, lmap.notes):
        assert any(words in note and note.startswith("it: ") for note in notes)


def test_a_tolerance_that_asks_for_too_many_triangles_is_refused(tmp_path: Path) -> None:
    stored(tmp_path, step.sphere(10.0, unit="m"))
    with pytest.raises(SceneError, match=r"0.001 mm would take about \S+ triangles.*Give a larger 'tolerance'"):
        compile_scene(glass(tmp_path, kind="mesh", file="optics.step", tolerance=0.001))


def test_flat_triangles_of_a_curved_glass_body_are_told() -> None:
    """Neighbours of a ball of 512 triangles turn by some 10°; not told if normals are smooth, or no light gets in."""
    ball = smooth_mesh("ball", 3)
    flat = {key: value for key, value in ball.items() if key != "crease_angle"}
    (note,) = compile_scene(Scene(solids=[{"shape": flat, "medium": "BK7"}])).notes
    assert "512 flat triangles stand for a curved surface: neighbours turn by 1" in note
    assert "crease_angle = 30" in note
    for solid in ({"shape": ball, "medium": "BK7"}, {"shape": flat, "finish": "absorber"}):
        assert not compile_scene(Scene(solids=[solid])).notes


# --- files that are damaged -------------------------------------------------------------------------------------------


def test_a_file_that_is_cut_off_is_told_with_its_line_and_nothing_is_printed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The library prints what it thinks of a file, which would stand in JSON."""
    text = step.half_ball(10.0)
    with pytest.raises(
        FormatError, match=r"holds no surface that can be read \(Line \d+: .*unexpected end of file.*\)"
    ):
        read_step(tmp_path, text[: len(text) // 2].encode(), None)
    assert capfd.readouterr() == ("", "")


def test_a_file_that_crashes_the_library_leaves_this_process_alone(tmp_path: Path) -> None:
    """An edge that is the edge of itself: the library follows it until its stack ends."""
    text, count = re.subn(
        r"#(\d+)=ORIENTED_EDGE\('',\*,\*,#\d+,", r"#\1=ORIENTED_EDGE('',*,*,#\1,", step.half_ball(10.0)
    )
    assert count == 2
    with pytest.raises(FormatError, match=r"Open CASCADE, which reads it, breaks off|holds no surface|no triangles"):
        read_step(tmp_path, text.encode(), None)


def test_what_the_library_said_before_it_broke_off_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that takes a part of the file, complains and is gone, whatever else it is sent."""
    program = tmp_path / "ends.py"
    program.write_text(
        "import sys; sys.stdin.buffer.read(8); sys.stderr.write('**** ERR StepFile : no room ****'); exit(3)"
    )
    monkeypatch.setattr(open_cascade_process, "__file__", str(program))
    with pytest.raises(FormatError, match=r"which reads it, breaks off \(no room\)\. The file is damaged"):
        read_step(tmp_path, step.half_ball(10.0).encode() + bytes(1 << 22), None)
