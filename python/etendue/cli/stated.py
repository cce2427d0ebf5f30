"""Which options somebody stated, beside those that have their defaults: one that changes nothing is refused."""

from __future__ import annotations

import contextvars
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import typer
from typer.core import TyperCommand

_stated: contextvars.ContextVar[Mapping[str, str]] = contextvars.ContextVar("stated", default=MappingProxyType({}))

STATED = "COMMANDLINE"
"""What the parser calls the place that such a value comes from."""


class Verb(TyperCommand):
    """A command that takes note of what was stated."""

    def invoke(self, ctx: Any) -> Any:
        """As of the parser."""
        before = _stated.set(
            {
                parameter.name: _spelled(parameter, ctx.params.get(parameter.name))
                for parameter in self.params
                if getattr(ctx.get_parameter_source(parameter.name), "name", None) == STATED
            }
        )
        try:
            return super().invoke(ctx)
        finally:
            _stated.reset(before)


def _spelled(parameter: Any, value: object) -> str:
    """The long name of an option that has this value: ``--cache``, or ``--no-cache`` where that is what was stated."""
    names = (parameter.secondary_opts if value is False else ()) or parameter.opts
    return str(next((name for name in names if name.startswith("--")), names[0]))


def stated(*names: str) -> list[str]:
    """Those of the options, named as Python spells them, that were stated: as the user spells them.

    Examples
    --------
    >>> stated("size", "gamma")  # no verb was called
    []
    """
    found = _stated.get()
    return [found[name] for name in names if name in found]


def refuse(names: Iterable[str], why: str) -> None:
    """Refuse those of the options that were stated, for a reason.

    Raises
    ------
    typer.BadParameter
        If one was.
    """
    needless = stated(*names)
    if needless:
        raise typer.BadParameter(f"{', '.join(needless)}: {why}")


def refuse_without_picture(outputs: Iterable[Path], *names: str) -> None:
    """Refuse options that say how a picture looks where none is drawn.

    Raises
    ------
    typer.BadParameter
        If one was stated.
    """
    # The list of verbs is told without the parts of files.
    from etendue.formats.maps import PICTURE_EXTENSIONS
    from etendue.plot.animation_files import ANIMATION_EXTENSIONS

    drawn = (*PICTURE_EXTENSIONS, *ANIMATION_EXTENSIONS)
    if stated(*names) and not any(path.suffix.lower() in drawn for path in outputs):
        refuse(names, f"for a picture, and none is written; add one ({', '.join(PICTURE_EXTENSIONS)}), or leave it out")
