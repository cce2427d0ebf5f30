"""Options that several verbs have in common."""

from __future__ import annotations

from typing import Annotated

import typer

from etendue.errors import UnknownNameError

Flux = Annotated[str | None, typer.Option("--flux", help="Total flux that overrides the file's: 337, 337lm.")]
Unit = Annotated[
    str | None, typer.Option("--unit", help="Unit of flux, lm or W: rays are converted through the file's spectrum.")
]
Threads = Annotated[int | None, typer.Option("--threads", help="Number of threads; all cores if not given.", min=1)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]

Regions = Annotated[
    list[str] | None,
    typer.Option(
        "--region",
        help="Part of the map in figures, outlined and numbered in pictures; may be given several times.",
        metavar="LEFT,RIGHT,BOTTOM,TOP|X/Y,X/Y,X/Y",
    ),
]


def ray_format(name: str) -> str:
    """The format that an option names.

    Raises
    ------
    typer.BadParameter
        If there is none; suggests the nearest.
    """
    # Verbs that only share the other options wait for no ray formats.
    from etendue.formats.rays import format_named

    try:
        return format_named(name).name
    except UnknownNameError as error:
        raise typer.BadParameter(str(error), param_hint="--format") from None
