"""TracePro surface property text: shares by angle, scatter by formulas, tables about the specular direction; two sides."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import UnsupportedFormatError
from etendue.formats.bsdf import tracepro_tables
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.functions import values_on
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.regular import regular_of
from etendue.formats.bsdf.tracepro_balance import Lit, chosen, only, unbalanced
from etendue.formats.bsdf.tracepro_lines import (
    COLUMNS,
    SIDES,
    Lines,
    Rows,
    once_at_the_normal,
    section_of,
)
from etendue.formats.bsdf.tracepro_models import Numbers, Way, forwards, made
from etendue.formats.bsdf.tracepro_readings import readings
from etendue.formats.bsdf.tracepro_writing import ABG, ASYMMETRIC, NONE, START, TWO_SIDED, plan_of, write
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import NORMAL, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

SCATTER = ("none", "ABg", "elliptical ABg", "elliptical Gaussian", "table", "asymmetric table", "1D ABg", "1D table",
           "BSDF property")  # fmt: skip
"""Kinds of scatter by their number."""

TABLE, LISTED, ELSEWHERE = 4, 7, 8

COATING = ("none", "table", "stack", "grating", "anisotropic", "DLL", "", "direction-sensitive")
BARE = 0
READ_COATINGS = (BARE, 1, 4, TWO_SIDED)

WAYS = ("reflected", "transmitted")

BETA = np.concatenate([[0.0], np.geomspace(0.005, 2.0, 60)])
AZIMUTH_STEP = 10.0
"""Of tables that are made to be written: |β − β₀|, and steps of azimuths [°]."""


def recognise(head: bytes) -> bool:
    """By the first line."""
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(START.encode("ascii"))


@dataclasses.dataclass(frozen=True, eq=False)
class _Side:
    """What is said of light that meets one side: its rows of shares, at one temperature, and where its section is."""

    front: bool
    rows: Rows
    begin: int
    end: int


def read(path: Path) -> BsdfData:
    """Read one property: specular shares, and scatter by a formula or a table; of several temperatures the first.

    With one azimuth of incidence the zero of scatter azimuths is the floating axis, at right angles to the plane of
    incidence, on the right of the light that goes on; with more azimuths it is the axis of the sample.
    """
    lines = Lines(path)
    scatter, two = _kinds(lines)
    sides: list[_Side] = []
    complaints = list(_notes(lines))
    for front, (begin, end) in zip((True, False), lines.sides(two=two), strict=False):
        rows = lines.rows(COLUMNS, begin, end)
        temperature = (sides[0].rows if sides else rows).values[0, 0]
        kept = rows.values[:, 0] == temperature
        if not kept.all():
            complaints.append(
                Complaint("note", "Temperature", f"temperatures other than {temperature:g} K are left out")
            )
        if not kept.any():
            raise lines.refuse(int(rows.line[0]), f"a temperature that [{SIDES[0]}] does not have")
        sides.append(_Side(front, once_at_the_normal(rows.where(kept)), begin, end))
    turns = {float(phi) % 360.0 for side in sides for phi in side.rows.values[side.rows.values[:, 2] >= NORMAL, 3]}
    turning = len(turns) <= 1
    components = _specular(lines, sides, complaints)
    slices: list[BsdfSlice] = []
    if scatter in (TABLE, ASYMMETRIC):
        for side in sides:
            blocks = tracepro_tables.blocks_of(lines, side.rows, side.begin, side.end)
            tables = tracepro_tables.slices_of(lines, side.rows, blocks, front=side.front, turning=turning)
            slices += tables.slices
            complaints += tables.complaints
    elif scatter != NONE:
        more, slices = _by_numbers(lines, sides, scatter, complaints, turning=turning)
        components += more
    stretched = any("aspect" in one for one in components)
    around = {round(one.phi, 6) for one in slices if one.theta >= NORMAL}
    return BsdfData(
        tuple(slices),
        tuple(components),
        isotropic=turning or (len(around) <= 1 and not stretched),
        mirrored=scatter not in (ASYMMETRIC, LISTED),
        both_sides=not two,
        name=lines.value("Name")[1] or path.stem,
        complaints=tuple(complaints),
        facts={"scatter": SCATTER[scatter], "zero of azimuth": "floating axis" if turning else "axis of the sample"},
    )


def _kinds(lines: Lines) -> tuple[int, bool]:
    """The kind of scatter, and whether there are two sides; what is known and not read is refused by name."""

    def unsupported(at: int, found: str, advice: str) -> UnsupportedFormatError:
        return UnsupportedFormatError(lines.path, f"line {at + 1}", found, advice)

    at, coating = lines.kind("Coating", COATING)
    if coating not in READ_COATINGS:
        found = f"a coating of kind {COATING[coating] or coating}"
        raise unsupported(at, found, "Export the scatter as a table without it.")
    at, scatter = lines.kind("Scatter", SCATTER)
    if scatter == ELSEWHERE:
        advice = "It stands in another file: export it as an asymmetric table."
        raise unsupported(at, f"scatter of kind {SCATTER[scatter]}", advice)
    retro = lines.switched_on("Interaction")
    if retro is not None:
        advice = "étendue has no finish that sends light back where it came from: model its prisms or beads as solids."
        raise unsupported(retro, "Interaction 1, a retroreflector", advice)
    several = next((k for k, line in enumerate(lines.lines) if section_of(line) == "SAVE-DATA"), None)
    if several is not None:
        raise unsupported(several, "[SAVE-DATA]: several properties in one file", "Export one at a time.")
    return scatter, coating == TWO_SIDED


def _notes(lines: Lines) -> Iterator[Complaint]:
    """What the head of a file says and étendue does not do."""
    at, coating = lines.kind("Coating", COATING)
    told = {
        at if coating == BARE else None: "no coating: what Fresnel's formulas reflect and transmit is not in the file",
        lines.switched_on("Polarization"): "Polarization 1: light is unpolarised here, with the mean of S and P",
    }
    for line, text in told.items():
        if line is not None:
            yield Complaint("note", f"line {line + 1}", text)
    if coating == TWO_SIDED:
        text = (
            f"no document at hand says which side is which: [{SIDES[0]}] is read as that of light that meets the front"
        )
        yield Complaint("note", f"[{SIDES[0]}]", text, "bsdf-files.md, tracepro")


def _specular(lines: Lines, sides: Sequence[_Side], complaints: list[Complaint]) -> list[Mapping[str, Any]]:
    """Mirrored and straight light by angle and wavelength, unpolarised, the same for both sides."""
    grids = []
    for side in sides:
        keys: dict[str, Any] = {}
        for key, first in (("specular_reflectance", 6), ("specular_transmittance", 8)):
            share = side.rows.values[:, first : first + 2].mean(axis=1)
            bad = (share < 0.0) | (share > 1.0)
            if bad.any():
                raise lines.refuse(int(side.rows.line[bad][0]), f"a {key.replace('_', ' ')} that is no share")
            numbers = Numbers.of(lines, side.rows, share[:, None])
            if numbers.depends_on(2):
                text = f"the {key.replace('_', ' ')} changes with the azimuth of incidence; its mean is taken"
                complaints.append(Complaint("note", "AziAngle", text))
            values = numbers.values[..., 0].mean(axis=2).T
            if values.any():
                keys[key] = _share_table(numbers, values)
        grids.append(keys)
    if any(keys != grids[0] for keys in grids):
        found = "mirrored or straight light that is not the same from both sides"
        advice = f"étendue mirrors alike on both: make Refl and Tran of [{SIDES[0]}] and [{SIDES[1]}] the same."
        raise UnsupportedFormatError(lines.path, f"line {sides[1].rows.line[0] + 1}", found, advice)
    return [{"kind": "mixed", **grids[0]}] if grids[0] else []


def _share_table(numbers: Numbers, values: Array) -> float | dict[str, Any]:
    """Values of shape (angles, wavelengths) as finishes state them."""
    if values.size == 1:
        return float(values[0, 0])
    angle, wavelength = {"angle": numbers.theta.tolist()}, {"wavelength": numbers.wavelength.tolist()}
    if numbers.wavelength.size == 1:
        return {**angle, "values": values[:, 0].tolist()}
    if numbers.theta.size == 1:
        return {**wavelength, "values": values[0].tolist()}
    return {**angle, **wavelength, "values": values.tolist()}


def _by_numbers(
    lines: Lines, sides: Sequence[_Side], scatter: int, complaints: list[Complaint], *, turning: bool
) -> tuple[list[Mapping[str, Any]], list[BsdfSlice]]:
    """Components and slices of the kinds that have numbers in the columns of the rows of shares."""
    lit: list[Lit] = []
    beta = np.zeros(0)
    for side in sides:
        rows, values = side.rows, side.rows.values
        negative = (values[:, 12:] < 0.0).any(axis=1)
        if negative.any():
            raise lines.refuse(int(rows.line[negative][0]), "a number of the BRDF or BTDF below 0")
        numbers, strength = [values[:, 12:17], values[:, 17:22]], [values[:, 12], values[:, 17]]
        if scatter == LISTED:
            blocks = tracepro_tables.blocks_of(lines, rows, side.begin, side.end)
            own, f = tracepro_tables.profiles_of(lines, rows, blocks)
            complaints += below_zero(f)
            if lit and not np.array_equal(own, beta):
                raise lines.refuse(side.begin, "the ScatterBeta of both sides are not the same")
            beta = own
            numbers, strength = [np.hstack(pair) for pair in zip(numbers, f, strict=True)], list(f.max(axis=2))
        ways = [
            Way.of(lines, rows, numbers[way], front=side.front, transmitted=bool(way), strength=strength[way])
            for way in range(2)
        ]
        lit.append(Lit(ways, Numbers.of(lines, rows, rows.left[:, None])))
    pairs = [[side.ways[way] for side in lit] for way in range(2)]
    pairs = [ways for ways in pairs if any(way.strong.any() for way in ways)]
    if not pairs:
        return [], []
    known = readings(scatter, beta)
    if len(known) == 1:
        reading = only(known[0], lit, lines)
        complaints += unbalanced(reading, lit, turning=turning)
    else:
        reading, complaint = chosen(known, lit, lines, turning=turning)
        complaints.append(complaint)
    components, slices, remarks = made(reading, pairs, lines, turning=turning, round_=scatter == ABG)
    complaints += remarks
    if slices and turning and scatter != ABG:
        text = (
            "the file does not say whether the axis is that of the sample; with one azimuth of incidence it is taken to be "
            "at right angles to the plane of incidence. Rows at two azimuths make it that of the sample"
        )
        complaints.append(Complaint("note", "AziAngle", text, "bsdf-files.md, tracepro"))
    return components, slices


def fits(data: BsdfData) -> bool:
    """Whether the slices are one table in direction cosines, the same for all incidences of a side; or there are formulas.

    Formulas are light that is mirrored or goes straight on, which may also stand beside tables, and lobes after ABg.
    """
    if not data.slices:
        return bool(data.components) and plan_of(data) is not None
    first = data.slices[0].grid
    if first is None or regular_of(data.components) is None or first.frame != "cosines":
        return False
    azimuth = first.azimuth + forwards(data.slices[0].phi, turning=data.isotropic)
    return all(_complete([one for one in data.slices if one.front is front]) for front in (True, False)) and all(
        one.grid is not None
        and one.grid.frame == "cosines"
        and (one.front or not data.both_sides)
        and one.wavelength is None
        and np.array_equal(one.grid.radial, first.radial)
        and one.grid.azimuth.size == first.azimuth.size
        and np.allclose(one.grid.azimuth + forwards(one.phi, turning=data.isotropic), azimuth, atol=1e-6)
        and not np.isnan(one.values).any()
        for one in data.slices
    )


def _complete(slices: Sequence[BsdfSlice]) -> bool:
    """Whether there is each angle of incidence at each azimuth."""
    known = {(round(one.phi, 6), round(one.theta, 9)) for one in slices if one.theta >= NORMAL}
    return len(known) == len({phi for phi, _ in known}) * len({theta for _, theta in known})


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light from both sides, or from the front if the back is alike; reflected and transmitted, on the same grid."""
    slices = []
    for front in (True,) if bsdf.both_sides else (True, False):
        for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
            for turn, theta in itertools.product(bsdf.turns if is_there else (), bsdf.incidences):
                if theta < NORMAL and turn:
                    continue  # light along the normal comes from no azimuth
                light = (180.0 + turn) % 360.0
                incident = light_from(theta, light, behind=not front)
                start = forwards(light, turning=bsdf.isotropic)
                grid = PolarGrid("cosines", BETA, np.arange(0.0, 360.0, AZIMUTH_STEP) - start)
                values = values_on(grid, bsdf, incident, transmitted=transmitted)
                slices.append(BsdfSlice(incident, values, transmitted, grid=grid))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, both_sides=bsdf.both_sides, name=bsdf.name)


FORMAT = BsdfFormat(
    "tracepro", "TracePro surface property", (".txt",), recognise, read, fits, tabulate, write, holds_regular=True
)
