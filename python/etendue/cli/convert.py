"""``etendue convert``: from one ray-file format to another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from etendue.cli.options import ray_format
from etendue.cli.stated import refuse
from etendue.cli.terminal import check_folder, complain, count, numbers, one_of, print_json, progress_bar, say
from etendue.errors import UnitError
from etendue.formats.rays import format_of_output, read_rays, write_rays
from etendue.formats.rays.ray_format import RayFormat
from etendue.lightfield.light_field import LightField
from etendue.quantities.powers_of_ten import counted
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
        str | None,
        typer.Option(
            "--unit",
            help="lm or W: the unit of OUTPUT; inputs are converted through their spectra or the totals they state. "
            "Without it: that of --flux, or of the inputs; lm if these differ. W where the format holds no other.",
        ),
    ] = None,
    subset: Annotated[
        int | None,
        typer.Option("--subset", help="Write this many rays, drawn at random.", parser=count(0), metavar="NUMBER"),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of --subset.")] = 1,
    rotate: Annotated[
        str | None,
        typer.Option(
            "--rotate",
            help="Turn the rays about an axis through the origin, right-handed: the axis, then degrees, e.g. 0,1,0,90.",
            metavar="X,Y,Z,ANGLE",
        ),
    ] = None,
    move: Annotated[
        str | None,
        typer.Option("--move", help="Shift the rays by so many mm, after --rotate, e.g. 0,0,12.5.", metavar="X,Y,Z"),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Read one or more ray files and write one; complaints and losses are printed."""
    if format is not None:
        ray_format(format)
    check_folder(output)
    chosen = format_of_output(output, format)
    if subset is None:
        refuse(["seed"], "for --subset, which draws rays; without it all are written as they are")
    turn = None if rotate is None else numbers(rotate, 4, "--rotate", "0,1,0,90")
    if turn is not None and not any(turn[:3]):
        raise typer.BadParameter(f"--rotate {rotate}: the axis has no length; give e.g. 0,1,0,90 for 90° about y")
    offset = None if move is None else numbers(move, 3, "--move", "0,0,12.5")
    if flux and len(flux) != len(inputs):
        raise typer.BadParameter(f"--flux was given {len(flux)} times for {len(inputs)} input files")
    fluxes: list[str | None] = [*flux] if flux else [None] * len(inputs)
    read = [read_rays(path) for path in inputs]
    wanted = _unit(unit, fluxes, read, chosen)
    sets = [in_unit(with_flux(rays, text), wanted) for rays, text in zip(read, fluxes, strict=True)]
    assumed = [note for old, new in zip(read, sets, strict=True) for note in _changes(old, new)]
    rays = RaySet.merge(sets) if len(sets) > 1 else sets[0]
    if subset is not None:
        rays = rays.subset(subset, seed)
    rays = rays if turn is None else rays.rotated(turn[:3], turn[3])
    rays = rays if offset is None else rays.moved(offset)
    if wanted is None:
        rays, turned = _as_stored(rays, chosen)
        assumed += turned
    with progress_bar("rays", len(rays)) as progress:
        losses = write_rays(output, rays.watched(progress) if progress else rays, format, flux_unit=wanted)
    notes = (*assumed, *losses)
    complaints = [str(c) for c in rays.complaints]
    if json:
        facts = {
            "output": output,
            "rays": rays.tally.usable,
            "total_flux": rays.total_flux,
            "flux_unit": rays.flux_unit,
        }
        print_json(facts | {"complaints": complaints, "notes": list(notes)})
        return
    for line in (*complaints, *(f"note: {note}" for note in notes)):
        complain(line)
    say(f"{output}: {rays.tally.usable:,} rays, {counted(rays.total_flux, rays.flux_unit)}")


def _unit(stated: str | None, fluxes: list[str | None], sets: list[RaySet], chosen: RayFormat) -> FluxUnit | None:
    """The unit of the output; None: that which all inputs have.

    The stated one, else the only one of the format, else that of the fluxes and of what has none, else lm if they differ.
    """
    if stated is not None:
        wanted = one_of(stated, FLUX_UNITS, "--unit")
        if chosen.unit not in (None, wanted):
            raise typer.BadParameter(f"--unit {wanted}: in a {chosen.title} rays have {chosen.unit}; leave it out")
        return wanted
    # Of rays without a spectrum the writer tells what the format wants.
    if chosen.unit is not None and all(rays.knows_spectrum for rays in sets):
        return chosen.unit
    ends = [
        next((unit for unit in FLUX_UNITS if text is not None and text.strip().endswith(unit)), None) for text in fluxes
    ]
    units = {end or rays.flux_unit for end, rays in zip(ends, sets, strict=True)}
    if len(units) > 1:
        return "lm"
    return units.pop() if any(ends) or len({rays.flux_unit for rays in sets}) > 1 else None


def _as_stored(rays: RaySet, chosen: RayFormat) -> tuple[RaySet, list[str]]:
    """The rays in watts if only so a file of the format holds all that is known of them, and the note that says so."""
    if not chosen.wants_watts(rays):
        return rays, []
    try:
        watts = rays.in_unit("W")
    except UnitError:
        return rays, []  # the writer tells what is lost
    reason = f"{chosen.title} holds wavelengths and spectra of rays beside W only"
    return watts, [f"{note}; {reason}" for note in _changes(rays, watts)]


def _changes(old: RaySet, new: RaySet) -> list[str]:
    """What was done to the flux of an input, and by which assumption."""
    steps = new.provenance.steps[len(old.provenance.steps) :]
    if not steps:
        return []
    told = f"{counted(old.total_flux, old.flux_unit)} became {counted(new.total_flux, new.flux_unit)}"
    return [f"{old.provenance.source}: {told}: {'; '.join(steps)}"]


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


Light = TypeVar("Light", RaySet, LightField)
"""What has a flux in lumens or watts."""


def in_unit(light: Light, unit: str | None) -> Light:
    """The set or field in the unit that an option names."""
    if unit is None:
        return light
    return light.in_unit(one_of(unit, FLUX_UNITS, "--unit"))
