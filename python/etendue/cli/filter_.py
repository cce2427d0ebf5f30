"""``etendue filter``: smooth a map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from etendue.cli.maps import print_map, summary, write_map
from etendue.cli.stated import refuse, refuse_without_picture
from etendue.cli.terminal import check_outputs, complain, one_of, print_json, say
from etendue.formats.maps import MAP_EXTENSIONS, PICTURE_EXTENSIONS, read_map
from etendue.luminance.denoising import denoise_map
from etendue.luminance.filters import FILTERS, filter_map
from etendue.plot.colour_scale import SCALES

KINDS = ("opt", *FILTERS)
"""The denoiser by optional Pólya tree, and the filters of the thesis."""


def filter_(
    file: Annotated[Path, typer.Argument(help="A map written by étendue.")],
    kind: Annotated[str, typer.Option("--kind", help=f"Filter: {', '.join(KINDS)}.")],
    output: Annotated[list[Path], typer.Option("-o", "--output", help="Map to write; several are allowed.")],
    size: Annotated[int, typer.Option("--size", help="Pixels along each side of the kernel, odd.")] = 5,
    gamma: Annotated[
        float, typer.Option("--gamma", help="Largest relative deviation of a neighbour (eq. 2.6); selective filters.")
    ] = 0.2,
    scale: Annotated[
        str, typer.Option("--scale", help="Colours of a picture: auto, linear or log; auto: what its values ask for.")
    ] = "auto",
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Smooth a map: opt needs no setting and keeps the flux; the four filters of the thesis report what they lose."""
    kind = one_of(kind, KINDS, "--kind")
    colours = one_of(scale, SCALES, "--scale")
    if kind == "opt":
        refuse(["size", "gamma"], f"for {', '.join(FILTERS)}; opt needs no setting. Leave it out")
    elif not FILTERS[kind].selective:
        refuse(["gamma"], f"for the selective filters, and {kind} is none; leave it out")
    refuse_without_picture(output, "scale")
    check_outputs(output, (*MAP_EXTENSIONS, *PICTURE_EXTENSIONS))
    noisy = read_map(file)
    smooth = denoise_map(noisy) if kind == "opt" else filter_map(noisy, kind, size=size, gamma=gamma)
    losses = write_map(smooth, output, colours)
    if json:
        print_json(summary(smooth) | {"outputs": output, "losses": losses})
        return
    for note in losses:
        complain(f"note: {note}")
    print_map(smooth)
    for path in output:
        say(f"  {path}")
