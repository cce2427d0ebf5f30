"""Zemax OpticStudio ``.bsdf``, the interchange format of Radiant Imaging: values about the specular direction."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.functions import values_on
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.shares import disagreements
from etendue.formats.bsdf.tokens import Tokens
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

SYMMETRIES = ("PlaneSymmetrical", "Asymmetrical", "ASymmetrical4D")
CHANNELS = ("TristimulusX", "TristimulusY", "TristimulusZ")

RADIAL = np.concatenate([np.arange(0, 2, 0.25), np.arange(2, 40, 1), np.arange(40, 91, 2.5), [100, 120, 150, 180]])
"""Angles from the specular direction [°] of tables that are made to be written."""

AZIMUTH_STEP = 10.0


def recognise(head: bytes) -> bool:
    """Whether the text names the angles of incidence and of scatter as this format does."""
    text = re.sub(rb"#[^\r\n]*", b"", head).lower()
    return b"symmetry" in text and b"scattertype" in text and b"samplerotation" in text


def read(path: Path) -> BsdfData:
    """Read a table; of three tristimulus values Y is taken.

    Azimuth 0 points from the specular direction towards the normal, and azimuths run counter-clockwise against the
    direction of the light. Values are absolute [1/sr]; the TIS of each block is kept beside its integral.
    """
    tokens = Tokens(path)
    facts = {}
    tokens.expect("Source")
    facts["source"] = tokens.word("Source")
    tokens.expect("Symmetry")
    symmetry = tokens.choice("Symmetry", SYMMETRIES)
    tokens.expect("SpectralContent")
    spectral = tokens.choice("SpectralContent", ("Monochrome", "XYZ"))
    tokens.expect("ScatterType")
    transmitted = tokens.choice("ScatterType", ("BRDF", "BTDF")) == "BTDF"
    tokens.expect("SampleRotation")
    rotations = tokens.numbers("sample rotations", tokens.count("number of sample rotations"))
    tokens.expect("AngleOfIncidence")
    incidences = tokens.rising("angles of incidence")
    if not ((incidences >= 0.0) & (incidences < 90.0)).all():
        tokens.refuse("an angle of incidence is not from 0 to 90°")
    tokens.expect("ScatterAzimuth")
    azimuths = tokens.rising("azimuths")
    tokens.expect("ScatterRadial")
    radial = tokens.rising("radial angles")
    if azimuths[-1] - azimuths[0] > 360.0 or radial[0] < 0.0 or radial[-1] > 180.0:
        tokens.refuse("azimuths span more than 360°, or radial angles are not from 0 to 180°")
    mirrored = symmetry == "PlaneSymmetrical"
    grid, order = _grid(tokens, azimuths, radial, mirrored=mirrored)
    slices: list[BsdfSlice] = []
    read_values: list[Array] = []
    for channel in CHANNELS if spectral == "XYZ" else ("Monochrome",):
        tokens.expect(channel)
        tokens.expect("DataBegin")
        taken = channel in ("Monochrome", "TristimulusY")
        for rotation in rotations:
            for theta in incidences:
                tokens.expect("TIS")
                stated = tokens.number("TIS")
                values = tokens.numbers("values", azimuths.size * radial.size).reshape(azimuths.size, radial.size)
                if not taken:
                    continue
                read_values.append(values)
                slices.append(
                    BsdfSlice(
                        # A sample turned counter-clockwise sees the light come from where it is turned away from.
                        light_from(theta, (180.0 - rotation) % 360.0),
                        values[order],
                        transmitted,
                        grid=grid,
                        stated=stated,
                    )
                )
        tokens.expect("DataEnd")
    complaints = [*below_zero(np.array(read_values)), *disagreements(slices)]
    return BsdfData(
        tuple(slices),
        isotropic=rotations.size == 1,
        mirrored=mirrored,
        name=path.stem,
        complaints=tuple(complaints),
        facts=facts,
    )


def _grid(tokens: Tokens, azimuths: Array, radial: Array, *, mirrored: bool) -> tuple[PolarGrid, npt.NDArray[np.intp]]:
    """The grid all around, and which row of the file each azimuth takes."""
    rows = np.arange(azimuths.size)
    if not mirrored:
        return PolarGrid("specular", radial, azimuths), rows
    if azimuths[0] < 0.0 or azimuths[-1] > 180.0:
        tokens.refuse("a plane-symmetrical table has azimuths from 0 to 180°")
    inner = (azimuths > 0.0) & (azimuths < 180.0)
    other = 360.0 - azimuths[inner][::-1]
    return PolarGrid("specular", radial, np.concatenate([azimuths, other])), np.concatenate([rows, rows[inner][::-1]])


def fits(data: BsdfData) -> bool:
    """Whether the slices are one table about the specular direction, of one way, in all azimuths."""
    grids = [one.grid for one in data.slices]
    first = grids[0] if grids else None
    if first is None or data.components or first.frame != "specular" or np.ptp(first.azimuth) >= 360.0:
        return False
    same = all(
        grid is not None
        and grid.frame == "specular"
        and np.array_equal(grid.radial, first.radial)
        and np.array_equal(grid.azimuth, first.azimuth)
        for grid in grids
    )
    ways = {(one.transmitted, one.front, one.wavelength) for one in data.slices}
    incidences = {(round(one.phi, 6), round(one.theta, 9)) for one in data.slices}
    phis, thetas = {phi for phi, _ in incidences}, {theta for _, theta in incidences}
    complete = len(incidences) == len(data.slices) == len(phis) * len(thetas)
    return same and len(ways) == 1 and complete and not any(np.isnan(one.values).any() for one in data.slices)


def tabulate(bsdf: Tabulated) -> BsdfData:
    """One way of light that meets the front: the reflected one, if there is any."""
    transmitted = not bsdf.reflects
    grid = PolarGrid("specular", RADIAL, np.arange(0.0, 360.0, AZIMUTH_STEP))
    phis = (180.0,) if bsdf.isotropic else tuple(np.arange(0.0, 360.0, 45.0))
    slices = []
    for phi in phis:
        for theta in bsdf.incidences:
            incident = light_from(theta, phi)
            values = values_on(grid, bsdf, incident, transmitted=transmitted)
            one = BsdfSlice(incident, values, transmitted, grid=grid)
            slices.append(BsdfSlice(incident, values, transmitted, grid=grid, stated=one.integral()))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write a table of this layout; nine digits each."""
    first = data.slices[0]
    grid = first.grid
    assert grid is not None  # noqa: S101 - `fits` says so
    thetas = sorted({round(one.theta, 9) for one in data.slices})
    phis = sorted({round(one.phi, 6) for one in data.slices}, key=lambda phi: (180.0 - phi) % 360.0)
    lists = {
        "SampleRotation": [(180.0 - phi) % 360.0 for phi in phis],
        "AngleOfIncidence": thetas,
        "ScatterAzimuth": grid.azimuth.tolist(),
        "ScatterRadial": grid.radial.tolist(),
    }
    lines = ["Source  Measured", "Symmetry  Asymmetrical" if data.isotropic else "Symmetry  ASymmetrical4D"]
    lines += ["SpectralContent  Monochrome", f"ScatterType  {'BTDF' if first.transmitted else 'BRDF'}"]
    for key, values in lists.items():
        lines += [f"{key} {len(values)}", " ".join(f"{value:.9g}" for value in values)]
    lines += ["", "Monochrome", "DataBegin"]
    by_place = {(round(one.phi, 6), round(one.theta, 9)): one for one in data.slices}
    for phi in phis:
        for theta in thetas:
            one = by_place[phi, theta]
            lines.append(f"TIS {one.stated if one.stated is not None else one.integral():.9g}")
            lines += [" ".join(f"{value:.9g}" for value in row) for row in one.values]
    stream.write(("\n".join([*lines, "DataEnd"]) + "\n").encode("ascii"))
    lost = []
    if first.wavelength is not None:
        lost.append(f"no wavelength is in the file: its values are those at {first.wavelength:g} nm")
    if not first.front:
        lost.append("the format does not tell front from back")
    return tuple(lost)


FORMAT = BsdfFormat("zemax", "Zemax BSDF", (".bsdf",), recognise, read, fits, tabulate, write)
