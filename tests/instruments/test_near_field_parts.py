"""Parts of the virtual near-field goniophotometer: its positions, its camera, exposures put together, starting points."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.instruments.near_field.camera import Camera
from etendue.instruments.near_field.merging import Merging
from etendue.instruments.near_field.positions import ArmPositions
from etendue.instruments.near_field.starting_points import closest_surface, on_surface
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE
from scipy.stats import chi2

Array = npt.NDArray[np.float64]


def towards(*, gamma: Array, c: Array) -> Array:
    g, a = np.radians(gamma), np.radians(c)
    return np.stack([np.sin(g) * np.cos(a), np.sin(g) * np.sin(a), np.cos(g)], axis=-1)


@pytest.mark.parametrize("exponent", [1, 2, 5])
def test_weights_integrate_lobes_above_the_horizon(exponent: int) -> None:
    """cosⁿ γ above the horizon and nothing below: 2π/(n + 1), with its kink at 90°, to parts in 10⁵."""
    stops = ArmPositions(5, 20)
    lobe = np.maximum(np.cos(np.radians(stops.gamma)), 0.0) ** exponent
    assert stops.weight @ lobe == pytest.approx(2 * math.pi / (exponent + 1), rel=3e-5)


def test_weights_integrate_a_tilted_lobe() -> None:
    """((1 + a·k)/2)⁶ about a tilted axis a: 4π/7."""
    stops = ArmPositions(10, 15)
    axis = towards(gamma=np.array(33.0), c=np.array(71.0))
    lobe = (0.5 + 0.5 * towards(gamma=stops.gamma, c=stops.c) @ axis) ** 6
    assert stops.weight @ lobe == pytest.approx(4 * math.pi / 7, rel=2e-4)


def test_directions_between_positions_are_even() -> None:
    """Positions drawn by the solid angles of their hats, then directions between: the sphere evenly, by χ²."""
    stops = ArmPositions(30, 60)
    rng = np.random.default_rng(5)
    n = 200_000
    k = stops.drawn(rng.choice(len(stops), n, p=stops.hat / (4.0 * math.pi)), rng)
    height = np.clip(((k[:, 2] + 1) / 2 * 20).astype(int), 0, 19)
    turn = np.clip(((np.arctan2(k[:, 1], k[:, 0]) / math.pi + 1) / 2 * 24).astype(int), 0, 23)
    counts = np.bincount(height * 24 + turn, minlength=480)
    statistic = ((counts - n / 480) ** 2 / (n / 480)).sum()
    assert SIGNIFICANCE < chi2.sf(statistic, 479) < 1 - SIGNIFICANCE


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        ((7, 10), "in γ"),
        ((10, 7), "in C"),
        ((0.01, 5), "at least"),
        ((10, 180), "at most"),
        ((45, 5), "at most"),
        ((math.nan, 5), "γ"),
    ],
)
def test_impossible_steps_are_told(steps: tuple[float, float], told: str) -> None:
    with pytest.raises(ArgumentError, match=told):
        ArmPositions(*steps)


def test_counts_have_the_mean_and_the_noise_of_their_electrons() -> None:
    """z of the mean; χ² of the variance: electrons, reading, and the converter's steps of one count (1/12)."""
    camera = Camera(bits=12, full_well=20_000, read_noise=12, exposures=2, exposure_ratio=4)
    rng, n = np.random.default_rng(3), 40_000
    counts = camera.expose(np.full(n, 2.5), 100.0, camera.times, rng).astype(float) - camera.dark_level
    per = camera.electrons_per_count
    for j, expected in enumerate((250.0, 1000.0)):
        variance = expected / per + (12 / per) ** 2 + 1 / 12
        assert abs(counts[:, j].mean() - expected) < LARGEST_Z * math.sqrt(variance / n)
        statistic = ((counts[:, j] - expected) ** 2).sum() / variance
        assert SIGNIFICANCE < chi2.sf(statistic, n) < 1 - SIGNIFICANCE


def test_blur_spreads_a_point_by_its_width_and_loses_no_light() -> None:
    image = np.zeros((41, 33))
    image[20, 15] = 7.0
    spread = Camera(blur=3.0).blurred(image)
    assert spread.sum() == pytest.approx(7.0, rel=1e-12)
    across, along = spread.sum(axis=0) / 7.0, spread.sum(axis=1) / 7.0
    sigma = 3.0 / math.sqrt(8 * math.log(2))
    # The variance of a Gaussian that falls into pixels is larger by that of a pixel.
    for shares, middle in ((across, 15), (along, 20)):
        place = np.arange(shares.size)
        assert (shares * place).sum() == pytest.approx(middle, abs=1e-12)
        assert (shares * (place - middle) ** 2).sum() == pytest.approx(sigma**2 + 1 / 12, rel=3e-3)


def test_merged_exposures_are_right_over_five_decades() -> None:
    """Times off by some per cent, found from the pixels; the mean of each brightness by z, its error by χ²."""
    camera = Camera(bits=12, exposures=4, exposure_ratio=8, exposure_error=0.03)
    rng = np.random.default_rng(9)
    times = camera.true_times(seed=4)
    assert np.abs(times / camera.times - 1).max() > 0.01
    levels, each = np.geomspace(0.06, 3600.0, 23), 4000
    truth = np.repeat(levels, each)
    counts = camera.expose(truth, 1.0, times, rng)
    merging = Merging.calibrated(camera, [counts[:50_000], counts[50_000:]])
    # In units of the shortest exposure, which is what it is.
    deviation = (merging.times[1:] / merging.times[:-1]) / (times[1:] / times[:-1]) - 1
    assert (np.abs(deviation) < LARGEST_Z * merging.errors[1:]).all()
    assert (merging.errors[1:] < 2e-3).all()
    merged, saturated = merging.merged(counts)
    assert not saturated.any()
    merged = merged.reshape(levels.size, each) / times[0]
    error = merging.standard_error(levels * times[0]) / times[0]
    bright = levels * times[-1] > 3 * camera.least_count
    z = (merged.mean(axis=1) / levels - 1) / np.hypot(error / levels / math.sqrt(each), 2e-3)
    assert np.abs(z[bright]).max() < LARGEST_Z
    # Near the change from one exposure to the next, some pixels of a level use the one and some the other.
    steady = bright & np.all(np.abs(levels[:, None] * times / (0.9 * camera.highest) - 1) > 0.2, axis=1)
    ratio = merged.var(axis=1, ddof=1)[steady] / error[steady] ** 2
    assert np.abs(ratio - 1).max() < LARGEST_Z * math.sqrt(2 / each) + 0.05


def test_the_converter_s_steps_do_not_lose_faint_light_when_times_are_compared() -> None:
    """Most pixels read 0 in the shorter exposure of a quiet camera of few bits: 0.3 of a count; some have enough."""
    camera = Camera(bits=8, read_noise=5, exposures=2, exposure_error=0.05)
    rng = np.random.default_rng(2)
    truth = np.concatenate([np.full(200_000, 0.3), rng.uniform(2.0, 20.0, 20_000)])
    counts = camera.expose(truth, 1.0, np.array([1.0, 10.7]), rng)
    merging = Merging.calibrated(camera, [counts])
    assert abs(merging.times[1] / 10.7 - 1) < LARGEST_Z * merging.errors[1] + 2e-3


def test_saturated_pixels_are_those_that_even_the_shortest_exposure_cannot_hold() -> None:
    camera = Camera(bits=8, exposures=2)
    merged, saturated = Merging(camera, camera.times, np.zeros(2)).merged(
        np.array([[255, 255], [254, 255], [3 + 2, 30 + 2], [0 + 2, 1 + 2]], dtype=np.uint16)
    )
    assert saturated.tolist() == [True, False, False, False]
    assert camera.dark_level == 2
    assert merged[1] == pytest.approx(252.0)
    assert merged[2] == pytest.approx(3.0)
    assert merged[3] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "surface",
    [
        et.Sphere(radius=2.0, centre=(0.3, -0.2, 0.5)),
        et.Hemisphere(radius=2.0, centre=(0.3, -0.2, 0.5)),
        et.Cylinder(radius=1.0, bottom=-1.0, top=2.0, centre=(0.3, -0.2)),
        et.Cylinder(radius=1.0, bottom=-1.0, top=2.0, centre=(-0.2, 0.5), axis="x"),
        et.Box(2.0, 3.0, 1.0, (0.3, -0.2, 0.5)),
        et.Disk(radius=2.0, z=0.5, centre=(0.3, -0.2)),
        et.Plane(z=0.5, width=4.0, height=2.0, centre=(0.3, -0.2)),
    ],
    ids=lambda s: s.NAME,
)
def test_lines_leave_surfaces_where_rays_that_start_there_do(surface: et.Sphere) -> None:
    """Rays drawn from a field on the surface start on it; their lines, taken up anywhere, are brought back there."""
    rng = np.random.default_rng(2)
    k = rng.standard_normal((2000, 3))
    k /= np.linalg.norm(k, axis=1, keepdims=True)
    field = et.LightField.fit(
        et.RaySet(np.array([0.3, -0.2, 0.5]) + 0.4 * rng.standard_normal(k.shape), k, np.ones(len(k))), surface,
        depths=(1, 1, 1, 1),
    )  # fmt: skip
    rays = field.sample(1000, seed=3)
    shifted = rays.position + rng.uniform(-9, 9, (1000, 1)) * rays.direction
    starts, missed = on_surface(surface, shifted, rays.direction)
    assert not missed.any()
    assert np.abs(starts - rays.position).max() < 1e-5


@pytest.mark.slow
def test_the_closest_surface_is_that_of_least_etendue() -> None:
    """Of a flat source a disk at its depth; of an even ball the ball."""
    rng = np.random.default_rng(8)
    n = 6000
    k = rng.standard_normal((n, 3))
    k /= np.linalg.norm(k, axis=1, keepdims=True)
    # Lambertian from a unit ball: a point of it, and a direction about its normal.
    normal = rng.standard_normal((n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    out = normal + k
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    ball = closest_surface(et.RaySet(normal + np.array([5.0, 0.0, 1.0]), out, np.ones(n)))
    assert ball.NAME == "sphere"
    assert ball.parts()[0].size[0] == pytest.approx(1.0, rel=0.03)
    up = np.array([0.0, 0.0, 1.0]) + k
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    flat = np.stack([rng.uniform(-1, 1, n), rng.uniform(-2, 2, n), np.full(n, 0.7)], axis=1)
    plane = closest_surface(et.RaySet(flat - 3.0 * up, up, np.ones(n)))
    assert plane.NAME == "plane"
    assert plane.parts()[0].centre[2] == pytest.approx(0.7, abs=0.05)
    assert plane.area == pytest.approx(8.0, rel=0.1)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"bits": 20}, "bits"),
        ({"exposures": 2.5}, "exposures"),
        ({"read_noise": math.nan}, "read_noise"),
        ({"exposure_ratio": 1.0}, "exposure_ratio"),
        ({"threshold": 0.0}, "threshold"),
    ],
)
def test_impossible_cameras_are_told(settings: dict[str, float], told: str) -> None:
    with pytest.raises(ArgumentError, match=told):
        Camera(**settings)  # type: ignore[arg-type] - what users may give
