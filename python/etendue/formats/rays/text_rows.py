"""Rows of numbers in text ray files, parsed in blocks of some megabytes, so that a file of any size needs no memory.

Each block goes through numpy's compiled parser. A block that it refuses is parsed again line by line, which either
understands what is unusual in it (Fortran exponents, the not-a-numbers of Microsoft's library, comments, the end of the
data) or says in which line what is wrong.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.head import Head
from etendue.formats.input import shortened
from etendue.quantities.report import Complaint, Severity
from etendue.quantities.spool import spool

FloatArray = npt.NDArray[np.float64]

BLOCK = 4 << 20
"""Bytes parsed at a time."""

LONGEST_LINE = 1 << 16
"""Bytes; a longer line is no row of a ray file, and looking for its end must not fill the memory."""

TAIL = 1 << 16
"""Bytes at the end of a file within which text that follows the rows is looked at."""

BYTE_ORDER_MARK = b"\xef\xbb\xbf"

_FORTRAN_EXPONENT = bytes.maketrans(b"dD", b"eE")
_MICROSOFT = re.compile(r"([+-]?)\d\.#(\w*)|[+-]?nan\(\w*\)", re.IGNORECASE)
_DIGITS = re.compile(r"[0-9]{1,18}")
_NO_EXPONENT_LETTER = re.compile(r"([+-]?\d*\.?\d*)([+-]\d{3})")


@dataclasses.dataclass(frozen=True)
class TextLine:
    """A line of a file's beginning.

    Parameters
    ----------
    number : int
        From 1.
    text : str
        Without surrounding white space.
    start, end : int
        Byte offsets of its first character and of the following line.
    """

    number: int
    text: str
    start: int
    end: int


@dataclasses.dataclass(frozen=True)
class RowLayout:
    """How the rows of a file are written, and what their numbers mean.

    Parameters
    ----------
    fields : mapping
        Indices of the columns of each record field: ``{"position": (0, 1, 2), "flux": (6,), …}``. Other columns are
        not read, whatever they hold.
    columns : int
        Entries per row.
    clause : str
        For complaints.
    separator : str or None
        Between the entries; None: white space.
    decimal_comma : bool
        Whether numbers are written ``0,5``.
    comments : tuple of str
        What lines to be skipped begin with.
    end : str or None
        What the line after the last row begins with, in lower case.
    expected : int or None
        Number of rows that the header states.
    stated_at : str
        Where it states it, for complaints.
    """

    fields: Mapping[str, tuple[int, ...]]
    columns: int
    clause: str
    separator: str | None = None
    decimal_comma: bool = False
    comments: tuple[str, ...] = ()
    end: str | None = None
    expected: int | None = None
    stated_at: str = "header"

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the records: all fields f8, in the order of `fields`."""
        return np.dtype([(n, "<f8", (len(c),)) if len(c) > 1 else (n, "<f8") for n, c in self.fields.items()])

    @functools.cached_property
    def used(self) -> list[int]:
        """Columns in the order of the records."""
        return [column for columns in self.fields.values() for column in columns]

    def split(self, text: str) -> list[str]:
        """The entries of a line."""
        return [entry.strip() for entry in text.split(self.separator)]

    def number(self, entry: str) -> float:
        """The number that an entry states; ValueError if none."""
        return number(entry.replace(",", ".") if self.decimal_comma else entry)

    def records(self, values: FloatArray) -> npt.NDArray[Any]:
        """Records from rows, shape (n, `columns`); a view of them if all columns are used in order."""
        if self.used != list(range(self.columns)):
            values = values[:, self.used]
        return np.ascontiguousarray(values).view(self.dtype).reshape(-1)


@dataclasses.dataclass(frozen=True)
class Rows:
    """The rows of a file.

    Parameters
    ----------
    records : structured array
        As `RowLayout.dtype` says, in memory or in a temporary file.
    complaints : tuple of Complaint
    """

    records: npt.NDArray[Any]
    complaints: tuple[Complaint, ...]


def head_lines(head: Head) -> list[TextLine]:
    r"""The whole lines of a file's beginning, decoded as Latin-1 without a byte-order mark.

    Lines end with LF (with any CR around it, which is white space), or with CR alone if there is no LF.

    Examples
    --------
    >>> [line.text for line in head_lines(Head(Path("x"), 9, b"2 4\r\n1 2\n\r"))]
    ['2 4', '1 2', '']
    """
    start = len(BYTE_ORDER_MARK) if head.data.startswith(BYTE_ORDER_MARK) else 0
    end_of_line = _end_of_line(head.data)
    lines: list[TextLine] = []
    for number, raw in enumerate(head.data[start:].split(end_of_line), 1):
        end = start + len(raw) + len(end_of_line)
        if end > len(head.data):
            if head.size > len(head.data):
                break  # the head ends within this line, not the file
            end = len(head.data)
        lines.append(TextLine(number, raw.decode("latin-1").strip(), start, end))
        start = end
    return lines


def _end_of_line(data: bytes) -> bytes:
    return b"\n" if b"\n" in data else b"\r"


def whole(entry: str) -> int | None:
    """The count that an entry states in plain digits; None if it states none, or one beyond any file.

    Examples
    --------
    >>> whole("1000"), whole("1e3"), whole("9" * 6000)
    (1000, None, None)
    """
    return int(entry) if _DIGITS.fullmatch(entry) else None


def number(entry: str) -> float:
    """The number that an entry states.

    Beside what Python takes for one: Fortran's ``1.0D-03`` and ``0.1-102``, and what programs made with Microsoft's
    library print for infinite and undefined values.

    Raises
    ------
    ValueError
        If it states none.

    Examples
    --------
    >>> number("7.24e-016"), number("-1.5D+01"), number("1.#INF"), number('"2"')
    (7.24e-16, -15.0, inf, 2.0)
    """
    if "_" in entry:  # Python's own digit grouping, which no ray file uses
        raise ValueError(entry)
    try:
        return float(entry)
    except ValueError:
        entry = entry.strip('"')
    try:
        return float(entry)
    except ValueError:
        pass
    if match := _MICROSOFT.fullmatch(entry):
        infinite = (match[2] or "").upper().startswith("INF")
        return float(f"{match[1]}inf") if infinite else float("nan")
    if match := _NO_EXPONENT_LETTER.fullmatch(entry):
        return float(f"{match[1]}e{match[2]}")
    return float(entry.translate({ord("d"): "e", ord("D"): "E"}))


def numbers(entries: list[str]) -> list[float] | None:
    """The numbers that all entries state, or None if there are no entries or one states none."""
    try:
        return [number(entry) for entry in entries] or None
    except ValueError:
        return None


def read_rows(path: Path, layout: RowLayout, *, offset: int, line: int) -> Rows:
    """Read all rows of a file.

    A last row that is cut off is left out with a complaint of severity ``error``; so are missing rows if the header
    states their number. Text after the last row is ignored with a warning.

    Parameters
    ----------
    path : Path
        Of the file.
    layout : RowLayout
        How its rows are written.
    offset, line : int
        Byte and line number at which the rows begin.

    Raises
    ------
    FormatError
        With the line, if a row has another number of entries or one that is no number, or if there are no rows.
    """
    reader = _RowReader(path, layout, offset, line)
    records = spool(reader.parts(), layout.dtype)
    if len(records) == 0:
        raise FormatError(path, f"line {line}", "no ray follows", "The file is empty or truncated; ask for it again.")
    return Rows(records, (*reader.complaints, *reader.count_complaints()))


class _RowReader:
    """One pass over the rows of a file."""

    def __init__(self, path: Path, layout: RowLayout, offset: int, line: int) -> None:
        self.path, self.layout, self.offset = path, layout, offset
        self.line = line
        self.rows = 0
        self.complaints: list[Complaint] = []
        self.done = False
        self.ended = False
        self.end_of_line = _end_of_line(Head.of(path).data)

    def parts(self) -> Iterator[npt.NDArray[Any]]:
        with self.path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            file.seek(self.offset)
            rest = b""
            # The size at the beginning counts, whatever is appended meanwhile.
            while (left := size - file.tell()) > 0:
                data = file.read(min(BLOCK, left))
                if not data:
                    raise shortened(self.path, file.tell(), size)
                cut = data.rfind(self.end_of_line) + 1
                block, rest = (rest + data[:cut], data[cut:]) if cut else (b"", rest + data)
                if block:
                    yield self.layout.records(self._whole_lines(block, rest, file))
                if self.done:
                    return
                if len(rest) > LONGEST_LINE:
                    self._refuse(f"no end within {LONGEST_LINE:,} bytes; this is no row of numbers")
            if rest.strip(b"\x1a \t\r\x0b\x0c"):
                yield self.layout.records(self._last_line(rest))

    def _nothing(self) -> FloatArray:
        return np.zeros((0, self.layout.columns))

    # --- whole lines -------------------------------------------------------------------------------------------------

    def _whole_lines(self, block: bytes, rest: bytes, file: BinaryIO) -> FloatArray:
        values = self._compiled(block)
        if values is None:
            values = self._line_by_line(block, rest, file)
        else:
            self.rows += len(values)
        if not self.done:
            self.line += block.count(self.end_of_line)
        return values

    def _compiled(self, block: bytes) -> FloatArray | None:
        """All rows of a block, or None if it holds anything but rows of numbers."""
        if block.isspace():
            return self._nothing()
        if b"\r" in block:
            block = block.replace(b"\r", b" " if self.end_of_line == b"\n" else b"\n")
        if self.layout.decimal_comma:
            if b"." in block:
                return None
            block = block.replace(b",", b".")
        if b"D" in block or b"d" in block:
            block = block.translate(_FORTRAN_EXPONENT)
        try:
            values = np.loadtxt(
                io.BytesIO(block), comments=None, delimiter=self.layout.separator, ndmin=2, encoding="latin-1"
            )
        except ValueError:
            return None
        return values if values.shape[1] == self.layout.columns else None

    def _line_by_line(self, block: bytes, rest: bytes, file: BinaryIO) -> FloatArray:
        rows: list[list[float]] = []
        lines = block.split(self.end_of_line)
        for index, raw in enumerate(lines):
            text = raw.decode("latin-1").strip()
            if not text or text.startswith(self.layout.comments):
                continue
            row = self._row(text)
            if isinstance(row, str):
                self.done = True
                self.line += index
                following = self.end_of_line.join(lines[index + 1 :]) + rest + file.read(TAIL + 1)
                self._judge_tail(text, row, following)
                break
            rows.append(row)
            self.rows += 1
        return np.array(rows, dtype=np.float64).reshape(-1, self.layout.columns)

    def _row(self, text: str) -> list[float] | str:
        """The numbers of a line, NaN in columns that are not read; or what is wrong with it."""
        layout = self.layout
        entries = layout.split(text)
        if len(entries) != layout.columns:
            return f"{len(entries)} entries where {layout.columns} are expected: {_shortened(text)}"
        if layout.decimal_comma and any("." in entries[column] for column in layout.used):
            return f"both decimal points and decimal commas in the file: {_shortened(text)}"
        row = [float("nan")] * layout.columns
        for column in layout.used:
            try:
                row[column] = layout.number(entries[column])
            except ValueError:
                return f"{_shortened(entries[column])} is not a number"
        return row

    # --- the end of the file -----------------------------------------------------------------------------------------

    def _judge_tail(self, text: str, problem: str, following: bytes) -> None:
        """Take a line that is no row for the end of the data, if that is certain; refuse the file otherwise."""
        if self._is_end(text):
            self.ended = True
            if following.strip(b"\x1a\0 \t\r\n"):
                self._complain("note", f"more follows after {text!r}; it is ignored")
            return
        entries = self.layout.split(text)
        complete = self.layout.expected is not None and self.rows >= self.layout.expected
        is_text = len(entries) != self.layout.columns and not self._are_numbers(entries[:1])
        if not complete and not (self.rows and is_text and self._holds_no_row(following)):
            self._refuse(problem)
        self._complain("warning", f"after the last row there is {_shortened(text)}; it and what follows is ignored")

    def _is_end(self, text: str) -> bool:
        return self.layout.end is not None and text.lower().startswith(self.layout.end)

    def _holds_no_row(self, data: bytes) -> bool:
        """Whether no row is among the rest of a file; False too if there is too much of it to look at."""
        lines = (raw.decode("latin-1").strip() for raw in data.split(self.end_of_line))
        return len(data) <= TAIL and all(isinstance(self._row(line), str) for line in lines if line)

    def _are_numbers(self, entries: list[str]) -> bool:
        try:
            for entry in entries:
                self.layout.number(entry)
        except ValueError:
            return False
        return True

    def _last_line(self, raw: bytes) -> FloatArray:
        """The row of a last line without line end, unless it is cut off or may be."""
        layout = self.layout
        text = raw.decode("latin-1").strip("\x1a \t\r\x0b\x0c")
        if text.startswith(layout.comments):
            return self._nothing()
        row = self._row(text)
        # A line end of CR LF may have lost its LF only; DOS editors end a file with the character 26.
        whole = raw.endswith((b"\r", b"\x1a"))
        if isinstance(row, str):
            if whole or self._is_end(text) or not self._is_beginning_of_row(text):
                self._judge_tail(text, row, b"")
            else:
                self._complain("error", f"the file ends within a row, which is left out: {_shortened(text)}")
            return self._nothing()
        rows_are_missing = layout.end is not None or (layout.expected is not None and self.rows + 1 < layout.expected)
        if not whole and rows_are_missing:
            found = f"the file ends in a row whose last number may be cut; it is left out: {_shortened(text)}"
            self._complain("error", found)
            return self._nothing()
        if not whole:
            self._complain("warning", "the file does not end with a line end; its last number may be cut")
        self.rows += 1
        return np.array([row])

    def _is_beginning_of_row(self, text: str) -> bool:
        entries = self.layout.split(text)
        before = [entries[column] for column in self.layout.used if column < len(entries) - 1]
        return len(entries) <= self.layout.columns and self._are_numbers(before)

    def count_complaints(self) -> Iterator[Complaint]:
        """What is to be said of the number of rows once all are read."""
        layout = self.layout
        if layout.end is not None and not self.ended:
            found = f"the file ends without {layout.end!r} after {self.rows:,} rays; it is truncated"
            yield Complaint("error", f"line {self.line}", found, layout.clause)
        if layout.expected is None or layout.expected == self.rows:
            return
        missing = layout.expected - self.rows
        severity: Severity = "error" if missing > 0 else "warning"
        rest = f"{missing:,} are missing" if missing > 0 else "all of them are read"
        found = f"{layout.expected:,} rays are stated, {self.rows:,} rows follow; {rest}"
        yield Complaint(severity, layout.stated_at, found, layout.clause)

    def _complain(self, severity: Severity, found: str) -> None:
        self.complaints.append(Complaint(severity, f"line {self.line}", found, self.layout.clause))

    def _refuse(self, problem: str) -> None:
        raise FormatError(
            self.path, f"line {self.line}", problem,
            f"Every row must have {self.layout.columns} entries. Ask for the file again, or correct the line. "
            f"[{self.layout.clause}]",
        )  # fmt: skip


def _shortened(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}…")
