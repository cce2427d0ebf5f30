"""FRED tabulated scatter, text: an incidence, and below it scattered directions with their values."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero, doubts, slice_of
from etendue.formats.bsdf.tokens import ADVICE, ended_lines
from etendue.formats.rays.text_rows import number
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.mirror_images import unfolded
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]
Block = tuple[float, float, list[tuple[float, float, float]]]

START = "type bsdf_data"

MISSING = "---"
"""In place of a value that was not measured."""

THETA = np.concatenate([np.arange(0.0, 80.0, 2.0), np.arange(80.0, 90.5, 1.0)])
ALONG = 1e-7
"""Angle that stands for light along the surface, which is reflected or transmitted [°]."""

PHI_STEP = 5.0
"""Directions of tables that are made to be written [°]."""


def recognise(head: bytes) -> bool:
    """By the first line."""
    first = head.removeprefix(b"\xef\xbb\xbf").split(b"\n", 1)[0]
    return b" ".join(first.split()).lower() == START.encode("ascii")


def read(path: Path) -> BsdfData:
    """Read all incidences, reflected and, beyond 90°, transmitted light.

    The light of an incidence at azimuth φ goes on towards φ: the mirrored and the straight direction have the azimuth of the
    incidence. Azimuths from 0 to 180° alone are those of a surface that is its own mirror image.
    """
    lines = ended_lines(path)
    scale = _scale(path, lines)
    blocks, gaps = _blocks(path, lines)
    sizes = [len(points) for _, _, points in blocks]
    if len(sizes) > 2 and len(set(sizes[:-1])) == 1 and sizes[-1] < sizes[0] and not gaps:
        found = f"{sizes[-1]} directions of the last incidence, {sizes[0]} of all others"
        raise FormatError(path, f"line {len(lines)}", found, ADVICE)
    mirrored = all(0.0 <= phi - turn <= 180.0 for _, turn, points in blocks for _, phi, _ in points)
    complaints = [Complaint("note", "values", f"{gaps} directions were not measured")] if gaps else []
    complaints += below_zero(np.array([f * scale for _, _, points in blocks for _, _, f in points]))
    slices = [one for block in blocks for one in _slices(path, block, scale, complaints, mirrored=mirrored)]
    return BsdfData(
        tuple(slices),
        isotropic=len({round(turn, 6) for _, turn, _ in blocks}) == 1,
        mirrored=mirrored,
        both_sides=True,
        name=path.stem,
        complaints=tuple(complaints),
    )


def _scale(path: Path, lines: list[str]) -> float:
    """Of the values, from the second line."""
    words = lines[1].split() if len(lines) > 1 else []
    if not words or words[0] != "format":
        raise FormatError(path, "line 2", "there is no 'format'", ADVICE)
    facts = dict(word.partition("=")[::2] for word in words[1:])
    for key, known in (("angles", "deg"), ("bsdf", "value")):
        if facts.get(key) != known:
            advice = f"étendue reads {key}={known} alone; export it so."
            raise FormatError(path, "line 2", f"{key} is {facts.get(key, 'not stated')[:40]!r}", advice)
    try:
        scale = number(facts.get("scale", "1"))
    except ValueError:
        scale = np.nan
    if not (np.isfinite(scale) and scale > 0.0):
        raise FormatError(path, "line 2", f"scale is {facts['scale'][:40]!r}", ADVICE)
    return scale


def _blocks(path: Path, lines: list[str]) -> tuple[list[Block], int]:
    """Angles of incidence, and (θ, φ, value) of each direction; how many values are missing."""
    blocks: list[Block] = []
    gaps = 0
    for at, line in enumerate(lines[2:], 3):
        fields = line.split()
        if not fields:
            continue
        gone = len(fields) == 3 and fields[2] == MISSING
        try:
            values = [number(field) for field in (fields[:2] if gone else fields)]
        except ValueError:
            values = [np.nan]
        most = (90.0, 180.0)[len(fields) == 3]
        if len(fields) not in (2, 3) or not all(map(math.isfinite, values)) or not 0.0 <= values[0] <= most:
            found = f"{line.strip()[:60]!r} is neither an incidence (θ φ) nor a direction (θ φ value)"
            raise FormatError(path, f"line {at}", found, ADVICE)
        if len(fields) == 2:
            blocks.append((values[0], values[1], []))
        elif not blocks:
            raise FormatError(path, f"line {at}", "a direction without an incidence before it", ADVICE)
        elif gone:
            gaps += 1
        else:
            blocks[-1][2].append((values[0], values[1], values[2]))
    if not blocks or not all(points for _, _, points in blocks):
        raise FormatError(path, f"line {len(lines)}", "an incidence without directions", ADVICE)
    if any(theta >= 90.0 for theta, _, _ in blocks):
        raise FormatError(path, "incidences", "one along the surface", "Angles of incidence are below 90°.")
    return blocks, gaps


def _slices(path: Path, block: Block, scale: float, complaints: list[Complaint], *, mirrored: bool) -> list[BsdfSlice]:
    """Reflected and transmitted light of an incidence, on the grid that its directions make."""
    theta, turn, points = block
    rows = np.array(points)
    found = []
    for transmitted in (False, True):
        own = rows[(rows[:, 0] > 90.0) == transmitted]
        if not len(own):
            continue
        polar = np.where(transmitted, 180.0 - own[:, 0], own[:, 0])
        incident = light_from(theta, (180.0 + turn) % 360.0)
        one = slice_of(incident, polar, own[:, 1], own[:, 2] * scale, transmitted)
        if one is None or one.grid is None:
            raise FormatError(
                path, f"{theta:g}° of incidence", "directions that make no grid", "Export a grid of θ and φ."
            )
        if mirrored:
            one = unfolded(one)
        complaints += doubts(one)
        found.append(one)
    return found


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables about the normal, from the front, of no wavelength."""
    return (
        bool(data.slices)
        and not data.components
        and all(
            one.grid is not None
            and one.grid.frame == "normal"
            and one.front
            and one.wavelength is None
            and not np.isnan(one.values).any()
            and one.grid.radial[-1] <= 90.0
            for one in data.slices
        )
    )


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light that meets the front, reflected and transmitted; along the surface as just above it."""
    slices = []
    for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
        radial = THETA[:-1] if transmitted else THETA
        for turn, theta in itertools.product(bsdf.turns if is_there else (), bsdf.incidences):
            incident = light_from(theta, (180.0 + turn) % 360.0)
            grid = PolarGrid("normal", radial, np.arange(0.0, 360.0, PHI_STEP) + turn)
            scattered = direction(np.minimum(radial, 90.0 - ALONG)[None, :], grid.azimuth[:, None], behind=transmitted)
            slices.append(BsdfSlice(incident, bsdf.evaluate(incident, scattered), transmitted, grid=grid))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write nine digits each; the values of a direction along the normal for each azimuth."""
    lines = [START, "format angles=deg bsdf=value scale=1"]
    ways: dict[tuple[float, float], list[BsdfSlice]] = {}
    for one in data.slices:
        ways.setdefault((round((one.phi - 180.0) % 360.0, 6) % 360.0, one.theta), []).append(one)
    for (turn, theta), slices in sorted(ways.items()):
        lines.append(f"{theta:.12g}\t{turn:.9g}")
        for one in slices:
            grid = one.grid
            assert grid is not None  # noqa: S101 - `fits` says so
            # Along the surface light counts as reflected.
            polar = 180.0 - np.minimum(grid.radial, 90.0 - ALONG) if one.transmitted else grid.radial
            for (i, r), (k, a) in itertools.product(enumerate(polar), enumerate(grid.azimuth)):
                lines.append(f"{r:.12g}\t{a:.9g}\t{one.values[k, i]:.9g}")
    stream.write(("\n".join(lines) + "\n").encode("ascii"))
    return () if data.both_sides else ("only light that meets the front is written",)


FORMAT = BsdfFormat("fred", "FRED tabulated scatter", (".dat",), recognise, read, fits, tabulate, write)
