"""JSON as its standard has it, without the numbers that Python's reader lets through."""

from __future__ import annotations

import json
import math
from typing import Any


def strict_json(text: str | bytes) -> Any:
    """What a JSON text says, of finite numbers only.

    Parameters
    ----------
    text : str or bytes
        All of it.

    Raises
    ------
    ValueError
        If it is not JSON, or a number in it is NaN, infinite, or larger than a float64 holds.
    RecursionError
        If it is nested too deep.

    Examples
    --------
    >>> strict_json("[1e300]")
    [1e+300]
    >>> strict_json("[1e400]")
    Traceback (most recent call last):
    ...
    ValueError: '1e400' is no finite number
    """
    return json.loads(text, parse_constant=_refuse, parse_float=_finite, parse_int=_integer)


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _refuse(text)


def _integer(text: str) -> int:
    # Beyond this no float64 holds it, and whatever reads it as a number of the physical world would overflow.
    return int(text) if len(text) <= 308 else _refuse(text)


def _refuse(text: str) -> Any:
    raise ValueError(f"{text[:40]!r} is no finite number")
