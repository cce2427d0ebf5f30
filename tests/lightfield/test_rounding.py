"""Rounding to binary digits: what it may move, and what it may not."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from etendue.lightfield.rounding import digits_for, rounded
from hypothesis import given
from hypothesis import strategies as st

TYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])


@TYPES
@given(data=st.data())
def test_the_nearest_number_with_so_many_digits(dtype: type, data: st.DataObject) -> None:
    """Worked out in fractions."""
    width = 32 if dtype is np.float32 else 64
    value = data.draw(st.floats(2.0**-100, 2.0**100, width=width))
    digits = data.draw(st.integers(0, 60))
    (found,) = rounded(np.array([value], dtype=dtype), digits)
    exponent = np.frexp(value)[1] - 1  # of the leading digit
    step = Fraction(2) ** int(exponent - min(digits, 23 if width == 32 else 52))
    assert Fraction(float(found)) == round(Fraction(value) / step) * step  # Python's round is to the even one, too
    assert rounded(np.array([found]), digits) == found


@TYPES
def test_numbers_at_the_ends_of_their_range(dtype: type) -> None:
    largest, smallest = np.finfo(dtype).max, np.finfo(dtype).smallest_subnormal
    values = np.array([largest, smallest, 0.0, 7 * smallest], dtype=dtype)
    np.testing.assert_array_equal(rounded(values, 1), np.array([largest, smallest, 0.0, 8 * smallest], dtype=dtype))
    assert rounded(values, 1).dtype == dtype


@TYPES
def test_steps_and_fewest_digits_bound_the_error_and_are_found_again(dtype: type) -> None:
    rng = np.random.default_rng(3)
    values, steps = np.exp(rng.normal(0, 6, (2, 100_000))).astype(dtype)
    steps[::100] = 0
    digits = digits_for(values, steps, 4)
    near = rounded(values, digits)
    error = np.abs(near.astype(np.float64) - values)
    kept = np.finfo(dtype).eps / 2 * values
    assert (error <= np.maximum(np.minimum(steps / 2, values / 32), kept)).all()
    assert (near[::100] == values[::100]).all()
    # Coarse steps are used, too: with these draws most digits go.
    assert np.median(digits) < 8
    # Rounding may carry a value to the next power of two, where more digits are wanted; it stays what it is.
    np.testing.assert_array_equal(rounded(near, digits_for(near, steps, 4)), near)
