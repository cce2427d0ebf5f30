"""Speos text ray files (``.txt``): a line with the number of rays, then rows ``index x y z l m n λ energy``.

Lengths are millimetres, wavelengths nanometres. Energies are relative, from 0 to 1, and no total is in the file. Rows
of polarised rays continue with the unit vector along the big axis of the ellipse, its axis ratio, and its handedness.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, losses, wavelength_complaints
from etendue.formats.rays.speos import in_watts, largest_flux
from etendue.formats.rays.text_output import usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, TextLine, head_lines, numbers, read_rows, whole
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint

CLAUSE = "Ansys Speos help, Contents of Ray Files"

UNPOLARISED, POLARISED = 9, 14
FIELDS = {"position": (1, 2, 3), "direction": (4, 5, 6), "wavelength": (7,), "flux": (8,)}


def recognise(head: Head) -> bool:
    """By a first line with one whole number, before rows of 9 or 14 numbers."""
    return head.is_text and _first_lines(head) is not None


def _first_lines(head: Head) -> tuple[TextLine, int, int] | None:
    """The first line, the number that it states, and the number of columns below; None if it is no Speos file."""
    lines = [line for line in head_lines(head) if line.text][:2]
    stated = whole(lines[0].text) if len(lines) == 2 else None
    if stated is None:
        return None
    columns = len(numbers(lines[1].text.split()) or [])
    return (lines[0], stated, columns) if columns in (UNPOLARISED, POLARISED) else None


def read(path: Path) -> RaySet:
    """Read a Speos text ray file. The total flux is not in it: the sum of the energies stands for watts.

    Raises
    ------
    FormatError
        If the first line is no number of rays, or a row is not one.
    """
    found = _first_lines(Head.of(path))
    if found is None:
        raise FormatError(
            path, "line 1", f"no number of rays before rows of {UNPOLARISED} or {POLARISED} numbers",
            f"Ask for the file again. [{CLAUSE}]",
        )  # fmt: skip
    first, count, columns = found
    place = f"line {first.number}"
    layout = RowLayout(fields=FIELDS, columns=columns, clause=CLAUSE, expected=count, stated_at=place)
    rows = read_rows(path, layout, offset=first.end, line=first.number + 1)
    unknown_total = (
        "the rays' energies are relative and the total flux is not in the file; their sum is taken as W. "
        "Give the total: --flux 0.7W, or RaySet.with_total_flux(value, 'W') in Python"
    )
    complaints = [Complaint("warning", "total flux", unknown_total, CLAUSE)]
    if columns == POLARISED:
        complaints.append(Complaint("note", "columns 10 to 14", "the polarisation of the rays is not read", CLAUSE))
    meaning = RaySetMeaning(
        flux_unit="W",
        header={"stated_rays": count, "polarised": columns == POLARISED},
        complaints=(*complaints, *rows.complaints, *wavelength_complaints(rows.records, CLAUSE)),
        provenance=file_provenance(path, "speos-text"),
    )
    return RaySet.from_records(rows.records, meaning)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a Speos text ray file, with energies relative to the strongest ray's."""
    rays, notes = in_watts(rays, "'lighttools-text', which needs none")
    colour = RayColour.of(rays)
    count = usable_rays(rays)
    largest = largest_flux(rays)
    scale = 1 / largest if largest > 0 else 1.0
    written_before = 0

    def columns(batch: RayBatch) -> list[FloatArray]:
        nonlocal written_before
        index = np.arange(written_before, written_before + len(batch.flux), dtype=np.float64) + 1
        written_before += len(batch.flux)
        return [index, batch.position, batch.direction, colour.wavelength(batch), batch.flux * scale]

    with path.open("wb") as file:
        file.write(f"{count}\r\n".encode("ascii"))
        written = write_rows(file, rays, columns)
    notes.append(f"The total flux, {rays.total_flux:.7g} W, has no place in the file; enter it in Speos.")
    notes += losses(rays, written, colour, colour_kept=True, kept=("radiant_flux",))
    return tuple(notes)


FORMAT = RayFormat("speos-text", "Speos text ray file", (), recognise, read, write, value_bytes=2, unit="W")
"""Speos text ray files. Their extension, ``.txt``, belongs to other formats as well."""
