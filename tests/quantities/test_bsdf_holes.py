"""Values of grids that were not measured, against the BSDF that they were taken from."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_holes import filled
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.models import Gaussian, Lambertian, Mixture

FLAT = Mixture(parts=(Lambertian(reflectance=0.3), Gaussian(peak=3, sigma=0.15)))
LIGHT = light_from(40.0, 180.0)


def of_model(*, grid: PolarGrid, incident: np.ndarray = LIGHT) -> np.ndarray:
    to = grid.directions(incident, transmitted=False)
    there = ~np.isnan(to[..., 0])
    f = np.full(there.shape, np.nan)
    f[there] = FLAT.evaluate(incident, to[there])
    return f


GRID = PolarGrid("normal", np.arange(0.0, 90.0, 3.0), np.arange(0.0, 360.0, 10.0))


@pytest.mark.parametrize(
    ("part", "most"),
    [
        ("centre", 1.4),  # θ below 9°, beside a lobe at 20°; the least value of the slice was off by up to 10 times
        ("between", 1.4),  # three of ten values at random; the last value before them by up to 2.6 times
        ("azimuths", 1.4),  # each third azimuth; by up to 25 times
        ("ring", 1.25),  # θ from 27 to 33°; by up to 2.6 times
    ],
)
def test_values_taken_out_of_a_lobe_on_a_floor_come_back(part: str, most: float) -> None:
    """Factor by which any of them is off, and their share of the light, against the model."""
    incident = light_from(20.0 if part == "centre" else 40.0, 180.0)
    f = of_model(grid=GRID, incident=incident)
    n, m = np.arange(GRID.radial.size)[None, :], np.arange(GRID.azimuth.size)[:, None]
    out = {
        "centre": (n < 3) & (m >= 0),
        "between": np.random.default_rng(1).random(f.shape) < 0.3,
        "azimuths": (m % 3 == 1) & (n >= 0),
        "ring": (n // 3 == 3) & (m >= 0),
    }[part]
    one = BsdfSlice(incident, np.where(out, np.nan, f), grid=GRID)
    off = np.abs(np.log(one.held[out] / f[out]))
    assert np.exp(off.max()) < most
    assert one.integral() == pytest.approx(BsdfSlice(incident, f, grid=GRID).integral(), rel=0.04)
    assert (one.holes[:, :-1] == out[:, :-1]).all()


def test_an_exponential_through_the_pole_and_around_it_is_exact() -> None:
    """Ln f = a + b x + c y is linear along every line through the pole; nothing is measured below 8° and at 20°."""
    radial, azimuth = np.arange(0.0, 40.0, 4.0), np.arange(0.0, 360.0, 15.0)
    x, y = radial * np.cos(np.radians(azimuth))[:, None], radial * np.sin(np.radians(azimuth))[:, None]
    f = np.exp(0.3 - 0.05 * x + 0.02 * y)
    hole = f.copy()
    hole[:, (radial < 8.0) | (radial == 20.0)] = np.nan
    found = filled(hole, radial, azimuth, np.ones(f.shape, bool), degrees=True)
    np.testing.assert_allclose(found.values, f, rtol=1e-12)
    assert found.between.sum() == 3 * azimuth.size


def test_noise_around_zero_is_interpolated_straight() -> None:
    """No logarithm is taken where one of both ends is not above 0."""
    hole = np.array([[0.4, np.nan, -0.2]])
    found = filled(hole, np.array([0.0, 1.0, 2.0]), np.zeros(1), np.ones((1, 3), bool), degrees=True)
    np.testing.assert_allclose(found.values, [[0.4, 0.1, -0.2]], atol=1e-12)


def test_what_was_not_measured_is_told() -> None:
    """How many values, where and how; a warning where they hold much of the light."""
    f = of_model(grid=GRID)
    few, many = f.copy(), f.copy()
    few[3, 20:23] = np.nan
    many[:, 10:18] = np.nan  # the lobe
    for values, severity, count in ((few, "note", 3), (many, "warning", 8 * GRID.azimuth.size)):
        table = et.Bsdf.table(BsdfData((BsdfSlice(LIGHT, values, grid=GRID),)))
        (told,) = [one for one in table.complaints if "not measured" in one.found]
        assert told.severity == severity
        assert told.found.startswith(f"{count} of {f.size} values")
        assert "ln f linear" in told.found
        assert told.place == "40° of incidence"


def test_rows_of_which_nothing_is_known_lie_between_their_neighbours() -> None:
    """Of two half planes 180° apart, as a scan in one plane has them, the others are a mix of both."""
    values = np.full((4, 2), np.nan)
    values[0], values[2] = (1.0, 4.0), (4.0, 1.0)
    found = filled(values, np.array([10.0, 20.0]), np.arange(0.0, 360.0, 90.0), np.ones((4, 2), bool), degrees=True)
    np.testing.assert_allclose(found.values[[1, 3]], 2.0, rtol=1e-12)
