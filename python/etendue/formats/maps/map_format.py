"""What every file format for maps has to offer, and the guards its reader stands behind."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path

from etendue.errors import FormatError
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.memory import require_memory

AnyMap = LuminanceMap | IlluminanceMap
"""What a map file may hold: its header names the quantity."""

DAMAGED = "The file is damaged or cut short: copy it again, or make the map again."

PIXEL_BYTES = 48
"""Of a pixel in memory: as the file has it, and as the map has it."""

DEFLATE_RATIO = 1032
"""The largest factor by which deflate can shrink anything: 258 bytes into 2 bits."""


@dataclasses.dataclass(frozen=True)
class MapFormat:
    """One file format for maps of luminance, and of illuminance where it has room for them.

    Parameters
    ----------
    name : str
        Its name in messages and in the registry.
    extensions : tuple of str
        File extensions that choose it when a map is saved, lower case with the dot; the first one is the usual one.
    sniff : callable
        Whether a file that begins with these bytes (at least 32, unless it is shorter) is of this format.
    read : callable
        From a path to the map. Raises `FormatError` for whatever is wrong with the file.
    write : callable
        Writes a map to a path (which exists, empty) and returns what the format could not express.
    """

    name: str
    extensions: tuple[str, ...]
    sniff: Callable[[bytes], bool]
    read: Callable[[Path], AnyMap]
    write: Callable[[AnyMap, Path], tuple[str, ...]]


@contextlib.contextmanager
def parsing(path: Path, place: str) -> Iterator[None]:
    """Turn whatever a parser raises over damaged bytes into a `FormatError` that names file and place."""
    try:
        yield
    except (FormatError, MemoryError):
        raise
    # Decoders of other makers raise anything over damaged bytes, from zlib.error to AttributeError.
    except Exception as error:
        raise FormatError(path, place, f"{type(error).__name__}: {error}", DAMAGED) from error


def check_room(path: Path, pixels: int, bytes_per_pixel: int, ratio: int = DEFLATE_RATIO) -> None:
    """Refuse a file that is too short for the pixels it claims, before memory is set aside for them.

    Parameters
    ----------
    path : Path
        The file.
    pixels, bytes_per_pixel : int
        What it claims to hold, unpacked.
    ratio : int
        Largest factor by which the format may pack.

    Raises
    ------
    FormatError
        If the file cannot hold that much.
    MemoryLimitError
        If there is no room for it.
    """
    size = path.stat().st_size
    if pixels * bytes_per_pixel > ratio * size:
        raise FormatError(path, "pixels", f"the header claims {pixels} pixels, the file has only {size} bytes", DAMAGED)
    require_memory(PIXEL_BYTES * pixels, f"{path}: a map of {pixels:,} pixels")
