"""Temporary files and folders that do not outlive their process: the next one at work in the same folder removes them.

Each is locked as long as its process lives. A lock ends with the process, however it ends, so that what can be locked
belongs to nobody.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

# Elsewhere nothing is cleaned up after others.
fcntl = importlib.import_module("fcntl") if os.name == "posix" else None

PATTERN = re.compile(r"\.writing-[0-9a-f]{16}(\.\w+)?")
"""Names of temporary files and folders. A file that is none of ours does not have such a name by accident."""


@contextlib.contextmanager
def temporary_beside(target: Path, *, folder: bool = False) -> Iterator[Path]:
    """An empty temporary file or folder in the folder of `target`, with its suffix; removed at the end if still there.

    What dead processes have left there is removed first.

    Raises
    ------
    OSError
        If it cannot be made.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place, temporary_beside(Path(place) / "map.csv") as path:
    ...     path.suffix, path.stat().st_size
    ('.csv', 0)
    """
    remove_leftovers(target.parent)
    path, lock = _made(target, folder=folder)
    try:
        yield path
    finally:
        _remove(path)
        if lock is not None:
            os.close(lock)


def remove_leftovers(folder: Path) -> None:
    """Remove the temporary files and folders in a folder whose processes are dead."""
    if fcntl is None:
        return
    try:
        with os.scandir(folder) as entries:
            left = [Path(entry.path) for entry in entries if PATTERN.fullmatch(entry.name)]
    except OSError:
        return  # a folder that cannot be read says so when it is written to
    for path in left:
        lock = _locked(path)
        if lock is not None:
            _remove(path)
            os.close(lock)


def _made(target: Path, *, folder: bool) -> tuple[Path, int | None]:
    while True:
        path = target.with_name(f".writing-{secrets.token_hex(8)}{'' if folder else target.suffix}")
        if not PATTERN.fullmatch(path.name):
            path = path.with_suffix("")  # a suffix that no library would know either
        if folder:
            path.mkdir()
        else:
            # 0o666 less the umask: what a file written in place would get.
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        if fcntl is None or not _can_lock(path):
            return path, None
        # Between its making and its locking another process may have taken it for a dead one's.
        lock = _locked(path)
        if lock is not None:
            return path, lock


def _can_lock(path: Path) -> bool:
    """Whether the file system knows locks. Where it does not, nobody can lock, and nothing is removed either."""
    assert fcntl is not None  # noqa: S101 - asked by those who know
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    else:
        return True
    finally:
        os.close(handle)


def _locked(path: Path) -> int | None:
    """A handle that holds the lock of a file or folder; None if somebody else holds it, or it is gone."""
    assert fcntl is not None  # noqa: S101 - asked by those who know
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(handle), path.lstat()):
            return handle
    except OSError:
        pass
    os.close(handle)
    return None


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
