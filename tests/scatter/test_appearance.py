"""Gloss and haze against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.scatter.appearance import RECEPTORS, appearance, specular_gloss, transmission_haze
from etendue.scatter.models import Coated, Gaussian, Lambertian, Mirror, Mixture, Transmitter


def glass(*, index: float, angle: float) -> float:
    """Reflectance of polished glass for unpolarised light, by the angles of Fresnel's sines and tangents."""
    i = math.radians(angle)
    t = math.asin(math.sin(i) / index)
    return 0.5 * ((math.sin(i - t) / math.sin(i + t)) ** 2 + (math.tan(i - t) / math.tan(i + t)) ** 2)


@pytest.mark.parametrize("angle", RECEPTORS)
def test_polished_glass(angle: int) -> None:
    """100 by definition for an index of 1.567, and the ratio of Fresnel's reflectances for others."""
    assert specular_gloss(Coated(index=1.567, base_reflectance=0.0), angle) == pytest.approx(100.0, rel=1e-12)
    other = 100.0 * glass(index=1.5, angle=angle) / glass(index=1.567, angle=angle)
    assert specular_gloss(Coated(index=1.5, base_reflectance=0.0), angle) == pytest.approx(other, rel=1e-9)
    mirror = 100.0 * 0.9 / glass(index=1.567, angle=angle)
    assert specular_gloss(Mirror(reflectance=0.9), angle) == pytest.approx(mirror, rel=1e-9)


@pytest.mark.parametrize("angle", RECEPTORS)
def test_a_lambertian_surface(angle: int) -> None:
    """ρ/π ∫ cosθ dΩ = ρ/π 2 cosθ sin δ (ε + sin ε cos ε) over a rectangle of half angles δ and ε."""
    along, across = (math.radians(0.5 * side) for side in RECEPTORS[angle])
    seen = 0.8 / math.pi * 2.0 * math.cos(math.radians(angle)) * math.sin(along)
    seen *= across + math.sin(across) * math.cos(across)
    expected = 100.0 * seen / glass(index=1.567, angle=angle)
    assert specular_gloss(Lambertian(reflectance=0.8), angle) == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_lobe_much_narrower_than_the_receptor_counts_whole_and_a_wide_one_does_not() -> None:
    sigma = 2e-3
    narrow = Gaussian(peak=0.5 / (2.0 * math.pi * sigma**2), sigma=sigma)
    assert specular_gloss(narrow, 60) == pytest.approx(50.0 / glass(index=1.567, angle=60), rel=2e-3)
    # By another route: rays that are drawn from directions within the source, counted in the receptor.
    sigma = 0.05
    wide = Gaussian(peak=0.5 / (2.0 * math.pi * sigma**2), sigma=sigma)
    rng = np.random.default_rng(8)
    inside = drawn = 0
    for k in range(40):
        tilt, turn = rng.uniform(-0.375, 0.375), rng.uniform(-1.25, 1.25)
        a, b = math.radians(60.0 + tilt), math.radians(turn)
        incident = [-math.sin(a) * math.cos(b), -math.sin(b), math.cos(a) * math.cos(b)]
        rays = wide.sample(incident, 20_000, seed=k)
        gone = rays[~np.isnan(rays[:, 0])]
        along = np.degrees(np.arctan2(gone[:, 0], gone[:, 2])) - 60.0
        across = np.degrees(np.arcsin(gone[:, 1]))
        inside += int(((np.abs(along) < 2.2) & (np.abs(across) < 5.85)).sum())
        drawn += 20_000
    share = inside / drawn
    error = math.sqrt(share * (1.0 - share) / drawn)
    found = specular_gloss(wide, 60) * glass(index=1.567, angle=60) / 100.0
    assert abs(found - share) < 4.0 * error
    assert found < 0.3


def test_haze() -> None:
    sigma = 0.02
    film = Gaussian(peak=0.8 / (2.0 * math.pi * sigma**2), sigma=sigma, way="transmitted")
    beyond = 100.0 * math.exp(-0.5 * (math.sin(math.radians(2.5)) / sigma) ** 2)
    assert transmission_haze(film) == pytest.approx(beyond, rel=1e-4)
    clear = Mixture(parts=[Transmitter(transmittance=0.9), Lambertian(reflectance=0.0, transmittance=0.1)])
    assert transmission_haze(clear) == pytest.approx(10.0 * math.cos(math.radians(2.5)) ** 2, rel=1e-9)
    assert appearance(film).haze == transmission_haze(film)
    assert appearance(Mirror(reflectance=0.9)).haze is None
    with pytest.raises(ArgumentError, match="nothing is"):
        transmission_haze(Mirror(reflectance=0.9))


def test_only_the_angles_of_the_standard() -> None:
    with pytest.raises(ArgumentError, match="20, 60, 85"):
        specular_gloss(Mirror(reflectance=0.9), 45)
