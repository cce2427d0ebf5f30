"""ZIP archives of strangers: bounded before they are opened, read in memory, never unpacked into a folder."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from pathlib import Path

from etendue.errors import FormatError

MOST_BYTES = 1 << 30
"""Of an archive: the geometry of a luminaire is most of it."""

MOST_DIRECTORY_BYTES = 1 << 22
MOST_MEMBERS = 1 << 14
MOST_RATIO = 200
"""Of the unpacked size to the packed one; text of numbers has 10, and deflate cannot exceed 1032."""

FREE_RATIO_BYTES = 1 << 20
"""Up to here any ratio is harmless."""

ADVICE = "The archive is damaged, or made to do harm; ask for it again."
_END = b"PK\x05\x06"
_FAULTS = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,
    RuntimeError,
    ValueError,
    LookupError,
    ArithmeticError,
    OSError,
)
"""What `zipfile` raises for archives that are damaged; OSError when it is led to a place before the file's beginning."""


class Archive:
    """A ZIP archive, of which single members are read.

    Parameters
    ----------
    path : Path
    most_bytes : int
        Of the file.

    Raises
    ------
    FormatError
        If it is none, is damaged, or has more members than any product data.
    OSError
        If it cannot be opened.
    """

    def __init__(self, path: Path, most_bytes: int = MOST_BYTES) -> None:
        self.path = path
        _check_end(path, most_bytes)
        try:
            with zipfile.ZipFile(path) as archive:
                members = archive.infolist()
        except _FAULTS as error:
            raise FormatError(path, "directory of the archive", str(error)[:200], ADVICE) from None
        # `ZipInfo.is_dir` cannot stand a name without letters.
        files = [member for member in members if not member.filename.endswith("/")]
        self.members = {member.filename: member for member in files}
        if len(self.members) != len(files):
            raise FormatError(path, "directory of the archive", "two members have the same name", ADVICE)

    def read(self, name: str, most: int, most_ratio: int = MOST_RATIO) -> bytes:
        """The content of a member, of `most` bytes at most, and of `most_ratio` times the packed ones.

        Raises
        ------
        FormatError
            If there is no such member, or it is damaged, encrypted, or larger than allowed or announced.
        """
        member = self.members.get(name)
        if member is None:
            raise FormatError(self.path, name, "it is not in the archive", "Ask for a complete one.")
        packed = max(member.compress_size, 1)
        if member.file_size > most:
            raise FormatError(self.path, name, f"{member.file_size:,} bytes, more than {most:,}", ADVICE)
        if member.file_size > FREE_RATIO_BYTES and member.file_size > most_ratio * packed:
            found = f"{packed:,} bytes that unpack to {member.file_size:,}"
            raise FormatError(self.path, name, found, ADVICE)
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise FormatError(self.path, name, "packed in a way other than deflate", "Pack it anew as an ordinary ZIP.")
        if member.flag_bits & 1:
            raise FormatError(self.path, name, "it is encrypted", "Ask for the archive without a password.")
        try:
            with zipfile.ZipFile(self.path) as archive, archive.open(member) as file:
                data = file.read(member.file_size + 1)
        except _FAULTS as error:
            raise FormatError(self.path, name, str(error)[:200], ADVICE) from None
        if len(data) != member.file_size:
            found = f"{member.file_size:,} bytes were announced, and there are others"
            raise FormatError(self.path, name, found, ADVICE)
        return data


def _check_end(path: Path, most_bytes: int) -> None:
    """Refuse an archive whose directory alone would fill the memory, before anything reads it."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > most_bytes:
            raise FormatError(path, "size", f"{size:,} bytes", f"Such a file has {most_bytes:,} at most.")
        start = max(0, size - (1 << 16) - 42)
        file.seek(start)
        tail = file.read()
    # As `zipfile` does it: a record without a comment at the very end, else the last one.
    place = len(tail) - 22
    if place < 0 or tail[place : place + 4] != _END or tail[-2:] != b"\0\0":
        place = tail.rfind(_END)
    if place < 0 or place + 22 > len(tail):
        raise FormatError(path, f"byte {size}", "the archive has no end record", "It is cut short; ask for it again.")
    _, _, _, _, count, directory, _, _ = struct.unpack("<4s4H2IH", tail[place : place + 22])
    if tail[max(0, place - 20) : place].startswith(b"PK\x06\x07"):
        raise FormatError(path, "end of the archive", "an archive in the format for huge ones (ZIP64)", ADVICE)
    if count > MOST_MEMBERS or directory > MOST_DIRECTORY_BYTES:
        raise FormatError(path, "end of the archive", f"{count:,} members in {directory:,} bytes of directory", ADVICE)
