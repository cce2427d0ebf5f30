"""LightTools ``.bsdf``: values about the normal, a block for each incidence, side, way and colour."""

from __future__ import annotations

import dataclasses
import itertools
import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.shares import disagreements
from etendue.formats.bsdf.tokens import Tokens
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

INCIDENT = 90.0
"""Azimuth [°] of the light at POI 0."""

RIGHT_ANGLE = 90.0

THETA = np.concatenate([np.arange(0.0, 80.0, 2.0), np.arange(80.0, 90.5, 1.0)])
PHI_STEP = 5.0
"""Directions of tables that are made to be written [°]."""

SYMMETRIES = ("PlaneSymmetrical", "Asymmetric", "Asymmetrical")
CHANNELS = ("TrisX", "TrisY", "TrisZ")


def recognise(head: bytes) -> bool:
    """By its keywords, without those that Zemax has besides."""
    text = re.sub(rb"#[^\r\n]*", b"", head).lower()
    return b"symmetry" in text and b"scatterradial" in text and b"samplerotation" not in text


def read(path: Path) -> BsdfData:
    """Read all blocks; of three tristimulus values the second.

    Light comes from azimuth 90° + POI, scattered directions are counted from the normal of the side where they leave.
    """
    tokens = Tokens(path)
    header = _header(tokens)
    radial, azimuth = header["ScatterRadial"], header["ScatterAzimuth"]
    grid, order = _grid(tokens, radial, azimuth, header.get("Symmetry", ""))
    slices: list[BsdfSlice] = []
    complaints: list[Complaint] = []
    read_values: list[Array] = []
    block: dict[str, Any] = {}
    while True:
        key = tokens.choice(
            "keyword",
            ("AOI", "POI", "Side", "Wavelength", "ScatterType", "TristimulusValue", "TIS", "DataEnd"),
        )
        if key == "DataEnd":
            break
        if key in ("AOI", "POI", "Wavelength"):
            block[key] = tokens.number(key)
        elif key == "Side":
            block[key] = tokens.choice(key, ("Front", "Back"))
        elif key == "ScatterType":
            block[key] = tokens.choice(key, ("BRDF", "BTDF"))
        elif key == "TristimulusValue":
            block[key] = tokens.choice(key, CHANNELS)
        else:
            stated = tokens.number("TIS")
            values = tokens.numbers("values", azimuth.size * radial.size).reshape(azimuth.size, radial.size)
            if block.get("TristimulusValue", "TrisY") == "TrisY":
                slices.append(_slice(tokens, block, values[order], grid, stated, complaints))
                read_values.append(values)
            block = {}
    if not slices:
        tokens.refuse("no block of data")
    waves = {one.wavelength for one in slices}
    if len(waves) == 1:
        slices = [_plain(one) for one in slices]
    both = {one.front for one in slices} == {True, False}
    turns = {round(one.phi, 4) for one in slices if one.theta > 1e-3}
    return BsdfData(
        tuple(slices),
        isotropic=len(turns) <= 1,
        mirrored=False,
        both_sides=not both,
        name=path.stem,
        complaints=(*complaints, *below_zero(np.array(read_values)), *disagreements(slices)),
    )


def _plain(one: BsdfSlice) -> BsdfSlice:
    """Without its wavelength, where there is but one."""
    return dataclasses.replace(one, wavelength=None)


def _header(tokens: Tokens) -> dict[str, Any]:
    found: dict[str, Any] = {}
    while tokens.peek().casefold() != "databegin":
        key = tokens.word("keyword of the header")
        meant = {name.casefold(): name for name in ("Symmetry", "SpectralContent", "ScatterAzimuth", "ScatterRadial")}
        name = meant.get(key.casefold())
        if name == "Symmetry":
            found[name] = tokens.choice(name, SYMMETRIES)
        elif name == "SpectralContent":
            found[name] = tokens.choice(name, ("Monochrome", "XYZ"))
        elif name is not None:
            found[name] = tokens.rising(name)
        elif not tokens.left:
            break
    tokens.expect("DataBegin")
    for name in ("ScatterAzimuth", "ScatterRadial"):
        if name not in found:
            tokens.refuse(f"there is no {name}")
    radial = found["ScatterRadial"]
    if radial[0] < 0.0 or radial[-1] > RIGHT_ANGLE:
        tokens.refuse("radial angles are not from 0 to 90°")
    return found


def _grid(tokens: Tokens, radial: Array, azimuth: Array, symmetry: str) -> tuple[PolarGrid, npt.NDArray[np.intp]]:
    """The grid all around, and which row of the file each azimuth takes."""
    rows = np.arange(azimuth.size)
    span = float(np.ptp(azimuth))
    if span > 2.0 * 180.0:
        tokens.refuse("azimuths span more than 360°")
    if symmetry == "PlaneSymmetrical" and span <= 180.0 and azimuth.size > 1:
        # The plane of incidence is that of azimuths 90° and −90°.
        if not (azimuth[0] >= -RIGHT_ANGLE and azimuth[-1] <= RIGHT_ANGLE) and not (
            azimuth[0] >= RIGHT_ANGLE and azimuth[-1] <= 3 * RIGHT_ANGLE
        ):
            advice = "Export the table with azimuths all around."
            tokens.refuse("azimuths of a plane-symmetrical table that lie on both sides of 90°", advice)
        other = (180.0 - azimuth) % 360.0
        both = np.concatenate([azimuth % 360.0, other])
        around, first = np.unique(np.round(both, 9), return_index=True)
        return PolarGrid("normal", radial, around), np.concatenate([rows, rows])[first]
    if span == 2.0 * 180.0:
        azimuth, rows = azimuth[:-1], rows[:-1]
    return PolarGrid("normal", radial, azimuth), rows


def _slice(
    tokens: Tokens, block: dict[str, Any], values: Array, grid: PolarGrid, stated: float, complaints: list[Complaint]
) -> BsdfSlice:
    theta = block.get("AOI", 0.0)
    if theta >= RIGHT_ANGLE:
        complaints.append(Complaint("warning", f"AOI {theta:g}", "an angle of incidence from 90° on was taken as 0°"))
        theta = 0.0
    if theta < 0.0:
        tokens.refuse(f"the angle of incidence is {theta:g}°")
    return BsdfSlice(
        light_from(theta, (INCIDENT + block.get("POI", 0.0)) % 360.0, behind=block.get("Side", "Front") == "Back"),
        values,
        block.get("ScatterType", "BRDF") == "BTDF",
        grid=grid,
        wavelength=block.get("Wavelength"),
        stated=stated,
    )


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables about the normal on one grid, of both sides unless these are alike."""
    first = data.slices[0].grid if data.slices else None
    if not data.both_sides and len({one.front for one in data.slices}) == 1:
        return False
    if first is None or data.components or first.frame != "normal" or first.radial[-1] > RIGHT_ANGLE:
        return False
    return all(
        one.grid is not None
        and one.grid.frame == "normal"
        and np.array_equal(one.grid.radial, first.radial)
        and np.array_equal(one.grid.azimuth, first.azimuth)
        and not np.isnan(one.values).any()
        for one in data.slices
    )


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light from both sides, or from the front if the back is alike; reflected and transmitted, at each known wavelength."""
    grid = PolarGrid("normal", THETA, np.arange(0.0, 360.0, PHI_STEP))
    slices = []
    for front in (True,) if bsdf.both_sides else (True, False):
        for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
            for turn in bsdf.turns if is_there else ():
                for theta, wave in itertools.product(bsdf.incidences, bsdf.wavelengths or (None,)):
                    incident = light_from(theta, (INCIDENT + turn) % 360.0, behind=not front)
                    # Along the surface, where a BSDF may have no value: just above it.
                    behind = front == transmitted
                    polar = np.minimum(THETA, RIGHT_ANGLE - 1e-7)
                    scattered = direction(polar[None, :], grid.azimuth[:, None], behind=behind)
                    values = bsdf.evaluate(incident, scattered, wavelength=wave)
                    one = BsdfSlice(incident, values, transmitted, grid=grid, wavelength=wave)
                    slices.append(dataclasses.replace(one, stated=one.integral()))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, both_sides=bsdf.both_sides, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write a table all around; nine digits each."""
    grid = data.slices[0].grid
    assert grid is not None  # noqa: S101 - `fits` says so
    lines = ["Symmetry Asymmetric", "SpectralContent Monochrome"]
    for key, listed in (("ScatterAzimuth", grid.azimuth), ("ScatterRadial", grid.radial)):
        lines += [f"{key} {listed.size}", " ".join(f"{value:.9g}" for value in listed)]
    lines.append("DataBegin")
    for one in data.slices:
        lines += [f"AOI {one.theta:.12g}", f"POI {(one.phi - INCIDENT) % 360.0:.9g}"]
        lines.append(f"Side {'Front' if one.front else 'Back'}")
        if one.wavelength is not None:
            lines.append(f"Wavelength {one.wavelength:.9g}")
        lines.append(f"ScatterType {'BTDF' if one.transmitted else 'BRDF'}")
        lines.append(f"TIS {one.stated if one.stated is not None else one.integral():.9g}")
        lines += [" ".join(f"{value:.9g}" for value in row) for row in one.values]
    stream.write(("\n".join([*lines, "DataEnd"]) + "\n").encode("ascii"))
    return ()


FORMAT = BsdfFormat("lighttools", "LightTools BSDF", (".lt.bsdf",), recognise, read, fits, tabulate, write)
