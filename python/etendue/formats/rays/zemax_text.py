"""Zemax OpticStudio text source files (``.dat``, ``.txt``): a line ``rays unit format flux-type``, and a row per ray.

Rows are ``x y z l m n flux``, in spectral files followed by the wavelength [µm]. Programs that keep the file as a table
pad the first line with zeros to the width of the rows, so that it looks like a ray without direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, wavelength_complaints
from etendue.formats.rays.text_output import usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, TextLine, head_lines, numbers, read_rows
from etendue.formats.rays.zemax import DIMENSION_UNITS, FLUX_ONLY, LONGEST_WAVELENGTH, SPECTRAL, zemax_losses
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT, NM_PER_UM, FluxUnit

CLAUSE = "ray-file formats, Zemax text"

EARLY_LUMENS = 2
"""An early converter from Speos wrote this for lumens."""

FLUX_TYPES: dict[float, FluxUnit] = {0: "W", 1: "lm", EARLY_LUMENS: "lm"}
GEOMETRY = {"position": (0, 1, 2), "direction": (3, 4, 5), "flux": (6,)}
FIELDS = {7: GEOMETRY, 8: {**GEOMETRY, "wavelength": (7,)}}
"""Record fields by the number of columns."""


def recognise(head: Head) -> bool:
    """By a first line of 2 to 4 numbers, or padded with zeros, before rows of 7 or 8 numbers."""
    return head.is_text and _first_lines(head) is not None


def _first_lines(head: Head) -> tuple[TextLine, TextLine] | None:
    lines = [line for line in head_lines(head) if line.text][:2]
    if len(lines) < 2:
        return None
    stated, row = (numbers(line.text.split()) or [] for line in lines)
    # Behind the four numbers a table is padded with zeros; the first row of bare columns has a direction there.
    fits = 2 <= len(stated) <= 8 and not any(stated[4:]) and len(row) in FIELDS
    return (lines[0], lines[1]) if fits else None


def read(path: Path) -> RaySet:
    """Read a Zemax text source file. The rays' flux is absolute.

    Raises
    ------
    FormatError
        If the first line says nothing that is known, or a row is not one.
    """
    found = _first_lines(Head.of(path))
    if found is None:
        raise FormatError(
            path, "line 1", "no line `rays unit format flux-type` before rows of 7 or 8 numbers",
            f"Ask for the file again. [{CLAUSE}]",
        )  # fmt: skip
    first, row = found
    stated = numbers(first.text.split()) or []
    columns = len(row.text.split())
    place = f"line {first.number}"
    count, unit = _count_and_unit(path, place, stated)
    complaints: list[Complaint] = []
    flux_unit = _flux_unit(path, place, stated, columns, complaints)
    rows = read_rows(
        path,
        RowLayout(fields=FIELDS[columns], columns=columns, clause=CLAUSE, expected=count, stated_at=place),
        offset=first.end,
        line=first.number + 1,
    )
    complaints += [*rows.complaints, *wavelength_complaints(rows.records, CLAUSE)]
    if "wavelength" in FIELDS[columns]:
        complaints += _unit_of_wavelength(rows.records["wavelength"], row)
    meaning = RaySetMeaning(
        flux_unit=flux_unit,
        length_scale=MM_PER_LENGTH_UNIT[unit],
        wavelength_scale=NM_PER_UM,
        header={"stated_rays": count, "length_unit": unit},
        complaints=tuple(complaints),
        provenance=file_provenance(path, "zemax-text"),
    )
    return RaySet.from_records(rows.records, meaning)


def _count_and_unit(path: Path, place: str, stated: list[float]) -> tuple[int, str]:
    count, unit = stated[:2]
    if not (count >= 1 and count == np.floor(count) and np.isfinite(count)):
        raise FormatError(
            path, place, f"{count:g} is no number of rays", f"The first line is: rays unit format flux-type. [{CLAUSE}]"
        )
    if unit not in range(len(DIMENSION_UNITS)):
        names = ", ".join(f"{i} {name}" for i, name in enumerate(DIMENSION_UNITS))
        raise FormatError(path, place, f"length unit {unit:g} does not exist", f"Known: {names}. [{CLAUSE}]")
    return int(count), DIMENSION_UNITS[int(unit)]


def _flux_unit(path: Path, place: str, stated: list[float], columns: int, complaints: list[Complaint]) -> FluxUnit:
    """Watts or lumens, by the first line's format and flux type, which it may lack."""

    def complain(found: str) -> None:
        complaints.append(Complaint("warning", place, found, CLAUSE))

    kind, flux_type = stated[2:4] if len(stated) >= 4 else (FLUX_ONLY, 0.0)
    # Padding cannot be told from the numbers "0 0", so it states nothing.
    if len(stated) < 4 or (len(stated) > 4 and kind == FLUX_ONLY and flux_type == 0):
        if columns == 7:
            complain(
                "the flux unit is not stated; taken as W, OpticStudio's default. "
                "If it is lm, say so: --flux 54.6lm, or RaySet.with_total_flux(value, 'lm') in Python"
            )
        return "W"
    expected = 8 if kind == SPECTRAL else 7
    if kind not in (FLUX_ONLY, SPECTRAL):
        complain(f"record format {kind:g}, not 0 (flux only) or 2 (spectral); the rows decide")
    elif columns != expected:
        complain(f"record format {kind:g} has {expected} columns, but the rows have {columns}; the rows decide")
    if kind == SPECTRAL:
        if flux_type != 0:
            complain(f"flux type {flux_type:g} in a spectral file, whose flux is in watts by definition")
        return "W"
    if flux_type not in FLUX_TYPES:
        raise FormatError(path, place, f"flux type {flux_type:g} does not exist", f"Known: 0 W, 1 lm. [{CLAUSE}]")
    if flux_type == EARLY_LUMENS:
        complain("flux type 2, not 0 (W) or 1 (lm); taken as lumens")
    return FLUX_TYPES[flux_type]


def _unit_of_wavelength(wavelength: FloatArray, row: TextLine) -> Iterator[Complaint]:
    if wavelength[0] > LONGEST_WAVELENGTH:
        found = f"a wavelength of {wavelength[0]:g} µm, in which the column is by definition; is the file in nm?"
        yield Complaint("warning", f"line {row.number}", found, CLAUSE)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a Zemax text source file in millimetres, spectral if the rays have wavelengths and carry watts."""
    colour = RayColour.of(rays)
    spectral = colour.has_wavelengths and rays.flux_unit == "W"
    kind, flux_type = SPECTRAL if spectral else FLUX_ONLY, 1 if rays.flux_unit == "lm" else 0

    def columns(batch: RayBatch) -> list[FloatArray]:
        geometry = [batch.position, batch.direction, batch.flux]
        return [*geometry, colour.wavelength(batch) / NM_PER_UM] if spectral else geometry

    count = usable_rays(rays)
    with path.open("wb") as file:
        file.write(f"{count} {DIMENSION_UNITS.index('mm')} {kind} {flux_type}\r\n".encode("ascii"))
        written = write_rows(file, rays, columns)
    return zemax_losses(rays, written, colour, spectral, wavelengths_lost=colour.has_wavelengths and not spectral)


FORMAT = RayFormat("zemax-text", "Zemax text source file", (), recognise, read, write, value_bytes=2)
"""Zemax OpticStudio text source files. Their extensions, ``.dat`` and ``.txt``, belong to other formats as well."""
