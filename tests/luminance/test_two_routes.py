"""The same light forwards and backwards: two routes with nothing in common but the geometry; verdicts at 1e-4."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import etendue as et
import numpy as np
import pytest
from oracles.luminaires import corner, lens_and_mirror, pipe_and_prism, reflector_and_cover
from oracles.verdicts import LARGEST_Z, assert_agree, assert_differ

SCENES: list[Callable[[], dict[str, Any]]] = [corner, lens_and_mirror, reflector_and_cover]


@pytest.mark.slow
@pytest.mark.parametrize("scene_of", SCENES)
def test_light_image_and_lines_of_sight_show_the_same(scene_of: Callable[[], dict[str, Any]]) -> None:
    """χ² over the pixels: the light image of a trace, every scatter connected to the eye, and the map by lines of sight."""
    scene = et.Scene(**scene_of())
    forward = et.trace(scene, 4e5, 3).images["image"]
    (reverse,) = et.luminance_map(scene, rays_per_pixel=4096, seed=5)
    assert reverse.observer == forward.observer
    error = np.hypot(forward.standard_error, reverse.standard_error)
    assert np.median(error / reverse.values) < 0.04
    assert_agree(values=forward.values, expected=reverse.values, standard_error=error)
    # All pixels together show an error of a few per cent that no single one would.
    total = math.sqrt((error**2).sum())
    assert total < 0.01 * reverse.values.sum()
    assert abs((forward.values - reverse.values).sum()) < LARGEST_Z * total
    for other in (reverse.values[::-1], reverse.values[:, ::-1], reverse.values[::-1, ::-1]):
        assert_differ(values=forward.values, other=other, standard_error=error)


@pytest.mark.slow
def test_collected_rays_and_lines_of_sight_show_the_same() -> None:
    """χ² over the pixels: cones of rays that a plane has collected, and lines of sight in directions drawn in the cones.

    A cone's expectation is ∫∫ L cos θ dΩ dA/G over pixel and cone (theory eq. 7), G = ΔA cos θ_p Ω: the mean of
    L cos θ/cos θ_p over directions even in the cone's solid angle.
    """
    scene = et.Scene(**pipe_and_prism())
    acceptance, distance, target = 10.0, 1e7, (0.4, 0.3, 10.0)
    screen = et.Screen(7.2, 4.8, 8, 6, plane="xy")
    eye = et.Observer(24, 200, distance, target=target)
    rays = et.trace(scene, 1.5e6, 7).rays["plane"]
    cone = et.luminance_map(rays, eye, screen, method="cone", acceptance=acceptance)
    rng = np.random.default_rng(8)
    count = 28
    z = rng.uniform(math.cos(math.radians(acceptance)), 1.0, count)
    turn = rng.uniform(0, 2 * np.pi, count)
    right, up, axis = et.Screen(1, 1, 1, 1).axes(eye)
    across = np.sqrt(1 - z * z)
    k = z[:, None] * axis + (across * np.cos(turn))[:, None] * right + (across * np.sin(turn))[:, None] * up
    observers = [
        et.Observer(math.degrees(math.acos(d[2])), math.degrees(math.atan2(d[1], d[0])), distance, target=target)
        for d in k
    ]
    # Maps of one seed draw the same directions in the same pixel: for independent errors each has its own.
    maps = [et.luminance_map(scene, o, screen, rays_per_pixel=64, seed=9 + i) for i, o in enumerate(observers)]
    found = np.array([lmap.values for lmap in maps]) * (k[:, 2] / math.cos(math.radians(24)))[:, None, None]
    mean, error = found.mean(axis=0), found.std(axis=0, ddof=1) / math.sqrt(count)
    both = np.hypot(cone.standard_error, error)
    lit = cone.rays > 100
    assert lit.sum() > 20
    assert np.median(both[lit] / mean[lit]) < 0.07
    assert_agree(values=cone.values[lit], expected=mean[lit], standard_error=both[lit])
    assert abs((cone.values - mean)[lit].sum()) < LARGEST_Z * math.sqrt((both[lit] ** 2).sum())
    for other in (mean[::-1], mean[:, ::-1], mean[::-1, ::-1]):
        assert_differ(values=cone.values[lit], other=other[lit], standard_error=both[lit])
