"""Which things in a scene treat some wavelengths differently from others."""

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
