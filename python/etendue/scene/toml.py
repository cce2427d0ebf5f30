"""Scenes as TOML text: tables for what has a name, one line for each value in them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

BARE = re.compile(r"[A-Za-z0-9_-]+")


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
