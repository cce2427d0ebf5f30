"""Two distributions compared: closed forms, what each measure sees, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.goniophotometry.comparison import compare_intensities
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid


def test_a_distribution_agrees_with_itself_and_its_multiple() -> None:
    led = lid("none")
    same = compare_intensities(led, led)
    assert (same.ncc, same.ncc_sphere) == pytest.approx((1, 1), abs=1e-15)
    assert (same.nrmse, same.nrmse_thesis, same.nrmse_sphere, same.flux_ratio) == (0, 0, 0, 1)
    twice = compare_intensities(led.scaled(2), led)
    assert twice.ncc == pytest.approx(1)
    assert twice.flux_ratio == pytest.approx(2)
    assert twice.nrmse == pytest.approx(np.sqrt((led.values**2).mean()) / led.maximum)
    assert twice.nrmse_thesis == pytest.approx(led.values.mean() / (2 * led.maximum))


def test_the_measures_by_their_formulas_on_different_grids() -> None:
    test, reference = lid("none", c=(0, 90, 200), gamma=(0, 40, 180)), lid("both", c=(0, 30, 180), gamma=(0, 90, 180))
    c, gamma = np.array([0, 30, 90, 180, 200.0])[:, None], np.array([0, 40, 90, 180.0])
    a, b = test.at(c, gamma), reference.at(c, gamma)
    found = compare_intensities(test, reference)
    assert found.nodes == 20
    assert found.ncc == pytest.approx(np.corrcoef(a.ravel(), b.ravel())[0, 1])
    assert found.nrmse_thesis == pytest.approx(np.abs(a - b).mean() / max(a.max(), b.max()))
    assert found.nrmse == pytest.approx(np.sqrt(((a - b) ** 2).mean()) / b.max())


def test_the_sphere_does_not_see_how_the_table_is_cut() -> None:
    """Many nodes about the pole, where both agree, improve the mean over nodes and not that over directions."""
    a, b = Intensity([0], [0, 60, 90, 180], [[5, 5, 1, 0]]), Intensity([0], [0, 60, 90, 180], [[5, 5, 3, 0]])
    crowded = [0, *np.linspace(0.5, 59.5, 400), 60, 90, 180]
    fine = [Intensity([0], crowded, led.at(0, [crowded])) for led in (a, b)]
    coarse, crowd = compare_intensities(a, b), compare_intensities(*fine)
    assert crowd.nrmse < 0.3 * coarse.nrmse
    assert crowd.nrmse_sphere == pytest.approx(coarse.nrmse_sphere, rel=1e-2)
    # Between the nodes the weights are those of the integral: ∫ hat(γ) sin γ dγ of the node at 90° over 2.
    hat = Intensity([0], [60, 90, 180], [[0, 1, 0]]).flux / (4 * np.pi)
    assert coarse.nrmse_sphere == pytest.approx(2 * np.sqrt(hat) / 5)


def test_undefined_numbers_are_none() -> None:
    dark = Intensity([0], [0, 180], [[0, 0]])
    found = compare_intensities(lid("none"), dark)
    assert math.isnan(found.ncc)
    assert {k for k, v in found.to_dict().items() if v is None} == {
        "ncc",
        "ncc_sphere",
        "nrmse",
        "nrmse_sphere",
        "flux_ratio",
    }
    assert "NCC" in found.summary()
    with pytest.raises(ArgumentError, match="W/sr"):
        compare_intensities(dark.replace(flux_unit="W"), dark)
