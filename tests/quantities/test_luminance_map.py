"""A luminance map keeps its arrays, its unit and its origin, and sums to intensity."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance

OBSERVER = Observer(40, 25, 60, (1, -2, 3))
SCREEN = Screen(30, 8, 4, 3, plane="xy")


def make_map(**changes: Any) -> LuminanceMap:
    values = np.arange(12.0).reshape(3, 4) ** 1.5
    values[1, 2] = math.nan
    fields: dict[str, Any] = {
        "values": values,
        "standard_error": values / 10,
        "rays": np.where(np.isnan(values), 0, 7),
        "observer": OBSERVER,
        "screen": SCREEN,
        "provenance": Provenance("led.ray", "tm25", "0a", ("moved",), "etendue 0"),
        "notes": ("acceptance 1.5°",),
    }
    return LuminanceMap(**(fields | changes))


def test_arrays_are_copies_that_nobody_changes() -> None:
    values = np.ones((3, 4))
    lmap = make_map(values=values)
    values[0, 0] = 5.0
    assert lmap.values[0, 0] == 1.0
    for array in (lmap.values, lmap.standard_error, lmap.rays):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 2


def test_arrays_have_the_stated_types() -> None:
    lmap = make_map(values=np.ones((3, 4), "f4"), rays=np.ones((3, 4), "u2"))
    assert (lmap.values.dtype, lmap.standard_error.dtype, lmap.rays.dtype) == (np.float64, np.float64, np.int64)


@pytest.mark.parametrize("name", ["values", "standard_error", "rays"])
def test_refuses_arrays_that_do_not_fit_the_screen(name: str) -> None:
    # Rows and columns swapped: the mistake that a square screen would hide.
    with pytest.raises(ArgumentError, match=rf"{name} has shape \(4, 3\), the screen has \(rows, columns\) = \(3, 4\)"):
        make_map(**{name: np.ones((4, 3))})


def test_units_follow_the_flux() -> None:
    assert (make_map().quantity, make_map().unit) == ("luminance", "cd/m²")
    radiometric = make_map(flux_unit="W")
    assert (radiometric.quantity, radiometric.unit) == ("radiance", "W/(m² sr)")
    with pytest.raises(UnknownNameError, match="unknown flux unit 'lumen'"):
        make_map(flux_unit="lumen")


def test_dead_pixels_are_counted() -> None:
    assert make_map().dead_pixels == 1
    assert make_map(values=np.full((3, 4), math.nan)).dead_pixels == 12


def test_intensity_is_the_sum_over_apparent_areas() -> None:
    lmap = make_map()
    t, p = math.radians(40), math.radians(25)
    eye = 60 * np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])
    expected = 0.0
    for row, column in itertools.product(range(3), range(4)):
        sight = eye - [(column + 0.5) * 7.5 - 15, 4 - (row + 0.5) * 8 / 3, 0]
        apparent = 7.5e-3 * (8e-3 / 3) * sight[2] / np.linalg.norm(sight)  # m²
        if (row, column) != (1, 2):
            expected += (4 * row + column) ** 1.5 * apparent
    assert lmap.intensity == pytest.approx(expected, rel=1e-13)


def test_a_uniform_map_seen_from_afar_has_the_intensity_luminance_times_area() -> None:
    screen = Screen(20, 50, 7, 9)
    shape = screen.shape
    lmap = LuminanceMap(np.full(shape, 3e4), np.zeros(shape), np.ones(shape), Observer(70, 200, 1e9), screen)
    assert lmap.intensity == pytest.approx(3e4 * 0.02 * 0.05, rel=1e-12)


def test_survives_its_header() -> None:
    lmap = make_map(flux_unit="W")
    header = json.loads(json.dumps(lmap.header()))
    back = LuminanceMap.from_header(header, lmap.values, lmap.standard_error, lmap.rays)
    for name in ("observer", "screen", "flux_unit", "provenance", "notes"):
        assert getattr(back, name) == getattr(lmap, name)
    np.testing.assert_array_equal(back.values, lmap.values)
    assert (header["unit"], header["quantity"]) == ("W/(m² sr)", "radiance")


def test_replace_changes_one_field_of_a_copy() -> None:
    lmap = make_map()
    other = lmap.replace(notes=("another",))
    assert (other.notes, lmap.notes) == (("another",), ("acceptance 1.5°",))
    np.testing.assert_array_equal(other.values, lmap.values)
