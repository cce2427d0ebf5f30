"""Files that hold maps of luminance or of illuminance: one module per format, one registry, found by content."""

from __future__ import annotations

import os
from pathlib import Path

from etendue.errors import FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.encodings import in_utf8, refuse_unmarked
from etendue.formats.input import as_path, is_stream, require_readable
from etendue.formats.maps import csv, exr, hdr, npz, tiff
from etendue.formats.maps.map_format import AnyMap, MapFormat
from etendue.formats.other_kind import other_kind
from etendue.formats.output import atomic_output
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap

MAP_FORMATS: dict[str, MapFormat] = {module.FORMAT.name: module.FORMAT for module in (exr, hdr, tiff, npz, csv)}
"""Every format by name."""

PICTURE_EXTENSIONS = (".png", ".svg", ".pdf")
"""Extensions that are drawn instead of written: a picture for people, which no program reads back."""

MAP_EXTENSIONS: tuple[str, ...] = tuple(extension for f in MAP_FORMATS.values() for extension in f.extensions)
"""Extensions of files that hold a map and can be read back."""

SNIFFED_BYTES = 64


def read_map(path: str | os.PathLike[str]) -> LuminanceMap:
    """Read a luminance map that `save_map` wrote; the format is found from the content.

    Parameters
    ----------
    path : path
        A file of any of `MAP_FORMATS`.

    Returns
    -------
    LuminanceMap
        The map. From .npz and .csv exactly the one that was saved; from .exr and .tif rounded to float32; from .hdr
        to 8 bits, without standard errors and ray counts.

    Raises
    ------
    FormatError
        If it is none of the formats, was not written by étendue (observer, screen and unit would be missing), or has
        changed since: a checksum seals header and pixels.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.quantities.observer import Observer, Screen
    >>> from etendue.quantities.provenance import Provenance
    >>> lmap = LuminanceMap([[3.0, np.nan]], [[0.1, np.nan]], [[900, 0]], Observer(0, 0, 1000), Screen(2, 1, 2, 1),
    ...                     provenance=Provenance(software="example"))
    >>> with TemporaryDirectory() as folder:
    ...     lost = save_map(lmap, Path(folder) / "map.npz")
    ...     read_map(Path(folder) / "map.npz").values.tolist(), lost
    ([[3.0, nan]], ())
    """
    lmap = read_any_map(path)
    if not isinstance(lmap, LuminanceMap):
        raise FormatError(
            path,
            "header",
            f"this is a map of {lmap.quantity}",
            "Give a luminance map; in Python, read_illuminance_map reads this one.",
        )
    return lmap


def read_illuminance_map(path: str | os.PathLike[str]) -> IlluminanceMap:
    """Read a map of illuminance that `save_map` wrote; the format is found from the content.

    Parameters
    ----------
    path : path
        A file of any of `MAP_FORMATS` but .hdr.

    Returns
    -------
    IlluminanceMap
        The map. From .npz and .csv exactly the one that was saved; from .exr and .tif rounded to float32.

    Raises
    ------
    FormatError, OSError
        As `read_map`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.quantities.observer import Screen
    >>> desk = IlluminanceMap([[500.0]], [[5.0]], [[900]], Screen(20, 10, 1, 1, "xy"), centre=(1, 2, 3))
    >>> with TemporaryDirectory() as folder:
    ...     lost = desk.save(Path(folder) / "desk.csv")
    ...     read_illuminance_map(Path(folder) / "desk.csv").centre, lost
    ((1.0, 2.0, 3.0), ())
    """
    lmap = read_any_map(path)
    if not isinstance(lmap, IlluminanceMap):
        raise FormatError(
            path,
            "header",
            f"this is a map of {lmap.quantity}",
            "Give an illuminance map; in Python, read_map reads this one.",
        )
    return lmap


def is_map_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file begins as a map does: a picture format that holds maps, an .npz or a table that étendue wrote.

    A pipe is none: looking at its beginning would take that away from whoever reads it.

    Raises
    ------
    OSError
        If the file cannot be opened.
    FormatError
        If it is a text that is not in the encoding that its mark announces.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "rays.txt"
    ...     _ = path.write_text("x y z")
    ...     is_map_file(path)
    False
    """
    path = as_path(path)
    if is_stream(path):
        return False
    with in_utf8(path) as readable:
        head = _head(readable)
    found = next((form for form in MAP_FORMATS.values() if form.sniff(head)), None)
    # Any ZIP archive begins as an .npz does; a map's first member is its header.
    return found is not None and (found is not npz.FORMAT or npz.FIRST_MEMBER in head)


def read_any_map(path: str | os.PathLike[str]) -> AnyMap:
    """Read a map of luminance or of illuminance, whichever the file holds.

    Raises
    ------
    FormatError, OSError
        As `read_map`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.quantities.observer import Screen
    >>> desk = IlluminanceMap([[500.0]], [[5.0]], [[900]], Screen(20, 10, 1, 1, "xy"))
    >>> with TemporaryDirectory() as folder:
    ...     lost = desk.save(Path(folder) / "desk.npz")
    ...     read_any_map(Path(folder) / "desk.npz").quantity
    'illuminance'
    """
    path = as_path(path)
    require_readable(path)
    with in_utf8(path) as readable:
        head = _head(readable)
        for candidate in MAP_FORMATS.values():
            if candidate.sniff(head):
                return candidate.read(readable)
    refuse_unmarked(path, head)
    other = other_kind(path)
    if other is not None:
        raise UnsupportedFormatError(path, "first bytes", f"this is {other.title}, no map", other.advice)
    found = f"no map format begins with {head[:8]!r}" if head else "the file is empty"
    raise FormatError(path, "first bytes", found, f"étendue reads the maps it wrote: {', '.join(MAP_EXTENSIONS)}.")


def _head(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(SNIFFED_BYTES)


def save_map(lmap: AnyMap, path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a map of luminance or of illuminance; the format follows the extension.

    The file appears whole or not at all, and the same map gives the same bytes.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        The map; .hdr holds luminance only.
    path : path
        Ends with an extension of one of `MAP_FORMATS`, or with one of `PICTURE_EXTENSIONS` for a picture.

    Returns
    -------
    tuple of str
        What the format could not express, one sentence each; empty when it holds everything.

    Raises
    ------
    UnknownNameError
        If no format has the extension.
    ArgumentError
        If the directory does not exist or a number is too large for the format.
    """
    path = as_path(path)
    extension = path.suffix.lower()
    if extension in PICTURE_EXTENSIONS:
        lmap.plot(path)
        return ("a picture is for the eye: the numbers of the map cannot be read back from it",)
    for candidate in MAP_FORMATS.values():
        if extension in candidate.extensions:
            with atomic_output(path) as temporary:
                return candidate.write(lmap, temporary)
    raise UnknownNameError("extension of a map file", extension, (*MAP_EXTENSIONS, *PICTURE_EXTENSIONS))
