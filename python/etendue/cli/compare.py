"""``etendue compare``: how well a map agrees with a reference."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.stated import refuse
from etendue.cli.terminal import check_outputs, one_of, print_json, say
from etendue.formats.maps import PICTURE_EXTENSIONS, read_map
from etendue.luminance.comparison import DEAD_RULES, cross_section
from etendue.luminance.comparison import compare as compare_maps
from etendue.luminance.regions import parse_region
from etendue.plot import plot_comparison, plot_cross_sections
from etendue.plot.colour_scale import SCALES
from etendue.plot.comparison_picture import DIFFERENCES


def compare(
    test: Annotated[Path, typer.Argument(help="The map that is judged.")],
    reference: Annotated[Path, typer.Argument(help="The map it is judged by.")],
    region: Annotated[
        str | None, typer.Option("--region", help="Part of the screen, in mm.", metavar="LEFT,RIGHT,BOTTOM,TOP")
    ] = None,
    dead: Annotated[str, typer.Option("--dead", help="What a dead pixel counts as: zero, or exclude.")] = "zero",
    ignore_geometry: Annotated[
        bool, typer.Option("--ignore-geometry", help="Compare pixel by pixel even if observer or screen differ.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Picture of both maps and their difference: .png, .svg, .pdf")
    ] = None,
    difference: Annotated[
        str,
        typer.Option(
            "--difference",
            help="In the picture: maximum (signed, in % of the reference's), sigma (in standard errors), thesis (eq. 3.4).",
        ),
    ] = "maximum",
    scale: Annotated[
        str, typer.Option("--scale", help="Colours and sections: linear, log, or auto: by the range of the lit pixels.")
    ] = "auto",
    section_y: Annotated[
        float | None, typer.Option("--section-y", help="Cut both maps along the row at this height in mm.")
    ] = None,
    section_x: Annotated[
        float | None, typer.Option("--section-x", help="Cut both maps along the column at this position in mm.")
    ] = None,
    section_output: Annotated[
        Path | None, typer.Option("--section-output", help="Picture of the cross sections: .png, .svg, .pdf")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """NCC (3.5), NRMSE as printed (3.6), true RMSE over the reference's maximum, difference image (3.4), cross sections."""
    rule = one_of(dead, DEAD_RULES, "--dead")
    scaling, shown = one_of(scale, SCALES, "--scale"), one_of(difference, DIFFERENCES, "--difference")
    if (section_output is None) != (section_x is None and section_y is None):
        raise typer.BadParameter("--section-output goes with --section-x or --section-y")
    if section_x is not None and section_y is not None:
        raise typer.BadParameter("--section-x and --section-y: one picture shows one of them; run the command for each")
    check_outputs([p for p in (output, section_output) if p], PICTURE_EXTENSIONS)
    if output is None:
        refuse(["difference"], "for the picture of the difference; add -o picture.png, or leave it out")
    if output is None and section_output is None:
        refuse(["scale"], "for pictures; add -o or --section-output, or leave it out")
    limits = None
    if region is not None:
        limits = parse_region(region)
    a, b = read_map(test), read_map(reference)
    result = compare_maps(a, b, region=limits, dead=rule, ignore_geometry=ignore_geometry)
    # Before anything is written: a place may be off the screen.
    cuts = [cross_section(lmap, x=section_x, y=section_y) for lmap in (a, b) if section_output is not None]
    if output is not None:
        plot_comparison(result, output, scaling, difference=shown, labels=(test.name, reference.name))
    if section_output is not None:
        plot_cross_sections(cuts, section_output, scaling, labels=[test.name, reference.name])
    if json:
        print_json(result.to_dict() | {"outputs": [p for p in (output, section_output) if p]})
        return
    for line in result.summary().splitlines():
        say(line)
    for path in (output, section_output):
        if path is not None:
            say(f"  {path}")
