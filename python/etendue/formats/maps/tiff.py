"""TIFF: three pages of luminance, standard error and ray counts; for image-processing tools."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from etendue.errors import FormatError
from etendue.formats.maps.header import FOREIGN, VERSION_KEY, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, check_room, parsing
from etendue.formats.maps.narrow import narrowed, rays_from_uint32, rays_to_uint32

PAGES = {"values": np.dtype(np.float32), "standard_error": np.dtype(np.float32), "rays": np.dtype(np.uint32)}

MAGICS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

CLASSIC_LIMIT = 2**32 - 2**25
"""Bytes of pixels that an ordinary TIFF holds, less room for its directories; above it a BigTIFF is written."""

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
            arrays[name] = page.asarray(maxworkers=1)
    values, error = (arrays[name].astype(np.float64) for name in ("values", "standard_error"))
    return header.restore(values, error, rays_from_uint32(arrays["rays"]))


FORMAT = MapFormat("tiff", (".tif", ".tiff"), lambda head: head.startswith(MAGICS), read, write)
