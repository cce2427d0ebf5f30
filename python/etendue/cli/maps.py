"""Maps of luminance and of illuminance, as the verbs write them and tell them in figures."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from etendue.cli.terminal import say
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.formats.maps.map_format import AnyMap
from etendue.luminance.filters import pixels_err_together
from etendue.luminance.region_statistics import RegionStatistics, region_statistics
from etendue.luminance.regions import AnyRegion, parse_region
from etendue.plot.colour_scale import Scale
from etendue.plot.map_picture import plot_map
from etendue.plot.region_marks import check_number
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.luminance_map import LuminanceMap, errors_parted
from etendue.quantities.measured import measured, measured_pixel
from etendue.quantities.observer import Screen
from etendue.quantities.powers_of_ten import counted, rounded
from etendue.quantities.unlifted import unlifted

LIFT = 0.01
"""Share of a maximum that chance may lift it by without a word."""


def parsed_regions(texts: Sequence[str] | None, outputs: Iterable[Path]) -> list[AnyRegion]:
    """The regions that an option states, as many as a picture among the outputs has room for.

    Raises
    ------
    ArgumentError
        If one is none, or there are more than a picture has room for.
    """
    regions = [parse_region(text) for text in texts or []]
    if any(path.suffix.lower() in PICTURE_EXTENSIONS for path in outputs):
        check_number(regions)
    return regions


def check_regions(regions: Sequence[AnyRegion], screens: Iterable[Screen]) -> None:
    """Refuse, before any map is worked out, regions that hold no pixel of one of the screens.

    Raises
    ------
    ArgumentError
        If so.
    """
    for screen in dict.fromkeys(screens):
        for region in regions:
            region.mask(screen)


def write_map(
    lmap: LuminanceMap, paths: list[Path], scale: Scale = "auto", regions: Sequence[AnyRegion] = ()
) -> list[str]:
    """Write a map to files, and draw it, by extension; returns what the formats could not express."""
    drawn = [path for path in paths if path.suffix.lower() in PICTURE_EXTENSIONS]
    # A picture may be refused for what the map turns out to be, e.g. dark in a region: the map itself is kept.
    notes = [f"{path}: {note}" for path in paths if path not in drawn for note in lmap.save(path)]
    for path in drawn:
        plot_map(lmap, path, scale, regions=regions)
    return notes


def summary(lmap: LuminanceMap, regions: Sequence[AnyRegion] = ()) -> dict[str, Any]:
    """A map in figures, as plain data [unit of the map]."""
    live = ~np.isnan(lmap.values)
    values = lmap.values[live]
    error = lmap.relative_error
    return {
        "quantity": lmap.quantity,
        "unit": lmap.unit,
        "observer": lmap.header()["observer"],
        "screen": lmap.header()["screen"],
        "mean_of_live_pixels": float(values.mean()) if live.any() else None,
        "maximum": float(values.max()) if live.any() else None,
        "maximum_apart": _largest_apart(lmap) if live.any() else None,
        "intensity": lmap.intensity,
        "relative_error": None if error is None else dataclasses.asdict(error),
        "common_error": lmap.common_error,
        "rays": int(lmap.rays[lmap.rays > 0].sum()) if (lmap.rays >= 0).any() else None,
        "dead_pixels": lmap.dead_pixels,
        "pixels": lmap.values.size,
        "regions": [region_statistics(lmap, region).to_dict() for region in regions],
        "notes": list(lmap.notes),
    }


def print_map(lmap: LuminanceMap, regions: Sequence[AnyRegion] = (), *, notes: bool = True) -> None:
    """A map in figures, for people, with its notes or without."""
    facts = summary(lmap)
    where = lmap.observer
    say(f"{facts['quantity']} from θ = {where.theta:g}°, φ = {where.phi:g}°, {where.distance:g} mm")
    if facts["maximum"] is not None:
        dead = f" ({facts['dead_pixels']:,} dead ones left out)" if facts["dead_pixels"] else ""
        say(f"  mean of live pixels {counted(facts['mean_of_live_pixels'], lmap.unit)}{dead}, maximum {_maximum(lmap)}")
        unit = "cd" if lmap.flux_unit == "lm" else "W/sr"
        say(f"  intensity towards the observer {counted(facts['intensity'], unit)}")
    if lmap.relative_error is not None:
        say(f"  {lmap.relative_error.sentence(facts['quantity'])}")
    _print_regions(lmap, regions)
    for note in lmap.notes if notes else ():
        say(f"  {note}")


def _lifted(found: RegionStatistics, together: bool) -> str:
    """What a maximum is without the lift of chance, if pixels err by themselves and it is a hundredth or more."""
    if together or not found.maximum - found.maximum_apart > LIFT * found.maximum:
        return ""
    # What is below half of it is made of single rays.
    if found.maximum_apart < 0.5 * found.maximum:
        return " (chance alone may have made it)"
    return f" (lifted by chance from {counted(found.maximum_apart, found.unit)})"


def _largest_apart(lmap: LuminanceMap) -> float:
    """The largest pixel less what chance lifts it by if each pixel errs by itself; as it is where they err together."""
    live = ~np.isnan(lmap.values)
    values = lmap.values[live]
    if pixels_err_together(lmap):
        return float(values.max())
    _, own = errors_parted(values, lmap.standard_error[live], lmap.common_error)
    return unlifted(values, own, np.ones(values.size)).value


def _maximum(lmap: LuminanceMap) -> str:
    """The largest luminance with its error, and the largest pixel if chance lifts that by more than half of its error."""
    largest, error = float(np.nanmax(lmap.values)), float(lmap.standard_error.flat[np.nanargmax(lmap.values)])
    return measured_pixel(largest, error, _largest_apart(lmap), lmap.unit)


def _print_regions(lmap: AnyMap, regions: Sequence[AnyRegion]) -> None:
    for number, region in enumerate(regions, 1):
        found = region_statistics(lmap, region)
        together = isinstance(lmap, LuminanceMap) and pixels_err_together(lmap)
        mean_error = found.mean_error if together else found.mean_error_apart
        say(
            f"  region {number}: mean {measured(found.mean, mean_error, found.unit)}, "
            f"minimum {counted(found.minimum, found.unit)}, maximum {counted(found.maximum, found.unit)}"
            f"{_lifted(found, together)}, "
            f"minimum over mean {rounded(found.uniformity, 3)}"
            + "".join(f"; {note}" for note in found.notes)
            + (f"; {found.dead_pixels} of {found.pixels} pixels are dead and count as 0" if found.dead_pixels else "")
        )


def print_illuminance(found: IlluminanceMap, regions: Sequence[AnyRegion] = ()) -> None:
    """A map of illuminance in figures, for people, with its notes."""
    x, y, z = found.centre
    say(f"{found.quantity} around ({x:g}, {y:g}, {z:g}) mm")
    say(
        f"  mean {measured(found.mean, found.mean_error, found.unit)}, least/mean {rounded(found.uniformity, 3)}, "
        f"flux {measured(found.flux, found.flux_error, found.flux_unit)}"
    )
    if found.relative_error is not None:
        say(f"  {found.relative_error.sentence(found.quantity)}")
    _print_regions(found, regions)
    for note in found.notes:
        say(f"  {note}")


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
        "mean_error": found.mean_error,
        "uniformity": found.uniformity if found.mean > 0.0 else None,
        "flux": found.flux,
        "flux_error": found.flux_error,
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
    print_illuminance(found)
