"""What maps and traces must add up to, and what they cannot exceed, in scenes without symmetry; verdicts at 1e-4."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.verdicts import LARGEST_Z, assert_agree

Array = npt.NDArray[np.float64]

LAMP = {"name": "lamp", "kind": "surface", "shape": {"kind": "rectangle", "width": 3, "height": 2}, "flux": 100,
        "at": [0.5, -0.4, -5], "toward": [0.2, 0.1, 1]}  # fmt: skip


def lantern(**more: Any) -> et.Scene:
    """A lamp, a tinted lens, a concave mirror beside and a scattering card above it, all within 11 mm of the origin."""
    keys: dict[str, Any] = {
        "media": {"tinted": {"index": 1.5, "absorption": 0.03}},
        "sources": [LAMP],
        "solids": [{"name": "lens", "medium": "tinted", "at": [0, 0.5, -2], "rotation": [5, -8, 0], "shape": {"kind": "lens",
                    "radius": 3.5, "thickness": 2.2, "front": {"radius_of_curvature": 15},
                    "back": {"radius_of_curvature": -9}}}],
        "surfaces": [
            {"name": "mirror", "shape": {"kind": "conic", "radius_of_curvature": 14, "radius": 4}, "at": [6, 1, 2],
             "toward": [-1, -0.1, 0.3], "finish": {"kind": "mirror", "reflectance": 0.9}},
            {"name": "card", "shape": {"kind": "rectangle", "width": 7, "height": 5}, "at": [-2, -1, 6],
             "toward": [0.3, 0.2, 1], "finish": {"kind": "lambertian", "reflectance": 0.3, "transmittance": 0.5}},
        ],
        "detectors": [{"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 30}],
    }  # fmt: skip
    return et.Scene(**(keys | more))


# --- V12 -------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_what_is_seen_from_everywhere_is_the_flux() -> None:
    """V12: Σ L A⊥ of a map is the intensity of its view, ∫ I dω = ∫∫ L dU the flux that leaves.

    Views are drawn around each node of the far field of a trace, by its hat, more of them where there is more light; their
    spread is the error of their mean. One view of four has rays forwards, which cost more than its lines of sight and take
    next to nothing from that spread: to the total error, 5 % of the flux, it makes no difference.
    """
    scene = lantern()
    result = et.trace(scene, 4e5, 3)
    far = result.intensity.only
    rng, seed = np.random.default_rng(6), 0
    cells: list[tuple[float, ...]] = []
    screen = et.Screen(23, 23, 16, 16)
    nodes = [(0, 0), (0, 6), *((i, j) for i in range(6) for j in range(1, 6))]
    for i, j in nodes:
        pole, g = j in {0, 6}, far.gamma[j]
        solid = float(far.node_solid_angle[:, j].sum() if pole else far.node_solid_angle[i, j])
        count = 4 + int(100 * solid * far.values[i, j] / far.flux)
        thetas = np.degrees(np.arccos(rng.uniform(*np.cos(np.radians([min(g + 30, 180), max(g - 30, 0)])), 40 * count)))
        thetas = thetas[rng.random(thetas.size) < 1.0 - np.abs(thetas - g) / 30.0][:count]
        phis = rng.uniform(0, 360, count) if pole else far.c[i] + rng.triangular(-60, 0, 60, count)
        seen = []
        for theta, phi in zip(thetas, phis, strict=True):
            seed += 1
            view = et.Observer(theta, phi, 1e7)
            forward = None if seed % 4 == 0 else 0
            seen.append(
                et.luminance_map(scene, view, screen, rays_per_pixel=8, seed=seed, forward_rays=forward).intensity
            )
        error = np.std(seen, ddof=1) / math.sqrt(count)
        cells.append((float(np.mean(seen)) - far.values[i, j], math.hypot(error, far.standard_error[i, j]), solid,
                      float(np.mean(seen)), count - 1.0))  # fmt: skip
    off, error, solid, mean, degrees = np.array(cells).T
    assert solid.sum() == pytest.approx(4 * math.pi)
    assert_agree(values=off, expected=np.zeros_like(off), standard_error=error, degrees=degrees)
    escaped = result.ledger.escaped.flux
    assert 50 < escaped < 99
    assert far.flux == pytest.approx(escaped, rel=1e-9)
    total = math.sqrt(((error * solid) ** 2).sum())
    assert total < 0.05 * escaped
    assert abs(mean @ solid - escaped) < LARGEST_Z * total


# --- V10 -------------------------------------------------------------------------------------------------------------


def random_system(seed: int) -> dict[str, Any]:
    """Two lamps of basic luminance L/n² = 1, one of them in glass, among glass bodies, a mirror and a white card at random.

    The base below the immersed lamp is black, so that no light of another medium starts there.
    """
    rng = np.random.default_rng(seed)

    def place(low: float, high: float) -> dict[str, Any]:
        v = rng.normal(size=3)
        return {"at": rng.uniform(low, high) * v / np.linalg.norm(v), "rotation": rng.uniform(-180, 180, 3)}

    n = float(rng.uniform(1.3, 2.0))
    bodies = [
        {"kind": "ball", "radius": 2.2},
        {"kind": "block", "width": 3, "height": 2, "depth": 3},
        {"kind": "lens", "radius": 3, "thickness": 2, "front": {"radius_of_curvature": 9}, "back":
         {"radius_of_curvature": float(rng.uniform(-9, -6))}},
    ]  # fmt: skip
    turns = rng.permutation([[6, 1, 0], [-5, 4, 1], [-2, -6, 2]]).tolist()
    solids = [{"shape": {"kind": "dome", "radius": 3}, "medium": {"index": n}, "finishes": {"base": "absorber"}}]
    solids += [{"shape": b, "medium": {"index": float(rng.uniform(1.3, 2.4))}, "at": at, "rotation": place(0, 1)["rotation"]}
               for b, at in zip(bodies, turns, strict=True)]  # fmt: skip
    mirror = {"shape": {"kind": "conic", "radius_of_curvature": 12, "radius": 4}, "finish": "mirror", "at": [0, 0, 9],
              "rotation": rng.uniform(150, 210, 3) * [1, 0, 0]}  # fmt: skip
    card = {"shape": {"kind": "rectangle", "width": 5, "height": 4}, "finish": {"kind": "lambertian", "reflectance": 1.0},
            **place(10, 12)}  # fmt: skip
    lamps = [
        {"kind": "surface", "shape": {"kind": "disk", "radius": 1.5}, "flux": n * n * math.pi * math.pi * 1.5**2, "at":
         [0, 0, 1e-9]},
        {"kind": "surface", "shape": {"kind": "rectangle", "width": 4, "height": 3}, "flux": math.pi * 12, "at": [0, 0, -4]},
    ]  # fmt: skip
    return {"sources": lamps, "solids": solids, "surfaces": [mirror, card]}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_brighter_than_its_source(seed: int) -> None:
    """V10: no passive system shows more than the largest L/n² of its sources, and no surface gets more than π times it.

    Along smooth ways that holds for every line of sight; where chance had a say, to the error of the pixel.
    """
    scene = et.Scene(**random_system(seed))
    rng = np.random.default_rng(seed)
    brightest = 0.0
    for k in range(3):
        theta, phi = np.degrees(np.arccos(rng.uniform(-0.5, 1))), rng.uniform(0, 360)
        seen = et.luminance_map(
            scene, et.Observer(theta, phi, 60), et.Screen(18, 18, 24, 24), rays_per_pixel=32, seed=k + 1
        )
        over = seen.values / 1e6 - 1
        assert (over <= 1e-9 + 6 * seen.standard_error / 1e6).all()
        brightest = max(brightest, float(seen.values.max() / 1e6))
    # Fresnel's losses at normal incidence are all that the bound leaves unused.
    assert brightest > 0.8
    toward = rng.normal(size=3)
    grid = {"kind": "illuminance", "width": 20, "height": 20, "columns": 8, "rows": 8, "at": -13 * toward /
            np.linalg.norm(toward), "toward": toward, "name": "grid"}  # fmt: skip
    got = et.trace(scene.replace(detectors=[grid]), 1e5, seed + 1).illuminance["grid"]
    known = got.standard_error > 0
    assert (got.values[known] / 1e6 <= math.pi + 6 * got.standard_error[known] / 1e6).all()


# --- V13 -------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_where_on_its_line_a_ray_starts_does_not_matter() -> None:
    """V13: rays of a set moved back along themselves meet the same fates, at the same places, to roundings."""
    rng = np.random.default_rng(2)
    n = 30_000
    position = np.stack([rng.uniform(-1.5, 1.5, n), rng.uniform(-1, 1, n), np.full(n, -5.0)], axis=1)
    direction = rng.normal((0.2, 0.1, 2.0), 1.0, (n, 3))
    direction[:, 2] = np.abs(direction[:, 2])
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    moved = position - rng.uniform(0, 300, (n, 1)) * direction
    plane = {"name": "plane", "kind": "rays", "shape": {"kind": "sphere", "radius": 15}, "trim": {"z": [-4, 16]}}
    far = {"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 30}
    results = []
    for start in (position, moved):
        rays = et.RaySet(start, direction, 1.0 + np.arange(n) % 7)
        results.append(et.trace(lantern(sources=[{"kind": "rays", "rays": rays}], detectors=[plane, far]), None, 5))
    here, there = results
    assert here.ledger.escaped.rays == there.ledger.escaped.rays
    for name, entry in here.ledger.by_surface.items():
        assert there.ledger.by_surface[name].rays == entry.rays
    assert here.ledger.by_surface["card"].rays > 1000
    # The moved rays come in through the part that is cut away, or from outside through the plane before they start.
    first, second = here.rays["plane"], there.rays["plane"]
    assert len(first) > 20_000
    np.testing.assert_allclose(here.intensity["far"].values, there.intensity["far"].values, rtol=1e-9)
    outward = (second.position * second.direction).sum(axis=1) > 0
    np.testing.assert_allclose(first.position, second.position[outward], atol=1e-9)
    np.testing.assert_allclose(first.direction, second.direction[outward], atol=1e-9)


def test_where_rays_are_collected_does_not_matter() -> None:
    """V13: the same rays collected on two planes show the same observer the same, ray for ray."""
    planes = [{"name": name, "kind": "rays", "shape": {"kind": "rectangle", "width": 4000, "height": 4000}, "at": [0, 0, z]}
              for name, z in (("near", 10.0), ("far", 90.0))]  # fmt: skip
    rays = et.trace(lantern(detectors=planes), 1.5e5, 4).rays
    eye, screen = et.Observer(20, 50, 500), et.Screen(16, 16, 8, 8)
    near, far = (et.luminance_map(rays[name], eye, screen, method="cone", acceptance=6.0) for name in ("near", "far"))
    assert near.rays.sum() > 1000
    np.testing.assert_array_equal(near.rays, far.rays)
    np.testing.assert_allclose(near.values, far.values, rtol=1e-9)
