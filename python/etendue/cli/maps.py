"""Maps of luminance and of illuminance, as ``etendue info`` tells them."""

from __future__ import annotations

import dataclasses
from typing import Any

from etendue.cli.luminance import print_map, summary
from etendue.cli.terminal import say
from etendue.formats.maps.map_format import AnyMap
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.powers_of_ten import counted


def describe_map(found: AnyMap) -> dict[str, Any]:
    """A map in figures, as plain data [unit of the map, mm]."""
    facts = {"source": found.provenance.source, "software": found.provenance.software}
    if isinstance(found, LuminanceMap):
        return summary(found) | facts
    error = found.relative_error
    return {
        "quantity": found.quantity,
        "unit": found.unit,
        "screen": dataclasses.asdict(found.screen),
        "centre": list(found.centre),
        "normal": list(found.normal),
        "mean": found.mean,
        "uniformity": found.uniformity if found.mean > 0.0 else None,
        "flux": found.flux,
        "relative_error": None if error is None else dataclasses.asdict(error),
        "pixels": found.values.size,
        "notes": list(found.notes),
    } | facts


def print_map_file(found: AnyMap) -> None:
    """Grid and origin of a map, and what `etendue luminance` or `etendue trace` prints of it."""
    grid = found.screen
    say(f"  {grid.columns} × {grid.rows} pixels, {grid.width:g} × {grid.height:g} mm ({grid.plane})")
    say(f"  of {found.provenance.source}, by {found.provenance.software}")
    if isinstance(found, LuminanceMap):
        print_map(found)
        return
    x, y, z = found.centre
    say(f"{found.quantity} around ({x:g}, {y:g}, {z:g}) mm")
    say(
        f"  mean {counted(found.mean, found.unit)}, least/mean {found.uniformity:.3f}, "
        f"flux {counted(found.flux, found.flux_unit)}"
    )
    if found.relative_error is not None:
        say(f"  {found.relative_error.sentence(found.quantity)}")
    for note in found.notes:
        say(f"  {note}")
