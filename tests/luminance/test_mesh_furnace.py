"""Clear bodies of triangles with interpolated normals in even light: they cannot be seen, and lose nothing."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import pytest
from oracles.meshes import ROUND_BODIES, smooth_mesh
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE
from scipy.stats import chi2


def furnace(body: str, times: int, radius: float) -> dict[str, Any]:
    """A body of index 1.5 in a surround of luminance 1e6 cd/m²."""
    sky = {"kind": "surface", "shape": {"kind": "sphere", "radius": radius}, "side": "back",
           "flux": 4 * (math.pi * radius) ** 2}  # fmt: skip
    return {"sources": [sky], "solids": [{"shape": smooth_mesh(body, times), "medium": {"index": 1.5}}]}


@pytest.mark.slow
@pytest.mark.parametrize("body", ROUND_BODIES)
@pytest.mark.parametrize("times", [1, 4])
@pytest.mark.parametrize("view", [(20, 30), (88, 200)])
def test_every_pixel_of_a_smooth_mesh_shows_the_furnace(body: str, times: int, view: tuple[float, float]) -> None:
    """L ≡ 1 outside, so 1 in every pixel, rims seen at a grazing angle among them: without noise but for branches that are
    drawn by chance, which have errors."""
    observer, screen = et.Observer(*view, 60), et.Screen(21, 21, 24, 24)
    lmap = et.luminance_map(et.Scene(**furnace(body, times, 100.0)), observer, screen, rays_per_pixel=32, seed=1)
    off, error = lmap.values / 1e6 - 1, lmap.standard_error / 1e6
    drawn = error > 1e-12
    assert np.abs(off[~drawn]).max() < 1e-9
    if drawn.any():
        z = off[drawn] / error[drawn]
        assert np.abs(z).max() < LARGEST_Z
        assert chi2.sf((z**2).sum(), z.size) > SIGNIFICANCE


@pytest.mark.slow
@pytest.mark.parametrize("body", ROUND_BODIES)
@pytest.mark.parametrize("times", [1, 3])
def test_a_clear_smooth_mesh_loses_no_light(body: str, times: int) -> None:
    """Forwards all of it gets out again, even what is totally reflected more than a thousand times."""
    scene = et.Scene(**furnace(body, times, 15.0))
    ledger = et.trace(scene, rays=2e5, seed=1).ledger
    assert ledger.terminated.rays == 0
    assert not ledger.lost
    assert ledger.escaped.flux == pytest.approx(4 * (math.pi * 15) ** 2, rel=1e-12)


@pytest.mark.slow
def test_interpolated_normals_move_light_at_the_rim_and_less_with_finer_meshes() -> None:
    """In an even surround all lines are alike, with a ball or without: their squared distances from its middle are evenly
    spread. What interpolated normals do to étendue, and corners to the outline, is of second order in the size of the
    triangles: with half the size about a fourth is left of the light on the wrong side of the rim.
    """
    astray = []
    for times in (2, 3):
        scene = furnace("ball", times, 11.0)
        scene["detectors"] = [{"name": "out", "kind": "rays", "shape": {"kind": "sphere", "radius": 11.01}}]
        rays = et.trace(et.Scene(**scene), rays=5e5, seed=3).rays["out"]
        squares = (np.cross(rays.position, rays.direction) ** 2).sum(axis=1)
        even = len(rays) / 20
        excess = np.histogram(squares, bins=20, range=(0, 121))[0] - even
        # Of 20 rings those around the ball's rim, 100/121 · 20 = 16.5; nothing is amiss in the others.
        inner = excess[:13] / math.sqrt(even)
        assert chi2.sf((inner**2).sum(), inner.size) > SIGNIFICANCE
        astray.append(np.abs(excess[13:18]).sum() / math.sqrt(5 * even))
    assert astray[0] > 5 * LARGEST_Z
    assert astray[1] < astray[0] / 3
