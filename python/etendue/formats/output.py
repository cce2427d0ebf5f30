"""Files appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path

from etendue.errors import ArgumentError


@contextlib.contextmanager
def atomic_output(path: str | os.PathLike[str]) -> Iterator[Path]:
    r"""Write a file so that `path` holds either what it held before or the whole new content.

    Parameters
    ----------
    path : path
        Where the file shall appear. Its directory must exist.

    Yields
    ------
    Path
        An empty temporary file beside `path`, with the same suffix (libraries guess the format from it). Write to it
        and close it before the block ends: it is then flushed to the disk and takes the place of `path`. If the block
        raises anything at all (`KeyboardInterrupt` too) it is removed and `path` stays untouched.

    Raises
    ------
    ArgumentError
        If the directory does not exist or cannot be written, or if `path` is a directory or a device.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     target = Path(folder) / "map.csv"
    ...     with atomic_output(target) as temporary:
    ...         _ = temporary.write_text("row,column\n")
    ...     target.read_text(), len(list(target.parent.iterdir()))
    ('row,column\n', 1)
    """
    target = _destination(Path(path))
    temporary = _temporary_beside(target)
    try:
        yield temporary
        _flush(temporary)
        _keep_permissions(target, temporary)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    _flush_directory(target.parent)


def _destination(path: Path) -> Path:
    # A link is followed, so that the file it points to is replaced and the link itself survives.
    target = path.resolve() if path.is_symlink() else path
    if target.is_dir():
        raise ArgumentError(f"{path}: cannot write a file here: this is a directory. Give a file name inside it.")
    if target.exists() and not target.is_file():
        # Taking the place of /dev/null or of a pipe would destroy it for everyone.
        raise ArgumentError(f"{path}: cannot write: this is a device or a pipe. Give the path of an ordinary file.")
    if not target.parent.is_dir():
        raise ArgumentError(
            f"{path}: cannot write: the directory {target.parent} does not exist. Create it first or give another path."
        )
    return target


def _temporary_beside(target: Path) -> Path:
    temporary = target.with_name(f".writing-{secrets.token_hex(8)}{target.suffix}")
    try:
        # 0o666 less the umask: what a file written in place would get.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except OSError as error:
        raise ArgumentError(
            f"{target}: cannot write: {error.strerror or error}. Check the permissions of {target.parent} and the disk."
        ) from error
    return temporary


def _keep_permissions(target: Path, temporary: Path) -> None:
    """Give a file that is replaced the permissions it had."""
    with contextlib.suppress(FileNotFoundError):
        temporary.chmod(stat.S_IMODE(target.stat().st_mode))


def _flush(path: Path) -> None:
    # Opened for writing because Windows flushes only writable handles.
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


def _flush_directory(directory: Path) -> None:
    """Make the new name durable too, where the system lets a directory be opened."""
    if os.name != "posix":
        return
    # Some file systems (network mounts) cannot flush a directory; the file itself is safe by then.
    with contextlib.suppress(OSError):
        handle = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
