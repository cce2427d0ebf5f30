"""``etendue plot``: pictures of maps and intensity distributions that are in files, as a report wants them."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Annotated, get_args

import numpy as np
import typer

from etendue.cli.maps import check_regions, parsed_regions, print_illuminance, print_map
from etendue.cli.options import Json, Regions
from etendue.cli.stated import refuse, stated
from etendue.cli.terminal import check_outputs, complain, one_of, print_json, say
from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.intensity import detect_intensity_format, read_intensity
from etendue.formats.maps import read_any_map
from etendue.luminance.region_statistics import region_statistics
from etendue.luminance.regions import AnyRegion
from etendue.plot.colour_scale import SCALES, Scale, choose_scale, normalisation
from etendue.plot.intensity_picture import plot_intensity
from etendue.plot.map_picture import Show, plot_map
from etendue.plot.style import FILE_TYPES
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap

Map = LuminanceMap | IlluminanceMap


def plot(
    files: Annotated[
        list[Path], typer.Argument(help="Maps of any format, or intensity files; several maps share one scale.")
    ],
    output: Annotated[
        list[Path],
        typer.Option("-o", "--output", help="Picture (.png, .svg, .pdf); several are allowed. {name} is filled in."),
    ],
    scale: Annotated[str, typer.Option("--scale", help="Colours: auto, linear or log.")] = "auto",
    log: Annotated[bool, typer.Option("--log", help="The same as --scale log.")] = False,
    vmin: Annotated[float | None, typer.Option("--vmin", help="Value at the lower end of the colours.")] = None,
    vmax: Annotated[float | None, typer.Option("--vmax", help="Value at the upper end of the colours.")] = None,
    title: Annotated[
        str | None, typer.Option("--title", help="Title of the picture; quantity and source if not given.")
    ] = None,
    show: Annotated[str, typer.Option("--show", help="What is drawn: value or relative-error.")] = "value",
    region: Regions = None,
    per_klm: Annotated[bool, typer.Option("--per-klm", help="Intensity in cd/klm, of the lamps where known.")] = False,
    json: Json = False,
) -> None:
    """Draw maps, or intensity distributions, that are in files; say what regions of a map amount to."""
    colours = one_of(scale, SCALES, "--scale")
    if log:
        colours = _logarithmic(colours)
    shown = one_of(show, get_args(Show), "--show")
    regions = parsed_regions(region, output)
    targets = [[_named(path, file) for path in output] for file in files]
    everything = [path for paths in targets for path in paths]
    if len(set(everything)) < len(everything):
        raise ArgumentError("several files would be drawn to the same picture; put {name} into its name.")
    check_outputs(everything, tuple(FILE_TYPES))
    found = [_read(file) for file in files]
    maps = [one for one in found if isinstance(one, LuminanceMap | IlluminanceMap)]
    if len(maps) < len(found):
        for_maps = ("scale", "log", "vmin", "vmax", "show", "region")
        refuse(for_maps, "for maps; an intensity distribution has no colours and no regions")
    elif per_klm:
        raise typer.BadParameter("--per-klm: for intensity distributions; a map is in cd/m² or lx")
    check_regions(regions, [one.screen for one in maps])
    if len(maps) > 1 and shown == "value":
        colours, vmin, vmax = _common(maps, colours, vmin, vmax)
    for one, paths in zip(found, targets, strict=True):
        for path in paths:
            if isinstance(one, Intensity):
                plot_intensity(one, path, title=title, per_klm=per_klm)
            else:
                plot_map(one, path, colours, vmin=vmin, vmax=vmax, title=title, show=shown, regions=regions)
    if json:
        print_json({"pictures": [_facts(*row, regions=regions) for row in zip(files, found, targets, strict=True)]})
        return
    for file, one, paths in zip(files, found, targets, strict=True):
        if isinstance(one, LuminanceMap):
            print_map(one, regions)
        elif isinstance(one, IlluminanceMap):
            print_illuminance(one, regions)
        else:
            say(f"{file}")
            for complaint in one.complaints:
                where = complaint.place if len(files) == 1 else f"{file.name}: {complaint.place}"
                complain(str(dataclasses.replace(complaint, place=where)))
        for path in paths:
            say(f"  {path}")


def _logarithmic(stated_scale: Scale) -> Scale:
    """The scale that ``--log`` asks for.

    Raises
    ------
    typer.BadParameter
        If ``--scale`` asks for another one.
    """
    if stated("scale") and stated_scale != "log":
        raise typer.BadParameter(
            f"--log is --scale log, and --scale {stated_scale} asks for another one; leave one out"
        )
    return "log"


def _facts(file: Path, one: Map | Intensity, paths: list[Path], *, regions: list[AnyRegion]) -> dict[str, object]:
    facts: dict[str, object] = {"file": file, "outputs": paths}
    if isinstance(one, Intensity):
        return facts | {"notes": [str(complaint) for complaint in one.complaints]}
    figures = [region_statistics(one, region).to_dict() for region in regions]
    return facts | {"regions": figures, "notes": list(one.notes)}


def _common(
    maps: list[Map], colours: Scale, vmin: float | None, vmax: float | None
) -> tuple[Scale, float | None, float | None]:
    """One scale for all maps: of all their pixels together.

    Raises
    ------
    ArgumentError
        If they are of different quantities.
    """
    units = {f"{one.quantity} [{one.unit}]" for one in maps}
    if len(units) > 1:
        raise ArgumentError(f"maps of {' and '.join(sorted(units))} have no scale in common; draw them one by one.")
    values = np.concatenate([one.values.ravel() for one in maps])
    chosen = choose_scale(values, colours).name
    errors = np.concatenate([one.standard_error.ravel() for one in maps])
    norm = normalisation(values, chosen, vmin, vmax, errors)
    return chosen, norm.vmin, norm.vmax


def _read(file: Path) -> Map | Intensity:
    return read_any_map(file) if detect_intensity_format(file) is None else read_intensity(file)


def _named(path: Path, file: Path) -> Path:
    def value(match: re.Match[str]) -> str:
        if match[1] != "name":
            raise UnknownNameError(f"placeholder in the output {path}", match[1], ["name"])
        return file.stem

    return path.with_name(re.sub(r"\{(\w*)\}", value, path.name))
