"""Errors that a near-field goniophotometer states of lamps that are functions and fields."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.instruments.near_field.field_errors import FIELDS
from etendue.instruments.near_field.run import NearFieldRun
from oracles.verdicts import assert_agree

RADIUS, BRIGHT = 3.0, 1e4


def disk(points: np.ndarray, k: np.ndarray) -> np.ndarray:
    """An even disk in the plane z = 0, with edges that pixels are cut by."""
    with np.errstate(divide="ignore", invalid="ignore"):
        hit = points - (points[:, 2] / k[:, 2])[:, None] * k
    on = (k[:, 2] > 1e-9) & (np.hypot(hit[:, 0], hit[:, 1]) < RADIUS)
    return np.where(on, BRIGHT, 0.0)


def illuminance_of_disk(*, run: NearFieldRun) -> np.ndarray:
    """At the photometer of each position, facing the middle of the disk: a sum over 144 000 patches of it."""
    stops, distance = run.setting.positions, run.setting.photometer_distance
    r = RADIUS * np.sqrt((np.arange(400) + 0.5) / 400)[:, None]
    phi = (np.arange(360) + 0.5) * np.pi / 180.0
    patches = np.stack([r * np.cos(phi), r * np.sin(phi), np.zeros((400, 360))], axis=-1)
    found = []
    for gamma, c in zip(np.radians(stops.gamma), np.radians(stops.c), strict=True):
        normal = np.array([np.sin(gamma) * np.cos(c), np.sin(gamma) * np.sin(c), np.cos(gamma)])
        apart = distance * normal - patches
        length = np.linalg.norm(apart, axis=-1)
        part = np.maximum(apart[..., 2], 0.0) * (apart @ normal) / length**4
        found.append(BRIGHT * np.pi * RADIUS**2 * part.mean())
    return np.array(found)


@pytest.mark.slow
def test_readings_of_a_function_are_off_by_what_they_state() -> None:
    """χ² per reading against the sum, from 0.2 (errors twice as large as need be) to 1.25 (4σ of some 100 readings)."""
    goniophotometer = et.NearFieldGoniophotometer(step=15, camera_pixels=32)
    runs = [goniophotometer.measure(disk, size=2.0 * RADIUS, samples=samples) for samples in (4, 9, 64)]
    true = illuminance_of_disk(run=runs[0])
    for run in runs:
        assert run.setting.positions.gamma.tolist() == runs[0].setting.positions.gamma.tolist()
        lit = true > 1e-3 * true.max()
        off = (run.illuminance - true)[lit] / run.illuminance_error[lit]
        assert lit.sum() > 90
        assert 0.2 < float(np.mean(off**2)) < 1.25
        assert run.total_flux_error > 0.0


def test_errors_of_even_light_are_none() -> None:
    """There is nothing that lines could miss within the image."""
    even = et.NearFieldGoniophotometer(step=30, camera_pixels=8).measure(
        lambda points, k: np.full(len(points), 5.0) + 0.0 * k[:, 0], size=2.0, samples=4
    )
    assert np.all(even.illuminance_error == 0.0)


@pytest.mark.slow
def test_readings_of_a_field_state_its_error() -> None:
    """The spread between fields of eight resamplings of its rays is no more than that; there is a note of it."""
    rays = et.RingSource(rays=50_000).ray_set()
    goniophotometer = et.NearFieldGoniophotometer(
        step=30, camera_pixels=16, distance=400, photometer_distance=400, field_of_view=66
    )
    runs = []
    for seed in range(8):
        chosen = np.random.default_rng(seed).integers(0, len(rays), 5000)
        some = et.RaySet(rays.position[chosen], rays.direction[chosen], np.full(5000, 2e-4))
        runs.append(goniophotometer.measure(et.LightField.fit(some, et.Disk(radius=30), depths=(2, 2, 2, 2))))
    light = np.array([run.illuminance for run in runs])
    lit = light.mean(axis=0) > 0.05 * light.mean(axis=0).max()
    stated = np.mean([run.illuminance_error for run in runs], axis=0)
    assert (stated[lit] > 0.0).all()
    assert float(np.mean((light.std(axis=0, ddof=1)[lit] / stated[lit]) ** 2)) < 1.0
    assert any("between sets of as many rays" in note for note in runs[0].notes)


def lopsided_rays(*, seed: int, rays: int, unequal: bool) -> et.RaySet:
    """Of a disk of 100 lm whose light leans to one side in place and in direction; fluxes equal, or far from it."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-1.0, 1.0, (2, 8 * rays))
    p, q = rng.uniform(-1.0, 1.0, (2, 8 * rays))
    kept = (np.hypot(x, y) < 1.0) & (np.hypot(p, q) < 1.0)
    kept &= rng.random(8 * rays) < (1.0 + 0.6 * x - 0.3 * y) * (1.0 + 0.5 * p + 0.4 * q) / (1.7 * 1.7)
    x, y, p, q = (values[kept][:rays] for values in (x, y, p, q))
    assert x.size == rays
    flux = rng.exponential(size=rays) ** 2 / 2.0 if unequal else np.ones(rays)
    places = np.stack([2.0 * x, 2.0 * y, 0.0 * x], axis=1)
    return et.RaySet(places, np.stack([p, q, np.sqrt(1.0 - p * p - q * q)], axis=1), 100.0 / rays * flux)


@pytest.fixture(scope="module", params=[False, True], ids=["equal", "unequal"])
def measured_fields(request: pytest.FixtureRequest) -> list[NearFieldRun]:
    """The same lamp by sixteen sets of rays, each with a light field of its own."""
    goniophotometer = et.NearFieldGoniophotometer(
        (30, 40), 100, centre=(0.0, 0.0, 0.0), camera_pixels=16, field_of_view=5
    )
    runs = []
    for seed in range(16):
        rays = lopsided_rays(seed=seed, rays=4000, unequal=request.param)
        field = et.LightField.fit(rays, et.Disk(radius=2), depths=(3, 3, 4, 4))
        runs.append(goniophotometer.measure(field, samples=16, seed=seed))
    return runs


@pytest.mark.slow
def test_flux_of_a_field_is_off_by_what_it_states(measured_fields: list[NearFieldRun]) -> None:
    """All positions see the same rays. χ² over sets of rays against the lamp's 100 lm, from both sides."""
    assert_agree(
        values=np.array([run.total_flux for run in measured_fields]),
        expected=100.0,
        standard_error=np.array([run.total_flux_error for run in measured_fields]),
        degrees=FIELDS - 1.0,
    )


@pytest.mark.slow
def test_readings_of_a_field_are_off_by_what_they_state(measured_fields: list[NearFieldRun]) -> None:
    """The variance over sets of rays at each lit position over the stated one: from 1/2 to 2 on average.

    Of sixteen sets each is known to 37 %, and their mean, of 19 that err together, to some 20 %.
    """
    light = np.array([run.illuminance for run in measured_fields])
    lit = light.mean(axis=0) > 0.05 * light.mean(axis=0).max()
    stated = np.mean([run.illuminance_error**2 for run in measured_fields], axis=0)
    assert lit.sum() > 15
    assert 0.5 < float(np.mean(light.var(axis=0, ddof=1)[lit] / stated[lit])) < 2.0
