"""Ray tables (``.csv``, ``.asc``, ``.txt``): rows of numbers below a row that names the columns and their units.

étendue writes ``x_mm,y_mm,z_mm,l,m,n,flux_lm`` and, where known, ``wavelength_nm``, below lines ``# key: value``.
Bare rows of seven or eight numbers are read too, but what they do not say has to be assumed, and is complained about.
"""

from __future__ import annotations

import contextlib
import dataclasses
import re
from pathlib import Path
from typing import NoReturn

from etendue.errors import FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.column_names import ColumnName, column_name
from etendue.formats.rays.ray_format import RayFormat
from etendue.formats.rays.shared import FloatArray, RayColour, losses, wavelength_complaints
from etendue.formats.rays.text_output import geometry, usable_rays, write_rows
from etendue.formats.rays.text_rows import RowLayout, TextLine, head_lines, numbers, read_rows, whole
from etendue.quantities.provenance import version
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.units import MM_PER_LENGTH_UNIT, NM_PER_UM, FluxUnit

CLAUSE = "ray-file formats, ASCII table"

TITLE = "# etendue ray table"
COMMENTS = ("#", "%", "!", "//")
SEPARATORS = (";", "\t", ",")

COLUMNS = {"position": 3, "direction": 3, "flux": 1, "wavelength": 1}
"""Number of columns of each record field."""

BARE_FIELDS = {"position": (0, 1, 2), "direction": (3, 4, 5), "flux": (6,)}
FEWEST_NUMBERS = 6
"""A line of as many numbers is taken for a row of a table, if only to say what it lacks."""

EXAMPLE = "x_mm,y_mm,z_mm,l,m,n,flux_lm"
OVERRULE = "If it is another, say so: --flux 0.7W, or RaySet.with_total_flux(value, unit) in Python"


def recognise(head: Head) -> bool:
    """By a first line, after comments, that names directions and positions or flux, or that is a row of numbers."""
    first = _first_line(head) if head.is_text else None
    if first is None:
        return False
    fields = {(column.field, column.component) for column in _names(first.text) if column is not None}
    named = {("direction", i) for i in range(3)} <= fields and len(fields) > 3
    return named or _is_row(first.text)


def _first_line(head: Head) -> TextLine | None:
    return next((line for line in head_lines(head) if line.text and not line.text.startswith(COMMENTS)), None)


def _separator(text: str) -> str | None:
    """The strongest separator in a line; None for blanks."""
    return next((separator for separator in SEPARATORS if separator in text), None)


def _entries(text: str) -> list[str]:
    # Lines are decoded as Latin-1, of which anything is; "λ" and "µm" may be UTF-8.
    with contextlib.suppress(UnicodeError):
        text = text.encode("latin-1").decode("utf-8")
    return [entry.strip() for entry in text.split(_separator(text))]


def _names(text: str) -> list[ColumnName | None]:
    return [column_name(entry) for entry in _entries(text)]


def _is_row(text: str) -> bool:
    by_point, by_comma = _entries(text), text.replace(",", ".").replace(";", " ").split()
    return any(len(numbers(entries) or []) >= FEWEST_NUMBERS for entries in (by_point, by_comma))


@dataclasses.dataclass
class _Table:
    """What is found out about a table before its rows are read."""

    path: Path
    first: TextLine
    lines: list[TextLine]
    fields: dict[str, tuple[int, ...]] = dataclasses.field(default_factory=dict)
    columns: int = 0
    separator: str | None = None
    flux_unit: FluxUnit = "lm"
    length_unit: str = "mm"
    wavelength_unit: str = "nm"
    complaints: list[Complaint] = dataclasses.field(default_factory=list)

    @property
    def named(self) -> bool:
        return not _is_row(self.first.text)

    def complain(self, found: str) -> None:
        self.complaints.append(Complaint("warning", f"line {self.first.number}", found, CLAUSE))

    def refuse(self, found: str, advice: str, line: TextLine | None = None) -> NoReturn:
        raise FormatError(self.path, f"line {(line or self.first).number}", found, f"{advice} [{CLAUSE}]")

    # --- bare rows ---------------------------------------------------------------------------------------------------

    def assume_columns(self) -> None:
        separator = _separator(self.first.text)
        entries = _entries(self.first.text)
        if separator == "," and any(" " in entry for entry in entries):
            self.refuse(
                "blanks between the numbers and commas within or between them",
                "Separate the columns by ';' or tabs if the comma is the decimal mark.",
            )
        self.columns = len(entries)
        self.separator = None if separator == "\t" else separator
        if self.columns not in (7, 8):
            self.refuse(f"{self.columns} numbers without names", f"Put a line of names above, like {EXAMPLE}.")
        self.fields = dict(BARE_FIELDS)
        self.complain(
            f"bare numbers: taken as x y z [mm], direction, and flux [lm], because nothing says so. {OVERRULE}"
        )
        if self.columns == 8:
            # The path length in FRED, the wavelength in others.
            self.complain("what column 8 means is not known; it is ignored. A line of column names would tell")

    # --- named columns -----------------------------------------------------------------------------------------------

    def name_columns(self) -> None:
        names = _names(self.first.text)
        entries = _entries(self.first.text)
        self.columns = len(names)
        unknown = [entry for entry, name in zip(entries, names, strict=True) if name is None]
        if unknown:
            self.complain(f"columns that are not known, and are ignored: {', '.join(map(repr, unknown))}")
        separator = _separator(self.first.text)
        # Tabs may be mixed with blanks, unless an entry of an unknown column may contain some.
        self.separator = None if separator == "\t" and not unknown else separator
        places: dict[str, dict[int, int]] = {}
        units: dict[str, set[str]] = {}
        for index, name in enumerate(names):
            if name is None:
                continue
            of_field = places.setdefault(name.field, {})
            if name.component in of_field:
                both = f"{entries[of_field[name.component]]!r} and {entries[index]!r}"
                self.refuse(f"the columns {both} mean the same", "Leave one of them out.")
            of_field[name.component] = index
            units.setdefault(name.field, set()).update([name.unit] if name.unit else [])
        for field, needed in COLUMNS.items():
            if field in places:
                if len(places[field]) < needed:
                    self.refuse(f"{len(places[field])} of {needed} {field} columns", f"Name them like {EXAMPLE}.")
                self.fields[field] = tuple(places[field][i] for i in range(needed))
        for field in ("direction", "flux"):
            if field not in self.fields:
                self.refuse(f"no column is the {field}", f"Name it like {EXAMPLE}.")
        self.settle_units(units)

    def settle_units(self, units: dict[str, set[str]]) -> None:
        for field, known in (
            ("position", tuple(MM_PER_LENGTH_UNIT)),
            ("flux", ("lm", "W")),
            ("wavelength", ("nm", "um")),
        ):
            stated = units.get(field, set())
            if len(stated) > 1 or not stated <= set(known):
                self.refuse(f"unit {' and '.join(sorted(stated))} of the {field}", f"Give one of: {', '.join(known)}.")
        if "position" in self.fields:
            self.length_unit = next(iter(units["position"]), "")
            if not self.length_unit:
                self.length_unit = "mm"
                self.complain("the length unit is not stated; taken as mm (in Python, RaySet.scaled changes it)")
        flux = next(iter(units["flux"]), "")
        self.flux_unit = "W" if flux == "W" else "lm"
        if not flux:
            self.complain(f"the flux unit is not stated; taken as lm. {OVERRULE}")
        if "wavelength" in self.fields:
            self.wavelength_unit = next(iter(units["wavelength"]), "")
            if not self.wavelength_unit:
                self.wavelength_unit = "nm"
                self.complain("the unit of the wavelength is not stated; taken as nm")

    # --- rows --------------------------------------------------------------------------------------------------------

    def decimal_comma(self) -> bool:
        """Whether numbers are written ``0,5``; possible only where a comma does not separate columns."""
        separator = _separator(self.first.text)
        if separator not in (";", "\t"):
            return False
        below = [line for line in self.lines if line.number >= self.first.number + self.named]
        marks: set[str] = set()
        for line in below:
            if not line.text or line.text.startswith(COMMENTS):
                continue
            entries = line.text.split(self.separator)
            used = [
                entries[column] for of_field in self.fields.values() for column in of_field if column < len(entries)
            ]
            marks |= {mark for mark in ".," if any(mark in entry for entry in used)}
            if len(marks) > 1:
                self.refuse(
                    "both decimal points and commas: whether a comma is a decimal mark is not certain",
                    "Write all numbers with decimal points.", line,
                )  # fmt: skip
        return marks == {","}

    def facts(self) -> dict[str, str]:
        """Comment lines ``# key: value`` of a table that étendue wrote."""
        above = [line.text for line in self.lines if line.number < self.first.number]
        if not above or above[0] != TITLE:
            return {}
        pairs = (text.lstrip("# ").split(": ", 1) for text in above[1:] if ": " in text)
        return {key: value for key, value in pairs}  # noqa: C416 - dict() would not be typed

    def layout(self) -> RowLayout:
        return RowLayout(
            fields=self.fields,
            columns=self.columns,
            clause=CLAUSE,
            separator=self.separator,
            decimal_comma=self.decimal_comma(),
            comments=COMMENTS,
            expected=whole(self.facts().get("rays", "")),
            stated_at="comment 'rays'",
        )


def read(path: Path) -> RaySet:
    """Read a ray table. The rays' flux is absolute.

    Columns are known by the usual names in any case and order: ``x y z``; ``l m n``, ``kx ky kz`` and alike; ``flux``,
    ``power``, ``intensity`` or ``energy``; ``wavelength``. Units stand in brackets or behind an underscore. Columns are
    separated by commas, semicolons, tabs or blanks; beside semicolons and tabs the decimal mark may be a comma.

    Raises
    ------
    FormatError
        If a column is missing or there twice, a unit is unknown, decimal marks are ambiguous, or a row is not one.
    """
    head = Head.of(path)
    first = _first_line(head)
    if first is None:
        raise FormatError(path, "line 1", "no row of numbers", f"The file is empty or truncated. [{CLAUSE}]")
    table = _Table(path, first, head_lines(head))
    if table.named:
        table.name_columns()
        rows = read_rows(path, table.layout(), offset=first.end, line=first.number + 1)
    else:
        table.assume_columns()
        rows = read_rows(path, table.layout(), offset=first.start, line=first.number)
    meaning = RaySetMeaning(
        flux_unit=table.flux_unit,
        length_scale=MM_PER_LENGTH_UNIT[table.length_unit],
        wavelength_scale=NM_PER_UM if table.wavelength_unit == "um" else 1.0,
        header=table.facts(),
        complaints=(*table.complaints, *rows.complaints, *wavelength_complaints(rows.records, CLAUSE)),
        provenance=file_provenance(path, "csv"),
    )
    return RaySet.from_records(rows.records, meaning)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a ray table, from which every number comes back bit by bit."""
    colour = RayColour.of(rays)
    names = [*(("x_mm", "y_mm", "z_mm") if rays.has_position else ()), "l", "m", "n", f"flux_{rays.flux_unit}"]
    names += ["wavelength_nm"] if colour.has_wavelengths else []

    def columns(batch: RayBatch) -> list[FloatArray]:
        before = [*geometry(rays, batch), batch.flux]
        return [*before, colour.wavelength(batch)] if colour.has_wavelengths else before

    count = usable_rays(rays)
    source = re.sub(r"[^\x20-\x7e]", "?", rays.provenance.source)
    header = (TITLE, f"# software: etendue {version()}", f"# source: {source}", f"# rays: {count}", ",".join(names))
    with path.open("wb") as file:
        file.write("".join(f"{line}\n" for line in header).encode("ascii"))
        written = write_rows(file, rays, columns, separator=",", end_of_line="\n")
    return losses(rays, written, colour, colour_kept=colour.has_wavelengths)


FORMAT = RayFormat("csv", "ray table", (".csv",), recognise, read, write, far_field=True, value_bytes=2)
"""Ray tables. They are read from ``.asc`` and ``.txt`` too, which are not theirs alone."""
