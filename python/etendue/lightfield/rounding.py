"""Numbers with only as many binary digits as they deserve, so that files of them are small."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Floats = TypeVar("Floats", npt.NDArray[np.float32], npt.NDArray[np.float64])
Digits = int | npt.NDArray[np.integer]


def rounded(values: Floats, digits: Digits) -> Floats:
    """The nearest numbers with at most `digits` binary digits after the leading one; of two, the even one.

    They are off by at most 2^-(digits + 1) of their value. What is rounded already stays as it is.

    Parameters
    ----------
    values : array of float32 or float64
        Finite.
    digits : int or array of int
        0 or more; where it exceeds what the type has, the value stays as it is.

    Examples
    --------
    >>> rounded(np.array([1.0, 1.1, 1.3, 1e6, 0.0]), 2)
    array([1.000000e+00, 1.000000e+00, 1.250000e+00, 1.048576e+06, 0.000000e+00])
    """
    fraction, exponent = np.frexp(values)
    # No double has more: shifted by more than its digits, a number would only overflow.
    shift = np.minimum(digits, 52) + 1
    with np.errstate(over="ignore"):
        near = np.ldexp(np.rint(np.ldexp(fraction, shift)), exponent - shift)
    # The largest numbers of all cannot be rounded up.
    return np.where(np.isfinite(near), near, values)


def digits_for(values: Floats, steps: Floats, fewest: int) -> npt.NDArray[np.integer]:
    """The digits with which `rounded` leaves values on multiples of a power of two that is not above their step.

    Rounding by them moves a value by at most half its step and by at most 2^-(fewest + 1) of itself.

    Parameters
    ----------
    values, steps : array of float32 or float64, same shape
        Not negative. Where the step is 0, all digits are kept.
    fewest : int
        As many digits are kept however coarse the step is.

    Examples
    --------
    >>> values, steps = np.array([5.3, 5.3, 5.3]), np.array([0.3, 0.003, 80.0])
    >>> digits = digits_for(values, steps, 1)
    >>> digits.tolist(), rounded(values, digits).tolist()
    ([4, 11, 1], [5.25, 5.30078125, 6.0])
    """
    wanted = np.frexp(values)[1] - np.frexp(steps)[1]
    most: int = np.finfo(values.dtype).nmant
    return np.where(steps > 0, np.clip(wanted, fewest, most), most)
