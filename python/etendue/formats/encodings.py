"""How the text of a file is encoded: certain from a byte-order mark, else UTF-8, else Latin-1."""

from __future__ import annotations

import codecs
import contextlib
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from etendue.errors import FormatError

WIDE_MARKS = {
    # UTF-32 before UTF-16, whose mark its own begins with.
    codecs.BOM_UTF32_LE: "utf-32-le",
    codecs.BOM_UTF32_BE: "utf-32-be",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}
"""Byte-order marks of encodings whose letters have more than one byte each."""

SAVE_AS_UTF8 = "Save it as UTF-8, or with a byte-order mark."

LOOKED_AT = 1 << 12
"""Bytes by which text without a mark is told."""

_ALLOWED = frozenset((9, 10, 11, 12, 13, 26))
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")


def wide_encoding(head: bytes) -> tuple[str, int] | None:
    r"""Encoding and length of its mark, if a file begins with the mark of UTF-16 or UTF-32 and with text in it.

    Binary files may begin with the same bytes, but not with text behind them.

    Examples
    --------
    >>> wide_encoding("IES".encode("utf-16")), wide_encoding(b"\xff\xfe\1\0\2\0"), wide_encoding(b"IES")
    (('utf-16-le', 2), None, None)
    """
    for mark, encoding in WIDE_MARKS.items():
        if head.startswith(mark) and _is_text(head[len(mark) : LOOKED_AT], encoding):
            return encoding, len(mark)
    return None


def unmarked_encoding(head: bytes) -> str | None:
    r"""The encoding that a text without a byte-order mark has by all appearances, if that is UTF-16 or UTF-32.

    Examples
    --------
    >>> unmarked_encoding("TILT=NONE".encode("utf-16-be")), unmarked_encoding(b"TILT=NONE")
    ('utf-16-be', None)
    """
    head = head[: min(LOOKED_AT, len(head) // 4 * 4) or len(head)]
    if b"\0" not in head:
        return None
    for encoding in WIDE_MARKS.values():
        width = 4 if "32" in encoding else 2
        # In texts of the western languages nearly all letters are those of Latin-1, whose other bytes are 0.
        low = head[(0 if encoding.endswith("le") else width - 1) :: width]
        zeros = head.count(0) - low.count(0)
        if 0 not in low and zeros >= 0.9 * (len(head) - len(low)) and _is_text(head, encoding):
            return encoding
    return None


def refuse_unmarked(path: Path, head: bytes) -> None:
    """Raise if a file, whose first bytes these are, is text in UTF-16 or UTF-32 that does not say so.

    Raises
    ------
    FormatError
        With the name of the encoding.
    """
    encoding = unmarked_encoding(head)
    if encoding is not None:
        raise FormatError(path, "byte 0", f"text in {encoding.upper()} without a byte-order mark", SAVE_AS_UTF8)


def decoded(path: Path, data: bytes) -> str:
    r"""The text of a file: by its byte-order mark, or UTF-8, or else Latin-1.

    Raises
    ------
    FormatError
        If it is in UTF-16 without a mark, or holds what is no text.

    Examples
    --------
    >>> decoded(Path("a.txt"), "θ".encode("utf-16")), decoded(Path("a.txt"), b"10\xb0")
    ('θ', '10°')
    """
    wide = wide_encoding(data)
    if wide is not None:
        encoding, mark = wide
        try:
            text = data[mark:].decode(encoding)
        except UnicodeDecodeError as error:
            found = f"no {encoding.upper()}, which the byte-order mark announces"
            raise FormatError(path, f"byte {mark + error.start}", found, SAVE_AS_UTF8) from None
    else:
        refuse_unmarked(path, data)
        data = data.removeprefix(codecs.BOM_UTF8)
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    control = _CONTROL.search(text)
    if control is not None:
        line = len(re.findall(r"\r\n|\n|\r", text[: control.start()])) + 1
        found = f"the control character {control[0]!r} in a text"
        raise FormatError(path, f"line {line}", found, "The file is damaged, or made to mislead; ask for it again.")
    return text


@contextlib.contextmanager
def in_utf8(path: Path) -> Iterator[Path]:
    """The path of the same text in UTF-8: of the file itself, unless a mark says that it is UTF-16 or UTF-32.

    A copy exists only inside the block, under the same name in a folder of its own. Errors name the file itself.

    Raises
    ------
    FormatError
        If the text is not in the encoding that its mark announces.
    """
    with path.open("rb") as file:
        wide = wide_encoding(file.read(LOOKED_AT))
    if wide is None:
        yield path
        return
    encoding, mark = wide
    with tempfile.TemporaryDirectory(prefix="etendue-") as folder:
        copy = Path(folder) / path.name
        with path.open("rb") as source, copy.open("wb") as target:
            source.seek(mark)
            decoder = codecs.getincrementaldecoder(encoding)()
            try:
                while block := source.read(1 << 20):
                    target.write(decoder.decode(block).encode("utf-8"))
                decoder.decode(b"", final=True)
            except UnicodeError:
                found = f"no {encoding.upper()}, which the byte-order mark announces"
                raise FormatError(path, f"before byte {source.tell()}", found, SAVE_AS_UTF8) from None
        try:
            yield copy
        except FormatError as error:
            raise type(error)(path, error.place, error.found, error.advice) from None


def _is_text(data: bytes, encoding: str) -> bool:
    text = data.decode(encoding, errors="replace")
    return bool(text) and not any(ord(letter) < 32 and ord(letter) not in _ALLOWED for letter in text)
