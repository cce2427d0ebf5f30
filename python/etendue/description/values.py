"""Numbers and rows of numbers as users write them: what a key of a scene may hold."""

from __future__ import annotations

import numbers
from typing import Annotated, Any, TypeGuard

import numpy as np
from annotated_types import Ge, Gt, Le, MaxLen, MinLen
from pydantic import AfterValidator, AllowInfNan, BeforeValidator, FailFast


def is_number(value: object) -> TypeGuard[float]:
    """Whether something is a real number; a truth value is none.

    Examples
    --------
    >>> is_number(3), is_number(np.float32(0.5)), is_number(True), is_number("3")
    (True, True, False, False)
    """
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _number(value: Any) -> Any:
    """A float from any real number; text that looks like one is a mistake, and so is a truth value."""
    if type(value) is float:
        return value
    if not is_number(value):
        raise ValueError("not a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("not a number of a size that can be worked with") from None


def _count(value: Any) -> Any:
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        raise ValueError("not a whole number")  # noqa: TRY004 - a TypeError would not reach the list of mistakes
    return int(value)


def _row(value: Any) -> Any:
    """A tuple from a list or an array; a set has no order and a text is no row."""
    if isinstance(value, np.ndarray):
        return tuple(value.tolist())
    if not isinstance(value, list | tuple):
        raise ValueError("not a row of values in [ ]")  # noqa: TRY004 - likewise
    return tuple(value)


# The constraints stand inside, next to the type that JSON Schema knows, and what tells numbers from look-alikes outside.
AsNumber = BeforeValidator(_number)
AsCount = BeforeValidator(_count)
AsRow = BeforeValidator(_row)


class _FirstMistake(FailFast):
    # Types that are joined with `|` are looked up by their hash.
    __hash__ = object.__hash__


FirstMistake = _FirstMistake()
"""For long rows: only the first mistake is told, of what may be millions."""
Finite = AllowInfNan(False)

LONGEST = 1e9
"""Largest length [mm] in a scene: a thousand kilometres. Squares and products of lengths then stay far from overflow."""

SHORTEST = 1e-100
"""Smallest length [mm] in a scene, so that squares and products of lengths do not vanish: no surface has an area of 0."""


def _not_tiny(length: float) -> float:
    if length < SHORTEST:
        raise ValueError(f"is {length:g}; it must be at least {SHORTEST:g}")
    return length


SHORTEST_WAVELENGTH = 10.0
"""Smallest wavelength [nm] in a scene, where ultraviolet radiation begins. Visible light that is stated in µm is below."""


def _in_nanometres(wavelength: float) -> float:
    if wavelength < SHORTEST_WAVELENGTH:
        raise ValueError(f"is {wavelength:g}; wavelengths are in nm, and {SHORTEST_WAVELENGTH:g} nm at least")
    return wavelength


Bound = Annotated[float, AsNumber]
"""A number or an infinity."""
Number = Annotated[float, Finite, AsNumber]
Positive = Annotated[float, Finite, Gt(0.0), AsNumber]
NotNegative = Annotated[float, Finite, Ge(0.0), AsNumber]
Length = Annotated[float, Finite, Gt(0.0), Le(LONGEST), AfterValidator(_not_tiny), AsNumber]
LengthOrZero = Annotated[float, Finite, Ge(0.0), Le(LONGEST), AsNumber]
Coordinate = Annotated[float, Finite, Ge(-LONGEST), Le(LONGEST), AsNumber]
Wavelength = Annotated[float, Finite, Gt(0.0), Le(1e9), AfterValidator(_in_nanometres), AsNumber]
Share = Annotated[float, Finite, Ge(0.0), Le(1.0), AsNumber]
Index = Annotated[int, Ge(0), Le((1 << 31) - 1), AsCount]
Pixels = Annotated[int, Ge(1), Le(65536), AsCount]

Vector = Annotated[tuple[Number, Number, Number], AsRow]
Point = Annotated[tuple[Coordinate, Coordinate, Coordinate], AsRow]
Interval = Annotated[tuple[Bound, Bound], AsRow]
Numbers = Annotated[tuple[Number, ...], FirstMistake, AsRow]
Vertices = Annotated[
    tuple[Annotated[tuple[Coordinate, Coordinate], AsRow], ...], MinLen(3), MaxLen(1 << 16), FirstMistake, AsRow
]

Rising = Annotated[tuple[Wavelength, ...], MinLen(1), MaxLen(1 << 20), FirstMistake, AsRow]


def rises(name: str, values: tuple[float, ...]) -> None:
    """Refuse nodes of a table that do not rise strictly.

    Raises
    ------
    ValueError
        With the name of the key.

    Examples
    --------
    >>> rises("wavelength", (400.0, 700.0))
    """
    if (np.diff(values) <= 0.0).any():
        raise ValueError(f"{name!r} must rise from value to value")
