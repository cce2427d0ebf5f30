"""Light that is mirrored or goes straight on, by angle of incidence, as components of a file state it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

KEYS = ("specular_reflectance", "specular_transmittance")


@dataclasses.dataclass(frozen=True, eq=False)
class Regular:
    """Shares of light that is mirrored and that goes straight on.

    Parameters
    ----------
    angle : array, shape (n,)
        Of incidence [°], rising. Shares are linear in between, and beyond the ends those of the ends.
    shares : array, shape (2, n)
        Mirrored, and straight on.
    """

    angle: Array
    shares: Array

    def at(self, angle: Sequence[float] | Array) -> Array:
        """Shares at other angles [°] of shape (m,), shape (2, m)."""
        return np.stack([np.interp(angle, self.angle, share) for share in self.shares])


def regular_of(components: Iterable[Mapping[str, Any]]) -> Regular | None:
    """What components mirror and let straight on together; None if one of them does more, or has wavelengths.

    Parameters
    ----------
    components : iterable of mapping
        As of `BsdfData`.

    Examples
    --------
    >>> regular_of([{"kind": "mixed", "specular_reflectance": {"angle": [0, 90], "values": [0.0, 0.5]}}]).at([45.0]).tolist()
    [[0.25], [0.0]]
    >>> regular_of([{"kind": "lambertian", "reflectance": 0.5}]) is None
    True
    """
    tables: list[tuple[int, Array, Array]] = []
    for part in components:
        if part["kind"] != "mixed" or not set(part) <= {"kind", *KEYS}:
            return None
        for way, key in enumerate(KEYS):
            value = part.get(key, 0.0)
            if not isinstance(value, Mapping):
                value = {"angle": [0.0], "values": [value]}
            if set(value) != {"angle", "values"}:
                return None
            tables.append((way, np.array(value["angle"], np.float64), np.array(value["values"], np.float64)))
    angle = np.unique(np.concatenate([np.zeros(1), *(angle for _, angle, _ in tables)]))
    shares = np.zeros((2, angle.size))
    for way, own, values in tables:
        shares[way] += np.interp(angle, own, values)
    return Regular(angle, shares)
