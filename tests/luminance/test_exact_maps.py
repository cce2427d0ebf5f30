"""Lines of sight through optics with an answer in closed form, one by one; and fluxes that maps must add up to."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.scene import compile_scene
from numpy.polynomial.legendre import leggauss
from oracles.verdicts import LARGEST_Z, REVERSE, assert_agree, assert_differ

Array = npt.NDArray[np.float64]
NEEDLE = et.Screen(1e-9, 1e-9, 1, 1)
"""One line of sight, to a rounding."""


def along(observers: list[et.Observer], **scene: Any) -> Array:
    """Luminance along one line of sight for each observer, towards its target, over 10⁶ cd/m²."""
    maps = et.luminance_map(et.Scene(**scene), observers, NEEDLE, rays_per_pixel=4)
    for lmap in maps:
        # None of four passes has met chance.
        assert lmap.standard_error[0, 0] <= 1e-9 * lmap.values[0, 0]
    return np.array([lmap.values[0, 0] for lmap in maps]) / 1e6


def transmittance(inside: Array, n: float) -> Array:
    """Of a surface from n into 1 for unpolarised light, by the sine of the angle in the glass."""
    ci, ct = np.sqrt(1 - inside**2), np.sqrt(1 - (n * inside) ** 2)
    s, p = (n * ci - ct) / (n * ci + ct), (ci - n * ct) / (ci + n * ct)
    return 1 - (s * s + p * p) / 2


def trails(rays: int, **scene: Any) -> list[Array]:
    """Where rays start, turn and end."""
    return _core.trace_trails(_core.Scene(compile_scene(et.Scene(**scene)).record), rays, 1, 100, 100.0)


def looking(point: Array, direction: Array) -> et.Observer:
    """An observer with the line of sight through a point in a direction."""
    theta = math.degrees(math.atan2(math.hypot(direction[0], direction[1]), -direction[2]))
    phi = math.degrees(math.atan2(-direction[1], -direction[0]))
    return et.Observer(theta, phi, 100, target=tuple(point))


def lines_to(targets: Array, theta: float, phi: float, distance: float) -> list[et.Observer]:
    return [et.Observer(theta, phi, distance, target=tuple(target)) for target in targets]


# --- V3: the aplanatic sphere ------------------------------------------------------------------------------------------

N, R = 1.5, 6.0
CAP = 3.5
"""Rim of the luminous cap, on the sphere of radius R/n = 4 about the centre of the ball."""
BLACK = 3.7
"""Rim of what is black behind it."""


def aplanatic() -> dict[str, Any]:
    """A cap of radius R/n below the centre of a ball, which shines towards the centre; behind it all is black."""
    cap = {"kind": "conic", "radius_of_curvature": R / N, "radius": CAP}
    area = 2 * math.pi * R / N * (R / N - math.sqrt((R / N) ** 2 - CAP**2))
    return {
        "media": {"glass": {"index": N}},
        "sources": [{"kind": "surface", "shape": cap, "flux": math.pi * area, "at": [0, 0, -R / N]}],
        "solids": [{"name": "ball", "shape": {"kind": "ball", "radius": R}, "medium": "glass"}],
        "surfaces": [{"shape": {**cap, "radius": BLACK}, "at": [0, 0, -R / N - 1e-6], "finish": "absorber"}],
    }


def test_rays_from_an_aplanatic_point_come_from_another() -> None:
    """V3: every refracted ray, carried back, passes n² P, whichever way it left P; sin i' = n sin i = sin ∠(P → C, ray)."""
    seen = 0
    for points in trails(4000, **aplanatic()):
        if len(points) != 3 or np.linalg.norm(points[-1]) < 50:
            continue  # reflected within
        start, turn, end = points
        seen += 1
        ray = (end - turn) / np.linalg.norm(end - turn)
        image = N**2 * start
        assert np.linalg.norm(np.cross(image - turn, ray)) < 1e-9
        within = (turn - start) / np.linalg.norm(turn - start)
        sine = np.linalg.norm(np.cross(-start, within)) / np.linalg.norm(start)
        assert np.linalg.norm(np.cross(turn / R, ray)) == pytest.approx(sine, abs=1e-9)
    assert seen > 2500


@pytest.mark.slow
def test_luminance_of_an_aplanatic_image() -> None:
    """V3: L = T(i) L₀/n² where the line of sight, carried on, meets the image of the cap on radius nR; else darkness."""
    rng = np.random.default_rng(3)
    toward = rng.normal(size=(4000, 3)) * [0.5, 0.5, 1.0]
    toward[:, 2] = -np.abs(toward[:, 2])
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    middle = np.cross(toward, rng.normal(size=(4000, 3)))
    middle *= (rng.uniform(0, 0.99 * R, 4000) / np.linalg.norm(middle, axis=1))[:, None]
    offset = np.linalg.norm(middle, axis=1)
    image = middle + np.sqrt((N * R) ** 2 - offset**2)[:, None] * toward
    enters = middle - np.sqrt(R**2 - offset**2)[:, None] * toward
    point = image / N**2
    # On its way to the point the line passes the sphere of the cap once more, where nothing may be in its way.
    inward = (point - enters) / np.linalg.norm(point - enters, axis=1)[:, None]
    before = point - 2 * (point * inward).sum(1)[:, None] * inward
    free = before[:, 2] > 0
    radius = np.hypot(point[:, 0], point[:, 1])
    lit = free & (point[:, 2] < 0) & (radius < CAP - 1e-6)
    dark = free & (point[:, 2] < 0) & (radius > CAP + 1e-6) & (radius < BLACK - 1e-6)
    assert lit.sum() > 500
    assert dark.sum() > 20
    lit[np.flatnonzero(lit)[200:]] = False
    expected = transmittance(offset[lit] / R / N, N) / N**2
    assert np.allclose(along([looking(*line) for line in zip(middle[lit], toward[lit], strict=True)], **aplanatic()),
                       expected, rtol=1e-9, atol=0)  # fmt: skip
    unseen = along([looking(*line) for line in zip(middle[dark], toward[dark], strict=True)], **aplanatic())
    assert (unseen == 0).all()


# --- V4: a disk in a dome, seen from afar ------------------------------------------------------------------------------

DOME_N, DOME_R, DISK = 1.41, 3.0, 1.2


def dome(**more: Any) -> dict[str, Any]:
    return {
        "media": {"glass": {"index": DOME_N}},
        "solids": [{"name": "dome", "shape": {"kind": "dome", "radius": DOME_R}, "medium": "glass",
                    "finishes": {"base": "absorber"}}],
        **more,
    }  # fmt: skip


def object_radius(h: Array) -> Array:
    """ρ = h/(n cos(i − i')), sin i = h/R, sin i' = h/(n R)."""
    return h / (DOME_N * np.cos(np.arcsin(h / DOME_R) - np.arcsin(h / (DOME_N * DOME_R))))


def test_parallel_light_meets_the_base_of_a_dome() -> None:
    """V4 by rays: parallel light at height h meets the centre plane at ρ(h); what is seen from afar runs the other way."""
    beam = {
        "kind": "beam",
        "shape": {"kind": "disk", "radius": 2.99},
        "flux": 1,
        "at": [0, 0, 20],
        "toward": [0, 0, -1],
    }
    seen = 0
    for start, *_, end in (t for t in trails(4000, **dome(sources=[beam])) if len(t) == 3):
        if np.linalg.norm(end) > DOME_R:
            continue  # reflected by the dome
        h = np.hypot(start[0], start[1])
        assert np.hypot(end[0], end[1]) == pytest.approx(float(object_radius(h)), abs=1e-9)
        assert end[0] * start[1] == pytest.approx(end[1] * start[0], abs=1e-9)
        seen += 1
    assert seen > 3000


def test_edge_and_luminance_of_a_disk_in_a_dome() -> None:
    """V4: the edge is seen at the height whose ρ is the radius, L = T L₀/n² inside of it, and nothing outside.

    The eye is 10⁶ mm away: its lines of sight are parallel to 10⁻⁶, and so are the heights at which they meet the dome.
    """
    area = math.pi * DISK**2
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": DISK}, "flux": math.pi * area, "at": [0, 0, 1e-9]}
    low, high = 0.1, 2.9
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if object_radius(np.array(middle)) < DISK else (low, middle)
    edge, distance = low, 1e6
    assert 1.4 < edge < 1.7
    h = edge * np.concatenate([np.linspace(0.05, 0.95, 10), 1 - np.array([1e-4, 1e-5]), 1 + np.array([1e-5, 1e-4])])
    turn = np.linspace(0, 5, len(h))
    targets = np.stack([h * np.cos(turn), h * np.sin(turn), np.zeros(len(h))], axis=1)
    found = along(lines_to(targets, 0, 0, distance), **dome(sources=[lamp]))
    assert (found[-2:] == 0).all()
    expected = transmittance(h / (DOME_N * DOME_R), DOME_N) / DOME_N**2
    assert np.allclose(found[:-2], expected[:-2], rtol=1e-9, atol=0)


# --- V8: view factors --------------------------------------------------------------------------------------------------

LAMP = {"kind": "rectangle", "width": 3, "height": 5}
CARD = {"kind": "rectangle", "width": 6, "height": 4}
CARD_AT = {"at": [2.5, -1.0, 6.0], "toward": [-0.4, 0.3, -1.0], "spin": 25}


def irradiance(points: Array, normal: Array, exitance: float) -> Array:
    """∫ M cos θ cos θ'/(π d²) dA over the lamp, by a product rule of 24² points; converged, the lamp being far away."""
    x, w = leggauss(24)
    u, v = np.meshgrid(1.5 * x, 2.5 * x, indexing="ij")
    lamp = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3)
    weights = (1.5 * 2.5 * np.multiply.outer(w, w)).ravel()
    away = points[..., None, :] - lamp
    square = (away**2).sum(-1)
    here, there = -(away @ normal), away[..., 2]
    assert (here > 0).all()
    assert (there > 0).all()
    return exitance / math.pi * (here * there / square**2) @ weights


def test_flux_between_tilted_rectangles() -> None:
    """V8 without symmetry, both ways: what a card gets, and what is seen of it, E/π if it is white; F by both.

    The eye stands behind the lamp, which does not shine there, and looks through it.
    """
    flux = 40.0
    lamp = {"kind": "surface", "shape": LAMP, "flux": flux}
    grid = {"name": "card", "kind": "illuminance", **{k: CARD[k] for k in ("width", "height")}, "columns": 6, "rows": 4,
            **CARD_AT}  # fmt: skip
    forward = et.trace(et.Scene(sources=[lamp], detectors=[grid]), 1e6, 5).illuminance["card"]
    x, w = leggauss(6)
    expected = np.zeros(forward.values.shape)
    for u, wu in zip(x, w, strict=True):
        for v, wv in zip(x, w, strict=True):
            at = forward.points + u * 0.5 * np.array(forward.right) + v * 0.5 * np.array(forward.up)
            expected += wu * wv / 4 * irradiance(at, np.array(forward.normal), flux / 15)
    share = expected.mean() * 24 / flux
    assert 0.05 < share < 0.2
    assert_agree(values=forward.values, expected=expected * 1e6, standard_error=forward.standard_error)
    # The card as it is seen along its normal: its corners are at those of the screen, turned by its spin.
    card = {"shape": CARD, **CARD_AT, "finish": {"kind": "lambertian", "reflectance": 1.0}}
    scene = et.Scene(sources=[lamp], surfaces=[card])
    normal = np.array(forward.normal)
    theta, phi = math.degrees(math.acos(normal[2])), math.degrees(math.atan2(normal[1], normal[0]))
    eye = et.Observer(theta, phi, 1e6, target=tuple(CARD_AT["at"]))
    seen = et.luminance_map(scene, eye, et.Screen(8, 8, 16, 16), rays_per_pixel=1024)
    right, up, _ = seen.screen.axes(eye)
    expected_map = np.zeros((16, 16))
    inside = np.ones((16, 16), dtype=bool)
    for du in (-0.25 / math.sqrt(3), 0.25 / math.sqrt(3)):
        for dv in (-0.25 / math.sqrt(3), 0.25 / math.sqrt(3)):
            at = np.array(CARD_AT["at"]) + (seen.screen.x[None, :, None] + du) * right
            at = at + (seen.screen.y[:, None, None] + dv) * up
            expected_map += irradiance(at, normal, flux / 15) / math.pi / 4
    for du in (-0.25, 0.25):
        for dv in (-0.25, 0.25):
            at = (seen.screen.x[None, :, None] + du) * right + (seen.screen.y[:, None, None] + dv) * up
            inside &= (np.abs(at @ np.array(forward.right)) < 3) & (np.abs(at @ np.array(forward.up)) < 2)
    assert inside.sum() > 60
    error = seen.standard_error[inside]
    assert_agree(values=seen.values[inside], expected=expected_map[inside] * 1e6, standard_error=error, degrees=REVERSE)
    assert_differ(values=seen.values[inside], other=expected_map[::-1][inside] * 1e6, standard_error=error)
    total = math.sqrt((seen.standard_error**2).sum()) * seen.screen.pixel_area / 1e6
    assert abs(seen.intensity - share * flux / math.pi) < LARGEST_Z * total
    assert total < 0.01 * seen.intensity


def test_flux_from_disc_to_disc_as_it_is_seen() -> None:
    """V8: F = ½ (Z − √(Z² − 4 (r₂/r₁)²)); a white disk that gets Φ F shows the intensity Φ F/π along its normal."""
    r1, r2, d, flux = 2.0, 3.0, 2.5, 7.0
    Z = 1 + (1 + (r2 / d) ** 2) / (r1 / d) ** 2
    share = 0.5 * (Z - math.sqrt(Z**2 - 4 * (r2 / r1) ** 2))
    axis = np.array([0.48, -0.6, 0.64])
    source = {"kind": "surface", "shape": {"kind": "disk", "radius": r1}, "flux": flux, "at": [1, 2, 3], "toward": axis}
    target = {"shape": {"kind": "disk", "radius": r2}, "at": np.array([1, 2, 3]) + d * axis, "toward": -axis,
              "finish": {"kind": "lambertian", "reflectance": 1.0}}  # fmt: skip
    theta, phi = math.degrees(math.acos(-axis[2])), math.degrees(math.atan2(-axis[1], -axis[0]))
    eye = et.Observer(theta, phi, 1e6, target=tuple(np.array([1, 2, 3]) + d * axis))
    seen = et.luminance_map(
        et.Scene(sources=[source], surfaces=[target]), eye, et.Screen(6.4, 6.4, 24, 24), rays_per_pixel=512
    )
    error = math.sqrt((seen.standard_error**2).sum()) * seen.screen.pixel_area / 1e6
    assert error < 2e-3 * seen.intensity
    assert abs(seen.intensity - share * flux / math.pi) < LARGEST_Z * error


# --- mirrors and sums --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "length"), [(35.0, 3.0), (60.0, 5.0)])
def test_mirrored_pipe(angle: float, length: float) -> None:
    """What is seen of a luminous disk through a mirror pipe is what it lets pass of parallel light [SwiftSmith1995]_."""
    radius, reflectance = 2.0, 0.85
    aspect = length * math.tan(math.radians(angle))
    s = np.sin((np.arange(400_000) + 0.5) / 400_000 * math.pi / 2)
    bounces = aspect / s
    kept = reflectance ** np.floor(bounces) * (1 - (1 - reflectance) * (bounces - np.floor(bounces)))
    share = 2 * (s**2 * kept).mean()
    length *= 2 * radius
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": radius}, "flux": math.pi * math.pi * radius**2}
    pipe = {"shape": {"kind": "cylinder", "radius": radius, "height": length},
            "finish": {"kind": "mirror", "reflectance": reflectance}}  # fmt: skip
    baffle = {"shape": {"kind": "annulus", "inner_radius": radius, "outer_radius": 40}, "at": [0, 0, length],
              "finish": "absorber"}  # fmt: skip
    eye = et.Observer(angle, 50, 1e7, target=(0, 0, length))
    seen = et.luminance_map(
        et.Scene(sources=[lamp], surfaces=[pipe, baffle]), eye, et.Screen(4.2, 4.2, 48, 48), rays_per_pixel=256
    )
    expected = share * math.pi * radius**2 * math.cos(math.radians(angle))
    error = math.sqrt((seen.standard_error**2).sum()) * seen.screen.pixel_area / 1e6
    assert error < 2e-3 * expected
    assert abs(seen.intensity - expected) < LARGEST_Z * error
