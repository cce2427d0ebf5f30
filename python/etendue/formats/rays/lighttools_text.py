"""LightTools text ray data (``.ray``, ``.txt``): lines ``key: value``, and rows between two marker lines.

Rows are ``x y z l m n power``, in far-field files without the position, with a wavelength [nm] at the end, or with the
tristimulus values X Y Z in place of the power.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import NoReturn

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.lighttools_colour import (
    NO_COLOUR,
    TRISTIMULUS,
    TRISTIMULUS_COLUMNS,
    WAVELENGTH,
    colour_losses,
    held_colour,
)
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, own_rows, wavelength_complaints
from etendue.formats.rays.text_output import geometry, usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, TextLine, head_lines, numbers, read_rows
from etendue.quantities.provenance import version
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint, Severity
from etendue.units import MM_PER_LENGTH_UNIT, FluxUnit

CLAUSE = "ray-file formats, LightTools text"

START, END = "lt_startofdata", "lt_endofdata"

LENGTH_UNITS = {
    "millimeters": "mm",
    "centimeters": "cm",
    "meters": "m",
    "inches": "inch",
    "feet": "feet",
    "micrometers": "um",
    "microns": "um",
    "nanometers": "nm",
}
FLUX_UNIT: dict[str, FluxUnit] = {"luminous_flux": "lm", "radiant_power": "W"}
FAR_FIELD = {"no": False, "yes": True}
COLOURS = (NO_COLOUR, WAVELENGTH, TRISTIMULUS)

KNOWN_KEYS = (
    "lt_rdf_version",
    "dataname",
    "lt_datatype",
    "lt_far_field_data",
    "lt_color_info",
    "lt_length_units",
    "lt_data_origin",
    "lt_radiant_flux",
)


def recognise(head: Head) -> bool:
    """By its keywords in a text."""
    text = head.data.lower()
    return head.is_text and (b"lt_rdf_version" in text or START.encode() in text)


@dataclasses.dataclass
class _Header:
    """The lines before the rows, by key in lower case."""

    path: Path
    lines: dict[str, tuple[TextLine, str]]
    start: TextLine
    complaints: list[Complaint]

    @classmethod
    def of(cls, path: Path) -> _Header:
        lines: dict[str, tuple[TextLine, str]] = {}
        complaints: list[Complaint] = []
        for line in head_lines(Head.of(path)):
            if line.text.lower().startswith(START):
                header = cls(path, lines, line, complaints)
                header.check_keys()
                return header
            match = re.match(r"([A-Za-z]\w*)\s*[:=\s]\s*(.*)", line.text)
            if match is None:
                continue  # a comment, or a blank line
            key, value = match[1].lower(), match[2].strip()
            if key in lines:
                found = f"{key} is stated again, {value!r} after {lines[key][1]!r}; the first counts"
                complaints.append(Complaint("warning", f"line {line.number}", found, CLAUSE))
            else:
                lines[key] = (line, value)
        raise FormatError(
            path, "header", f"{START} is missing, so that it is not known where the rays begin",
            f"The file is truncated; ask for it again. [{CLAUSE}]",
        )  # fmt: skip

    def check_keys(self) -> None:
        for key, (_, value) in self.lines.items():
            if key not in KNOWN_KEYS:
                self.complain("note", key, f"{key!r} is not known; its value, {value!r}, is ignored")

    def value(self, key: str) -> str | None:
        return self.lines[key][1] if key in self.lines else None

    def place(self, key: str) -> str:
        return f"line {self.lines[key][0].number}" if key in self.lines else "header"

    def complain(self, severity: Severity, key: str, found: str) -> None:
        self.complaints.append(Complaint(severity, self.place(key), found, CLAUSE))

    def refuse(self, key: str, found: str, known: str) -> NoReturn:
        raise FormatError(self.path, self.place(key), found, f"Known: {known}. [{CLAUSE}]")

    # --- what the keys mean ------------------------------------------------------------------------------------------

    def flux_unit(self) -> FluxUnit:
        value = self.value("lt_datatype")
        if value is None or value.lower() not in FLUX_UNIT:
            found = "lt_datatype is missing" if value is None else f"lt_datatype {value!r} is not known"
            self.refuse("lt_datatype", f"{found}, so that the unit of the flux is not known", ", ".join(FLUX_UNIT))
        return FLUX_UNIT[value.lower()]

    def far_field(self) -> bool:
        value = self.value("lt_far_field_data")
        if value is None:
            self.complain("warning", "lt_far_field_data", "lt_far_field_data is missing; taken as 'no'")
            return False
        if value.lower() not in FAR_FIELD:
            self.refuse("lt_far_field_data", f"lt_far_field_data is {value!r}", ", ".join(FAR_FIELD))
        return FAR_FIELD[value.lower()]

    def colour(self) -> str:
        value = self.value("lt_color_info")
        if value is None:
            self.complain("warning", "lt_color_info", "lt_color_info is missing; taken as 'none'")
            return NO_COLOUR
        # How LightTools spells the tristimulus case is not documented; the word occurs in every spelling.
        found = [colour for colour in COLOURS if colour in value.lower()]
        if not found:
            self.refuse("lt_color_info", f"lt_color_info is {value!r}", ", ".join(COLOURS))
        return found[0]

    def length_unit(self) -> str:
        value = self.value("lt_length_units")
        if value is None or value.lower().startswith("system"):
            found = (
                "lt_length_units is missing"
                if value is None
                else "lt_length_units is 'system', which the file does not name"
            )
            self.complain("warning", "lt_length_units", f"{found}; taken as mm (in Python, RaySet.scaled changes it)")
            return "mm"
        for name, unit in LENGTH_UNITS.items():
            if value.lower() in (name, unit, name.replace("ter", "tre")):
                return unit
        return self.refuse("lt_length_units", f"lt_length_units is {value!r}", ", ".join(LENGTH_UNITS))

    def origin(self) -> tuple[float, ...]:
        value = self.value("lt_data_origin")
        origin = numbers((value or "0 0 0").split())
        if origin is None:
            self.complain("warning", "lt_data_origin", f"lt_data_origin {value!r} is no position; it is ignored")
        elif any(origin):
            found = f"data origin {origin} is not 0; positions are left as stored (in Python, RaySet.moved shifts them)"
            self.complain("warning", "lt_data_origin", found)
        return tuple(origin or ())

    def total(self) -> float | None:
        value = self.value("lt_radiant_flux")
        total = (numbers([value]) if value else None) or [float("nan")]
        if np.isfinite(total[0]) and total[0] > 0:
            return total[0]
        found = "lt_radiant_flux is missing" if value is None else f"lt_radiant_flux is {value!r}"
        self.complain("warning", "lt_radiant_flux", f"{found}; the rays' own values are taken as absolute")
        return None


def _fields(far_field: bool, colour: str) -> dict[str, tuple[int, ...]]:
    fields: dict[str, tuple[int, ...]] = {} if far_field else {"position": (0, 1, 2)}
    n = 0 if far_field else 3
    fields["direction"] = (n, n + 1, n + 2)
    if colour == TRISTIMULUS:
        return {**fields, "tristimulus_x": (n + 3,), "flux": (n + 4,), "tristimulus_z": (n + 5,)}
    fields["flux"] = (n + 3,)
    return {**fields, "wavelength": (n + 4,)} if colour == WAVELENGTH else fields


def read(path: Path) -> RaySet:
    """Read a LightTools text ray file.

    The rays' values are relative: LightTools writes them larger than the header's total by the number of rays it
    started, which is not in the file. They are scaled to the total, unless that is 0 or not finite.

    Raises
    ------
    FormatError
        If the header lacks the unit of the flux or has values that mean nothing, or a row is not as the header says.
    """
    header = _Header.of(path)
    flux_unit, far_field, colour = header.flux_unit(), header.far_field(), header.colour()
    unit, origin, total = header.length_unit(), header.origin(), header.total()
    if colour == TRISTIMULUS and flux_unit == "W":
        header.complain("warning", "lt_datatype", "radiant power with tristimulus values; Y is in lumens by definition")
        flux_unit = "lm"
    fields = _fields(far_field, colour)
    columns = sum(len(of_field) for of_field in fields.values())
    layout = RowLayout(fields=fields, columns=columns, clause=CLAUSE, end=END)
    rows = read_rows(path, layout, offset=header.start.end, line=header.start.number + 1)
    facts = {
        "version": header.value("lt_rdf_version"),
        "name": header.value("dataname"),
        "far_field": far_field,
        "length_unit": unit,
        "data_origin": origin,
        "total_flux": total,
    }
    meaning = RaySetMeaning(
        flux_unit=flux_unit,
        declared_flux=total,
        length_scale=MM_PER_LENGTH_UNIT[unit],
        header={key: value for key, value in facts.items() if value is not None},
        complaints=(*header.complaints, *rows.complaints, *wavelength_complaints(rows.records, CLAUSE)),
        provenance=file_provenance(path, "lighttools-text"),
    )
    return RaySet.from_records(rows.records, meaning)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a LightTools text ray file in millimetres, with absolute flux that sums to the header's total.

    Rays with wavelengths keep them if they carry watts, rays with tristimulus values if they carry lumens.
    """
    colour = RayColour.of(rays)
    held = held_colour(rays, colour)

    def columns(batch: RayBatch) -> list[FloatArray]:
        before = geometry(rays, batch)
        if held == WAVELENGTH:
            return [*before, batch.flux, colour.wavelength(batch)]
        if held == TRISTIMULUS and isinstance(rays, RaySet):
            x, z = (own_rows(batch, rays, name) * rays.flux_scale for name in TRISTIMULUS_COLUMNS)
            return [*before, x, batch.flux, z]
        return [*before, batch.flux]

    usable_rays(rays)
    datatype = next(name for name, unit in FLUX_UNIT.items() if unit == rays.flux_unit)
    name = re.sub(r"[^\x20-\x7e]", "?", rays.provenance.source)
    header = (
        f"# etendue {version()}",
        "# Ray Data Export File",
        "lt_rdf_version: 2.0",
        f"dataname: {name}",
        f"lt_datatype: {datatype}",
        f"lt_far_field_data: {'no' if rays.has_position else 'yes'}",
        f"lt_color_info: {held}",
        "lt_length_units: millimeters",
        "lt_data_origin: 0 0 0",
        f"lt_radiant_flux: {rays.total_flux:.17g}",
        START,
    )
    with path.open("wb") as file:
        file.write("".join(f"{line}\r\n" for line in header).encode("ascii"))
        written = write_rows(file, rays, columns)
        file.write(f"{END}\r\n".encode("ascii"))
    return colour_losses(rays, written, colour, held)


FORMAT = RayFormat(
    "lighttools-text", "LightTools text ray file", (), recognise, read, write, far_field=True, value_bytes=2
)
"""LightTools text ray files. Their extensions, ``.ray`` and ``.txt``, belong to other formats as well."""
