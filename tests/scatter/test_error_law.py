"""Fits to counts: what weights made of the counts themselves would do to them."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.scatter.error_law import error_law
from etendue.scatter.model_fit import fit_bsdf
from etendue.scatter.scans.scans import Scans

SETS = 40


def counted(*, bsdf: et.Bsdf, each: float, seed: int) -> Scans:
    """A scan in the plane of incidence of Poisson counts of this mean, with the square roots of the counts as errors."""
    theta = np.arange(-80.0, 81.0, 2.0)
    to = direction(np.abs(theta), np.where(theta < 0.0, 180.0, 0.0))
    incident = np.tile(light_from(30.0, 180.0), (theta.size, 1))
    per = bsdf.evaluate(incident, to) * to[:, 2]
    per_count = per.mean() / each
    counts = np.random.default_rng(seed).poisson(per / per_count)
    scale = per_count / to[:, 2]
    return Scans(incident, to, counts * scale, np.sqrt(np.maximum(counts, 1)) * scale)


@pytest.mark.parametrize("each", [10.0, 30.0])
def test_counts_are_not_taken_for_less_light(each: float) -> None:
    """The mean reflectance of forty sets of counts, within 3.3 standard errors (1 in 1000); once 12 % low at 10."""
    half = et.bsdf.Lambertian(reflectance=0.5)
    found = [fit_bsdf(counted(bsdf=half, each=each, seed=seed), "lambertian") for seed in range(SETS)]
    values = np.array([one.parameters["reflectance"] for one in found])
    error = 0.5 / np.sqrt(each * 81.0 * SETS)
    assert abs(values.mean() - 0.5) < 3.3 * error
    # And each states its own spread: of a variance of 40 values to 22 %, three of which are enough.
    stated = np.mean([one.standard_errors["reflectance"] for one in found])
    assert values.std(ddof=1) == pytest.approx(stated, rel=0.4)


@pytest.mark.slow
def test_a_lobe_of_counts() -> None:
    """Peak and width of a Gaussian lobe, means of forty fits within 3.3 of their standard errors."""
    lobe = et.bsdf.Gaussian(peak=1.0, sigma=0.3)
    found = [fit_bsdf(counted(bsdf=lobe, each=30.0, seed=seed), "gaussian").parameters for seed in range(SETS)]
    for name, true in (("peak", 1.0), ("sigma", 0.3)):
        values = np.array([one[name] for one in found])
        assert abs(values.mean() - true) < 3.3 * values.std(ddof=1) / np.sqrt(SETS)


def test_errors_that_do_not_depend_on_values_stay() -> None:
    """Even errors, and those without a law, give none; relative ones give 2."""
    rng = np.random.default_rng(4)
    values, ones, scan = rng.uniform(0.1, 3.0, 50), np.ones(50), np.zeros(50, np.intp)
    assert error_law(values, np.full(50, 0.1), ones, scan) is None
    assert error_law(values, rng.uniform(0.01, 1.0, 50), ones, scan) is None
    law = error_law(values, 0.1 * values, ones, scan)
    assert law is not None
    assert law.exponent == pytest.approx(2.0)
    np.testing.assert_allclose(law.at(np.full(50, 2.0)), 0.2, rtol=1e-9)
