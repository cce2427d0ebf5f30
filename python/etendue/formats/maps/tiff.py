"""TIFF: three pages of luminance, standard error and ray counts; for image-processing tools."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etendue.errors import FormatError
from etendue.formats.maps.header import FOREIGN, VERSION_KEY, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, check_room, parsing
from etendue.formats.maps.narrow import narrowed, rays_from_uint32, rays_to_uint32

PAGES = {"values": np.dtype(np.float32), "standard_error": np.dtype(np.float32), "rays": np.dtype(np.uint32)}

MAGICS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

CLASSIC_LIMIT = 2**32 - 2**25
"""Bytes of pixels that an ordinary TIFF holds, less room for its directories; above it a BigTIFF is written."""

MOST_TAGS = 1000
"""Of a directory; pictures have some twenty."""

TYPE_BYTES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}
"""Bytes of a value, by the number of its type."""

PAGE_NAME = 285
"""Number of the TIFF tag PageName."""


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write pages of luminance [cd/m²] and standard error (float32) and of rays (uint32, 2³²-1 where unknown).

    NaN in the first page is a dead pixel. The description of the first page holds the header as JSON, its resolution
    the size of the pixels.
    """
    import tifffile

    stored, lost = narrowed(lmap)
    pages = {
        "values": stored.values.astype(np.float32),
        "standard_error": stored.standard_error.astype(np.float32),
        "rays": rays_to_uint32(stored.rays),
    }
    screen = stored.screen
    pixels_per_cm = (10.0 * screen.columns / screen.width, 10.0 * screen.rows / screen.height)
    big = sum(page.nbytes for page in pages.values()) > CLASSIC_LIMIT
    with tifffile.TiffWriter(path, bigtiff=big, byteorder="<") as writer:
        for name, page in pages.items():
            writer.write(
                page,
                photometric="minisblack",
                description=header_text(stored) if name == "values" else None,
                metadata=None,
                software=stored.provenance.software.encode("ascii", "replace").decode("ascii"),
                resolution=pixels_per_cm,
                resolutionunit="CENTIMETER",
                extratags=[(PAGE_NAME, "s", 0, name, True)],
            )
    return lost


def read(path: Path) -> AnyMap:
    """Read what `write` wrote."""
    import tifffile

    _check_directories(path)
    with parsing(path, "TIFF directories"), tifffile.TiffFile(path) as file:
        text = file.pages.first.description
        if VERSION_KEY not in text:
            raise FormatError(path, "description of page 1", "not a header of étendue", FOREIGN)
        header = MapHeader.parse(path, "description of page 1", text)
        if len(file.pages) != len(PAGES):
            raise FormatError(path, "pages", f"found {len(file.pages)}, expected {', '.join(PAGES)}", DAMAGED)
        check_room(path, header.pixels, sum(dtype.itemsize for dtype in PAGES.values()))
        arrays = {}
        for number, (name, dtype) in enumerate(PAGES.items()):
            page = file.pages[number].aspage()
            if page.shape != header.shape or page.dtype != dtype:
                found = f"{page.dtype} of shape {page.shape}, expected {dtype} of {header.shape}"
                raise FormatError(path, f"page {number + 1} ({name})", found, DAMAGED)
            if page.compression != tifffile.COMPRESSION.NONE:
                found = f"packed by {tifffile.COMPRESSION(page.compression).name}"
                raise FormatError(path, f"page {number + 1} ({name})", found, "Save it without compression.")
            arrays[name] = page.asarray(maxworkers=1)
    values, error = (arrays[name].astype(np.float64) for name in ("values", "standard_error"))
    return header.restore(values, error, rays_from_uint32(arrays["rays"]))


def _check_directories(path: Path) -> None:
    """Refuse tags that announce more bytes than the file has: the library makes room for them before it looks.

    [TIFF1992]_, section 2; the directories of BigTIFF have wider counts and offsets.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(16)
        order = "<" if head.startswith(b"II") else ">"
        big = head[2:4] in {b"+\0", b"\0+"}
        number, tag, offset = ("Q", "HHQ", "Q") if big else ("H", "HHI", "I")
        entry = struct.calcsize(f"{order}{tag}{offset}")
        at = _unpacked(file, path, 8 if big else 4, order + offset)
        # What follows the pages of a map is told by who reads them.
        for _ in range(len(PAGES) + 1):
            if at == 0:
                return
            count = _unpacked(file, path, at, order + number)
            at += struct.calcsize(order + number)
            if count > MOST_TAGS:
                raise FormatError(path, f"byte {at}", f"{count:,} tags in a directory", DAMAGED)
            for i in range(count):
                file.seek(at + i * entry)
                data = file.read(entry)
                if len(data) < entry:
                    raise FormatError(path, f"byte {at + i * entry}", "the file ends in a directory", DAMAGED)
                name, kind, values, _ = struct.unpack(f"{order}{tag}{offset}", data)
                if values * TYPE_BYTES.get(kind, 1) > size:
                    raise FormatError(path, f"tag {name}", f"{values:,} values in a file of {size:,} bytes", DAMAGED)
            at = _unpacked(file, path, at + count * entry, order + offset)


def _unpacked(file: BinaryIO, path: Path, at: int, form: str) -> int:
    file.seek(at)
    data = file.read(struct.calcsize(form))
    if len(data) < struct.calcsize(form):
        raise FormatError(path, f"byte {at}", "the file ends before its directories do", DAMAGED)
    (value,) = struct.unpack(form, data)
    return int(value)


FORMAT = MapFormat("tiff", (".tif", ".tiff"), lambda head: head.startswith(MAGICS), read, write)
