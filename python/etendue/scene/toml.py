"""Scenes as TOML text: tables for what has a name, one line for each value in them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from etendue.errors import FormatError, SceneError
from etendue.formats.encodings import decoded, wide_encoding

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
    """A mapping of plain values as TOML: numbers in their shortest form, vectors on one line.

    Examples
    --------
    >>> print(to_toml({"name": "a", "media": {"glass": {"index": 1.5}}, "solids": [{"at": [0.0, 0.0, 7.0]}]}), end="")
    name = "a"
    <BLANKLINE>
    [media.glass]
    index = 1.5
    <BLANKLINE>
    [[solids]]
    at = [0, 0, 7]
    """
    text = tomli_w.dumps(_shortest(data))
    # An array begins a line for each value. Those of tables keep their lines; no text has a line break within it.
    for breaks, instead in ((r"(?<=\[)\n *(?!\s|\{)", ""), (r"(?<!\}),\n *(?=\])", ""), (r"(?<!\}),\n *", ", ")):
        text = re.sub(breaks, instead, text)
    return text


def _shortest(value: Any) -> Any:
    """The same with whole numbers as such: 7 reads better than 7.0."""
    if isinstance(value, Mapping):
        return {key: _shortest(held) for key, held in value.items()}
    if isinstance(value, list | tuple):
        return [_shortest(held) for held in value]
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 1e15 else value
