"""``etendue peak``: the brightest pixel of a map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from etendue.cli.terminal import print_json, say
from etendue.formats.maps import read_map


def peak(
    file: Annotated[Path, typer.Argument(help="A map.")],
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """The brightest pixel of a map: how bright it is, and where."""
    found = read_map(file)
    row, column = np.unravel_index(np.argmax(found.values), found.values.shape)
    value, x, y = float(found.values[row, column]), float(found.screen.x[column]), float(found.screen.y[row])
    if json:
        print_json({"file": file, "value": value, "unit": found.unit, "x": x, "y": y, "notes": found.notes})
        return
    say(f"{file}: {value:.6g} {found.unit} at x = {x:g} mm, y = {y:g} mm")
    for note in found.notes:
        say(f"  {note}")
