"""The catalogue of errors.

Every error says where (file, place), what was found and what to do. Each class also derives from the
built-in exception a caller would expect, so ``except ValueError`` and ``except OSError`` keep working.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class EtendueError(Exception):
    """Base of every error that étendue raises on purpose."""


class ArgumentError(EtendueError, ValueError):
    """An argument has a value outside its domain."""


class UnknownNameError(EtendueError, ValueError):
    """A name (option, key, format, filter) that does not exist; the message suggests the nearest one."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        choices = tuple(sorted(known))
        # What is no text resembles no name.
        near = nearest_name(name, choices) if isinstance(name, str) else None
        hint = f" Did you mean {near!r}?" if near else ""
        self.kind, self.name, self.known = kind, name, choices
        told = f"Known: {', '.join(choices)}." if choices else "There is none."
        super().__init__(f"unknown {kind} {name!r}.{hint} {told}")

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which would give the message alone."""
        return type(self), (self.kind, self.name, self.known)


class FormatError(EtendueError, ValueError):
    """A file that cannot be read with certainty: names file, place, what was found and what to do."""

    def __init__(self, path: object, place: str, found: str, advice: str) -> None:
        super().__init__(f"{path}: {place}: {found}. {advice}")
        self.path = path
        self.place = place
        self.found = found
        self.advice = advice

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which would give the message alone."""
        return type(self), (self.path, self.place, self.found, self.advice)


class UnsupportedFormatError(FormatError):
    """A format recognised by name that étendue refuses, with what to ask for instead."""


class OutputError(EtendueError, OSError):
    """A file that the system does not let be written: names it, what was needed and what there is."""

    def __str__(self) -> str:
        """File and reason."""
        return f"{self.filename}: {self.strerror}."


class MemoryLimitError(EtendueError, MemoryError):
    """More memory is asked for than there is: names what for, how much, and how much there is."""


class MissingLibraryError(EtendueError, ImportError):
    """A library is needed that is not installed; names the extra of étendue that installs it."""

    def __init__(self, library: str, purpose: str, extra: str) -> None:
        super().__init__(
            f"{library} is not installed, which {purpose} need. Install it: pip install 'etendue[{extra}]'."
        )
        self.library, self.purpose, self.extra = library, purpose, extra

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which would give the message alone."""
        return type(self), (self.library, self.purpose, self.extra)


class UnitError(EtendueError, ValueError):
    """A conversion between units that the data does not support (watts to lumens without a spectrum)."""


MOST_TOLD = 50
"""Mistakes of a scene that a message tells one by one."""


class SceneError(EtendueError, ValueError):
    """A scene that cannot be built: every mistake in it, each with its place and what to do.

    Parameters
    ----------
    source : object
        The file, or what was being made.
    mistakes : iterable of (place, text)
        ``('solids[2] "lens": shape.radius', "…")`` and so on, at least one. The message tells the first fifty.
    """

    def __init__(self, source: object, mistakes: Iterable[tuple[str, str]]) -> None:
        self.source = source
        self.mistakes = tuple(mistakes)
        told = [f"{place}: {text}" if place else text for place, text in self.mistakes[:MOST_TOLD]]
        more = len(self.mistakes) - len(told)
        told += [f"and {more:,} more"] if more else []
        self.lines = (
            (f"{source}: {told[0]}",) if len(told) == 1 else (f"{source}: {len(self.mistakes):,} mistakes", *told)
        )
        """The message, line by line."""
        super().__init__("\n  ".join(self.lines))

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle, which would give the message alone."""
        return type(self), (self.source, self.mistakes)


class SceneWarning(UserWarning):
    """Something in a scene that can be computed with, and is probably not what was meant."""


def nearest_name(name: str, known: Iterable[str]) -> str | None:
    """The known name that somebody who wrote `name` may have meant, if there is one; capitals do not matter."""
    by_folded = {choice.casefold(): choice for choice in sorted(known)}
    near = difflib.get_close_matches(name.casefold(), list(by_folded), n=1, cutoff=0.5)
    return by_folded[near[0]] if near else None
