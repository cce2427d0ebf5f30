"""Scans as tables for scenes: the lobe they were taken of, and what is refused."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.instruments.goniometer_scan import GoniometerScan, cubic

Array = npt.NDArray[np.float64]
SIGMA = 0.0045
"""A lobe of 0.6°, in radians."""


def lobe(*, angle: Array) -> Array:
    """A Gaussian in sin θ whose integral of f cosθ over the hemisphere is 0.9, but for exp(-1/(2σ²))."""
    return np.asarray(0.9 / (2 * math.pi * SIGMA**2) * np.exp(-(np.sin(np.radians(angle)) ** 2) / (2 * SIGMA**2)))


def scan(*, middle: float = 0.0, **more: object) -> GoniometerScan:
    """f of the lobe as a scan without blur, in steps of 0.1°: five of them are its width."""
    angle = np.round(np.arange(-3.0, 3.01, 0.1), 10)
    flux = 6.25e-4 * lobe(angle=angle - middle) * np.cos(np.radians(angle))
    return GoniometerScan(angle, flux, solid_angle=6.25e-4, **more)


@pytest.mark.parametrize("middle", [0.0, 0.037])
def test_the_table_is_the_lobe(middle: float) -> None:
    """Wherever the lobe stands in the scan: f by its formula, the share 0.9 by ∫ f cosθ dΩ, and nothing beyond the scan.

    f is right to 1.5 % of its peak, which is what tables keep (docs/scatter.md); the cubic alone is off by 0.15 %.
    """
    one = scan(middle=middle)
    table = et.revolved(one)
    angle = np.linspace(0.0, 1.5, 61)
    t = np.radians(angle)
    for azimuth in (0.0, 1.0, 4.0):
        to = np.column_stack([np.sin(t) * math.cos(azimuth), np.sin(t) * math.sin(azimuth), -np.cos(t)])
        assert table.evaluate([0, 0, 1], to) == pytest.approx(lobe(angle=angle), abs=0.015 * lobe(angle=np.zeros(1))[0])
    assert float(table.transmittance(0)) == pytest.approx(0.9, rel=2e-3)
    beyond = np.array([math.sin(math.radians(3.2)), 0.0, -math.cos(math.radians(3.2))])
    assert table.evaluate([0, 0, 1], beyond) < 1e-6 * table.evaluate([0, 0, 1], [0, 0, -1])
    share = cubic(one.angle, one.bsdf, middle + angle)
    assert share == pytest.approx(lobe(angle=angle), abs=0.003 * lobe(angle=np.zeros(1))[0])
    # The values as they are, linear over steps of the scan, would have 1 % more light.
    r = np.radians(np.arange(0.0, 3.01, 0.1))
    fine = np.linspace(0.0, r[-1], 20_000)
    linear = np.interp(fine, r, lobe(angle=np.degrees(r)))
    assert 2 * math.pi * np.trapezoid(linear * np.sin(fine) * np.cos(fine), fine) > 0.91


def test_values_of_a_deconvolution_take_the_place_of_what_was_measured() -> None:
    """Twice the values are twice the table; both sides are averaged; reflected light goes to the front."""
    one = scan()
    twice = et.revolved(one, 0.5 * one.bsdf, middle=0.0)
    top = float(et.revolved(one).evaluate([0, 0, 1], [0, 0, -1]))
    assert float(twice.evaluate([0, 0, 1], [0, 0, -1])) == pytest.approx(0.5 * top, rel=1e-6)
    tilted = one.bsdf * (1.0 + 0.2 * np.sign(one.angle))
    again = et.revolved(one, tilted, middle=0.0)
    assert again.transmittance(0) == pytest.approx(et.revolved(one).transmittance(0), rel=1e-3)
    mirrored = et.revolved(dataclasses.replace(one, way="reflected"))
    assert float(mirrored.reflectance(0)) == pytest.approx(0.9, rel=2e-3)


def test_what_is_refused() -> None:
    for wrong, told in (
        (dataclasses.replace(scan(), incidence=30.0), "sample at 30°"),
        (dataclasses.replace(scan(), sample=False), "bare beam"),
        (dataclasses.replace(scan(), flux=np.zeros(61)), "some light"),
    ):
        with pytest.raises(ArgumentError, match=told):
            et.revolved(wrong)
    with pytest.raises(ArgumentError, match="3 values for 61"):
        et.revolved(scan(), [1.0, 2.0, 1.0])
    with pytest.raises(ArgumentError, match="outside the scan"):
        et.revolved(scan(), middle=4.0)
