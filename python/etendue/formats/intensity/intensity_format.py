"""What a format for intensity distributions is, and what its readers and writers share."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from etendue.errors import FormatError
from etendue.formats.encodings import decoded
from etendue.formats.head import Head
from etendue.formats.intensity.symmetry import Array
from etendue.quantities.intensity import Intensity
from etendue.quantities.measured import measured, measured_peak

MOST_BYTES = 1 << 27
"""Largest file that is read: a table of 0.1° by 0.1° over the whole sphere has half as much."""

LARGEST_INTENSITY = 1e35
"""cd or W/sr: the sun has 3e27 cd. What is larger is a slip, and sums and squares of it may leave the numbers."""

DAMAGED = "The file is damaged or cut short; ask for it again."

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)


@dataclasses.dataclass(frozen=True)
class IntensityFormat:
    """One published format for luminous intensity distributions.

    Parameters
    ----------
    name : str
        As users type it: ``"lm63"``.
    title : str
        As people read it.
    extension : str
        Lower case with the dot; it chooses the format for writing, never for reading.
    recognise : callable
        Whether a file that begins with this `Head` is of this format.
    read : callable
        From a path to the distribution. Raises `FormatError` for whatever is wrong with the file.
    write : callable, optional
        Writes a distribution to a path and returns what the format could not express, one sentence each. None for
        formats that are read only.
    pick : callable, optional
        From a path and a name to one of the distributions of a file. None for formats that hold one.
    """

    name: str
    title: str
    extension: str
    recognise: Callable[[Head], bool]
    read: Callable[[Path], Intensity]
    write: Callable[[Intensity, Path], tuple[str, ...]] | None = None
    pick: Callable[[Path, str], Intensity] | None = None


def read_bytes(path: Path) -> bytes:
    """The whole file.

    Raises
    ------
    FormatError
        If it is larger than any distribution.
    """
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise FormatError(path, "size", f"{size:,} bytes, far more than a distribution", "Give an intensity file.")
    return path.read_bytes()


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, decoded by `etendue.formats.encodings.decoded`.

    The last one is what follows the last line end: empty if the file ends with one.

    Raises
    ------
    FormatError
        If the file is larger than any distribution, or no text.
    """
    # A DOS end-of-file mark is no text.
    return re.split(r"\r\n|\n|\r", decoded(path, read_bytes(path)).removesuffix("\x1a"))


def number(word: str) -> float | None:
    """What a word of a file says, if it is a finite number; Python's own reading takes ``nan`` and ``1_000`` as well."""
    if not _NUMBER.fullmatch(word):
        return None
    value = float(word.replace("d", "e").replace("D", "e"))
    return value if np.isfinite(value) else None


def scaled(path: Path, place: str, values: Array, factor: float) -> Array:
    """The intensities of a file [cd or W/sr]: its table times the factor that it states.

    Raises
    ------
    FormatError
        If one is larger than that of any source.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        intensities = values * factor
    if not (np.abs(intensities) <= LARGEST_INTENSITY).all():
        found = (
            f"{np.abs(values).max():g}, times the factor {factor:g} that the file states, is more than any source has"
        )
        raise FormatError(path, place, found, DAMAGED)
    return intensities


def decimal(value: float, digits: int) -> str:
    """A number to so many significant digits without a power of ten, which readers of these formats may not know."""
    return np.format_float_positional(value, precision=digits, unique=False, fractional=False, trim="-")


def fitted(text: str, encoding: str, length: int) -> str:
    """One line of printable text that an encoding and a format have room for; ``?`` where a letter does not exist."""
    printable = "".join(letter if letter.isprintable() else " " for letter in text)
    return printable.encode(encoding, errors="replace").decode(encoding)[:length]


def figures(intensity: Intensity) -> Iterator[str]:
    """Peak and flux with their standard errors, if these are known."""
    if np.isfinite(intensity.maximum_error):
        yield f"peak {measured_peak(intensity)}"
    if np.isfinite(intensity.flux_error):
        yield f"flux {measured(intensity.flux, intensity.flux_error, intensity.flux_unit)}"


def general_losses(intensity: Intensity) -> Iterator[str]:
    """What files of intensity have no place for, one sentence each."""
    if np.isfinite(intensity.standard_error).any():
        yield "standard errors are not kept"
    if "spectrum" in intensity.luminaire:
        yield "the spectrum is not kept"
    if "tilt" in intensity.luminaire:
        yield "the lamp factors over tilt are not kept"
