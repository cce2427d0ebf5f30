"""Models against closed forms and quadratures through Python, and light through scenes of each both ways."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, SceneError
from etendue.scatter.models import MODELS
from oracles.both_ways import forwards_and_backwards_agree, two_walls

REFLECTING: dict[str, dict[str, Any]] = {
    "abg": {"a": 0.1, "b": 0.1, "g": 1.5},
    "gaussian": {"peak": 1.5, "sigma": 0.4, "aspect": 0.5, "axis": [0.3, 1, 0.2]},
    "harvey-shack": {"b0": 0.8, "l": 0.3, "s": -2.5, "beyond": "renormalised"},
    "cosine-power": {"peak": 0.8, "exponent": 4},
    "rough-coat": {"roughness": 0.4, "index": 1.5, "base_reflectance": 0.8},
    "rough-metal": {
        "roughness": 0.2,
        "roughness_across": 0.5,
        "axis": [0.3, 1, 0.2],
        "index": 0.96,
        "extinction": 6.69,
    },
    "mixture": {
        "parts": [{"kind": "lambertian", "reflectance": 0.3}, {"kind": "gaussian", "peak": 1.0, "sigma": 0.3}],
    },
}
"""A finish of each kind that scatters back, and mirrors nothing: mirror images are in no light image."""

NARROW: dict[str, dict[str, int]] = {
    "gaussian": {"rays": 500_000, "lines": 9000},
    "cosine-power": {"rays": 400_000, "lines": 8000},
}
"""How many rays and lines of sight it takes where hardly any light reaches some pixels."""

TRANSMITTING: dict[str, dict[str, Any]] = {
    "gaussian": {"peak": 1.0, "sigma": 0.3, "way": "transmitted"},
    "cosine-power": {"peak": 0.3, "exponent": 2, "about": "normal", "way": "transmitted"},
    "lambertian": {"reflectance": 0.2, "transmittance": 0.6},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", REFLECTING)
def test_reflected_light_forwards_and_backwards_is_the_same(kind: str) -> None:
    forwards_and_backwards_agree(surfaces=two_walls({"kind": kind, **REFLECTING[kind]}), **NARROW.get(kind, {}))


@pytest.mark.slow
@pytest.mark.parametrize("kind", TRANSMITTING)
def test_transmitted_light_forwards_and_backwards_is_the_same(kind: str) -> None:
    sheet = {"shape": {"kind": "rectangle", "width": 30, "height": 30}, "finish": {"kind": kind, **TRANSMITTING[kind]}}
    forwards_and_backwards_agree(surfaces=[sheet], below=True)


@pytest.mark.slow
def test_light_through_ground_glass_forwards_and_backwards_is_the_same() -> None:
    """Radiance grows by n² and falls again, each face scatters, and light is led along the slab."""
    slab = {"shape": {"kind": "block", "width": 30, "height": 30, "depth": 4}, "medium": "glass", "at": [0, 0, -2],
            "finish": {"kind": "rough-interface", "roughness": 0.4}}  # fmt: skip
    glass = {"glass": {"index": 1.5}}
    forwards_and_backwards_agree(solids=[slab], media=glass, below=True, sharp=0.25, rays=150_000, lines=10_000)


def test_every_model_that_scatters_into_lobes_is_traced_both_ways() -> None:
    plain = {"coated", "interface", "mirror", "absorber", "lambertian", "diffuse-specular", "transmitter", "mixed"}
    assert {*REFLECTING, "rough-interface", *plain} == set(MODELS)


def test_reflectance_of_metals_is_the_closed_form() -> None:
    """|(n − 1 + ik)/(n + 1 + ik)|² at normal incidence; of aluminium, 555 nm: 0.92."""
    n, k = 0.96, 6.69
    expected = ((n - 1.0) ** 2 + k * k) / ((n + 1.0) ** 2 + k * k)
    smooth = et.bsdf.RoughMetal(roughness=0.001, index=n, extinction=k)
    assert float(smooth.reflectance(0)) == pytest.approx(expected, abs=2e-4)
    # Of a dielectric (k = 0): Fresnel's equations at Brewster's angle, ½ ((n² − 1)/(n² + 1))².
    glass = et.bsdf.RoughMetal(roughness=0.001, index=1.5, extinction=0.0)
    assert float(glass.reflectance(math.degrees(math.atan(1.5)))) == pytest.approx(0.5 * (1.25 / 3.25) ** 2, abs=2e-3)


@pytest.mark.parametrize("outside", [1.0, 1.33, 1.5186])
def test_a_metal_reflects_by_the_medium_in_front(outside: float) -> None:
    """Fresnel's equations of (n + ik)/n₁ from 0 to 70°, from either side; but for the mean slope of the facets."""
    metal = et.bsdf.RoughMetal(roughness=0.001, index=1.2, extinction=2.0)
    theta = np.array([0.0, 25.0, 50.0, 70.0])
    c, m = np.cos(np.radians(theta)), (1.2 + 2j) / outside
    across = np.sqrt(m * m - 1 + c * c)
    s, p = (c - across) / (c + across), (m * m * c - across) / (m * m * c + across)
    expected = (np.abs(s) ** 2 + np.abs(p) ** 2) / 2
    assert metal.reflectance(theta, media=(outside, 1.0)) == pytest.approx(expected, abs=1e-3)
    assert metal.reflectance(theta, side="back", media=(1.0, outside)) == pytest.approx(expected, abs=1e-3)


def test_brushed_metal_is_wide_across_its_axis() -> None:
    metal = et.bsdf.RoughMetal(roughness=0.05, roughness_across=0.4, reflectance=1.0)
    normal, tilt = [0.0, 0.0, 1.0], math.sin(math.radians(20.0))
    along, across = metal.evaluate(normal, [[tilt, 0, math.cos(math.asin(tilt))], [0, tilt, math.cos(math.asin(tilt))]])
    assert across > 5.0 * along


@pytest.mark.parametrize(
    ("finish", "said"),
    [
        ({"kind": "rough-metal", "roughness": 0.1}, "needs reflectance, or index and extinction"),
        ({"kind": "rough-metal", "roughness": 0.1, "index": 1.0, "extinction": 6, "reflectance": 1}, "not both"),
        ({"kind": "gaussian", "peak": 9.0, "sigma": 0.4}, "more than arrives"),
        ({"kind": "cosine-power", "peak": 1.0, "exponent": 0.5}, "more than arrives"),
        ({"kind": "gaussian", "peak": 0.1, "sigma": 0.1, "axis": [0, 0, 0]}, "'axis' has no direction"),
        (
            {"kind": "mixture", "parts": [{"kind": "gaussian", "peak": 0.1, "sigma": 0.1, "axis": [0, 1, 0]}]},
            "share one axis",
        ),
        ({"kind": "rough-interface", "roughness": 0.0}, "roughness"),
    ],
)
def test_impossible_finishes_are_refused(finish: dict[str, Any], said: str) -> None:
    with pytest.raises((ArgumentError, SceneError), match=said):
        et.trace(
            et.Scene(
                sources=[{"kind": "point", "flux": 1.0, "at": [0, 0, 3]}],
                surfaces=[{"shape": {"kind": "disk", "radius": 1}, "finish": finish}],
            ),
            rays=10,
        )


def test_lobes_of_a_round_and_an_elliptical_gaussian() -> None:
    """2π σ₁ σ₂ peak far from the rim."""
    lobe = et.bsdf.Gaussian(peak=10.0, sigma=0.02, aspect=3.0)
    assert float(lobe.reflectance(30, phi=45)) == pytest.approx(2.0 * math.pi * 0.02 * 0.06 * 10.0, rel=1e-5)
    off = np.array([[0.02, 0.0], [0.0, 0.06]])
    scattered = np.column_stack([off, np.sqrt(1.0 - np.sum(off * off, axis=1))])
    assert np.allclose(lobe.evaluate([0, 0, 1], scattered), 10.0 * math.exp(-0.5), rtol=1e-9)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (lambda b: b.reflectance([30, 95, 100]), "theta is 95°; give angles"),
        (lambda b: b.transmittance(-1), "theta is -1°"),
        (lambda b: b.reflectance(30, wavelength=0.555), "wavelength is 0.555; give a finite number of nm, 10 at least"),
        (lambda b: b.reflectance(30, phi=math.nan), "phi is nan; give finite"),
        (lambda b: b.transmittance(30, phi=[0, math.inf]), "phi is"),
        (lambda b: b.reflectance(30, media=(1, -1.5)), "media is .* above 0"),
        (lambda b: b.regular_reflectance(30, media=(1, math.nan)), "media is"),
        (lambda b: b.regular_transmittance(30, media=(0, 1.5)), "media is"),
        (lambda b: b.evaluate([0, 0, 1], [0, 0, 1], media=(1, math.inf)), "media is"),
        (lambda b: b.pdf([0, 0, 1], [0, 0, 1], media=(1,)), "media is .* two"),
        (lambda b: b.evaluate([0, 0, 1], [0, 0, 1], wavelength=math.nan), "wavelength is nan"),
        (lambda b: b.sample([0, 0, 1], 2, wavelength=-555.0), "wavelength is -555"),
        (lambda b: b.sample([0, 0, 1], 2, seed=-1), "seed is -1; give a whole number"),
        (lambda b: b.sample([0, 0, 1], 2, seed=2**64), "seed is"),
        (lambda b: b.sample([0, 0, 1], 1.5), "n is 1.5; give a whole number"),
        (lambda b: b.sample([0, 0, 1], -1), "n is -1"),
    ],
)
def test_numbers_that_mean_nothing_are_refused_by_name(asked: Callable[[et.Bsdf], Any], told: str) -> None:
    for bsdf in (et.bsdf.Interface(), et.bsdf.Gaussian(peak=2.0, sigma=0.15)):
        with pytest.raises(ArgumentError, match=told):
            asked(bsdf)


def test_whole_numbers_of_any_kind_draw_rays() -> None:
    lobe = et.bsdf.Gaussian(peak=2.0, sigma=0.15)
    drawn = [lobe.sample([0, 0, 1], n, seed=seed) for n, seed in ((5, 3), (np.int32(5), np.uint64(3)))]
    assert np.array_equal(*drawn, equal_nan=True)
