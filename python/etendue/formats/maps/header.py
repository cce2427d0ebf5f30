"""The header that étendue adds to every map file: geometry, unit, origin and notes, sealed with a checksum."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.maps.map_format import DAMAGED, AnyMap, parsing
from etendue.formats.strict_json import strict_json
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import MAX_PIXELS
from etendue.quantities.pixel_map import MapValues
from etendue.units import FLUX_UNITS, ILLUMINANCE_NAME

MOST_HEADER_BYTES = 1 << 22
"""Of the JSON text, which takes 4 bytes a character in some files: about a thousand pages."""

VERSION = 1
VERSION_KEY = "etendue_map"
CHECKSUM_KEY = "sha256"

FOREIGN = (
    "A luminance map needs its observer, screen size and unit; étendue reads the maps that `etendue luminance` or "
    "LuminanceMap.save wrote. In Python, a LuminanceMap can be made of pixels and the geometry you know."
)


def header_text(lmap: AnyMap) -> str:
    """Everything but the arrays as one line of ASCII JSON.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        The map *as the file holds it*: with its values rounded as the format rounds them, because the checksum
        covers what will be read back.
    """
    header = lmap.header()
    checksum = _checksum(header, lmap.values, lmap.standard_error, lmap.rays)
    return _json({VERSION_KEY: VERSION, CHECKSUM_KEY: checksum, **header})


@dataclasses.dataclass(frozen=True)
class MapHeader:
    """A parsed header, and where it was found.

    Parameters
    ----------
    path : Path
        The file.
    place : str
        Where in the file the header stands.
    data : dict
        What the map's `header` gave.
    checksum : str
        SHA-256 over header and arrays.
    rows, columns : int
        Pixels of the screen.
    """

    path: Path
    place: str
    data: dict[str, Any]
    checksum: str
    rows: int
    columns: int

    @classmethod
    def parse(cls, path: Path, place: str, text: str) -> MapHeader:
        """Read `header_text` back.

        Raises
        ------
        FormatError
            If it is not such a text, or one of a newer version.
        """
        try:
            data = strict_json(text)
        except (ValueError, RecursionError) as error:
            raise FormatError(path, place, f"not valid JSON ({error})", DAMAGED) from error
        if not isinstance(data, dict) or VERSION_KEY not in data:
            raise FormatError(path, place, f"no {VERSION_KEY!r} in the JSON header", FOREIGN)
        version = data.pop(VERSION_KEY)
        if version != VERSION:
            raise FormatError(
                path, place, f"map header version {version!r}", f"This étendue reads {VERSION}; update it."
            )
        with parsing(path, place):
            checksum = data.pop(CHECKSUM_KEY)
            rows, columns = (int(data["screen"][name]) for name in ("rows", "columns"))
        if min(rows, columns) < 1 or rows * columns > MAX_PIXELS:
            raise FormatError(path, place, f"a screen of {rows:,} × {columns:,} pixels", DAMAGED)
        return cls(path, place, data, checksum, rows, columns)

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows, self.columns

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.rows * self.columns

    def restore(
        self,
        values: MapValues,
        standard_error: MapValues,
        rays: npt.NDArray[np.int64],
        *,
        sealed: bool = True,
        notes: tuple[str, ...] = (),
    ) -> AnyMap:
        """Make the map from the arrays that the file held.

        Parameters
        ----------
        values, standard_error, rays : array, shape (rows, columns)
            As the map wants them.
        sealed : bool
            Whether the checksum must agree.
        notes : tuple of str
            What the reader has to add to the map's notes.

        Raises
        ------
        FormatError
            If the header does not describe a map of these arrays, or the checksum disagrees.
        """
        if sealed and _checksum(self.data, values, standard_error, rays) != self.checksum:
            found = "the checksum does not agree: header or pixels changed after étendue wrote them"
            raise FormatError(self.path, self.place, found, DAMAGED)
        with parsing(self.path, self.place):
            _check_plain(self.data)
            kind = IlluminanceMap if self.data["quantity"] in ILLUMINANCE_NAME.values() else LuminanceMap
            lmap = kind.from_header(self.data, values, standard_error, rays)
        return lmap.replace(notes=(*lmap.notes, *notes))


def _check_plain(data: dict[str, Any]) -> None:
    """What the constructors of the quantities take on trust."""
    if data["flux_unit"] not in FLUX_UNITS:
        raise ValueError(f"flux_unit is {data['flux_unit']!r}; known: {', '.join(FLUX_UNITS)}")
    strings = (*data["notes"], *_leaves(data["provenance"]))
    if not all(isinstance(text, str) for text in strings):
        raise ValueError("notes and provenance must be texts")


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from _leaves(item)
    else:
        yield value


def _checksum(header: dict[str, Any], values: MapValues, standard_error: MapValues, rays: npt.NDArray[np.int64]) -> str:
    digest = hashlib.sha256(_json(header).encode("ascii"))
    for array in (values, standard_error):
        # Every NaN is the same NaN: formats keep that a value is missing, not the spare bits of its encoding.
        digest.update(np.ascontiguousarray(np.where(np.isnan(array), np.nan, array), dtype="<f8").data)
    digest.update(np.ascontiguousarray(rays, dtype="<i8").data)
    return digest.hexdigest()


def _json(data: dict[str, Any]) -> str:
    return json.dumps(data, allow_nan=False, sort_keys=True, default=_plain_number)


def _plain_number(value: Any) -> Any:
    """Numpy scalars that a caller gave as angles or sizes."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a map header")
