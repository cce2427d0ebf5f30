"""``etendue view``: what a source looks like, to be moved and measured in a browser, or as a file that can be mailed."""

from __future__ import annotations

import contextlib
import shlex
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

from etendue.cli.convert import in_unit, with_flux
from etendue.cli.detectors import check_detector
from etendue.cli.options import Flux, Json, Threads, Unit
from etendue.cli.stated import refuse
from etendue.cli.terminal import check_outputs, complain, count, print_json, progress_bar, say
from etendue.lightfield.light_field import LightField
from etendue.quantities.ray_set import RaySet
from etendue.scene import Scene
from etendue.tracing.result import TraceResult
from etendue.tracing.storage import is_result_file
from etendue.viewer.file_output import PAGE_EXTENSIONS, write_page
from etendue.viewer.opening import SCENE_RAYS, Viewable, exhibit_of, of_detector, open_viewable
from etendue.viewer.server import ViewerServer


def view(
    file: Annotated[
        Path,
        typer.Argument(help="A light field, rays, an index of rays, a map, the result of a trace, or a scene (.toml)."),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="Page to write, .html: one file that works offline. If not given, it is served."
        ),
    ] = None,
    detector: Annotated[
        str | None,
        typer.Option("--detector", help="Of the result of a trace: the detector whose map or rays are shown."),
    ] = None,
    rays: Annotated[
        int | None,
        typer.Option(
            "--rays",
            help="Of a scene: rays that are traced for the light field around it (2000000).",
            parser=count(),
            metavar="NUMBER",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of that trace.", min=0)] = 1,
    flux: Flux = None,
    unit: Unit = None,
    title: Annotated[
        str | None, typer.Option("--title", help="Title of the page; the file's name if not given.")
    ] = None,
    port: Annotated[
        int, typer.Option("--port", help="Port on which the page is served; 0: any that is free.", min=0, max=65535)
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Take light fields from those fitted before (etendue cache).")
    ] = True,
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Look at a source from all sides and measure it: in the browser, or in a page of one file to be handed on."""
    check_outputs([output] if output else [], PAGE_EXTENSIONS)
    if output is not None:
        refuse(("port", "browser"), "for a page that is served, and --output writes one; leave it out")
    viewable = _in_unit(_opened(file, detector), file, flux, unit)
    if not isinstance(viewable, Scene):
        refuse(("rays", "seed"), f"for scenes, which are traced; {file} is none")
    total = (
        (rays or SCENE_RAYS) if isinstance(viewable, Scene) else len(viewable) if isinstance(viewable, RaySet) else 0
    )
    with progress_bar("rays", total) if total else contextlib.nullcontext() as progress:
        exhibit = exhibit_of(
            viewable,
            name=title or file.name,
            file=str(file),
            options=_spelled({"--detector": detector, "--flux": flux, "--unit": unit}),
            rays=rays,
            seed=seed,
            cache=cache,
            threads=threads,
            progress=progress,
        )
    complaints = [str(c) for c in viewable.complaints] if isinstance(viewable, RaySet) else []
    facts: dict[str, Any] = {
        "file": file,
        "shown": exhibit.subject["kind"],
        "bound": exhibit.subject.get("field", {}).get("bound"),
        "notes": exhibit.subject["notes"],
        "complaints": complaints,
    }
    if not json:
        for line in complaints:
            complain(line)
        for note in exhibit.source.notes:
            complain(f"note: {note}")
    if output is not None:
        write_page(exhibit, output)
        if json:
            print_json({**facts, "output": output, "bytes": output.stat().st_size})
        else:
            say(f"{output}: {output.stat().st_size / 1000:,.1f} kB. {exhibit.subject['accuracy']}")
        return
    with ViewerServer(exhibit, port, threads) as server:
        if json:
            print_json({**facts, "url": server.url})
        else:
            say(f"{server.url} (good for one visit, on this machine); Ctrl-C ends it")
        if browser:
            webbrowser.open(server.url)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()


def _spelled(options: dict[str, str | None]) -> str:
    """The options that are stated, as a shell takes them."""
    return shlex.join(word for name, value in options.items() if value is not None for word in (name, value))


def _opened(file: Path, detector: str | None) -> Viewable:
    """What the file holds, or what the detector of a trace saw.

    Raises
    ------
    UnknownNameError, ArgumentError
        If there is no such detector, or several and none is named.
    """
    if detector is None or not (file.is_file() and is_result_file(file)):
        return open_viewable(file, detector)
    result = TraceResult.load(file)
    check_detector(result, detector, {**result.images, **result.illuminance, **result.rays}, "map or rays")
    return of_detector(result, detector)


def _in_unit(viewable: Viewable, file: Path, flux: str | None, unit: str | None) -> Viewable:
    """With flux and unit as the options state.

    Raises
    ------
    typer.BadParameter
        If there is nothing that they could change.
    """
    if isinstance(viewable, RaySet):
        return in_unit(with_flux(viewable, flux), unit)
    if flux is not None:
        raise typer.BadParameter(f"--flux: for ray files; {file} is none")
    if isinstance(viewable, LightField):
        return in_unit(viewable, unit)
    if unit is not None:
        raise typer.BadParameter(f"--unit: for rays and light fields; {file} is neither")
    return viewable
