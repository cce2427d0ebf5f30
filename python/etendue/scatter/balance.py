"""No more light leaves a table than arrives: both ways and all components together."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.report import Complaint
from etendue.scatter.bsdf import WAVELENGTH
from etendue.scatter.building import built
from etendue.scatter.members import Record, leaving, members_of

Array = npt.NDArray[np.float64]

MOST = 1.01
"""Share of the light that may leave: more is refused, and what is above 1 is scaled to 1, with a complaint."""

CLOSE = 1e-5
"""By which shares that come from quadratures may exceed 1 and nothing is said; the core allows as much."""

STEP = 0.25
"""Of the angles of incidence [°] at which the core looks at sums, and so does what follows."""

AROUND = np.degrees(np.arctan2([0.0, 0.6, 1.0, 0.28, -0.8], [1.0, 0.8, 0.0, -0.96, -0.6]))
"""The same for azimuths [°]."""

VISIBLE = np.arange(380.0, 781.0, 20.0)
"""And for wavelengths [nm]."""


def balanced(data: BsdfData, shares: Sequence[float]) -> tuple[list[Record] | None, float, list[Complaint]]:
    """Members of a table of which no more light leaves than arrives, and a weight of everything for what is left.

    At the incidences of the slices both ways are scaled so that they make 1 with the components. What exceeds 1 after that
    is due to components alone, or lies between incidences; everything is multiplied by the weight for it.

    Parameters
    ----------
    data : BsdfData
        Slices and components.
    shares : sequence of float
        Of the flux that each slice scatters by itself.

    Returns
    -------
    members, weight, complaints
        Members as `members_of` makes them; None if those of the shares will do, which have not been needed.

    Raises
    ------
    ArgumentError
        If more than 101 % of the light leaves.

    Examples
    --------
    >>> two = ({"kind": "lambertian", "reflectance": 0.9}, {"kind": "mirror", "reflectance": 0.104})
    >>> _, weight, complaints = balanced(BsdfData(components=two), [])
    >>> print(round(weight, 4), *complaints)
    0.996 warning: 0° of incidence: 1.004 of the light leaves in all; everything is scaled by 0.996016
    """
    if len(data.components) + len({one.transmitted for one in data.slices}) < 2:
        return None, 1.0, []
    records = members_of(data, shares)
    members = [built(record) for record in records]
    complaints: dict[str, Complaint] = {}
    found = []
    for one, share in zip(data.slices, shares, strict=True):
        scattered, other, wavelength = max(_at(one, data, members), key=lambda parts: parts[0] + parts[1])
        total = scattered + other
        place = _place(data, one.theta, wavelength)
        _refuse(total, place)
        if total > 1.0 + CLOSE:
            complaints.setdefault(
                place, Complaint("warning", place, f"{total:.6g} of the light leaves in all; scaled to 1")
            )
        found.append(share if total <= 1.0 else share * max(1.0 - other, 0.0) / scattered)
    if found != list(shares):
        records = members_of(data, found)
        members = [built(record) for record in records]
    if (beyond := _beyond(data, members)) < 1.0 - CLOSE:
        records = members_of(data, found, beyond)
        members = [built(record) for record in records]
    total, place = max(_everywhere(data, members))
    _refuse(total, place)
    if total > 1.0 + CLOSE:
        scaled = f"{total:.6g} of the light leaves in all; everything is scaled by {1.0 / total:.6g}"
        complaints.setdefault(f"{place}, left", Complaint("warning", place, scaled))
    return records, 1.0 / max(total, 1.0), list(complaints.values())


def _at(one: BsdfSlice, data: BsdfData, members: Sequence[_core.Bsdf]) -> Iterator[tuple[float, float, float]]:
    """At the incidence of a slice: what slices scatter, the most that leaves of components, and at which wavelength."""
    n = len(data.components)
    azimuths = one.phi + AROUND if data.isotropic else np.array([one.phi])
    sides = (False, True) if data.both_sides else (not one.front,)
    incident = np.concatenate([direction(one.theta, azimuths, behind=behind) for behind in sides])
    for wavelength in data.wavelengths or (WAVELENGTH,) if one.wavelength is None else (one.wavelength,):
        scattered, other = (leaving(part, incident, wavelength) for part in (members[n:], members[:n]))
        yield float(scattered.max()), float(other.max()), wavelength


def _beyond(data: BsdfData, members: Sequence[_core.Bsdf]) -> float:
    """The part of what slices scatter beyond their last incidence that components leave room for."""
    n, last = len(data.components), max((one.theta for one in data.slices), default=90.0)
    if not n:
        return 1.0
    theta = np.arange(90.0, last, -STEP)
    part = 1.0
    for wavelength in data.wavelengths or (WAVELENGTH,):
        for azimuth, behind in itertools.product(AROUND, (False, True)):
            incident = direction(theta, azimuth, behind=behind)
            scattered, other = (leaving(some, incident, wavelength) for some in (members[n:], members[:n]))
            # Where next to nothing is left, as at the rim, shares are as good as 0.
            there = scattered > CLOSE
            part = min([part, *np.maximum(1.0 - other[there], 0.0) / scattered[there]])
    return part


def _everywhere(data: BsdfData, members: Sequence[_core.Bsdf]) -> Iterator[tuple[float, str]]:
    """The largest share that leaves at each wavelength, and where it does."""
    angles = np.concatenate(
        [np.arange(0.0, 90.0 + STEP, STEP), [one.theta for one in data.slices], _nodes(data, "angle")]
    )
    azimuths = np.unique(np.append(AROUND, [] if data.isotropic else [one.phi for one in data.slices]))
    theta = np.repeat(np.unique(angles), len(azimuths))
    phi = np.tile(azimuths, len(theta) // len(azimuths))
    incident = np.concatenate([direction(theta, phi, behind=behind) for behind in (False, True)])
    spectrum = [VISIBLE, _nodes(data, "wavelength")] if data.components else []
    for wavelength in np.unique(np.concatenate([data.wavelengths or [WAVELENGTH], *spectrum])):
        found = leaving(members, incident, float(wavelength))
        most = int(np.argmax(found))
        yield float(found[most]), _place(data, theta[most % len(theta)], float(wavelength))


def _nodes(data: BsdfData, axis: str) -> list[float]:
    """Where the curves of components have their kinks."""
    curves = [value for part in data.components for value in part.values() if isinstance(value, Mapping)]
    return [float(node) for curve in curves for node in curve.get(axis, ())]


def _place(data: BsdfData, theta: float, wavelength: float) -> str:
    return f"{theta:g}° of incidence" + (f", {wavelength:g} nm" if data.wavelengths else "")


def _refuse(total: float, place: str) -> None:
    if total > MOST:
        raise ArgumentError(f"at {place} {total:.4g} of the light leaves in all, more than the surface receives")
