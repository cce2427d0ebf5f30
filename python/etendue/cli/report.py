"""``etendue report``: a ray file on a page that an engineer signs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.field import surface_option
from etendue.cli.options import Flux, Json, Threads, Unit
from etendue.cli.terminal import angles, check_outputs, complain, numbers, print_json, progress_bar, say
from etendue.formats.rays import read_rays
from etendue.luminance.framing import centre_of_light, probe
from etendue.luminance.source_report import DISTANCE, report_source
from etendue.plot.report_page import PAGE_TYPES, plot_report
from etendue.quantities.observer import Observer


def report(
    file: Annotated[Path, typer.Argument(help="A ray file of any format.")],
    output: Annotated[
        list[Path], typer.Option("-o", "--output", help="Page (.html, .pdf, .png, .svg); several are allowed.")
    ],
    observer: Annotated[
        list[str] | None,
        typer.Option(
            "--observer",
            help="Direction θ,φ of an observer in degrees; may be given several times (0,0 30,0 60,0 60,90).",
            metavar="THETA,PHI",
            show_default=False,
        ),
    ] = None,
    distance: Annotated[
        float, typer.Option("--distance", help="Distance of stated observers from the target in mm.")
    ] = DISTANCE,
    target: Annotated[
        str | None,
        typer.Option(
            "--target",
            help="Point that stated observers look at, in mm (where the light is).",
            metavar="X,Y,Z",
            show_default=False,
        ),
    ] = None,
    surface: Annotated[str, typer.Option("--surface", help="Carrier surface, as for fit.")] = "auto",
    title: Annotated[
        str | None, typer.Option("--title", help="Title of the page; name of the file if not given.")
    ] = None,
    forecast: Annotated[
        bool, typer.Option("--forecast/--no-forecast", help="Say what more rays would bring, for the time of a fit.")
    ] = True,
    seed: Annotated[
        int, typer.Option("--seed", help="Seed: decides which rays are held out of the fit to judge it.", min=0)
    ] = 1,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Take a light field that was fitted before (etendue cache).")
    ] = True,
    threads: Threads = None,
    flux: Flux = None,
    unit: Unit = None,
    json: Json = False,
) -> None:
    """A source on one page: file facts and complaints, resolution, maps, intensity, how many rays more, provenance."""
    check_outputs(output, PAGE_TYPES)
    carrier = surface_option(surface)
    stated = None if observer is None else angles(observer)
    point = None if target is None else numbers(target, 3, "--target", "0,0,0.3")
    if stated is None and (target is not None or distance != DISTANCE):
        raise typer.BadParameter("--target and --distance: for observers that are stated; give --observer too")
    rays = in_unit(with_flux(read_rays(file), flux), unit)
    views = None
    if stated is not None:
        x, y, z = centre_of_light(probe(rays)) if point is None else point
        views = [Observer(theta, phi, distance, target=(x, y, z)) for theta, phi in stated]
    with progress_bar("rays", (2 if forecast else 1) * len(rays)) as progress:
        found = report_source(
            rays,
            surface=carrier,
            observers=views,
            title=title,
            forecast=forecast,
            seed=seed,
            cache=cache,
            threads=threads,
            progress=progress,
        )
    for path in output:
        plot_report(found, path)
    if json:
        print_json({"file": file, **found.to_dict(), "outputs": output})
        return
    for line in found.complaints:
        complain(line)
    say(f"{file}: {found.subtitle}")
    for line in (*found.quality_lines, *found.sheet.lines(), *found.notes):
        say(f"  {line}")
    for row in found.view_rows():
        say("  " + ", ".join(f"{label} {text}" for label, text in row))
    for path in output:
        say(f"  {path}")
