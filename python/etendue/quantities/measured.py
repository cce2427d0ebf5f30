"""A number with its standard error, as people read it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etendue.quantities.powers_of_ten import common_power, counted, ten_to

if TYPE_CHECKING:
    from etendue.quantities.intensity import Intensity


def measured(value: float, error: float, unit: str) -> str:
    """A value to the digits that its standard error leaves, two of the error's; to four digits if there is none.

    Both are counted in the same power of ten, which is named if the value is very small or very large.

    Examples
    --------
    >>> measured(91.9955, 0.02714, "lm"), measured(45812.3, 1471.3, "cd"), measured(12.3456789, math.nan, "lm")
    ('91.996 ± 0.027 lm', '45800 ± 1500 cd', '12.35 lm')
    >>> measured(18.31e6, 2.1e6, "cd/m²"), measured(18.31e6, math.nan, "cd/m²")
    ('(18.3 ± 2.1) × 10⁶ cd/m²', '18.31 × 10⁶ cd/m²')
    """
    if not (math.isfinite(error) and error > 0.0 and math.isfinite(value)):
        return counted(value, unit)
    if power := common_power(value, error):
        return f"({measured(value / 10.0**power, error / 10.0**power, '').rstrip()}) × {ten_to(power)} {unit}"
    digits = 1 - math.floor(math.log10(error))
    # 0.0996 has two digits as 0.10.
    digits = 1 - math.floor(math.log10(round(error, digits)))
    # A table of numbers that differ by more than a double holds is shown to what it holds.
    if digits > 12:
        return f"{value:.6g} ± {error:.2g} {unit}"
    places = max(digits, 0)
    return f"{round(value, digits):.{places}f} ± {round(error, digits):.{places}f} {unit}"


def measured_peak(found: Intensity) -> str:
    """The peak with its standard error, and the largest value if chance lifts that by more than half of it.

    Examples
    --------
    >>> import etendue as et
    >>> measured_peak(et.Intensity([0], [0, 90, 180], [[500.0, 0, 0]], [[20.0, 0, 0]]))
    '500 ± 20 cd'
    >>> measured_peak(et.Intensity([0], [0, 60, 120, 180], [[500.0, 505, 498, 502]], 20.0))
    '494 ± 20 cd (largest value 505 cd, lifted by chance)'
    >>> measured_peak(et.Intensity([0], [0, 60, 120, 180], [[50000.0, 50500, 49800, 50200]], 2000.0))
    '49400 ± 2000 cd (largest value 50500 cd, lifted by chance)'
    """
    return measured_largest(found.peak_intensity, found.peak_error, found.maximum, found.unit)


def measured_largest(value: float, error: float, largest: float, unit: str) -> str:
    """What the largest of many values is without chance, and that value if chance lifts it by more than half of the error.

    Examples
    --------
    >>> measured_largest(0.26, 0.04, 0.35, "1/sr"), measured_largest(0.26, 0.04, 0.27, "1/sr")
    ('0.260 ± 0.040 1/sr (largest value 0.35 1/sr, lifted by chance)', '0.260 ± 0.040 1/sr')
    """
    told = measured(value, error, unit)
    if not largest - value > 0.5 * error:
        return told
    return f"{told} (largest value {counted(largest, unit)}, lifted by chance)"


def measured_pixel(largest: float, error: float, apart: float, unit: str) -> str:
    """The largest pixel of a map with its error; without the lift of chance, if that is more than half of the error.

    Parameters
    ----------
    largest, error : float
        The pixel and its standard error.
    apart : float
        What it is less the lift (`unlifted`).
    unit : str
        Of all three.

    Examples
    --------
    >>> measured_pixel(3560.0, 92.0, 3540.0, "cd/m²"), measured_pixel(3560.0, 92.0, 3410.0, "cd/m²")
    ('3560 ± 92 cd/m²', '3410 ± 92 cd/m² (largest pixel 3560 cd/m², lifted by chance)')
    >>> measured_pixel(3560.0, 2100.0, 100.0, "cd/m²")
    'not known (chance alone may have made the largest pixel, 3560 cd/m²)'
    """
    if not largest - apart > 0.5 * error:
        return measured(largest, error, unit)
    if apart < error:
        return f"not known (chance alone may have made the largest pixel, {counted(largest, unit)})"
    return f"{measured(apart, error, unit)} (largest pixel {counted(largest, unit)}, lifted by chance)"


def peak_line(found: Intensity) -> str:
    """The peak of a distribution with its error and direction.

    Examples
    --------
    >>> import etendue as et
    >>> peak_line(et.Intensity([0], [0, 90, 180], [[500.0, 0, 0]], [[20.0, 0, 0]]))
    'peak 500 ± 20 cd at C = 0°, γ = 0°'
    """
    c, gamma = found.peak
    return f"peak {measured_peak(found)} at C = {c:g}°, γ = {gamma:g}°"
