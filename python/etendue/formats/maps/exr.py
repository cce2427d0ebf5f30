"""OpenEXR: luminance in channel Y, with its standard error and ray counts beside it; for picture tools.

Files are written by the OpenEXR library. They are read by the code below, because the library prints to the terminal
over damaged files; it knows the layout of scan lines with the compressions that unpack with zlib alone.
"""

from __future__ import annotations

import dataclasses
import struct
import zlib
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

PIXEL_TYPES: dict[int, np.dtype[Any]] = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}

LINES_PER_CHUNK = {0: 1, 2: 1, 3: 16}
"""Of the compressions none, ZIPS and ZIP, by their number in the file."""


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
    """Read what `write` wrote."""
    data = path.read_bytes()
    with parsing(path, "header"):
        attributes, table = _attributes(path, data)
    if ATTRIBUTE not in attributes:
        raise FormatError(path, "header", f"no attribute {ATTRIBUTE!r}", FOREIGN)
    header = MapHeader.parse(path, f"attribute {ATTRIBUTE!r}", attributes[ATTRIBUTE].decode("ascii", "replace"))
    with parsing(path, "header"):
        layout = _Layout.of(path, attributes, table)
    if layout.shape != header.shape:
        raise FormatError(
            path, "dataWindow", f"{layout.shape} pixels, expected {header.shape} (rows, columns)", DAMAGED
        )
    check_room(path, header.pixels, layout.pixel.itemsize)
    with parsing(path, "pixels"):
        pixels = layout.unpack(data)
    with np.errstate(invalid="ignore"):  # a signalling NaN of a damaged file is a NaN all the same
        values, error = (pixels[name].astype(np.float64) for name in ("Y", "standard_error"))
    return header.restore(values, error, rays_from_uint32(pixels["rays"]))


def _attributes(path: Path, data: bytes) -> tuple[dict[str, bytes], int]:
    """The header's attributes by name, and where the table of chunk offsets begins."""
    version, flags = data[4], data[5:8]
    # 0x04 says that names may be longer than 31 bytes; the other flags are tiles, deep pixels and several parts.
    if version != 2 or flags not in (b"\0\0\0", b"\4\0\0"):
        raise FormatError(path, "byte 4", f"version and flags {data[4:8].hex()}", "Save it as one part of scan lines.")
    attributes, at = {}, 8
    while data[at] != 0:
        end_of_name = data.index(b"\0", at)
        end_of_type = data.index(b"\0", end_of_name + 1)
        (size,) = struct.unpack_from("<i", data, end_of_type + 1)
        start = end_of_type + 5
        if not 0 <= size <= len(data) - start:
            raise ValueError(f"an attribute of {size} bytes at byte {at}")
        attributes[data[at:end_of_name].decode()] = data[start : start + size]
        at = start + size
    return attributes, at + 1


@dataclasses.dataclass(frozen=True)
class _Layout:
    """Where the pixels are.

    `table` is the position of the chunk offsets, `top` the y of the first line, `pixel` one value of each channel.
    """

    table: int
    shape: tuple[int, int]
    top: int
    lines: int
    packed: bool
    pixel: np.dtype[Any]

    @classmethod
    def of(cls, path: Path, attributes: dict[str, bytes], table: int) -> _Layout:
        compression = attributes["compression"][0]
        if compression not in LINES_PER_CHUNK:
            raise FormatError(
                path, "compression", f"number {compression}", "Save it with ZIP compression, or without any."
            )
        pixel = np.dtype(list(_channels(attributes["channels"])))
        for name, dtype in CHANNELS.items():
            if pixel.fields is None or pixel.fields.get(name, (None,))[0] != dtype:
                raise FormatError(path, "channels", f"no channel {name!r} of {dtype}", FOREIGN)
        left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
        shape = (bottom - top + 1, right - left + 1)
        return cls(table, shape, top, LINES_PER_CHUNK[compression], compression != 0, pixel)

    def unpack(self, data: bytes) -> dict[str, npt.NDArray[Any]]:
        """Every channel, shape (rows, columns)."""
        rows, columns = self.shape
        starts = struct.unpack_from(f"<{-(-rows // self.lines)}Q", data, self.table)
        channels = {name: np.zeros(self.shape, self.pixel[name]) for name in CHANNELS}
        for first, start in zip(range(0, rows, self.lines), starts, strict=True):
            last = min(first + self.lines, rows)
            y, size = struct.unpack_from("<2i", data, start)
            length = (last - first) * columns * self.pixel.itemsize
            chunk = data[start + 8 : start + 8 + size]
            if y != self.top + first or not 0 <= size <= length or len(chunk) != size:
                raise ValueError(f"a chunk of line {y} with {size} bytes where line {self.top + first} is expected")
            # A chunk that would not shrink is stored as it is.
            line = _inflate(chunk, length) if self.packed and size < length else chunk
            if len(line) != length:
                raise ValueError(f"{len(line)} bytes for the lines {first} to {last - 1}, expected {length}")
            lines = np.frombuffer(line, np.uint8).reshape(last - first, columns * self.pixel.itemsize)
            at = 0
            for name in self.pixel.names or ():
                dtype = self.pixel[name]
                if name in channels:
                    plane = np.ascontiguousarray(lines[:, at : at + columns * dtype.itemsize])
                    channels[name][first:last] = plane.view(dtype)
                at += columns * dtype.itemsize
        return channels


def _channels(data: bytes) -> list[tuple[str, np.dtype[Any]]]:
    found: list[tuple[str, np.dtype[Any]]] = []
    at = 0
    while data[at] != 0:
        end = data.index(b"\0", at)
        pixel_type, x_sampling, y_sampling = struct.unpack_from("<i4x2i", data, end + 1)
        if (x_sampling, y_sampling) != (1, 1):
            raise ValueError("a channel that does not have every pixel")
        found.append((data[at:end].decode(), PIXEL_TYPES[pixel_type]))
        at = end + 17
    return found


def _inflate(chunk: bytes, length: int) -> bytes:
    """Undo the ZIP compression of OpenEXR: deflated differences of bytes whose even ones stand before the odd ones."""
    deflated = zlib.decompressobj()
    differences = np.frombuffer(deflated.decompress(chunk, length), np.uint8).copy()
    differences[1:] -= 128  # modulo 256, like the sum
    split = np.cumsum(differences, dtype=np.uint8)
    joined = np.zeros_like(split)
    half = (len(split) + 1) // 2
    joined[0::2], joined[1::2] = split[:half], split[half:]
    return joined.tobytes()


FORMAT = MapFormat("exr", (".exr",), lambda head: head.startswith(MAGIC), read, write)
