"""Materials by name: what their sources say of them, and scenes that name them."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import pytest
from etendue.scatter.appearance import specular_gloss, transmission_haze
from etendue.scatter.materials import MATERIALS
from etendue.scene.finishes import BUILT_IN


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "reflectance"),
    [
        ("matt-white-paint", 0.85),
        ("gloss-white-paint", 0.83),
        ("anodised-aluminium", 0.81),
        ("brushed-aluminium", 0.915),
        ("opal-pmma", 0.38),
        ("microcellular-pet", 0.984),
    ],
)
def test_reflectance_at_8_degrees(name: str, reflectance: float) -> None:
    assert float(MATERIALS[name].finish.reflectance(8)) == pytest.approx(reflectance, abs=0.006)


def test_gloss_is_that_of_gloss_and_matt_paint() -> None:
    assert specular_gloss(MATERIALS["gloss-white-paint"].finish, 60) > 85.0
    assert specular_gloss(MATERIALS["matt-white-paint"].finish, 60) < 5.0


@pytest.mark.parametrize("width", [0.5, 5.0, 20.0, 40.0])
def test_holographic_diffusers_fall_to_half_at_half_their_width(width: float) -> None:
    finish = MATERIALS[f"holographic-diffuser-{width:g}"].finish
    half = math.radians(width / 2.0)
    straight, off = finish.evaluate([0, 0, 1], np.array([[0, 0, -1.0], [math.sin(half), 0, -math.cos(half)]]))
    assert off / straight == pytest.approx(0.5, rel=1e-9)
    assert float(finish.transmittance(0)) == pytest.approx(0.9, abs=1e-5)


def test_haze_rises_with_the_width_of_a_diffuser() -> None:
    haze = [transmission_haze(MATERIALS[f"holographic-diffuser-{width}"].finish) for width in ("0.5", "5", "20")]
    assert haze == sorted(haze)
    assert haze[0] < 1.0
    # Of a Gaussian all but 1 − exp(−r²/2σ²) lies beyond r.
    sigma = math.sin(math.radians(10.0)) / math.sqrt(2.0 * math.log(2.0))
    assert haze[2] == pytest.approx(100.0 * math.exp(-0.5 * (math.sin(math.radians(2.5)) / sigma) ** 2), abs=1.0)


def test_scenes_name_them() -> None:
    assert set(MATERIALS) <= set(BUILT_IN)
    disk = {"shape": {"kind": "disk", "radius": 5}, "finish": "opal-pmma"}
    lamp = {"kind": "point", "flux": 1.0, "at": [0, 0, 3]}
    assert et.trace(et.Scene(sources=[lamp], surfaces=[disk]), rays=10_000).ledger.closes
