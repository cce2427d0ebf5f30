"""``etendue sample``: as many rays as wanted from a light field, or from patches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.options import ray_format
from etendue.cli.terminal import check_folder, complain, count, print_json, progress_bar, say
from etendue.errors import ArgumentError
from etendue.formats.patch_folder import is_patch_folder
from etendue.formats.rays import RAY_FORMATS, writable_format, write_rays
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.light_field import LightField
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_stream import RayStream


def sample(
    file: Annotated[Path, typer.Argument(help="A light field or a folder of patches written by étendue.")],
    rays: Annotated[
        int, typer.Option("-n", "--rays", help="Number of rays, e.g. 1e8.", parser=count(), metavar="NUMBER")
    ],
    output: Annotated[list[Path], typer.Option("-o", "--output", help="Ray file to write; several get the same rays.")],
    format: Annotated[
        str | None, typer.Option("--format", help="Format to write; from the extension of the output if not given.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed: decides which rays are drawn.", min=0)] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Draw rays of equal flux from a light field or from patches, exactly as these are read out; they stream to disk."""
    if format is not None:
        ray_format(format)
    for path in output:
        check_folder(path)
        if format is None:
            _check_extension(path)
    source: LightField | GriddedSource
    stream: RayStream
    if is_patch_folder(file):
        source = GriddedSource.load(file)
        stream = source.sample(rays, seed)
    else:
        source = LightField.load(file)
        stream = source.rays(rays, seed)
    for path in output:
        writable_format(path, stream, format)
    losses: list[str] = []
    for path in output:
        with progress_bar(path.name, rays) as progress:
            notes = write_rays(path, stream.watched(progress) if progress else stream, format)
        losses += [f"{path}: {note}" for note in notes if note not in source.notes]
    if json:
        facts = {"file": file, "outputs": output, "rays": rays, "seed": seed}
        print_json(
            facts | {"total_flux": stream.total_flux, "flux_unit": stream.flux_unit, "notes": [*source.notes, *losses]}
        )
        return
    for note in (*source.notes, *losses):
        complain(f"note: {note}")
    for path in output:
        say(f"{path}: {rays:,} rays, {counted(stream.total_flux, stream.flux_unit)}")


def _check_extension(path: Path) -> None:
    """Refuse, before any work is done, an output whose format nobody could tell."""
    names = [f.name for f in RAY_FORMATS if path.suffix.lower() in f.extensions]
    if len(names) != 1:
        found = f"belongs to several formats: {', '.join(names)}" if names else "belongs to no ray format"
        known = ", ".join(sorted({extension for f in RAY_FORMATS for extension in f.extensions}))
        raise ArgumentError(f"{path}: the extension {path.suffix!r} {found}; give --format, or one of {known}.")
