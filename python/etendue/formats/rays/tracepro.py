"""TracePro text source files (``.dat``, ``.src``, ``.txt``): a header for people, a line of column names, and rows.

Rows are ``x y z l m n flux``. The header states the length unit by the number of them in a metre.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, losses
from etendue.formats.rays.text_output import usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, TextLine, head_lines, numbers, read_rows, whole
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT

CLAUSE = "ray-file formats, TracePro text"

COLUMN_NAMES = "X Pos Y Pos Z Pos X Vec Y Vec Z Vec Inc Flux"
MARKER = re.compile(COLUMN_NAMES.replace(" ", r"\s*"), re.IGNORECASE)
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
GENERATED = re.compile(r"NbrRays Generated:\s*(\d+)", re.IGNORECASE)

PLACEMENTS = (("rotation", 0.0), ("translation", 0.0), ("scale", 1.0))
"""Header lines that place the source in a model, with the numbers that leave it where it is."""

GEOMETRY = {"position": (0, 1, 2), "direction": (3, 4, 5), "flux": (6,)}
COLUMNS = (7, 8)
"""What the eighth column means is not published."""


def recognise(head: Head) -> bool:
    """By the line of column names."""
    return head.is_text and any(MARKER.match(line.text) for line in head_lines(head))


def read(path: Path) -> RaySet:
    """Read a TracePro text source file. The rays' flux is absolute; it is taken as watts, for the file does not say.

    Raises
    ------
    FormatError
        If the line of column names is missing, the length unit is no number, or a row is not one.
    """
    lines = head_lines(Head.of(path))
    marker = next((i for i, line in enumerate(lines) if MARKER.match(line.text)), None)
    if marker is None:
        raise FormatError(path, "header", f"no line {COLUMN_NAMES!r}", f"Ask for the file again. [{CLAUSE}]")
    above, names = lines[:marker], lines[marker]
    columns = next((len(line.text.split()) for line in lines[marker + 1 :] if line.text), COLUMNS[0])
    if columns not in COLUMNS:
        raise FormatError(
            path, f"line {names.number + 1}", f"{columns} numbers in the first row, not 7 or 8",
            f"Ask for the file again. [{CLAUSE}]",
        )  # fmt: skip
    count, stated_at = _stated_rays(above)
    layout = RowLayout(fields=GEOMETRY, columns=columns, clause=CLAUSE, expected=count, stated_at=stated_at)
    length_scale, complaints = _length_scale(path, above)
    complaints += _placement_complaints(above)
    unit = (
        "the flux unit is not stated; taken as W. "
        "If it is lm, say so: --flux 54.6lm, or RaySet.with_total_flux(value, 'lm') in Python"
    )
    complaints.append(Complaint("warning", f"line {names.number}", unit, CLAUSE))
    if columns == COLUMNS[1]:
        eighth = "what column 8 means is not known; it is ignored"
        complaints.append(Complaint("warning", f"line {names.number}", eighth, CLAUSE))
    rows = read_rows(path, layout, offset=names.end, line=names.number + 1)
    meaning = RaySetMeaning(
        flux_unit="W",
        length_scale=length_scale,
        header={"title": above[0].text.lstrip("!# ") if above else "", "stated_rays": count},
        complaints=(*complaints, *rows.complaints),
        provenance=file_provenance(path, "tracepro"),
    )
    return RaySet.from_records(rows.records, meaning)


def _stated_rays(lines: list[TextLine]) -> tuple[int | None, str]:
    for line in lines:
        if match := GENERATED.search(line.text):
            return whole(match[1]), f"line {line.number}"
    return None, "header"


def _length_scale(path: Path, lines: list[TextLine]) -> tuple[float, list[Complaint]]:
    """Millimetres per unit of the file."""
    for line in lines:
        if line.text.lower().startswith("conversion factor from meters"):
            per_metre = (numbers(line.text.split()[4:5]) or [math.nan])[0]
            if not (math.isfinite(per_metre) and per_metre > 0):
                raise FormatError(
                    path, f"line {line.number}", f"{line.text!r} states no length unit",
                    f"It is the number of length units in a metre: 1 for m, 1000 for mm. [{CLAUSE}]",
                )  # fmt: skip
            return MM_PER_LENGTH_UNIT["m"] / per_metre, []
    found = "no line 'Conversion Factor From Meters'; lengths are taken as mm (in Python, RaySet.scaled changes it)"
    return 1.0, [Complaint("warning", "header", found, CLAUSE)]


def _placement_complaints(lines: list[TextLine]) -> Iterator[Complaint]:
    for line in lines:
        for name, neutral in PLACEMENTS:
            if line.text.lower().startswith(name) and any(float(v) != neutral for v in NUMBER.findall(line.text)):
                found = (
                    f"{line.text!r} is not applied; positions are left as stored "
                    "(in Python, RaySet.rotated, moved and scaled do it)"
                )
                yield Complaint("warning", f"line {line.number}", found, CLAUSE)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a TracePro text source file in metres, the one unit whose conversion factor, 1, cannot be misunderstood."""
    count = usable_rays(rays)
    source = re.sub(r"[^\x20-\x7e]", "?", rays.provenance.source)
    header = (
        f"!! Source file: {source}",
        f"# NbrRays Requested: {count},  NbrRays Generated: {count}",
        "Angular Range PolarBeg:   0.0000, PolarEnd: 180.0000, AzimuthBeg:   0.0000, AzimuthEnd: 360.0000",
        "Rotation AboutX   0.0000, AboutY   0.0000, AboutZ   0.0000",
        "Translation X   0.0000, Y   0.0000, Z   0.0000",
        "Scale X   1.0000, Y   1.0000, Z   1.0000",
        "Conversion Factor From Meters   1.0000",
        COLUMN_NAMES,
    )

    def columns(batch: RayBatch) -> list[FloatArray]:
        return [batch.position / MM_PER_LENGTH_UNIT["m"], batch.direction, batch.flux]

    with path.open("wb") as file:
        file.write("".join(f"{line}\r\n" for line in header).encode("ascii"))
        written = write_rows(file, rays, columns)
    notes = [f"The file does not say that the flux is in {rays.flux_unit}; choose it in TracePro."]
    notes += losses(rays, written, RayColour.of(rays), colour_kept=False)
    return tuple(notes)


FORMAT = RayFormat("tracepro", "TracePro text source file", (".src",), recognise, read, write, value_bytes=2)
"""TracePro text source files."""
