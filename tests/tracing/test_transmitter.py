"""A transmitting finish on a face between media: Snell's law and total reflection, and no reflection of Fresnel's."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import pytest

INDEX = 1.5
RAYS = 20_000


def through_the_top(finish: dict[str, Any] | str, degrees: float) -> et.TraceResult:
    """A beam within a block of glass that meets its top at this angle; all other faces absorb."""
    angle = math.radians(degrees)
    beam: dict[str, Any] = {"kind": "beam", "shape": {"kind": "disk", "radius": 0.1}, "flux": 1, "at": [0, 0, 1]}
    beam["toward"] = [math.sin(angle), 0, math.cos(angle)]
    faces = dict.fromkeys(("bottom", "left", "right", "front", "back"), "absorber")
    block = {
        "name": "block",
        "shape": {"kind": "block", "width": 40, "height": 40, "depth": 2},
        "medium": {"index": INDEX},
    }
    block["finishes"] = {**faces, "top": finish}
    above = {
        "name": "above",
        "kind": "rays",
        "shape": {"kind": "rectangle", "width": 400, "height": 400},
        "at": [0, 0, 5],
    }
    return et.trace(et.Scene(sources=[beam], solids=[block], detectors=[above]), rays=RAYS, seed=1)


@pytest.mark.parametrize("degrees", [0, 30, 41])
def test_light_is_refracted_and_nothing_is_reflected(degrees: float) -> None:
    out = through_the_top("transparent", degrees).rays["above"]
    assert len(out) == RAYS
    assert np.allclose(out.direction[:, 0], INDEX * math.sin(math.radians(degrees)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("degrees", [42, 60])
def test_beyond_the_critical_angle_all_is_mirrored(degrees: float) -> None:
    assert INDEX * math.sin(math.radians(degrees)) > 1
    ledger = through_the_top("transparent", degrees).ledger
    assert ledger.escaped.rays == 0
    assert ledger.absorbed.rays == RAYS


@pytest.mark.parametrize(("degrees", "expected"), [(30, (0.6, 0.3)), (60, (0.0, 0.9))])
def test_the_share_that_would_pass_is_mirrored_then(degrees: float, expected: tuple[float, float]) -> None:
    finish = {"kind": "mixed", "specular_transmittance": 0.6, "specular_reflectance": 0.3}
    result = through_the_top(finish, degrees)
    # Rays that escape, and those that come down again: binomial, to 4 standard deviations (6·10⁻⁵ each).
    bottom = result.ledger.by_surface["block.bottom"].rays
    for rays, share in zip((result.ledger.escaped.rays, bottom), expected, strict=True):
        assert abs(rays - RAYS * share) <= 4 * math.sqrt(RAYS * share * (1 - share))


def test_diffuse_transmission_between_media_is_as_stated_from_both_sides() -> None:
    # A slab in an even surround of luminance 1, its top transmitting all light diffusely. To the top from within comes what
    # enters at the bottom, (1 − F), and of what enters at the top what the bottom mirrors, 1 − (1 − F)/n², F being Fresnel's
    # reflectance of diffuse light; all of it leaves.
    cosine, weights = np.polynomial.legendre.leggauss(200)
    cosine, weights = (1 + cosine) / 2, weights / 2
    within = np.sqrt(1 - (1 - cosine**2) / INDEX**2)
    across = (cosine - INDEX * within) / (cosine + INDEX * within)
    along = (INDEX * cosine - within) / (INDEX * cosine + within)
    enters = 1 - float(np.sum(weights * cosine * (across**2 + along**2)))
    sky: dict[str, Any] = {"kind": "surface", "shape": {"kind": "sphere", "radius": 1e5}, "side": "back"}
    sky["flux"] = 4 * math.pi**2 * 1e10 * 1e-6
    slab: dict[str, Any] = {
        "shape": {"kind": "block", "width": 1000, "height": 1000, "depth": 0.1},
        "medium": {"index": INDEX},
    }
    slab["finishes"] = {"top": {"kind": "lambertian", "reflectance": 0, "transmittance": 1}}
    scene = et.Scene(sources=[sky], solids=[slab])
    how = et.PathTracing(rays_per_pixel=4096, forward_rays=0, gather=False)
    lmap = et.luminance_map(scene, et.Observer(20, 10, 100), et.Screen(5, 5, 2, 2), method=how)
    z = (lmap.values - (enters + 1 - enters / INDEX**2)) / lmap.standard_error
    # Student's t of 15 degrees of freedom: beyond 6.4 in one of 4 pixels by chance in 5·10⁻⁵ of all cases.
    assert np.abs(z).max() < 6.4
