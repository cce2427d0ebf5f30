"""``etendue convert``: from one ray-file format to another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.terminal import check_folder, complain, one_of, print_json, progress_bar, say
from etendue.formats.rays import RAY_FORMATS, read_rays, write_rays
from etendue.quantities.ray_set import RaySet
from etendue.units import FLUX_UNITS, FluxUnit


def convert(
    inputs: Annotated[
        list[Path], typer.Argument(help="One ray file, or several to merge (a white LED: blue and yellow).")
    ],
    output: Annotated[Path, typer.Argument(help="The file to write.")],
    format: Annotated[
        str | None, typer.Option("--format", help="Format to write; from the extension of OUTPUT if not given.")
    ] = None,
    flux: Annotated[
        list[str] | None,
        typer.Option("--flux", help="Total flux that overrides the file's, e.g. 337 or 337lm; once per input."),
    ] = None,
    unit: Annotated[
        str | None, typer.Option("--unit", help="lm or W: convert the flux through the file's spectrum.")
    ] = None,
    subset: Annotated[int | None, typer.Option("--subset", help="Write this many rays, drawn at random.")] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of --subset.")] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Read one or more ray files and write one; complaints and losses are printed."""
    if format is not None:
        one_of(format, [f.name for f in RAY_FORMATS], "--format")
    check_folder(output)
    if flux and len(flux) != len(inputs):
        raise typer.BadParameter(f"--flux was given {len(flux)} times for {len(inputs)} input files")
    fluxes: list[str | None] = [*flux] if flux else [None] * len(inputs)
    sets = [with_flux(read_rays(path), text) for path, text in zip(inputs, fluxes, strict=True)]
    rays = RaySet.merge(sets) if len(sets) > 1 else sets[0]
    rays = in_unit(rays, unit)
    if subset is not None:
        rays = rays.subset(subset, seed)
    with progress_bar("rays", len(rays)) as progress:
        notes = write_rays(output, rays.watched(progress) if progress else rays, format)
    complaints = [str(c) for c in rays.complaints]
    if json:
        facts = {"output": output, "rays": len(rays), "total_flux": rays.total_flux, "flux_unit": rays.flux_unit}
        print_json(facts | {"complaints": complaints, "notes": list(notes)})
        return
    for line in (*complaints, *(f"note: {note}" for note in notes)):
        complain(line)
    say(f"{output}: {len(rays):,} rays, {rays.total_flux:.7g} {rays.flux_unit}")


def with_flux(rays: RaySet, text: str | None) -> RaySet:
    """The set with the total flux that an option states: a number, with the unit lm or W or in the set's own."""
    if text is None:
        return rays
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(lm|W)?\s*", text)
    try:
        value = float(match[1]) if match else None
    except ValueError:
        value = None
    if match is None or value is None:
        raise typer.BadParameter(f"{text!r}: give a flux with or without its unit, e.g. --flux 337 or --flux 337lm")
    stated: FluxUnit | None = "lm" if match[2] == "lm" else "W" if match[2] == "W" else None
    return rays.with_total_flux(value, stated)


def in_unit(rays: RaySet, unit: str | None) -> RaySet:
    """The set in the unit that an option names."""
    if unit is None:
        return rays
    one_of(unit, FLUX_UNITS, "--unit")
    return rays.in_unit("lm" if unit == "lm" else "W")
