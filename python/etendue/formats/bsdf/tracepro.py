"""TracePro surface property text: shares by angle, the ABg model, tables about the specular direction."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.tokens import ADVICE, LARGEST
from etendue.formats.encodings import decoded
from etendue.formats.rays.text_rows import number
from etendue.quantities.bsdf_data import BsdfData, BsdfSlice, PolarGrid, direction
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

START = "TracePro Surface Property Data"

COLUMNS = ("Temperature", "Wavelength", "IncAngle", "AziAngle", "Abso_S", "Abso_P", "Refl_S", "Refl_P", "Tran_S",
           "Tran_P", "PhaseRefl", "PhaseTran", "BRDF_A", "BRDF_B", "BRDF_By", "BRDF_g", "BRDF_gy", "BTDF_A", "BTDF_B",
           "BTDF_By", "BTDF_g", "BTDF_gy")  # fmt: skip
TABLE_COLUMNS = ("Temperature", "Wavelength", "IncAngle", "AziAngle", "ScatterBeta", "ScatterAzimuth", "BRDF", "BTDF")

SCATTER = ("none", "ABg", "elliptical ABg", "elliptical Gaussian", "table", "asymmetric table", "1D ABg", "1D table",
           "BSDF property")  # fmt: skip
"""Kinds of scatter by their number."""

NONE, ABG, TABLE, ASYMMETRIC = 0, 1, 4, 5

COATING = ("none", "table", "stack", "grating", "anisotropic", "DLL", "", "direction-sensitive")
READ_COATINGS = (0, 1, 4)

FLOATING = 90.0
"""Azimuth of the forward direction [°] where the zero is at right angles to the plane of incidence: the floating axis."""

BETA = np.concatenate([[0.0], np.geomspace(0.005, 2.0, 60)])
AZIMUTH_STEP, TURN = 10.0, 45.0
"""Of tables that are made to be written: |β − β₀|, and steps of azimuths [°]."""


def recognise(head: bytes) -> bool:
    """By the first line."""
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(START.encode("ascii"))


class _Lines:
    """The lines of a file, split into fields, each with its number."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise FormatError(path, "length", "more than 256 MiB", "No table of a BSDF is so large.")
        text = decoded(path, data)
        self.lines = text.splitlines()
        if not text.endswith(("\n", "\r")):
            place = f"line {len(self.lines)}"
            raise FormatError(
                path, place, "the last line has no end", "If it is whole, end it; if not, ask for the file again."
            )

    def refuse(self, line: int, found: str, advice: str = ADVICE) -> FormatError:
        return FormatError(self.path, f"line {line + 1}", found, advice)

    def value(self, key: str) -> tuple[int, str]:
        """What stands behind a key, in front of all sections, and its line."""
        for at, line in enumerate(self.lines):
            fields = line.split(None, 1)
            if fields and fields[0].casefold() == key.casefold():
                return at, fields[1].strip() if len(fields) > 1 else ""
            if line.startswith("[") or line.split()[:2] == ["Temperature", "Wavelength"]:
                break
        raise FormatError(self.path, "first lines", f"there is no {key!r}", ADVICE)

    def kind(self, key: str, known: tuple[str, ...]) -> tuple[int, int]:
        """The number behind a key, of a list of kinds."""
        at, text = self.value(key)
        word = text.split()[0] if text else ""
        if not word.isascii() or not word.isdigit() or len(word) > 2 or int(word) >= len(known):
            raise self.refuse(at, f"{key} is {word[:40]!r}, not one of 0 to {len(known) - 1}")
        return at, int(word)

    def rows(self, columns: tuple[str, ...], begin: int = 0) -> tuple[int, Array]:
        """The numbers below a line with the names of columns, to the next line that is empty or begins with a name."""
        for at in range(begin, len(self.lines)):
            names = self.lines[at].split()
            if names[: len(columns)] == list(columns):
                break
        else:
            missing = f"there is no line with {' '.join(columns[:4])} … {columns[-1]}"
            raise FormatError(self.path, f"line {len(self.lines)}", missing, ADVICE)
        rows = []
        for line in range(at + 1, len(self.lines)):
            fields = self.lines[line].split()
            if not fields or fields[0].startswith("["):
                break
            if len(fields) != len(columns):
                raise self.refuse(line, f"{len(fields)} fields; the columns are {len(columns)}")
            try:
                values = [number(field) for field in fields]
            except ValueError:
                raise self.refuse(line, "a field that is no number") from None
            if not np.isfinite(values).all():
                raise self.refuse(line, "a field that is not finite")
            rows.append(values)
        if not rows:
            raise self.refuse(at, "no values follow")
        return at, np.array(rows)


def read(path: Path) -> BsdfData:
    """Read one property: specular shares, and ABg or tabulated scatter; of several temperatures the first.

    Of a table with one azimuth of incidence the zero of scatter azimuths is the floating axis, at right angles to the plane
    of incidence, on the right of the light that goes on; of more azimuths it is the axis of the sample.
    """
    lines = _Lines(path)
    at, coating = lines.kind("Coating", COATING)
    if coating not in READ_COATINGS:
        advice = "Export the scatter as a table without it."
        raise UnsupportedFormatError(path, f"line {at + 1}", f"a coating of kind {COATING[coating] or coating}", advice)
    at, scatter = lines.kind("Scatter", SCATTER)
    if scatter not in (NONE, ABG, TABLE, ASYMMETRIC):
        advice = "Export it as an asymmetric table."
        raise UnsupportedFormatError(path, f"line {at + 1}", f"scatter of kind {SCATTER[scatter]}", advice)
    at, shares = lines.rows(COLUMNS)
    if any(line.startswith("[SAVE-DATA]") for line in lines.lines[at:]):
        raise UnsupportedFormatError(path, "[SAVE-DATA]", "several properties in one file", "Export one at a time.")
    complaints = []
    kept = shares[:, 0] == shares[0, 0]
    if not kept.all():
        text = f"temperatures other than {shares[0, 0]:g} K are left out"
        complaints.append(Complaint("note", "Temperature", text))
    shares = shares[kept]
    if not ((shares[:, 2] >= 0.0) & (shares[:, 2] <= 90.0)).all():
        raise lines.refuse(at, "an angle of incidence is not from 0 to 90°")
    components: list[Mapping[str, Any]] = list(_specular(lines, at, shares))
    slices: tuple[BsdfSlice, ...] = ()
    isotropic = True
    if scatter == ABG:
        components += _abg(path, at, shares)
    elif scatter in (TABLE, ASYMMETRIC):
        slices, isotropic = _tables(lines, shares)
    return BsdfData(
        slices,
        tuple(components),
        isotropic=isotropic,
        mirrored=scatter == TABLE,
        name=lines.value("Name")[1] or path.stem,
        complaints=tuple(complaints),
        facts={"scatter": SCATTER[scatter], "zero of azimuth": "floating axis" if isotropic else "axis of the sample"},
    )


def _specular(lines: _Lines, at: int, rows: Array) -> list[Mapping[str, Any]]:
    """Mirrored and straight light by angle and wavelength, unpolarised."""
    angles, wavelengths = np.unique(rows[:, 2]), np.unique(rows[:, 1])
    grid: dict[str, Any] = {}
    for key, first in (("specular_reflectance", 6), ("specular_transmittance", 8)):
        share = rows[:, first : first + 2].mean(axis=1)
        if share.min() < 0.0 or share.max() > 1.0:
            raise lines.refuse(at, f"a {key.replace('_', ' ')} that is no share")
        values = np.full((angles.size, wavelengths.size), np.nan)
        values[np.searchsorted(angles, rows[:, 2]), np.searchsorted(wavelengths, rows[:, 1])] = share
        if np.isnan(values).any():
            raise lines.refuse(at, "angles of incidence that are not stated for each wavelength")
        if not values.any():
            continue
        if values.size == 1:
            grid[key] = float(values[0, 0])
        elif wavelengths.size == 1:
            grid[key] = {"angle": angles.tolist(), "values": values[:, 0].tolist()}
        elif angles.size == 1:
            grid[key] = {"wavelength": (1e3 * wavelengths).tolist(), "values": values[0].tolist()}
        else:
            grid[key] = {
                "angle": angles.tolist(),
                "wavelength": (1e3 * wavelengths).tolist(),
                "values": values.tolist(),
            }
    return [{"kind": "mixed", **grid}] if grid else []


def _abg(path: Path, at: int, rows: Array) -> list[Mapping[str, Any]]:
    found: list[Mapping[str, Any]] = []
    for way, (a, b, g) in {"reflected": (12, 13, 15), "transmitted": (17, 18, 20)}.items():
        values = rows[:, [a, b, g]]
        if (values != values[0]).any():
            advice = "Export it as an asymmetric table."
            raise UnsupportedFormatError(
                path, f"line {at + 2}", "ABg parameters that change with angle or wavelength", advice
            )
        if values[0, 0] > 0.0:
            found.append({"kind": "abg", "a": values[0, 0], "b": values[0, 1], "g": values[0, 2], "way": way})
    return found


def _tables(lines: _Lines, shares: Array) -> tuple[tuple[BsdfSlice, ...], bool]:
    at, rows = lines.rows(TABLE_COLUMNS)
    rows = rows[rows[:, 0] == shares[0, 0]]
    blocks = {tuple(key): rows[(rows[:, 1:4] == key).all(axis=1)] for key in np.unique(rows[:, 1:4], axis=0)}
    stated = {tuple(key) for key in shares[:, 1:4]}
    for wavelength, theta, phi in sorted(stated - set(blocks)):
        place = f"{theta:g}° of incidence, azimuth {phi:g}°, {wavelength:g} µm"
        raise FormatError(lines.path, f"line {len(lines.lines)}", f"no table for {place}", ADVICE)
    several = len({key[0] for key in blocks}) > 1
    isotropic = len({key[2] for key in blocks}) == 1
    slices = []
    for (wavelength, theta, phi), block in blocks.items():
        beta, azimuth = np.unique(block[:, 4]), np.unique(block[:, 5])
        values = np.full((2, azimuth.size, beta.size), np.nan)
        values[:, np.searchsorted(azimuth, block[:, 5]), np.searchsorted(beta, block[:, 4])] = block[:, 6:].T
        if len(block) != beta.size * azimuth.size or np.isnan(values).any() or beta[0] < 0.0 or not 0.0 <= theta < 90.0:
            raise lines.refuse(at, f"the table at {theta:g}° has no value, or two, for some direction")
        if np.ptp(azimuth) > 360.0:
            raise lines.refuse(at, f"azimuths at {theta:g}° span more than a turn")
        if np.ptp(azimuth) == 360.0:
            azimuth, values = azimuth[:-1], values[:, :-1]
        # Counted from the forward direction.
        grid = PolarGrid("cosines", beta, azimuth - (FLOATING if isotropic else phi))
        incident = direction(theta, (180.0 + phi) % 360.0)
        colour = 1e3 * wavelength if several else None
        for transmitted in (False, True):
            if values[int(transmitted)].any():
                f = np.maximum(values[int(transmitted)], 0.0)
                slices.append(BsdfSlice(incident, f, transmitted, grid=grid, wavelength=colour))
    return tuple(slices), isotropic


def fits(data: BsdfData) -> bool:
    """Whether the slices are one table in direction cosines, from the front, the same for all incidences."""
    first = data.slices[0].grid if data.slices else None
    if first is None or data.components or first.frame != "cosines":
        return False
    start = _start(data.slices[0], data)
    incidences = {(round(one.phi, 6), round(one.theta, 9)) for one in data.slices}
    complete = len(incidences) == len({phi for phi, _ in incidences}) * len({theta for _, theta in incidences})
    return complete and all(
        one.grid is not None
        and one.grid.frame == "cosines"
        and one.front
        and one.wavelength is None
        and np.array_equal(one.grid.radial, first.radial)
        and one.grid.azimuth.size == first.azimuth.size
        and np.allclose(one.grid.azimuth + _start(one, data), first.azimuth + start, atol=1e-6)
        and not np.isnan(one.values).any()
        for one in data.slices
    )


def _start(one: BsdfSlice, data: BsdfData) -> float:
    """Azimuth of the forward direction as the file counts it."""
    return FLOATING if data.isotropic else (one.phi - 180.0) % 360.0


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light that meets the front, reflected and transmitted, on the same grid at all incidences."""
    turns = (0.0,) if bsdf.isotropic else tuple(np.arange(0.0, 360.0, TURN))
    slices = []
    for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
        for turn, theta in itertools.product(turns if is_there else (), bsdf.incidences):
            incident = direction(theta, (180.0 + turn) % 360.0)
            start = FLOATING if bsdf.isotropic else turn
            grid = PolarGrid("cosines", BETA, np.arange(0.0, 360.0, AZIMUTH_STEP) - start)
            scattered = grid.directions(incident, transmitted=transmitted)
            beyond = np.isnan(scattered[..., 0])
            scattered[beyond] = [0.0, 0.0, -1.0 if transmitted else 1.0]
            values = np.where(beyond, 0.0, bsdf.evaluate(incident, scattered))
            slices.append(BsdfSlice(incident, values, transmitted, grid=grid))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write an asymmetric table at 300 K and 0.55 µm; what is not scattered counts as absorbed."""
    name = " ".join(data.name.encode("ascii", "replace").decode("ascii").split())
    lines = [START, "TracePro Release: 19 6 0", "Database Version: 4 1 0", "Data generated by etendue", ""]
    lines += [
        f"Name\t{name}",
        "Catalog\tetendue",
        "Description\t",
        "Coating\t1",
        f"Scatter\t{ASYMMETRIC}",
        "Interaction\t0",
    ]
    lines += ["Polarization\t0", "User_Data\t0", "Solve\t<None>", "", "\t".join(COLUMNS)]
    by_incidence: dict[tuple[float, float], dict[bool, BsdfSlice]] = {}
    for one in data.slices:
        turn = round((one.phi - 180.0) % 360.0, 6) % 360.0
        by_incidence.setdefault((0.0 if data.isotropic else turn, one.theta), {})[one.transmitted] = one
    for (turn, theta), ways in sorted(by_incidence.items()):
        left = 1.0 - sum(one.integral() for one in ways.values())
        lines.append("\t".join(["300", "0.55", f"{theta:.12g}", f"{turn:.9g}", *(2 * [f"{left:.9g}"]), *(16 * ["0"])]))
    lines += ["", "[Table_BSDF_Data]", "\t".join(TABLE_COLUMNS)]
    for (turn, theta), ways in sorted(by_incidence.items()):
        any_way = next(iter(ways.values()))
        grid = any_way.grid
        assert grid is not None  # noqa: S101 - `fits` says so
        azimuth = np.round(grid.azimuth + _start(any_way, data), 9)
        nothing = np.zeros(grid.shape)
        f = [ways[transmitted].values if transmitted in ways else nothing for transmitted in (False, True)]
        for (k, a), (i, r) in itertools.product(enumerate(azimuth), enumerate(grid.radial)):
            place = f"300\t0.55\t{theta:.12g}\t{turn:.9g}\t{r:.12g}\t{a:.9g}"
            lines.append(f"{place}\t{f[0][k, i]:.9g}\t{f[1][k, i]:.9g}")
    stream.write(("\n".join(lines) + "\n").encode("ascii"))
    lost = []
    if any(one.standard_error is not None for one in data.slices):
        lost.append("the format has no standard errors")
    if not data.both_sides:
        lost.append("only light that meets the front is written")
    return tuple(lost)


FORMAT = BsdfFormat("tracepro", "TracePro surface property", (".txt",), recognise, read, fits, tabulate, write)
