"""``etendue intensity``: how much a source sends into every direction."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.distributions import describe_intensity, print_intensity
from etendue.cli.field import complaints_of, read_source
from etendue.cli.options import Flux, Json, Unit
from etendue.cli.stated import refuse_without_picture
from etendue.cli.terminal import check_outputs, complain, one_of, print_json, progress_bar, say
from etendue.cli.writing import Writing
from etendue.errors import UnsupportedFormatError
from etendue.formats.intensity import (
    INTENSITY_EXTENSIONS,
    detect_intensity_format,
    read_intensity,
    write_intensity,
)
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.formats.patch_folder import is_patch_folder
from etendue.formats.rays.refused import INTENSITY_FILE
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.light_field import LightField
from etendue.plot.intensity_picture import INTENSITY_KINDS, plot_intensity
from etendue.quantities.intensity_nodes import check_steps
from etendue.quantities.ray_set import RaySet


def intensity(
    file: Annotated[
        Path,
        typer.Argument(
            help="A ray file of any format, a light field, patches, or an IES, EULUMDAT, TM-33 or GLDF file."
        ),
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "-o", "--output", help="Distribution (.ies, .ldt) or picture (.png, .svg, .pdf); several are allowed."
        ),
    ] = None,
    c_planes: Annotated[
        int | None,
        typer.Option("--c-planes", help="Number of half planes C (chosen from the light).", min=1, show_default=False),
    ] = None,
    gamma_step: Annotated[
        float | None,
        typer.Option(
            "--gamma-step",
            help="Step of γ in degrees (chosen from the light).",
            show_default=False,
        ),
    ] = None,
    flux: Flux = None,
    unit: Unit = None,
    photometry: Annotated[
        str | None,
        typer.Option("--photometry", help="Which one of an intensity file that holds several (TM-33, GLDF)."),
    ] = None,
    rotate: Annotated[
        float, typer.Option("--rotate", help="Turn about the axis: C becomes C + this, in degrees.")
    ] = 0.0,
    mirror: Annotated[bool, typer.Option("--mirror", help="C becomes -C (before --rotate).")] = False,
    kind: Annotated[str, typer.Option("--kind", help="Kind of picture: polar or cartesian.")] = "polar",
    per_klm: Annotated[bool, typer.Option("--per-klm", help="Picture in cd/klm, of the lamps where known.")] = False,
    json: Json = False,
) -> None:
    """Far-field intensity of rays, a light field, patches or an intensity file: in figures, as a file, as a picture."""
    outputs = output or []
    shape = one_of(kind, INTENSITY_KINDS, "--kind")
    refuse_without_picture(outputs, "kind", "per_klm")
    check_outputs(outputs, (*INTENSITY_EXTENSIONS, *PICTURE_EXTENSIONS))
    if is_patch_folder(file):
        _refuse(file, "ray and intensity files", {"--photometry": photometry, "--flux": flux, "--unit": unit})
        patches = GriddedSource.load(file)
        result, complaints = patches.intensity(c_planes or 36, gamma_step or 2.5), list(patches.notes)
    elif detect_intensity_format(file) is None:
        if photometry is not None:
            raise typer.BadParameter(f"--photometry: for intensity files, and {file} is none")
        check_steps(c_planes, gamma_step)
        source = _source(file, flux, unit)
        if isinstance(source, LightField):
            result = source.intensity(c_planes, gamma_step)
        else:
            with progress_bar("rays", len(source)) as progress:
                result = intensity_distribution(source, c_planes, gamma_step, progress=progress)
        complaints = complaints_of(source)
    else:
        _refuse(file, "ray files", {"--flux": flux})
        _refuse(
            file, "ray files and light fields", {"--c-planes": c_planes, "--gamma-step": gamma_step, "--unit": unit}
        )
        result = read_intensity(file, photometry)
        complaints = [str(c) for c in result.complaints]
    shown = result.mirrored() if mirror else result
    shown = shown.rotated_about_axis(rotate) if rotate else shown
    writing = Writing()

    def write(path: Path) -> tuple[str, ...]:
        if path.suffix.lower() not in PICTURE_EXTENSIONS:
            return write_intensity(path, result, rotate=rotate, mirror=mirror)
        plot_intensity(shown, path, shape, per_klm=per_klm)
        return ()

    for path in outputs:
        writing.write(path, write)
    if json:
        found = {"outputs": writing.done, "complaints": complaints, "losses": writing.losses}
        print_json({"file": file, **describe_intensity(shown), **found})
    else:
        for line in (*complaints, *(f"note: {note}" for note in writing.losses)):
            complain(line)
        print_intensity(shown)
        for path in writing.done:
            say(f"  {path}")
    writing.finish()


def _refuse(file: Path, kinds: str, given: Mapping[str, object]) -> None:
    """Refuse options that belong to other kinds of files."""
    needless = [option for option, value in given.items() if value is not None]
    if needless:
        raise typer.BadParameter(f"{', '.join(needless)}: for {kinds}, and {file} is none of these")


def _source(file: Path, flux: str | None, unit: str | None) -> RaySet | LightField:
    try:
        return read_source(file, flux, unit)
    except UnsupportedFormatError as error:
        if error.advice == INTENSITY_FILE:
            # The name promises intensity, which is what this verb reads: say why the content is none.
            read_intensity(file)
        raise
