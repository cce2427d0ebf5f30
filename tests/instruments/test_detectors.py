"""Detectors against the sums that define them; a baffle against lines through both openings."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_directions import direction
from oracles.verdicts import LARGEST_Z, assert_agree, assert_differ

Array = npt.NDArray[np.float64]
CCD = et.Detector(
    1e9, 1e5, read_noise=60.0, dark=40.0, shortest=0.01, longest=20.0, filters=(1.0, 0.03), pause=2.0, stray=3e-8
)


def test_times_fill_the_well() -> None:
    """t = fill · well / ((Φ + Φ₀) rate T + dark), by hand; behind the filter if that is too short, cut at the longest."""
    flux = np.array([2e-2, 1e-3, 1e-6, 1e-9])
    seconds, transmittance = CCD.exposures(flux)
    assert transmittance.tolist() == [0.03, 1.0, 1.0, 1.0]
    expected = [8e4 / (2e7 * 0.03 + 30 * 0.03 + 40), 8e4 / (1e6 + 30 + 40), 20.0, 20.0]
    assert seconds == pytest.approx(expected, rel=1e-9)
    fixed = et.Detector(1e9, 1e5, shortest=0.5, longest=0.5, filters=(0.1, 1.0))
    assert [set(one.tolist()) for one in fixed.exposures(flux)] == [{0.5}, {0.1}]


def test_readings_have_the_mean_and_the_variance_that_are_stated() -> None:
    """Mean Φ + stray light; variance (counts + read noise²)/gain², over 400 readings at each of four fluxes (χ²)."""
    for flux in (5e-3, 1e-4, 1e-6, 1e-8):
        many = np.full(400, flux)
        found = CCD.read(many, seed=11)
        seconds, transmittance = CCD.exposures(many)
        gain = 1e9 * transmittance * seconds
        error = np.sqrt((flux + 3e-8) * gain + 40.0 * seconds + 60.0**2) / gain
        assert_agree(values=found.flux, expected=flux + 3e-8, standard_error=error)
        assert found.standard_error == pytest.approx(error, rel=0.3)
        assert found.seconds == pytest.approx(seconds + 2.0)
        assert found.hours == pytest.approx(float((seconds + 2.0).sum()) / 3600)
        assert not found.saturated.any()
        assert_differ(values=found.flux, other=np.full(400, 0.97 * flux), standard_error=0.1 * error)


def test_a_filter_is_off_by_the_same_at_all_positions() -> None:
    """What its transmittance is not known to: shared by all readings behind it, of a stated spread over scans."""
    off = []
    for seed in range(60):
        one = et.Detector(1e15, 1e12, shortest=1e-3, longest=10.0, filters=(1.0, 0.01), filter_error=0.02)
        found = one.read([0.95, 0.9, 1e-6], seed=seed)
        ratio = found.flux / [0.95, 0.9, 1e-6]
        assert ratio[0] == pytest.approx(ratio[1], abs=2e-5)
        assert ratio[2] == pytest.approx(1.0, abs=2e-4)
        off.append(ratio[0] - 1.0)
    # χ² of 60 normal deviates: their standard deviation is within 4 / √(2·60) of 0.02.
    assert np.std(off) == pytest.approx(0.02, rel=4 / math.sqrt(120))
    assert abs(np.mean(off)) < LARGEST_Z * 0.02 / math.sqrt(60)


def test_too_much_light_is_told() -> None:
    photometer = et.Detector(1e12, 1e9)
    found = photometer.read([1e-3, 0.5])
    assert found.saturated.tolist() == [False, True]
    # The least it can be.
    assert found.flux[1] == pytest.approx(1e9 / 1e11)
    assert photometer.dynamic_range == pytest.approx(1e9)
    assert CCD.dynamic_range == pytest.approx(1e5 / math.sqrt(0.4 + 3600))


def test_the_same_seed_gives_the_same_readings() -> None:
    flux = np.full(5, 1e-4)
    assert np.array_equal(CCD.read(flux, seed=3).flux, CCD.read(flux, seed=3).flux)
    assert not np.array_equal(CCD.read(flux, seed=3).flux, CCD.read(flux, seed=4).flux)


def through(*, opening: float, length: float, aperture: float, height: float, distance: float) -> float:
    """Part of an aperture that sees a point beside its axis: points of it, and where lines pass the opening."""
    rng = np.random.default_rng(5)
    r, a = 0.5 * aperture * np.sqrt(rng.random(200_000)), 2 * math.pi * rng.random(200_000)
    x, y = r * np.cos(a), r * np.sin(a)
    part = length / distance
    return float((np.hypot(x + part * (height - x), y * (1 - part)) <= 0.5 * opening).mean())


def test_what_a_baffle_lets_through() -> None:
    """Points just within the full field are seen by all of the aperture, just beyond it not; beyond the whole by none."""
    baffle = et.Baffle(24.0, 200.0)
    full, whole = baffle.field(25.0, 886.0)
    geometry = {"opening": 24.0, "length": 200.0, "aperture": 25.0, "distance": 886.0}
    assert through(height=0.499 * full, **geometry) == 1.0
    assert through(height=0.55 * full, **geometry) < 1.0
    assert through(height=0.48 * whole, **geometry) > 0.0
    assert through(height=0.501 * whole, **geometry) == 0.0
    assert et.Baffle(5.0, 200.0).field(25.0, 886.0)[0] == 0.0


def test_the_etendue_of_two_disks() -> None:
    """∫∫ cos²/r² dA dA over pairs of points of both, by Monte Carlo; two disks close together see all of the half space."""
    rng = np.random.default_rng(6)
    n = 400_000
    ends = []
    for diameter in (25.0, 40.0):
        r, a = 0.5 * diameter * np.sqrt(rng.random(n)), 2 * math.pi * rng.random(n)
        ends.append(np.column_stack([r * np.cos(a), r * np.sin(a)]))
    square = ((ends[0] - ends[1]) ** 2).sum(axis=1) + 30.0**2
    terms = 30.0**2 / square**2 * (math.pi * 12.5**2) * (math.pi * 20.0**2)
    error = float(terms.std()) / math.sqrt(n)
    assert abs(et.Baffle(40.0, 30.0).etendue(25.0) - terms.mean()) < LARGEST_Z * error
    assert et.Baffle(1e4, 1.0).etendue(25.0) == pytest.approx(math.pi * math.pi * 12.5**2, rel=1e-3)


def test_flux_on_both_sides() -> None:
    """ρ cosθ Ω/π in front of a diffuse sheet and τ cosθ Ω/π behind it, in one call; rays agree (z of each, Bonferroni)."""
    goniometer = et.ScatterGoniometer(14, 60, 500)
    sheet = et.bsdf.Lambertian(reflectance=0.5, transmittance=0.3)
    at = np.concatenate([direction([0, 30, 70], [0, 50, 200]), direction([10, 60], [100, 20], behind=True)])
    exact, _ = goniometer.flux_at(sheet, at, 25.0, method="quadrature")
    share = np.where(at[:, 2] > 0, 0.5, 0.3)
    assert exact == pytest.approx(share * np.abs(at[:, 2]) * goniometer.solid_angle / math.pi, rel=0.01)
    traced, _ = goniometer.flux_at(sheet, at, 25.0, rays=400_000, seed=9)
    assert (np.abs(traced - exact) < (LARGEST_Z + 0.5) * np.sqrt(exact / 4e5)).all()
    for wrong in ([[0.0, 0.0, 2.0]], [0.0, 0.0, 1.0]):
        with pytest.raises(ArgumentError, match="unit vectors"):
            goniometer.flux_at(sheet, wrong)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"rate": 0.0}, "rate"),
        ({"read_noise": -1.0}, "read_noise"),
        ({"shortest": 1.0, "longest": 0.5}, "no shorter"),
        ({"fill": 1.5}, "part of the well"),
        ({"filters": ()}, "transmittances"),
        ({"filters": (2.0,)}, "transmittances"),
    ],
)
def test_what_is_refused(settings: dict[str, object], told: str) -> None:
    with pytest.raises(ArgumentError, match=told):
        et.Detector(**{"rate": 1e9, "full_well": 1e5, "shortest": 0.1, "longest": 0.1} | settings)  # type: ignore[arg-type]


def test_fluxes_and_baffles_that_are_refused() -> None:
    for flux in ([-1e-3], [float("nan")]):
        with pytest.raises(ArgumentError, match="not negative"):
            CCD.read(flux)
    with pytest.raises(ArgumentError, match="seed"):
        CCD.read([1e-3], seed=-1)
    with pytest.raises(ArgumentError, match="more than 0"):
        et.Baffle(0.0, 10.0)
    with pytest.raises(ArgumentError, match="sample is at 100"):
        et.Baffle(10.0, 200.0).field(25.0, 100.0)
