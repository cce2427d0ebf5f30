"""Scans of the goniometer RT-300S: workbooks of Excel (.xls) with a column for each position of the detector."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.extras import require
from etendue.formats.head import WORKBOOK_SIGNATURE
from etendue.formats.input import as_path

Array = npt.NDArray[np.float64]

ROWS = ("Azimuth", "Incidence", "Receive", "RT")
"""Of each sheet: three angles [°], and the signal, π f |cos θ| of the laser diode."""

LARGEST = 1 << 26


def is_rt300s(path: Path) -> bool:
    """Whether a file is a workbook of that kind, by its first bytes."""
    with as_path(path).open("rb") as file:
        return file.read(len(WORKBOOK_SIGNATURE)) == WORKBOOK_SIGNATURE


def read_rt300s(path: Path) -> dict[str, Array]:
    """Azimuth, incidence, receive [°] and signal of every position, by the lower-case names of `ROWS`.

    Raises
    ------
    FormatError
        If the workbook is damaged, or a sheet with positions lacks one of the rows.
    MissingLibraryError
        If xlrd is not installed.
    """
    path = as_path(path)
    xlrd = require("xlrd")
    data = path.read_bytes()
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 64 MiB", "No scan is so large.")
    try:
        # What the library has to say of encodings goes nowhere: standard output holds results alone.
        book = xlrd.open_workbook(file_contents=data, logfile=io.StringIO(), verbosity=0)
        sheets = [(sheet.name, [sheet.row_values(row) for row in range(sheet.nrows)]) for sheet in book.sheets()]
    except Exception as error:  # noqa: BLE001 - the library stumbles over damage in ways of its own
        raise FormatError(path, "workbook", f"damaged ({type(error).__name__})", "Export the scan again.") from None
    found: dict[str, list[float]] = {name.lower(): [] for name in ROWS}
    for name, rows in sheets:
        if not rows:
            continue
        by_label = {str(row[0]).strip(): row[1:] for row in rows if row}
        missing = [label for label in ROWS if label not in by_label]
        if missing:
            raise FormatError(path, f"sheet {name}", f"no row {missing[0]!r}", f"Each sheet has {', '.join(ROWS)}.")
        for column, values in enumerate(zip(*(by_label[label] for label in ROWS), strict=False), 2):
            if all(value == "" for value in values):
                continue
            if not all(isinstance(value, float) and np.isfinite(value) for value in values):
                raise FormatError(path, f"sheet {name}, column {column}", "no number", "Mend the cell.")
            for label, value in zip(ROWS, values, strict=True):
                found[label.lower()].append(value)
    if not found["rt"]:
        raise FormatError(path, "workbook", "no positions", "Export the scan again.")
    return {label: np.array(values) for label, values in found.items()}
