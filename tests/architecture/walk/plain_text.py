"""Rays as plain text (``.rays``): a line ``rays COUNT UNIT COLUMNS``, and a row per ray.

Rows are ``x y z l m n flux`` in mm and in the unit that the first line states, and the wavelength [nm] if it states eight
columns.
"""

from __future__ import annotations

import re
from pathlib import Path

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, losses, wavelength_complaints
from etendue.formats.rays.text_output import usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, head_lines, read_rows
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream

CLAUSE = "ray-file formats, plain text"
FIRST_LINE = re.compile(r"rays (\d{1,15}) (lm|W) ([78])", re.ASCII)
GEOMETRY = {"position": (0, 1, 2), "direction": (3, 4, 5), "flux": (6,)}


def recognise(head: Head) -> bool:
    """By the first line."""
    return head.is_text and any(FIRST_LINE.fullmatch(line.text) for line in head_lines(head)[:1])


def read(path: Path) -> RaySet:
    """Read a file of rays as plain text. The rays' flux is absolute.

    Raises
    ------
    FormatError
        If the first line is another one, or a row is none.
    """
    first = head_lines(Head.of(path))[0]
    stated = FIRST_LINE.fullmatch(first.text)
    if stated is None:
        raise FormatError(path, "line 1", f"{first.text[:40]!r}", f"It is `rays COUNT UNIT COLUMNS`. [{CLAUSE}]")
    columns = int(stated[3])
    fields = GEOMETRY if columns == 7 else {**GEOMETRY, "wavelength": (7,)}
    layout = RowLayout(fields=fields, columns=columns, clause=CLAUSE, expected=int(stated[1]), stated_at="line 1")
    rows = read_rows(path, layout, offset=first.end, line=2)
    meaning = RaySetMeaning(
        flux_unit="lm" if stated[2] == "lm" else "W",
        complaints=(*rows.complaints, *wavelength_complaints(rows.records, CLAUSE)),
        provenance=file_provenance(path, "plain-text"),
    )
    return RaySet.from_records(rows.records, meaning)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write rays as plain text.

    Returns
    -------
    tuple of str
        What the format could not express.

    Raises
    ------
    ArgumentError
        If there is no usable ray.
    """
    colour = RayColour.of(rays)
    kept = colour.has_wavelengths

    def columns(batch: RayBatch) -> list[FloatArray]:
        geometry = [batch.position, batch.direction, batch.flux]
        return [*geometry, colour.wavelength(batch)] if kept else geometry

    count = usable_rays(rays)
    with path.open("wb") as file:
        file.write(f"rays {count} {rays.flux_unit} {8 if kept else 7}\r\n".encode("ascii"))
        written = write_rows(file, rays, columns)
    return losses(rays, written, colour, colour_kept=kept)


FORMAT = RayFormat("plain-text", "plain text ray file", (".rays",), recognise, read, write, value_bytes=2)
"""Rays as plain text."""
