"""Records that stay in their file and are read where they are asked for."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import FormatError

STRETCH = 1 << 16
"""Records that are read at once where a column of all of them is asked for: some megabytes."""


class Origin(NamedTuple):
    """Where records come from, so that another process finds them.

    Parameters
    ----------
    path : Path
        The file, absolute.
    offset, length : int
        Of the records [bytes].
    name : str
        What messages call it.
    stamp : (int, int)
        Its size [bytes] and time of change [ns].

    Examples
    --------
    >>> Origin(Path("/lamps/led.tm25ray"), 512, 2048, "led.tm25ray", (2560, 0)).length
    2048
    """

    path: Path
    offset: int
    length: int
    name: str
    stamp: tuple[int, int]


class FileRecords:
    """Structured records of a file, which behave like a read-only array of one axis that is not in memory.

    Not a memory map: if somebody shortens a mapped file, the system ends the program without a word. Here it is a
    `FormatError`. The file is held open, so that it stays the same one if another takes its name. Pickled are its path, size
    and time of change, not its records.

    Parameters
    ----------
    stored : _core.StoredBytes
        The bytes of all records.
    dtype : structured dtype
        Of a record.
    origin : Origin
        Where they are.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "records"
    ...     _ = path.write_bytes(np.arange(6, dtype="<f4").tobytes())
    ...     records = FileRecords.of(path, np.dtype([("x", "<f4"), ("y", "<f4")]), offset=0, count=3)
    ...     len(records), records["y"].tolist(), records[1:].tolist()
    (3, [1.0, 3.0, 5.0], [(2.0, 3.0), (4.0, 5.0)])
    """

    def __init__(self, stored: _core.StoredBytes, dtype: np.dtype[Any], origin: Origin) -> None:
        self.stored = stored
        self.dtype = dtype
        self._origin = origin
        self.shape = (len(stored) // dtype.itemsize,)

    @classmethod
    def of(cls, path: Path, dtype: np.dtype[Any], offset: int, count: int) -> FileRecords:
        """`count` records from byte `offset` of a file; OSError if it cannot be opened."""
        # Looked at before: a file that changes in between is not the one that is found again.
        stamp = _stamp(path)
        length = count * dtype.itemsize
        stored = _core.StoredBytes(path, offset, length).named(str(path))
        return cls(stored, dtype, Origin(path.absolute(), offset, length, str(path), stamp))

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: where the records are."""
        return _found_again, (self._origin, self.dtype)

    def __deepcopy__(self, memo: dict[int, Any]) -> FileRecords:
        """Itself: nobody can change it, and the file may be gone."""
        return self

    def __len__(self) -> int:
        """Number of records."""
        return self.shape[0]

    def __getitem__(self, key: Any) -> Any:
        """Records of a slice or of numbers, read; the column of a name, read; for a list of names, `FileRecords` of them.

        Raises
        ------
        FormatError
            If the file has become shorter.
        """
        if isinstance(key, str):
            return self._column(key)
        if isinstance(key, list) and key and all(isinstance(name, str) for name in key):
            return FileRecords(self.stored, self.dtype[key], self._origin)
        if isinstance(key, slice):
            return self._slice(key)
        if isinstance(key, int | np.integer):
            at = int(key) + (len(self) if key < 0 else 0)
            if not 0 <= at < len(self):
                raise IndexError(f"record {key} of {len(self)}")
            return self._read(at, at + 1)[0]
        return np.asarray(self)[key]

    def __iter__(self) -> Iterator[Any]:
        """One record after the other."""
        for part in self._parts(slice(0, len(self))):
            yield from part

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """All records, in memory."""
        if copy is False:
            raise ValueError("records of a file can only be copied into memory")
        records = self._read(0, len(self))
        return records if dtype is None else records.astype(dtype)

    def copy(self) -> npt.NDArray[Any]:
        """All records, in memory."""
        return np.array(self)

    def tobytes(self) -> bytes:
        """The bytes of all records, as stored."""
        return np.asarray(self).tobytes()

    def _slice(self, key: slice) -> npt.NDArray[Any]:
        start, stop, step = key.indices(len(self))
        rows = range(start, stop, step)
        if not rows:
            return np.zeros(0, self.dtype)
        first, last = min(rows[0], rows[-1]), max(rows[0], rows[-1])
        return self._read(first, last + 1)[::step]

    def _column(self, name: str) -> npt.NDArray[Any]:
        field = self.dtype[name]
        column = np.zeros((len(self), *field.shape), field.base)
        done = 0
        for part in self._parts(slice(0, len(self))):
            column[done : done + len(part)] = part[name]
            done += len(part)
        return column

    def _parts(self, rows: slice) -> Iterator[npt.NDArray[Any]]:
        for start in range(rows.start, rows.stop, STRETCH):
            yield self._read(start, min(start + STRETCH, rows.stop))

    def _read(self, start: int, stop: int) -> npt.NDArray[Any]:
        width = self.dtype.itemsize
        data = self.stored.read(start * width, stop * width)
        data.setflags(write=False)
        return data.view(self.dtype)


def _stamp(path: Path) -> tuple[int, int]:
    """Size [bytes] and time of change [ns] of a file."""
    held = path.stat()
    return held.st_size, held.st_mtime_ns


def _found_again(origin: Origin, dtype: np.dtype[Any]) -> FileRecords:
    """Pickled records; OSError if their file is gone, FormatError if it is another one."""
    if _stamp(origin.path) != origin.stamp:
        raise FormatError(
            origin.path,
            "pickled rays",
            "size or time of change of the file is not what it was when they were pickled",
            "Read the file again; to another machine, copy it with its time of change.",
        )
    stored = _core.StoredBytes(origin.path, origin.offset, origin.length).named(origin.name)
    return FileRecords(stored, dtype, origin)


AnyRecords = npt.NDArray[Any] | FileRecords
"""Records, in memory or in their file."""
