"""What a table of scatter hands to the core: its components, and its slices by side, way and wavelength."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.description.files import Files
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.scatter.bases import Base, base_of
from etendue.scatter.bsdf import WAVELENGTH
from etendue.scatter.building import built
from etendue.scatter.models import MODELS
from etendue.scatter.resampling import Rest, lobes_of

Array = npt.NDArray[np.float64]
Record = dict[str, Any]
Rows = list[Record]

Known = list[tuple[BsdfSlice, float]]
"""Slices, with what each scatters of the flux."""


def parts_of(record: Record) -> Iterator[Record]:
    """What the core takes as one, without the sums that it is part of.

    Examples
    --------
    >>> from etendue.scatter.models import Mixture
    >>> paint = Mixture(parts=[{"kind": "lambertian", "reflectance": 0.8}, {"kind": "abg", "a": 0.01, "b": 0.1, "g": 2}])
    >>> [part["kind"] for part in parts_of(paint.record(Files()))]
    ['scatter', 'abg']
    """
    if record["kind"] != "sum":
        yield record
        return
    for _, member in record["members"]:
        yield from parts_of(member)


def same_when_turned(record: Record) -> bool:
    """Whether no lobe of a model is wider across the axis than along it, no surface rougher, and no table by azimuth.

    Examples
    --------
    >>> from etendue.scatter.models import Gaussian
    >>> [same_when_turned(Gaussian(peak=5, sigma=0.1, aspect=aspect).record(Files())) for aspect in (1.0, 2.0)]
    [True, False]
    """
    return all(
        part.get("aspect", 1.0) == 1.0 and part.get("alpha_x") == part.get("alpha_y") and not _by_azimuth(part)
        for part in parts_of(record)
    )


def _by_azimuth(part: Record) -> bool:
    """Whether it is a table of several azimuths of incidence."""
    if part["kind"] != "table":
        return False
    ways = [one[way] for side in ("front", "back") for one in part[side] for way in ("reflected", "transmitted")]
    return any(way is not None and len(way) > 1 for way in ways)


def components_of(data: BsdfData) -> list[Record]:
    """Records of what is described by models.

    Examples
    --------
    >>> [record["kind"] for record in components_of(BsdfData(components=({"kind": "lambertian", "reflectance": 0.5},)))]
    ['scatter']
    """
    return [MODELS[part["kind"]](**part).record(Files()) for part in map(dict, data.components)]


def members_of(data: BsdfData, shares: Sequence[float], beyond: float = 1.0) -> list[Record]:
    """Records of what adds up to a BSDF: one for each component; and one for the slices, or one for each way.

    The core interpolates between wavelengths with both ways together. Where they are not known at the same, each way has a
    table of its own, so that either is interpolated between its own wavelengths.

    Parameters
    ----------
    data : BsdfData
        Of any kind.
    shares : sequence of float
        Of the flux that each slice scatters.
    beyond : float
        Part of what would be scattered beyond the last incidence that is scattered.

    Examples
    --------
    >>> [record["kind"] for record in members_of(BsdfData(components=({"kind": "lambertian", "reflectance": 0.5},)), [])]
    ['scatter']
    """
    found = components_of(data)
    known = list(zip(data.slices, shares, strict=True))
    sides = [[pair for pair in known if pair[0].front is front] for front in (True, False)]
    if data.both_sides:
        sides = [sides[0] or sides[1]]
    rests = _rests(known, found, data, beyond)
    bases = _bases(sides)
    ways = [
        [
            _by_wavelength(side, data, transmitted=way, base=bases[behind != way], rest=rests[way])
            for behind, side in enumerate(sides)
        ]
        for way in (False, True)
    ]
    there = [way for way in ways if any(way)]
    if len(there) == 2 and not any(a and b and a.keys() != b.keys() for a, b in zip(*ways, strict=True)):
        return [*found, _table(ways[0], ways[1], bases)]
    empty: list[dict[float, Rows]] = [{} for _ in sides]
    return found + [_table(way, empty, bases) if way is ways[0] else _table(empty, way, bases) for way in there]


def leaving(members: Sequence[_core.Bsdf], incident: Array, wavelength: float) -> Array:
    """Share of light from directions of shape (n, 3) that leaves the members of a sum, shape (n,).

    Examples
    --------
    >>> data = BsdfData(components=({"kind": "lambertian", "reflectance": 0.5}, {"kind": "mirror", "reflectance": 0.1}))
    >>> members = [built(record) for record in components_of(data)]
    >>> leaving(members, direction([0.0, 80.0], 0.0), 555.0).tolist()
    [0.6, 0.6]
    """
    return sum((one.shares(incident, (wavelength, 1.0, 1.0)).sum(axis=1) for one in members), np.zeros(len(incident)))


def _rests(known: Known, components: Sequence[Record], data: BsdfData, beyond: float) -> tuple[Rest, Rest]:
    """Of reflected and transmitted light: what components leave, shared as at the last incidence."""
    members = [built(part) for part in components]

    def left(theta: Array) -> Array:
        taken = np.zeros(len(theta))
        for behind, azimuth, wavelength in itertools.product(
            (False, True), (0.0, 90.0), data.wavelengths or (WAVELENGTH,)
        ):
            taken = np.maximum(taken, leaving(members, direction(theta, azimuth, behind=behind), wavelength))
        return np.maximum(1.0 - taken, 0.0)

    last = [
        max([(0.0, 0.0), *((one.theta, share) for one, share in known if one.transmitted is way)])[1]
        for way in (False, True)
    ]
    whole = sum(last)
    back, through = (Rest(left, share / whole if whole > 0.0 else 1.0, beyond) for share in last)
    return back, through


def _bases(sides: Sequence[Known]) -> tuple[Base, Base]:
    """Of light that leaves on the front and on the back; slices are of light that meets each, or either."""
    if len(sides) == 1:
        # The same slices leave on both.
        base = base_of([one for one, _ in sides[0]])
        return base, base

    def leaving(front: bool) -> Base:
        known = zip((True, False), sides, strict=True)
        return base_of([one for lit, side in known for one, _ in side if (lit != one.transmitted) is front])

    return leaving(front=True), leaving(front=False)


def _by_wavelength(known: Known, data: BsdfData, *, transmitted: bool, base: Base, rest: Rest) -> dict[float, Rows]:
    """The rows of one way of light that meets a side; slices of no wavelength hold at all, where no other says more."""
    way = [pair for pair in known if pair[0].transmitted is transmitted]
    of_all = [pair for pair in way if pair[0].wavelength is None]
    stated = sorted({one.wavelength for one, _ in way if one.wavelength is not None})
    if not stated:
        return {WAVELENGTH: _rows(of_all, data, base, rest)} if of_all else {}
    return {at: _rows([pair for pair in way if pair[0].wavelength == at] + of_all, data, base, rest) for at in stated}


def _rows(known: Known, data: BsdfData, base: Base, rest: Rest) -> Rows:
    slices, shares = zip(*known, strict=True)
    mirrored = data.isotropic and data.mirrored
    rows = lobes_of(slices, shares, isotropic=data.isotropic, mirrored=mirrored, base=base, rest=rest)
    return [
        {"azimuth": phi / 360.0, "slices": [lobe.record() for lobe in lobes]} for phi, lobes in sorted(rows.items())
    ]


def _table(
    reflected: Sequence[dict[float, Rows]], transmitted: Sequence[dict[float, Rows]], bases: tuple[Base, Base]
) -> Record:
    """Of light that meets the front and the back, or either; bases are of light that leaves there."""
    sides = [
        [
            {"wavelength": at, "reflected": back.get(at), "transmitted": through.get(at)}
            for at in sorted({*back, *through})
        ]
        for back, through in zip(reflected, transmitted, strict=True)
    ]
    return {"kind": "table", "front": sides[0], "back": sides[-1], "bases": [base.luminances for base in bases]}
