"""What each new member gives, against what is known of it. They run where the members were added: see `test_walk`."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import etendue as et
import numpy as np
import pytest


def test_bsdf(tmp_path: Path) -> None:
    """A beam at 60° onto a disk that follows Minnaert's law, with n = 1.5.

    The share ρ cosⁿ60° is reflected; the luminance is E f, and E = E₀ cos 60° in a beam of irradiance E₀ across.
    """
    rho, n, flux, radius = 0.9, 1.5, 100.0, 5.0
    (tmp_path / "scene.toml").write_text(
        f"""
        [[sources]]
        kind = "beam"
        shape = {{ kind = "disk", radius = {radius} }}
        flux = {flux}
        at = [{50 * math.sin(math.pi / 3)}, 0, {50 * math.cos(math.pi / 3)}]
        toward = [{-math.sin(math.pi / 3)}, 0, {-math.cos(math.pi / 3)}]

        [[surfaces]]
        name = "stone"
        shape = {{ kind = "disk", radius = 40 }}
        finish = {{ kind = "minnaert", reflectance = {rho}, exponent = {n} }}
        """,
        encoding="utf-8",
    )
    scene = et.Scene.load(tmp_path / "scene.toml")
    ledger = et.trace(scene, rays=400_000, seed=1).ledger
    share = rho * 0.5**n
    spread = math.sqrt(share * (1 - share) / 400_000)
    assert abs(ledger.escaped.flux / flux - share) < 4 * spread
    observers = [et.Observer(theta, 90, 500) for theta in (0, 60)]
    maps = et.luminance_map(scene, observers, et.Screen(2, 2, 2, 2), rays_per_pixel=256, forward_rays=1e6, seed=2)
    illuminance = flux / (math.pi * radius**2) * 1e6 * 0.5
    for seen, cosine in zip(maps, (1.0, 0.5), strict=True):
        expected = illuminance * rho * (n + 2) / (2 * math.pi) * (0.5 * cosine) ** n
        error = math.hypot(*seen.standard_error.ravel()) / seen.values.size
        assert 0 < error < 0.05 * expected
        assert abs(seen.values.mean() - expected) < 4 * error


def test_detector() -> None:
    """Of a point's light a disk sees Φ/2 (1 − cos α); a sphere around it sees all of it."""
    half = math.atan(10 / 20)
    result = et.trace(
        et.Scene(
            sources=[{"kind": "point", "flux": 80}],
            detectors=[
                {"name": "disk", "kind": "flux", "shape": {"kind": "disk", "radius": 10}, "at": [0, 0, 20]},
                {"name": "all", "kind": "flux", "shape": {"kind": "sphere", "radius": 30}},
            ],
        ),
        rays=200_000,
        seed=3,
    )
    seen = result.quantity_of("disk")
    assert seen.standard_error > 0
    assert abs(seen.value - 40 * (1 - math.cos(half))) < 4 * seen.standard_error
    assert result.quantity_of("all").value == pytest.approx(80, rel=1e-9)
    assert result.to_dict()["detectors"][0]["flux"] == seen.value


def test_source() -> None:
    """From the side a Lambertian cylinder is as bright everywhere: L = Φ/(π · π d l)."""
    tube = {"kind": "tube", "diameter": 20, "length": 60, "flux": 500, "at": [0, 0, -30]}
    observer, screen = et.Observer(90, 20, 1000), et.Screen(8, 8, 3, 3)
    seen = et.luminance_map(et.Scene(sources=[tube]), observer, screen, rays_per_pixel=16)
    assert np.allclose(seen.values, 500 / (math.pi**2 * 20 * 60) * 1e6, rtol=1e-6)


def test_ray_format(tmp_path: Path) -> None:
    """By its content whatever it is called, and by its extension on the command line."""
    rays = et.RingSource(rays=500, seed=4).ray_set()
    et.write_rays(tmp_path / "led.dat", rays, "plain-text")
    run("convert", tmp_path / "led.dat", tmp_path / "led.rays")
    for file in ("led.dat", "led.rays"):
        back = et.read_rays(tmp_path / file)
        assert back.provenance.format == "plain-text"
        assert back.flux_unit == "lm"
        for name in ("position", "direction", "flux"):
            assert np.allclose(getattr(back, name), getattr(rays, name), rtol=1e-14, atol=1e-15)


def test_verb(tmp_path: Path) -> None:
    """The pixel that was made the brightest."""
    values = np.arange(12.0).reshape(3, 4)
    values[1, 2] = 99.0
    lmap = et.LuminanceMap(values, values, np.ones((3, 4), np.int64), et.Observer(0, 0, 100), et.Screen(8, 6, 4, 3))
    lmap.save(tmp_path / "map.npz")
    found = json.loads(run("peak", tmp_path / "map.npz", "--json"))
    assert (found["value"], found["x"], found["y"], found["unit"]) == (99.0, 1.0, 0.0, "cd/m²")


def run(*arguments: object) -> str:
    program = [sys.executable, "-c", "from etendue.cli import main; main()", *map(str, arguments)]
    return subprocess.run(program, check=True, capture_output=True, text=True).stdout
