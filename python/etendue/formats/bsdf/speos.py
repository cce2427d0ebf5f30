"""Ansys Speos ``.anisotropicbsdf`` as text: values about the normal, in proportion to the BSDF or to the intensity."""

from __future__ import annotations

import dataclasses
from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.shares import scaled
from etendue.formats.bsdf.tokens import ADVICE, Tokens
from etendue.formats.encodings import decoded
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import photopic_efficiency

Array = npt.NDArray[np.float64]

START = "OPTIS - Anisotropic BSDF surface file"

THETA = np.concatenate([np.arange(0.0, 80.0, 2.0), np.arange(80.0, 90.5, 1.0)])
"""Angles from the normal [°] of tables that are made to be written."""

PHI_STEP = 5.0
"""Steps of the azimuth of scattered light and of the anisotropy angle [°]."""

WAYS = ("reflection", "transmission")

SAME = 1e-6
"""Angles of incidence [°] that differ by less are one: they went through a direction and back."""


def recognise(head: bytes) -> bool:
    """By the first line, of text or binary files."""
    return head.removeprefix(BOM_UTF8).startswith(START.encode("ascii"))


def read(path: Path) -> BsdfData:
    """Read the shape, and scale it so that the reference incidence reflects or transmits what the file's spectrum says.

    The spectrum is weighted with V(λ), under light of equal energy. Azimuths turn counter-clockwise seen from the front; the
    mirrored and the straight direction have azimuth 0. The anisotropy angle turns the plane of incidence from the
    anisotropy vector, the x axis here.
    """
    with path.open("rb") as file:
        head = file.read(256)
    mode = head.partition(b"\n")[2].lstrip(b"\r\n \t")[:1]
    if mode == b"1":
        raise UnsupportedFormatError(
            path, "line 2", "this Speos file is binary", "Save it as text in the surface editor, mode 0."
        )
    tokens = Tokens(path)
    text = decoded(path, path.read_bytes()).splitlines()
    past_header(tokens, text)
    tokens.numbers("anisotropy vector", 3)
    there = [flag(tokens, way) for way in WAYS]
    if not any(there):
        tokens.refuse("neither reflection nor transmission is there", "Ask for a file with data.")
    proportional = tokens.number("type")
    if proportional not in (0.0, 1.0):
        tokens.refuse(f"the type of values is {proportional:g}", "It is 0 (intensity) or 1 (BSDF).")
    angles = [_angles(tokens) if one else {} for one in there]
    spectra = [_spectrum(tokens, way) if one else None for one, way in zip(there, WAYS, strict=True)]
    slices: list[BsdfSlice] = []
    complaints: list[Complaint] = []
    for transmitted, (incidences, spectrum) in enumerate(zip(angles, spectra, strict=True)):
        if spectrum is None:
            continue
        own = [
            slice_of(tokens, theta, turn, bool(transmitted), intensity=proportional == 0.0)
            for turn, thetas in incidences.items()
            for theta in thetas
        ]
        complaints += below_zero(np.concatenate([one.values.ravel() for one in own]), WAYS[transmitted])
        slices += _scaled(tokens, own, spectrum, complaints)
    if " ".join(tokens.words[tokens.at : tokens.at + 3]).casefold() != "end of file":
        tokens.refuse("the data do not end with 'End of file'")
    return BsdfData(
        tuple(slices),
        isotropic=all(len(one) <= 1 for one in angles),
        mirrored=False,
        both_sides=True,
        name=path.stem,
        complaints=tuple(complaints),
    )


def past_header(tokens: Tokens, text: list[str]) -> None:
    """Past the header, the comment, and a description of so many characters that may run over lines."""
    try:
        left = int(text[3])
    except (IndexError, ValueError):
        raise FormatError(tokens.path, "line 4", "no length of the description", ADVICE) from None
    line = 4
    while left > 0 and line < len(text):
        left -= len(text[line]) + 1
        line += 1
    # An empty description has its line too.
    line = max(line, 5)
    tokens.at = int(np.searchsorted(tokens.lines, line, side="right"))


def flag(tokens: Tokens, way: str) -> bool:
    """0 or 1: whether a way of light is there."""
    value = tokens.number(f"flag of {way}")
    if value not in (0.0, 1.0):
        tokens.refuse(f"the flag of {way} is {value:g}, not 0 or 1")
    return value == 1.0


def _angles(tokens: Tokens) -> dict[float, Array]:
    """Angles of incidence by anisotropy angle."""
    turns = tokens.rising("anisotropy angles")
    found = {}
    for turn in turns.tolist():
        thetas = tokens.rising("angles of incidence")
        if thetas[0] < 0.0 or thetas[-1] >= 90.0:
            tokens.refuse("an angle of incidence is not from 0 to 90°")
        found[turn] = thetas
    return found


def _spectrum(tokens: Tokens, way: str) -> tuple[float, float, Array, Array]:
    """Reference incidence and azimuth [°]; wavelengths [nm] and shares."""
    theta, phi = tokens.number(f"reference incidence of {way}"), tokens.number("reference azimuth")
    line = tokens.lines[tokens.at - 1]
    # A line of description follows, which may be empty.
    tokens.at = int(np.searchsorted(tokens.lines, line + 1, side="right"))
    rows = tokens.numbers("spectrum", 2 * tokens.count("number of wavelengths")).reshape(-1, 2)
    if (np.diff(rows[:, 0]) <= 0.0).any() or (rows[:, 1] < 0.0).any():
        tokens.refuse(f"the spectrum of {way} falls back in wavelength, or below 0")
    return theta, phi, rows[:, 0], rows[:, 1] / 100.0


def slice_of(tokens: Tokens, theta: float, turn: float, transmitted: bool, *, intensity: bool) -> BsdfSlice:
    """One table: sizes, azimuths, then θ and values row by row."""
    thetas, phis = tokens.count("number of polar angles"), tokens.count("number of azimuths")
    phi = tokens.numbers("azimuths", phis)
    rows = tokens.numbers("values", thetas * (phis + 1)).reshape(thetas, phis + 1)
    polar, values = rows[:, 0], rows[:, 1:]
    if transmitted:
        polar, values = 180.0 - polar[::-1], values[::-1]
    falls = (np.diff(phi) <= 0.0).any() or (np.diff(polar) <= 0.0).any()
    if falls or np.ptp(phi) > 360.0 or polar[0] < 0.0 or polar[-1] > 90.0:
        tokens.refuse(f"angles of the data at {theta:g}° do not rise within 0 to 90° and 0 to 360°")
    if np.ptp(phi) == 360.0:
        phi, values = phi[:-1], values[:, :-1]
    if intensity:
        cosine = np.cos(np.radians(polar))[:, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            values = np.where(cosine > 1e-6, values / cosine, np.nan)
    grid = PolarGrid("normal", polar, phi + turn)
    return BsdfSlice(light_from(theta, (180.0 + turn) % 360.0), values.T, transmitted, grid=grid)


def _scaled(
    tokens: Tokens, slices: list[BsdfSlice], spectrum: tuple[float, float, Array, Array], complaints: list[Complaint]
) -> list[BsdfSlice]:
    """All by the factor that gives the reference incidence the share of the spectrum, which is stated there."""
    theta, phi, wavelengths, shares = spectrum
    turns = np.array([(one.phi - 180.0) % 360.0 for one in slices])
    apart = np.abs((turns - phi + 180.0) % 360.0 - 180.0)
    near = [one for one, off in zip(slices, apart, strict=True) if off <= apart.min() + 1e-9]
    known = float(np.interp(theta, [one.theta for one in near], [one.integral() for one in near]))
    if len(shares) == 1:
        wanted = float(shares[0])
    else:
        weights = photopic_efficiency(wavelengths) * np.gradient(wavelengths)
        even = np.ptp(shares) < 1e-9
        wanted = float(
            shares[0] if even else shares @ weights / weights.sum() if weights.sum() > 0.0 else shares.mean()
        )
        if not even:
            text = f"the spectrum from {shares.min():.3g} to {shares.max():.3g} is weighted with V(λ)"
            complaints.append(Complaint("note", f"{theta:g}° of incidence", text))
    if not known > 0.0:
        if wanted > 0.0:
            tokens.refuse("values at the reference incidence add up to no light, though its spectrum says so")
        known = 1.0
    else:
        way = WAYS[near[0].transmitted]
        complaints += scaled([(f"{theta:g}° of incidence, {way}", wanted, known)])
    factor = wanted / known
    reference = [one for one in near if abs(one.theta - theta) < SAME]
    return [
        dataclasses.replace(one, values=one.values * factor, stated=wanted if one in reference else None)
        for one in slices
    ]


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables about the normal from the front, with azimuths that begin where the light goes."""
    if not data.slices or data.components:
        return False
    for one in data.slices:
        grid = one.grid
        if grid is None or grid.frame != "normal" or not one.front or one.wavelength is not None:
            return False
        first = (grid.azimuth[0] - one.phi - 180.0) % 360.0
        if min(first, 360.0 - first) > 1e-6 or np.isnan(one.values).any() or grid.radial[-1] > 90.0:
            return False
    return True


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light that meets the front, reflected and transmitted."""
    slices = []
    for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
        for turn in bsdf.turns if is_there else ():
            for theta in bsdf.incidences:
                incident = light_from(theta, 180.0 + turn)
                grid = PolarGrid("normal", THETA, np.arange(0.0, 360.0, PHI_STEP) + turn)
                # Along the surface, where a BSDF may have no value: just above it.
                scattered = direction(
                    np.minimum(THETA, 90.0 - 1e-7)[None, :], grid.azimuth[:, None], behind=transmitted
                )
                slices.append(BsdfSlice(incident, bsdf.evaluate(incident, scattered), transmitted, grid=grid))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write text of version 8.0 with values in proportion to the BSDF, scaled at the first incidence."""
    ways = [transmitted for transmitted in (False, True) if any(one.transmitted == transmitted for one in data.slices)]
    name = data.name.encode("ascii", "replace").decode("ascii").replace("\n", " ")
    lines = [f"{START} v8.0", "0", "written by etendue", str(len(name)), name, "1\t0\t0"]
    lines += ["\t".join(str(int(transmitted in ways)) for transmitted in (False, True)), "1"]
    ordered = {}
    for transmitted in ways:
        by_turn: dict[float, list[BsdfSlice]] = {}
        for one in data.slices:
            if one.transmitted == transmitted:
                by_turn.setdefault(round((one.phi - 180.0) % 360.0, 6) % 360.0, []).append(one)
        ordered[transmitted] = {turn: sorted(by_turn[turn], key=lambda one: one.theta) for turn in sorted(by_turn)}
        lines += [str(len(by_turn)), "\t".join(f"{turn:.9g}" for turn in ordered[transmitted])]
        for own in ordered[transmitted].values():
            lines += [str(len(own)), "\t".join(f"{one.theta:.12g}" for one in own)]
    for transmitted in ways:
        turn, own = next(iter(ordered[transmitted].items()))
        lines += [f"{own[0].theta:.12g}\t{turn:.9g}", "", "2"]
        lines += [f"{wavelength}\t{100.0 * max(own[0].integral(), 0.0):.12g}" for wavelength in (350, 850)]
    for transmitted in ways:
        for one in (one for own in ordered[transmitted].values() for one in own):
            lines += table_rows(one)
    stream.write(("\n".join([*lines, "End of file"]) + "\n").encode("ascii"))
    return () if data.both_sides else ("only light that meets the front is written",)


def table_rows(one: BsdfSlice) -> list[str]:
    """Lines of one table about the normal: sizes, azimuths, then a line for each θ."""
    grid = one.grid
    assert grid is not None  # noqa: S101 - `fits` says so
    azimuth, values = grid.azimuth - grid.azimuth[0], one.values
    if np.ptp(azimuth) < 360.0:
        azimuth, values = np.append(azimuth, 360.0), np.vstack([values, values[:1]])
    lines = [f"{grid.radial.size} {azimuth.size}", "\t" + "\t".join(f"{a:.9g}" for a in azimuth)]
    columns = range(grid.radial.size)
    for k in reversed(columns) if one.transmitted else columns:
        theta = 180.0 - grid.radial[k] if one.transmitted else grid.radial[k]
        lines.append("\t".join([f"{theta:.9g}", *(f"{value:.9g}" for value in values[:, k])]))
    return lines


FORMAT = BsdfFormat("speos", "Speos anisotropic BSDF", (".anisotropicbsdf",), recognise, read, fits, tabulate, write)
