"""``etendue sweep``: measures of a scene over one of its numbers, or over a grid of several."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from etendue.cli.guard import require_apart
from etendue.cli.options import Json, Threads
from etendue.cli.stated import refuse
from etendue.cli.terminal import (
    INTERRUPTED,
    angles,
    both_sides,
    check_outputs,
    complain,
    count,
    numbers,
    print_json,
    progress_bar,
    say,
    whole_numbers,
)
from etendue.cli.writing import Writing
from etendue.errors import ArgumentError
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.luminance.regions import parse_region
from etendue.plot.sweep_picture import plot_sweep, require_drawable
from etendue.quantities.measured import measured
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.powers_of_ten import counted
from etendue.scene import Scene
from etendue.sweeps.measures import NOUNS
from etendue.sweeps.parameter import parse_setting
from etendue.sweeps.running import LINES, RAYS, sweep_steps
from etendue.sweeps.table import EXTENSIONS, SweepTable

PIXELS = "128,128"


def sweep(
    file: Annotated[Path, typer.Argument(help="A scene, .toml")],
    setting: Annotated[
        list[str],
        typer.Option(
            "--set",
            help="A number of the scene and its values: lens.at.2=5:9:0.5 from 5 to 9 in steps of 0.5, or =5,6,7.5. Given "
            "several times, every combination is a step.",
            metavar="PATH=VALUES",
        ),
    ],
    measure: Annotated[
        list[str],
        typer.Option(
            "--measure",
            help=f"What is measured: {', '.join(NOUNS)}; several with commas. Of a detector, observer or part: flux:desk.",
            metavar="NAME,NAME:OF",
        ),
    ],
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Table (.csv) or picture (.png, .svg, .pdf); several are allowed."),
    ] = None,
    observer: Annotated[
        list[str] | None,
        typer.Option(
            "--observer",
            help="Direction θ,φ of the observer in degrees; may be given several times. "
            "The scene's own observers if not given.",
            metavar="THETA,PHI",
        ),
    ] = None,
    distance: Annotated[float, typer.Option("--distance", help="Distance from target to observer in mm.")] = 1000.0,
    target: Annotated[
        str, typer.Option("--target", help="Point looked at, in mm.", metavar="X,Y,Z", show_default=True)
    ] = "0,0,0",
    size: Annotated[
        str | None,
        typer.Option(
            "--size",
            help="Width and height of the screen in mm; framed to the scene at all steps if not given.",
            metavar="W,H",
        ),
    ] = None,
    pixels: Annotated[str, typer.Option("--pixels", help="Columns and rows of each map.", metavar="C,R")] = PIXELS,
    region: Annotated[
        str | None,
        typer.Option(
            "--region",
            help="Part of the observers' maps that mean, extremes and uniformity are of.",
            metavar="LEFT,RIGHT,BOTTOM,TOP|X/Y,X/Y,X/Y",
        ),
    ] = None,
    rays: Annotated[
        int,
        typer.Option("--rays", help="Rays of each trace, e.g. 1e7.", parser=count(), metavar="NUMBER"),
    ] = RAYS,
    rays_per_pixel: Annotated[
        int,
        typer.Option(
            "--rays-per-pixel", help="Lines of sight per pixel of each map.", parser=count(), metavar="NUMBER"
        ),
    ] = LINES,
    seed: Annotated[int, typer.Option("--seed", help="Seed of every step, 0 to 2^64 - 1.", min=0)] = 1,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Take light fields from those fitted before (etendue cache).")
    ] = True,
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Measure a scene over one of its numbers, or over a grid of several: a table, a picture. Ctrl-C keeps what was done."""
    outputs = output or []
    names = [name.strip() for text in measure for name in text.split(",") if name.strip()]
    _refuse_idle(names, stated_observer=bool(observer))
    check_outputs(outputs, (*EXTENSIONS, *PICTURE_EXTENSIONS))
    scene = Scene.load(file)
    require_apart([file, *scene.read_files()], outputs)
    settings = _settings(setting)
    steps = sweep_steps(
        scene,
        settings,
        names,
        _observers(observer, distance, target),
        _screen(size, pixels) if observer else None,
        region=None if region is None else parse_region(region),
        rays=rays,
        rays_per_pixel=rays_per_pixel,
        seed=seed,
        cache=cache,
        threads=threads,
    )
    if any(path.suffix.lower() in PICTURE_EXTENSIONS for path in outputs):
        require_drawable(settings, len(steps.measures))
    table: SweepTable | None = None
    interrupted = False
    with progress_bar("steps", len(steps)) as progress:
        try:
            for table in steps:
                if progress is not None:
                    progress(table.done)
        except KeyboardInterrupt:
            if table is None:
                raise
            interrupted = True
    assert table is not None  # noqa: S101 - there is at least one step
    writing = Writing()
    for path in outputs:
        writing.write(path, table.save if path.suffix.lower() in EXTENSIONS else functools.partial(_draw, table))
    if interrupted:
        complain(f"stopped; what was written has {table.done:,} of {table.steps:,} steps, each of them whole")
    if json:
        print_json({"file": file, **table.to_dict(), "outputs": writing.done, "interrupted": interrupted})
    else:
        print_table(table)
        for path in writing.done:
            say(f"  {path}")
    writing.finish()
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def _draw(table: SweepTable, path: Path) -> None:
    plot_sweep(table, path)


def _refuse_idle(names: list[str], *, stated_observer: bool) -> None:
    """Refuse options of observers where there are none, or none whose map is measured, and rays where none is traced."""
    if not stated_observer:
        of_observers = ("distance", "target", "size", "pixels")
        refuse(of_observers, "for --observer; the scene's own observers have places and screens of their own")
    reads = {NOUNS[word].reads for name in names if (word := name.partition(":")[0].strip()) in NOUNS}
    if reads and not reads & {"map", "observer"}:
        needless = ("observer", "distance", "target", "size", "pixels", "region", "rays_per_pixel")
        refuse(needless, f"for measures of what an observer sees, and {', '.join(names)} is none")
    if reads == {"observer"}:
        refuse(["rays"], f"for measures of a trace, and {', '.join(names)} is none")


def _settings(texts: list[str]) -> dict[str, tuple[float, ...]]:
    """Parameters and values.

    Raises
    ------
    ArgumentError
        If one is given twice.
    """
    found: dict[str, tuple[float, ...]] = {}
    for text in texts:
        path, values = parse_setting(text)
        if path in found:
            raise ArgumentError(f"--set {path} is given twice; put all its values into one, e.g. {path}=5,6,7.5.")
        found[path] = values
    return found


def _observers(texts: list[str] | None, distance: float, target: str) -> list[Observer] | None:
    if not texts:
        return None
    x, y, z = numbers(target, 3, "--target", "0,0,0")
    return [Observer(theta, phi, distance, (x, y, z)) for theta, phi in angles(texts)]


def _screen(size: str | None, pixels: str) -> Screen | tuple[int, int]:
    """Of the size that is stated, else to be framed."""
    columns, rows = whole_numbers(both_sides(pixels), 2, "--pixels", PIXELS)
    if size is None:
        return columns, rows
    width, height = numbers(both_sides(size), 2, "--size", "25,25")
    return Screen(width, height, columns, rows)


def print_table(table: SweepTable) -> None:
    """A sweep in figures, for people."""
    names = [*table.parameters, *table.values]
    rows = [names]
    for found in table.rows():
        place, pairs = found[: len(table.parameters)], found[len(table.parameters) :]
        cells = [f"{value:g} {table.unit(name)}".rstrip() for name, value in zip(table.parameters, place, strict=True)]
        for name, value, error in zip(table.values, pairs[::2], pairs[1::2], strict=True):
            cells.append(measured(value, error, table.unit(name)).rstrip())
        rows.append(cells)
    widths = [max(len(row[i]) for row in rows) for i in range(len(names))]
    for row in rows:
        say("  ".join(f"{cell:>{width}}" for cell, width in zip(row, widths, strict=True)))
    for note in table.notes:
        say(f"  {note}")
    _say_best(table)


def _say_best(table: SweepTable) -> None:
    """Where each measure is largest."""
    if table.done < 2:
        return
    for name, values in table.values.items():
        known = values[np.isfinite(values)]
        if known.size and known.max() > known.min():
            place = ", ".join(
                f"{path} = {value:g} {table.unit(path)}".rstrip() for path, value in table.best(name).items()
            )
            say(f"  largest {name}: {counted(float(known.max()), table.unit(name))} at {place}")
