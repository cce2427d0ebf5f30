"""Records that are made one stretch after the other and may not fit into memory."""

from __future__ import annotations

import contextlib
import tempfile
import weakref
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import OutputError

MEMORY_LIMIT = 64 << 20
"""Bytes that stay in memory; beyond, the records go to a nameless temporary file, which is then mapped."""


class Spool:
    """Records that are appended stretch by stretch, and can be looked at in between.

    An interruption at any moment leaves what was appended before as it was.

    Parameters
    ----------
    dtype : structured dtype
        Of the records.
    memory_limit : int
        Bytes that stay in memory.

    Examples
    --------
    >>> import numpy as np
    >>> records = Spool(np.dtype("f4,f4"))
    >>> records.append(np.zeros(2, "f4,f4"))
    >>> early = records.array()
    >>> records.append(np.ones(1, "f4,f4"))
    >>> len(early), len(records.array()), len(records.array(1))
    (2, 3, 1)
    """

    def __init__(self, dtype: np.dtype[Any], memory_limit: int = MEMORY_LIMIT) -> None:
        self._dtype = dtype
        self._limit = memory_limit
        # The file has no name and dies with the last map of it, whatever happens.
        self._file: Any = None
        # Bytes in the file, and what is not there yet: replaced together, in one step.
        self._state: tuple[int, tuple[npt.NDArray[Any], ...]] = (0, ())

    def append(self, part: npt.NDArray[Any]) -> None:
        """Append a stretch.

        Raises
        ------
        OutputError
            If the temporary folder is full.
        """
        written, held = self._state
        held = (*held, np.ascontiguousarray(part, dtype=self._dtype))
        self._state = (written, held)
        if sum(stretch.nbytes for stretch in held) > self._limit:
            self._flush()

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the records, wherever they are."""
        return _spooled, (self._dtype, self._limit, self.array())

    def __len__(self) -> int:
        """Number of records."""
        written, held = self._state
        return written // self._dtype.itemsize + sum(map(len, held))

    def array(self, count: int | None = None) -> npt.NDArray[Any]:
        """The first `count` records, or all of them, read-only: in memory if few and as a map of the file if not."""
        count = len(self) if count is None else count
        if self._file is None:
            _, held = self._state
            gathered = np.concatenate(held, dtype=self._dtype)[:count] if held else np.zeros(0, self._dtype)
            gathered.setflags(write=False)
            return gathered
        self._flush()
        self._file.flush()
        return np.memmap(self._file, dtype=self._dtype, mode="r", shape=(count,)) if count else np.zeros(0, self._dtype)

    def _flush(self) -> None:
        written, held = self._state
        if self._file is None:
            self._file = tempfile.TemporaryFile(prefix="etendue-")  # noqa: SIM115 - it lives as long as the spool
            weakref.finalize(self, self._file.close)
        asked = written + sum(part.nbytes for part in held)
        try:
            self._file.seek(written)
            for part in held:
                # Not ndarray.tofile, which closes its own buffer without looking whether the last bytes found room.
                self._file.write(part.view(np.uint8).data)
                written += part.nbytes
            self._file.flush()
        except OSError as error:
            raise OutputError(
                error.errno,
                f"cannot write {asked:,} bytes of temporary records: {error.strerror}. "
                "Make room, or set TMPDIR to a folder that has some",
                tempfile.gettempdir(),
            ) from error
        self._state = (written, ())

    def close(self) -> None:
        """Give the file back; arrays that were handed out stay."""
        if self._file is not None:
            # What found no room has been told; the file's buffer would tell it again in its place.
            with contextlib.suppress(OSError):
                self._file.close()


def _spooled(dtype: np.dtype[Any], memory_limit: int, records: npt.NDArray[Any]) -> Spool:
    spool = Spool(dtype, memory_limit)
    spool.append(records)
    return spool


def spool(
    parts: Iterable[npt.NDArray[Any]], dtype: np.dtype[Any], memory_limit: int = MEMORY_LIMIT
) -> npt.NDArray[Any]:
    """Gather stretches of records into one read-only array, in memory if small and in a temporary file if not.

    Parameters
    ----------
    parts : iterable of structured arrays of `dtype`
        In order.
    dtype : structured dtype
        Of the result, which has shape (n,).
    memory_limit : int
        Bytes that stay in memory.

    Raises
    ------
    OutputError
        If the temporary folder is full.

    Examples
    --------
    >>> import numpy as np
    >>> spool([np.zeros(2, "f4,f4"), np.ones(1, "f4,f4")], np.dtype("f4,f4")).shape
    (3,)
    """
    records = Spool(dtype, memory_limit)
    try:
        for part in parts:
            records.append(part)
        return records.array()
    finally:
        records.close()
