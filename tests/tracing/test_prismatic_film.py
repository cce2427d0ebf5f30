"""A prismatic film over an even surface, prism by prism, against an endless film followed by other means."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.prismatic_film import seen_through
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

SIGNIFICANCE = 1e-3
"""Of each verdict."""

PRISMS = 6
TABLE = {
    0: {0: 0.951, 10: 0.930, 20: 0.899, 30: 0.809, 35: 0.441, 40: 0.032, 50: 0.029, 60: 0.292, 70: 0.649, 80: 0.892},
    90: {0: 0.951, 10: 0.949, 20: 0.946, 30: 0.935, 40: 0.907, 50: 0.701, 60: 0.0, 70: 0.0, 80: 0.0},
}
"""Transmission by azimuth (0: across the prisms) and polar angle, to ± 0.001: n = 1.59, slab as thick as the pitch."""

MEAN_TRANSMISSION, GAIN = (0.470, 0.007), (1.82, 0.02)
"""From the same source: of Lambertian light, and on the axis above a plate that reflects 0.9; with their errors."""


def endless(index: float = 1.59, thickness: float = 1.0, gap: float = 0.0, **keys: Any) -> et.Scene:
    """Six prisms of pitch 1 above L = 1 cd/m², in a shaft of mirrors, which stand where the endless film is symmetric."""
    half, top, low = PRISMS / 2 + 1e-6, thickness + 0.5, -gap - 0.01
    walls = [
        {
            "shape": {"kind": "rectangle", "width": 2 * half, "height": top - low},
            "finish": "mirror",
            "at": [x * half, y * half, (top + low) / 2],
            "toward": [x, y, 0],
            "spin": 90 if x else 0,
        }
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    source = {
        "kind": "surface",
        "shape": {"kind": "rectangle", "width": 2 * half, "height": 2 * half},
        "flux": math.pi * (2 * half) ** 2 * 1e-6,
        "at": [0, 0, -gap - 1e-3],
    }
    film = {
        "shape": {"kind": "prismatic-film", "width": PRISMS, "height": PRISMS, "thickness": thickness, "pitch": 1},
        "medium": {"index": index},
        "finishes": dict.fromkeys(("left", "right", "front", "back"), "mirror"),
    }
    below = {"shape": {"kind": "rectangle", "width": 2 * half, "height": 2 * half}, "at": [0, 0, -gap - 2e-3], **keys}
    return et.Scene(sources=[source], solids=[film], surfaces=[*walls, below] if keys else walls)


def seen(scene: et.Scene, directions: list[tuple[float, float]], lines: int) -> tuple[Array, Array]:
    """Luminance over whole prisms, with its error, seen from θ, φ."""
    film = scene.solids[0].shape
    observers = [et.Observer(*d, 1e6, target=(0, 0, film.thickness + 0.5)) for d in directions]  # type: ignore[union-attr]
    maps = et.luminance_map(scene, observers, et.Screen(1, 1, 1, 1, "xy"), rays_per_pixel=lines)
    return np.array([m.values[0, 0] for m in maps]), np.array([m.standard_error[0, 0] for m in maps])


def assert_same(found: Array, error: Array, truth: Array, truth_error: Array | float) -> None:
    z = (found - truth) / np.hypot(error, truth_error)
    assert chi2.sf((z**2).sum(), z.size) > SIGNIFICANCE, z


@pytest.mark.slow
@pytest.mark.parametrize("azimuth", TABLE)
def test_transmission_by_angle(azimuth: int) -> None:
    """L_out = T(θ, φ) L: the known table; no light where total reflection turns back every line."""
    table = TABLE[azimuth]
    found, error = seen(endless(), [(theta, azimuth) for theta in table], lines=512)
    truth = np.array(list(table.values()))
    assert (found[truth == 0.0] == 0.0).all()
    assert_same(found, error, truth, 1e-3)


@pytest.mark.slow
def test_transmission_of_other_films_in_skew_directions() -> None:
    """The same as lines through grooves, prisms and slab of one period, of other index and thickness."""
    rng = np.random.default_rng(4)
    directions = [(15.0, 25.0), (33.0, 70.0), (38.0, 140.0), (66.0, -20.0)]
    found, error = seen(endless(index=1.49, thickness=0.37), directions, lines=4096)
    n, through = 60_000, []
    for theta, phi in np.radians(directions):
        view = [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
        through.append(seen_through(np.tile(view, (n, 1)), index=1.49, thickness=0.37, rng=rng).mean())
    share = np.array(through)
    assert ((share > 0.1) & (share < 0.96)).all()
    assert_same(found, error, share, np.sqrt(share * (1 - share) / n))


def mean_transmission() -> tuple[float, float]:
    """Of Lambertian light: the mean over the unit disk of direction cosines, with its error."""
    rng = np.random.default_rng(5)
    n = 100_000
    radius, azimuth = np.sqrt(rng.random(n)), 2 * math.pi * rng.random(n)
    p, q = radius * np.cos(azimuth), radius * np.sin(azimuth)
    share = float(
        seen_through(np.stack([p, q, np.sqrt(1 - radius**2)], axis=1), index=1.59, thickness=1.0, rng=rng).mean()
    )
    return share, math.sqrt(share * (1 - share) / n)


def test_transmission_of_lambertian_light_forwards() -> None:
    """What leaves the shaft of the light sent into the film, over a black plate: by symmetry of étendue the mean of T."""
    rays = 100_000
    ledger = et.trace(endless(finish="absorber"), rays=rays, seed=6).ledger
    found = ledger.escaped.flux / ledger.total.flux
    error = math.sqrt(found * (1 - found) / rays)
    for truth, truth_error in (mean_transmission(), MEAN_TRANSMISSION):
        assert_same(np.array([found]), np.array([error]), np.array([truth]), truth_error)


@pytest.mark.slow
def test_gain_above_a_reflecting_plate() -> None:
    """L_out / L = T(0) / (1 - R (1 - T̄)): light that the film sends back comes again from the plate.

    The plate is far enough from the prisms that they cast no pattern on it.
    """
    plate = {"kind": "lambertian", "reflectance": 0.9}
    found, error = seen(endless(gap=3.0, finish=plate), [(0.0, 0.0)], lines=4096)
    straight, straight_error = seen(endless(), [(0.0, 0.0)], lines=2048)
    mean, mean_error = mean_transmission()
    again = 1.0 - 0.9 * (1.0 - mean)
    gain = straight[0] / again
    gain_error = gain * math.hypot(straight_error[0] / straight[0], 0.9 * mean_error / again)
    for truth, truth_error in ((gain, gain_error), GAIN):
        assert_same(found, error, np.array([truth]), truth_error)
