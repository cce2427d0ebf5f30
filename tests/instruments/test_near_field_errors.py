"""Errors that a near-field goniophotometer states of lamps that are functions and fields."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.instruments.near_field.run import NearFieldRun

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
    assert any("errors of the readings are those of the field" in note for note in runs[0].notes)
