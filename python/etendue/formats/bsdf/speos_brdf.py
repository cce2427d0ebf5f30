"""Ansys Speos ``.brdf`` as text: isotropic, a table about the normal for each incidence and wavelength."""

from __future__ import annotations

import dataclasses
import itertools
from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.shares import scaled
from etendue.formats.bsdf.speos import PHI_STEP, THETA, WAYS, flag, past_header, slice_of, table_rows
from etendue.formats.bsdf.tokens import Tokens
from etendue.formats.encodings import decoded
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

START = "OPTIS - brdf surface file"

ANY_COLOUR = (360.0, 830.0)
"""Wavelengths [nm] at which values are written that are the same at all."""


def recognise(head: bytes) -> bool:
    """By the first line, of text or binary files."""
    return head.removeprefix(BOM_UTF8).lower().startswith(START.lower().encode("ascii"))


def read(path: Path) -> BsdfData:
    """Read shapes, each scaled to the share that stands above it, at every wavelength.

    Azimuth 0 is the mirrored or straight direction; θ counts from the normal, beyond 90° behind the surface.
    """
    with path.open("rb") as file:
        head = file.read(256)
    if head.partition(b"\n")[2].lstrip(b"\r\n \t")[:1] == b"1":
        advice = "Save it as text in the surface editor, mode 0."
        raise UnsupportedFormatError(path, "line 2", "this Speos file is binary", advice)
    tokens = Tokens(path)
    past_header(tokens, decoded(path, path.read_bytes()).splitlines())
    there = [flag(tokens, way) for way in WAYS]
    if not any(there):
        tokens.refuse("neither reflection nor transmission is there", "Ask for a file with data.")
    kind = tokens.number("type")
    if kind not in (0.0, 1.0):
        tokens.refuse(f"the type of values is {kind:g}", "It is 0 (intensity) or 1 (BSDF).")
    counts = [tokens.count(f"number of {what}") for what in ("incidences", "wavelengths")]
    incidences, waves = (
        tokens.numbers(what, count) for what, count in zip(("incidences", "wavelengths"), counts, strict=True)
    )
    if (np.diff(incidences) <= 0.0).any() or incidences[0] < 0.0 or incidences[-1] > 90.0:
        tokens.refuse("angles of incidence do not rise within 0 to 90°")
    if (np.diff(waves) <= 0.0).any() or waves[0] <= 0.0:
        tokens.refuse("wavelengths do not rise")
    slices = []
    tables: list[tuple[str, float, float]] = []
    read_values: list[Array] = []
    for transmitted in (way for way in (False, True) if there[way]):
        for theta, wave in itertools.product(incidences, waves):
            share = tokens.number("share [%]")
            if not 0.0 <= share <= 100.0:
                tokens.refuse(f"a share of {share:g} %")
            one = slice_of(tokens, min(float(theta), 89.99), 0.0, transmitted, intensity=kind == 0.0)
            read_values.append(one.values.ravel())
            known = one.integral()
            if share > 0.0 and not known > 0.0:
                tokens.refuse("values add up to no light, though the share says so")
            stated = 0.01 * share
            factor = stated / known if known > 0.0 else 0.0
            if known > 0.0:
                tables.append((f"{theta:g}° of incidence, {WAYS[transmitted]}, {wave:g} nm", stated, known))
            wavelength = None if waves.size == 1 else float(wave)
            slices.append(dataclasses.replace(one, values=one.values * factor, wavelength=wavelength, stated=stated))
    if " ".join(tokens.words[tokens.at : tokens.at + 3]).casefold() != "end of file":
        tokens.refuse("the data do not end with 'End of file'")
    complaints = (*below_zero(np.concatenate(read_values)), *scaled(tables))
    return BsdfData(tuple(_of_one_colour(slices)), mirrored=False, name=path.stem, complaints=complaints)


def _of_one_colour(slices: list[BsdfSlice]) -> list[BsdfSlice]:
    """Without wavelengths, where all hold the same values."""
    waves = sorted({one.wavelength for one in slices if one.wavelength is not None})
    first = [one for one in slices if not waves or one.wavelength == waves[0]]
    for wave in waves[1:]:
        own = [one for one in slices if one.wavelength == wave]
        if not all(np.array_equal(a.values, b.values, equal_nan=True) for a, b in zip(first, own, strict=True)):
            return slices
    return [dataclasses.replace(one, wavelength=None) for one in first]


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables about the normal from one azimuth, at the same angles for each way and wavelength."""
    if not data.slices or data.components or not data.isotropic:
        return False
    by_way: dict[tuple[bool, float | None], list[float]] = {}
    for one in data.slices:
        grid = one.grid
        if grid is None or grid.frame != "normal" or not one.front or np.isnan(one.values).any():
            return False
        first = (grid.azimuth[0] - one.phi - 180.0) % 360.0
        if min(first, 360.0 - first) > 1e-6 and grid.azimuth.size > 1:
            return False
        by_way.setdefault((one.transmitted, one.wavelength), []).append(round(one.theta, 9))
    angles = next(iter(by_way.values()))
    waves = [{wave for other, wave in by_way if other == way} for way, _ in by_way]
    return waves.count(waves[0]) == len(waves) and all(
        sorted(thetas) == sorted(set(angles)) for thetas in by_way.values()
    )


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light that meets the front from one azimuth, reflected and transmitted, at each wavelength that is known."""
    grid = PolarGrid("normal", THETA, np.arange(0.0, 360.0, PHI_STEP))
    polar = np.minimum(THETA, 90.0 - 1e-7)
    slices = []
    for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
        scattered = direction(polar[None, :], grid.azimuth[:, None], behind=transmitted)
        for theta, wave in itertools.product(bsdf.incidences if is_there else (), bsdf.wavelengths or (None,)):
            incident = light_from(theta, 180.0)
            values = bsdf.evaluate(incident, scattered, wavelength=wave)
            slices.append(BsdfSlice(incident, values, transmitted, grid=grid, wavelength=wave))
    return BsdfData(tuple(slices), isotropic=True, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write text of version 8.0 with values in proportion to the BSDF under the share of each table."""
    ways = [way for way in (False, True) if any(one.transmitted == way for one in data.slices)]
    waves: list[float | None] = sorted({one.wavelength for one in data.slices}, key=lambda wave: wave or 0.0)
    listed = ANY_COLOUR if waves == [None] else [wave for wave in waves if wave is not None]
    thetas = sorted({round(one.theta, 9) for one in data.slices})
    name = data.name.encode("ascii", "replace").decode("ascii").replace("\n", " ")
    lines = [f"{START} v8.0", "0", "written by etendue", str(len(name)), name]
    lines += ["\t".join(str(int(way in ways)) for way in (False, True)), "1", f"{len(thetas)} {len(listed)}"]
    lines += ["\t".join(f"{value:.12g}" for value in values) for values in (thetas, listed)]
    by_place = {(one.transmitted, round(one.theta, 9), one.wavelength): one for one in data.slices}
    for way, theta, wave in itertools.product(ways, thetas, listed):
        one = by_place[way, theta, None if waves == [None] else wave]
        lines += [f"{100.0 * max(one.integral(), 0.0):.12g}", *table_rows(one)]
    stream.write(("\n".join([*lines, "End of file"]) + "\n").encode("ascii"))
    return () if data.both_sides else ("only light that meets the front is written",)


FORMAT = BsdfFormat("speos-brdf", "Speos BRDF", (".brdf",), recognise, read, fits, tabulate, write)
