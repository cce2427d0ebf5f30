"""The virtual near-field goniophotometer against a lamp without symmetry whose luminance is known in closed form."""

from __future__ import annotations

import math
import re
from pathlib import Path

import etendue as et
import h5py
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.instruments.near_field.camera import Camera
from etendue.instruments.near_field.far_field import linear_notes, step_notes
from etendue.instruments.near_field.positions import ArmPositions
from etendue.instruments.near_field.setting import Setting
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

STEEP, SOFT = 5e4, 2e4
"""Luminance of the two parts of the lamp in closed form [cd/m²]."""

HIGH, LOW = 0.4, -0.2
"""Their heights [mm]."""


def two_parts(points: Array, k: Array) -> Array:
    """A rectangle whose luminance rises towards +x, and a disk below it that is brightest along its normal; both look up."""
    up = np.where(k[:, 2] > 0.0, k[:, 2], np.nan)

    def at(z: float) -> tuple[Array, Array]:
        along = (z - points[:, 2]) / up
        return points[:, 0] + along * k[:, 0], points[:, 1] + along * k[:, 1]

    x, y = at(HIGH)
    rectangle = (x > 0.2) & (x < 1.4) & (y > -0.5) & (y < 0.3)
    u, v = at(LOW)
    disk = np.hypot(u + 0.9, v - 0.2) < 0.6
    found = np.where(rectangle, STEEP * (1.0 + 0.6 * k[:, 0]), 0.0) + np.where(disk, SOFT * k[:, 2], 0.0)
    return np.where(np.isnan(up), 0.0, found)


AREAS = (1.2 * 0.8, math.pi * 0.6**2)
FLUX = (math.pi * STEEP * AREAS[0] + 2 * math.pi / 3 * SOFT * AREAS[1]) / 1e6
"""∫ L cos γ over the hemisphere: the term in x vanishes, cos² γ leaves 2π/3 [lm]."""


def intensity(*, gamma: Array, c: Array) -> Array:
    """In closed form [cd]."""
    g, a = np.radians(gamma), np.radians(c)
    rectangle = STEEP * (1 + 0.6 * np.sin(g) * np.cos(a)) * AREAS[0] * np.cos(g)
    return np.where(gamma < 90.0, rectangle + SOFT * AREAS[1] * np.cos(g) ** 2, 0.0) / 1e6


QUIET = {"read_noise": 0.0, "full_well": 1e8, "bits": 16}
"""A camera whose noise does not matter."""


@pytest.fixture(scope="module")
def run() -> et.NearFieldRun:
    gonio = et.NearFieldGoniophotometer(step=10, camera_pixels=64, distance=60, exposures=2, **QUIET)
    return gonio.measure(two_parts, size=3.4, samples=4)


@pytest.mark.slow
def test_flux_is_the_integral_of_illuminance(run: et.NearFieldRun) -> None:
    assert run.total_flux == pytest.approx(FLUX, rel=1e-3)


@pytest.mark.slow
def test_images_show_the_luminance_in_its_place(run: et.NearFieldRun) -> None:
    """Pixels that lie wholly in one part, by four lines through their corners; the scale comes from the photometer."""
    for gamma, c in ((0.0, 0.0), (30.0, 45.0), (60.0, 210.0)):
        lmap = run.luminance_map(gamma, c)
        screen, observer = lmap.screen, lmap.observer
        right, up, _ = screen.axes(observer)
        corners = []
        for i in (-0.5, 0.5):
            for j in (-0.5, 0.5):
                x, y = screen.x + i * screen.width / screen.columns, screen.y + j * screen.height / screen.rows
                points = (np.asarray(observer.target) + x[None, :, None] * right + y[:, None, None] * up).reshape(-1, 3)
                k = observer.position - points
                k /= np.linalg.norm(k, axis=1, keepdims=True)
                corners.append(two_parts(points, k).reshape(screen.shape))
        stack = np.array(corners)
        mean = stack.mean(axis=0)
        inside = (stack.min(axis=0) > 0.97 * mean) & (mean > 0.0)
        assert inside.sum() > 100
        assert lmap.values[inside] == pytest.approx(mean[inside], rel=3e-3)
        assert lmap.values[stack.max(axis=0) == 0.0].mean() < 1e-3 * mean.max()


@pytest.mark.slow
def test_intensity_by_the_photometer_is_that_of_the_lamp(run: et.NearFieldRun) -> None:
    """In the far field but for (size/distance)², 3 · 10⁻³ here; a distance of 18 sizes."""
    found = run.intensity()
    gamma, c = np.array([0.0, 30.0, 60.0, 75.0]), np.array([0.0, 75.0, 195.0, 300.0])
    for g, a in zip(gamma, c, strict=True):
        assert found.at(a, g) == pytest.approx(intensity(gamma=g, c=a), rel=0.02, abs=1e-6)
    assert found.flux_error == run.total_flux_error


def shares() -> tuple[Array, Array]:
    """Expected flux of each part, half and direction bin; the bins are 3 zones × 8 sectors, by quadrature in closed form."""
    zones, sectors = np.array([0.0, 10.0, 20.0, 30.0]), np.linspace(0.0, 360.0, 9)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    table = np.zeros((2, 3, 8))
    for i in range(3):
        for j in range(8):
            g = (zones[i] + zones[i + 1]) / 2 + nodes * (zones[i + 1] - zones[i]) / 2
            a = (sectors[j] + sectors[j + 1]) / 2 + nodes * (sectors[j + 1] - sectors[j]) / 2
            w = np.outer(weights * (zones[i + 1] - zones[i]) / 2, weights * 22.5) * np.radians(1.0) ** 2
            sin, cos = np.sin(np.radians(g))[:, None], np.cos(np.radians(g))[:, None]
            table[0, i, j] = (w * STEEP * (1 + 0.6 * sin * np.cos(np.radians(a))) * AREAS[0] * cos * sin).sum()
            table[1, i, j] = (w * SOFT * AREAS[1] * cos**2 * sin + 0 * a).sum()
    return np.concatenate([zones]), table / 1e6 / FLUX


@pytest.mark.slow
@pytest.mark.parametrize("surface", [et.Box(3.0, 1.8, 0.6, (0.0, 0.1, 0.1)), "closest"], ids=["box", "closest"])
def test_rays_have_the_lamp_s_places_and_directions(run: et.NearFieldRun, surface: et.Box) -> None:
    """χ² over which part each ray comes from, which half of it, and 24 directions; more than chance, interpolation errs.

    Between positions 10° apart the light of a point is taken for linear: off by up to (10°)²/8 = 0.4 %; places by the
    height of the surface over the part, times that angle.
    """
    rays = run.ray_set(40_000, surface=surface, seed=3)
    assert rays.total_flux == pytest.approx(run.total_flux, rel=1e-9)
    k, x = rays.direction, rays.position
    gamma = np.degrees(np.arccos(k[:, 2]))
    sector = (np.degrees(np.arctan2(k[:, 1], k[:, 0])) % 360.0 // 45.0).astype(int)
    high = x + ((HIGH - x[:, 2]) / k[:, 2])[:, None] * k
    low = x + ((LOW - x[:, 2]) / k[:, 2])[:, None] * k
    zones, expected = shares()
    zone = np.digitize(gamma, zones) - 1
    seen = np.zeros((2, 3, 8))
    # Below 30° the rectangle is seen beyond x = -0.15 in the plane of the disk, which ends at -0.3.
    part = np.where(low[:, 0] < -0.2, 1, 0)
    used = zone < 3
    np.add.at(seen, (part[used], zone[used], sector[used]), 1)
    statistic = (seen - 40_000 * expected) ** 2 / (40_000 * expected)
    assert chi2.sf(statistic.sum(), statistic.size) > SIGNIFICANCE
    # Within the rectangle the light is even: half of it lies beyond its middle, in x and in y.
    steep = (part == 0) & (gamma < 30)
    for axis, middle in ((0, 0.8), (1, -0.1)):
        beyond = (high[steep, axis] > middle).mean()
        assert abs(beyond - 0.5) < LARGEST_Z * 0.5 / math.sqrt(steep.sum())
    assert high[steep, 0].max() < 1.4 + 0.15


def test_light_between_positions_is_linear_up_to_the_axis_and_the_horizon() -> None:
    """A Lambertian square, cos γ at the positions and linear between: flux of zones by quadrature, and their rays by χ².

    Even on the axis, where one position stands for all, and at 90°, where light that goes to one side has its kink.
    """

    def square(points: Array, k: Array) -> Array:
        up = np.where(k[:, 2] > 1e-9, k[:, 2], np.inf)
        at = points - (points[:, 2] / up)[:, None] * k
        return np.where((k[:, 2] > 1e-9) & (np.abs(at[:, :2]).max(axis=1) < 1.0), 1e6, 0.0)

    seen = et.NearFieldGoniophotometer((15, 30), camera_pixels=16, distance=60, exposures=3, **QUIET)
    rays = seen.measure(square, size=3.0, samples=16).ray_set(20_000, surface=et.Plane(z=0), seed=2)
    edges = np.array([0.0, 4.0, 8.0, 15.0, 25.0, 35.0, 50.0, 65.0, 75.0, 82.0, 90.0])
    counts = np.histogram(np.degrees(np.arccos(rays.direction[:, 2])), edges)[0]
    gamma = (np.arange(90_000) + 0.5) / 1000.0
    stops = np.arange(0.0, 91.0, 15.0)
    light = np.interp(gamma, stops, np.cos(np.radians(stops))) * np.sin(np.radians(gamma))
    expected = np.histogram(gamma, edges, weights=light)[0] * len(rays) / light.sum()
    assert chi2.sf(((counts - expected) ** 2 / expected).sum(), expected.size - 1) > SIGNIFICANCE


def test_a_table_that_is_too_coarse_for_its_flux_says_so() -> None:
    """Σ cos γ over hats, by quadrature: 2.3 % below π in steps of 30°, 0.26 % in steps of 10°."""

    def disk(points: Array, k: Array) -> Array:
        up = np.where(k[:, 2] > 1e-9, k[:, 2], np.inf)
        at = points - (points[:, 2] / up)[:, None] * k
        return np.where((k[:, 2] > 1e-9) & (np.hypot(at[:, 0], at[:, 1]) < 1.0), 1e6, 0.0)

    for step, told in ((30.0, True), (10.0, False)):
        seen = et.NearFieldGoniophotometer((step, 60), camera_pixels=16, distance=60, **QUIET)
        run = seen.measure(disk, size=2.2, samples=16)
        table = run.intensity()
        gamma = np.radians((np.arange(90_000) + 0.5) / 1000.0)
        stops = np.radians(np.arange(0.0, 91.0, step))
        share = 2.0 * (np.interp(gamma, stops, np.cos(stops)) * np.sin(gamma)).mean() * np.pi / 2.0
        assert table.flux / run.total_flux == pytest.approx(share, abs=2e-3)
        assert any("linear between positions" in note for note in table.notes) == told


@pytest.mark.slow
def test_any_stretch_of_a_ray_file_is_spread_over_the_light(run: et.NearFieldRun) -> None:
    """The first tenth has the mean direction of all rays."""
    k = run.ray_set(20_000, seed=1).direction
    error = k.std(axis=0) / math.sqrt(2000)
    assert (np.abs(k[:2000].mean(axis=0) - k.mean(axis=0)) < LARGEST_Z * error).all()


@pytest.mark.slow
def test_one_ray_for_each_lit_pixel(run: et.NearFieldRun) -> None:
    rays = run.ray_set()
    assert len(rays) == run.lit_pixels
    assert rays.total_flux == pytest.approx(run.total_flux, rel=1e-9)
    mean = np.average(rays.direction, axis=0, weights=rays.flux)
    drawn = run.ray_set(40_000, seed=5).direction
    error = drawn.std(axis=0) / math.sqrt(40_000)
    assert (np.abs(drawn.mean(axis=0) - mean) < LARGEST_Z * error).all()


@pytest.mark.slow
def test_a_photometer_elsewhere_measures_the_same_flux() -> None:
    gonio = et.NearFieldGoniophotometer(step=(10, 30), camera_pixels=48, distance=40, photometer_distance=20, **QUIET)
    near = gonio.measure(two_parts, size=3.4, samples=4)
    assert near.total_flux == pytest.approx(FLUX, rel=2e-3)
    assert near.disagreement < 0.05
    assert any("far field" in note for note in near.intensity().notes)


def die_in_a_glow(points: Array, k: Array) -> Array:
    """A round die whose luminance falls as cos² to its rim, in a glow of a 5 000th of it, which has a sixth of the light."""
    up = k[:, 2] > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = (points[:, i] - points[:, 2] / k[:, 2] * k[:, i] for i in (0, 1))
    radius = np.hypot(x - 0.3, y + 0.2)
    die = np.where(radius < 1.0, 1e6 * np.cos(0.5 * math.pi * radius) ** 2, 0.0)
    glow = np.where(np.hypot(x, y) < GLOW, FAINT, 0.0)
    return np.where(up, die + glow, 0.0)


GLOW, FAINT = 18.0, 200.0
DIE_FLUX = math.pi * math.pi * (0.5 - 2.0 / math.pi**2)
"""∫ cos²(π r/2) over the disk: π (1/2 - 2/π²) [lm]."""
GLOW_FLUX = math.pi * FAINT * math.pi * GLOW**2 / 1e6


@pytest.fixture(scope="module")
def dim() -> et.NearFieldRun:
    gonio = et.NearFieldGoniophotometer(step=30, camera_pixels=128, distance=600, exposures=3)
    return gonio.measure(die_in_a_glow, size=36, samples=16)


@pytest.mark.slow
def test_one_exposure_loses_the_glow_and_sets_the_wrong_scale(dim: et.NearFieldRun) -> None:
    """The photometer sees all light, the camera the die alone: its luminance is too high by (die + glow)/die.

    A glow of 0.7 counts lies below the 10 that stand out from the noise.
    """
    one = dim.using(1)
    assert one.total_flux == pytest.approx(DIE_FLUX + GLOW_FLUX, rel=1e-3)
    lmap, whole = one.luminance_map(0), dim.luminance_map(0)
    radius = np.hypot(lmap.screen.x[None, :] - 0.3, lmap.screen.y[:, None] + 0.2)
    ratio = lmap.values[radius < 0.5] / whole.values[radius < 0.5]
    assert ratio == pytest.approx(1 + GLOW_FLUX / DIE_FLUX, rel=0.01)
    assert lmap.values[radius > 2].mean() < 1e-2 * FAINT


@pytest.mark.slow
def test_exposures_as_advised_bring_it_back(dim: et.NearFieldRun) -> None:
    """The glow's luminance by z, the die's to 1 %; the glow's share of the flux to 0.1 %."""
    lmap = dim.luminance_map(0)
    radius = np.hypot(lmap.screen.x[None, :] - 0.3, lmap.screen.y[:, None] + 0.2)
    inside = (radius > 1.5) & (radius < 15)
    values, error = lmap.values[inside], lmap.standard_error[inside]
    # The scale rests on the sum of all images, whose lines of sight see the die to 0.2 %.
    assert abs(values.mean() - FAINT) < LARGEST_Z * error.mean() / math.sqrt(values.size) + 2e-3 * FAINT
    die = lmap.values[radius < 1.5].sum() * lmap.screen.pixel_area
    assert die == pytest.approx(DIE_FLUX / math.pi * 1e6 + FAINT * math.pi * 1.5**2, rel=0.01)
    rays = dim.ray_set(surface=et.Disk(radius=20, z=0))
    x = rays.position - (rays.position[:, 2] / rays.direction[:, 2])[:, None] * rays.direction
    outside = np.hypot(x[:, 0] - 0.3, x[:, 1] + 0.2) > 1.5
    ring = (math.pi * GLOW**2 - math.pi * 1.5**2) * math.pi * FAINT / 1e6
    share = rays.flux[outside].sum() / rays.total_flux
    assert share == pytest.approx(ring / (DIE_FLUX + GLOW_FLUX), abs=1e-3)


def test_the_number_of_exposures_that_is_needed_is_told() -> None:
    """By the photometer alone: with one exposure the images disagree with it where the glow is brightest from the side.

    Both parts are Lambertian here, so that the missing glow changes no direction: the truth is asked in
    `test_one_exposure_…`. A lamp whose glow goes elsewhere shows it.
    """

    def sideways(points: Array, k: Array) -> Array:
        found = die_in_a_glow(points, k)
        return np.where(found == FAINT, FAINT * (1 + k[:, 0]), found)

    gonio = et.NearFieldGoniophotometer(step=30, camera_pixels=64, distance=600, exposures=4)
    lopsided = gonio.measure(sideways, size=36, samples=4)
    assert lopsided.using(1).disagreement > 0.02
    # The glow has 7.4 counts in the second exposure and 74 in the third: 10 are needed.
    assert lopsided.exposures_needed(0.003) == 3
    assert lopsided.exposures_needed(1e-6) is None
    assert any("other directions" in note for note in lopsided.using(1).notes)
    with pytest.raises(ArgumentError, match="1 to 4"):
        lopsided.using(5)


def test_saturation_is_told() -> None:
    gonio = et.NearFieldGoniophotometer(step=30, camera_pixels=32, distance=60, level=1.5)
    over = gonio.measure(two_parts, size=3.4, samples=4)
    assert over.saturated > 0
    assert any("saturated" in note for note in over.notes)


@pytest.mark.slow
def test_a_lamp_out_of_place_is_measured_out_of_place() -> None:
    """Rays of a lamp that stands 0.2 mm beside the middle start there."""
    settings = {"step": 15, "camera_pixels": 64, "distance": 60} | QUIET
    straight = et.NearFieldGoniophotometer(**settings).measure(two_parts, size=3.4, samples=4)
    astray = et.NearFieldGoniophotometer(misalignment=(0.2, -0.1, 0.0), **settings)
    off = astray.measure(two_parts, size=3.4, samples=4)
    flat = et.Plane(z=0.1, width=8, height=8)
    moved = off.ray_set(20_000, surface=flat).position - straight.ray_set(20_000, surface=flat).position
    assert moved.mean(axis=0)[:2] == pytest.approx([0.2, -0.1], abs=0.02)


def test_readings_of_the_photometer_err_as_stated() -> None:
    settings = {"step": 15, "camera_pixels": 32, "distance": 60} | QUIET
    exact = et.NearFieldGoniophotometer(**settings).measure(two_parts, size=3.4, samples=4, seed=4)
    noisy = et.NearFieldGoniophotometer(photometer_error=0.02, **settings).measure(
        two_parts, size=3.4, samples=4, seed=4
    )
    lit = exact.illuminance > 0
    z = (noisy.illuminance[lit] / exact.illuminance[lit] - 1) / 0.02
    assert SIGNIFICANCE < chi2.sf((z**2).sum(), z.size) < 1 - SIGNIFICANCE
    assert abs(noisy.total_flux - FLUX) < LARGEST_Z * noisy.total_flux_error + 2e-3 * FLUX


@pytest.mark.slow
def test_scenes_and_fields_are_measured_alike() -> None:
    """A rectangle as a scene, and a light field of it: the flux of both, with the error of lines of sight by z."""
    shape = {"kind": "rectangle", "width": 2.0, "height": 1.0}
    scene = et.Scene(sources=[{"kind": "surface", "shape": shape, "flux": 50, "at": [0.3, 0, 0.2]}])
    gonio = et.NearFieldGoniophotometer(step=30, camera_pixels=32)
    seen = gonio.measure(scene)
    assert abs(seen.total_flux - 50) < LARGEST_Z * seen.total_flux_error + 0.02
    assert 0 < seen.total_flux_error < 0.2
    rng = np.random.default_rng(1)
    n = 20_000
    sin, turn = np.sqrt(rng.random(n)), rng.uniform(0, 2 * math.pi, n)
    k = np.stack([sin * np.cos(turn), sin * np.sin(turn), np.sqrt(1 - sin**2)], axis=1)
    start = np.stack([0.3 + rng.uniform(-1, 1, n), rng.uniform(-0.5, 0.5, n), np.full(n, 0.2)], axis=1)
    rays = et.RaySet(start, k, np.full(n, 50 / n))
    field = et.LightField.fit(rays, et.Plane(z=0.2, width=2, height=1, centre=(0.3, 0)), depths=(2, 2, 2, 2))
    assert gonio.measure(field).total_flux == pytest.approx(50, rel=5e-3)


@pytest.mark.slow
def test_the_same_bits_for_any_number_of_threads() -> None:
    scene = et.Scene(sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 50}])
    gonio = et.NearFieldGoniophotometer(step=(30, 120), camera_pixels=16)
    one, three = gonio.measure(scene, threads=1), gonio.measure(scene, threads=3)
    assert (one.records == three.records).all()
    assert (one.illuminance == three.illuminance).all()
    assert (one.ray_set(300).position == three.ray_set(300).position).all()


@pytest.mark.slow
def test_a_measurement_in_a_file(run: et.NearFieldRun, tmp_path: Path) -> None:
    again = et.NearFieldRun.load(run.save(tmp_path / "lamp.h5"))
    assert again.setting.camera == run.setting.camera
    assert again.total_flux == run.total_flux
    assert again.total_flux_error == run.total_flux_error > 0.0
    assert (again.ray_set(500, seed=2).direction == run.ray_set(500, seed=2).direction).all()
    assert again.provenance == run.provenance


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    gonio = et.NearFieldGoniophotometer(step=(30, 90), camera_pixels=16, distance=60)
    path = gonio.measure(two_parts, size=3.4, samples=4).save(tmp_path / "lamp.h5")
    whole = path.read_bytes()
    for cut in range(0, len(whole), max(1, len(whole) // 40)):
        path.write_bytes(whole[:cut])
        with pytest.raises(FormatError, match=r"lamp\.h5"):
            et.NearFieldRun.load(path)
    for name, values in (("illuminance", math.nan), ("start", 10**9), ("pixel", 10**6)):
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            file[name][-1] = values
        with pytest.raises(FormatError, match=name):
            et.NearFieldRun.load(path)
    for value, told in ((-1.0, "flux_error"), (math.nan, "flux_error")):
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            file.attrs["flux_error"] = value
        with pytest.raises(FormatError, match=told):
            et.NearFieldRun.load(path)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"distance": -1}, "distance"),
        ({"distance": 1.5}, "move it away"),
        ({"photometer_distance": 1.0, "distance": 30}, "photometer stands"),
        ({"centre": (0, 0)}, "three finite coordinates"),
        ({"arm_error": -1}, "arm_error"),
        ({"step": 7}, "whole number of steps"),
    ],
)
def test_impossible_measurements_are_told(settings: dict[str, object], told: str) -> None:
    with pytest.raises(ArgumentError, match=told):
        et.NearFieldGoniophotometer(**{"step": 30, "camera_pixels": 16} | settings).measure(two_parts, size=3.4)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("step", "toward", "ways"),
    [
        ((30, 30), (0, 0, 1), ["along γ"]),
        ((10, 90), (1, 0, 1), ["along C"]),
        ((10, 30), (1, 0, 1), []),
        ((10, 90), (0, 0, 1), []),
    ],
)
def test_beams_between_positions_are_told(
    step: tuple[float, float], toward: tuple[float, float, float], ways: list[str]
) -> None:
    """cos¹⁰ of the angle to an axis: where the flux of the positions is off by 2 %, a note says so.

    With I = cosⁿ the flux is 2π/(n + 1).
    """
    stops = ArmPositions(*step)
    axis = np.array(toward) / np.linalg.norm(toward)
    gamma, c = np.radians(stops.gamma), np.radians(stops.c)
    cosine = np.stack([np.sin(gamma) * np.cos(c), np.sin(gamma) * np.sin(c), np.cos(gamma)], axis=1) @ axis
    light = np.maximum(cosine, 0.0) ** 10
    off = abs(stops.weight @ light / (2 * np.pi / 11) - 1.0)
    setting = Setting(stops, Camera(8), 100.0, 100.0, 5.0, (0.0, 0.0, 0.0), 4.0)
    told = list(step_notes(setting, stops.table(light)))
    assert [way for way in ("along γ", "along C") if any(way in note for note in told)] == ways
    assert (off > 0.02) == bool(ways)


@pytest.mark.parametrize(
    ("step", "gamma", "power"), [((5, 5), 90, 12), ((5, 10), 60, 8), ((10, 5), 90, 8), ((5, 5), 0, 20)]
)
def test_beams_that_straight_lines_lower_are_told(step: tuple[float, float], gamma: float, power: int) -> None:
    """cosⁿ of the angle to an axis, at the positions and linear between: how much lower it is within a step of its peak."""
    stops = ArmPositions(*step)

    def beam(g: Array, c: Array) -> Array:
        g, c, axis = np.radians(g), np.radians(c - 180.0), np.radians(gamma)
        return np.maximum(np.sin(g) * np.cos(c) * np.sin(axis) + np.cos(g) * np.cos(axis), 0.0) ** power

    table = beam(stops.rings[None, :], stops.planes[:, None])
    linear = RegularGridInterpolator((stops.planes, stops.rings), table)
    g = gamma + step[0] * (np.arange(200) + 0.5) / 200.0 * (-1.0 if gamma == 90 else 1.0)
    c = 180.0 + step[1] * (np.arange(200) + 0.5) / 200.0
    places = np.stack(np.meshgrid(c, g, indexing="ij"), axis=-1)
    weight = np.sin(np.radians(g))[None, :]
    lost = ((beam(places[..., 1], places[..., 0]) - linear(places)) * weight).mean() / weight.mean()
    setting = Setting(stops, Camera(8), 100.0, 100.0, 5.0, (0.0, 0.0, 0.0), 4.0)
    (note,) = linear_notes(setting, table)
    stated = float(re.findall(r"by some ([0-9.]+)%", note)[0]) / 100.0
    # What is left out is some three times (step/width)² of it.
    assert stated == pytest.approx(lost, rel=0.15)


@pytest.mark.parametrize("seed", [-1, 1 << 64, 0.5])
def test_seeds_that_are_none_are_told(seed: int) -> None:
    run = et.NearFieldGoniophotometer(step=30, camera_pixels=16, distance=60).measure(two_parts, size=3.4, samples=1)
    for use in (run.ray_set, run.closest_surface, run.light_field):
        with pytest.raises(ArgumentError, match="seed is"):
            use(seed=seed)  # type: ignore[operator]


@pytest.mark.slow
def test_what_cannot_be_measured_is_told() -> None:
    gonio = et.NearFieldGoniophotometer(step=30, camera_pixels=16)
    with pytest.raises(ArgumentError, match="size"):
        gonio.measure(two_parts)
    with pytest.raises(ArgumentError, match="no light was seen"):
        gonio.measure(lambda points, _: np.zeros(len(points)), size=2)
    with pytest.raises(ArgumentError, match="no source"):
        gonio.measure(3)  # type: ignore[arg-type]
