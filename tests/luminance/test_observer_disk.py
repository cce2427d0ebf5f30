"""The observer as a disk, figure 2.2 of the thesis: the étendue of each pixel, and maps without bias; verdicts at 1e-4."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.luminance.observer_disk import disk_etendue
from oracles.verdicts import assert_agree


@pytest.mark.parametrize(("distance", "radius", "side"), [(1000.0, 5.0, 60.0), (20.0, 8.0, 12.0), (5.0, 30.0, 4.0)])
def test_the_etendue_of_parallel_planes_is_the_closed_form(distance: float, radius: float, side: float) -> None:
    """From an element a from the axis: π/2 (1 - (h² + a² - r²)/√((h² + a² + r²)² - 4 a² r²)), pixel by pixel."""
    n, fine = 8, 24
    found = disk_etendue(et.Observer(40, 70, distance, (1, 2, 3)), et.Screen(side, side, n, n), radius)
    at = ((np.arange(n * fine) + 0.5) / (n * fine) - 0.5) * side
    a2 = at[:, None] ** 2 + at[None, :] ** 2
    h2, r2 = distance**2, radius**2
    solid = 0.5 * np.pi * (1 - (h2 + a2 - r2) / np.sqrt((h2 + a2 + r2) ** 2 - 4 * a2 * r2))
    expected = solid.reshape(n, fine, n, fine).mean(axis=(1, 3)) * (side / n) ** 2 * 1e-6
    # The midpoint rule of the oracle is the coarser one.
    np.testing.assert_allclose(found, expected, rtol=2e-5)


def test_the_etendue_of_a_slanted_screen_is_that_of_the_double_integral() -> None:
    """Points of the pixel and of the disk, brute force; the screen lies in the XY plane, the observer at 50°."""
    observer, screen, radius = et.Observer(50, 30, 40, (1, 0, 0)), et.Screen(16, 12, 3, 2, plane="xy"), 9.0
    found = disk_etendue(observer, screen, radius)
    away = (observer.position - [1, 0, 0]) / 40.0
    first = np.cross(away, [0, 0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(away, first)
    r = (np.arange(60) + 0.5) / 60 * radius
    phi = (np.arange(90) + 0.5) / 90 * 2 * np.pi
    disk = observer.position + (
        r[:, None, None] * (np.cos(phi)[:, None] * first + np.sin(phi)[:, None] * second)
    ).reshape(-1, 3)
    weight = np.repeat(r, 90) * (radius / 60) * (2 * np.pi / 90)
    for row in range(2):
        for column in range(3):
            total = 0.0
            for u in (np.arange(10) + 0.5) / 10 - 0.5:
                for v in (np.arange(10) + 0.5) / 10 - 0.5:
                    point = np.array([1 + screen.x[column] + u * 16 / 3, screen.y[row] + v * 6, 0.0])
                    ray = disk - point
                    d2 = (ray**2).sum(axis=1)
                    total += float((weight * ray[:, 2] * (ray @ away) / d2**2).sum())
            assert found[row, column] == pytest.approx(total / 100 * (16 / 3) * 6 * 1e-6, rel=2e-3)


def lambertian(count: int, seed: int) -> et.RaySet:
    """A square of 20 mm, 1 lm: luminance 1e6/(400 π) everywhere and in all directions."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([(rng.random((count, 2)) - 0.5) * 20, np.zeros(count)])
    sine, phi = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    direction = np.column_stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - sine**2)])
    return et.RaySet(position, direction, np.full(count, 1.0 / count))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("theta", "distance", "radius", "plane"),
    [(0, 20, 8, "view"), (0, 500, 60, "view"), (45, 25, 6, "xy"), (60, 400, 80, "xy")],
)
def test_a_lambertian_source_has_its_luminance_near_and_far(
    theta: float, distance: float, radius: float, plane: str
) -> None:
    """Closed form L = Φ/(π A) in every pixel, and by the rays that a plain loop counts."""
    rays, observer = lambertian(200_000, 3), et.Observer(theta, 25, distance)
    screen = et.Screen(12, 12, 4, 4, plane=plane)  # type: ignore[arg-type]
    lmap = et.luminance_map(rays, observer, screen, method=et.Cone(observer_radius=radius))
    truth = 1e6 / (400 * math.pi)
    assert_agree(values=lmap.values, expected=np.full((4, 4), truth), standard_error=lmap.standard_error)
    total = float(lmap.values.mean() - truth) / float(np.sqrt((lmap.standard_error**2).sum()) / 16)
    assert abs(total) < 3.9
    away = observer.position / distance
    t = (distance - rays.position @ away) / (rays.direction @ away)
    off = rays.position + t[:, None] * rays.direction - observer.position
    inside = (rays.direction @ away > 0) & ((off**2).sum(axis=1) < radius**2)
    if plane == "xy":
        inside &= (np.abs(rays.position[:, :2]) < 6).all(axis=1)
        assert lmap.rays.sum() == inside.sum()


def test_far_away_it_is_the_cone() -> None:
    """A disk of radius d tan α from afar: the same rays, with the projected solid angle in place of the solid angle."""
    rays, alpha = lambertian(400_000, 4), 3.0
    observer, screen = et.Observer(20, 10, 1e7), et.Screen(16, 16, 4, 4, plane="xy")
    cone = et.luminance_map(rays, observer, screen, method=et.Cone(acceptance=alpha))
    disk = et.luminance_map(rays, observer, screen, method=et.Cone(observer_radius=1e7 * math.tan(math.radians(alpha))))
    assert disk.rays.tolist() == cone.rays.tolist()
    # About the axis of a cone that is slanted against the pixel ∫ cos θ dΩ = π sin²α cos θ₀; the cone has 2π (1 - cos α).
    ratio = (1 + math.cos(math.radians(alpha))) / 2
    np.testing.assert_allclose(cone.values, disk.values * ratio, rtol=1e-6)


def test_what_cannot_be() -> None:
    rays, screen = lambertian(10, 1), et.Screen(4, 4, 2, 2, plane="xy")
    with pytest.raises(ArgumentError, match="reaches behind the plane of the screen"):
        et.luminance_map(rays, et.Observer(80, 0, 100), screen, observer_radius=20)
    with pytest.raises(ArgumentError, match="both stated"):
        et.Cone(acceptance=3, observer_radius=2)
    # The value that an acceptance has unless it is stated is no exception.
    with pytest.raises(ArgumentError, match="both stated"):
        et.Cone(acceptance=1.5, observer_radius=2)
    assert (et.Cone().half_angle, et.Cone(observer_radius=2).half_angle) == (1.5, None)
    assert dataclasses.replace(et.Cone(), observer_radius=2) == et.Cone(observer_radius=2)
    for bad in (0.0, -1.0, float("nan"), float("inf"), "wide"):
        with pytest.raises(ArgumentError, match="radius of the observer's disk"):
            et.Cone(observer_radius=bad)  # type: ignore[arg-type]
