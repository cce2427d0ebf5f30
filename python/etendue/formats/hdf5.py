"""HDF5 files: what is written so that damage is found, and nothing is read that was not looked at before.

Files are written so that the HDF5 library finds damage by itself: a checksum on every header (file format 1.10) and on
every chunk.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.input import require_readable
from etendue.formats.strict_json import strict_json

SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""The first bytes of an HDF5 file."""

LIBRARY = ("v110", "v110")
"""The oldest HDF5 that reads the files: the first with checksums on all that tells where data are."""

DEFLATE_RATIO = 1032
"""The largest factor by which deflate can shrink anything: 258 bytes into 2 bits."""


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
    except (FormatError, MemoryError):
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
        """A dataset of this type, all of which is in the file; not read yet."""
        data = self._member(name, "dataset")
        place = f"dataset {name!r}"
        if data.dtype != dtype or len(data.shape or ()) != axes:
            raise self.error(place, f"{data.dtype} of shape {data.shape}, expected {dtype} with {axes} axes")
        # Memory is set aside only for what the file can hold; and nothing is followed to other files.
        if data.external or data.is_virtual or data.nbytes > DEFLATE_RATIO * data.id.get_storage_size():
            raise self.error(place, f"the {data.nbytes} bytes of shape {data.shape} are not in it")
        if data.chunks is not None and math.prod(data.chunks) > data.size:
            raise self.error(place, f"chunks of shape {data.chunks} in shape {data.shape}")
        return data

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
