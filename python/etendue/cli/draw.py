"""``etendue draw``: sections of a scene with a few rays, to see that it is what one meant."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.stated import refuse_without_picture
from etendue.cli.terminal import check_outputs, complain, numbers, print_json, say
from etendue.formats.maps import PICTURE_EXTENSIONS
from etendue.plot.scene_layout import DEFAULT_SECTIONS, SceneLayout, lay_out_scene
from etendue.plot.scene_picture import plot_layout
from etendue.scene import Scene


def draw(
    file: Annotated[Path, typer.Argument(help="A scene, .toml")],
    output: Annotated[
        list[Path] | None, typer.Option("-o", "--output", help="Picture (.png, .svg, .pdf); several are allowed.")
    ] = None,
    section: Annotated[
        list[str] | None,
        typer.Option(
            "--section",
            help="Plane across one of the axes, in mm, e.g. z=12.5; up to three (y=0 and x=0).",
            show_default=False,
        ),
    ] = None,
    rays: Annotated[int, typer.Option("--rays", help="Rays in each section, 0 to 1000.")] = 30,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the rays, 0 to 2^64 - 1.", min=0)] = 1,
    window: Annotated[
        str | None,
        typer.Option(
            "--window",
            help="What each section shows, in mm; all that has an end if not given.",
            metavar="LEFT,RIGHT,BOTTOM,TOP",
        ),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", help="Title of the picture; the scene's name if not given.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Draw sections of a scene to scale, with a few rays; say how large it is and what stands in it."""
    outputs = output or []
    refuse_without_picture(outputs, "title")
    check_outputs(outputs, PICTURE_EXTENSIONS)
    frame = None if window is None else numbers(window, 4, "--window", "-20,20,0,40")
    layout = lay_out_scene(Scene.load(file), section or DEFAULT_SECTIONS, rays=rays, seed=seed, window=frame)
    for path in outputs:
        plot_layout(layout, path, title=title)
    if json:
        print_json({"file": file, **layout.to_dict(), "outputs": outputs})
        return
    for note in layout.compiled.notes:
        if note not in layout.compiled.doubts:  # these were warnings
            complain(f"note: {note}")
    print_layout(layout)
    for path in outputs:
        say(f"  {path}")


def print_layout(layout: SceneLayout) -> None:
    """How large a scene is and what stands in it, for people."""
    facts = layout.to_dict()
    say(facts["scene"] or "scene")
    for axis, (low, high) in facts["bounds"].items():
        if math.isfinite(low):
            say(f"  {axis:<10} {low:.6g} to {high:.6g} mm")
    for what in ("sources", "solids", "surfaces", "detectors", "observers"):
        if facts[what]:
            say(f"  {what:<10} {', '.join(facts[what])}")
    for name, index in facts["media"].items():
        say(f"  {name:<10} n = {index:.5g} at {layout.wavelength:g} nm")
    for words, names in (("not cut", layout.uncut), ("farther away", layout.beyond)):
        if names:
            say(f"  {words}: {', '.join(names)}")
