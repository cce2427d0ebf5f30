"""Sections of scenes: curves that lie on the faces, without a gap and without a join that is none.

Two routes that know nothing of how the curves are found: closed forms of points, lengths and areas; and lines in general
position within the section, which must cross the curves of a face as often as the tracer meets the face, and there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.scene import Scene, compile_scene
from etendue.scene.bodies import BODIES
from etendue.scene.extents import box_of
from etendue.scene.face_rows import FaceRows
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.shape import Trim
from etendue.tracing.section import Section
from etendue.tracing.section_chains import chains, rings
from etendue.tracing.sections import cut_faces
from oracles.scenes import OCTAHEDRON, OCTANTS
from scipy.integrate import quad

Array = npt.NDArray[np.float64]

FLATNESS = 3e-5
"""What is promised of curves and their chords, as a share of the size."""

HERE = Placement()
TILTED = Placement(at=(0.3, -0.2, 0.7), rotation=(23, -31, 47))

SAMPLES: dict[str, dict[str, Any]] = {
    "rectangle": {"width": 3, "height": 2},
    "disk": {"radius": 3},
    "annulus": {"inner_radius": 1, "outer_radius": 3},
    "polygon": {"vertices": [(-2, -2), (3, -2), (3, 3), (0.5, -1), (-2, 2)]},
    "sphere": {"radius": 2},
    "hemisphere": {"radius": 3},
    "cylinder": {"radius": 2, "height": 5},
    "cone": {"radius_bottom": 0, "radius_top": 3, "height": 3},
    "torus": {"major_radius": 5, "minor_radius": 1},
    "conic": {"radius_of_curvature": 10, "conic": 0.5, "radius": 7, "inner_radius": 1},
    "asphere": {"radius_of_curvature": 10, "conic": -1, "coefficients": [1e-4, -1e-6], "radius": 8},
    "paraboloid": {"focal_length": 5, "radius": 20, "inner_radius": 2},
    "ellipsoid": {"focus": 10, "second_focus": 40},
    "hyperboloid": {"focus": 2, "virtual_focus": 6, "radius": 5},
    "mesh": {"vertices": OCTAHEDRON, "triangles": OCTANTS},
}
"""Every shape that has an end."""

TRIMS = {
    "rectangle": Trim(half_spaces=[{"normal": (1, 1, 0), "distance": 1}]),
    "sphere": Trim(z=(-1, 1.5), half_spaces=[{"normal": (1, 0, 1), "distance": 0.5}]),
    "torus": Trim(half_spaces=[{"normal": (1, 2, 0.3), "distance": 1}]),
    "mesh": Trim(half_spaces=[{"normal": (1, 2, 0.3), "distance": 0.1}]),
    "disk": Trim(radius=(1, 2)),
}


def face(kind: str, place: Placement = HERE, trim: Trim | None = None, **keys: Any) -> dict[str, Any]:
    sheet = SHAPES[kind](**(keys or SAMPLES.get(kind, {}))).sheet(trim or Trim(), Files())
    return {"shape": sheet.shape, "frame": place.frame().record(), "trims": sheet.trims}


def cut(kind: str, section: str = "y=0", place: Placement = HERE, trim: Trim | None = None, **keys: Any) -> list[Array]:
    return cut_faces([face(kind, place, trim, **keys)], Section.parse(section))[0]


def is_closed(curve: Array) -> bool:
    return bool((curve[0] == curve[-1]).all())


def length(curve: Array) -> float:
    return float(np.hypot(*np.diff(curve, axis=0).T).sum())


def area(ring: Array) -> float:
    (x, y), (right, up) = ring[:-1].T, ring[1:].T
    return abs(float((x * up - right * y).sum())) / 2


def ends(curves: list[Array]) -> list[tuple[float, ...]]:
    return sorted(tuple(float(c) for c in point) for curve in curves for point in curve[[0, -1]])


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_sphere_is_cut_in_one_closed_circle(scale: float) -> None:
    (curve,) = cut("sphere", f"y={1.2 * scale}", radius=2 * scale)
    assert is_closed(curve)
    radius = 1.6 * scale
    np.testing.assert_allclose(np.hypot(*curve.T), radius, rtol=1e-10)
    # Of a circle the chords are shorter by (their number's) 1 - sinc; sagittas up to 3e-5 of 2 R make that 12e-5 at most.
    assert 2 * math.pi * radius * (1 - 4 * FLATNESS) < length(curve) < 2 * math.pi * radius


def test_a_paraboloid_is_cut_in_two_arms_that_end_at_hole_and_rim() -> None:
    curves = cut("paraboloid")
    assert len(curves) == 2
    for curve in curves:
        np.testing.assert_allclose(curve[:, 1], curve[:, 0] ** 2 / 20, atol=1e-10)
    np.testing.assert_allclose(ends(curves), [(-20, 20), (-2, 0.2), (2, 0.2), (20, 20)], atol=1e-9)
    arm = quad(lambda x: math.hypot(1, x / 10), 2, 20)[0]
    np.testing.assert_allclose([length(curve) for curve in curves], arm, rtol=1e-4)


def test_a_block_is_cut_in_the_four_sides_of_a_rectangle() -> None:
    compiled = compile_scene(Scene(solids=[{"shape": {"kind": "block", "width": 4, "height": 6, "depth": 3},
                                            "medium": "PC"}]))  # fmt: skip
    curves = cut_faces(compiled.record["faces"], Section("y", 1.0))
    sides = dict(zip(compiled.face_names, curves, strict=True))
    assert not sides["solids[0].front"]
    assert not sides["solids[0].back"]
    assert ends(sides["solids[0].top"]) == [(-2, 3), (2, 3)]
    assert ends(sides["solids[0].left"]) == [(-2, 0), (-2, 3)]
    (ring,) = rings([c for found in curves for c in found], 1e-9)
    assert area(ring) == pytest.approx(12, rel=1e-12)


def test_a_torus_is_cut_in_two_tubes_or_two_circles() -> None:
    tubes = cut("torus")
    assert [is_closed(c) for c in tubes] == [True, True]
    for curve in tubes:
        np.testing.assert_allclose(np.hypot(abs(curve[:, 0]) - 5, curve[:, 1]), 1, rtol=1e-10)
    circles = sorted(cut("torus", "z=0.6"), key=length)
    assert [is_closed(c) for c in circles] == [True, True]
    for curve, radius in zip(circles, (4.2, 5.8), strict=True):
        np.testing.assert_allclose(np.hypot(*curve.T), radius, rtol=1e-9)


def test_a_thin_torus_has_tubes_thinner_than_a_cell() -> None:
    tubes = cut("torus", major_radius=50, minor_radius=0.05)
    assert [is_closed(c) for c in tubes] == [True, True]
    for tube in tubes:
        np.testing.assert_allclose(np.hypot(abs(tube[:, 0]) - 50, tube[:, 1]), 0.05, rtol=1e-8)
        # Chords lie up to 3e-5 of 100 mm inside of the circle.
        assert 1 - 2 * FLATNESS * 100 / 0.05 < area(tube) / (math.pi * 0.05**2) < 1


def test_the_tip_of_a_cone_is_in_its_curve() -> None:
    (curve,) = cut("cone", radius_bottom=0, radius_top=0.1, height=3)
    np.testing.assert_allclose(np.abs(curve[:, 0]) * 30, curve[:, 1], atol=1e-9)
    assert np.hypot(*curve.T).min() < 2e-3
    np.testing.assert_allclose(ends([curve]), [(-0.1, 3), (0.1, 3)], atol=1e-9)


def test_gaps_stay_gaps() -> None:
    rim, hole = math.sqrt(8.75), math.sqrt(0.75)
    expected = [(-rim, 0), (-hole, 0), (hole, 0), (rim, 0)]
    np.testing.assert_allclose(ends(cut("annulus", "y=0.5")), expected, atol=1e-9)
    # A slot of 1/600 of the width, less than a cell of the grid.
    slotted = cut("annulus", inner_radius=0.005, outer_radius=3)
    np.testing.assert_allclose(ends(slotted), [(-3, 0), (-0.005, 0), (0.005, 0), (3, 0)], atol=1e-9)


def test_slots_narrower_than_a_cell_are_found_wherever_they_are() -> None:
    # 1/600 of the width each, a cell of the grid being 1/370: some lie between two lines of it.
    slots = [(x, x + 0.01) for x in (0.31, 0.87, 1.512, 2.203, 2.94, 3.333, 4.1, 4.777, 5.5)]
    teeth = [corner for x, end in slots for corner in ((x, 2), (x, 0.5), (end, 0.5), (end, 2))]
    curves = cut("polygon", "y=1", vertices=[(0, 0), (0, 2), *teeth, (6, 2), (6, 0)])
    expected = sorted([0.0, 6.0, *(x for slot in slots for x in slot)])
    np.testing.assert_allclose([x for x, _ in ends(curves)], expected, atol=1e-9)


@pytest.mark.parametrize("at", [1.9999, 1.99999])
def test_a_trifle_of_a_face_is_found(at: float) -> None:
    (curve,) = cut("sphere", f"y={at}", radius=2)
    assert is_closed(curve)
    # The section is laid 1e-11 of the size farther on, which counts so near to the end of the sphere.
    np.testing.assert_allclose(np.hypot(*curve.T), math.sqrt(4 - (at + 2e-11) ** 2), rtol=1e-9)


def test_what_stands_on_the_section_is_cut_just_above_it() -> None:
    (rim,) = cut("hemisphere", "z=0")
    np.testing.assert_allclose(np.hypot(*rim.T), 3, rtol=1e-9)
    block = compile_scene(
        Scene(solids=[{"shape": {"kind": "block", "width": 2, "height": 4, "depth": 1}, "medium": "PC"}])
    )
    found = [c for curves in cut_faces(block.record["faces"], Section("z", 0.0)) for c in curves]
    (ring,) = rings(found, 1e-9)
    assert area(ring) == pytest.approx(8, rel=1e-9)
    assert not cut("rectangle", "z=0")


# --- lines in general position ---------------------------------------------------------------------------------------


def crossed(curves: list[Array], start: Array, along: Array) -> int:
    """How often a line crosses polylines."""
    normal = np.array([-along[1], along[0]])
    sides = [(curve - start) @ normal > 0 for curve in curves]
    return sum(int((side[:-1] != side[1:]).sum()) for side in sides)


def far_from(curves: list[Array], point: Array) -> float:
    """Distance of a point from polylines."""
    nearest = math.inf
    for curve in curves:
        step = np.diff(curve, axis=0)
        t = np.clip(((point - curve[:-1]) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-300), 0, 1)
        nearest = min(nearest, float(np.hypot(*(curve[:-1] + t[:, None] * step - point).T).min()))
    return nearest


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "trimmed"), [*((kind, False) for kind in SHAPES if kind != "plane"), *((kind, True) for kind in TRIMS)]
)
@pytest.mark.parametrize("section", ["y=0.1", "x=-0.4", "z=0.9"])
def test_lines_cross_the_curves_as_often_as_they_meet_the_face(kind: str, section: str, trimmed: bool) -> None:
    part, plane = face(kind, TILTED, TRIMS[kind] if trimmed else None), Section.parse(section)
    (curves,) = cut_faces([part], plane)
    record = compile_scene(Scene(surfaces=[{"shape": {"kind": "disk", "radius": 1}, "finish": "absorber"}])).record
    core = _core.Scene({**record, "faces": FaceRows.of([{**record["faces"][0], **part}])})
    size = float(np.ptp(box_of(part["shape"]), axis=0).max())
    rng = np.random.default_rng(7)
    angle, shift = rng.uniform(0, 2 * np.pi, 300), rng.uniform(-size, size, 300)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    middle = plane.flat(np.array(TILTED.at))
    start = middle + shift[:, None] * along[:, ::-1] * (-1, 1) - 3 * size * along
    lines, _, t = _core.scene_crossings(core, plane.points(start), plane.directions(along))
    for i in range(300):
        assert crossed(curves, start[i], along[i]) == (lines == i).sum(), f"line {i}"
    for i, distance in zip(lines.astype(int), t, strict=True):
        assert far_from(curves, start[i] + distance * along[i]) <= FLATNESS * size
    assert len(lines) > 50 or kind in {"rectangle", "disk", "annulus", "polygon", "mesh", "sphere"}, "few lines met it"


def test_whole_rectangles_are_cut_as_polygons_are() -> None:
    corners = [(-1.5, -1), (1.5, -1), (1.5, 1), (-1.5, 1)]
    for section in ("y=0.1", "x=-0.4", "z=0.9"):
        whole = cut("rectangle", section, TILTED)
        np.testing.assert_allclose(ends(whole), ends(cut("polygon", section, TILTED, vertices=corners)), atol=1e-9)
        assert len(whole) == 1


def test_a_plane_is_cut_within_the_window_only() -> None:
    part = face("plane", Placement(at=(0, 0, 1), toward=(1, 0, 1)))
    section = Section("y", 0.0)
    assert cut_faces([part], section) == [[]]
    ((curve,),) = cut_faces([part], section, (-2.0, 2.0, -3.0, 3.0))
    np.testing.assert_allclose(curve.sum(axis=1), 1, atol=1e-9)
    assert curve[:, 0].min() < -1.99 < 1.99 < curve[:, 0].max()


# --- solids ----------------------------------------------------------------------------------------------------------

LENS = {
    "radius": 3,
    "thickness": 2,
    "front": {"radius_of_curvature": 7},
    "back": {"radius_of_curvature": -9, "conic": -2},
}


def lens_area() -> float:
    def thickness(r: float) -> float:
        front, back = r * r / 7 / (1 + math.sqrt(1 - r * r / 49)), -r * r / 9 / (1 + math.sqrt(1 + r * r / 81))
        return 2 + back - front

    return 2 * quad(thickness, 0, 3)[0]


AREAS: dict[str, tuple[dict[str, Any], float]] = {
    "ball": ({"radius": 2}, 4 * math.pi),
    "dome": ({"radius": 2}, 2 * math.pi),
    "rod": ({"radius": 2, "height": 3}, 12),
    "frustum": ({"radius_bottom": 3, "radius_top": 0, "height": 4}, 12),
    "block": ({"width": 2, "height": 3, "depth": 5}, 10),
    "lens": (LENS, lens_area()),
    "prism": ({"vertices": [(-1, -1), (3, -1), (3, 1), (1, 1), (1, 5), (-1, 5)], "height": 2}, 8),
    "prismatic-film": ({"width": 50, "height": 20, "thickness": 0.4, "pitch": 0.5}, 50 * 0.4 + 100 * 0.5 * 0.25 / 2),
    "torus": ({"major_radius": 5, "minor_radius": 1}, 2 * math.pi),
    "mesh": ({"vertices": OCTAHEDRON, "triangles": OCTANTS}, 8),
}


@pytest.mark.parametrize("kind", BODIES)
def test_the_curves_of_a_solid_close_around_its_section(kind: str) -> None:
    keys, expected = AREAS[kind]
    scene = Scene(solids=[{"name": "it", "shape": {"kind": kind, **keys}, "medium": "PC", "at": (0.5, -3, 7)}])
    faces = compile_scene(scene).record["faces"]
    curves = [c for found in cut_faces(faces, Section("y", -3.0)) for c in found]
    # Chords lie up to 3e-5 of the size inside of a circle: 12e-5 of its area at most.
    assert sum(area(ring) for ring in rings(curves, 1e-6)) == pytest.approx(expected, rel=1e-4)


def test_every_flank_of_a_film_is_cut() -> None:
    keys, _ = AREAS["prismatic-film"]
    compiled = compile_scene(Scene(solids=[{"shape": {"kind": "prismatic-film", **keys}, "medium": "PC"}]))
    curves = dict(zip(compiled.face_names, cut_faces(compiled.record["faces"], Section("y", 0.0)), strict=True))
    assert {name.split(".")[1] for name, found in curves.items() if not found} == {"front", "back"}
    assert len(curves) == 205
    assert all(
        length(found[0]) == pytest.approx(0.25 * math.sqrt(2)) for name, found in curves.items() if "prism " in name
    )


# --- parts -----------------------------------------------------------------------------------------------------------

BOXES: list[tuple[str, dict[str, Any], Trim, list[list[float]]]] = [
    ("sphere", {"radius": 2}, Trim(z=(1, 9)), [[-math.sqrt(3)] * 2 + [1], [math.sqrt(3)] * 2 + [2]]),
    ("sphere", {"radius": 2}, Trim(radius=(1, 1.5)), [[-1.5, -1.5, -math.sqrt(3)], [1.5, 1.5, math.sqrt(3)]]),
    ("cone", {"radius_bottom": 1, "radius_top": 3, "height": 4}, Trim(z=(1, 2)), [[-2, -2, 1], [2, 2, 2]]),
    ("cylinder", {"radius": 1, "height": 4}, Trim(), [[-1, -1, 0], [1, 1, 4]]),
    ("paraboloid", {"focal_length": 5, "radius": 20, "inner_radius": 2}, Trim(), [[-20, -20, 0.2], [20, 20, 20]]),
    ("paraboloid", {"focal_length": 5, "origin": "focus"}, Trim(z=(-9, 0)), [[-10, -10, -5], [10, 10, 0]]),
    ("ellipsoid", {"focus": 10, "second_focus": 40}, Trim(), [[-20, -20, 0], [20, 20, 50]]),
    ("hyperboloid", {"focus": 2, "virtual_focus": 6, "radius": 2 * math.sqrt(3) * math.sqrt(3)}, Trim(),
     [[-6, -6, 0], [6, 6, 2]]),
    ("conic", {"radius_of_curvature": -5, "radius": 4, "inner_radius": 3}, Trim(), [[-4, -4, -2], [4, 4, -1]]),
    ("conic", {"radius_of_curvature": None, "radius": 4}, Trim(), [[-4, -4, 0], [4, 4, 0]]),
    ("asphere", {"radius_of_curvature": None, "coefficients": [0.01], "radius": 2}, Trim(), [[-2, -2, 0], [2, 2, 0.16]]),
    ("polygon", {"vertices": [(0, 1), (4, 2), (1, 7)]}, Trim(), [[0, 1, 0], [4, 7, 0]]),
    ("paraboloid", {"focal_length": 5}, Trim(), [[-math.inf, -math.inf, 0], [math.inf] * 3]),
    ("plane", {}, Trim(), [[-math.inf, -math.inf, 0], [math.inf, math.inf, 0]]),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "keys", "trim", "expected"), BOXES)
def test_boxes_fit(kind: str, keys: dict[str, Any], trim: Trim, expected: list[list[float]]) -> None:
    np.testing.assert_allclose(box_of(SHAPES[kind](**keys).sheet(trim, Files()).shape), expected, atol=1e-9)


def test_chains_end_where_three_meet() -> None:
    assert sorted(map(len, chains(5, np.array([[0, 1], [1, 2], [1, 3], [3, 4]])))) == [2, 2, 3]
    assert chains(3, np.zeros((0, 2), dtype=np.int64)) == []


def test_rings_leave_out_what_does_not_close() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    pieces = [square[[0, 1]], square[[2, 1]], square[2:] + 1e-8]
    (ring,) = rings(pieces, 1e-6)
    assert area(ring) == pytest.approx(1, rel=1e-6)
    assert rings(pieces[:2], 1e-6) == []


@pytest.mark.parametrize("text", ["y", "w=1", "y=", "y=nan", "y=inf", "y==0", "0", "y=0,1", ""])
def test_a_section_is_an_equation(text: str) -> None:
    with pytest.raises(ArgumentError, match=r"e\.g\. y=0"):
        Section.parse(text)
