"""What a ray-file format is, and what its readers and writers share."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.encodings import wide_encoding
from etendue.formats.input import require_readable
from etendue.quantities.file_records import AnyRecords, FileRecords
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

HEAD_BYTES = 1 << 16
"""Bytes from the beginning of a file by which its format is recognised."""


@dataclasses.dataclass(frozen=True)
class Head:
    """The beginning of a file.

    Parameters
    ----------
    path : Path
    size : int
        Of the whole file [bytes].
    data : bytes
        The first `HEAD_BYTES`, or less.
    """

    path: Path
    size: int
    data: bytes

    @classmethod
    def of(cls, path: Path) -> Head:
        """Read the head of a file, text in UTF-16 as UTF-8; OSError if it cannot be opened."""
        require_readable(path)
        with path.open("rb") as file:
            size, data = os.fstat(file.fileno()).st_size, file.read(HEAD_BYTES)
        wide = wide_encoding(data)
        if wide is not None:
            encoding, mark = wide
            # The last letter may be cut.
            data = data[mark:].decode(encoding, errors="ignore").encode("utf-8", errors="replace")
        return cls(path, size, data)

    @property
    def is_text(self) -> bool:
        """Whether the head holds no control characters but white space; decides between binary and text formats."""
        return not any(b < 32 and b not in (9, 10, 11, 12, 13, 26) for b in self.data[:4096])

    @property
    def lines(self) -> list[str]:
        """The lines of the head, decoded as Latin-1 without a byte-order mark; the last may be cut."""
        return self.data.removeprefix(b"\xef\xbb\xbf").decode("latin-1").splitlines()


@dataclasses.dataclass(frozen=True)
class RayFormat:
    """One published ray-file format.

    Parameters
    ----------
    name : str
        As users type it: ``"tm25"``.
    title : str
        As people read it.
    extensions : tuple of str
        Lower case with the dot; used to choose a format for writing, never for reading.
    recognise : callable
        Whether a `Head` is of this format. Formats are asked in the order of the registry, strict ones first.
    read : callable
        Path to RaySet; raises `FormatError`.
    write : callable
        Writes a stream to a path (of a temporary file; the caller moves it) and returns what the format could not
        express, one sentence each. Raises `ArgumentError` if there is no usable ray, or the format cannot hold the rays.
    far_field : bool
        Whether it can hold rays without positions.
    wants_watts : callable
        Whether it would write this set in watts because in lumens it cannot hold all that is known of the rays.
    value_bytes : int
        Bytes that a number takes at least: those of a float, or of a digit and what parts it from the next.
    most_rays : int, optional
        Rays that a file holds at most, where the format or its own program has such a limit.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    recognise: Callable[[Head], bool]
    read: Callable[[Path], RaySet]
    write: Callable[[RayStream, Path], tuple[str, ...]]
    far_field: bool = False
    wants_watts: Callable[[RayStream], bool] = lambda _rays: False
    value_bytes: int = 4
    most_rays: int | None = None

    def least_size(self, rays: RayStream) -> int:
        """Bytes that a file of these rays has at least."""
        return len(rays) * self.value_bytes * (7 if rays.has_position else 4)


def stored_records(path: Path, dtype: np.dtype[Any], offset: int, count: int) -> AnyRecords:
    """`count` records from byte `offset` of a file, which is held open; none is read.

    Raises
    ------
    FormatError
        If the file is shorter than that.
    """
    if count == 0:
        return np.zeros(0, dtype)
    end = offset + count * dtype.itemsize
    records = FileRecords.of(path, dtype, offset, count)
    size = records.stored.size()
    if end > size:
        raise FormatError(
            path, f"byte {size}", f"the file ends, but {count:,} records of {dtype.itemsize} bytes end at byte {end:,}",
            "The file is truncated; ask for it again.",
        )  # fmt: skip
    return records


def file_provenance(path: Path, format_name: str) -> Provenance:
    """Provenance of a file: name, format, and a digest of its size, first and last megabyte.

    The digest does not read the whole file, which may have 28 GB.
    """
    digest = hashlib.blake2b(digest_size=16)
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        digest.update(size.to_bytes(8, "little"))
        digest.update(file.read(1 << 20))
        file.seek(max(0, size - (1 << 20)))
        digest.update(file.read(1 << 20))
    return Provenance(source=path.name, format=format_name, fingerprint=digest.hexdigest())
