"""Scenes as TOML text: tables for what has a name, one line for each value in them."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from etendue.errors import FormatError, SceneError
from etendue.formats.encodings import decoded, wide_encoding

BARE = re.compile(r"[A-Za-z0-9_-]+")

MOST_PARTS, DEEPEST, LONGEST_NUMBER = 16, 32, 1000
"""Parts of a key, levels of brackets, and letters of a number. The parser needs time and memory that grow with the square
of the first, is called within itself for the second, and Python refuses whole numbers that are longer than some 4000."""

_TOKEN = re.compile(
    r'""".*?(?<!\\)(?:\\\\)*"{3,5}|"(?:\\.|[^"\\\n])*"|"'
    r"|'''.*?'{3,5}|'[^'\n]*'|'"
    r"|#[^\n]*|\n|[\[\]{}.,=]|[A-Za-z0-9_+-]+",
    re.DOTALL,
)


def read_toml(path: Path, raw: bytes) -> dict[str, Any]:
    """The values of a TOML file.

    Raises
    ------
    SceneError
        If it is none, with line and column; or one that nobody wrote who described a scene: keys of a thousand parts,
        brackets in brackets without end, numbers of a thousand digits.

    Examples
    --------
    >>> read_toml(Path("scene.toml"), b'name = "lamp"')
    {'name': 'lamp'}
    """
    try:
        text = decoded(path, raw)
        if wide_encoding(raw) is None:
            raw.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SceneError(path, [(f"byte {error.start}", "no UTF-8, which TOML files are written in")]) from None
    except FormatError as error:
        raise SceneError(path, [(error.place, f"{error.found}. {error.advice}")]) from None
    if "\n" not in text:
        text = text.replace("\r", "\n")
    _check(path, text)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(path, [("", f"no TOML: {error}")]) from None


def _check(path: Path, text: str) -> None:
    """Refuse what the parser would take too long for, before it begins."""
    line, depth, parts, joined = 1, 0, 0, False
    for match in _TOKEN.finditer(text):
        token = match[0]
        first = token[0]
        if token in {'"', "'"}:
            return  # a text without an end, of which the parser says where it begins
        if first == ".":
            joined = True
            continue
        if first.isalnum() or first in "\"'_+-":
            parts = parts + 1 if joined else 1
            joined = False
            line += token.count("\n")
            if parts > MOST_PARTS:
                raise SceneError(path, [(f"line {line}", f"a key of more than {MOST_PARTS} parts")])
            if first in "+-0123456789" and len(token) > LONGEST_NUMBER:
                found = f"a number of {len(token):,} digits; a scene needs none of more than {LONGEST_NUMBER:,}"
                raise SceneError(path, [(f"line {line}", found)])
            continue
        joined = False
        line += token.count("\n")
        depth += (first in "[{") - (first in "]}")
        if depth > DEEPEST:
            raise SceneError(path, [(f"line {line}", f"brackets within brackets, more than {DEEPEST} levels deep")])


def to_toml(data: Mapping[str, Any]) -> str:
    """A mapping of plain values as TOML.

    Values come first, then tables, then rows of tables; tables within those stand on one line, in braces.

    Examples
    --------
    >>> print(to_toml({"name": "a", "media": {"glass": {"index": 1.5}}, "solids": [{"shape": {"kind": "ball"}}]}), end="")
    name = "a"
    <BLANKLINE>
    [media.glass]
    index = 1.5
    <BLANKLINE>
    [[solids]]
    shape = { kind = "ball" }
    """
    lines = [f"{_key(key)} = {_value(value)}" for key, value in data.items() if not _has_tables(value)]
    for key, value in data.items():
        if isinstance(value, Mapping) and _has_tables(value):
            for name, table in value.items():
                lines += ["", f"[{_key(key)}.{_key(name)}]", *_table(table)]
    for key, value in data.items():
        if isinstance(value, list) and _has_tables(value):
            for table in value:
                lines += ["", f"[[{_key(key)}]]", *_table(table)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _has_tables(value: Any) -> bool:
    held = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    return any(isinstance(one, Mapping) for one in held)


def _table(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items()]


def _key(key: str) -> str:
    return key if BARE.fullmatch(key) else _text(key)


def _text(text: str) -> str:
    # JSON's escapes are TOML's; the one control character that JSON leaves alone is DEL.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
        whole = value.is_integer() and abs(value) < 1e15
        return str(int(value)) if whole else repr(value)
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{_key(key)} = {_value(held)}" for key, held in value.items()) + " }" if value else "{}"
        )
    return "[" + ", ".join(map(_value, value)) + "]"
