"""Records that are made one stretch after the other and may not fit into memory."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

MEMORY_LIMIT = 64 << 20
"""Bytes that stay in memory; beyond, the records go to a nameless temporary file, which is then mapped."""


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
    OSError
        If the temporary folder is full.

    Examples
    --------
    >>> import numpy as np
    >>> spool([np.zeros(2, "f4,f4"), np.ones(1, "f4,f4")], np.dtype("f4,f4")).shape
    (3,)
    """
    held: list[npt.NDArray[Any]] = []
    held_bytes, records = 0, 0
    # The file has no name and dies with the last map of it, whatever happens.
    with tempfile.TemporaryFile(prefix="etendue-") as file:
        for part in parts:
            held.append(np.ascontiguousarray(part, dtype=dtype))
            held_bytes += part.nbytes
            records += len(part)
            if held_bytes > memory_limit:
                _flush(held, file)
                held_bytes = 0
        if file.tell() == 0:
            gathered = np.concatenate(held, dtype=dtype) if held else np.zeros(0, dtype)
            gathered.setflags(write=False)
            return gathered
        _flush(held, file)
        file.flush()
        return np.memmap(file, dtype=dtype, mode="r", shape=(records,))


def _flush(held: list[npt.NDArray[Any]], file: Any) -> None:
    for part in held:
        # Not ndarray.tofile, which closes its own buffer without looking whether the last bytes found room.
        file.write(part.view(np.uint8).data)
    held.clear()
