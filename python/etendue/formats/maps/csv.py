"""Comma-separated text: the exact map, for spreadsheets and for eyes."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etendue.errors import FormatError
from etendue.formats.maps.header import FOREIGN, MOST_HEADER_BYTES, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, parsing
from etendue.formats.own_kind import ILLUMINANCE_TITLE, MAP_TITLE
from etendue.units import ILLUMINANCE_NAME

TITLES = (MAP_TITLE.encode("ascii"), ILLUMINANCE_TITLE.encode("ascii"))
COLUMNS = {
    "row": np.int64,
    "column": np.int64,
    "x_mm": np.float64,
    "y_mm": np.float64,
    "value": np.float64,
    "standard_error": np.float64,
    "rays": np.int64,
}


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write a title, the JSON header behind ``#``, the column names and one line per pixel; nothing is lost.

    Numbers have as many digits as it takes to read the same float64 back; ``nan`` stands for a dead pixel.
    """
    with path.open("w", encoding="ascii", newline="\n") as stream:
        title = ILLUMINANCE_TITLE if lmap.quantity in ILLUMINANCE_NAME.values() else MAP_TITLE
        stream.write(f"{title}\n# {header_text(lmap)}\n{','.join(COLUMNS)}\n")
        stream.writelines(_rows(lmap))
    return ()


def _rows(lmap: AnyMap) -> Iterator[str]:
    """The lines of one row of pixels at a time."""
    x = lmap.screen.x.tolist()
    for row, y in enumerate(lmap.screen.y.tolist()):
        pixels = zip(x, *(array[row].tolist() for array in (lmap.values, lmap.standard_error, lmap.rays)), strict=True)
        yield "".join(
            f"{row},{column},{x_mm!r},{y!r},{value!r},{error!r},{rays}\n"
            for column, (x_mm, value, error, rays) in enumerate(pixels)
        )


def read(path: Path) -> AnyMap:
    """Read what `write` wrote; line ends may have become those of another system, old or new."""
    with path.open("rb") as stream:
        head = stream.read(MOST_HEADER_BYTES).removeprefix(BOM_UTF8)
        end = b"\n" if b"\n" in head else b"\r"
        top = [line.rstrip(b"\r") for line in head.split(end, 3)[:3]]
        stream.seek(0)
        lines, ended = _count_lines(stream, end)
    if len(top) < 3:
        raise FormatError(path, "lines 1 to 3", f"no end of them within {len(head):,} bytes", DAMAGED)
    if top[0] not in TITLES or not top[1].startswith(b"# "):
        raise FormatError(path, "lines 1 and 2", "not the title and header of an étendue map", FOREIGN)
    if top[2] != ",".join(COLUMNS).encode("ascii"):
        raise FormatError(path, "line 3", f"found {top[2][:80]!r}", f"It must be {','.join(COLUMNS)!r}.")
    header = MapHeader.parse(path, "line 2", top[1][2:].decode("ascii", errors="replace"))
    if lines - 3 != header.pixels or not ended:
        found = f"{lines - 3} whole lines of pixels, {header.pixels} expected" + (
            "" if ended else ", and a line cut short"
        )
        raise FormatError(path, "pixels", found, DAMAGED)
    with parsing(path, "pixels"), path.open(encoding="utf-8") as stream:
        table = np.loadtxt(stream, dtype=list(COLUMNS.items()), delimiter=",", comments=None, skiprows=3, ndmin=1)
    row, column = np.divmod(np.arange(header.pixels), header.columns)
    if len(table) != header.pixels or (table["row"] != row).any() or (table["column"] != column).any():
        raise FormatError(path, "pixels", "rows and columns do not count up", "Restore the order they were written in.")
    value, error, rays = (table[name].reshape(header.shape) for name in ("value", "standard_error", "rays"))
    return header.restore(value, error, rays)


def _count_lines(stream: BinaryIO, end: bytes) -> tuple[int, bool]:
    """Number of line ends from here on, and whether the file stops with one."""
    lines, last = 0, end
    while block := stream.read(1 << 20):
        lines += block.count(end)
        last = block[-1:]
    return lines, last == end


FORMAT = MapFormat("csv", (".csv",), lambda head: head.removeprefix(BOM_UTF8).startswith(TITLES), read, write)
