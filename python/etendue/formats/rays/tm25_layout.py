"""Where things stand in a TM-25 file: numbers and names of the clauses 4.7 and 4.8 of ANSI/IES TM-25."""

from __future__ import annotations

import dataclasses
import enum
import struct
from typing import Any

import numpy as np

MAGIC = b"TM25"
VERSIONS = (2013, 2020)

HEADER = struct.Struct("<4s2i2fQ28s2i3f3i168x")
"""Clause 4.7.1: magic, version, creation method, Φv, Φe, rays, date, start position, spectral identifier, single,
lowest and highest wavelength, spectral tables, additional columns, bytes of additional text."""

FLAGS = struct.Struct("<8i")
"""Clause 4.7.2: which data the rays have."""

HEADER_BYTES = 256
DESCRIPTION_OFFSET = 288
DESCRIPTION_BYTES = 4000
DESCRIPTIONS = (
    "light_source",
    "manufacturer",
    "model_creator",
    "creator",
    "equipment",
    "camera",
    "operation",
    "information",
    "data_reference",
)
"""Names of the nine description fields of clause 4.7.3, in order; ``creator`` made the ray file."""

TABLES_OFFSET = DESCRIPTION_OFFSET + DESCRIPTION_BYTES * len(DESCRIPTIONS)
LABEL_BYTES = 512
BLOCK = 32
"""The spectral tables and the additional text are padded to a multiple of this."""

UNKNOWN = struct.unpack("<f", bytes.fromhex("0000c07f"))[0]
"""The quiet NaN 0x7FC00000: a value that is not known."""

CREATION_METHODS = {0: "simulation", 1: "measurement", -1: "unknown"}
START_POSITIONS = (
    "unknown",
    "user defined",
    "plane",
    "sphere",
    "cylinder",
    "cuboid",
    "geometry",
    "back propagation",
)


class Spectral(enum.IntEnum):
    """The spectral data identifier of clause 4.7.1.9."""

    NONE = 0
    SINGLE = 1
    PER_RAY = 2
    ONE_SPECTRUM = 3
    INDEXED = 4


@dataclasses.dataclass(frozen=True)
class Columns:
    """Which columns a ray has (clause 4.8.1), in the order of the file.

    Parameters
    ----------
    radiant, wavelength, luminous, stokes, tristimulus, index : bool
        The known-data flags 3 to 8.
    axis : bool
        Whether the axis of the polarisation ellipse follows the Stokes parameters: always in TM-25-20.
    additional : int
        Number of additional columns.
    """

    radiant: bool = False
    wavelength: bool = False
    luminous: bool = False
    stokes: bool = False
    axis: bool = False
    tristimulus: bool = False
    index: bool = False
    additional: int = 0

    @property
    def widths(self) -> dict[str, int]:
        """Number of 32-bit values of each column; the flux is the luminous one if there is one."""
        columns = (
            ("position", 3),
            ("direction", 3),
            ("radiant_flux" if self.luminous else "flux", self.radiant),
            ("wavelength", self.wavelength),
            ("flux", self.luminous),
            ("stokes", 3 * self.stokes),
            ("polarisation_axis", 3 * self.axis),
            ("tristimulus_x", self.tristimulus),
            ("tristimulus_z", self.tristimulus),
            ("spectrum_index", self.index),
            ("additional", self.additional),
        )
        return {name: int(width) for name, width in columns if width}

    @property
    def record(self) -> np.dtype[Any]:
        """The record type."""
        fields = []
        for name, width in self.widths.items():
            kind = "<i4" if name == "spectrum_index" else "<f4"
            fields.append((name, kind, (width,)) if width > 1 or name == "additional" else (name, kind))
        return np.dtype(fields)


def padded(count: int) -> int:
    """`count` rounded up to whole blocks of 32 bytes.

    Examples
    --------
    >>> padded(612), padded(640)
    (640, 640)
    """
    return -(-count // BLOCK) * BLOCK


def decode(data: bytes) -> str:
    """Text in UTF-32LE up to the first NUL; code points that do not exist become U+FFFD.

    Examples
    --------
    >>> decode("blå".encode("utf-32-le") + bytes(4) + b"junk")
    'blå'
    """
    codes = np.frombuffer(data, "<u4", count=len(data) // 4)
    end = np.flatnonzero(codes == 0)
    codes = codes[: end[0]] if len(end) else codes
    valid = (codes < 0xD800) | ((codes > 0xDFFF) & (codes <= 0x10FFFF))
    return np.where(valid, codes, 0xFFFD).astype("<u4").tobytes().decode("utf-32-le")


def encode(text: str, size: int) -> bytes:
    """Text as UTF-32LE, cut and NUL-padded to `size` bytes with at least one NUL at the end."""
    return text[: size // 4 - 1].encode("utf-32-le", "replace").ljust(size, b"\0")
