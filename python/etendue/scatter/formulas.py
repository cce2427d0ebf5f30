"""What a BSDF mirrors, and its lobes after ABg, as formulas that files of other programs hold without a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]
Record = dict[str, Any]
Component = dict[str, Any]

REGULAR = ("specular_reflectance", "specular_transmittance")
DIFFUSE = ("diffuse_reflectance", "diffuse_transmittance")

GLASS = (1.0, 1.5)
"""Refractive indices in front and behind: what a surface mirrors between such media and in air alike is its own."""

STEPS = np.arange(0.0, 91.0)
"""Angles of incidence [°] at which the share is asked that a BSDF mirrors."""

ROUNDING = 1e-9
"""Of shares by the core."""

COARSE = 0.01
"""Share of the light that is worth a word."""


def formulas_of(record: Record) -> tuple[Component, ...] | None:
    """A BSDF as a component of specular shares and lobes after ABg; None if it is more than that.

    Parameters
    ----------
    record : dict
        As the core takes it.

    Returns
    -------
    tuple of dict
        In the keys of a scene's finishes: ``{"kind": "mixed", …}`` if something is mirrored or goes straight on, the same at
        all wavelengths, and ``{"kind": "abg", …}`` for each lobe.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scatter.models import Mixture
    >>> polish = Mixture(parts=[{"kind": "mirror"}, {"kind": "abg", "a": 0.01, "b": 0.1, "g": 2}], weights=[0.5, 2])
    >>> mirror, lobe = formulas_of(polish.record(Files()))
    >>> mirror["specular_reflectance"], lobe["a"], lobe["way"]
    (0.5, 0.02, 'reflected')
    """
    lobes: list[Component] = []
    shares: list[list[tuple[Array, Array]]] = [[], []]
    for weight, part in _weighted(record):
        if part["kind"] == "abg" and not part["renormalised"]:
            way = "transmitted" if part["transmitted"] else "reflected"
            keys = {name: float(part[name]) for name in ("b", "g", "aspect")}
            lobes.append({"kind": "abg", "a": weight * float(part["a"]), **keys, "way": way})
            continue
        if part["kind"] != "scatter" or any(part[name]["values"].any() for name in DIFFUSE):
            return None
        for known, name in zip(shares, REGULAR, strict=True):
            values = part[name]["values"]
            if np.ptp(values, axis=1).any():
                return None
            known.append((np.degrees(part[name]["angle"]).round(9), weight * values[:, 0]))
    angle = np.unique(np.concatenate([own for known in shares for own, _ in known])) if any(shares) else np.zeros(1)
    whole = [sum((np.interp(angle, own, values) for own, values in known), np.zeros(angle.size)) for known in shares]
    return (*_mixed(angle, np.array(whole)), *lobes)


def _weighted(record: Record, weight: float = 1.0) -> Iterator[tuple[float, Record]]:
    """The parts of a record, and what each counts."""
    if record["kind"] != "sum":
        yield weight, record
        return
    for own, member in record["members"]:
        yield from _weighted(member, weight * own)


def _mixed(angle: Array, shares: Array) -> list[Component]:
    """Shares of shape (2, angles) as one component; none if all are 0."""
    keys: Component = {
        name: {"angle": angle.tolist(), "values": values.tolist()} if np.ptp(values) else float(values[0])
        for name, values in zip(REGULAR, shares, strict=True)
        if values.any()
    }
    return [{"kind": "mixed", **keys}] if keys else []


def regular_of_any(bsdf: Bsdf, nodes: Array, wavelength: float, last: float) -> tuple[list[Component], list[str]]:
    """What any BSDF mirrors and lets straight on, degree by degree, and what of it no share of the surface alone says.

    Parameters
    ----------
    bsdf : Bsdf
        What is asked, in air.
    nodes : array
        More angles of incidence [°], where shares may have a kink.
    wavelength : float
        In nm.
    last : float
        Angle of incidence [°] from which on shares stay what they are there. With a table that ends there, which readers
        take to go on as it is, more light could leave than arrives if shares alone went on to 90°.

    Returns
    -------
    components, lost
        None or one component; sentences.

    Examples
    --------
    >>> from etendue.scatter.models import Interface, Mirror
    >>> regular_of_any(Mirror(reflectance=0.9), np.zeros(0), 555.0, 90.0)
    ([{'kind': 'mixed', 'specular_reflectance': 0.9}], [])
    >>> regular_of_any(Interface(), np.zeros(0), 555.0, 90.0)[0]
    []
    """
    angle = np.unique(np.concatenate([STEPS, nodes, [last]]))
    ways = (bsdf.regular_reflectance, bsdf.regular_transmittance)
    shares = np.stack([way(angle, wavelength=wavelength) for way in ways])
    between = np.stack([way(angle, wavelength=wavelength, media=GLASS) for way in ways])
    if np.abs(between - shares).max() > ROUNDING:
        return [], ["light that is mirrored or refracted by the media on both sides is not in the file"]
    shares[shares < ROUNDING] = 0.0
    kept = angle <= last
    (at,) = np.flatnonzero(angle == last)
    lost = []
    off = np.abs(shares[:, -1] - shares[:, at])
    if off.max() > COARSE:
        which = int(np.argmax(off))
        what = ("mirrored", "let straight on")[which]
        told = f"{shares[which, at]:.3g} of the light, at 90° {shares[which, -1]:.3g} in truth"
        lost.append(f"beyond {last:g}° of incidence as much is {what} in the file as there: {told}")
    return _mixed(angle[kept], shares[:, kept]), lost
