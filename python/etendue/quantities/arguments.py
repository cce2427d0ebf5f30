"""What somebody hands over as an argument, refused in the words of the call before something further in stumbles over it."""

from __future__ import annotations

import numbers
from typing import Any

from etendue.errors import ArgumentError

INTENSITY = "an Intensity: of a file et.read_intensity(path), of rays et.intensity_distribution(rays)"
"""What to give where an intensity distribution is wanted."""

LUMINANCE_OR_ILLUMINANCE = (
    "a LuminanceMap or an IlluminanceMap: of a file et.read_map(path) or et.read_illuminance_map(path)"
)
"""What to give where a map of either is wanted."""

SCENE = "a Scene: of a file et.Scene.load(path)"
"""What to give where a scene is wanted."""

MOST_LETTERS = 40
"""Of a text that is told."""


def described(given: object) -> str:
    """A value in a message: texts and numbers as they are written, anything else by its kind.

    Examples
    --------
    >>> described("0"), described(None), described(3), described([1, 2]), described(range(2))
    ("'0'", 'None', '3', 'a list', 'a range')
    """
    if given is None or isinstance(given, str | int | float):
        text = repr(given)
        return text if len(text) <= MOST_LETTERS else f"{text[: MOST_LETTERS - 1]}…"
    name = type(given).__name__
    return f"an {name}" if name[0] in "AEIOaeio" else f"a {name}"


def require(given: object, kinds: type | tuple[type, ...], what: str, instead: str) -> None:
    """Refuse what is of none of these kinds.

    Parameters
    ----------
    given : object
        The argument.
    kinds : type or tuple of type
        What it may be.
    what : str
        Function and argument.
    instead : str
        What to give.

    Raises
    ------
    ArgumentError
        If it is something else.

    Examples
    --------
    >>> require("lamp.ies", dict, "beam_angle: intensity", "an Intensity, of a file et.read_intensity(path)")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: beam_angle: intensity is 'lamp.ies'; give an Intensity, of a file et.read_intensity(path).
    """
    if not isinstance(given, kinds):
        raise ArgumentError(f"{what} is {described(given)}; give {instead}.")


def require_number(given: Any, what: str, instead: str = "a number") -> None:
    """Refuse what is no real number: texts that look like one, None, arrays of several.

    Parameters
    ----------
    given : object
        The argument; scalars of numpy are numbers.
    what, instead : str
        As of `require`.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> require_number(3.5, "beam_angle: c")
    >>> require_number("0", "beam_angle: c", "an angle in °")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: beam_angle: c is '0'; give an angle in °.
    """
    # An array of one number without axes has the type of its elements, and no iteration.
    scalar = getattr(given, "ndim", None) == 0 and getattr(getattr(given, "dtype", None), "kind", "") in "iuf"
    if not (isinstance(given, numbers.Real) or scalar):
        raise ArgumentError(f"{what} is {described(given)}; give {instead}.")
