"""``etendue cache``: light fields that were fitted for maps and are kept."""

from __future__ import annotations

from typing import Annotated

import typer

from etendue.cli.terminal import print_json, say
from etendue.lightfield.fit_cache import FOLDER_VARIABLE, MOST_BYTES, cache_content, clear_cache


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all light fields from the folder.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show or clear the folder of light fields that were fitted for maps of rays and scenes and are not fitted again."""
    held = clear_cache() if clear else cache_content()
    if json:
        facts = {"folder": held.folder, "fields": held.fields, "bytes": held.size, "most_bytes": MOST_BYTES}
        print_json(facts | {"cleared": clear})
        return
    if held.folder is None:
        say(f"no light fields are kept: {FOLDER_VARIABLE} is empty")
        return
    say(f"{held.folder}: {held.fields:,} light fields, {held.size / 1e6:.1f} MB of {MOST_BYTES / 1e6:,.0f} at most")
    if clear:
        say("removed")
