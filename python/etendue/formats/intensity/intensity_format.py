"""What a format for intensity distributions is, and what its readers and writers share."""

from __future__ import annotations

import dataclasses
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.encodings import decoded
from etendue.formats.head import Head
from etendue.formats.intensity.symmetry import Array
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminaire_facts import has_corners
from etendue.quantities.measured import measured, measured_peak

MOST_BYTES = 1 << 27
"""Largest file that is read: a table of 0.1° by 0.1° over the whole sphere has half as much."""

LARGEST_INTENSITY = 1e35
"""cd or W/sr: the sun has 3e27 cd. What is larger is a slip, and sums and squares of it may leave the numbers."""

_EITHER_COMMA = re.compile(r"[1-9][0-9]{0,2},[0-9]{3}")

DAMAGED = "The file is damaged or cut short; ask for it again."

SPELT_OUT = {
    "γ": "gamma", "°": " deg", "±": "+/-", "√": "sqrt", "Σ": "sum", "×": "x", "−": "-", "–": "-", "—": "-", "’": "'",
    "“": '"', "”": '"', "„": '"',
}  # fmt: skip
"""Signs that an encoding may not have, and what says the same."""

MOST_LETTERS = 8
"""Letters that a sentence about a text names."""

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


def either_comma(word: str) -> str | None:
    """What is to be said of a number whose comma may stand before decimals or between thousands; None of any other.

    Examples
    --------
    >>> either_comma("1,250"), either_comma("0,9"), either_comma("1000,5")
    ("'1,250' may be 1250 or 1.250", None, None)
    """
    if not _EITHER_COMMA.fullmatch(word):
        return None
    return f"{word!r} may be {word.replace(',', '')} or {word.replace(',', '.')}"


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


class Texts:
    """Texts on their way into a file, and what of them the format has no letters or no room for.

    Parameters
    ----------
    encoding : str
        What the format is written in.
    letters : str
        How people call its letters.
    length : int
        Characters that a text may have.
    """

    def __init__(self, encoding: str, letters: str, length: int) -> None:
        self.encoding, self.letters, self.length = encoding, letters, length
        self.changed: list[str] = []

    def own(self, text: str) -> str:
        """A text of étendue's own, which loses nothing that anybody else wrote."""
        return self._encodable(text)[0][: self.length].strip()

    def of(self, field: str, text: object) -> str:
        """A text of the user or of a file, as a line of the written one has it: printable letters of the encoding."""
        whole, lost = self._encodable(str(text).strip())
        said = [f"{letter!r} became {there!r}" for letter, there in [*lost.items()][:MOST_LETTERS]]
        said += ["…"] if len(lost) > MOST_LETTERS else []
        said += [f"cut to {self.length} of {len(whole)} characters"] if len(whole) > self.length else []
        if said:
            self.changed.append(f"{field} ({', '.join(said)})")
        return whole[: self.length].strip()

    def losses(self) -> Iterator[str]:
        """One sentence that names every field that changed; none if none did."""
        if self.changed:
            yield f"texts changed, since the format has {self.letters} letters only: {'; '.join(self.changed)}"

    def _encodable(self, text: str) -> tuple[str, dict[str, str]]:
        """The text in letters of the encoding, and which ones became others: without accents, or else a question mark."""
        written, lost = "", {}
        for letter in unicodedata.normalize("NFC", text):
            there = letter if letter.isprintable() else " "
            if not (letter.isprintable() or letter.isspace()):
                lost[letter] = there
            elif not self._has(there):
                there = SPELT_OUT.get(letter, "")
                if not there:
                    there = lost[letter] = self._alike(letter)
                # 1½ is not 11/2.
                there = f" {there}" if "/" in there and written[-1:].isdigit() else there
            written += there
        return written.strip(), lost

    def _alike(self, letter: str) -> str:
        """The letters of the encoding that are most like one that it does not have."""
        parts = unicodedata.normalize("NFKD", letter).replace("\N{FRACTION SLASH}", "/")
        return "".join(part if self._has(part) else "?" for part in parts if not unicodedata.combining(part))

    def _has(self, letter: str) -> bool:
        try:
            letter.encode(self.encoding)
        except UnicodeEncodeError:
            return False
        return True


def keywords_lost(keywords: Iterable[str], why: str) -> Iterator[str]:
    """One sentence about keywords of an IES file that a writer leaves out; none if it leaves out none."""
    names = [f"[{keyword}]" if keyword else "lines without a keyword" for keyword in dict.fromkeys(keywords)]
    if names:
        yield f"keywords of the IES file {why} are not kept: {', '.join(names)}"


def turned_extents(facts: Mapping[str, Any], *, housing: bool) -> Iterator[str]:
    """One sentence if what is written, the luminous opening or a housing too, stands turned, which no format can state."""
    turn = float(facts.get("extents_turned", 0.0))
    opening = has_corners(facts, "opening")
    if turn and (opening or (housing and has_corners(facts, "housing"))):
        size = " × ".join(f"{facts.get(f'opening_{axis}', 0.0):g}" for axis in "xyz")
        what = f"the luminous opening ({facts.get('opening_shape')}, {size} mm)" if opening else "the luminaire"
        found = f"{what} stands turned by {turn:.9g}° from the planes C, which the format cannot state"
        yield f"{found}; it was written as if it stood along them"


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
