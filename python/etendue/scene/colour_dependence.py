"""Which things in a scene treat some wavelengths differently from others, and which of their tables end before the light."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scatter.members import parts_of
from etendue.scene.media import Sellmeier

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

SAME = 1e-9
"""Values that differ by less, of a quantity of the order of 1, are taken for equal."""

VISIBLE = np.arange(380.0, 781.0)
"""Wavelengths [nm] at which things are compared where those of the light are not known."""

TOLD_BEYOND = 1e-3
"""Share of the light of a source beyond the ends of a table from which on it is told."""


def telling_media(rows: Sequence[Record], names: Sequence[str], wavelength: Array) -> Iterator[str]:
    """Media whose index or absorption differs between some wavelengths [nm], by what differs.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scene.media_library import MEDIA
    >>> rows = [MEDIA[name].medium.record(Files()) for name in ("air", "BK7")]
    >>> list(telling_media(rows, ["air", "BK7"], np.array([450.0, 633.0])))
    ["the index of 'BK7'"]
    """
    for row, name in zip(rows, names, strict=True):
        if _differs(index_of(row["index"], wavelength)):
            yield f"the index of {name!r}"
        yield from telling_absorption([row], [name], wavelength)


def telling_absorption(rows: Sequence[Record], names: Sequence[str], wavelength: Array) -> Iterator[str]:
    """The same of absorption alone.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scene.media import Medium
    >>> dye = Medium(index=1.33, absorption={"wavelength": [400, 700], "values": [0.2, 0.0]}).record(Files())
    >>> list(telling_absorption([dye], ["dye"], np.array([450.0, 633.0])))
    ["the absorption of 'dye'"]
    """
    for row, name in zip(rows, names, strict=True):
        absorption = row["absorption"]
        if _differs(np.interp(wavelength, absorption["wavelength"], absorption["per_mm"])):
            yield f"the absorption of {name!r}"


def telling_finishes(rows: Sequence[Record], names: Sequence[str], wavelength: Array) -> Iterator[str]:
    """Finishes of which some share differs between some wavelengths [nm].

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scene.finishes import Transmitter
    >>> row = Transmitter(transmittance={"wavelength": [400, 700], "values": [0.1, 0.9]}).record(Files())
    >>> list(telling_finishes([row], ["filter"], np.array([450.0, 633.0])))
    ["the finish 'filter'"]
    """
    for row, name in zip(rows, names, strict=True):
        if any(_tells(part, wavelength) for part in parts_of(row)):
            yield f"the finish {name!r}"


def told_beyond(rows: Mapping[str, Sequence[Record]], names: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """What of the light of sources has wavelengths at which tables of media and finishes do not say anything.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scene.media import Medium
    >>> glass = Medium(table={"wavelength": [450, 650], "values": [1.53, 1.51]}).record(Files())
    >>> lamp = {"wavelengths": np.array([405.0, 550.0]), "shares": np.array([0.25, 0.75])}
    >>> rows = {"media": [glass], "finishes": [], "sources": [lamp]}
    >>> print(*told_beyond(rows, {"media": ["glass"], "finishes": [], "sources": ["lamp"]}))
    the index of 'glass' is known from 450 to 650 nm; its last value is taken for 0.25 of the light of 'lamp', as at 405 nm
    """
    tables = [
        *(found for row, name in zip(rows["media"], names["media"], strict=True) for found in _of_medium(row, name)),
        *(
            found
            for row, name in zip(rows["finishes"], names["finishes"], strict=True)
            for found in _of_finish(row, name)
        ),
    ]
    for what, low, high in dict.fromkeys(tables):
        beyond = [(at["wavelengths"] < low) | (at["wavelengths"] > high) for at in rows["sources"]]
        shares = [float(at["shares"][out].sum()) for at, out in zip(rows["sources"], beyond, strict=True)]
        if max(shares, default=0.0) > TOLD_BEYOND:
            most = int(np.argmax(shares))
            source = rows["sources"][most]
            at = source["wavelengths"][np.argmax(np.where(beyond[most], source["shares"], -1.0))]
            yield (
                f"{what} is known from {low:g} to {high:g} nm; its last value is taken for {shares[most]:.3g} of the "
                f"light of {names['sources'][most]!r}, as at {at:g} nm"
            )


def _of_medium(row: Record, name: str) -> Iterator[tuple[str, float, float]]:
    """What of a medium is a table that is not the same everywhere, and between which wavelengths [nm]."""
    index, absorption = row["index"], row["absorption"]
    if index["kind"] == "table" and _differs(index["n"]):
        yield f"the index of {name!r}", float(index["wavelength"][0]), float(index["wavelength"][-1])
    if _differs(absorption["per_mm"]):
        yield f"the absorption of {name!r}", float(absorption["wavelength"][0]), float(absorption["wavelength"][-1])


def _of_finish(row: Record, name: str) -> Iterator[tuple[str, float, float]]:
    """The same of the shares of a finish."""
    for part in parts_of(row):
        if part["kind"] == "table":
            known = [
                at for at in ([of["wavelength"] for of in part[side]] for side in ("front", "back")) if len(at) > 1
            ]
        else:
            tables = [value for value in part.values() if isinstance(value, Mapping) and "values" in value]
            known = [t["wavelength"] for t in tables if any(map(_differs, np.asarray(t["values"])))]
        for at in known:
            yield f"the finish {name!r}", float(at[0]), float(at[-1])


def _tells(part: Record, wavelength: Array) -> bool:
    """Whether a finish that is no sum of others differs between some wavelengths."""
    if part["kind"] == "table":
        known = [[of["wavelength"] for of in part[side]] for side in ("front", "back")]
        # Linear between the wavelengths of its slices, constant beyond.
        return any(len(at) > 1 and _differs(np.clip(wavelength, at[0], at[-1])) for at in known)
    tables = [value for value in part.values() if isinstance(value, Mapping) and "values" in value]
    shares = (np.interp(wavelength, t["wavelength"], values) for t in tables for values in np.asarray(t["values"]))
    return any(map(_differs, shares))


def index_of(index: Record, wavelength: Array) -> Array:
    """The refractive index of a medium, as the core takes it, at some wavelengths [nm].

    Examples
    --------
    >>> index_of({"kind": "constant", "n": 1.5}, np.array([450.0, 633.0]))
    array([1.5, 1.5])
    """
    if index["kind"] == "sellmeier":
        return Sellmeier(b=index["b"], c=index["c"]).index(wavelength)
    if index["kind"] == "table":
        return np.interp(wavelength, index["wavelength"], index["n"])
    return np.full(wavelength.shape, index["n"])


def _differs(values: Array) -> bool:
    return bool(np.ptp(values) > SAME)
