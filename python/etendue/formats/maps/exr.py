"""OpenEXR: luminance in channel Y, with its standard error and ray counts beside it; for picture tools.

The library does not say by an exception what is wrong with the pixels of a file, and it makes room for whatever a header
declares: the header is read alone first, and bounds what the library may unpack.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.maps.header import FOREIGN, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, check_room, parsing
from etendue.formats.maps.narrow import narrowed, rays_from_uint32, rays_to_uint32
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.printable import printable

MAGIC = b"\x76\x2f\x31\x01"

ATTRIBUTE = "etendue"
"""Name of the string attribute that holds the JSON header."""

CHANNELS = {"Y": np.dtype("<f4"), "rays": np.dtype("<u4"), "standard_error": np.dtype("<f4")}
"""Channels in the order of the file, which is alphabetical."""

WIDEST, MOST_CHANNELS = 4, 12
"""Bytes of a pixel in one channel, at the most; and channels, all of which the library unpacks: together no more than
`PIXEL_BYTES`."""

LOSSLESS = (0, 2, 3)
"""Of the compressions none, ZIPS and ZIP, by their number in the file: what they unpack to is bounded."""


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write channels ``Y`` [cd/m²], ``standard_error`` (float32) and ``rays`` (uint32, 2³²-1 where unknown).

    NaN in ``Y`` is a dead pixel. The attribute ``etendue`` holds the exact header as JSON; the others repeat its main
    numbers for people who look into the file with `exrheader`.
    """
    import OpenEXR

    stored, lost = narrowed(lmap)
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        ATTRIBUTE: header_text(stored),
        **_plain_attributes(stored),
    }
    channels = {
        "Y": stored.values.astype(np.float32),
        "rays": rays_to_uint32(stored.rays),
        "standard_error": stored.standard_error.astype(np.float32),
    }
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))
    return lost


def _plain_attributes(lmap: AnyMap) -> dict[str, Any]:
    screen = lmap.screen
    if isinstance(lmap, LuminanceMap):
        observer = lmap.observer
        place: dict[str, Any] = {
            "observerTheta": float(observer.theta),
            "observerPhi": float(observer.phi),
            "observerDistance": float(observer.distance),
            "observerTarget": observer.target,
        }
    else:
        place = {"screenCentre": lmap.centre, "screenRight": lmap.right, "screenUp": lmap.up}
    return {
        "quantity": lmap.quantity,
        "unit": lmap.unit,
        **place,
        "screenWidth": float(screen.width),
        "screenHeight": float(screen.height),
        "screenPlane": screen.plane,
        "pixelAspectRatio": float((screen.width / screen.columns) / (screen.height / screen.rows)),
        # The JSON header keeps what cannot be shown, such as bytes of file names that are no text.
        "software": printable(lmap.provenance.software),
        "comments": "\n".join(("angles in degrees, lengths in millimetres", *map(printable, lmap.notes))),
    }


def read(path: Path) -> AnyMap:
    """Read what `write` wrote; the library unpacks the pixels once they are known to be bounded."""
    import OpenEXR

    with parsing(path, "header"), OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
        # The file empties its header when it is closed.
        attributes, parts = dict(file.header()), len(file.parts)
    if parts != 1 or attributes["type"] != OpenEXR.scanlineimage:
        raise FormatError(path, "header", f"{parts} parts, {attributes['type']}", "Save it as one part of scan lines.")
    text = attributes.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise FormatError(path, "header", f"no attribute {ATTRIBUTE!r}", FOREIGN)
    header = MapHeader.parse(path, f"attribute {ATTRIBUTE!r}", text)
    if attributes["compression"].value not in LOSSLESS:
        advice = "Save it with ZIP compression, or without any."
        raise FormatError(path, "compression", f"number {attributes['compression'].value}", advice)
    (left, top), (right, bottom) = (corner.tolist() for corner in attributes["dataWindow"])
    shape = (bottom - top + 1, right - left + 1)
    if shape != header.shape:
        raise FormatError(path, "dataWindow", f"{shape} pixels, expected {header.shape} (rows, columns)", DAMAGED)
    if len(attributes["channels"]) > MOST_CHANNELS:
        found = f"{len(attributes['channels']):,} channels, expected {', '.join(CHANNELS)}"
        raise FormatError(path, "channels", found, "Save it without the others.")
    check_room(path, header.pixels, WIDEST * len(attributes["channels"]))
    pixels = _pixels(path)
    for name, dtype in CHANNELS.items():
        if name not in pixels or pixels[name].dtype != dtype or pixels[name].shape != header.shape:
            raise FormatError(path, "channels", f"no channel {name!r} of {dtype}", FOREIGN)
    with np.errstate(invalid="ignore"):  # a signalling NaN of a damaged file is a NaN all the same
        values, error = (pixels[name].astype(np.float64) for name in ("Y", "standard_error"))
    return header.restore(values, error, rays_from_uint32(pixels["rays"]))


def _pixels(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Every channel, shape (rows, columns)."""
    import OpenEXR

    # The library prints what is wrong with damaged pixels, and leaves their part out.
    said = io.StringIO()
    with (
        parsing(path, "pixels"),
        contextlib.redirect_stdout(said),
        OpenEXR.File(str(path), separate_channels=True) as file,
    ):
        if file.parts:
            return {name: channel.pixels for name, channel in file.channels().items()}
    raise FormatError(path, "pixels", said.getvalue().strip(), DAMAGED)


FORMAT = MapFormat("exr", (".exr",), lambda head: head.startswith(MAGIC), read, write)
