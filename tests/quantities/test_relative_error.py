"""Two figures for how sure a map is: pixels with next to no light do not spoil them."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.quantities.relative_error import RelativeError
from oracles.verdicts import LARGEST_Z


def lamp(level: float, seed: int) -> tuple[et.LuminanceMap, np.ndarray]:
    """Counts of a bright bar in a wide faint glow, seen on a plane whose pixels foreshorten."""
    truth = np.full((40, 60), 0.4)
    truth[12:20, 10:50] = 900.0
    truth[30:34, 5:12] = 120.0
    counts = np.random.default_rng(seed).poisson(truth * level).astype(float)
    screen = et.Screen(60, 40, 60, 40, "xy")
    lmap = et.LuminanceMap(counts / level, np.sqrt(counts) / level, counts, et.Observer(35, 20, 90), screen)
    return lmap, truth * level


def test_figures_are_those_of_the_light_and_not_of_the_glow() -> None:
    """Poisson counts: σ/L = 1/√n; Σ A √n/Σ A n weighted by flux, and 1/√n of the bright pixels."""
    lmap, expected = lamp(1.0, 3)
    found = lmap.relative_error
    assert found is not None
    # Almost all pixels have no more than one count: their median is 100 %.
    lit = lmap.values > 0
    assert np.median(lmap.standard_error[lit] / lmap.values[lit]) == 1.0
    area = np.broadcast_to(lmap.screen.cosine(lmap.observer), expected.shape)
    # E √n of a Poisson variable: √m (1 - 1/(8 m)) for large m, and its sum over k for small ones.
    k = np.arange(30)
    glow = float(np.sum(np.sqrt(k) * np.exp(k * np.log(0.4) - 0.4 - np.cumsum(np.log(np.maximum(k, 1))))))
    root = np.where(expected > 1, np.sqrt(expected) * (1 - 1 / (8 * expected)), glow)
    assert found.flux_weighted == pytest.approx((area * root).sum() / (area * expected).sum(), rel=LARGEST_Z * 2e-3)
    assert found.bright == pytest.approx(1 / np.sqrt(900.0), rel=0.02)


def test_nothing_is_said_of_what_is_not_known() -> None:
    dark = np.zeros((3, 3))
    assert RelativeError.of(dark, dark) is None
    assert RelativeError.of(dark + 1, dark * np.nan) is None
    one = RelativeError.of(np.array([[np.nan, 2.0]]), np.array([[np.nan, 0.5]]))
    assert one is not None
    assert (one.flux_weighted, one.bright) == (0.25, 0.25)
