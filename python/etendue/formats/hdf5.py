"""HDF5 files: what is written so that damage is found, and nothing is read that was not looked at before.

Files are written so that the HDF5 library finds damage by itself: a checksum on every header (file format 1.10) and on
every chunk.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, OutputError
from etendue.formats.input import require_readable
from etendue.formats.strict_json import strict_json
from etendue.quantities.memory import require_memory

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""The first bytes of an HDF5 file."""

LIBRARY = ("v110", "v110")
"""The oldest HDF5 that reads the files: the first with checksums on all that tells where data are."""

DEFLATE_RATIO = 1032
"""The largest factor by which deflate can shrink anything: 258 bytes into 2 bits."""

FILTERS = {1: "deflate", 2: "shuffle", 3: "fletcher32"}
"""What chunks may be packed with, by the numbers of the HDF5 library: filters that every one of them has."""

FREE_BYTES = 1 << 26
"""A chunk that cannot unpack to more than this does no harm, whatever it announces."""

STRETCH = 1 << 20
"""Bytes of a chunk that are unpacked at a time to see how many they are."""

CHUNK_ROOM = 64
"""Bytes by which a chunk may be larger in the file than in memory, beside a 256th of it: what deflate and checksum add
to numbers that cannot be packed."""


def begins_as_hdf5(path: Path) -> bool:
    """Whether the file begins as HDF5 files do."""
    require_readable(path)
    with path.open("rb") as stream:
        return stream.read(len(SIGNATURE)) == SIGNATURE


@contextlib.contextmanager
def reading(path: Path, place: str, damaged: str) -> Iterator[None]:
    """Turn whatever is raised over damaged or foreign content into a `FormatError` that names file and place."""
    try:
        yield
    except (FormatError, MemoryError, OutputError):
        raise
    # The library raises anything from OSError to KeyError over damaged files, our own constructors ArgumentError.
    except Exception as error:
        raise FormatError(path, place, f"{type(error).__name__}: {error}", damaged) from error


def put(node: Any, **values: Any) -> None:
    """Attributes: texts in UTF-8, numbers and arrays of numbers as they are."""
    import h5py

    for name, value in values.items():
        if isinstance(value, str):
            # Of fixed length, because the heap that holds texts of any length has no checksum.
            encoded = value.encode("utf-8")
            node.attrs.create(name, encoded, dtype=h5py.string_dtype("utf-8", max(len(encoded), 1)))
        else:
            node.attrs[name] = value


@dataclasses.dataclass(frozen=True)
class Node:
    """A group of the file. Nothing is read of which kind and size were not looked at before.

    Parameters
    ----------
    path : Path
        Of the file, for messages.
    node : h5py.Group
    damaged : str
        What to do about a damaged file.
    """

    path: Path
    node: Any
    damaged: str

    def error(self, place: str, found: str, advice: str = "") -> FormatError:
        """A complaint about something in this group; the advice is that of damaged files unless stated."""
        return FormatError(self.path, f"{self.node.name.rstrip('/')}/ {place}", found, advice or self.damaged)

    def group(self, name: str) -> Node:
        """A group in this one."""
        return Node(self.path, self._member(name, "group"), self.damaged)

    def dataset(self, name: str, dtype: np.dtype[Any], axes: int) -> Any:
        """A dataset of this type, every value of which is in the file; not read yet."""
        data = self._member(name, "dataset")
        place = f"dataset {name!r}"
        if data.dtype != dtype or len(data.shape or ()) != axes:
            raise self.error(place, f"{data.dtype} of shape {data.shape}, expected {dtype} with {axes} axes")
        # Memory is set aside only for what the file can hold; and nothing is followed to other files.
        stored = min(data.id.get_storage_size(), self.path.stat().st_size)
        if data.external or data.is_virtual or data.nbytes > DEFLATE_RATIO * stored:
            raise self.error(place, f"the {data.nbytes:,} bytes of shape {data.shape} are not in it")
        if data.chunks is not None:
            self._check_chunks(data, place)
        elif data.nbytes > stored:
            raise self.error(place, f"of the {data.nbytes:,} bytes of shape {data.shape} only {stored:,} were written")
        return data

    def values(self, data: Any) -> npt.NDArray[Any]:
        """All of a dataset of this group.

        Raises
        ------
        MemoryLimitError
            If there is no room for it; names file, dataset and size.
        """
        require_memory(data.nbytes, f"{self.path}: {data.name}, an array of shape {data.shape},")
        values: npt.NDArray[Any] = data[()]
        return values

    def _check_chunks(self, data: Any, place: str) -> None:
        """Refuse chunks that were never written, or that unpack to more than the library is told."""
        if math.prod(data.chunks) > data.size:
            raise self.error(place, f"chunks of shape {data.chunks} in shape {data.shape}")
        made = data.id.get_create_plist()
        filters = [made.get_filter(i)[0] for i in range(made.get_nfilters())]
        unknown = [number for number in filters if number not in FILTERS]
        if unknown or len(set(filters)) != len(filters):
            found = f"its chunks are packed with filters {filters}"
            raise self.error(place, found, f"Pack it with {', '.join(FILTERS.values())} at most, each once (h5repack).")
        expected = math.prod(-(-n // side) for n, side in zip(data.shape, data.chunks, strict=True))
        whole, large, written = math.prod(data.chunks) * data.dtype.itemsize, [], 0

        def look(chunk: Any) -> bool | None:
            nonlocal written
            if chunk.size > whole + whole // 256 + CHUNK_ROOM:
                return True  # ends the search, and is returned
            if DEFLATE_RATIO * chunk.size > max(FREE_BYTES, whole):
                large.append(chunk.chunk_offset)
            written += 1
            return None

        if data.id.chunk_iter(look):
            raise self.error(place, f"a chunk that takes more than its {whole:,} bytes")
        if written != expected:
            raise self.error(place, f"{written:,} of its {expected:,} chunks were written; the rest has no values")
        if "deflate" in (FILTERS[number] for number in filters):
            for offset in large:
                self._check_unpacked(data, place, offset, whole)

    def _check_unpacked(self, data: Any, place: str, offset: tuple[int, ...], whole: int) -> None:
        """Refuse a chunk that unpacks to more than its bytes: the library would make room for all of it."""
        mask, packed = data.id.read_direct_chunk(offset)
        if mask:
            return  # a filter was left out because it gained nothing, so that nothing unpacks
        unpacking, size = zlib.decompressobj(), 0
        while packed and not unpacking.eof and size <= whole + CHUNK_ROOM:
            size += len(unpacking.decompress(packed, STRETCH))
            packed = unpacking.unconsumed_tail
        if size > whole + CHUNK_ROOM:
            raise self.error(place, f"a chunk of {whole:,} bytes unpacks to more of them")

    def text(self, name: str) -> str:
        """An attribute that is a text."""
        stored = self._attribute(name, (), "SO")
        return stored.decode("utf-8") if isinstance(stored, bytes) else str(stored)

    def has_text(self, name: str, text: str) -> bool:
        """Whether there is such an attribute with just this text, whatever else it may be."""
        fits = name in self.node.attrs and self.node.attrs.get_id(name).dtype.kind in "SO"
        return fits and self.node.attrs.get_id(name).shape == () and self.text(name) == text

    def texts(self, name: str) -> tuple[str, ...]:
        """An attribute that is a list of texts, as JSON."""
        stored = strict_json(self.text(name))
        if not (isinstance(stored, list) and all(isinstance(item, str) for item in stored)):
            raise self.error(f"attribute {name!r}", "it is not a list of texts")
        return tuple(stored)

    def integer(self, name: str) -> int:
        """An attribute that is a whole number."""
        return int(self._attribute(name, (), "iu"))

    def truth(self, name: str) -> bool:
        """An attribute that is true or false."""
        return bool(self._attribute(name, (), "b"))

    def number(self, name: str, *, finite: bool = True) -> float:
        """An attribute that is a number."""
        return float(self._numbers(name, (), finite=finite))

    def numbers(self, name: str, shape: tuple[int, ...] | None) -> npt.NDArray[np.float64]:
        """An attribute that is an array of finite numbers; shape None: of any length."""
        return self._numbers(name, shape, finite=True)

    def _numbers(self, name: str, shape: tuple[int, ...] | None, *, finite: bool) -> npt.NDArray[np.float64]:
        values = np.asarray(self._attribute(name, shape, "iuf"), dtype=np.float64)
        if finite and not np.isfinite(values).all():
            raise self.error(f"attribute {name!r}", f"{values} is not finite")
        return values

    def _attribute(self, name: str, shape: tuple[int, ...] | None, kinds: str) -> Any:
        if name not in self.node.attrs:
            raise self.error(f"attribute {name!r}", "there is none")
        stored = self.node.attrs.get_id(name)
        fits = stored.shape == shape if shape is not None else stored.shape is not None and len(stored.shape) == 1
        if not fits or stored.dtype.kind not in kinds or stored.get_storage_size() > self.path.stat().st_size:
            raise self.error(f"attribute {name!r}", f"{stored.dtype} of shape {stored.shape}")
        return self.node.attrs[name]

    def _member(self, name: str, kind: str) -> Any:
        import h5py

        link = self.node.get(name, getlink=True)
        # Soft and external links lead elsewhere, out of the file even.
        member = self.node[name] if isinstance(link, h5py.HardLink) and name in self.node else None
        if not isinstance(member, h5py.Group if kind == "group" else h5py.Dataset):
            raise self.error(f"{kind} {name!r}", "there is none")
        return member


def states_format(path: Path, name: str, damaged: str) -> bool:
    """Whether a file is an HDF5 file whose attribute ``format`` has this text; False of a damaged one.

    Parameters
    ----------
    path : Path
        Of the file.
    name : str
        What the attribute should say.
    damaged : str
        What to do about a damaged file.

    Raises
    ------
    OSError
        If there is no such file.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "notes.txt"
    ...     _ = path.write_text("no HDF5")
    ...     states_format(path, "etendue trace result", "Copy it again.")
    False
    """
    import h5py

    if not begins_as_hdf5(path):
        return False
    try:
        with reading(path, "HDF5", damaged), h5py.File(path, "r") as file:
            return Node(path, file, damaged).has_text("format", name)
    except FormatError:
        return False
