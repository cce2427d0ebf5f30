"""Data that end before the horizon: the share that nobody measured is told."""

import math
import re

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid


def _table(*, last: float, azimuths: int, theta: float) -> et.BsdfTable:
    grid = PolarGrid("normal", np.linspace(0.0, last, 6), np.arange(azimuths) * 360.0 / azimuths)
    return et.BsdfTable(BsdfData([BsdfSlice(direction(theta, 180.0), np.full(grid.shape, 0.5 / np.pi), grid=grid)]))


@pytest.mark.parametrize("azimuths", [1, 24])
@pytest.mark.parametrize("last", [20.0, 60.0, 80.0])
def test_what_lies_beyond_the_values_is_told(last: float, azimuths: int) -> None:
    """Of f = R/π, R cos² of the last angle lies beyond it."""
    (told,) = map(str, _table(last=last, azimuths=azimuths, theta=30.0).complaints)
    found = re.search(r"of the (\S+) of the light that the table reflects, (\S+) lies beyond", told)
    assert found is not None, told
    share, beyond = map(float, found.groups())
    assert abs(share - 0.5) < 1e-4
    assert abs(beyond - 0.5 * math.cos(math.radians(last)) ** 2) < 2e-4


@pytest.mark.parametrize("last", [85.0, 90.0])
def test_the_last_degrees_are_no_matter(last: float) -> None:
    assert not _table(last=last, azimuths=24, theta=30.0).complaints


def test_values_that_were_not_measured_lie_beyond_as_well() -> None:
    grid = PolarGrid("normal", np.arange(0.0, 91.0, 10.0), np.arange(0.0, 360.0, 90.0))
    values = np.where(grid.radial > 40.0, np.nan, 0.3) * np.ones(grid.shape)
    (told,) = et.BsdfTable(BsdfData([BsdfSlice(direction(10.0, 180.0), values, grid=grid)])).complaints
    # Between 40° and the first that is not known, 50°, it is not known where they end.
    ends = [0.3 * math.pi * math.cos(math.radians(angle)) ** 2 for angle in (50.0, 40.0)]
    beyond = re.search(r", (\S+) lies beyond", str(told))
    assert beyond is not None
    assert ends[0] <= float(beyond[1]) <= ends[1]
