"""Errors of pixels from independent passes, where these are known."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from etendue.luminance.passes import Passes
from oracles.verdicts import LARGEST_Z

Array = npt.NDArray[np.float64]
SIDE, PASSES, SHARE = 60, 16, 0.08


def passes(lit: Array) -> Passes:
    """Passes over pixels that find their light, on average 1, in a share of passes only; all see a diffuse surface."""
    found = Passes((SIDE, SIDE), np.ones((SIDE, SIDE)))
    for light in lit:
        nothing = np.zeros_like(light)
        found.add(light, nothing, nothing, nothing, np.ones_like(light), light)
    return found


def test_pixels_that_found_nothing_err_as_their_neighbours() -> None:
    """The variance of a pixel's mean is (1/p − 1)/n; by its own passes a quarter of all would say that it is 0."""
    rng = np.random.default_rng(4)
    lit = (rng.random((PASSES, SIDE, SIDE)) < SHARE) / SHARE
    values, error = passes(lit).total(None)
    dark = values == 0
    share = (1 - SHARE) ** PASSES
    assert abs(dark.mean() - share) < LARGEST_Z * np.sqrt(share * (1 - share) / dark.size)
    known = (1 / SHARE - 1) / PASSES
    # The mean over nine pixels, one of which is dark for sure, times (K + 1)/K with some ten finds: 8/9 · 11/10.
    assert 0.9 * known < (error[dark] ** 2).mean() < 1.1 * known
    z = (values - 1) / error
    assert np.mean(np.abs(z) > 3) < 0.01


def test_the_edge_of_a_lamp_tells_nothing_of_dim_surfaces_beside_it() -> None:
    """The variance of a dim pixel's mean is (1/p − 1)/n, whatever share of its neighbour a lamp 10⁵ times as bright covers.

    Errors of single pixels rest on few finds; their mean square does not.
    """
    rng = np.random.default_rng(6)
    dim = (rng.random((PASSES, SIDE, SIDE)) < 3 * SHARE) / (3 * SHARE)
    direct = np.zeros_like(dim)
    direct[:, :, 7::5] = 1e5 * rng.binomial(1, 0.4, (PASSES, SIDE, len(range(7, SIDE, 5))))
    nothing, everywhere = np.zeros((SIDE, SIDE)), np.ones((SIDE, SIDE))
    found = Passes((SIDE, SIDE), everywhere)
    for scattered, seen in zip(dim, direct, strict=True):
        found.add(scattered + seen, nothing, nothing, nothing, everywhere, scattered)
    _, error = found.total(None)
    lamp = direct.any(axis=0)
    assert lamp.sum() > SIDE
    known = (1 / (3 * SHARE) - 1) / PASSES
    assert 1.0 < (error[~lamp] ** 2).mean() / known < 1.3
    assert np.allclose(error[lamp], (dim + direct).std(axis=0, ddof=1)[lamp] / 4, rtol=1e-3, atol=0)


def test_pixels_that_found_light_in_each_pass_err_by_their_own() -> None:
    """Whatever is beside them, and however few passes there are."""
    rng = np.random.default_rng(5)
    light = rng.gamma(4.0, 0.25, (4, SIDE, SIDE))
    light[:, :, SIDE // 2 :] *= 1e-3
    values, error = passes(light).total(None)
    assert np.allclose(error, light.std(axis=0, ddof=1) / 2, rtol=1e-9, atol=0)
    assert np.allclose(values, light.mean(axis=0), rtol=1e-12, atol=0)


def test_where_no_light_is_found_nothing_is_made_up() -> None:
    values, error = passes(np.zeros((PASSES, SIDE, SIDE))).total(None)
    assert not values.any()
    assert not error.any()
