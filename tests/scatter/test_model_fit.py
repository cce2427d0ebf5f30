"""Models fitted to scans: parameters come back within their errors, and a model that does not fit is seen."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, MissingLibraryError, UnknownNameError
from etendue.quantities.bsdf_directions import direction
from etendue.scatter.model_fit import FITTED_MODELS, fit_bsdf
from oracles.verdicts import SIGNIFICANCE, assert_agree
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

LOBES: dict[str, dict[str, float]] = {
    "gaussian": {"peak": 2.0, "sigma": 0.2},
    "abg": {"a": 0.02, "b": 0.01, "g": 1.8},
    "harvey-shack": {"b0": 2.0, "l": 0.1, "s": -2.5},
}
TRUTHS = {
    "lambertian": {"reflectance": 0.6},
    **LOBES,
    **{f"lambertian+{name}": keys | {"reflectance": 0.3} for name, keys in LOBES.items()},
}
NOISE = 0.03
"""Relative, of the values."""


def bsdf_of(kind: str) -> et.Bsdf:
    """The true one, as the core has it."""
    keys = dict(TRUTHS[kind])
    parts: list[dict[str, Any]] = []
    if "reflectance" in keys:
        parts.append({"kind": "lambertian", "reflectance": keys.pop("reflectance")})
    if keys:
        parts.append({"kind": kind.removeprefix("lambertian+"), **keys})
    return et.bsdf.Mixture(parts=parts)  # type: ignore[arg-type] # as scenes state them


def positions() -> tuple[Array, Array]:
    """Three incidences, one of them out of the plane of the others, scanned unevenly about the specular direction."""
    incident, scattered = [], []
    for theta, phi in ((7.0, 180.0), (33.0, 200.0), (58.0, 180.0)):
        along = theta + np.array([-41.0, -22.0, -9.0, -4.0, -1.5, -0.4, 0.0, 0.7, 2.0, 5.0, 11.0, 24.0])
        to = [direction(along[along < 85.0], phi + 180.0 + turn) for turn in (0.0, 13.0)]
        own = np.concatenate([*to, direction(np.array([10.0, 35.0, 61.0]), phi + 77.0)])
        incident.append(np.tile(direction(theta, phi), (len(own), 1)))
        scattered.append(own)
    return np.concatenate(incident), np.concatenate(scattered)


def noisy(kind: str, *, seed: int, known: bool = True) -> et.Scans:
    i, s = positions()
    f = bsdf_of(kind).evaluate(i, s)
    values = f * (1.0 + NOISE * np.random.default_rng(seed).standard_normal(f.size))
    return et.Scans(i, s, values, standard_error=NOISE * f if known else None)


def assert_parameters_scatter_as_told(kind: str, *, seeds: int, known: bool) -> None:
    """Deviations d of all parameters together: Σ dᵀ C⁻¹ d over independent scans is χ² of as many degrees of freedom.

    Where C comes from the spread of n values about the model, d² is F and not χ²: with 77 degrees of freedom or more it is
    larger by 3 % on average, which the verdict allows for.
    """
    total, values = 0.0, []
    for seed in range(seeds):
        found = fit_bsdf(noisy(kind, seed=seed, known=known), kind)
        assert set(found.parameters) == set(TRUTHS[kind])
        off = np.array([found.parameters[name] - TRUTHS[kind][name] for name in found.parameters])
        total += float(off @ np.linalg.solve(found.covariance, off))
        errors = np.array([*found.standard_errors.values()])
        assert errors == pytest.approx(np.sqrt(np.diag(found.covariance)))
        values.append(found.chi2_per_dof * found.degrees_of_freedom)
    degrees = seeds * len(TRUTHS[kind])
    told = f"{kind}: χ² is {total:.1f} for {degrees} degrees of freedom"
    assert chi2.sf(total / (1.0 if known else 1.03), degrees) > SIGNIFICANCE, told
    assert chi2.cdf(total, degrees) > SIGNIFICANCE, told
    if known:
        freedom = seeds * found.degrees_of_freedom
        assert min(chi2.sf(sum(values), freedom), chi2.cdf(sum(values), freedom)) > SIGNIFICANCE / 2
    else:
        assert np.isnan(values).all()


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("kind", FITTED_MODELS)
def test_all_models_come_back(kind: str, known: bool) -> None:
    # At least 16 deviations. Parameters that are off by 5 % are so by more than two errors in each fit.
    assert_parameters_scatter_as_told(kind, seeds=16 if kind == "lambertian" else 8, known=known)


def test_errors_are_those_of_a_weighted_mean() -> None:
    """A Lambertian surface: its reflectance is π Σ(y/σ²)/Σ(1/σ²), with the variance π²/Σ(1/σ²)."""
    i, s = positions()
    rng = np.random.default_rng(2)
    error = rng.uniform(0.002, 0.02, len(i))
    values = 0.15 + error * rng.standard_normal(len(i))
    found = fit_bsdf(et.Scans(i, s, values, standard_error=error), "lambertian")
    weight = error**-2
    assert found.parameters["reflectance"] == pytest.approx(math.pi * (weight @ values) / weight.sum(), rel=1e-9)
    assert found.standard_errors["reflectance"] == pytest.approx(math.pi / math.sqrt(weight.sum()), rel=1e-6)
    # Of relative residuals without errors: the mean, whose error is the spread over √n.
    plain = fit_bsdf(et.Scans(i, s, values), "lambertian")
    assert plain.parameters["reflectance"] == pytest.approx(math.pi * values.mean(), rel=1e-6)
    spread = math.pi * values.std(ddof=1) / math.sqrt(len(values))
    assert plain.standard_errors["reflectance"] == pytest.approx(spread, rel=1e-4)
    assert plain.rms_residual == pytest.approx(values.std() / values.mean(), rel=1e-4)


@pytest.mark.parametrize("kind", LOBES)
def test_shares_are_those_of_the_core(kind: str) -> None:
    """Rings about the specular direction within the unit circle, against the quadrature of the core."""
    found = fit_bsdf(noisy(f"lambertian+{kind}", seed=4), f"lambertian+{kind}")
    assert found.shares == pytest.approx(found.model.reflectance(found.thetas), abs=2e-6)
    assert (found.share_errors > 0.0).all()
    assert (found.share_errors < NOISE * found.shares).all()


@pytest.mark.slow
def test_errors_of_shares_hold() -> None:
    """Over seeds the share at one angle misses the true one as its error says."""
    truth = bsdf_of("lambertian+abg").reflectance(33.0)
    fits = [fit_bsdf(noisy("lambertian+abg", seed=seed), "lambertian+abg") for seed in range(16)]
    values, errors = (np.array([getattr(one, name)[1] for one in fits]) for name in ("shares", "share_errors"))
    assert_agree(values=values, expected=float(truth), standard_error=errors)


def test_a_model_that_does_not_fit_is_seen() -> None:
    """χ² far above its degrees of freedom, a large residual and a note, for the wrong model alone."""
    right, wrong = (fit_bsdf(noisy("lambertian+abg", seed=5), kind) for kind in ("lambertian+abg", "gaussian"))
    assert right.chi2_per_dof < 1.6
    assert not right.notes
    assert wrong.chi2_per_dof > 50.0
    assert wrong.rms_residual > 10.0 * right.rms_residual
    assert "gaussian does not describe these scans" in " ".join(wrong.notes)


def test_a_floor_below_0_is_left_out() -> None:
    """Scans of which every value is less than a lobe has it by the same amount, but no less than 0."""
    i, s = positions()
    f = bsdf_of("gaussian").evaluate(i, s)
    found = fit_bsdf(
        et.Scans(i, s, np.maximum(f - 0.02, 0.0), standard_error=np.full(f.size, 0.01)), "lambertian+gaussian"
    )
    assert found.kind == "gaussian"
    assert "reflectance" not in found.parameters
    assert "floor came out below 0, at -0.0" in found.notes[0]


def test_what_cannot_be_fitted_is_told() -> None:
    scans = noisy("lambertian", seed=1)
    with pytest.raises(UnknownNameError, match="Did you mean 'lambertian\\+gaussian'"):
        fit_bsdf(scans, "lambertian+gausian")
    with pytest.raises(ArgumentError, match="do not determine b"):
        fit_bsdf(scans, "abg")
    with pytest.raises(ArgumentError, match="2 values do not determine 2 parameters"):
        fit_bsdf(et.Scans(scans.incident[:2], scans.scattered[:2], scans.values[:2]), "gaussian")
    with pytest.raises(ArgumentError, match="no value of the scans is above 0"):
        fit_bsdf(et.Scans(scans.incident, scans.scattered, 0.0 * scans.values), "lambertian")
    errors = np.where(np.arange(scans.values.size) == 3, 0.0, 0.01)
    with pytest.raises(ArgumentError, match=r"standard_error\[3\] is 0"):
        fit_bsdf(et.Scans(scans.incident, scans.scattered, scans.values, standard_error=errors), "lambertian")
    with pytest.raises(ArgumentError, match="leave the reflectance out"):
        fit_bsdf(et.Scans(scans.incident, scans.scattered, scans.values, reflectance=0.6), "lambertian")
    with pytest.raises(ArgumentError, match=r"reflectance = 1\.19\d* ± 0\.0\d+\) reflects more light than arrives"):
        fit_bsdf(et.Scans(scans.incident, scans.scattered, 2.0 * scans.values), "lambertian")


def test_without_scipy_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> Any:
        raise MissingLibraryError("scipy", "fits", "scans")

    monkeypatch.setattr("etendue.scatter.model_fit.scipy_part", missing)
    with pytest.raises(MissingLibraryError, match=r"etendue\[scans\]"):
        fit_bsdf(noisy("lambertian", seed=1), "lambertian")


def test_a_fit_goes_into_a_file_and_a_scene(tmp_path: Path) -> None:
    """The file holds the model itself, with the errors of its parameters; a scene takes it."""
    found = fit_bsdf(noisy("lambertian+harvey-shack", seed=6), "lambertian+harvey-shack")
    assert et.write_bsdf(tmp_path / "paint.h5", found.table) == ()
    read = et.read_bsdf(tmp_path / "paint.h5")
    (component,) = read.data.components
    assert json.loads(json.dumps(component)) == json.loads(json.dumps(found.model.to_dict()))
    assert "±" in read.data.facts["l"]
    i, s = positions()
    assert read.evaluate(i, s) == pytest.approx(found.model.evaluate(i, s), rel=1e-12)
    wall = {"shape": {"kind": "disk", "radius": 10}, "finish": {"kind": "bsdf", "file": str(tmp_path / "paint.h5")}}
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 1, "at": [0, 0, 5], "toward": [0, 0, -1]}
    traced = et.trace(et.Scene(sources=[lamp], surfaces=[wall]), rays=2000, seed=1)
    assert traced.ledger.absorbed.flux > 0.0
