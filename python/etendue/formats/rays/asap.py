"""ASAP binary ray files (``.dis``): five header records, then LENR 32-bit columns per ray.

The layout is that of direct-access Fortran files, from the manual of TechnoTeam's Converter 801, §5.1.1. With the usual
LENR of 7 a header record has 28 bytes; for longer rays it has either 28 or 4 · LENR, which the file's size decides. All
values are little-endian.
"""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat, stored_records
from etendue.formats.rays.shared import (
    RayColour,
    losses,
    read_bytes,
    stated_total,
    text,
    whole_records,
    write_records,
)
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT, FluxUnit

CLAUSE = "Converter 801 manual 5.1.1"

KEY, KEY_STEP = 247, 1024
"""The first integer is 247 + 1024 · LENR."""

COLUMNS = range(7, 13)
"""Columns per ray that occur."""

MAX_RAYS = 2**31 - 1
"""Largest number of rays that the header's signed 32-bit number can say."""

RECORDS = 5
SHORT_RECORD = 28
LENGTH_UNITS = {
    "M": "m",
    "CM": "cm",
    "MM": "mm",
    "UM": "um",
    "INCH": "inch",
    "IN": "inch",
    "FEET": "feet",
    "FT": "feet",
}
"""The header's words for length units."""

FLUX_UNITS: dict[str, FluxUnit] = {"W": "W", "LM": "lm"}
"""The third word of the label of values; ``_`` or nothing is the lumen."""


@dataclasses.dataclass(frozen=True)
class _Header:
    """The fields of the five header records, which are `stride` bytes apart."""

    stride: int
    title: str
    total: float | None
    words: tuple[str, ...]
    first: float
    last: float
    number: int

    @classmethod
    def parse(cls, data: bytes, stride: int) -> _Header:
        title = text(data[stride : stride + 24])
        values, rays = 2 * stride, 3 * stride
        words = tuple(text(data[values + 12 : values + 28]).upper().split())
        first, last, number = struct.unpack_from("<2fi", data, rays + 16)
        return cls(stride, title, stated_total(data[values + 8 : values + 12]), words, first, last, number)

    @property
    def count(self) -> int:
        """Rays; the file stores the number with a minus sign."""
        return abs(self.number)

    @property
    def is_plausible(self) -> bool:
        """Whether the largest ray number, a 32-bit float, agrees with the number of rays."""
        return self.number != 0 and bool(np.isclose(self.last, self.count, rtol=1e-6, atol=0.5))

    @property
    def start(self) -> int:
        """First byte of the rays."""
        return RECORDS * self.stride

    @property
    def columns(self) -> str:
        """The letters of the columns."""
        return self.words[0] if self.words else ""


def _columns_per_ray(data: bytes) -> int | None:
    """LENR from the first four bytes, or None."""
    columns, rest = divmod(int.from_bytes(data[:4], "little", signed=True) - KEY, KEY_STEP)
    return columns if rest == 0 and columns in COLUMNS else None


def recognise(head: Head) -> bool:
    """By the key in the first integer, and a printable title."""
    columns = _columns_per_ray(head.data)
    if columns is None or len(head.data) < SHORT_RECORD * RECORDS:
        return False
    titles = (head.data[stride : stride + 24] for stride in (SHORT_RECORD, 4 * columns))
    return any(all(byte == 0 or 32 <= byte < 127 for byte in title) for title in titles)


def read(path: Path) -> RaySet:
    """Map an ASAP binary ray file. The rays' flux is absolute; the header's total is reported.

    Raises
    ------
    FormatError
        If the header contradicts itself or the file's size, or the length unit is unknown.
    """
    columns = _columns_per_ray(read_bytes(path, 0, 4, "header"))
    if columns is None:
        raise FormatError(path, "byte 0", "no ASAP key 247 + 1024 · columns", f"Is it an ASAP file? [{CLAUSE}]")
    header = _header(path, columns)
    rays, tail = whole_records(path, header.start, 4 * columns, header.count, CLAUSE)
    offsets, complaints = _offsets(path, header, columns)
    word = header.words[1] if len(header.words) > 1 else ""
    place = f"byte {2 * header.stride + 12}"
    if word and word != "_" and word not in LENGTH_UNITS:
        raise FormatError(path, place, f"length unit {word!r} is unknown", f"Known: {', '.join(LENGTH_UNITS)}.")
    if word not in LENGTH_UNITS:
        found = "no length unit; taken as mm (in Python, RaySet.scaled changes it)"
        complaints.append(Complaint("warning", place, found, CLAUSE))
    if header.number > 0:
        found = f"the number of rays is stored as {header.number}, not with a minus sign"
        complaints.append(Complaint("warning", f"byte {3 * header.stride + 24}", found, CLAUSE))
    unit = LENGTH_UNITS.get(word, "mm")
    facts: dict[str, Any] = {"title": header.title, "length_unit": unit, "label": " ".join(header.words)}
    if header.total is not None:
        facts["total_flux"] = header.total
    dtype = np.dtype({
        "names": ["position", "direction", "flux"],
        "formats": [("<f4", 3), ("<f4", 3), "<f4"],
        "offsets": offsets,
        "itemsize": 4 * columns,
    })  # fmt: skip
    meaning = RaySetMeaning(
        flux_unit=FLUX_UNITS.get(header.words[2] if len(header.words) > 2 else "", "lm"),
        length_scale=MM_PER_LENGTH_UNIT[unit],
        header=facts,
        complaints=(*complaints, *tail),
        provenance=file_provenance(path, "asap"),
    )
    return RaySet.from_records(stored_records(path, dtype, header.start, rays), meaning)


def _header(path: Path, columns: int) -> _Header:
    """The header whose stride makes sense: the one that fits the file's size, or else the only plausible one."""
    size = path.stat().st_size
    strides = dict.fromkeys((SHORT_RECORD, 4 * columns))
    possible = [_Header.parse(read_bytes(path, 0, RECORDS * s, "header"), s) for s in strides if RECORDS * s <= size]
    fitting = [h for h in possible if h.start + h.count * 4 * columns == size]
    chosen = fitting or [h for h in possible if h.is_plausible]
    if len(chosen) != 1:
        found = f"no header of {columns} columns per ray fits the file of {size:,} bytes"
        raise FormatError(path, "byte 84", found, f"The file is truncated or of an unknown variant. [{CLAUSE}]")
    return chosen[0]


def _offsets(path: Path, header: _Header, columns: int) -> tuple[list[int], list[Complaint]]:
    """Byte offsets of position, direction and flux, from the letters of the columns."""
    letters, place = header.columns, f"byte {2 * header.stride + 12}"
    starts = [letters.find(group) for group in ("XYZ", "ABC", "F")]
    if min(starts) < 0:
        found = f"the columns are labelled {letters!r}, which does not name XYZ, ABC and F; read in this order"
        return [0, 12, 24], [Complaint("warning", place, found, CLAUSE)]
    if max(start + width for start, width in zip(starts, (3, 3, 1), strict=True)) > columns:
        raise FormatError(path, place, f"{columns} columns are labelled {letters!r}", "Ask for the file again.")
    complaints = []
    if columns > 7:
        found = f"{columns - 7} columns beside XYZ, ABC and F are ignored (label {letters!r})"
        complaints.append(Complaint("warning", place, found, CLAUSE))
    return [4 * start for start in starts], complaints


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write an ASAP binary ray file with seven columns, in millimetres."""
    dtype = np.dtype([("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")])
    with path.open("wb") as file:
        file.write(bytes(RECORDS * SHORT_RECORD))
        written = write_records(file, rays, dtype)
        file.seek(0)
        file.write(_header_bytes(rays, written.rays, written.totals["flux"]))
    notes = list(losses(rays, written, RayColour.of(rays), colour_kept=False))
    if rays.flux_unit == "W":
        notes.append("ASAP's header has no agreed place for the unit of flux; this file says W after the length unit.")
    return tuple(notes)


def _header_bytes(rays: RayStream, count: int, total: float) -> bytes:
    title = rays.provenance.source.encode("ascii", "replace")
    label = b"XYZABCF MM " + (b"W" if rays.flux_unit == "W" else b"_")
    return b"".join((
        struct.pack("<i24x", KEY + KEY_STEP * 7),
        struct.pack("<24si", title[:24].ljust(24), 1),
        struct.pack("<8sf16s", b"Tot Flux", total, label.ljust(16)),
        struct.pack("<16s2fi", b"Ray number".ljust(16), 1.0, count, -count),
        struct.pack("<16s2fi", b"Wavelength".ljust(16), 0.0, 0.0, 1),
    ))  # fmt: skip


FORMAT = RayFormat("asap", "ASAP binary ray file", (".dis",), recognise, read, write, most_rays=MAX_RAYS)
"""ASAP binary ray files."""
