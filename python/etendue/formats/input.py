"""Files to be read: what they are, and whether they stay what they were."""

from __future__ import annotations

import contextlib
import os
import select
import stat
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path, PosixPath

from etendue.errors import ArgumentError, FormatError
from etendue.formats.output import naming
from etendue.formats.temporary import temporary_beside
from etendue.quantities.arguments import require_path
from etendue.quantities.report import ChangedFileWarning

STREAM_LIMIT = 64 << 30
"""Bytes of a pipe that are taken: it ends somewhere."""

PATIENCE = 1.0
"""Seconds without a word from a pipe after which it is told that one waits for it."""

WHOLE = "Give a whole file that nothing writes to, or a copy of it."


class WaitingWarning(UserWarning):
    """A pipe is empty, and what shall write to it has not begun."""


def is_stream(path: Path) -> bool:
    """Whether a path leads to a pipe, from which bytes come once and in order; false if there is nothing."""
    with contextlib.suppress(OSError):
        return stat.S_ISFIFO(path.stat().st_mode)
    return False


def require_readable(path: Path) -> None:
    """Refuse what is neither a file nor a pipe.

    Raises
    ------
    ArgumentError
        If it is a directory, a device or a socket.
    OSError
        If there is nothing.
    """
    if str(path) == "-" and not path.exists():
        raise ArgumentError("-: cannot read: there is no file of this name. Standard input is /dev/stdin.")
    mode = path.stat().st_mode
    kinds = ((stat.S_ISDIR, "a directory"), (stat.S_ISSOCK, "a socket"))
    devices = ((stat.S_ISCHR, "a device or a terminal"), (stat.S_ISBLK, "a device"))
    for is_one, kind in kinds + devices:
        if is_one(mode):
            raise ArgumentError(f"{path}: cannot read: this is {kind}. Give the path of a file or of a pipe.")


def require_file(path: Path, why: str) -> None:
    """Refuse what is no ordinary file, for formats that are read here and there; `why` says so.

    Raises
    ------
    ArgumentError
        If it is anything else.
    OSError
        If there is nothing.
    """
    require_readable(path)
    if is_stream(path):
        raise ArgumentError(f"{path}: cannot read: this is a pipe, and {why}. Write it to a file first.")


def as_path(path: str | os.PathLike[str]) -> Path:
    """A path as such, and the path of a pipe as that: `Path` would forget where its bytes are."""
    require_path(path)
    return path if isinstance(path, Path) else Path(path)


class StreamPath(PosixPath):
    """The path of a pipe, whose bytes are in a file: shown as the pipe, opened as the file."""

    copy: Path

    def __fspath__(self) -> str:
        """Where the bytes are."""
        return os.fspath(self.copy)

    @classmethod
    def over(cls, path: Path, copy: Path) -> StreamPath:
        """The path of a pipe and that of its bytes."""
        same = cls(path)
        same.copy = copy
        return same


@contextlib.contextmanager
def at_rest(path: Path) -> Iterator[None]:
    """See to it that a file is the same at the beginning and at the end of a block that opens or reads it.

    Raises
    ------
    FormatError
        If another file took its place, or it became shorter.

    Warns
    -----
    ChangedFileWarning
        If it was written to otherwise.
    """
    before = path.stat()
    yield
    try:
        after = path.stat()
    except FileNotFoundError:
        return  # what was opened is still there for those who hold it
    if (before.st_dev, before.st_ino) != (after.st_dev, after.st_ino):
        raise FormatError(path, "byte 0", "another file took its place while it was opened", WHOLE)
    if after.st_size < before.st_size:
        raise shortened(path, after.st_size, before.st_size)
    if (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns):
        text = f"{path}: somebody wrote to this file while it was read; its first {before.st_size:,} bytes count"
        warnings.warn(text, ChangedFileWarning, stacklevel=4)


def shortened(path: Path, size: int, before: int) -> FormatError:
    """The error for a file that has become shorter."""
    found = f"the file ended here while it was read; it had {before} bytes when it was opened"
    return FormatError(path, f"byte {size}", found, WHOLE)


@contextlib.contextmanager
def stream_in_file(path: Path, limit: int = STREAM_LIMIT) -> Iterator[StreamPath]:
    """The path of a pipe, of which all that comes out is in a temporary file that lives as long as the block.

    Raises
    ------
    FormatError
        If nothing comes, or more than `limit` bytes.
    OutputError
        If the temporary folder is full.

    Warns
    -----
    WaitingWarning
        If nothing writes to the pipe for a second.
    """
    place = Path(tempfile.gettempdir()) / f"etendue{path.suffix}"
    with temporary_beside(place) as file:
        total = 0
        with naming(place.with_name(f"the copy of {path.name}")), file.open("wb") as room:
            for data in _arriving(path):
                total += len(data)
                if total > limit:
                    found = f"more than {limit:,} bytes come out of this pipe"
                    raise FormatError(path, f"byte {limit}", found, "Write them to a file first.")
                room.write(data)
        if not total:
            raise FormatError(path, "byte 0", "nothing came out of this pipe", "See whether its writer failed.")
        yield StreamPath.over(path, file)


def _arriving(path: Path) -> Iterator[bytes]:
    # Opened so that a pipe without a writer does not hold the program, deaf to everything, within the call.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    told, began = False, time.monotonic()
    try:
        waiting = select.poll()
        waiting.register(handle, select.POLLIN | select.POLLHUP)
        while True:
            if not waiting.poll(200):
                if not told and time.monotonic() - began > PATIENCE:
                    told = True
                    text = f"{path}: waiting for something to be written to this pipe (Ctrl-C ends it)"
                    warnings.warn(text, WaitingWarning, stacklevel=5)
                continue
            try:
                data = os.read(handle, 1 << 20)
            except BlockingIOError:
                continue
            if not data:
                return
            told = True
            yield data
    finally:
        os.close(handle)
