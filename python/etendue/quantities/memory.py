"""How much memory there is, for those who are about to ask for much of it."""

from __future__ import annotations

import contextlib
from pathlib import Path

from etendue.errors import MemoryLimitError

NOTEWORTHY = 256 << 20
"""Bytes below which nobody asks: looking is not free, and so little is either there or nothing is."""


def require_memory(size: int, what: str) -> None:
    """Refuse, before anything is allocated, what does not fit into memory.

    The compiled core cannot give a failed allocation back: it ends the program.

    Parameters
    ----------
    size : int
        [bytes]
    what : str
        What needs them, for the message: ``"a map of 8192 x 8192 pixels"``.

    Raises
    ------
    MemoryLimitError
        If less is available, by what the system says or by a limit that was set.

    Examples
    --------
    >>> require_memory(1000, "a small map")
    >>> try:
    ...     require_memory(10**18, "a map of 10⁹ x 10⁹ pixels")
    ... except MemoryLimitError as error:
    ...     str(error).partition(", and")[0]
    'a map of 10⁹ x 10⁹ pixels needs 1,000,000,000.0 GB of memory'
    """
    if size < NOTEWORTHY:
        return
    available = available_memory()
    if available is not None and size > available:
        raise MemoryLimitError(
            f"{what} needs {size / 1e9:,.1f} GB of memory, and {available / 1e9:,.1f} GB are free. Ask for less, or give "
            "the program more memory."
        )


def available_memory() -> int | None:
    """Bytes that this process can still have, or None where the system does not tell.

    Examples
    --------
    >>> available = available_memory()
    >>> available is None or available > 0
    True
    """
    found = [bytes_left for bytes_left in (_of_system(), _of_group(), _of_limit()) if bytes_left is not None]
    return max(min(found), 0) if found else None


def _of_system() -> int | None:
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    return None


def _of_group() -> int | None:
    """What a container leaves, beside the pages of files that it can give back."""
    with contextlib.suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        limit = int((group / "memory.max").read_text(encoding="ascii"))
        used = int((group / "memory.current").read_text(encoding="ascii"))
        facts = dict(line.split() for line in (group / "memory.stat").read_text(encoding="ascii").splitlines())
        return limit - used + int(facts.get("file", 0))
    return None


def _of_limit() -> int | None:
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource  # noqa: PLC0415 - not on every system

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            return limit - pages * resource.getpagesize()
    return None
