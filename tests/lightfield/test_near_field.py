"""Rays whose lines all pass one point have an intensity distribution and no luminance: no map is made of them."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.selection.search import choose_surface
from etendue.lightfield.selection.settings import SelectionSettings

Array = npt.NDArray[np.float64]
REASON = "pass one point"


def directions(n: int, seed: int) -> Array:
    """Lambertian about +Z, brighter towards +X: no symmetry."""
    rng = np.random.default_rng(seed)
    cosine, turn = np.sqrt(rng.random(2 * n)), 2 * np.pi * rng.random(2 * n)
    sine = np.sqrt(1 - cosine**2)
    k = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=1)
    return k[rng.random(2 * n) < 0.5 + 0.5 * k[:, 0]][:n]


def far_field(start: str, n: int = 4000) -> et.RaySet:
    k = directions(n, 3)
    position = {
        "at the origin": np.zeros_like(k),
        "at a point": np.zeros_like(k) + np.array([120.0, -40.0, 7.0]),
        "on a sphere": 1000.0 * k.astype(np.float32).astype(np.float64),
        "on a sphere about a point": 250.0 * k + np.array([3.0, 1.0, -2.0]),
    }[start]
    return et.RaySet(position.astype(np.float32), k.astype(np.float32), np.full(len(k), 1 / len(k)))


@pytest.mark.parametrize("start", ["at the origin", "at a point", "on a sphere", "on a sphere about a point"])
def test_refused_whatever_the_method(start: str) -> None:
    rays = far_field(start)
    eye, screen = et.Observer(20, 30, 500), et.Screen(5, 5, 8, 8)
    with pytest.raises(ArgumentError, match=REASON):
        et.LightField.fit(rays)
    with pytest.raises(ArgumentError, match=REASON):
        et.LightField.fit(rays, et.Plane(z=4))
    with pytest.raises(ArgumentError, match=REASON):
        et.luminance_map(rays, eye, screen)
    with pytest.raises(ArgumentError, match=REASON):
        et.luminance_map(rays, eye, screen, method="cone")
    with pytest.raises(ArgumentError, match=REASON):
        et.GriddedSource.fit(rays, et.Plane(z=4, width=9, height=9), pixel=1.0, threshold=0.02)
    scene = et.Scene(sources=[{"kind": "rays", "rays": rays}])
    with pytest.raises(ArgumentError, match=REASON):
        et.luminance_map(scene, eye, screen)


@pytest.mark.slow
def test_a_small_source_far_from_the_origin_is_none_of_them() -> None:
    """A die of 20 µm, 3 m off the origin, kept in single precision on a sphere of 10 m: its rays still tell its size."""
    k = directions(4000, 5)
    rng = np.random.default_rng(1)
    die = np.concatenate([0.02 * (rng.random((len(k), 2)) - 0.5), np.zeros((len(k), 1))], axis=1)
    along = 10_000.0 * k + die
    for position in (die + np.array([0.0, 3000.0, 0.0]), along):
        rays = et.RaySet(position, k, np.full(len(k), 1.0))
        # The scorer's folds are none of the question: one of them is enough.
        surface = choose_surface(rays, settings=SelectionSettings(one_fold_from=1, search_one_fold_from=1)).surface
        assert et.LightField.fit(rays, surface, depths=(2, 2, 2, 2)).total_flux == pytest.approx(len(k), rel=0.02)
