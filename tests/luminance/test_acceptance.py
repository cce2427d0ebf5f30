"""The automatic acceptance against the one chosen knowing the truth."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.luminance.acceptance import LADDER, choose_acceptance, comparison_screen
from etendue.luminance.cone import ConeView, cone_estimates


def lobed_source(n: int, exponent: float, seed: int) -> et.RaySet:
    """A rectangle with a ramp of luminance, whose lobe cos^(n-1) θ leans away from the normal towards +X by 12°."""
    rng = np.random.default_rng(seed)
    x = 10.0 * np.sqrt(rng.random(n)) - 5.0
    y = 6.0 * rng.random(n) - 3.0
    cos = rng.random(n) ** (1.0 / (exponent + 1.0))
    phi = 2 * np.pi * rng.random(n)
    sin = np.sqrt(1 - cos**2)
    lean = np.radians(12.0)
    p, q, r = sin * np.cos(phi), sin * np.sin(phi), cos
    direction = np.stack([p * np.cos(lean) + r * np.sin(lean), q, -p * np.sin(lean) + r * np.cos(lean)], axis=1)
    return et.RaySet(np.stack([x, y, np.zeros(n)], axis=1), direction, np.full(n, 100.0 / n))


def lobed_truth(screen: et.Screen, observer: et.Observer, exponent: float) -> npt.NDArray[np.float64]:
    """I(direction)/(A cos θ_normal) of the ramp, at the pixel centres of a screen in the source's plane [cd/m²]."""
    lean = np.radians(12.0)
    x, y = np.meshgrid(screen.x, screen.y)
    to_eye = observer.position - np.stack([x, y, np.zeros_like(x)], axis=-1)
    to_eye /= np.linalg.norm(to_eye, axis=-1)[..., None]
    cos_lobe = np.clip(to_eye @ np.array([np.sin(lean), 0, np.cos(lean)]), 0, 1)
    intensity = 100.0 * (exponent + 1) / (2 * np.pi) * cos_lobe**exponent
    density = np.where((np.abs(x) < 5) & (np.abs(y) < 3), 2 * (x + 5) / 100 / 6, 0.0) * 1e6
    return intensity * density / to_eye[..., 2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "exponent", "pixels"),
    [(2_000_000, 400.0, 16), (200_000, 400.0, 16), (2_000_000, 5.0, 32), (100_000, 60.0, 8)],
)
def test_the_chosen_acceptance_is_nearly_the_best(n: int, exponent: float, pixels: int) -> None:
    """Root mean square error within 25 % of the best rung's, which only the truth knows; narrow lobes and wide ones."""
    rays = lobed_source(n, exponent, seed=n)
    observer, screen = et.Observer(10.0, 0.0, 2000.0), et.Screen(10.0, 6.0, pixels, pixels // 2, "xy")
    estimate = cone_estimates(rays, [ConeView(observer, screen, LADDER)])[0][0]
    truth = lobed_truth(screen, observer, exponent)
    error = np.sqrt(((estimate.luminance - truth) ** 2).sum(axis=(1, 2)) / (truth**2).sum())
    choice = choose_acceptance(estimate, screen)
    assert error[choice.index] < 1.25 * error.min(), (LADDER[choice.index], LADDER[int(error.argmin())])


def unequal_rays(n: int, seed: int) -> et.RaySet:
    """A Lambertian square of 4 mm and 100 lm in expectation; two of a hundred rays have a hundred times the others' flux."""
    rng = np.random.default_rng(seed)
    cos, phi = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    sin = np.sqrt(1 - cos**2)
    place = np.stack([4 * rng.random(n) - 2, 4 * rng.random(n) - 2, np.zeros(n)], axis=1)
    flux = np.where(rng.random(n) < 0.02, 100.0, 1.0) * 100.0 / (n * (0.02 * 100 + 0.98))
    return et.RaySet(place, np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1), flux)


def test_a_cone_that_by_chance_sees_no_heavy_ray_is_not_chosen_for_its_small_noise() -> None:
    """Intensity towards the observer: of a cone of half-angle α, Φ/π · (1 + cos α)/2 (theory eq. 9) in the mean of sets.

    Narrow cones see few rays, mostly light ones: their squares make little of their noise, and less of the light.
    """
    observer, screen = et.Observer(0, 0, 20000), et.Screen(5, 5, 16, 16)
    area = screen.width * screen.height / (screen.columns * screen.rows) * 1e-6
    missing = []
    for seed in range(60):
        estimate = cone_estimates(unequal_rays(20_000, seed), [ConeView(observer, screen, LADDER)])[0][0]
        choice = choose_acceptance(estimate, screen)
        expected = 100 / np.pi * (1 + np.cos(np.radians(choice.acceptance))) / 2
        missing.append(estimate.luminance[choice.index].sum() * area / expected - 1)
    z = np.mean(missing) / (np.std(missing, ddof=1) / np.sqrt(len(missing)))
    assert abs(z) < 3.3, (z, np.mean(missing))  # two-sided, 0.1 %


@pytest.mark.slow
def test_the_cases_above_have_different_answers() -> None:
    """Otherwise a constant would pass: a sharp lobe with many rays wants a narrow cone, a wide lobe a wide one."""
    chosen = []
    for n, exponent in ((2_000_000, 2000.0), (2_000_000, 5.0)):
        observer, screen = et.Observer(10.0, 0.0, 2000.0), et.Screen(10.0, 6.0, 16, 8, "xy")
        estimate = cone_estimates(lobed_source(n, exponent, 3), [ConeView(observer, screen, LADDER)])[0][0]
        chosen.append(choose_acceptance(estimate, screen).acceptance)
    assert chosen[0] < chosen[1] / 2


def test_a_large_screen_is_compared_on_a_coarser_one_and_mapped_on_its_own() -> None:
    screen = et.Screen(70, 35, 1000, 500)
    coarse = comparison_screen(screen)
    assert coarse.columns * coarse.rows <= 1 << 16
    assert (coarse.width, coarse.height) == (70, 35)
    rays = et.RingSource(rays=400_000, seed=2)
    lmap = et.luminance_map(rays, et.Observer(0, 0, 150), screen, acceptance="auto")
    assert lmap.values.shape == (500, 1000)
    note = next(note for note in lmap.notes if note.startswith("acceptance"))
    angle = float(note.split("°")[0].removeprefix("acceptance "))
    near = min(LADDER, key=lambda a: abs(a - angle))
    alone = et.luminance_map(rays, et.Observer(0, 0, 150), screen, method="cone", acceptance=near)
    np.testing.assert_array_equal(alone.values, lmap.values)


def test_the_automatic_map_is_the_cone_map_at_the_chosen_acceptance() -> None:
    rays = lobed_source(300_000, 60.0, seed=1)
    args = et.Observer(10, 0, 2000), et.Screen(10, 6, 16, 8)
    automatic = et.luminance_map(rays, *args, method="cone", acceptance="auto")
    note = next(note for note in automatic.notes if note.startswith("acceptance"))
    angle = min(LADDER, key=lambda a: abs(a - float(note.split("°")[0].removeprefix("acceptance "))))
    cone = et.luminance_map(rays, *args, method="cone", acceptance=angle)
    np.testing.assert_array_equal(cone.values, automatic.values)
    np.testing.assert_array_equal(cone.standard_error, automatic.standard_error)
    assert "blur" in note
    assert any("automatic" in step for step in automatic.provenance.steps)
    stated = et.luminance_map(rays, *args, acceptance=angle)
    np.testing.assert_array_equal(cone.values, stated.values)
    assert stated.provenance == cone.provenance
