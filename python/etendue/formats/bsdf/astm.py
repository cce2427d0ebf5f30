"""ASTM E1392 and E2387 style text: lines of keys, then directions in radians with values."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import RIM, below_zero, slices_of
from etendue.formats.bsdf.tokens import ADVICE, ended_lines
from etendue.formats.rays.text_rows import number, whole
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")

ROUNDED = 1e-3
"""By which a whole turn, or half of one, may be more than that after rounding [rad]."""

THETA = np.concatenate([np.arange(0.0, 80.0, 2.0), np.arange(80.0, 90.0, 1.0)])
PHI_STEP = 5.0
"""Directions of tables that are made to be written [°]."""


def recognise(head: bytes) -> bool:
    """By the line that names the variables, and a key of the standard before it."""
    found = re.search(rb"^VARS[ \t]+theta_i[ \t]*,", head, re.MULTILINE)
    return found is not None and b"NUM_POINTS" in head


def read(path: Path) -> BsdfData:
    """Read all incidences, from both sides, reflected and transmitted; of X, Y, Z the second.

    Angles are those of étendue: from the normal of the front and from +x, of directions away from the surface; θ beyond 90°
    is behind it. So the mirrored direction has φs = φi + π. Directions that make a grid in θ and φ become one; others stand
    for what is nearest to them.
    """
    lines = ended_lines(path)
    facts, names, begin = _header(path, lines)
    rows = _rows(path, lines, begin, len(names), facts)
    channels, complaints = _channels(path, names, begin)
    angles = np.degrees(rows[:, :4])
    slices = [
        one
        for column, wavelength in channels
        for one in slices_of(angles, rows[:, column], complaints, wavelength=wavelength)
    ]
    complaints += below_zero(rows[:, [column for column, _ in channels]])
    turns = {round(one.phi, 4) for one in slices if one.theta > 1e-3}
    fronts = {one.front for one in slices}
    return BsdfData(
        tuple(slices),
        isotropic=len(turns) <= 1,
        mirrored=False,
        both_sides=len(fronts) == 1,
        name=facts.get("SAMPLE_NAME", "") or path.stem,
        complaints=tuple(complaints),
        facts=facts,
    )


def _header(path: Path, lines: list[str]) -> tuple[dict[str, str], list[str], int]:
    """Keys with their values, names of the variables, and the first line of data."""
    facts: dict[str, str] = {}
    for at, line in enumerate(lines):
        key, _, value = line.strip().partition(" ")
        key, value = (key, value) if value else (line.strip().partition("\t")[0], line.strip().partition("\t")[2])
        if key == "VARS":
            names = [name.strip() for name in value.split(",")]
            if tuple(names[:4]) != ANGLES or len(names) < 5 or len(set(names)) < len(names):
                found = f"VARS are {', '.join(names)[:100]}"
                raise FormatError(
                    path, f"line {at + 1}", found, f"They begin with {', '.join(ANGLES)}, and values follow."
                )
            return facts, names, at + 1
        facts[key] = value.strip()
    raise FormatError(path, f"line {len(lines)}", "there is no VARS", ADVICE)


def _rows(path: Path, lines: list[str], begin: int, columns: int, facts: dict[str, str]) -> Array:
    count = whole(facts.get("NUM_POINTS", ""))
    rows = []
    for at, line in enumerate(lines[begin:], begin + 1):
        if not line.strip():
            continue
        fields = line.split(",")
        try:
            values = [number(field.strip()) for field in fields]
        except ValueError:
            values = [np.nan]
        if len(fields) != columns or not all(map(math.isfinite, values)):
            found = f"{line.strip()[:60]!r} is not {columns} finite numbers"
            raise FormatError(path, f"line {at}", found, ADVICE)
        rows.append(values)
    if count is None or count != len(rows) or not rows:
        found = f"{len(rows)} points; NUM_POINTS is {facts.get('NUM_POINTS', 'not stated')[:20]!r}"
        raise FormatError(path, f"line {len(lines)}", found, ADVICE)
    angles = np.array(rows)
    # Angles below 0 are those a turn later; θ may run on either side of the normal.
    if (np.abs(angles[:, :4]) > 2.0 * np.pi + ROUNDED).any():
        raise FormatError(path, "angles", "angles beyond a turn", "They are in radians in this format.")
    angles[:, :4] = np.clip(angles[:, :4], -2.0 * np.pi, 2.0 * np.pi)
    for theta, phi in ((0, 1), (2, 3)):
        over = angles[:, theta] < 0.0
        angles[over, theta] *= -1.0
        angles[over, phi] += np.pi
        angles[:, phi] %= 2.0 * np.pi
    flat = np.abs(angles[:, 0] - 0.5 * np.pi) < np.radians(RIM)
    if flat.any() or (angles[:, [0, 2]] > np.pi + ROUNDED).any():
        raise FormatError(path, "angles", "light along the surface, or θ beyond π", "Leave such points out.")
    angles[:, [0, 2]] = np.minimum(angles[:, [0, 2]], np.pi)
    return angles


def _channels(path: Path, names: list[str], begin: int) -> tuple[list[tuple[int, float | None]], list[Complaint]]:
    """Columns to read, with their wavelengths [nm]."""
    own = names[4:]
    if len(own) == 1 and not own[0].endswith("nm"):
        return [(4, None)], []
    upper = [name.upper() for name in own]
    if upper == ["X", "Y", "Z"]:
        return [(5, None)], [Complaint("note", "VARS", "of X, Y, Z the second is read")]
    try:
        waves = [number(name.removesuffix("nm").strip()) for name in own]
    except ValueError:
        advice = "étendue reads one value, X,Y,Z, or wavelengths as 465nm."
        raise UnsupportedFormatError(path, f"line {begin}", f"values named {', '.join(own)[:60]}", advice) from None
    return [(4 + k, wave) for k, wave in enumerate(waves)], []


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables about the normal below 90°, at the same wavelengths for each incidence and way."""
    return (
        bool(data.slices)
        and not data.components
        and all(
            one.grid is not None
            and one.grid.frame == "normal"
            and one.grid.radial[-1] < 90.0
            and not np.isnan(one.values).any()
            for one in data.slices
        )
        and len({tuple(one.wavelength for one in colours) for colours in _colours(data)}) == 1
        and all(_alike(colours) for colours in _colours(data))
    )


def _colours(data: BsdfData) -> list[list[BsdfSlice]]:
    """The slices of each incidence and way, of rising wavelength."""
    found: dict[tuple[float, float, bool, bool], list[BsdfSlice]] = {}
    for one in sorted(data.slices, key=lambda one: one.wavelength or 0.0):
        found.setdefault((round(one.theta, 9), round(one.phi, 9), one.front, one.transmitted), []).append(one)
    return list(found.values())


def _alike(colours: list[BsdfSlice]) -> bool:
    """Whether slices are on one grid, each of another wavelength."""
    grids = [one.grid for one in colours if one.grid is not None]
    same = all(
        np.array_equal(one.radial, grids[0].radial) and np.array_equal(one.azimuth, grids[0].azimuth) for one in grids
    )
    return same and len({one.wavelength for one in colours}) == len(colours)


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light from both sides, or from the front if the back is alike; reflected and transmitted, at each known wavelength."""
    slices = []
    for front in (True,) if bsdf.both_sides else (True, False):
        for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
            for turn in bsdf.turns if is_there else ():
                for theta, wave in itertools.product(bsdf.incidences, bsdf.wavelengths or (None,)):
                    incident = light_from(theta, (180.0 + turn) % 360.0, behind=not front)
                    grid = PolarGrid("normal", THETA, np.arange(0.0, 360.0, PHI_STEP))
                    scattered = grid.directions(incident, transmitted=transmitted)
                    values = bsdf.evaluate(incident, scattered, wavelength=wave)
                    slices.append(BsdfSlice(incident, values, transmitted, grid=grid, wavelength=wave))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, both_sides=bsdf.both_sides, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write all points, twelve digits of the angles and nine of the values; a column for each wavelength."""
    rows = []
    places = _colours(data)
    for colours in places:
        one, values = colours[0], np.stack([colour.values for colour in colours])
        grid = one.grid
        assert grid is not None  # noqa: S101 - `fits` says so
        theta_i = np.radians(one.theta if one.front else 180.0 - one.theta)
        polar = np.radians(grid.radial if one.front != one.transmitted else 180.0 - grid.radial)
        azimuth = np.radians(grid.azimuth % 360.0)
        for k, a in enumerate(azimuth):
            for i, t in enumerate(polar):
                if i == 0 and k > 0 and grid.radial[0] == 0.0:
                    continue
                f = ",".join(f"{value:.9g}" for value in values[:, k, i])
                rows.append(f"{theta_i:.12g},{np.radians(one.phi):.12g},{t:.12g},{a:.12g},{f}")
    name = " ".join(data.name.encode("ascii", "replace").decode("ascii").split())
    head = ["LAB_NAME -", "SYSTEM_NAME etendue", f"SAMPLE_NAME {name}", f"NUM_POINTS {len(rows)}"]
    names = ["BSDF" if one.wavelength is None else f"{one.wavelength:.9g}nm" for one in places[0]]
    head.append(f"VARS {','.join([*ANGLES, *names])}")
    stream.write(("\n".join([*head, *rows]) + "\n").encode("ascii"))
    return ()


FORMAT = BsdfFormat("astm", "ASTM E1392/E2387 text", (".astm",), recognise, read, fits, tabulate, write)
