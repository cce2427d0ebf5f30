"""The beginning of a file, by which its format is recognised, and where a value that is read from it comes from."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from pathlib import Path

from etendue.formats.encodings import wide_encoding
from etendue.formats.input import require_readable
from etendue.quantities.provenance import Provenance

HEAD_BYTES = 1 << 16
"""Bytes from the beginning of a file by which its format is recognised."""

STEP_SIGNATURE = b"ISO-10303-21"
"""How STEP files begin, after white space."""

WORKBOOK_SIGNATURE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
"""How the container of Excel's older workbooks (.xls) begins."""

_OF_TEXT = bytes(byte for byte in range(256) if byte >= 32 or byte in (9, 10, 11, 12, 13, 26))
"""What may stand in text: no control characters but white space and the end-of-file mark of DOS."""

ZIP_SIGNATURE = b"PK\x03\x04"
"""How ZIP archives begin. Members that are not compressed stand in them as they are."""


@dataclasses.dataclass(frozen=True)
class Head:
    """The beginning of a file.

    Parameters
    ----------
    path : Path
    size : int
        Of the whole file [bytes].
    data : bytes
        The first `HEAD_BYTES`, or less.
    """

    path: Path
    size: int
    data: bytes

    @classmethod
    def of(cls, path: Path) -> Head:
        """Read the head of a file, text in UTF-16 as UTF-8; OSError if it cannot be opened."""
        require_readable(path)
        with path.open("rb") as file:
            size, data = os.fstat(file.fileno()).st_size, file.read(HEAD_BYTES)
        wide = wide_encoding(data)
        if wide is not None:
            encoding, mark = wide
            # The last letter may be cut.
            data = data[mark:].decode(encoding, errors="ignore").encode("utf-8", errors="replace")
        return cls(path, size, data)

    @property
    def is_text(self) -> bool:
        """Whether the head holds no control characters but white space; decides between binary and text formats."""
        return not self.data[:4096].translate(None, delete=_OF_TEXT)

    @property
    def is_zip(self) -> bool:
        """Whether this is a ZIP archive, whose members may be text of any format."""
        return self.data.startswith(ZIP_SIGNATURE)

    @property
    def lines(self) -> list[str]:
        """The lines of the head, decoded as Latin-1 without a byte-order mark; the last may be cut."""
        return self.data.removeprefix(b"\xef\xbb\xbf").decode("latin-1").splitlines()


def file_provenance(path: Path, format_name: str) -> Provenance:
    """Provenance of a file: name, format, and a digest of its size, first and last megabyte.

    The digest does not read the whole file, which may have 28 GB.
    """
    digest = hashlib.blake2b(digest_size=16)
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        digest.update(size.to_bytes(8, "little"))
        digest.update(file.read(1 << 20))
        file.seek(max(0, size - (1 << 20)))
        digest.update(file.read(1 << 20))
    return Provenance(source=path.name, format=format_name, fingerprint=digest.hexdigest())
