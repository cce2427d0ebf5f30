"""``etendue patches``: a ray file as surface sources with intensity distributions, for other ray tracers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.options import Flux, Json, Unit
from etendue.cli.stated import refuse
from etendue.cli.terminal import complain, one_of, print_json, progress_bar, say, whole_numbers
from etendue.formats.output import atomic_output
from etendue.formats.patch_folder import PATCH_FORMATS, check_patch_folder
from etendue.formats.rays import read_rays
from etendue.formats.scenes import SCENES
from etendue.goniophotometry.threshold_sweep import THRESHOLDS, threshold_sweep
from etendue.lightfield.carrier import parse_surface
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.gridded.pixelated import CENTRES
from etendue.plot.threshold_picture import plot_threshold_sweep


def patches(
    file: Annotated[Path, typer.Argument(help="A ray file of any format.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder to be written, which is made.")],
    surface: Annotated[
        str, typer.Option("--surface", help="Carrier surface: plane:z=0, disk:radius=11.5, dome:radius=1.264 …")
    ] = "plane:z=0",
    pixel: Annotated[float, typer.Option("--pixel", help="Side of the squares on flat parts, in mm.")] = 1.0,
    centre_on: Annotated[
        str,
        typer.Option(
            "--centre-on", help="What lies at the centre, or at x = y = 0: a corner of squares, a pixel, or auto."
        ),
    ] = "auto",
    threshold: Annotated[
        float | None,
        typer.Option(
            "--threshold",
            help="Largest flux error E of a patch, in percent (thesis eq. 3.3); what suits the number of rays if not given.",
        ),
    ] = None,
    parallels: Annotated[
        int | None, typer.Option("--parallels", help="Cut a hemisphere into (2N-1)² cells; from --pixel if not given.")
    ] = None,
    coarsest: Annotated[
        str,
        typer.Option("--coarsest", help="Largest bins Δθ and Δφ, which are tried first, in degrees.", metavar="N,N"),
    ] = "30,90",
    finest: Annotated[
        str, typer.Option("--finest", help="Smallest bins Δθ and Δφ, which are tried last, in degrees.", metavar="N,N")
    ] = "1,1",
    format: Annotated[str, typer.Option("--format", help="Format of the intensity files: ies or ldt.")] = "ies",
    scene: Annotated[
        list[str] | None, typer.Option("--scene", help="Add a scene: radiance or mitsuba; several are allowed.")
    ] = None,
    sweep: Annotated[
        bool, typer.Option("--sweep", help="Also judge nine thresholds and this one: sweep.csv and sweep.png.")
    ] = False,
    seed: Annotated[int, typer.Option("--seed", help="Seed: chooses the rays that --sweep keeps back.", min=0)] = 1,
    flux: Flux = None,
    unit: Unit = None,
    json: Json = False,
) -> None:
    """Sample a ray file into patches, each with an intensity distribution of its own: thesis 3.2 and 3.3."""
    lids = one_of(format, PATCH_FORMATS, "--format")
    at = one_of(centre_on, CENTRES, "--centre-on")
    first = whole_numbers(coarsest, 2, "--coarsest", "30,90")
    last = whole_numbers(finest, 2, "--finest", "1,1")
    scenes = [one_of(name, SCENES, "--scene") for name in scene or []]
    if not sweep:
        refuse(["seed"], "for --sweep, which keeps rays back; without it none is drawn")
    carrier = parse_surface(surface)
    rays = in_unit(with_flux(read_rays(file), flux), unit)
    check_patch_folder(output, rays.flux_unit, lids, scenes)
    with progress_bar("rays", len(rays)) as progress:
        source = GriddedSource.fit(
            rays,
            carrier,
            pixel,
            threshold,
            parallels,
            progress,
            centre_on=at,
            coarsest_bins=(first[0], first[1]),
            finest_bins=(last[0], last[1]),
        )
    swept = None
    if sweep:
        thresholds = sorted({*THRESHOLDS, source.threshold} - {0.0}, reverse=True)
        with progress_bar("thresholds", len(rays)) as progress:
            swept = threshold_sweep(
                rays, carrier, pixel, thresholds, parallels, centre_on=at, seed=seed, progress=progress
            )
    source.save_patches(output, lids, scenes)
    if swept is not None:
        with atomic_output(output / "sweep.csv") as temporary:
            temporary.write_text(swept.to_csv(), encoding="utf-8")
        plot_threshold_sweep(swept, output / "sweep.png")
    complaints = [str(c) for c in rays.complaints]
    if json:
        facts = {"file": file, "output": output, "flux_unit": source.flux_unit, "patches": len(source.patches)}
        facts |= source.facts | {"scenes": scenes, "sweep": swept and swept.to_dict(), "complaints": complaints}
        print_json(facts)
        return
    for line in complaints:
        complain(line)
    say(f"{output}: {len(source.patches):,} patches on {source.surface.surface.told}")
    for note in source.notes:
        say(f"  {note}")
    if swept is not None:
        for name, criterion in (("ncc", "the far field (NCC)"), ("score", "rays kept back")):
            row = swept.best(name)
            found = f"NCC {100 * swept['ncc'][row]:.2f} %, score {swept['score'][row]:.3f} nat per ray"
            say(f"  threshold by {criterion}: {swept['threshold'][row]:g} % ({found})")
