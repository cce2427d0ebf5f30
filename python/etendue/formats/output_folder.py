"""Folders of files appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from etendue.errors import ArgumentError
from etendue.formats.output import naming
from etendue.formats.temporary import temporary_beside
from etendue.quantities.arguments import require_path


def check_output_folder(path: str | os.PathLike[str], replaceable: Callable[[Path], bool]) -> None:
    """Refuse a folder that cannot be written, or that holds something else.

    Parameters
    ----------
    path : path
        Of the folder to come.
    replaceable : callable
        Whether a folder that holds files is one of ours, and may be replaced as a whole.

    Raises
    ------
    ArgumentError
        If `path` is a file or a link, its parent does not exist, or it is a folder with files that is not replaceable.
    """
    require_path(path, instead="the path of a folder")
    folder = Path(path)
    if not folder.absolute().parent.is_dir():
        raise ArgumentError(f"{folder}: cannot write: {folder.absolute().parent} does not exist. Create it first.")
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise ArgumentError(f"{folder}: cannot write a folder here: this is a file or a link. Give another name.")
    if folder.is_dir() and any(folder.iterdir()) and not replaceable(folder):
        raise ArgumentError(f"{folder}: this folder holds other files, which would be lost. Give another name.")


@contextlib.contextmanager
def atomic_folder(path: str | os.PathLike[str], replaceable: Callable[[Path], bool]) -> Iterator[Path]:
    """Write a folder so that `path` is either what it was before or the whole new folder.

    Parameters
    ----------
    path : path
        Where the folder shall appear; its parent must exist.
    replaceable : callable
        Whether a folder that holds files is one of ours, and may be replaced as a whole.

    Yields
    ------
    Path
        An empty temporary folder beside `path`. When the block ends it takes the place of `path`; if the block raises
        anything at all it is removed, and `path` stays untouched.

    Raises
    ------
    ArgumentError
        As of `check_output_folder`.
    OutputError
        If the system does not let it be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as parent:
    ...     with atomic_folder(Path(parent) / "lids", replaceable=lambda old: False) as temporary:
    ...         _ = (temporary / "manifest.json").write_text("{}")
    ...     [file.name for file in (Path(parent) / "lids").iterdir()], len(list(Path(parent).iterdir()))
    (['manifest.json'], 1)
    """
    check_output_folder(path, replaceable)
    target = Path(path).absolute()
    with naming(target), temporary_beside(target, folder=True) as temporary:
        yield temporary
        _take_the_place_of(temporary, target)


def _take_the_place_of(temporary: Path, target: Path) -> None:
    if not target.exists():
        temporary.rename(target)
        return
    # A folder that is not empty cannot be replaced in one step: for a moment there is none of that name.
    old = target.with_name(f".replaced-{secrets.token_hex(8)}")
    target.rename(old)
    try:
        temporary.rename(target)
    except BaseException:
        old.rename(target)
        raise
    # Under the name of what nobody needs: should the program end here, another one removes it.
    useless = target.with_name(f".writing-{secrets.token_hex(8)}")
    old.rename(useless)
    shutil.rmtree(useless, ignore_errors=True)
