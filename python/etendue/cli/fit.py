"""``etendue fit``: a ray file becomes a light field, which can be looked at, drawn from and exported."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.field import FIELD_EXTENSIONS, describe_field, print_field, surface_option
from etendue.cli.options import Flux, Json, Threads, Unit
from etendue.cli.terminal import check_outputs, complain, print_json, progress_bar, say, whole_numbers
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.formats.rays import read_rays
from etendue.lightfield.diagnostics import Diagnostics, diagnose
from etendue.lightfield.forecast import REFITS
from etendue.lightfield.light_field import LightField
from etendue.plot.characteristic_picture import plot_characteristic
from etendue.quantities.ray_set import RaySet


def fit(
    file: Annotated[Path, typer.Argument(help="A ray file of any format.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Light field to write, .h5")],
    surface: Annotated[
        str,
        typer.Option(
            "--surface",
            help="Carrier surface: auto, plane:z=0, disk:radius=11.5, dome:radius=1.264, cylinder:radius=2 …",
        ),
    ] = "auto",
    symmetry: Annotated[
        str,
        typer.Option("--symmetry", help="Symmetry of the source: none, auto, mirror-x, mirror-y, mirror-xy, c2 or c4."),
    ] = "none",
    depths: Annotated[
        str | None,
        typer.Option(
            "--depths", help="Halvings of the grid along s₁, s₂, a and b; chosen if not given.", metavar="N,N,N,N"
        ),
    ] = None,
    max_resolution: Annotated[
        float | None,
        typer.Option(
            "--max-resolution",
            help="Longer side of the finest cells over place in mm, for sets of very many rays; 1/512 of it if not given.",
            metavar="MM",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", help="Seed: decides which rays are held out of the fit to judge it.", min=0)
    ] = 1,
    threads: Threads = None,
    flux: Flux = None,
    unit: Unit = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", help="Picture of the diagnostics, .png, .svg or .pdf; takes about as long as the fit."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Estimate the luminance of every point in every direction from all rays of a file, with error bars."""
    check_outputs([output], FIELD_EXTENSIONS)
    check_outputs([report] if report else [], PICTURE_EXTENSIONS)
    carrier = surface_option(surface)
    grid = None if depths is None else depths_option(depths)
    rays = in_unit(with_flux(read_rays(file), flux), unit)
    started = time.perf_counter()
    with progress_bar("rays", len(rays)) as progress:
        field = LightField.fit(
            rays,
            carrier,
            symmetry=symmetry,
            depths=grid,
            max_resolution=max_resolution,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    seconds = time.perf_counter() - started
    field.save(output)
    diagnostics = None if report is None else _report(field, rays, report, seed, threads)
    complaints = [str(c) for c in rays.complaints]
    if json:
        facts = {"file": file, "output": output, "bytes": output.stat().st_size, "seconds": seconds}
        found = {} if diagnostics is None else {"report": report, "diagnostics": diagnostics.to_dict()}
        print_json(facts | describe_field(field) | found | {"complaints": complaints})
        return
    for line in complaints:
        complain(line)
    say(f"{output}: {output.stat().st_size / 1000:,.1f} kB, fitted in {seconds:.1f} s")
    print_field(field)
    if diagnostics is not None:
        for line in diagnostics.summary().splitlines():
            say(f"  {line}")
        say(f"  {report}")


def depths_option(text: str) -> tuple[int, int, int, int]:
    """The halvings of the grid that an option names."""
    s1, s2, a, b = whole_numbers(text, 4, "--depths", "5,5,5,5")
    return s1, s2, a, b


def _report(field: LightField, rays: RaySet, path: Path, seed: int, threads: int | None) -> Diagnostics:
    with progress_bar("refits", REFITS) as progress:
        diagnostics = diagnose(field, rays, seed=seed, threads=threads, progress=progress)
    plot_characteristic(diagnostics, path)
    return diagnostics
