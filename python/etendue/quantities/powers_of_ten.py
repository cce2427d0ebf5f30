"""Numbers counted in powers of ten, as people write them."""

from __future__ import annotations

import math

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def ten_to(power: int) -> str:
    """A power of ten.

    Examples
    --------
    >>> ten_to(-12)
    '10⁻¹²'
    """
    return "10" + str(power).translate(RAISED)


def common_power(low: float, high: float) -> int:
    """The power of ten, a multiple of three, that numbers are counted in; 0 if the largest is neither tiny nor huge.

    Examples
    --------
    >>> common_power(0.0, 9.9e6), common_power(-3e7, 2.0), common_power(0.0, 2e-4)
    (0, 6, -6)
    """
    size = max(abs(low), abs(high))
    return 0 if size == 0.0 or not math.isfinite(size) or 1e-3 <= size < 1e7 else 3 * math.floor(math.log10(size) / 3.0)


def rounded(value: float, digits: int = 4) -> str:
    """A number to so many digits, without a power of ten unless it is very small or very large; NaN is "undefined".

    Examples
    --------
    >>> rounded(12345.678), rounded(0.021834567), rounded(500.0), rounded(math.nan)
    ('12350', '0.02183', '500', 'undefined')
    """
    if math.isnan(value):
        return "undefined"
    text = f"{value:.{digits}g}"
    return text if common_power(value, value) or not math.isfinite(value) else f"{float(text):.12g}"


def counted(value: float, unit: str, digits: int = 4) -> str:
    """A number to so many digits with its unit, in a power of ten only if it is very small or very large.

    Examples
    --------
    >>> counted(18312345.0, "cd/m²"), counted(0.25, "lm"), counted(4.2e-7, "cd")
    ('18.31 × 10⁶ cd/m²', '0.25 lm', '420 × 10⁻⁹ cd')
    >>> counted(0.99999999e-9, "W")
    '1 × 10⁻⁹ W'
    """
    if math.isfinite(value):
        value = float(f"{value:.{digits}g}")  # before its power is chosen
    power = common_power(value, value)
    return f"{value / 10.0**power:.{digits}g} × {ten_to(power)} {unit}" if power else f"{rounded(value, digits)} {unit}"
