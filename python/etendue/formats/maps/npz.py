"""NumPy archive: the exact map. `numpy.load` opens it without étendue."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.archive import Archive
from etendue.formats.maps.header import FOREIGN, MOST_HEADER_BYTES, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, DEFLATE_RATIO, AnyMap, MapFormat, parsing
from etendue.quantities.observer import MAX_PIXELS

ARRAYS = {"values": np.dtype("<f8"), "standard_error": np.dtype("<f8"), "rays": np.dtype("<i8")}

NPY_HEADER_BYTES = 10 + 65535
"""Most bytes before the numbers of an array, by the format of version 1.0."""

MOST_BYTES = 24 * MAX_PIXELS + MOST_HEADER_BYTES + (1 << 20)
"""Of the archive of the largest map, were nothing of it to shrink."""


FIRST_MEMBER = b"header.npy"
"""Name of the member that `write` puts first, within the first 64 bytes of the file."""


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write arrays ``values``, ``standard_error``, ``rays`` and the JSON text ``header``; nothing is lost."""
    arrays = {name: getattr(lmap, name).astype(dtype) for name, dtype in ARRAYS.items()}
    # An open file, because to a path that does not end with ".npz" in lower case numpy would add it.
    with path.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(header_text(lmap)), **arrays)
    return ()


def read(path: Path) -> AnyMap:
    """Read what `write` wrote."""
    archive = Archive(path, MOST_BYTES)
    missing = [f"{name}.npy" for name in ("header", *ARRAYS) if f"{name}.npy" not in archive.members]
    if missing:
        raise FormatError(path, "zip archive", f"no {', '.join(missing)} in it", FOREIGN)
    text = _member(archive, "header", (), np.dtype(str), MOST_HEADER_BYTES)
    header = MapHeader.parse(path, "array 'header'", str(text.item()))
    arrays = {
        name: _member(archive, name, header.shape, dtype, header.pixels * dtype.itemsize)
        for name, dtype in ARRAYS.items()
    }
    return header.restore(arrays["values"], arrays["standard_error"], arrays["rays"])


def _member(
    archive: Archive, name: str, shape: tuple[int, ...], dtype: np.dtype[Any], most_bytes: int
) -> npt.NDArray[Any]:
    """One array of the archive, which the archive does not unpack if it claims more than it may hold."""
    # Pixels that are all dead shrink as far as deflate can shrink anything.
    data = archive.read(f"{name}.npy", NPY_HEADER_BYTES + most_bytes, DEFLATE_RATIO)
    with parsing(archive.path, f"array {name!r}"):
        stream = io.BytesIO(data)
        version = np.lib.format.read_magic(stream)
        if version != (1, 0):
            raise FormatError(archive.path, f"array {name!r}", f"npy version {version}", DAMAGED)
        found_shape, fortran, found_dtype = np.lib.format.read_array_header_1_0(stream)
        # A text array has no set length.
        expected = found_dtype if dtype.kind == found_dtype.kind == "U" else dtype
        if found_shape != shape or found_dtype != expected or fortran:
            found = f"{found_dtype} of shape {found_shape}, expected {dtype} of shape {shape}"
            raise FormatError(archive.path, f"array {name!r}", found, DAMAGED)
        return np.frombuffer(data, dtype=found_dtype, offset=stream.tell()).reshape(shape)


FORMAT = MapFormat("npz", (".npz",), lambda head: head.startswith(b"PK\x03\x04"), read, write)
