"""What rings cannot undo is told: lobes that are not round in the angle, and apertures that are not round."""

from __future__ import annotations

import re

import etendue as et
import numpy as np
import pytest

WIDTH = 0.012


@pytest.mark.parametrize("plane", ["in-plane", "cross-plane"])
@pytest.mark.parametrize("incidence", [30.0, 60.0])
def test_the_peak_of_a_lobe_that_is_round_in_direction_cosines(plane: str, incidence: float) -> None:
    """The part that the note states is the part that is found, to 0.02; no noise but that of 10⁸ photons."""
    goniometer = et.ScatterGoniometer(photons=1e8)
    peak = 0.8 / (2.0 * np.pi * WIDTH**2)
    lobe = et.bsdf.Gaussian(peak=peak, sigma=WIDTH)
    scan = goniometer.measure(lobe, incidence, step=0.4, span=6, plane=plane, method="quadrature")
    found = et.deconvolve(scan, goniometer.instrument_function(), replicates=0)
    (told,) = [note for note in found.notes if "direction cosines" in note]
    stated = float(re.search(r"about ([\d.]+) of", told)[1])  # type: ignore[index] # it is there
    assert found.peak / peak == pytest.approx(stated, abs=0.02)
    assert abs(stated - 1.0) > 0.03


def test_nothing_is_said_at_normal_incidence() -> None:
    """There all lobes of the model are round either way."""
    goniometer = et.ScatterGoniometer(photons=1e8)
    lobe = et.bsdf.Gaussian(peak=100.0, sigma=WIDTH)
    scan = goniometer.measure(lobe, 0.0, step=0.2, span=6, method="quadrature")
    assert not et.deconvolve(scan, goniometer.instrument_function(), replicates=0).notes


def test_a_square_aperture_is_told() -> None:
    """Its rings are off by more than half."""
    goniometer = et.ScatterGoniometer(photons=1e8, aperture="square")
    lobe = et.bsdf.CosinePower(peak=1500, exponent=18204)
    scan = goniometer.measure(lobe, 0.0, step=0.2, span=6, method="quadrature")
    found = et.deconvolve(scan, goniometer.instrument_function(), replicates=0)
    assert any("aperture is square" in note for note in found.notes)
    assert abs(found.peak / 1500 - 1.0) > 0.5
