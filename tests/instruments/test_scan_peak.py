"""Peaks of scans: the largest of many noisy values is larger than the sample's."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import pytest
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.scan_peak import scan_peak
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE
from scipy.stats import chi2

PAPER = et.bsdf.Lambertian(reflectance=0.8)
SEEDS = range(1, 31)


def assert_errors_hold(*, values: list[float], errors: list[float], truth: float) -> None:
    """Squares of deviations from the truth are at most χ²: errors of peaks are on the safe side."""
    squares = float((((np.array(values) - truth) / np.array(errors)) ** 2).sum())
    assert chi2.sf(squares, len(values)) > SIGNIFICANCE, squares / len(values)


@pytest.mark.parametrize("window", [False, True])
def test_the_peak_of_even_light_is_not_that_of_the_luckiest_position(*, window: bool) -> None:
    """A Lambertian sample has f = ρ/π everywhere; positions are further apart than the aperture is wide."""
    bench = et.ScatterGoniometer()
    if window:
        scans = [bench.measure_window(PAPER, 20, 5, 20, 20_000, seed) for seed in SEEDS]
    else:
        scans = [bench.measure(PAPER, 20, 5, 50_000, seed, span=60) for seed in SEEDS]
    peaks = [scan_peak(scan) for scan in scans]
    values, errors = [peak.value for peak in peaks], [peak.error for peak in peaks]
    assert_errors_hold(values=values, errors=errors, truth=0.8 / math.pi)
    # The largest values are beyond doubt too large.
    lifted = np.array([float(scan.bsdf.max()) for scan in scans]) - 0.8 / math.pi
    assert lifted.mean() > LARGEST_Z * lifted.std(ddof=1) / math.sqrt(lifted.size)


def test_a_peak_that_stands_alone_is_the_largest_value() -> None:
    scan = GoniometerScan([-5.0, 0.0, 5.0], [1e-4, 5e-3, 1e-4], [1e-5, 1e-4, 1e-5], solid_angle=1e-3)
    assert scan_peak(scan).value == pytest.approx(5.0, rel=1e-12)
    assert scan_peak(scan).error == pytest.approx(0.1, rel=1e-12)
    bare = GoniometerScan([-5.0, 0.0, 5.0], [1e-4, 5e-3, 1e-4], solid_angle=1e-3)
    assert scan_peak(bare).value == pytest.approx(5.0, rel=1e-12)
    assert math.isnan(scan_peak(bare).error)
