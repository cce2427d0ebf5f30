"""Errors of light that lines of sight find both by connections to a lamp and by directions that happen to meet it."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.verdicts import REVERSE, assert_agree

Array = npt.NDArray[np.float64]

Lamp = tuple[tuple[float, float, float], float, float]
"""Place, side [mm] and flux [lm] of a square."""

TOWARD, WHITE = np.array([0.2, -0.3, -1.0]), 0.6
TARGET, PIXELS, WIDTH = np.array([60.0, 30.0, 0.0]), 6, 6.0


def turned(points: Array, *, normal: Array) -> Array:
    """Points of the xy plane in one with this normal, by Rodrigues' rotation of +z to it."""
    v = np.cross([0.0, 0.0, 1.0], normal)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return points @ (np.eye(3) + cross + cross @ cross / (1 + normal[2])).T


def floor_luminance(*, points: Array, lamp: Lamp) -> Array:
    """ρ/π ∫ L cosθ₁ cosθ₂/d² dA over a lamp [cd/m²], by the midpoint rule: to 1e-6 at ten times the lamp's size."""
    at, size, flux = lamp
    normal = TOWARD / np.linalg.norm(TOWARD)
    side = ((np.arange(24) + 0.5) / 24 - 0.5) * size
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    to = points[:, None] - (np.array(at) + turned(np.column_stack([x, y, 0 * x]), normal=normal))
    square = np.sum(to**2, axis=-1)
    cosines = np.clip(to @ normal, 0, None) * np.clip(-to[..., 2], 0, None) / square
    luminance = flux / (np.pi * size**2 * 1e-6)
    return WHITE / np.pi * luminance * np.sum(cosines / square, axis=1) * size**2 / x.size


def errors_hold(*, lamps: list[Lamp], theta: float, lines: int, seeds: int) -> None:
    """χ² over the pixels of a white floor below some lamps, and over maps of several seeds."""
    sources = [
        {"kind": "surface", "shape": {"kind": "rectangle", "width": size, "height": size}, "flux": flux,
         "at": at, "toward": TOWARD.tolist()}
        for at, size, flux in lamps
    ]  # fmt: skip
    floor = {"shape": {"kind": "rectangle", "width": 2000, "height": 2000},
             "finish": {"kind": "lambertian", "reflectance": WHITE}}  # fmt: skip
    scene = et.Scene(sources=sources, surfaces=[floor])
    observer, screen = et.Observer(theta, 0, 4e5, target=tuple(TARGET)), et.Screen(WIDTH, WIDTH, PIXELS, PIXELS, "xy")
    # Points within each pixel, all of which lie on the floor.
    place = ((np.arange(4 * PIXELS) + 0.5) / (4 * PIXELS) - 0.5) * WIDTH
    x, y = np.meshgrid(TARGET[0] + place, TARGET[1] - place)
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    fine = np.sum([floor_luminance(points=points, lamp=lamp) for lamp in lamps], axis=0)
    maps = [et.luminance_map(scene, observer, screen, rays_per_pixel=lines, seed=seed) for seed in range(1, seeds + 1)]
    assert_agree(
        values=np.array([lmap.values for lmap in maps]),
        expected=fine.reshape(PIXELS, 4, PIXELS, 4).mean(axis=(1, 3)),
        standard_error=np.array([lmap.standard_error for lmap in maps]),
        degrees=REVERSE,
    )


@pytest.mark.slow
@pytest.mark.parametrize(("theta", "lines", "seeds"), [(0, 256, 6), (0, 1024, 2), (75, 256, 5)])
def test_a_small_lamp_over_a_floor(theta: float, lines: int, seeds: int) -> None:
    """One line in some hundreds meets the lamp: a pixel without such a line must not lack what the others have by it."""
    errors_hold(lamps=[((12.0, -7.0, 100.0), 10.0, 500.0)], theta=theta, lines=lines, seeds=seeds)


@pytest.mark.slow
@pytest.mark.parametrize(("lines", "seeds"), [(64, 6), (256, 6), (1024, 2)])
def test_a_weak_lamp_close_by_among_many(lines: int, seeds: int) -> None:
    """Of more than eight lamps one is connected to: that which brings most of the light must not be missed for its flux."""
    strong = [((200.0 * i - 700, 300.0, 900.0), 40.0, 1000.0) for i in range(9)]
    errors_hold(lamps=[((58.0, 34.0, 60.0), 5.0, 10.0), *strong], theta=0, lines=lines, seeds=seeds)
