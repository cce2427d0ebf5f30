"""What somebody hands over as an argument, refused in the words of the call before something further in stumbles over it."""

from __future__ import annotations

import dataclasses
import math
import numbers
import os
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.powers_of_ten import RAISED

if TYPE_CHECKING:
    import numpy.typing as npt

INTENSITY = "an Intensity: of a file et.read_intensity(path), of rays et.intensity_distribution(rays)"
"""What to give where an intensity distribution is wanted."""

LUMINANCE_OR_ILLUMINANCE = (
    "a LuminanceMap or an IlluminanceMap: of a file et.read_map(path) or et.read_illuminance_map(path)"
)
"""What to give where a map of either is wanted."""

SCENE = "a Scene: of a file et.Scene.load(path)"
"""What to give where a scene is wanted."""

SURFACE = "an et.Surface such as et.Disk(radius=30); of a text et.parse_surface(text)"
"""What to give where a carrier surface is wanted."""

SCANS = "Scans: of files et.read_scans(paths)"
"""What to give where scans of a goniometer are wanted."""

BSDF = "a BSDF: a model such as et.bsdf.Lambertian(reflectance=0.8), or of a file et.read_bsdf(path)"
"""What to give where a BSDF is wanted."""

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


def require_path(given: object, what: str = "path", instead: str = "the path of a file") -> None:
    """Refuse what is no path.

    Parameters
    ----------
    given : object
        The argument; whether there is a file is not asked.
    what, instead : str
        As of `require`.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> require_path("lamp.ies")
    >>> require_path(None)
    Traceback (most recent call last):
    etendue.errors.ArgumentError: path is None; give the path of a file.
    """
    require(given, (str, os.PathLike), what, instead)
    if "\0" in str(given):  # the system would read it as the end
        raise ArgumentError(f"{what} is {described(str(given))}, and no path has a letter of code 0; give {instead}.")


def require_known(given: object, known: Collection[str], what: str) -> None:
    """Refuse a name that is none of these, also what Python could not compare with them, as lists and arrays.

    Parameters
    ----------
    given : object
        The argument.
    known : collection of str
        The names that there are.
    what : str
        They are names of.

    Raises
    ------
    UnknownNameError
        If it is something else.

    Examples
    --------
    >>> require_known("ies", ("ies", "eulumdat"), "format")
    >>> require_known(["ies"], ("ies", "eulumdat"), "format")
    Traceback (most recent call last):
    etendue.errors.UnknownNameError: unknown format ['ies']. Known: eulumdat, ies.
    """
    if not isinstance(given, str) or given not in known:
        raise UnknownNameError(what, given, known)


def require_fields(changes: Collection[str], kind: type, called: str = "") -> None:
    """Refuse names of fields that a dataclass does not have, before `dataclasses.replace` fails in words of its own.

    Parameters
    ----------
    changes : collection of str
        The names.
    kind : type
        The dataclass.
    called : str
        What people call it; its name if empty.

    Raises
    ------
    UnknownNameError
        If so; suggests the nearest.

    Examples
    --------
    >>> from etendue.quantities.observer import Screen
    >>> require_fields({"column": 12}, Screen)
    Traceback (most recent call last):
    etendue.errors.UnknownNameError: unknown field of a Screen 'column'. Did you mean 'columns'? Known: columns, height, ...
    """
    known = [field.name for field in dataclasses.fields(kind) if field.init]
    for name in changes:
        require_known(name, known, f"field of a {called or kind.__name__}")


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
    if isinstance(given, float | int):  # first, as asking for any kind of number takes longer
        return
    # An array of one number without axes has the type of its elements, and no iteration.
    scalar = getattr(given, "ndim", None) == 0 and getattr(getattr(given, "dtype", None), "kind", "") in "iuf"
    if not (isinstance(given, numbers.Real) or scalar):
        raise ArgumentError(f"{what} is {described(given)}; give {instead}.")


def as_whole(given: Any, what: str, least: int = 0, most: int = (1 << 64) - 1) -> int:
    """A whole number of a range, as Python's own; True and False are none, 1e6 is one.

    Parameters
    ----------
    given : int or float
        The argument; scalars of numpy are numbers.
    what : str
        Function and argument.
    least, most : int
        The range, both included; a large `most` is one less than a power of two.

    Raises
    ------
    ArgumentError
        If it is something else.

    Examples
    --------
    >>> as_whole(1e3, "sample: n", 1)
    1000
    >>> as_whole(3.5, "sample: n", 1, 100)
    Traceback (most recent call last):
    etendue.errors.ArgumentError: sample: n is 3.5; give a whole number from 1 to 100.
    """
    number = isinstance(given, numbers.Real) and not isinstance(given, bool)
    # In this order: infinity and NaN have no int.
    if not (number and least <= given <= most and int(given) == given):
        told = f"{most:,}" if most < 1 << 40 else "2" + str((most + 1).bit_length() - 1).translate(RAISED) + " − 1"
        raise ArgumentError(f"{what} is {described(given)}; give a whole number from {least:,} to {told}.")
    return int(given)


def require_numbers(holder: object, *names: str, instead: str = "a number", none: bool = False) -> None:
    """Refuse settings that are no real numbers.

    Parameters
    ----------
    holder : object
        What has them as attributes; its class is named.
    *names : str
        Of the settings.
    instead : str
        What to give.
    none : bool
        Whether None is allowed.

    Raises
    ------
    ArgumentError
        If one is something else.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> require_numbers(SimpleNamespace(width="8"), "width", instead="a length in mm")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: SimpleNamespace: width is '8'; give a length in mm.
    """
    for name in names:
        given = getattr(holder, name)
        if not (none and given is None):
            require_number(given, f"{type(holder).__name__}: {name}", f"{instead}, or None" if none else instead)


def require_callable(given: object, what: str = "progress") -> None:
    """Refuse what cannot be called; None is left alone.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> require_callable(print), require_callable(None)
    (None, None)
    >>> require_callable(True)
    Traceback (most recent call last):
    etendue.errors.ArgumentError: progress is True; give a function that is called as work goes on, or None.
    """
    if given is not None and not callable(given):
        raise ArgumentError(f"{what} is {described(given)}; give a function that is called as work goes on, or None.")


def as_numbers(
    given: Any, what: str, instead: str = "an array of numbers", dtype: type = float, *, copy: bool = False
) -> npt.NDArray[Any]:
    """An array of numbers, of whatever shape.

    Parameters
    ----------
    given : array_like
        The argument.
    what, instead : str
        As of `require`.
    dtype : type
        Of the array.
    copy : bool
        Whether to copy an array that has this type already.

    Raises
    ------
    ArgumentError
        If it is a text, None, or holds something that is no number, or rows of different lengths.

    Examples
    --------
    >>> as_numbers([1, 2], "RaySet: flux").tolist()
    [1.0, 2.0]
    >>> as_numbers([1, "b"], "RaySet: flux")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: RaySet: flux is a list (could not convert string to float: 'b'); give an array of numbers.
    """
    import numpy as np  # noqa: PLC0415 - the command line names wrong paths without it

    why = ""
    if not (given is None or isinstance(given, (str, bytes))):  # numpy makes NaN of None, and a number of "3"
        try:
            return np.array(given, dtype=dtype, copy=copy or None)
        except (TypeError, ValueError, OverflowError) as error:
            why = f" ({error})"
    raise ArgumentError(f"{what} is {described(given)}{why}; give {instead}.") from None


def as_point(given: Any, what: str, instead: str) -> tuple[float, float, float]:
    """Three finite numbers.

    Parameters
    ----------
    given : sequence of 3 numbers
        The argument.
    what, instead : str
        As of `require`.

    Raises
    ------
    ArgumentError
        If it is something else.

    Examples
    --------
    >>> as_point([0, 0, 5], "Observer: target", "three finite coordinates in mm")
    (0.0, 0.0, 5.0)
    >>> as_point((0, 5), "Observer: target", "three finite coordinates in mm")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: Observer: target is (0, 5); give three finite coordinates in mm.
    """
    try:
        found = () if isinstance(given, str | bytes | Mapping) else tuple(map(float, given))
    except (TypeError, ValueError):
        found = ()
    if len(found) != 3 or not all(map(math.isfinite, found)):
        told = (
            f"({', '.join(f'{one:g}' for one in found[:4])}{', …' * (len(found) > 4)})" if found else described(given)
        )
        raise ArgumentError(f"{what} is {told}; give {instead}.")
    x, y, z = found
    return x, y, z
