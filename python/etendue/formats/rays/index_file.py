"""The file of a ray index (``.etd``); docs/formats/ray-index.md describes it byte by byte."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError, FormatError
from etendue.formats.head import file_provenance
from etendue.formats.rays.index_building import SIDES, Counted, IndexTables, Records, leaf_count
from etendue.formats.rays.ray_format import stored_records
from etendue.formats.rays.shared import read_bytes
from etendue.formats.strict_json import strict_json
from etendue.quantities.file_records import AnyRecords
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_stream import Tally
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import Spectrum

MAGIC = b"\x89ETD\r\n\x1a\n"
"""No text begins so, and a transfer that changes line ends or the eighth bit changes it."""

VERSION = 1
HEADER = struct.Struct("<8sIIQQIIQQII")
"""Magic, version, side, rays, leaves, rays of a leaf, bytes of a record, bytes of the JSON text, first byte of the
records, checksum, 0."""

CHECKSUM_AT = 56
BLOCK = 64
PAGE = 4096
BOUNDS_BYTES = 32
ZEROS = bytes(1 << 24)

DAMAGED = "The file is damaged or cut short: copy it again, or build the index again."


@dataclasses.dataclass(frozen=True)
class Place:
    """Where things stand in a file [bytes].

    Parameters
    ----------
    json, starts, bounds, records : int
        First byte of each.
    end : int
        Size of the file.
    """

    json: int
    starts: int
    bounds: int
    records: int
    end: int

    @classmethod
    def of(cls, json_bytes: int, cells: int, leaves: int, rays: int, width: int) -> Place:
        """By the sizes of the parts."""
        starts = _padded(HEADER.size + json_bytes, BLOCK)
        bounds = _padded(starts + 8 * (cells + 1), BLOCK)
        records = _padded(bounds + BOUNDS_BYTES * leaves, PAGE)
        return cls(HEADER.size, starts, bounds, records, records + width * rays)


def _padded(size: int, block: int) -> int:
    return -(-size // block) * block


# --- writing ---------------------------------------------------------------------------------------------------------


def map_new(path: Path, counted: Counted, text: bytes) -> Records:
    """Set the room for an index aside on the disk, and map its records for writing.

    Raises
    ------
    OSError
        If the disk has no room: now, since a mapped file that finds none later ends the program.
    """
    place = _place(counted, text)
    with path.open("r+b") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, place.end)
        else:
            for at in range(0, place.end, len(ZEROS)):
                file.write(ZEROS[: place.end - at])
    return np.memmap(path, dtype=counted.dtype, mode="r+", offset=place.records, shape=(counted.rays,))


def write_tables(path: Path, counted: Counted, tables: IndexTables, text: bytes) -> None:
    """Write all that stands before the records."""
    place = _place(counted, text)
    with path.open("r+b") as file:
        for at, data in ((place.json, text), (place.starts, tables.starts), (place.bounds, tables.bounds)):
            file.seek(at)
            file.write(data if isinstance(data, bytes) else data.tobytes())
        file.seek(0)
        header = HEADER.pack(
            MAGIC, VERSION, tables.side, counted.rays, counted.leaves, _core.index_leaf(), counted.dtype.itemsize,
            len(text), place.records, 0, 0,
        )  # fmt: skip
        file.write(header)
        check = _checksum(file, place.records)
        file.seek(CHECKSUM_AT)
        file.write(struct.pack("<I", check))


def _place(counted: Counted, text: bytes) -> Place:
    return Place.of(len(text), len(counted.starts) - 1, counted.leaves, counted.rays, counted.dtype.itemsize)


def _checksum(file: BinaryIO, size: int) -> int:
    """CRC-32 of the first `size` bytes of a file, those of the checksum itself taken as 0."""
    file.seek(0)
    check = zlib.crc32(_head(file.read(HEADER.size)))
    done = HEADER.size
    while data := file.read(min(len(ZEROS), size - done)):
        check = zlib.crc32(data, check)
        done += len(data)
    return check


def _head(data: bytes) -> bytes:
    """The header with the checksum taken as 0."""
    return data[:CHECKSUM_AT] + bytes(4) + data[CHECKSUM_AT + 4 :]


def text_of(meaning: RaySetMeaning, dtype: np.dtype[Any], tally: Tally, centre: tuple[float, float, float]) -> bytes:
    """The JSON text: what the columns are and mean, the flux account, where the rays come from."""
    fields: Mapping[str, Any] = dtype.fields or {}
    columns = [
        {"name": name, "type": field[0].base.str, "shape": list(field[0].shape), "offset": field[1]}
        for name, field in fields.items()
    ]
    values = {f.name: getattr(meaning, f.name) for f in dataclasses.fields(meaning)}
    values |= {
        "header": dict(meaning.header),
        "spectra": [[s.wavelength.tolist(), s.weight.tolist()] for s in meaning.spectra],
        "complaints": [complaint.to_dict() for complaint in meaning.complaints],
        "provenance": meaning.provenance.to_dict(),
    }
    content = {"columns": columns, "meaning": values, "tally": dataclasses.asdict(tally), "centre": list(centre)}
    return json.dumps(_plain(content), ensure_ascii=False, allow_nan=False).encode()


def _plain(data: Any) -> Any:
    """Data as JSON has them; what is not finite is unknown."""
    if isinstance(data, Mapping):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data if data is None or isinstance(data, str | int | float | bool) else str(data)


# --- reading ---------------------------------------------------------------------------------------------------------


def read_index(path: Path) -> tuple[AnyRecords, RaySetMeaning, IndexTables, Tally]:
    """Open an index: records, which stay in the file, what they mean, tables, and the flux account.

    Raises
    ------
    FormatError
        If the file is no index, of another version, cut short or damaged. Everything before the records is under a
        checksum.
    """
    data = read_bytes(path, 0, HEADER.size, "header")
    magic, version, side, rays, leaves, leaf, width, text_bytes, start, checksum, rest = HEADER.unpack(data)
    if magic != MAGIC:
        raise FormatError(
            path, "byte 0", f"{magic!r} begins no ray index", "Give a file (.etd) that `etendue convert` wrote."
        )
    if version != VERSION:
        raise FormatError(path, "byte 8", f"version {version}", f"This étendue reads {VERSION}; update it.")
    if side not in SIDES or leaf != _core.index_leaf() or rest != 0 or rays == 0:
        found = f"{rays:,} rays by {leaf} in a leaf, {side} cells along a side, and {rest} where 0 should be"
        raise FormatError(path, "byte 12", found, DAMAGED)
    cells, size = 2 * side * side, path.stat().st_size
    place = Place.of(text_bytes, cells, leaves, rays, width)
    if (place.records, place.end) != (start, size):
        found = f"the header describes {place.end:,} bytes with the records from byte {place.records:,}"
        raise FormatError(path, f"byte {size}", f"{found}; the file has {size:,}, from {start:,}", DAMAGED)
    tables = read_bytes(path, 0, start, "tables")
    found_checksum = zlib.crc32(tables[HEADER.size :], zlib.crc32(_head(tables[: HEADER.size])))
    if found_checksum != checksum:
        found = f"the checksum is {checksum:08x}, but that of header and tables {found_checksum:08x}"
        raise FormatError(path, f"byte {CHECKSUM_AT}", found, DAMAGED)
    try:
        content = strict_json(tables[place.json : place.json + text_bytes])
        dtype = _dtype(content["columns"], width)
        tally = Tally(**content["tally"])
        meaning = _meaning(content["meaning"], path)
        x, y, z = map(float, content["centre"])
    # Whatever a text that somebody made up may lead to.
    except (ArgumentError, AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError) as error:
        found = f"the JSON text is not that of an index: {type(error).__name__}: {error}"
        raise FormatError(path, f"byte {place.json}", found, DAMAGED) from error
    starts = np.frombuffer(tables, np.dtype("<u8"), cells + 1, place.starts)
    counts = np.diff(starts.astype(np.int64))
    if starts[0] != 0 or int(starts[-1]) != rays or (counts < 0).any() or leaf_count(starts) != leaves:
        found = f"the cells' first rays do not rise from 0 to {rays:,} with {leaves:,} leaves"
        raise FormatError(path, f"byte {place.starts}", found, DAMAGED)
    bounds = np.frombuffer(tables, np.dtype("<f4"), 8 * leaves, place.bounds).reshape(leaves, 8)
    records = stored_records(path, dtype, place.records, rays)
    return records, meaning, IndexTables(side, (x, y, z), starts, bounds), tally


def _dtype(columns: Any, width: int) -> np.dtype[Any]:
    for column in columns:
        if not re.fullmatch(r"(<[fiu][248]|\|[iu]1)", column["type"]):
            raise ValueError(f"column {column['name']!r} of type {column['type']!r}")
    if "position" not in {column["name"] for column in columns}:
        raise ValueError("there is no column 'position'")
    return np.dtype(
        {
            "names": [column["name"] for column in columns],
            "formats": [(column["type"], tuple(column["shape"])) for column in columns],
            "offsets": [column["offset"] for column in columns],
            "itemsize": width,
        }
    )


def _meaning(values: Any, path: Path) -> RaySetMeaning:
    origin = Provenance.from_dict(values["provenance"])
    file = file_provenance(path, "etd")
    came = f"rays of {origin.source} ({origin.format}{', ' * bool(origin.fingerprint)}{origin.fingerprint})"
    facts = {key: tuple(value) if isinstance(value, list) else value for key, value in values["header"].items()}
    changes = {
        "spectra": tuple(Spectrum(np.array(nodes), np.array(weights)) for nodes, weights in values["spectra"]),
        "complaints": tuple(Complaint(**complaint) for complaint in values["complaints"]),
        "provenance": dataclasses.replace(file, steps=(came, *origin.steps, "indexed by direction and position")),
        "header": facts,
    }
    return RaySetMeaning(**(values | changes))
