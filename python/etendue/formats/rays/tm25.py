"""TM-25 ray files (``.tm25ray``): ANSI/IES TM-25-13 and TM-25-20.

A header, nine descriptions, spectral tables, labels of additional columns, additional text, and then one record of
32-bit values per ray. All values are little-endian, text is UTF-32. Clause numbers are those of the standard.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from etendue.errors import ArgumentError, FormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat, stored_records
from etendue.formats.rays.shared import (
    CHECKED_RAYS,
    STRETCH,
    Records,
    read_bytes,
    stated_total,
    text,
    wavelength_complaints,
    whole_records,
)
from etendue.formats.rays.tm25_layout import (
    BLOCK,
    CREATION_METHODS,
    DESCRIPTION_BYTES,
    DESCRIPTION_OFFSET,
    DESCRIPTIONS,
    FLAGS,
    HEADER,
    HEADER_BYTES,
    LABEL_BYTES,
    MAGIC,
    START_POSITIONS,
    TABLES_OFFSET,
    VERSIONS,
    Columns,
    Spectral,
    decode,
    padded,
)
from etendue.formats.rays.tm25_writer import wants_watts, write
from etendue.quantities.file_records import AnyRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import Spectrum
from etendue.quantities.spool import spool

MAX_TABLES = 1 << 20
MAX_TABLE_BYTES = 1 << 28
MAX_ADDITIONAL = 1 << 12
MAX_TEXT_BYTES = 1 << 20
"""Counts above these are damage, not data (the text is merely cut): nothing is allocated on the word of a header."""


@dataclasses.dataclass(frozen=True)
class _Header:
    """The fixed blocks of a file, as stored."""

    version: int
    creation_method: int
    luminous_flux: float | None
    radiant_flux: float | None
    rays: int
    date: str
    start_position: int
    spectral: int
    single_wavelength: float
    tables: int
    additional: int
    text_bytes: int
    flags: tuple[int, ...]
    descriptions: dict[str, str]

    @classmethod
    def parse(cls, data: bytes) -> _Header:
        (_, version, method, _, _, rays, date, start, spectral, single, _, _, tables, additional, text_bytes) = (
            HEADER.unpack_from(data)
        )
        starts = range(DESCRIPTION_OFFSET, TABLES_OFFSET, DESCRIPTION_BYTES)
        texts = [decode(data[at : at + DESCRIPTION_BYTES]).strip() for at in starts]
        return cls(
            version=version,
            creation_method=method,
            luminous_flux=stated_total(data[12:16]),
            radiant_flux=stated_total(data[16:20]),
            rays=rays,
            date=text(date),
            start_position=start,
            spectral=spectral,
            single_wavelength=single,
            tables=tables,
            additional=additional,
            text_bytes=text_bytes,
            flags=FLAGS.unpack_from(data, HEADER_BYTES),
            descriptions=dict(zip(DESCRIPTIONS, texts, strict=True)),
        )

    def columns(self, *, axis: bool) -> Columns:
        """The columns that the flags describe."""
        _, _, radiant, wavelength, luminous, stokes, tristimulus, index = map(bool, self.flags)
        return Columns(radiant, wavelength, luminous, stokes, stokes and axis, tristimulus, index, self.additional)


def recognise(head: Head) -> bool:
    """By the magic bytes (4.7.1.1)."""
    return head.data.startswith(MAGIC)


def read(path: Path) -> RaySet:
    """Map a TM-25 file.

    The flux is the luminous one if the rays have it (a radiant one beside it becomes the column ``radiant_flux``),
    else the radiant one; it is relative and scaled to the header's total, if that is known. Violations of the standard
    that leave the meaning certain become complaints.

    Raises
    ------
    FormatError
        If the file is damaged or truncated before its first ray, the rays have no flux, or the size of the file fits
        no reading of its header.
    """
    header = _Header.parse(read_bytes(path, 0, TABLES_OFFSET, "header"))
    _refuse_impossible(path, header)
    size = path.stat().st_size
    with path.open("rb") as file:
        tables, tables_end = _read_tables(file, path, header.tables, size)
    place, rays, tail = _find_rays(path, header, tables_end, size)
    columns, start = place.columns, place.start
    labels = read_bytes(path, place.labels, LABEL_BYTES * header.additional, "column labels")
    text_bytes = min(header.text_bytes, MAX_TEXT_BYTES)
    extra_text = decode(read_bytes(path, place.labels + len(labels), text_bytes, "additional text"))
    spectra, table_complaints = _spectra(header, tables)
    records: AnyRecords = stored_records(path, columns.record, start, rays)
    if tail and not _directions_are_unit(records):
        found = "the file has not the size that its header describes, and no directions stand where they should"
        raise FormatError(path, f"byte {start}", found, "The file is damaged; ask for it again.")
    records, index_complaints = _with_integer_index(records, header.tables)
    total, facts, total_complaints = _facts(header, columns)
    if labels:
        blocks = range(0, len(labels), LABEL_BYTES)
        facts["additional_labels"] = tuple(decode(labels[at : at + LABEL_BYTES]).strip() for at in blocks)
    if extra_text:
        facts["additional_text"] = extra_text
    single = (
        header.spectral == Spectral.SINGLE and np.isfinite(header.single_wavelength) and header.single_wavelength > 0
    )
    meaning = RaySetMeaning(
        flux_unit="lm" if columns.luminous else "W",
        declared_flux=total,
        spectra=spectra,
        single_wavelength=float(header.single_wavelength) if single else None,
        header=facts,
        complaints=(
            *_header_complaints(header, columns),
            *total_complaints,
            *table_complaints,
            *tail,
            *index_complaints,
            *wavelength_complaints(records, "TM-25 4.8.1.8"),
        ),
        provenance=file_provenance(path, "tm25"),
    )
    return RaySet.from_records(records, meaning)


def _refuse_impossible(path: Path, header: _Header) -> None:
    for offset, name, value, limit in (
        (76, "spectral tables", header.tables, MAX_TABLES),
        (80, "additional columns", header.additional, MAX_ADDITIONAL),
        (84, "bytes of additional text", header.text_bytes, 2**31),
    ):
        if not 0 <= value <= limit:
            raise FormatError(path, f"byte {offset}", f"{value:,} {name}", "The file is damaged; ask for it again.")
    if not (header.flags[2] or header.flags[4]):
        raise FormatError(
            path,
            "byte 264",
            "the rays have neither radiant nor luminous flux",
            "Ask for a file with flux. [TM-25 4.7.2]",
        )


# --- where the rays are ----------------------------------------------------------------------------------------------


def _read_tables(file: BinaryIO, path: Path, count: int, size: int) -> tuple[list[Records], int]:
    """The spectral tables (4.7.4), each of shape (pairs, 2), and the byte at which they end before padding."""
    tables, at = [], TABLES_OFFSET
    file.seek(at)
    for number in range(1, count + 1):
        data = file.read(4)
        pairs = int.from_bytes(data, "little", signed=True) if len(data) == 4 else -1
        end = at + 4 + 8 * pairs
        if pairs < 0 or end > size or end - TABLES_OFFSET > MAX_TABLE_BYTES:
            stated = pairs if len(data) == 4 else "missing"
            found = f"spectral table {number} of {count:,} should begin here, but its number of pairs is {stated}"
            raise FormatError(path, f"byte {at}", found, "The file is damaged or truncated; ask for it again.")
        tables.append(np.frombuffer(file.read(8 * pairs), "<f4").reshape(-1, 2))
        at = end
    return tables, at


@dataclasses.dataclass(frozen=True)
class _Place:
    """One reading of where things are: the columns of the rays, the first byte of the labels and of the rays."""

    columns: Columns
    labels: int
    start: int


def _find_rays(path: Path, header: _Header, tables_end: int, size: int) -> tuple[_Place, int, tuple[Complaint, ...]]:
    """Where the rays are, how many, and what is wrong with that.

    The first reading is the standard's. The others are known faults: Stokes parameters without the axis, and blocks
    that were not padded. One of them counts only if it fits the file's size exactly.
    """
    tables_bytes = tables_end - TABLES_OFFSET
    readings = [
        _Place(columns, labels, labels + LABEL_BYTES * header.additional + text_block)
        for columns in (header.columns(axis=True), header.columns(axis=False))
        for labels in (TABLES_OFFSET + padded(tables_bytes), tables_end)
        for text_block in (header.text_bytes, padded(header.text_bytes))
    ]
    fitting = [place for place in readings if place.start + header.rays * place.columns.record.itemsize == size]
    standard, columns = readings[0], readings[0].columns
    if not fitting and columns.stokes and header.version == VERSIONS[0]:
        found = f"the rays have Stokes parameters, but neither three nor six columns of them fit {size:,} bytes"
        raise FormatError(path, "byte 276", found, "The file is truncated; ask for it again.")
    place = fitting[0] if fitting else standard
    count, tail = whole_records(path, place.start, place.columns.record.itemsize, header.rays, "TM-25 4.7.1.6")
    complaints = list(tail)
    if place.start != standard.start:
        found = f"the rays start at byte {place.start}, not {standard.start}: a block is not padded to {BLOCK} bytes"
        complaints.append(Complaint("warning", f"byte {place.start}", found, "TM-25 4.7.4"))
    if place.columns.stokes and not place.columns.axis:
        found = "the Stokes parameters come without the axis of the polarisation ellipse"
        complaints.append(Complaint("warning", "byte 276", found, "TM-25 4.8.1.13"))
    return place, count, tuple(complaints)


def _directions_are_unit(records: AnyRecords) -> bool:
    """Whether most of the first directions are unit vectors; they are not if the columns are shifted."""
    with np.errstate(all="ignore"):
        k = records[:1024]["direction"].astype(np.float64)
        norm = np.sqrt(np.einsum("ij,ij->i", k, k))
    return bool(np.mean(np.abs(norm - 1) < 1e-3) > 0.5)


def _with_integer_index(records: AnyRecords, tables: int) -> tuple[AnyRecords, tuple[Complaint, ...]]:
    """Records whose spectrum index is an integer; some software stores it as a float (the standard: 4.8.1.18, i32).

    An integer from 1 to 2²³ is a denormal float, so the two cannot be confused.
    """
    if "spectrum_index" not in (records.dtype.names or ()):
        return records, ()
    stored = records[:CHECKED_RAYS]["spectrum_index"]
    if ((stored >= 1) & (stored <= tables)).all():
        return records, ()
    floats = np.ascontiguousarray(stored).view("<f4")
    with np.errstate(invalid="ignore"):
        whole = (floats >= 1) & (floats <= tables) & (floats == np.floor(floats))
    if whole.all():
        converted = spool(_converted(records), records.dtype)
        found = "the spectrum indices are stored as floats, not as integers"
        return converted, (Complaint("warning", "rays", found, "TM-25 4.8.1.18"),)
    found = f"some of the first {len(stored):,} rays point to a spectrum outside 1..{tables}"
    return records, (Complaint("warning", "rays", found, "TM-25 4.8.1.18"),)


def _converted(records: AnyRecords) -> Iterator[Records]:
    for at in range(0, len(records), STRETCH):
        part = np.array(records[at : at + STRETCH])
        floats = np.ascontiguousarray(part["spectrum_index"]).view("<f4")
        # What is no index in either reading becomes 0, which points to nothing.
        valid = (floats >= 1) & (floats < 2**31)
        part["spectrum_index"] = np.where(valid, np.rint(np.where(valid, floats, 0)), 0).astype("<i4")
        yield part


# --- what it means ---------------------------------------------------------------------------------------------------


def _spectra(header: _Header, tables: list[Records]) -> tuple[tuple[Spectrum, ...], list[Complaint]]:
    """The spectra that the rays use, and complaints about the tables."""
    place, clause = f"byte {TABLES_OFFSET}", "TM-25 4.7.4"
    uses = header.spectral in (Spectral.ONE_SPECTRUM, Spectral.INDEXED)
    if not uses:
        found = f"{len(tables)} spectral tables, which spectral identifier {header.spectral} does not use"
        return (), [Complaint("note", place, found, clause)] if tables else []
    if not tables:
        found = f"spectral identifier {header.spectral} needs spectral tables, but there are none"
        return (), [Complaint("warning", "byte 76", found, "TM-25 4.7.1.13")]
    complaints = []
    if header.spectral == Spectral.ONE_SPECTRUM and len(tables) > 1:
        found = f"{len(tables)} spectral tables for one spectrum; the first is used"
        complaints.append(Complaint("warning", "byte 76", found, "TM-25 4.7.1.13"))
        tables = tables[:1]
    spectra = []
    for number, table in enumerate(tables, 1):
        try:
            with np.errstate(invalid="ignore"):  # NaN is refused by Spectrum, whether it signals or not
                spectra.append(Spectrum(table[:, 0], table[:, 1]))
        except ArgumentError as error:
            found = f"spectral table {number} is unusable, so all are left out: {error}"
            return (), [*complaints, Complaint("warning", place, found, clause)]
    return tuple(spectra), complaints


def _total(header: _Header, columns: Columns) -> tuple[float | None, list[Complaint]]:
    """The header's total of the flux column, or None if it is unknown."""
    own, other = header.radiant_flux, header.luminous_flux
    name, place, clause = "radiant", "byte 16", "TM-25 4.7.1.5"
    if columns.luminous:
        own, other = other, own
        name, place, clause = "luminous", "byte 12", "TM-25 4.7.1.4"
    if own is not None:
        return own, []
    if not columns.luminous and other is not None and header.descriptions["creator"].startswith("LightTools"):
        found = f"LightTools puts the total in the place of lumens (byte 12): {other:.7g} is taken as the rays' watts"
        return other, [Complaint("warning", place, found, clause)]
    found = f"the total {name} flux is unknown; the rays' own values are taken as absolute"
    return None, [Complaint("warning", place, found, clause)]


def _facts(header: _Header, columns: Columns) -> tuple[float | None, dict[str, Any], list[Complaint]]:
    """The total that belongs to the flux column, the header's facts for people, and complaints about the total."""
    start = header.start_position
    known_start = 0 <= start < len(START_POSITIONS)
    facts: dict[str, Any] = {
        "version": header.version,
        "date": header.date,
        "creation_method": CREATION_METHODS.get(header.creation_method, str(header.creation_method)),
        "start_position": START_POSITIONS[start] if known_start else str(start),
        **{name: value for name, value in header.descriptions.items() if value},
    }
    totals = {"luminous_flux": header.luminous_flux, "radiant_flux": header.radiant_flux}
    facts |= {name: value for name, value in totals.items() if value is not None}
    total, complaints = _total(header, columns)
    if total is not None:
        facts["total_flux"] = total
    return total, facts, complaints


def _header_complaints(header: _Header, columns: Columns) -> Iterator[Complaint]:
    """Everything in which the header offends the standard (4.7.1, 4.7.2)."""
    if header.version not in VERSIONS:
        yield Complaint("warning", "byte 4", f"version {header.version}, not 2013 or 2020", "TM-25 4.7.1.2")
    if header.creation_method not in CREATION_METHODS:
        found = f"creation method {header.creation_method}, not 0 (simulation) or 1 (measurement)"
        yield Complaint("warning", "byte 8", found, "TM-25 4.7.1.3")
    if not 0 <= header.start_position < len(START_POSITIONS):
        yield Complaint("warning", "byte 56", f"start position {header.start_position}, not 0 to 7", "TM-25 4.7.1.8")
    if header.text_bytes % BLOCK:
        found = f"{header.text_bytes} bytes of additional text, not a multiple of {BLOCK}"
        yield Complaint("warning", "byte 84", found, "TM-25 4.7.1.15")
    for number, flag in enumerate(header.flags):
        if flag not in (0, 1):
            found = f"known-data flag {number + 1} is {flag}, not 0 or 1; taken as 1"
            yield Complaint("warning", f"byte {HEADER_BYTES + 4 * number}", found, "TM-25 4.7.2")
    if not (header.flags[0] and header.flags[1]):
        found = "the flags deny position or direction, which every ray has"
        yield Complaint("warning", "byte 256", found, "TM-25 4.7.2")
    yield from _spectral_complaints(header, columns)


def _spectral_complaints(header: _Header, columns: Columns) -> Iterator[Complaint]:
    kind = header.spectral
    if kind not in list(Spectral):
        yield Complaint("warning", "byte 60", f"spectral identifier {kind}, not 0 to 4; taken as 0", "TM-25 4.7.1.9")
    if kind == Spectral.SINGLE and not (np.isfinite(header.single_wavelength) and header.single_wavelength > 0):
        found = f"the single wavelength is {header.single_wavelength} nm; the colour is unknown"
        yield Complaint("warning", "byte 64", found, "TM-25 4.7.1.10")
    per_ray, indexed = kind == Spectral.PER_RAY, kind == Spectral.INDEXED
    for offends, found in (
        (
            per_ray != columns.wavelength,
            "a wavelength per ray (flag 4) goes with spectral identifier 2, and only with it",
        ),
        (
            indexed != columns.index,
            "a spectrum index per ray (flag 8) goes with spectral identifier 4, and only with it",
        ),
        ((per_ray or indexed) and not columns.radiant, f"spectral identifier {kind} needs radiant flux (flag 3)"),
        ((per_ray or indexed) and columns.luminous, f"spectral identifier {kind} excludes luminous flux (flag 5)"),
        (columns.stokes and not columns.radiant, "Stokes parameters (flag 6) need radiant flux (flag 3)"),
        (columns.tristimulus and not columns.luminous, "tristimulus values (flag 7) need luminous flux (flag 5)"),
        (columns.tristimulus and kind != Spectral.NONE, "tristimulus values (flag 7) need spectral identifier 0"),
    ):
        if offends:
            yield Complaint("warning", "byte 256", found, "TM-25 4.7.2")


FORMAT = RayFormat("tm25", "IES TM-25 ray file", (".tm25ray", ".tm25"), recognise, read, write, wants_watts=wants_watts)
"""TM-25 ray files."""
