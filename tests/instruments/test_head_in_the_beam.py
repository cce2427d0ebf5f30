"""Positions at which the head of the detector would stand in the incident beam: they are not measured."""

from __future__ import annotations

import dataclasses

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from

PAINT = et.bsdf.Lambertian(reflectance=0.5)
BARE = et.ScatterGoniometer(photons=1e8)
HEAD = dataclasses.replace(BARE, head_diameter=80.0)
SHADOW = np.degrees(np.arcsin(0.5 * (80.0 + BARE.beam_diameter) / BARE.distance))


def test_scans_leave_them_out() -> None:
    """Light comes from -20° in the plane: 3.04° on both sides of it; the other values are those without a head."""
    scan = HEAD.measure(PAINT, 20.0, step=1.0, span=60.0, method="quadrature")
    plain = BARE.measure(PAINT, 20.0, step=1.0, span=60.0, method="quadrature")
    gone = np.abs(plain.angle + 20.0) < SHADOW
    assert gone.sum() == 7
    assert np.array_equal(scan.angle, plain.angle[~gone])
    assert any("7 positions are left out" in note for note in scan.notes)
    assert scan.gaps == ((-24.0, -16.0),)
    with pytest.raises(ArgumentError, match="at all positions"):
        HEAD.measure(PAINT, 0.0, step=0.5, span=1.0, method="quadrature")


def test_hemispheres_have_no_value_there() -> None:
    """By the angle to the light of each position; a table of it tells how many are interpolated, and keeps the share."""
    one = HEAD.measure_hemisphere(PAINT, 20.0, step=10.0, method="quadrature")
    apart = np.degrees(np.arccos(np.clip(one.directions @ light_from(20.0, 180.0), -1.0, 1.0)))
    assert np.array_equal(np.isnan(one.values), apart < SHADOW)
    assert np.isnan(one.values).sum() >= 1
    table = et.Bsdf.table(BsdfData((one,)))
    assert any("were not measured" in told.found for told in table.complaints)
    assert float(table.reflectance(20.0)) == pytest.approx(0.5, rel=5e-3)


def test_transmitted_light_has_no_shadow() -> None:
    """The detector is behind the sample."""
    film = et.bsdf.Lambertian(reflectance=0.0, transmittance=0.5)
    assert not np.isnan(
        HEAD.measure_hemisphere(film, 20.0, step=20.0, way="transmitted", method="quadrature").values
    ).any()
