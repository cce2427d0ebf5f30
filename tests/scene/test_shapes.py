"""Shapes of surfaces: points that are known to lie on them, foci that focus, and normals on the side that is stated."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.description.files import Files
from etendue.errors import SceneError
from etendue.scene import Scene, compile_scene
from etendue.scene.shapes import SHAPES as REGISTRY
from etendue.scene.shapes import Asphere, Ellipsoid, Hyperboloid, Paraboloid, Trim
from etendue.scene.shapes.conics import Profile
from oracles.border import hits
from oracles.scenes import SHAPES


def face(shape: dict[str, Any], **keys: Any) -> list[dict[str, Any]]:
    faces: list[dict[str, Any]] = compile_scene(Scene(surfaces=[{"shape": shape, "finish": "mirror", **keys}])).record[
        "faces"
    ]
    return faces


def met(faces: list[dict[str, Any]], o: Any, d: Any) -> list[float]:
    d = np.array(d, dtype=float)
    return [round(t, 9) for t, _, _ in hits(faces, o=np.array(o, dtype=float), d=d / np.linalg.norm(d))]


def test_every_shape_is_tested() -> None:
    assert set(SHAPES) == set(REGISTRY)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHAPES)
def test_shapes_can_be_met_and_their_normal_can_be_turned_into_place(kind: str) -> None:
    """Every shape is met by some line; placing shape and lines alike changes no distance."""
    here = face({"kind": kind, **SHAPES[kind]})
    there = face({"kind": kind, **SHAPES[kind]}, at=[1, 2, 3], rotation=[0, 0, 90])
    rng = np.random.default_rng(1)
    count = 0
    for _ in range(100):
        o, d = rng.uniform(-1, 1, 3), rng.normal(size=3)
        found = met(here, o, d)
        turned = [np.array([-v[1], v[0], v[2]]) for v in (o, d)]
        assert met(there, turned[0] + [1, 2, 3], turned[1]) == pytest.approx(found, abs=1e-7)
        count += len(found)
    assert count > 10


@pytest.mark.parametrize(
    ("mirror", "target"),
    [
        (Paraboloid(focal_length=3, radius=8), None),
        (Paraboloid(focal_length=3, radius=8, origin="focus"), None),
        (Ellipsoid(focus=2, second_focus=9), 9.0),
        (Ellipsoid(focus=2, second_focus=9, origin="focus", radius=3), 9.0),
        (Hyperboloid(focus=2, virtual_focus=7), -7.0),
        (Hyperboloid(focus=2, virtual_focus=7, origin="focus"), -7.0),
    ],
)
def test_light_from_the_focus_goes_to_the_other(mirror: Any, target: float | None) -> None:
    """Reflected at the normal, rays from a focus lie on a line through the other one, or parallel to the axis."""
    shift = 0.0 if mirror.origin == "vertex" else mirror.vertex_form()[0]
    focus = np.array([0.0, 0.0, mirror.vertex_form()[0] - shift])
    record = mirror.sheet(Trim(), Files(Path())).shape
    rng = np.random.default_rng(2)
    count = 0
    for _ in range(200):
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        for t, _, _ in hits([{"shape": record, "frame": IDENTITY, "trims": [], "flip": False}], o=focus, d=d):
            if t <= 0:
                continue
            p = focus + t * d
            n = np.array([record["r2"] * p[0], record["r2"] * p[1], record["z2"] * p[2] + record["z1"] / 2])
            n /= np.linalg.norm(n)
            assert n @ d > 0, "the normal points outwards, away from the focus"
            out = d - 2 * (n @ d) * n
            axis = np.array([0.0, 0.0, 1.0]) if target is None else np.array([0.0, 0.0, target - shift]) - p
            assert np.linalg.norm(np.cross(out, axis)) / np.linalg.norm(axis) < 1e-9
            count += 1
    assert count > 30


IDENTITY = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("conic", [-4.0, -1.0, -0.4, 0.0, 1.5])
@pytest.mark.parametrize("radius", [-5.0, 5.0])
def test_the_record_of_a_conic_is_its_sag(radius: float, conic: float) -> None:
    """A line parallel to the axis meets the quadric once, at the height of the sag, on the side of positive normal z."""
    profile = Profile(radius_of_curvature=radius, conic=conic)
    end = min(profile.reach(), 4.0)
    record = {"shape": profile.record(0.0, end), "frame": IDENTITY, "trims": [], "flip": False}
    for r in np.linspace(0.01, 0.99, 23) * end:
        found = hits([record], o=np.array([r, 0.0, -50.0]), d=np.array([0.0, 0.0, 1.0]))
        assert len(found) == 1
        assert found[0][0] - 50.0 == pytest.approx(profile.sag(float(r)), abs=1e-9)
        assert found[0][1] > 0.0


def test_sag_of_special_aspheres() -> None:
    """A sphere by Pythagoras, a paraboloid by its equation, coefficients by hand."""
    assert Profile(radius_of_curvature=5).sag(3.0) == pytest.approx(1.0, rel=1e-15)
    assert Profile(radius_of_curvature=-5, conic=-1).sag(3.0) == pytest.approx(-0.9, rel=1e-15)
    assert Profile(coefficients=[1e-2, 1e-4]).sag(2.0) == pytest.approx(0.16 + 0.0064, rel=1e-15)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"radius_of_curvature": 5, "radius": 5.1}, "ends at 5 mm"),
        ({"radius_of_curvature": 5, "conic": 3, "radius": 2.6}, "ends at 2.5 mm"),
        ({"radius_of_curvature": 0, "radius": 1}, "leave it out for a flat surface"),
        ({"radius_of_curvature": 5, "radius": 2, "inner_radius": 2}, "below 'radius'"),
        ({"radius": 1e9, "coefficients": [0.0] * 15 + [1e300]}, "not finite"),
        ({"radius": math.nan}, "radius: is nan; it must be"),
    ],
)
def test_conics_that_do_not_exist(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        Asphere(**keys)


def test_trims() -> None:
    """What is left of a sphere of radius 5 and of a plane, met by lines along the axis and beside it."""
    cap = face({"kind": "sphere", "radius": 5}, trim={"z": [0, math.inf], "radius": [0, 3]})
    assert met(cap, [0, 0, 10], [0, 0, -1]) == [5.0]
    assert met(cap, [3.1, 0, 10], [0, 0, -1]) == []
    ring = face({"kind": "plane"}, trim={"radius": [1, 2], "half_spaces": [{"normal": [2, 0, 0], "distance": 0.5}]})
    assert met(ring, [-1.5, 0, 1], [0, 0, -1]) == [1.0]
    assert met(ring, [1.5, 0, 1], [0, 0, -1]) == []
    assert met(ring, [0.5, 0, 1], [0, 0, -1]) == []
    bowl = face(
        {"kind": "asphere", "radius": 4, "coefficients": [0.01]}, trim={"z": [-math.inf, 0.5], "radius": [1, 9]}
    )
    assert met(bowl, [2.5, 0, 1], [0, 0, -1]) == [pytest.approx(1 - 0.01 * 2.5**4)]
    assert met(bowl, [3, 0, 1], [0, 0, -1]) == []
    assert met(bowl, [0.9, 0, 1], [0, 0, -1]) == []


@pytest.mark.parametrize(
    ("shape", "trim", "words"),
    [
        ({"kind": "rectangle", "width": 1, "height": 1}, {"radius": [0, 1]}, "not round"),
        ({"kind": "plane"}, {"radius": [1, math.inf]}, "finite outer radius"),
        ({"kind": "disk", "radius": 1}, {"radius": [2, 3]}, "nothing is left"),
        ({"kind": "cylinder", "radius": 1, "height": 2}, {"z": [3, 4]}, "nothing is left"),
        ({"kind": "asphere", "radius": 1}, {"radius": [2, 3]}, "nothing is left"),
    ],
)
def test_trims_that_leave_nothing(shape: dict[str, Any], trim: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=f"surfaces.0..shape: trim.radius: .*{words}" if "radius" in trim else words):
        face(shape, trim=trim)


def test_a_cone_stops_at_its_tip() -> None:
    """The other nappe of the double cone is no part of the shape."""
    cone = face({"kind": "cone", "radius_bottom": 0, "radius_top": 3, "height": 3})
    assert met(cone, [1, 0, -5], [0, 0, 1]) == [6.0]
