"""What a ray-file format is, and what its readers and writers share."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import FormatError
from etendue.formats.head import Head
from etendue.quantities.file_records import AnyRecords, FileRecords
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.units import FluxUnit


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
    unit : {"lm", "W"}, optional
        The one unit of flux that rays have in it, whatever they are handed over in; None: either.
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
    unit: FluxUnit | None = None

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
