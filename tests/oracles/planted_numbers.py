"""Small sound files with one number in turn replaced by what no sound file holds."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator

NUMBERS = (
    "nan", "-inf", "1e308", "-1e300", "1e400", "1e-320", "99999999999999999999", "2147483648", "-1", "",
)  # fmt: skip
"""Texts that take the place of a number."""

PATTERNS = (
    *(struct.pack("<f", value) for value in (float("nan"), float("inf"), 3e38, -1.0)),
    *(struct.pack("<d", value) for value in (float("nan"), 1e300)),
    b"\xff\xff\xff\x7f",
    b"\xff\xff\xff\xff",
)
"""Bytes that take the place of numbers of 32 or 64 bits."""

_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


def planted_in_text(data: bytes) -> Iterator[bytes]:
    """Every number of a text, with each of `NUMBERS` in its place."""
    for match in _NUMBER.finditer(data):
        for number in NUMBERS:
            yield data[: match.start()] + number.encode() + data[match.end() :]


def planted_in_bytes(data: bytes, most: int) -> Iterator[bytes]:
    """Every fourth place of a binary file, with each of `PATTERNS` there; of a long file about `most` of these."""
    planted = [(place, pattern) for place in range(0, len(data) - 8, 4) for pattern in PATTERNS]
    # An odd step, so that neither places nor patterns are always the same.
    for place, pattern in planted[:: len(planted) // most | 1]:
        yield data[:place] + pattern + data[place + len(pattern) :]
