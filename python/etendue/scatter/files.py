"""`read_bsdf` and `write_bsdf`: a BSDF from a file, and into one."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.formats.bsdf import BSDF_FORMATS, bsdf_format, read_bsdf_data, write_bsdf_data, write_bsdf_shares
from etendue.formats.bsdf.bsdf_format import NO_ERRORS, BsdfFormat
from etendue.quantities.arguments import BSDF, require, require_path
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import LEAN, NORMAL
from etendue.quantities.report import Complaint
from etendue.scatter.bsdf import WAVELENGTH, Bsdf, Side
from etendue.scatter.errors import with_standard_errors
from etendue.scatter.formulas import formulas_of, regular_of_any
from etendue.scatter.members import components_of, parts_of, same_when_turned
from etendue.scatter.models.finish import Finish, Record
from etendue.scatter.share_tables import share_tables
from etendue.scatter.table import BsdfTable
from etendue.scatter.turns import LEAST, MOST, MOST_SLICES, TOLERANCE, Turns, turns_of

INCIDENCES = (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0)
"""Angles [°] at which a model is tabled, and a file that holds models alone."""

GRAZING, RIGHT_ANGLE = 89.0, 90.0
"""Angle [°] besides these where a surface mirrors as well, most of it at grazing incidence; and the last there is."""

MOST_WAVELENGTHS = 41
"""At which a model is tabled: spectra measured at each nanometre would make files of gigabytes."""

COARSE = 0.01
"""Part of a slice's share by which its table may be off without a word."""

FAINT = 1e-5
"""Share of the light by which it may be as well."""


def read_bsdf(path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]]) -> BsdfTable:
    """Read a BSDF; the format is found from the content.

    Parameters
    ----------
    path : path or sequence of paths
        A file of any format of docs/formats/bsdf-files.md; or several that hold a part each, as goniophotometers write one
        for each incidence: their slices and components are put together.

    Returns
    -------
    BsdfTable
        With all that was not as it should be in `complaints`.

    Raises
    ------
    FormatError
        If it is none of the formats, or damaged; UnsupportedFormatError for formats that are known and refused.
    ArgumentError
        If more than 101 % of the light leaves, two files hold the same slice, or there is no file.
    OSError
        If a file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.scatter.models import Gaussian
    >>> with TemporaryDirectory() as folder:
    ...     lost = write_bsdf(Path(folder) / "film.h5", Gaussian(peak=5, sigma=0.15))
    ...     read_bsdf(Path(folder) / "film.h5").reflectance(30).round(3).tolist()
    0.706
    """
    paths: list[Any] = [path]
    if not isinstance(path, str | os.PathLike):
        require(path, Iterable, "read_bsdf: path", "the path of a file, or a list of them")
        paths = list(path)
    for one in paths:
        require_path(one, "read_bsdf: path" if one is path else "read_bsdf: one of the paths")
    if not paths:
        raise ArgumentError("read_bsdf: there is no file to read; give the path of one.")
    parts, names = [read_bsdf_data(one) for one in paths], [Path(one).name for one in paths]
    data = parts[0] if len(parts) == 1 else _joined(parts, names)
    try:
        return BsdfTable(data)
    except ArgumentError as error:
        raise ArgumentError(f"{', '.join(names)}: {error}") from error


def _joined(parts: Sequence[BsdfData], names: Sequence[str]) -> BsdfData:
    """What several files hold of one sample."""
    slices = tuple(one for part in parts for one in part.slices)
    places: dict[tuple[float, float, bool, bool, float | None], str] = {}
    for part, name in zip(parts, names, strict=True):
        for one in part.slices:
            place = (round(one.theta, 4), round(one.phi, 4), one.front, one.transmitted, one.wavelength)
            if place in places:
                both = f"{places[place]} and {name}"
                raise ArgumentError(f"{both} both hold light from {one.theta:g}°, azimuth {one.phi:g}°")
            places[place] = name
    turns = {round(one.phi, 3) % 360.0 for one in slices if one.theta > 1e-3}
    complaints = [
        Complaint(complaint.severity, f"{name}, {complaint.place}", complaint.found)
        for part, name in zip(parts, names, strict=True)
        for complaint in part.complaints
    ]
    return BsdfData(
        slices,
        tuple(component for part in parts for component in part.components),
        isotropic=all(part.isotropic for part in parts) and len(turns) <= 1,
        mirrored=all(part.mirrored for part in parts),
        both_sides=len({one.front for one in slices}) <= 1 and all(part.both_sides for part in parts),
        name=parts[0].name,
        complaints=tuple(complaints),
        facts=parts[0].facts,
        format=", ".join(sorted({part.format for part in parts})),
    )


def _grids(record: Record) -> list[dict[str, Any]]:
    """Tables of shares of a model."""
    return [value for part in parts_of(record) for value in part.values() if isinstance(value, dict)]


def _wavelengths(record: Record) -> set[float]:
    """Between which shares of a model are linear [nm]; none where they are the same at all."""
    nodes = [np.asarray(grid["wavelength"]) for grid in _grids(record) if "wavelength" in grid]
    return {float(node) for one in nodes if one.size > 1 for node in one}


class _Asked:
    """A BSDF as writers ask for it."""

    def __init__(self, bsdf: Bsdf, form: BsdfFormat) -> None:
        data = bsdf.data if isinstance(bsdf, BsdfTable) else None
        self._bsdf = bsdf
        self.name = data.name if data else type(bsdf).__name__
        record = bsdf.record(Files())
        self.isotropic = bsdf.isotropic if isinstance(bsdf, BsdfTable) else same_when_turned(record)
        self.both_sides = data.both_sides if data else True
        nodes = sorted(_wavelengths(record))
        kept = np.unique(np.linspace(0, len(nodes) - 1, min(len(nodes), MOST_WAVELENGTHS)).round().astype(int))
        self.left_out = len(nodes) - kept.size
        self.wavelengths = tuple(sorted({nodes[k] for k in kept}.union(data.wavelengths if data else ())))
        mirrored, refracted, self.reflects, self.transmits = bsdf.ways
        models = (*INCIDENCES, GRAZING) if form.holds_regular and (mirrored or refracted) else INCIDENCES
        self.incidences: tuple[float, ...] = (bsdf.incidences if isinstance(bsdf, BsdfTable) else ()) or models
        kinks = [grid["angle"] for grid in _grids(record) if "angle" in grid]
        self.angles = np.degrees(np.unique(np.concatenate([np.zeros(1), *kinks]))).round(9)

    @functools.cached_property
    def found_turns(self) -> Turns:
        """Azimuths of incidence that a table asks for; 0 alone of an isotropic one."""
        if self.isotropic:
            return Turns((0.0,), 0.0)
        table = self._bsdf.data.slices if isinstance(self._bsdf, BsdfTable) else ()
        known = [one.phi - 180.0 for one in table if one.theta >= NORMAL]
        ways = [way for way, is_there in ((False, self.reflects), (True, self.transmits)) if is_there]
        each = len(self.incidences) * len(ways) * (2 - self.both_sides) * max(len(self.wavelengths), 1)
        most = min(max(MOST_SLICES // max(each, 1), LEAST), MOST)
        return turns_of(lambda i, s: self.evaluate(i, s, wavelength=self.colour), self.incidences, ways, known, most)

    @property
    def turns(self) -> tuple[float, ...]:
        """As writers ask."""
        return self.found_turns.azimuths

    @property
    def colour(self) -> float:
        """The wavelength [nm] of what is written without one: what a table does not know is that of the nearest."""
        if not self.wavelengths:
            return WAVELENGTH
        return min(max(WAVELENGTH, self.wavelengths[0]), self.wavelengths[-1])

    def evaluate(
        self, incident: npt.ArrayLike, scattered: npt.ArrayLike, *, wavelength: float | None = None
    ) -> npt.NDArray[np.float64]:
        i = np.asarray(incident, np.float64)
        if not self.isotropic:
            # Along the normal a sample that can be turned sees light from no azimuth: nothing is to be interpolated there.
            along = np.hypot(i[..., 0], i[..., 1]) <= 2.0 * LEAN
            i = np.where(along[..., None], i * [0.0, 0.0, 1.0], i)
        return self._bsdf.evaluate(i, scattered, wavelength=WAVELENGTH if wavelength is None else wavelength)


def write_bsdf(path: str | os.PathLike[str], bsdf: Bsdf, format: str | None = None) -> tuple[str, ...]:
    """Write a BSDF; a table that a format can hold as it is is written so, else one is made.

    Parameters
    ----------
    path : path
        Appears whole or not at all.
    bsdf : Bsdf
        A model or a table.
    format : str, optional
        Name of a format; by the extension if left out.

    Returns
    -------
    tuple of str
        What the file does not hold, one sentence each.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    ArgumentError
        If nothing of it is scattered: mirrors and interfaces have no table; or the format is read only, or holds shares of
        mirrored and Lambertian light (Speos' .coated, .scattering, .simplescattering) and the BSDF has lobes, but for those
        that .scattering has.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from etendue.scatter.models import ABg
    >>> with TemporaryDirectory() as folder:
    ...     write_bsdf(Path(folder) / "polish.h5", ABg(a=0.0025, b=0.001, g=1.8))
    ()
    """
    require_path(path, "write_bsdf: path", "the path of the file first, then the BSDF")
    require(bsdf, Bsdf, "write_bsdf: bsdf", BSDF)
    form = bsdf_format(Path(path), format)
    if form.write_shares is not None:
        write_bsdf_shares(path, share_tables(bsdf, form), form.name)
        return ()
    data, lost = _laid_out(bsdf, form)
    return lost + write_bsdf_data(path, data, form.name)


def _laid_out(bsdf: Bsdf, form: BsdfFormat) -> tuple[BsdfData, tuple[str, ...]]:
    if form.fits is None or form.tabulate is None:
        written = ", ".join(one.name for one in BSDF_FORMATS.values() if one.tabulate is not None)
        raise ArgumentError(f"{form.title} is read only; formats that are written: {written}.")
    for data in _as_it_is(bsdf):
        if form.fits(data):
            return data, ()
    asked = _Asked(bsdf, form)
    regular, lost = _regular(bsdf, asked, form)
    if not (asked.reflects or asked.transmits):
        if not regular:
            raise ArgumentError("nothing of this BSDF is scattered, so there is no table of it to write")
        data = BsdfData(components=tuple(regular), name=asked.name)
        return data, (*lost, *_colours(asked, data))
    data = dataclasses.replace(form.tabulate(asked), components=tuple(regular))
    if isinstance(bsdf, BsdfTable) and any(one.standard_error is not None for one in bsdf.data.slices):
        data = with_standard_errors(data, bsdf.data) if form.holds_errors else data
        if not any(one.standard_error is not None for one in data.slices):
            lost.append("standard errors are known for a part of the light alone" if form.holds_errors else NO_ERRORS)
    if data.isotropic and not asked.isotropic:
        lost.append(f"only light from azimuth {data.slices[0].phi:g}° of an anisotropic sample is in the file")
    lost += [*_between_turns(asked), *_colours(asked, data)]
    if not asked.both_sides and len({one.front for one in data.slices}) == 1:
        lost.append("only light that meets the front is in the file, and reads as that of both sides")
    kept = {one.transmitted for one in data.slices}
    if kept != {way for way, is_there in ((False, asked.reflects), (True, asked.transmits)) if is_there}:
        lost.append(f"the file holds {'transmitted' if True in kept else 'reflected'} light only")
    lost.append("the values are a table made for this format")
    data, coarse = _scaled(bsdf, data)
    return data, (*lost, *coarse)


def _as_it_is(bsdf: Bsdf) -> Iterator[BsdfData]:
    """What a format may hold without a new table: slices and components as they are, or components as plain formulas."""
    if isinstance(bsdf, BsdfTable):
        data, records = bsdf.data, components_of(bsdf.data)
    elif isinstance(bsdf, Finish):
        records = [bsdf.record(Files())]
        isotropic = same_when_turned(records[0])
        data = BsdfData(components=(bsdf.to_dict(),), isotropic=isotropic, name=type(bsdf).__name__)
    else:
        return
    yield data
    plain = formulas_of({"kind": "sum", "members": [(1.0, record) for record in records]})
    if plain is not None:
        yield dataclasses.replace(data, components=plain)


def _regular(bsdf: Bsdf, asked: _Asked, form: BsdfFormat) -> tuple[list[dict[str, Any]], list[str]]:
    """Light that is mirrored or goes straight on, if there is any and the format holds it; and what is lost of it."""
    mirrored, refracted, _, _ = bsdf.ways
    if not (mirrored or refracted):
        return [], []
    if not form.holds_regular:
        return [], ["light that is mirrored or goes on in a single direction is not in the file"]
    last = asked.incidences[-1] if asked.reflects or asked.transmits else RIGHT_ANGLE
    return regular_of_any(bsdf, asked.angles, asked.colour, last)


def _between_turns(asked: _Asked) -> list[str]:
    """What is to be said of azimuths of incidence, if the format has asked for them."""
    found = vars(asked).get("found_turns", Turns((), 0.0))
    if found.off <= TOLERANCE:
        return []
    said = f"light from {len(found.azimuths)} azimuths is in the file, between which f is linear"
    return [f"{said}: in the middle between two of them it is off by up to {found.off:.2g} of the light"]


def _colours(asked: _Asked, data: BsdfData) -> list[str]:
    """What is to be said of wavelengths."""
    if asked.wavelengths and not data.wavelengths:
        return [f"no wavelength is in the file: its values are those at {asked.colour:g} nm"]
    if asked.left_out:
        return [f"{asked.left_out} wavelengths between those of the file are left out"]
    return []


def _scaled(bsdf: Bsdf, data: BsdfData) -> tuple[BsdfData, list[str]]:
    """The table with the shares that the BSDF has, and what is to be said of it: where it was farthest off.

    Where its directions are too far apart for the lobe, they hold another share of the light, or more than is received.
    """
    worst, said, slices = 0.0, [], []
    for one in data.slices:
        side: Side = "front" if one.front else "back"
        wavelength = WAVELENGTH if one.wavelength is None else one.wavelength
        ways = (bsdf.reflectance, bsdf.regular_reflectance)
        if one.transmitted:
            ways = (bsdf.transmittance, bsdf.regular_transmittance)
        total, regular = (float(way(one.theta, one.phi, side, wavelength=wavelength)) for way in ways)
        share = total - regular
        found = one.integral()
        off = abs(found - share)
        if off <= max(COARSE * share, FAINT):
            slices.append(one)
            continue
        # Of a lobe that falls between the directions there is nothing to scale.
        factor = share / found if found > FAINT and share > FAINT else 1.0
        error = None if one.standard_error is None else one.standard_error * factor
        stated = None if one.stated is None else one.stated * factor
        slices.append(dataclasses.replace(one, values=one.values * factor, standard_error=error, stated=stated))
        if off > worst:
            worst = off
            told = f"at {one.theta:g}° of incidence they add up to {found:.3g} of the light, in truth {share:.3g}"
            said = [f"the directions of the table are too far apart for the lobe: {told}"]
            said[0] += "; values are scaled to that" if factor != 1.0 else ""
    return dataclasses.replace(data, slices=tuple(slices)), said
