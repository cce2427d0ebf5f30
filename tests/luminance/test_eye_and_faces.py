"""What a line that touches an edge, and a lamp that lies on a face, must not change: both are exact."""

from __future__ import annotations

from typing import Any

import etendue as et
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

SKY: dict[str, Any] = {
    "kind": "surface",
    "shape": {"kind": "sphere", "radius": 1e5},
    "side": "back",
    "flux": np.pi * 4 * np.pi * 1e10 * 1e-6,
}
BLOCK = {"kind": "block", "width": 2, "height": 2, "depth": 2}
ROD = {"kind": "rod", "radius": 2, "height": 2}
CONE = {"kind": "frustum", "radius_bottom": 2, "radius_top": 0, "height": 2}
PRISM = {"kind": "prism", "vertices": [[0, 0], [2, 0], [0, 2]], "height": 2}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "target"),
    [(BLOCK, (1, 1, 2)), (BLOCK, (1, 0, 2)), (ROD, (2, 0, 0)), (ROD, (0, 2, 2)), (CONE, (0, 0, 2)), (PRISM, (2, 0, 0))],
)
def test_a_view_aimed_at_an_edge_is_lit_as_any_other(shape: dict[str, Any], target: tuple[float, float, float]) -> None:
    # In a surround of luminance 1 lossless optics are not seen: each pixel is 1, whatever the solid, and from inside it n².
    rng = np.random.default_rng(1)
    scene = et.Scene(sources=[SKY], solids=[{"shape": shape, "medium": {"index": 1.5}}])
    how = et.PathTracing(rays_per_pixel=4, forward_rays=0, gather=False)
    views = [
        (30, 0),
        (45, 180),
        (135, 45),
        *((np.degrees(np.arccos(c)), p) for c, p in rng.uniform((-1, 0), (1, 360), (25, 2))),
    ]
    for theta, phi in views:
        lmap = et.luminance_map(scene, et.Observer(theta, phi, 10, target=target), et.Screen(6, 6, 3, 3), method=how)
        assert np.allclose(lmap.values, 1, rtol=1e-9, atol=0), (theta, phi)


def test_an_eye_within_a_solid_may_look_at_its_edge() -> None:
    # In the middle of a block of so low an index that nothing is trapped: n².
    scene = et.Scene(sources=[SKY], solids=[{"shape": BLOCK, "medium": {"index": 1.1}}])
    eye = et.Observer(np.degrees(np.arccos(-(3**-0.5))), 225, 3**0.5, target=(1, 1, 2))
    lmap = et.luminance_map(scene, eye, et.Screen(0.1, 0.1, 3, 3), method=et.PathTracing(rays_per_pixel=4))
    assert np.allclose(lmap.values, 1.1**2, rtol=1e-9, atol=0)


@pytest.mark.parametrize(("major", "minor", "phi"), [(1000, 1, 0), (1000, 0.1, 0.01), (100, 0.1, 0.01), (10, 0.1, 2.4)])
def test_a_thin_torus_is_met_in_its_plane(major: float, minor: float, phi: float) -> None:
    # A line in the plane meets the tube where the ball around the torus touches it.
    torus: dict[str, Any] = {
        "shape": {"kind": "torus", "major_radius": major, "minor_radius": minor},
        "medium": {"index": 1.5},
    }
    scene = et.Scene(sources=[SKY], solids=[torus])
    for distance in (major / 20, major / 7, major / 3, major):
        eye = et.Observer(90, phi, distance, target=(major, 0, 0))
        lmap = et.luminance_map(
            scene, eye, et.Screen(4 * minor, 4 * minor, 4, 4), method=et.PathTracing(rays_per_pixel=16)
        )
        assert np.allclose(lmap.values, 1, rtol=1e-9, atol=0), distance


@pytest.mark.parametrize("rotation", [[0, 0, 0], [10, 0, 0], [20, 35, 50], [-70, 15, 130]])
@pytest.mark.parametrize(("top", "inwards"), [(True, False), (True, True), (False, False), (False, True)])
@pytest.mark.parametrize("gap", [0, 1e-10, 1e-7])
def test_a_lamp_on_a_face_is_seen_once(rotation: list[float], top: bool, inwards: bool, gap: float) -> None:
    # A slab of index n, and a lamp of luminance L on one of its faces or `gap` beyond it, where it shines to. From there it
    # has L; through the other face (1 − r) L/n², with Fresnel's r: what is mirrored to and fro passes beside the lamp.
    index, angle, turn = 1.5, 0.7, Rotation.from_euler("xyz", rotation, degrees=True)
    shift = np.array([3.3, 7.7, 1.1])
    up = 1 if top != inwards else -1
    point = shift + turn.apply([0, 0, (2 if top else 0) + up * gap])
    lamp: dict[str, Any] = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": np.pi**2 * 1e-6}
    lamp |= {"side": "front" if up > 0 else "back", "rotation": rotation, "at": point.tolist()}
    slab: dict[str, Any] = {
        "shape": {"kind": "block", "width": 400, "height": 400, "depth": 2},
        "medium": {"index": index},
    }
    slab |= {"rotation": rotation, "at": shift.tolist()}
    u = turn.apply([np.sin(angle), 0, up * np.cos(angle)])
    eye = et.Observer(np.degrees(np.arccos(u[2])), np.degrees(np.arctan2(u[1], u[0])), 1000, target=tuple(point))
    lmap = et.luminance_map(
        et.Scene(sources=[lamp], solids=[slab]),
        eye,
        et.Screen(0.2, 0.2, 2, 2),
        method=et.PathTracing(rays_per_pixel=16),
    )
    c, t = np.cos(angle), np.sqrt(1 - (np.sin(angle) / index) ** 2)
    r = (((c - index * t) / (c + index * t)) ** 2 + ((index * c - t) / (index * c + t)) ** 2) / 2
    expected = (1 - r) / index**2 if inwards else 1
    assert np.allclose(lmap.values, expected, rtol=1e-4, atol=0)


@pytest.mark.parametrize("distance", [10, 1e3, 1e5])
@pytest.mark.parametrize("depth", [1e-7, 1e-5])
def test_a_lamp_just_below_a_face_is_within_the_glass(distance: float, depth: float) -> None:
    # Along the normal, (1 − r) L/n² Σ r²ᵏ = L/(n² (1 + r)), however far off the eye is.
    lamp: dict[str, Any] = {
        "kind": "surface",
        "shape": {"kind": "disk", "radius": 1},
        "flux": np.pi**2 * 1e-6,
        "at": [0, 0, 2 - depth],
    }
    slab: dict[str, Any] = {
        "shape": {"kind": "block", "width": 400, "height": 400, "depth": 2},
        "medium": {"index": 1.5},
    }
    eye, screen = et.Observer(0, 0, distance, target=(0, 0, 2)), et.Screen(0.02, 0.02, 1, 1)
    lmap = et.luminance_map(
        et.Scene(sources=[lamp], solids=[slab]), eye, screen, method=et.PathTracing(rays_per_pixel=16)
    )
    assert np.allclose(lmap.values, 1 / (1.5**2 * 1.04), rtol=1e-4, atol=0)


@pytest.mark.parametrize("inwards", [False, True])
@pytest.mark.parametrize(("lamp", "solid", "theta"), [("sphere", "ball", 33), ("cylinder", "rod", 90)])
def test_a_lamp_around_a_solid_is_seen_once(lamp: str, solid: str, theta: float, inwards: bool) -> None:
    # Along the normal: L if the lamp shines outwards; else (1 − r) L/n² Σ rᵏ = L/n²: what is mirrored meets it again.
    keys: dict[str, Any] = {"radius": 2} if lamp == "sphere" else {"radius": 2, "height": 4}
    area = 4 * np.pi * 4 if lamp == "sphere" else 2 * np.pi * 2 * 4
    at = [3.3, 7.7, 1.1]
    source: dict[str, Any] = {"kind": "surface", "shape": {"kind": lamp, **keys}, "flux": np.pi * area * 1e-6, "at": at}
    source["side"] = "back" if inwards else "front"
    body: dict[str, Any] = {"shape": {"kind": solid, **keys}, "medium": {"index": 1.5}, "at": at}
    middle = (3.3, 7.7, 1.1 if lamp == "sphere" else 3.1)
    scene, eye = et.Scene(sources=[source], solids=[body]), et.Observer(theta, 21, 1000, target=middle)
    lmap = et.luminance_map(scene, eye, et.Screen(0.02, 0.02, 2, 2), method=et.PathTracing(rays_per_pixel=16))
    assert np.allclose(lmap.values, 1 / 1.5**2 if inwards else 1, rtol=1e-4, atol=0)


def test_lines_that_are_lost_are_told() -> None:
    # A line can be in four solids at once. Of five balls within each other, which bend nothing, the innermost is not seen: a
    # share of π·2²/14² of a screen of 14 mm, far off.
    balls = [{"shape": {"kind": "ball", "radius": radius}, "medium": {"index": 1.0}} for radius in (6, 5, 4, 3, 2)]
    eye, screen = et.Observer(0, 0, 1e4), et.Screen(14, 14, 28, 28)
    how = et.PathTracing(rays_per_pixel=64, forward_rays=0, gather=False)
    with pytest.warns(et.SceneWarning, match="all hold"):
        lmap = et.luminance_map(et.Scene(sources=[SKY], solids=balls), eye, screen, method=how)
    (note,) = [note for note in lmap.notes if "were lost" in note]
    assert f"with {np.pi * 4 / 14**2:.2g} of the weight" in note
    assert lmap.values[14, 14] == 0
    assert np.isclose(lmap.values[0, 0], 1, rtol=1e-9)
    whole = et.luminance_map(et.Scene(sources=[SKY], solids=balls[:4]), eye, screen, method=how)
    assert np.allclose(whole.values, 1, rtol=1e-9)
    assert not any("lost" in note for note in whole.notes)
