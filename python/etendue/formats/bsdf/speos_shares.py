"""What Speos' files of shares have in common: parts of the light in per cent, and Gaussian lobes by their width."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.formats.bsdf.bsdf_format import ShareTables
from etendue.formats.bsdf.tokens import UNENDED, Tokens
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

WHOLE = 100.0
"""Per cent."""

STEEPEST = 89.0
"""Largest angle of incidence [°] of a lobe."""

NARROWEST = 0.01
"""Full width at half maximum [°] below which a lobe is drawn no narrower."""

FIT = 1e-6
"""Relative difference from a Gaussian of values that went through files of nine digits and more."""

STEPS = np.concatenate([[0.0], np.geomspace(0.03, 3.0, 40)])
"""Angles from the specular direction over the full width at half maximum."""


def words_after_lines(path: Path, lines: int) -> tuple[Tokens, list[str]]:
    """The words of a text from a line on, and the lines before it."""
    tokens = Tokens(path)
    text = path.read_bytes().decode("utf-8", "replace").splitlines()[:lines]
    tokens.at = int(np.searchsorted(tokens.lines, lines, side="right"))
    return tokens, text


def require_end(path: Path, tokens: Tokens) -> None:
    """Refuse a text whose last line has no end, or that goes on after its data."""
    if tokens.left:
        tokens.at += 1
        tokens.refuse("the file goes on after its data")
    with path.open("rb") as file:
        file.seek(-1, 2)
        ended = file.read(1) in b"\r\n\t "
    if not ended:
        tokens.refuse("the last line has no end", UNENDED)


def sizes(tokens: Tokens, words: int) -> tuple[int, Array]:
    """How many angles of incidence, and the wavelengths [nm], with so many `words` of each at each angle to follow."""
    angles, waves = (tokens.count(what) for what in ("number of incidences", "number of wavelengths"))
    wavelength = tokens.numbers("wavelengths", waves)
    if (np.diff(wavelength) <= 0.0).any() or wavelength[0] <= 0.0:
        tokens.refuse("wavelengths do not rise")
    if tokens.left < angles * (1 + words * waves):
        tokens.refuse(f"{tokens.left} words follow; {angles} angles and {waves} wavelengths have more")
    return angles, wavelength


def next_angle(tokens: Tokens, before: float) -> float:
    """An angle of incidence [°] beyond the one before it."""
    value = tokens.number("angle of incidence")
    if not before < value <= 0.5 * 180.0:
        tokens.refuse("angles of incidence do not rise within 0 to 90°")
    return value


def head(start: bytes, version: str, name: str) -> list[str]:
    """The first two lines of a file: its kind, and a comment."""
    return [f"{start.decode()} {version}", " ".join(name.split()) or "BSDF"]


def per_cent(values: npt.ArrayLike) -> str:
    """Shares as words of a line."""
    return "\t".join(f"{WHOLE * value:.12g}" for value in np.ravel(values))


def whole_range(shares: ShareTables) -> ShareTables:
    """The same from 0 to 90°: beyond the first and the last angle shares do not change; widths are linear as well."""
    angle = np.unique(np.concatenate([[0.0, 0.5 * 180.0], np.clip(shares.angle, 0.0, 0.5 * 180.0)]))

    def at(values: Array) -> Array:
        columns = values.reshape(2, shares.angle.size, -1)
        found = [[np.interp(angle, shares.angle, column) for column in way.T] for way in columns]
        return np.swapaxes(np.array(found), 1, 2)

    return dataclasses.replace(
        shares,
        angle=angle,
        specular=at(shares.specular),
        diffuse=at(shares.diffuse),
        lobe=None if shares.lobe is None else at(shares.lobe),
        width=None if shares.width is None else np.stack([at(each) for each in shares.width]),
    )


def share(tokens: Tokens, what: str) -> float:
    """A number of per cent, as a share."""
    value = tokens.number(what)
    if not 0.0 <= value <= WHOLE:
        tokens.refuse(f"{what} is {value:g} %")
    return value / WHOLE


def width(tokens: Tokens, what: str) -> float:
    """A full width at half maximum [°]."""
    value = tokens.number(what)
    if not 0.0 <= value <= 0.5 * 180.0:
        tokens.refuse(f"{what} is {value:g}°")
    return value


def mixed(angle: Array, wavelength: Array, shares: Mapping[str, Array]) -> list[Mapping[str, Any]]:
    """Shares of shape (angles, wavelengths) as a component; none if all are 0."""
    there: dict[str, Any] = {}
    for name, values in shares.items():
        if not values.any():
            continue
        if not np.ptp(values):
            there[name] = float(values.flat[0])
        elif wavelength.size == 1 or not np.ptp(values, axis=1).any():
            there[name] = {"angle": angle.tolist(), "values": values[:, 0].tolist()}
        elif angle.size == 1 or not np.ptp(values, axis=0).any():
            there[name] = {"wavelength": wavelength.tolist(), "values": values[0].tolist()}
        else:
            there[name] = {"angle": angle.tolist(), "wavelength": wavelength.tolist(), "values": values.tolist()}
    return [{"kind": "mixed", **there}] if there else []


def gaussian(
    theta: float, part: float, widths: tuple[float, float], *, transmitted: bool, wavelength: float | None
) -> BsdfSlice:
    """A lobe whose intensity is Gaussian in angle, of full widths at half maximum in and across the plane of incidence."""
    in_plane, across = (max(one, NARROWEST) for one in widths)
    radial = STEPS * max(in_plane, across)
    radial = radial[radial < 180.0]
    grid = PolarGrid("specular", radial, np.arange(0.0, 360.0, 5.0))
    incident = direction(min(theta, STEEPEST), 180.0)
    to = grid.directions(incident, transmitted=transmitted)
    turn = np.radians(grid.azimuth)[:, None]
    square = (np.cos(turn) * radial / in_plane) ** 2 + (np.sin(turn) * radial / across) ** 2
    f = np.exp(-4.0 * math.log(2.0) * square) / np.maximum(np.abs(to[..., 2]), 1e-3)
    f[:, -1] = 0.0
    one = BsdfSlice(incident, np.where(np.isnan(f), 0.0, f), transmitted, grid=grid, wavelength=wavelength)
    known = one.integral()
    factor = part / known if known > 0.0 else 0.0
    return dataclasses.replace(one, values=one.values * factor, stated=part)


def lobe_of(one: BsdfSlice) -> tuple[float, float, float] | None:
    """Share and full widths [°], in the plane of incidence and across it, of a slice that `gaussian` makes; None of others.

    Examples
    --------
    >>> lobe = gaussian(30.0, 0.4, (5.0, 12.0), transmitted=False, wavelength=None)
    >>> [round(number, 9) for number in lobe_of(lobe)]
    [0.4, 5.0, 12.0]
    """
    grid = one.grid
    if grid is None or grid.frame != "specular" or grid.radial.size < 2 or grid.azimuth.size < 2 or not one.front:
        return None
    part, widest = one.integral(), float(grid.radial[1] / STEPS[1])
    widths = (widest, widest)
    if part > 0.0:
        intensity = one.values * np.abs(one.directions[..., 2])
        towards, across = (int(np.argmin(np.abs(grid.azimuth - angle))) for angle in (0.0, 0.5 * 180.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            fallen = -np.log(intensity[[towards, across], 1] / intensity[[towards, across], 0])
            found = grid.radial[1] * np.sqrt(4.0 * math.log(2.0) / fallen)
        if not (np.isfinite(found) & (found >= NARROWEST * (1.0 - FIT))).all():
            return None
        widths = float(found[0]), float(found[1])
    made = gaussian(one.theta, part, widths, transmitted=one.transmitted, wavelength=one.wavelength)
    there = made.grid
    if there is None or there.shape != grid.shape:
        return None
    pairs = ((there.radial, grid.radial), (there.azimuth, grid.azimuth), (made.values, one.values))
    if not all(np.allclose(a, b, rtol=0.0, atol=FIT * max(float(a.max()), FIT)) for a, b in pairs):
        return None
    return part, *widths
