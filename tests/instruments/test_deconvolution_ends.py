"""Scans that end on the lobe: what is found inside holds, and what is beyond is told."""

from __future__ import annotations

import dataclasses

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.instruments.operators import middle_of
from oracles.verdicts import SIGNIFICANCE
from scipy.stats import chi2

Array = npt.NDArray[np.float64]

GONIOMETER = et.ScatterGoniometer(photons=1e6)
SIGNATURE = GONIOMETER.instrument_function()
LOBES = {
    "gaussian": et.bsdf.Gaussian(peak=318.0, sigma=0.02, way="transmitted"),
    "cosine": et.bsdf.CosinePower(peak=300.0, exponent=2000.0, way="transmitted"),
    "abg": et.bsdf.ABg(a=0.02, b=2e-4, g=2.2, way="transmitted"),
}


def cut(*, scan: et.GoniometerScan, low: float, high: float) -> et.GoniometerScan:
    """The positions between two angles, as if no others had been measured."""
    kept = (scan.angle > low - 1e-9) & (scan.angle < high + 1e-9)
    assert scan.standard_error is not None
    error = scan.standard_error[kept]
    return dataclasses.replace(scan, angle=scan.angle[kept], flux=scan.flux[kept], standard_error=error)


def truth(*, lobe: et.bsdf.Bsdf, angle: Array) -> Array:
    """f at the positions of a scan at normal incidence."""
    at = np.radians(angle)
    out = np.stack([np.sin(at), 0.0 * at, -np.cos(at)], axis=1)
    return np.asarray(lobe.evaluate(np.broadcast_to([0.0, 0.0, 1.0], out.shape), out))


@pytest.mark.slow
@pytest.mark.parametrize("ends", [(-2.0, 2.0), (-3.0, 3.0), (-5.0, 1.0), (-0.6, 7.0)])
@pytest.mark.parametrize("name", LOBES)
def test_values_are_off_by_what_they_state(name: str, ends: tuple[float, float]) -> None:
    """χ² over twelve scans of f in the middle, and at the end that is nearer to it.

    From one side only, as the bands count the bias of smoothing, and take the nearer end for known by the other side alone.
    """
    lobe = LOBES[name]
    squares, notes = [], set()
    for seed in range(12):
        whole = GONIOMETER.measure(lobe, step=0.2, span=8, method="quadrature", seed=seed)
        scan = cut(scan=whole, low=ends[0], high=ends[1])
        found = et.deconvolve(scan, SIGNATURE, seed=seed)
        assert found.standard_error is not None
        z = (found.values - truth(lobe=lobe, angle=found.angle)) / found.standard_error
        near = 0 if abs(ends[0]) < abs(ends[1]) else -1
        squares.append((z[np.argmin(np.abs(found.angle))] ** 2, z[near] ** 2))
        notes |= {note.partition(",")[0] for note in found.notes}
    middle, end = np.sum(squares, axis=0)
    assert chi2.sf(middle, 12) > SIGNIFICANCE
    assert chi2.sf(end, 12) > SIGNIFICANCE
    assert notes == {"the scan ends on the lobe"}


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({}, "goes on as smoothly as it came"),
        ({"method": "richardson-lucy"}, "off by more than they state"),
        ({"operator": "slice"}, "takes all beyond for dark"),
    ],
)
def test_an_end_on_the_lobe_is_told(how: dict[str, str], told: str) -> None:
    """Whatever was done about it; of a scan that reaches the end of the lobe nothing is said."""
    whole = GONIOMETER.measure(LOBES["gaussian"], step=0.2, span=8, method="quadrature", seed=1)
    scan = cut(scan=whole, low=-2.4, high=2.0)
    found = et.deconvolve(scan, SIGNATURE, replicates=0, **how)  # type: ignore[arg-type]
    assert any(told in note and "ends on the lobe" in note for note in found.notes)
    assert not et.deconvolve(whole, SIGNATURE, replicates=0, **how).notes  # type: ignore[arg-type]


@pytest.mark.parametrize("high", [0.4, 0.7, 1.5, 3.0])
@pytest.mark.parametrize("middle", [-0.13, 0.0, 0.21])
def test_the_middle_of_a_lobe_that_is_cut_off(middle: float, high: float) -> None:
    """Of a lobe without noise, to a fifth of a step, on whichever side it ends."""
    angle = np.arange(-5.0, high + 1e-9, 0.1)
    values = 1.0 / (1.0 + ((angle - middle) / 0.8) ** 2) ** 2
    assert middle_of(angle, values) == pytest.approx(middle, abs=0.02)
    assert middle_of(-angle[::-1], values[::-1]) == pytest.approx(-middle, abs=0.02)
