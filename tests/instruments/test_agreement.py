"""How far lobes of several instruments differ: eq. 5.8 in closed form, and that deconvolution brings them together."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.instruments.agreement import variation
from etendue.instruments.goniometer_scan import GoniometerScan


def gaussian(*, height: float, sigma: float, middle: float = 0.0) -> GoniometerScan:
    angle = np.round(np.arange(-6.0, 6.01, 0.1), 10)
    f = height * np.exp(-0.5 * ((angle - middle) / sigma) ** 2)
    return GoniometerScan(angle, f * np.cos(np.radians(angle)), solid_angle=1.0)


def test_coefficients_of_variation_of_gaussians() -> None:
    """Heights 9, 10, 11 on one width: 10 % of peak and of f at every angle, 0 of the width; however they were laid."""
    lobes = [gaussian(height=h, sigma=1.0, middle=m) for h, m in ((9, 0.03), (10, -0.21), (11, 0.4))]
    found = et.agreement(lobes)
    assert found.peak == pytest.approx(10.0, abs=0.02)
    assert found.fwhm == pytest.approx(0.0, abs=0.3)
    assert found.values == pytest.approx(np.full(found.values.size, 10.0), abs=0.5)
    # Down to a hundredth of the peak: 3.03 σ.
    assert found.angle[-1] == pytest.approx(math.sqrt(2 * math.log(100)), abs=0.06)
    assert et.agreement(lobes, floor=0.5).angle[-1] == pytest.approx(math.sqrt(2 * math.log(2)), abs=0.06)


def test_widths() -> None:
    """2 √(2 ln 2) σ of σ = 0.9, 1, 1.1."""
    lobes = [gaussian(height=5.0, sigma=s) for s in (0.9, 1.0, 1.1)]
    found = et.agreement(lobes)
    assert found.fwhm == pytest.approx(10.0, abs=0.1)
    assert found.peak == pytest.approx(0.0, abs=0.1)
    at = np.exp(-0.5 * (found.angle[-1] / np.array([0.9, 1.0, 1.1])) ** 2)
    assert found.values[-1] == pytest.approx(variation(at), rel=0.03)
    assert found.over_angles == pytest.approx(math.sqrt((found.values**2).mean()))


@pytest.mark.slow
def test_deconvolution_brings_instruments_together() -> None:
    """Thesis 6.2, the hope of the round robin: three instruments, S of 0.26° to 1.85°, and a lobe of 1° (counts of 10⁶).

    Measured peaks spread by more than 40 %. Afterwards by no more than noise and stop leave of each lobe: its own standard
    error, twice, since the bands are known to be too narrow (docs/chapter-5.md).
    """
    sigma = math.sin(math.radians(0.5)) / math.sqrt(2 * math.log(2))
    sample = et.bsdf.Gaussian(peak=0.9 / (2 * math.pi * sigma**2), sigma=sigma, way="transmitted")
    scans, found = [], []
    for k, (beam, aperture, distance) in enumerate(((14, 25, 886), (30, 30, 1200), (5, 5, 1000))):
        goniometer = et.ScatterGoniometer(beam, aperture, distance, photons=1e6)
        scan = goniometer.measure(sample, step=0.1, span=4, method="quadrature", seed=20 + k)
        scan = dataclasses.replace(scan, angle=scan.angle + 0.03 * (k - 1))
        scans.append(scan)
        found.append(et.deconvolve(scan, goniometer.instrument_function(seed=30 + k), replicates=16))
    before, after = et.agreement(scans), et.agreement(found)
    assert before.peak > 40.0
    assert before.fwhm > 20.0
    errors = []
    for one in found:
        assert one.standard_error is not None
        errors.append(100 * one.standard_error[np.argmax(one.values)] / one.peak)
    assert after.peak < 2 * float(np.sqrt(np.mean(np.square(errors))))
    assert after.over_angles < 0.2 * before.over_angles


def test_what_is_refused() -> None:
    one = gaussian(height=1.0, sigma=1.0)
    with pytest.raises(ArgumentError, match="two are needed"):
        et.agreement([one])
    with pytest.raises(ArgumentError, match="floor"):
        et.agreement([one, one], floor=1.5)
