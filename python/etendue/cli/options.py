"""Options that several verbs have in common."""

from __future__ import annotations

from typing import Annotated

import typer

from etendue.errors import UnknownNameError
from etendue.formats.rays import format_named

Flux = Annotated[str | None, typer.Option("--flux", help="Total flux that overrides the file's: 337, 337lm.")]
Unit = Annotated[str | None, typer.Option("--unit", help="lm or W: convert through the file's spectrum.")]
Threads = Annotated[int | None, typer.Option("--threads", help="Threads; all cores if not given.", min=1)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def ray_format(name: str) -> str:
    """The format that an option names.

    Raises
    ------
    typer.BadParameter
        If there is none; suggests the nearest.
    """
    try:
        return format_named(name).name
    except UnknownNameError as error:
        raise typer.BadParameter(str(error), param_hint="--format") from None
