"""NumPy archive: the exact map. `numpy.load` opens it without étendue."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.maps.header import FOREIGN, MapHeader, header_text
from etendue.formats.maps.map_format import DAMAGED, AnyMap, MapFormat, parsing

ARRAYS = {"values": np.dtype("<f8"), "standard_error": np.dtype("<f8"), "rays": np.dtype("<i8")}


def write(lmap: AnyMap, path: Path) -> tuple[str, ...]:
    """Write arrays ``values``, ``standard_error``, ``rays`` and the JSON text ``header``; nothing is lost."""
    arrays = {name: getattr(lmap, name).astype(dtype) for name, dtype in ARRAYS.items()}
    # An open file, because to a path that does not end with ".npz" in lower case numpy would add it.
    with path.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(header_text(lmap)), **arrays)
    return ()


def read(path: Path) -> AnyMap:
    """Read what `write` wrote."""
    with parsing(path, "zip archive"), zipfile.ZipFile(path) as archive:
        missing = [f"{name}.npy" for name in ("header", *ARRAYS) if f"{name}.npy" not in archive.namelist()]
        if missing:
            raise FormatError(path, "zip archive", f"no {', '.join(missing)} in it", FOREIGN)
        text = _member(archive, path, "header", (), np.dtype(str))
        header = MapHeader.parse(path, "array 'header'", str(text.item()))
        arrays = {name: _member(archive, path, name, header.shape, dtype) for name, dtype in ARRAYS.items()}
    return header.restore(arrays["values"], arrays["standard_error"], arrays["rays"])


def _member(
    archive: zipfile.ZipFile, path: Path, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]
) -> npt.NDArray[Any]:
    """One array of the archive."""
    with archive.open(f"{name}.npy") as stream:
        version = np.lib.format.read_magic(stream)
        if version != (1, 0):
            raise FormatError(path, f"array {name!r}", f"npy version {version}", DAMAGED)
        found_shape, fortran, found_dtype = np.lib.format.read_array_header_1_0(stream)
        # A text array has no set length.
        expected = found_dtype if dtype.kind == found_dtype.kind == "U" else dtype
        if found_shape != shape or found_dtype != expected or fortran:
            found = f"{found_dtype} of shape {found_shape}, expected {dtype} of shape {shape}"
            raise FormatError(path, f"array {name!r}", found, DAMAGED)
        # To the end and not by the length that the header claims: no memory is set aside for a claim, and the
        # archive's own checksum is verified.
        data = stream.read()
    return np.frombuffer(data, dtype=found_dtype).reshape(shape)


FORMAT = MapFormat("npz", (".npz",), lambda head: head.startswith(b"PK\x03\x04"), read, write)
