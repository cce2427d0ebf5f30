"""Goniometer scans as CSV: directions with values of the BSDF, or the angles of the stages with fluxes."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.encodings import decoded
from etendue.formats.input import as_path
from etendue.formats.own_kind import STANDARD_ERROR
from etendue.formats.rays.text_rows import number

Array = npt.NDArray[np.float64]

ERROR = STANDARD_ERROR
LARGEST = 1 << 28
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


def read_columns(path: Path, layouts: Sequence[tuple[str, ...]]) -> dict[str, Array]:
    """The columns of a CSV file with a line of names; lines that begin with ``#`` are left out.

    Parameters
    ----------
    path : Path
        Separated by commas, semicolons or tabs.
    layouts : sequence of tuple of str
        Names of columns, any one of which sets must be there; ``standard_error`` may be.

    Raises
    ------
    FormatError
        If names are missing or not known, or a field is no finite number.
    """
    path = as_path(path)
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "No scan is so large.")
    _require_text(path, data)
    lines = [(at, line) for at, line in enumerate(decoded(path, data).splitlines(), 1) if line.strip()]
    lines = [(at, line) for at, line in lines if not line.lstrip().startswith("#")]
    wanted = " or ".join(",".join(layout) for layout in layouts)
    if not lines:
        raise FormatError(path, "first line", "the file is empty", f"Its first line names columns: {wanted}.")
    separator = next((s for s in (";", "\t") if s in lines[0][1]), ",")
    names = [name.strip().casefold() for name in lines[0][1].split(separator)]
    layout = next((one for one in layouts if set(one) <= set(names)), None)
    unknown = [name for name in names if layout is not None and name not in (*layout, ERROR)]
    if layout is None or unknown or len(set(names)) < len(names):
        found = f"columns {', '.join(names)[:120]}"
        raise FormatError(path, f"line {lines[0][0]}", found, f"Name them {wanted}, and {ERROR} if it is known.")
    rows = []
    for (at, _), fields in zip(
        lines[1:], csv.reader((line for _, line in lines[1:]), delimiter=separator), strict=True
    ):
        if len(fields) != len(names):
            raise FormatError(
                path, f"line {at}", f"{len(fields)} fields; the columns are {len(names)}", "Mend the line."
            )
        try:
            values = [number(field.strip()) for field in fields]
        except ValueError:
            values = [np.nan]
        if not np.isfinite(values).all():
            raise FormatError(path, f"line {at}", *_no_number(fields))
        rows.append(values)
    if not rows:
        raise FormatError(path, f"line {lines[0][0]}", "no values follow", "Export the scan again.")
    columns = dict(zip(names, np.array(rows).T, strict=True))
    if (columns.get(ERROR, np.zeros(1)) < 0.0).any():
        at = int(np.argmax(columns[ERROR] < 0.0))
        found = f"a standard error of {columns[ERROR][at]:g}"
        raise FormatError(
            path, f"line {lines[at + 1][0]}", found, "Errors are not below 0: state how far off it may be."
        )
    return columns


def _require_text(path: Path, data: bytes) -> None:
    """Refuse what was compressed."""
    kinds = ((b"\x1f\x8b", "compressed by gzip", "gunzip"), (b"PK\x03\x04", "a ZIP archive, or a workbook", "unzip"))
    for start, what, how in kinds:
        if data.startswith(start):
            advice = f"Unpack it first ({how}), or save the sheet as CSV: a scan is read from plain text."
            raise FormatError(path, "first bytes", what, advice)


def _no_number(fields: Sequence[str]) -> tuple[str, str]:
    """What is wrong with a line, and what to do."""
    comma = next((field.strip() for field in fields if DECIMAL_COMMA.fullmatch(field.strip())), None)
    if comma is not None:
        return f"{comma[:40]!r} has a decimal comma", "Write numbers with a point: 0.5, not 0,5."
    return "a field that is no finite number", "Mend the line."


def read_remarks(path: Path) -> dict[str, str]:
    """What a CSV file says in lines ``# name = value``, by name.

    Parameters
    ----------
    path : Path
        A file that `read_columns` has read.
    """
    with as_path(path).open("rb") as file:
        text = decoded(path, file.read(LARGEST))
    parts = [line.lstrip()[1:].partition("=") for line in text.splitlines() if line.lstrip().startswith("#")]
    return {name.strip().casefold(): value.strip() for name, sign, value in parts if sign}
