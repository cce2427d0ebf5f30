"""LightTools binary ray data (``.ray``), magic ``LTRF``: 44 bytes of header, records, and the seven bytes ``LTRFEND``.

The header holds no number of rays: it follows from the file's size. All values are little-endian.
"""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.lighttools_colour import (
    NO_COLOUR,
    TRISTIMULUS,
    TRISTIMULUS_COLUMNS,
    WAVELENGTH,
    colour_losses,
    held_colour,
)
from etendue.formats.rays.ray_format import RayFormat, stored_records
from etendue.formats.rays.shared import (
    RayColour,
    Records,
    own_rows,
    read_bytes,
    stated_total,
    wavelength_complaints,
    write_records,
)
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT, FluxUnit

CLAUSE = "LightTools, Ray Data File, binary format"

MAGIC = b"LTRF"
TRAILER = b"LTRFEND"
HEADER = struct.Struct("<4s6I3ff")
VERSION = 2
POLARISED_VERSION = 3

COLOUR_INFO = (NO_COLOUR, TRISTIMULUS, WAVELENGTH)
"""What a record holds of colour, in the order of the header's numbers."""

LENGTH_UNITS = ("mm", "mm", "cm", "m", "inch", "feet", "um", "nm")
"""Length units in the order of the header's numbers. Number 0 is "the system's", which the file does not name."""

FLUX_UNIT: tuple[FluxUnit, ...] = ("W", "lm")
"""Flux units in the order of the header's data types: radiometric, photometric."""


@dataclasses.dataclass(frozen=True)
class _Layout:
    """The columns of a record."""

    far_field: bool
    colour: str

    def dtype(self) -> np.dtype[Any]:
        columns: list[Any] = [] if self.far_field else [("position", "<f4", 3)]
        columns.append(("direction", "<f4", 3))
        if self.colour == TRISTIMULUS:
            # X Y Z stand in place of the flux, and Y is the flux.
            columns += [("tristimulus_x", "<f4"), ("flux", "<f4"), ("tristimulus_z", "<f4")]
        else:
            columns.append(("flux", "<f4"))
        if self.colour == WAVELENGTH:
            columns.append(("wavelength", "<f4"))
        return np.dtype(columns)


def recognise(head: Head) -> bool:
    """By the magic bytes."""
    return head.data.startswith(MAGIC)


def read(path: Path) -> RaySet:
    """Map a LightTools binary ray file of version 2.

    The rays' values are relative: LightTools writes them larger than the header's total by the number of rays it
    started, which is not in the file. They are scaled to the total, unless that is 0 or not finite.

    Raises
    ------
    UnsupportedFormatError
        If the file is of version 3 (polarised).
    FormatError
        If the header has numbers that mean nothing, or there is not one whole ray.
    """
    data = read_bytes(path, 0, HEADER.size, "header")
    _, major, minor, data_type, far_field, colour, unit, *origin, _total = HEADER.unpack(data)
    _refuse_version(path, major)
    for offset, name, value, known in (
        (12, "data type", data_type, ("radiometric", "photometric")),
        (16, "far field flag", far_field, ("with positions", "without")),
        (20, "colour information", colour, COLOUR_INFO),
        (24, "length unit", unit, ("system", *LENGTH_UNITS[1:])),
    ):
        if value >= len(known):
            listed = ", ".join(f"{i} {word}" for i, word in enumerate(known))
            raise FormatError(path, f"byte {offset}", f"{name} {value} does not exist", f"Known: {listed}. [{CLAUSE}]")
    dtype = _Layout(bool(far_field), COLOUR_INFO[colour]).dtype()
    rays, tail = _count(path, dtype.itemsize)
    records = stored_records(path, dtype, HEADER.size, rays)
    total = stated_total(data[40:44])
    complaints = []
    if minor != 0:
        complaints.append(Complaint("warning", "byte 8", f"minor version {minor}, not 0; read as version 2.0", CLAUSE))
    if unit == 0:
        found = "the length unit is 'system', which the file does not name; taken as mm (RaySet.scaled in Python changes it)"
        complaints.append(Complaint("warning", "byte 24", found, CLAUSE))
    if any(value != 0 for value in origin):
        found = f"data origin {origin} is not 0; positions are left as stored (in Python, RaySet.moved shifts them)"
        complaints.append(Complaint("warning", "byte 28", found, CLAUSE))
    if total is None:
        found = "the header does not know the total flux; the rays' own values are taken as absolute"
        complaints.append(Complaint("warning", "byte 40", found, CLAUSE))
    header = {
        "version": f"{major}.{minor}",
        "far_field": bool(far_field),
        "length_unit": "system" if unit == 0 else LENGTH_UNITS[unit],
        "data_origin": tuple(origin),
    }
    meaning = RaySetMeaning(
        flux_unit=FLUX_UNIT[data_type],
        declared_flux=total,
        length_scale=MM_PER_LENGTH_UNIT[LENGTH_UNITS[unit]],
        header=header if total is None else {**header, "total_flux": total},
        complaints=(*complaints, *tail, *wavelength_complaints(records, CLAUSE)),
        provenance=file_provenance(path, "lighttools"),
    )
    return RaySet.from_records(records, meaning)


def _refuse_version(path: Path, major: int) -> None:
    if major == POLARISED_VERSION:
        found = "LTRF version 3, which holds polarised rays in records of unpublished layout"
        raise UnsupportedFormatError(path, "byte 4", found, "Export it without polarisation (version 2), or as TM-25.")
    if major != VERSION:
        raise UnsupportedFormatError(
            path, "byte 4", f"LTRF version {major}; known is 2", "Ask for version 2, or TM-25."
        )


def _count(path: Path, width: int) -> tuple[int, tuple[Complaint, ...]]:
    """Number of whole records, by the file's size: searching for the trailer would be slow and could be fooled."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(HEADER.size, size - len(TRAILER)))
        whole = file.read(len(TRAILER)) == TRAILER
    count, stray = divmod(size - HEADER.size - (len(TRAILER) if whole else 0), width)
    if whole and stray:
        raise FormatError(
            path, f"byte {HEADER.size}", f"the rays do not fill whole records of {width} bytes: {stray} are left over",
            "The columns are not those of the header; ask the file's author to export it again.",
        )  # fmt: skip
    if count < 1:
        raise FormatError(path, f"byte {size}", "there is not one whole ray", "The file is empty or truncated.")
    if whole:
        return count, ()
    found = (
        f"the file ends without LTRFEND, {stray} bytes after ray {count:,}: it is truncated, and how many rays are "
        "missing is not known"
    )
    return count, (Complaint("error", f"byte {size}", found, CLAUSE),)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a LightTools binary ray file of version 2, in millimetres, with flux that sums to the header's total.

    Rays with wavelengths keep them if they carry watts, rays with tristimulus values if they carry lumens.
    """
    colour = RayColour.of(rays)
    held = held_colour(rays, colour)

    def fill(batch: RayBatch, records: Records) -> None:
        if held == WAVELENGTH:
            records["wavelength"] = colour.wavelength(batch)
        elif held == TRISTIMULUS and isinstance(rays, RaySet):
            for name in TRISTIMULUS_COLUMNS:
                records[name] = own_rows(batch, rays, name) * rays.flux_scale

    data_type, far_field = FLUX_UNIT.index(rays.flux_unit), not rays.has_position
    fields = (VERSION, 0, data_type, far_field, COLOUR_INFO.index(held), 1, 0.0, 0.0, 0.0)
    with path.open("wb") as file:
        file.write(bytes(HEADER.size))
        written = write_records(file, rays, _Layout(far_field, held).dtype(), fill)
        file.write(TRAILER)
        file.seek(0)
        file.write(HEADER.pack(MAGIC, *fields, written.totals["flux"]))
    return colour_losses(rays, written, colour, held)


FORMAT = RayFormat("lighttools", "LightTools binary ray file (LTRF)", (".ray",), recognise, read, write, far_field=True)
"""LightTools binary ray files."""
