"""Search along one coordinate: the maximum of a function, and round numbers near it."""

from __future__ import annotations

import math
from collections.abc import Callable


def golden_section(score: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Where a function is greatest, by golden section down to an interval of this width.

    Examples
    --------
    >>> round(golden_section(lambda z: -((z - 0.3) ** 2), 0.0, 1.0, 1e-4), 3)
    0.3
    """
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    places = [high - ratio * (high - low), low + ratio * (high - low)]
    values = [score(z) for z in places]
    while high - low > width:
        if values[0] >= values[1]:
            high, new = places[1], 0
            places[1], values[1] = places[0], values[0]
            places[0] = high - ratio * (high - low)
        else:
            low, new = places[0], 1
            places[0], values[0] = places[1], values[1]
            places[1] = low + ratio * (high - low)
        values[new] = score(places[new])
    return places[0] if values[0] >= values[1] else places[1]


def round_numbers_near(z: float, width: float, unit: float) -> list[float]:
    """Numbers within a width of z, with ever more decimals, down to some tenths of a unit, the roundest first.

    Examples
    --------
    >>> round_numbers_near(0.7512, 0.2, 0.02)
    [0.8, 0.75]
    """
    near: list[float] = []
    power = math.ceil(math.log10(max(abs(z), width)))
    while 10.0**power > 0.1 * unit:
        # Whole powers of ten are exact, their inverses are not.
        value = round(z / 10.0**power) * 10.0**power if power >= 0 else round(z * 10.0**-power) / 10.0**-power
        if abs(value - z) <= width and value not in near:
            near.append(value)
        power -= 1
    return near
