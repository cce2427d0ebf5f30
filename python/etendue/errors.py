"""The catalogue of errors.

Every error says where (file, place), what was found and what to do. Each class also derives from the
built-in exception a caller would expect, so ``except ValueError`` and ``except OSError`` keep working.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class EtendueError(Exception):
    """Base of every error that étendue raises on purpose."""


class ArgumentError(EtendueError, ValueError):
    """An argument has a value outside its domain."""


class UnknownNameError(EtendueError, ValueError):
    """A name (option, key, format, filter) that does not exist; the message suggests the nearest one."""

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        choices = sorted(known)
        near = difflib.get_close_matches(name, choices, n=1, cutoff=0.5)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        super().__init__(f"unknown {kind} {name!r}.{hint} Known: {', '.join(choices)}.")


class FormatError(EtendueError, ValueError):
    """A file that cannot be read with certainty: names file, place, what was found and what to do."""

    def __init__(self, path: object, place: str, found: str, advice: str) -> None:
        super().__init__(f"{path}: {place}: {found}. {advice}")
        self.path = path
        self.place = place
        self.found = found
        self.advice = advice


class UnsupportedFormatError(FormatError):
    """A format recognised by name that étendue refuses, with what to ask for instead."""


class UnitError(EtendueError, ValueError):
    """A conversion between units that the data does not support (watts to lumens without a spectrum)."""
