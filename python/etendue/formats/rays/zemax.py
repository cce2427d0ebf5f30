"""Zemax OpticStudio binary source files (``.dat``, ``.sdf``): 208 bytes of header, then records of 28 or 32 bytes.

Clauses are sections of the OpticStudio help: *Source File*, "Binary file format". All values are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat, stored_records
from etendue.formats.rays.shared import (
    Colour,
    RayColour,
    Records,
    Written,
    losses,
    read_bytes,
    stated_total,
    text,
    wavelength_complaints,
    whole_records,
    write_records,
)
from etendue.quantities.file_records import AnyRecords
from etendue.quantities.provenance import version
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT, NM_PER_UM, FluxUnit

CLAUSE = "OpticStudio help, Source File, binary format"

HEADER = struct.Struct("<iI100s3f2f2fi3f3f3f4f4i")
IDENTIFIERS = (1010, 8675309)
"""The current identifier, and the one of older files, which OpticStudio still accepts."""

DIMENSION_UNITS = ("m", "inch", "cm", "feet", "mm")
"""Length units in the order of the header's numbers."""

FLUX_ONLY, SPECTRAL = 0, 2
RECORD_BYTES = {FLUX_ONLY: 28, SPECTRAL: 32}
LONGEST_WAVELENGTH = 100.0
"""[µm]; whoever wrote a longer one meant nanometres."""

MAX_RAYS = 4_000_000_000
"""Largest number of rays that OpticStudio reads."""


def recognise(head: Head) -> bool:
    """By the identifier, and by unit and format numbers that exist or a size that fits."""
    if len(head.data) < HEADER.size or int.from_bytes(head.data[:4], "little") not in IDENTIFIERS:
        return False
    count = int.from_bytes(head.data[4:8], "little")
    fits = any(head.size == HEADER.size + count * width for width in RECORD_BYTES.values())
    (unit,) = struct.unpack_from("<i", head.data, 136)
    kind, flux_type = struct.unpack_from("<2i", head.data, 192)
    return fits or (0 <= unit < len(DIMENSION_UNITS) and kind in RECORD_BYTES and 0 <= flux_type <= 2)


def read(path: Path) -> RaySet:
    """Map a Zemax binary source file.

    OpticStudio uses only the number of rays, the length unit, the record format and the flux type; this reader also takes
    the header's wavelength, 0 if it is composite, for that of rays that have none of their own. The rays' flux is absolute;
    the header's fluxes are reported.

    Raises
    ------
    FormatError
        If the header has numbers that mean nothing, or contradicts the file's size.
    """
    data = read_bytes(path, 0, HEADER.size, "header")
    (identifier, count, description, source_flux, ray_set_flux, wavelength, *rest) = HEADER.unpack(data)
    angles, unit, placement = rest[0:4], rest[4], rest[5:11]
    kind, flux_type = rest[18], rest[19]
    if not 0 <= unit < len(DIMENSION_UNITS):
        names = ", ".join(f"{i} {name}" for i, name in enumerate(DIMENSION_UNITS))
        raise FormatError(path, "byte 136", f"length unit {unit} does not exist", f"Known: {names}. [{CLAUSE}]")
    if kind not in RECORD_BYTES:
        raise FormatError(
            path, "byte 192", f"record format {kind} does not exist", f"Known: 0 flux only, 2 spectral. [{CLAUSE}]"
        )
    single, wavelength_complaint = _single_wavelength(kind, wavelength)
    complaints = [*_header_complaints(kind, flux_type, placement), *wavelength_complaint]
    rays, tail = whole_records(path, HEADER.size, RECORD_BYTES[kind], count, CLAUSE)
    records = stored_records(path, _record(kind), HEADER.size, rays)
    total = stated_total(data[112:116])
    header = {
        "identifier": identifier,
        "description": text(description),
        "total_flux": total if total is not None else stated_total(data[108:112]),
        "source_flux": source_flux,
        "ray_set_flux": ray_set_flux,
        "inclination": tuple(angles[:2]),
        "azimuth": tuple(angles[2:]),
        "length_unit": DIMENSION_UNITS[unit],
        "location": tuple(placement[:3]),
        "rotation": tuple(placement[3:]),
    }
    meaning = RaySetMeaning(
        flux_unit=_flux_unit(kind, flux_type),
        length_scale=MM_PER_LENGTH_UNIT[DIMENSION_UNITS[unit]],
        wavelength_scale=NM_PER_UM,
        single_wavelength=single,
        header=header,
        complaints=(*complaints, *tail, *wavelength_complaints(records, CLAUSE), *_unit_of_wavelength(records)),
        provenance=file_provenance(path, "zemax"),
    )
    return RaySet.from_records(records, meaning)


def _single_wavelength(kind: int, stored: float) -> tuple[float | None, list[Complaint]]:
    """The wavelength [nm] of all rays, if they have but one."""
    if kind == SPECTRAL or not (np.isfinite(stored) and stored > 0):
        return None, []
    if stored > LONGEST_WAVELENGTH:
        # A public converter writes nanometres here.
        found = f"a wavelength of {stored:g}, which would be µm; taken as nm"
        return float(stored), [Complaint("warning", "byte 116", found, CLAUSE)]
    return float(stored) * NM_PER_UM, []


def _unit_of_wavelength(records: AnyRecords) -> Iterator[Complaint]:
    if "wavelength" in (records.dtype.names or ()) and records[0]["wavelength"] > LONGEST_WAVELENGTH:
        found = f"a wavelength of {records[0]['wavelength']:g} µm, in which the column is by definition; is it in nm?"
        yield Complaint("warning", f"byte {HEADER.size + 28}", found, CLAUSE)


def _flux_unit(kind: int, flux_type: int) -> FluxUnit:
    return "W" if kind == SPECTRAL or flux_type == 0 else "lm"


def _header_complaints(kind: int, flux_type: int, placement: list[float]) -> Iterator[Complaint]:
    if kind == SPECTRAL and flux_type != 0:
        found = f"flux type {flux_type} in a spectral file, whose flux is in watts by definition"
        yield Complaint("warning", "byte 196", found, CLAUSE)
    elif flux_type not in (0, 1):
        # An early converter from Speos wrote 2 for lumens.
        yield Complaint("warning", "byte 196", f"flux type {flux_type}, not 0 (W) or 1 (lm); taken as lumens", CLAUSE)
    if any(value != 0 for value in placement):
        found = f"location and rotation {[float(f'{v:.7g}') for v in placement]} are ignored, as OpticStudio does"
        yield Complaint("note", "byte 140", found, CLAUSE)


def _record(kind: int) -> np.dtype[Any]:
    columns: list[Any] = [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")]
    return np.dtype(columns + ([("wavelength", "<f4")] if kind == SPECTRAL else []))


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a Zemax binary source file in millimetres: spectral (``.sdf``) if the rays have wavelengths and watts."""
    colour = RayColour.of(rays)
    spectral = colour.kind is Colour.PER_RAY and rays.flux_unit == "W"
    kind = SPECTRAL if spectral else FLUX_ONLY

    def fill(batch: RayBatch, records: Records) -> None:
        if spectral:
            records["wavelength"] = colour.wavelength(batch) / NM_PER_UM

    with path.open("wb") as file:
        file.write(bytes(HEADER.size))
        written = write_records(file, rays, _record(kind), fill)
        file.seek(0)
        file.write(_header(rays, kind, written.rays, written.totals["flux"], (colour.single or 0.0) / NM_PER_UM))
    wavelengths_lost = colour.kind is Colour.PER_RAY and not spectral
    return zemax_losses(rays, written, colour, spectral or colour.single is not None, wavelengths_lost=wavelengths_lost)


def zemax_losses(
    rays: RayStream, written: Written, colour: RayColour, colour_kept: bool, *, wavelengths_lost: bool
) -> tuple[str, ...]:
    """What a Zemax file, binary or text, does not say of the rays, one sentence each."""
    notes = list(losses(rays, written, colour, colour_kept=colour_kept))
    if wavelengths_lost:
        notes.append(
            "Zemax files hold wavelengths only beside watts; to keep them, convert the rays to watts: --unit W, or "
            "RaySet.in_unit('W') in Python."
        )
    if colour.kind is Colour.ONE_SPECTRUM:
        notes.append("OpticStudio takes the spectrum from a .spcd file (µm, weight) that is chosen with the source.")
    if written.dark_rays:
        notes.append(f"{written.dark_rays:,} rays carry no flux, which OpticStudio may refuse.")
    return tuple(notes)


def _header(rays: RayStream, kind: int, count: int, total: float, wavelength: float) -> bytes:
    description = f"{rays.provenance.source} (etendue {version()})".encode("ascii", "replace")[:100]
    flux_type = 1 if rays.flux_unit == "lm" else 0
    angles, location, rotation, scale, unused = (0.0,) * 4, (0.0,) * 3, (0.0,) * 3, (1.0,) * 3, (0.0,) * 4
    return HEADER.pack(
        IDENTIFIERS[0], count, description, total, total, wavelength, *angles, DIMENSION_UNITS.index("mm"),
        *location, *rotation, *scale, *unused, kind, flux_type, 0, 0,
    )  # fmt: skip


FORMAT = RayFormat("zemax", "Zemax binary source file", (".dat", ".sdf"), recognise, read, write, most_rays=MAX_RAYS)
"""Zemax OpticStudio binary source files."""
