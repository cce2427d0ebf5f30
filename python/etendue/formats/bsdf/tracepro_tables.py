"""Tables of TracePro's scatter, about the specular direction in direction cosines, or along one axis."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.shares import CLOSE
from etendue.formats.bsdf.tokens import ADVICE
from etendue.formats.bsdf.tracepro_lines import TABLE_COLUMNS, Lines, Rows, once_at_the_normal
from etendue.formats.bsdf.tracepro_models import forwards
from etendue.quantities.bsdf_directions import NORMAL, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

Key = tuple[float, float, float]
"""Wavelength [µm], angle and azimuth of incidence [°]."""


def blocks_of(lines: Lines, shares: Rows, begin: int, end: int) -> dict[Key, Rows]:
    """The rows of the table of each wavelength, angle and azimuth of incidence, at the temperature of the shares.

    Raises
    ------
    FormatError
        If there is no table, or none for a row of shares.
    """
    rows = lines.rows(TABLE_COLUMNS, begin, end)
    rows = once_at_the_normal(rows.where(rows.values[:, 0] == shares.values[0, 0]))
    keys, which = np.unique(rows.values[:, 1:4], axis=0, return_inverse=True)
    # The places of the rows of each, in their order: a look at all rows for each would take the square of the time.
    places = np.split(np.argsort(which.ravel(), kind="stable"), np.cumsum(np.bincount(which.ravel()))[:-1])
    places = places[: len(keys)]  # of nothing the split is one empty part
    blocks = {_key(key): rows.where(own) for key, own in zip(keys, places, strict=True)}
    for wavelength, theta, phi in sorted({_key(key) for key in shares.values[:, 1:4]} - set(blocks)):
        place = f"{theta:g}° of incidence, azimuth {phi:g}°, {wavelength:g} µm"
        raise FormatError(lines.path, f"line {end}", f"no table for {place}", ADVICE)
    return blocks


def _key(values: Array) -> Key:
    wavelength, theta, phi = map(float, values)
    return wavelength, theta, phi


@dataclasses.dataclass(frozen=True)
class Tables:
    """Slices of one side, and what is to be told of them."""

    slices: list[BsdfSlice]
    complaints: list[Complaint]


def slices_of(lines: Lines, shares: Rows, blocks: dict[Key, Rows], *, front: bool, turning: bool) -> Tables:
    """The slices of tables over |β − β₀| and azimuth; of light that is scattered at no incidence there are none.

    What a row of shares leaves for scatter is the stated share, of both ways together: where one scatters alone, of it.

    Raises
    ------
    FormatError
        If a table is not complete.
    """
    several = len({key[0] for key in blocks}) > 1
    slices = []
    complaints = below_zero(np.concatenate([block.values[:, 6:].ravel() for block in blocks.values()]))
    left = {_key(key): max(float(value), 0.0) for key, value in zip(shares.values[:, 1:4], shares.left, strict=True)}
    largest = max(blocks.values(), key=lambda block: len(block.line)).values
    lists = np.unique(largest[:, 4]), np.unique(largest[:, 5])
    for (wavelength, theta, phi), block in blocks.items():
        at = int(block.line[0])
        if theta >= 90.0:
            advice = "Leave its rows out: there is no hemisphere, and light closer to the surface takes those before."
            raise lines.refuse(at, "a table at 90° of incidence", advice)
        beta, azimuth = np.unique(block.values[:, 4]), np.unique(block.values[:, 5])
        values = np.full((2, azimuth.size, beta.size), np.nan)
        to = np.searchsorted(azimuth, block.values[:, 5]), np.searchsorted(beta, block.values[:, 4])
        values[:, to[0], to[1]] = block.values[:, 6:].T
        if len(block.line) != beta.size * azimuth.size or np.isnan(values).any() or beta[0] < 0.0:
            raise lines.refuse(at, f"the table at {theta:g}° has no value, or two, for some direction")
        # TracePro has the same lists for all incidences. A file that was cut between two of its rows may lack nothing else.
        alike = np.array_equal(beta, lists[0])
        alike &= np.array_equal(azimuth, lists[1]) or (theta < NORMAL and azimuth.size == 1)
        if not alike:
            raise lines.refuse(
                int(block.line[-1]), f"the table at {theta:g}° has other ScatterBeta or ScatterAzimuth than others"
            )
        if np.ptp(azimuth) > 360.0:
            raise lines.refuse(at, f"azimuths at {theta:g}° span more than a turn")
        if np.ptp(azimuth) == 360.0:
            azimuth, values = azimuth[:-1], values[:, :-1]
        light = (180.0 + (0.0 if turning else phi)) % 360.0
        incident = light_from(theta, light, behind=not front)
        grid = PolarGrid("cosines", beta, azimuth - forwards(light, turning=turning))
        stated = left.get((wavelength, theta, phi))
        colour = 1e3 * wavelength if several else None
        both = [
            BsdfSlice(
                incident,
                values[int(transmitted)],
                transmitted,
                grid=grid,
                wavelength=colour,
                stated=stated if values[int(transmitted)].any() and not values[int(not transmitted)].any() else None,
            )
            for transmitted in (False, True)
        ]
        slices += both
        whole = sum(one.integral() for one in both)
        if stated is not None and abs(whole - stated) > CLOSE * max(stated, whole):
            text = f"the row of shares leaves {stated:.6g} of the light for scatter, the table adds up to {whole:.6g}"
            complaints.append(Complaint("note", f"{theta:g}° of incidence", text))
    scattered = {one.transmitted for one in slices if one.values.any()}
    return Tables([one for one in slices if one.transmitted in scattered], complaints)


def profiles_of(lines: Lines, shares: Rows, blocks: dict[Key, Rows]) -> tuple[Array, Array]:
    """One-dimensional tables: x of β − β₀, shape (n,), and f of both ways at each row of shares, shape (2, rows, n).

    Raises
    ------
    FormatError
        If tables are not complete, or differ in their x.
    UnsupportedFormatError
        If x is nowhere below 0, or there are azimuths: nothing is known of such tables.
    """
    first = np.unique(next(iter(blocks.values())).values[:, 4])
    f = np.zeros((2, len(shares.line), first.size))
    for row, key in enumerate(shares.values[:, 1:4]):
        block = blocks[_key(key)]
        place = f"line {block.line[0] + 1}"
        beta, order = np.unique(block.values[:, 4], return_index=True)
        if block.values[:, 5].any():
            found = "a one-dimensional table with a ScatterAzimuth that is not 0"
            raise UnsupportedFormatError(lines.path, place, found, "Export it as an asymmetric table.")
        if beta.size != len(block.line):
            raise lines.refuse(int(block.line[0]), "a ScatterBeta that is stated twice")
        if beta.size != first.size or (beta != first).any() or beta.size < 2:
            text = "the ScatterBeta of a one-dimensional table are two or more, the same for all incidences"
            raise lines.refuse(int(block.line[0]), text)
        if beta[0] >= 0.0 or np.abs(beta).max() > 2.0:
            found = f"a one-dimensional table of ScatterBeta from {beta[0]:g} to {beta[-1]:g}"
            advice = "It is read with values on both sides of 0, and none beyond 2. Export it as an asymmetric table."
            raise UnsupportedFormatError(lines.path, place, found, advice)
        f[:, row] = block.values[order, 6:].T
    return first, f
