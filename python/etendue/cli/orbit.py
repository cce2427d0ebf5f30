"""Observers around a source, and the moving pictures of what they see: ``etendue luminance --orbit``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import typer

from etendue.cli.terminal import check_folder
from etendue.plot.animation_files import ANIMATION_EXTENSIONS, writer_for
from etendue.quantities.observer import Observer, Screen

FEWEST, MOST = 2, 720
"""Observers of an orbit."""


def moving_outputs(output: Sequence[Path], orbit: int | None) -> tuple[list[Path], list[Path]]:
    """Outputs that are moving pictures, and the others; those can be written.

    Raises
    ------
    typer.BadParameter
        If there are moving pictures and no orbit.
    ArgumentError
        If the folder of one does not exist, or ffmpeg is needed and not there.
    """
    moving = [path for path in output if path.suffix.lower() in ANIMATION_EXTENSIONS]
    if moving and orbit is None:
        raise typer.BadParameter(
            f"{moving[0]}: a moving picture is of many observers; give --orbit 36, or write a picture (.png, .svg, .pdf)"
        )
    for path in moving:
        check_folder(path)
        writer_for(path)
    return moving, [path for path in output if path not in moving]


def around(observers: Sequence[Observer], orbit: int) -> list[Observer]:
    """As many observers, φ in even steps from that of the one given, at his θ; +Z stands upright unless he says what does.

    Raises
    ------
    typer.BadParameter
        If several are given, or he stands on the axis; or the number is out of its range.
    """
    if not FEWEST <= orbit <= MOST:
        raise typer.BadParameter(f"{orbit}: give {FEWEST} to {MOST} observers, e.g. --orbit 36", param_hint="--orbit")
    if len(observers) != 1:
        raise typer.BadParameter(
            f"--orbit goes around from one --observer, and {len(observers)} are given; leave the others out"
        )
    (first,) = observers
    if first.theta in (0.0, 180.0):
        raise typer.BadParameter(
            f"--orbit goes around in φ; from θ = {first.theta:g}° all views are of the same side. Give e.g. --observer 30,0"
        )
    up = (0.0, 0.0, 1.0) if first.up is None else first.up
    step = 360.0 / orbit
    phis = [(first.phi + number * step) % 360.0 for number in range(orbit)]
    # Names of files have these angles in them: 7.2, not 7.200000000000001.
    return [dataclasses.replace(first, phi=float(f"{phi:.9g}"), up=up) for phi in phis]


def alike(screens: Sequence[Screen]) -> list[Screen]:
    """The largest of all screens in the place of each, so that a picture keeps its scale."""
    return [max(screens, key=lambda screen: screen.width * screen.height)] * len(screens)
