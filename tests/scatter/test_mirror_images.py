"""Slices of samples that are their own mirror image: halves are unfolded, and those that are none are told of."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

RADIAL = np.arange(0.0, 91.0, 2.0)


def table(azimuth: np.ndarray, *, turn: float = 0.0, isotropic: bool = True, **more: bool) -> et.BsdfTable:
    """Of f = 0.2 (1 + 0.8 |sin φ|)/π, φ counted from the plane of incidence, which is turned."""
    grid = PolarGrid("normal", RADIAL, azimuth + turn)
    values = np.tile((1 + 0.8 * np.abs(np.sin(np.radians(azimuth))))[:, None] * 0.2 / math.pi, (1, RADIAL.size))
    slices = [BsdfSlice(light_from(theta, 180.0 + turn), values, grid=grid) for theta in (10.0, 40.0, 70.0)]
    return et.BsdfTable(BsdfData(tuple(slices), isotropic=isotropic, **more))


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.0, 35.0])
@pytest.mark.parametrize("first", [0.0, 180.0])
def test_half_a_grid_is_that_of_the_whole_sample(first: float, turn: float) -> None:
    """0.2 (1 + 1.6/π) of the light, and as much at 90° as at 270°; across the gap it had been interpolated."""
    half = table(np.arange(first, first + 181.0, 5.0), turn=turn, isotropic=turn == 0.0)
    aside = direction(50.0, np.array([90.0, 270.0]) + turn)
    light = np.tile(light_from(40.0, 180.0 + turn), (2, 1))
    assert half.reflectance(40.0, phi=180.0 + turn) == pytest.approx(0.2 * (1 + 1.6 / math.pi), rel=2e-3)
    assert half.evaluate(light, aside) == pytest.approx(np.full(2, 1.8 * 0.2 / math.pi), rel=5e-3)
    assert half.complaints == ()


def test_sides_that_differ_are_told_of_if_they_are_made_equal() -> None:
    azimuth = np.arange(0.0, 360.0, 5.0)
    grid = PolarGrid("normal", RADIAL, azimuth)
    values = np.tile((1 + 0.9 * np.sin(np.radians(azimuth)))[:, None] * 0.2 / math.pi, (1, RADIAL.size))
    data = BsdfData((BsdfSlice(light_from(40.0, 180.0), values, grid=grid),))
    (told,) = et.BsdfTable(data).complaints
    # ∫ 0.9 |sin φ| dφ/2π of the light.
    assert "differ by 57% of the light" in str(told)
    assert et.BsdfTable(dataclasses.replace(data, mirrored=False)).complaints == ()


def test_two_slices_of_one_incidence_are_refused() -> None:
    grid = PolarGrid("normal", RADIAL, np.zeros(1))

    def slice_at(phi: float, share: float) -> BsdfSlice:
        return BsdfSlice(light_from(40.0, phi), np.full((1, RADIAL.size), share / math.pi), grid=grid)

    for other in (180.0, 90.0):
        with pytest.raises(ArgumentError, match="two slices of light at 40° of incidence, from azimuths 180°"):
            et.BsdfTable(BsdfData((slice_at(180.0, 0.5), slice_at(other, 0.1))))


@pytest.mark.parametrize("wavelength", [math.nan, -5.0, 0.0, math.inf])
def test_impossible_wavelengths_of_slices(wavelength: float) -> None:
    grid = PolarGrid("normal", RADIAL, np.zeros(1))
    with pytest.raises(ArgumentError, match="wavelength of a slice"):
        BsdfSlice(light_from(40.0, 180.0), np.zeros((1, RADIAL.size)), grid=grid, wavelength=wavelength)


def test_errors_below_zero() -> None:
    grid, zeros = PolarGrid("normal", RADIAL, np.zeros(1)), np.zeros((1, RADIAL.size))
    with pytest.raises(ArgumentError, match="standard errors are not below 0"):
        BsdfSlice(light_from(40.0, 180.0), zeros, grid=grid, standard_error=zeros - 0.1)
