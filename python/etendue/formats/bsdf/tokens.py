"""Words of a text file one after the other, each with its line: for formats whose lists run over lines."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Never

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.encodings import decoded
from etendue.formats.rays.text_rows import number, whole

Array = npt.NDArray[np.float64]

LARGEST = 1 << 28
"""Most bytes of a text file with a BSDF."""

ODD = re.compile(r"[^0-9eE+. -]")

ADVICE = "The file is damaged or cut short; ask for it again."

UNENDED = "If it is whole, end it; if not, ask for the file again."
"""What to do about a last line without an end."""


def text_of(path: Path) -> str:
    """The text of a file.

    Raises
    ------
    FormatError
        If it is larger than 256 MiB or in no known encoding.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "No table of a BSDF is so large.")
    return decoded(path, data)


def ended_lines(path: Path) -> list[str]:
    """The lines of a file that would not show otherwise that it was cut.

    Raises
    ------
    FormatError
        As `text_of`, and if the last line has no end.
    """
    text = text_of(path)
    lines = text.splitlines()
    if not text.endswith(("\n", "\r")):
        raise FormatError(path, f"line {len(lines)}", "the last line has no end", UNENDED)
    return lines


class Tokens:
    """The words of a file; what follows ``#`` is left out.

    Parameters
    ----------
    path : Path
        The file; it is read at once.

    Raises
    ------
    FormatError
        If it is larger than 256 MiB or in no known encoding.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.words: list[str] = []
        self.lines: list[int] = []
        for at, line in enumerate(text_of(path).splitlines(), 1):
            found = line.partition("#")[0].split()
            self.words += found
            self.lines += [at] * len(found)
        self.at = 0

    def refuse(self, found: str, advice: str = ADVICE) -> Never:
        """Refuse the file for what stands at the word that was read last."""
        place = f"line {self.lines[min(self.at, len(self.lines)) - 1]}" if self.at else "first line"
        raise FormatError(self.path, place, found, advice)

    @property
    def left(self) -> int:
        """Words that are still to come."""
        return len(self.words) - self.at

    def word(self, what: str) -> str:
        """The next word."""
        if not self.left:
            self.at = len(self.words)
            self.refuse(f"the file ends where {what} should stand")
        self.at += 1
        return self.words[self.at - 1]

    def peek(self) -> str:
        """The next word, which stays the next one; empty at the end."""
        return self.words[self.at] if self.left else ""

    def expect(self, keyword: str) -> None:
        """A keyword, in capitals or not."""
        found = self.word(keyword)
        if found.casefold() != keyword.casefold():
            self.refuse(f"{found[:40]!r} stands where {keyword} should")

    def choice(self, what: str, known: tuple[str, ...]) -> str:
        """One of some words, in capitals or not; as it stands among them."""
        found = self.word(what)
        meant = next((one for one in known if found.casefold() == one.casefold()), None)
        return meant or self.refuse(f"{what} is {found[:40]!r}, not one of {', '.join(known)}")

    def number(self, what: str) -> float:
        """A finite number."""
        found = self.word(what)
        try:
            value = number(found)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            self.refuse(f"{what} is {found[:40]!r}, no finite number")
        return value

    def count(self, what: str) -> int:
        """A whole number from 1 to that of the words that are left."""
        found = self.word(what)
        value = whole(found)
        if value is None or not 1 <= value <= self.left:
            self.refuse(f"{what} is {found[:40]!r}; {self.left} words follow")
        return value

    def numbers(self, what: str, count: int) -> Array:
        """So many finite numbers."""
        if self.left < count:
            self.at = len(self.words)
            self.refuse(f"the file ends within {what}")
        words = self.words[self.at : self.at + count]
        # Tables are long: all at once, if they are made of nothing but digits, signs, points and exponents.
        if not ODD.search(" ".join(words)):
            try:
                values = np.array([float(word) for word in words])
            except ValueError:
                values = np.array([np.nan])
            if np.isfinite(values).all():
                self.at += count
                return values
        return np.array([self.number(what) for _ in range(count)])

    def rising(self, what: str) -> Array:
        """A count, and as many rising numbers."""
        values = self.numbers(what, self.count(f"number of {what}"))
        if (np.diff(values) <= 0.0).any():
            self.refuse(f"{what} do not rise")
        return values
