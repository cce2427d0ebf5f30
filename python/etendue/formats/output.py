"""Files appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

from etendue.errors import ArgumentError, OutputError
from etendue.formats.temporary import PATTERN, temporary_beside
from etendue.quantities.arguments import require_path


@contextlib.contextmanager
def atomic_output(path: str | os.PathLike[str], size: int | None = None) -> Iterator[Path]:
    r"""Write a file so that `path` holds either what it held before or the whole new content.

    Parameters
    ----------
    path : path
        Where the file shall appear. Its directory must exist.
    size : int, optional
        Bytes that the file will have at least: refused at once if there is no room for them.

    Yields
    ------
    Path
        An empty temporary file beside `path`, with the same suffix (libraries guess the format from it). Write to it
        and close it before the block ends: it is then flushed to the disk and takes the place of `path`. If the block
        raises anything at all (`KeyboardInterrupt` too) it is removed and `path` stays untouched.

    Raises
    ------
    ArgumentError
        If the directory does not exist, or if `path` is a directory, a device or a pipe.
    OutputError
        If the system does not let it be written: full disk, quota, permissions, a limit of size. Names `path`.

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
    require_path(path)
    target = _destination(Path(path))
    with naming(target), temporary_beside(target) as temporary:
        if size is not None:
            require_room(target, size)
        yield temporary
        _flush(temporary)
        _keep_permissions(target, temporary)
        temporary.replace(target)
    _flush_directory(target.parent)


def require_room(target: Path, size: int, purpose: str = "") -> None:
    """Refuse, before it is begun, what the disk has no room for.

    Parameters
    ----------
    target : Path
        A file, which need not be there, or a folder.
    size : int
        [bytes]
    purpose : str
        What for, where `target` does not say it.

    Raises
    ------
    OutputError
        If so.
    """
    needed = f"cannot write: {size:,} bytes are needed{purpose and ' '}{purpose}"
    free = _free(target)
    if free is not None and size > free:
        raise OutputError(
            errno.ENOSPC, f"{needed}, and {free:,} are free. Make room, or write to another disk", str(target)
        )
    limit = _largest_file()
    if limit is not None and size > limit:
        raise OutputError(errno.EFBIG, f"{needed}, and files may have {limit:,} (ulimit -f)", str(target))


@contextlib.contextmanager
def naming(target: Path) -> Iterator[None]:
    """Errors of the system over what is written name what was to be written, and how far it came.

    Raises
    ------
    OutputError
        In place of an `OSError` that names no file, or a temporary one.
    """
    try:
        yield
    except OutputError:
        raise
    except OSError as error:
        number = error.errno or _number_in(str(error))
        if number is None or (error.filename is not None and not PATTERN.fullmatch(Path(error.filename).name)):
            raise
        free = _free(target)
        room = "" if free is None else f"; {free:,} bytes are free in {target.parent}"
        raise OutputError(
            number,
            f"cannot write: {os.strerror(number)}{room}. Check the permissions, the disk and its quota",
            str(target),
        ) from error


def _number_in(text: str) -> int | None:
    """The number of an error that a library has only told in words."""
    match = re.search(r"errno = (\d+)", text)
    return int(match[1]) if match else None


def _free(target: Path) -> int | None:
    """Bytes free where a file shall be, if the system tells."""
    with contextlib.suppress(OSError):
        return shutil.disk_usage(target if target.is_dir() else target.parent).free
    return None


def _largest_file() -> int | None:
    try:
        import resource
    except ImportError:
        return None
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def require_writable(path: Path) -> None:
    """Refuse, before any work is done, a file that could not be written afterwards.

    Raises
    ------
    ArgumentError
        As of `atomic_output`.
    OutputError
        If nothing can be written into its folder.
    """
    folder = _destination(path).parent
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(
            errno.EACCES, f"cannot write: the folder {folder} does not let files be made in it", str(path)
        )


def _destination(path: Path) -> Path:
    # Files in memory are ordinary ones.
    among_devices = path.absolute().parts[:2] == ("/", "dev") and path.absolute().parts[2:3] != ("shm",)
    if (path.exists() and (not path.is_dir() and not path.is_file())) or among_devices:
        # Taking the place of /dev/null or of a pipe would destroy it for everyone.
        raise ArgumentError(f"{path}: cannot write: this is a device or a pipe. Give the path of an ordinary file.")
    # A link is followed, so that the file it points to is replaced and the link itself survives.
    target = path.resolve() if path.is_symlink() else path
    if target.is_dir():
        raise ArgumentError(f"{path}: cannot write a file here: this is a directory. Give a file name inside it.")
    if not target.parent.is_dir():
        raise ArgumentError(
            f"{path}: cannot write: the directory {target.parent} does not exist. Create it first or give another path."
        )
    return target


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
