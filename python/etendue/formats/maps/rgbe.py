"""The pixels of Radiance pictures: 8-bit mantissas with a common exponent, and their run-length encoding.

Source: [Ward1991]_ "Real Pixels", Graphics Gems II, and the reference manual "Radiance File Formats".
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]

SMALLEST = 2.0**-128
"""Below it a grey value would need an exponent byte under 1."""

LIMIT = 2.0**127
"""From it on a grey value would need an exponent byte over 255."""

LARGEST_RATIO = 64
"""The largest factor by which the run-length encoding can shrink anything: 127 bytes into 2."""

RUN_WIDTHS = range(8, 32768)
"""Widths of pictures whose scan lines are run-length encoded; others are written flat."""

MIN_RUN = 4
"""Shorter runs cost more than they save."""

LONGEST_RUN, LONGEST_DUMP = 127, 128


def encode_grey(values: npt.NDArray[np.float64]) -> tuple[Bytes, Bytes]:
    """Mantissa and exponent bytes of grey values, each of the same shape.

    Parameters
    ----------
    values : array
        0 ≤ value < 2¹²⁷. NaN is written as the all-zero pixel. Anything below `SMALLEST`, 0 included, gets mantissa 0
        and exponent 1: every Radiance reader sees black, and `decode` can tell it from NaN.

    Examples
    --------
    >>> mantissa, exponent = encode_grey(np.array([1.0, 0.0, np.nan]))
    >>> mantissa.tolist(), exponent.tolist()
    ([128, 0, 0], [129, 1, 0])
    """
    dead = np.isnan(values)
    black = ~dead & (values < SMALLEST)
    fraction, power = np.frexp(np.where(dead | black, 1.0, values))
    mantissa = np.where(dead | black, 0, np.floor(fraction * 256.0)).astype(np.uint8)
    exponent = np.where(dead, 0, np.where(black, 1, power + 128)).astype(np.uint8)
    return mantissa, exponent


def decode(mantissa: npt.NDArray[np.generic], exponent: npt.NDArray[np.generic]) -> npt.NDArray[np.float64]:
    """Value (mantissa + ½) · 2^(exponent - 136); 0 where the mantissa is 0, NaN where the exponent is 0.

    `mantissa` may be a weighted mean of the mantissas of red, green and blue.
    """
    number = np.asarray(mantissa, dtype=np.float64)
    value = np.ldexp(number + 0.5, np.asarray(exponent, dtype=np.int32) - 136)
    return np.where(exponent == 0, np.nan, np.where(number == 0.0, 0.0, value))


def pack_line(planes: tuple[Bytes, ...]) -> bytes:
    """One scan line of a picture whose width is in `RUN_WIDTHS`.

    Parameters
    ----------
    planes : tuple of 4 arrays of uint8, shape (columns,)
        Red, green, blue, exponent. The same array object given twice is packed once.
    """
    packed = {id(plane): b"".join(_pack(plane)) for plane in planes}
    return b"\2\2" + len(planes[0]).to_bytes(2, "big") + b"".join(packed[id(plane)] for plane in planes)


def _pack(plane: Bytes) -> Iterator[bytes]:
    data = plane.tobytes()
    starts = np.flatnonzero(np.diff(plane, prepend=~plane[:1]))
    lengths = np.diff(starts, append=len(plane))
    written = 0
    for start, length in zip(starts[lengths >= MIN_RUN].tolist(), lengths[lengths >= MIN_RUN].tolist(), strict=True):
        yield from _dump(data[written:start])
        for done in range(0, length, LONGEST_RUN):
            yield bytes((128 + min(LONGEST_RUN, length - done), data[start]))
        written = start + length
    yield from _dump(data[written:])


def _dump(data: bytes) -> Iterator[bytes]:
    for start in range(0, len(data), LONGEST_DUMP):
        piece = data[start : start + LONGEST_DUMP]
        yield bytes((len(piece),)) + piece


def unpack_lines(data: bytes, rows: int, columns: int) -> Bytes:
    """All pixels of a picture, run-length encoded or flat.

    Parameters
    ----------
    data : bytes
        What follows the resolution line; it must end with the last pixel.
    rows, columns : int
        Size of the picture, already known to be plausible for a file of this length.

    Returns
    -------
    array of uint8, shape (rows, 4, columns)
        Red, green, blue, exponent.

    Raises
    ------
    ValueError
        If the data do not hold exactly this many pixels.
    """
    pixels = np.zeros((rows, 4, columns), np.uint8)
    marker = b"\2\2" + columns.to_bytes(4, "big")[2:]
    at = 0
    for row in range(rows):
        if columns in RUN_WIDTHS and data[at : at + 4] == marker:
            line, at = _unpack(data, at + 4, 4 * columns)
            pixels[row] = np.frombuffer(line, np.uint8).reshape(4, columns)
        else:
            flat = np.frombuffer(data, np.uint8, 4 * columns, at).reshape(columns, 4)
            if (flat[:, :3] == 1).all(axis=1).any():
                raise ValueError(f"scan line {row} has the run-length encoding of before 1991")
            pixels[row] = flat.T
            at += 4 * columns
    if at != len(data):
        raise ValueError(f"{len(data) - at} bytes after the last pixel")
    return pixels


def _unpack(data: bytes, at: int, length: int) -> tuple[bytes, int]:
    """`length` bytes of a packed scan line, and where the next one begins."""
    pieces, done = [], 0
    while done < length:
        code = data[at]
        if code > LONGEST_DUMP:
            count = code - 128
            pieces.append(data[at + 1 : at + 2] * count)
            at += 2
        else:
            count = code
            pieces.append(data[at + 1 : at + 1 + count])
            at += 1 + count
        if count == 0:
            raise ValueError(f"a run of no bytes at byte {at}")
        done += count
    line = b"".join(pieces)
    # Also when a run crosses the end of the line, or the data end within a piece.
    if len(line) != length:
        raise ValueError(f"a scan line of {len(line)} bytes, expected {length}")
    return line, at
