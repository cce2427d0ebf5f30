"""Scans through the specular direction: the azimuths about it at which values lie."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.scans.scans import Scans

Array = npt.NDArray[np.float64]

ON_ARM = 2.5
"""Azimuths about the specular direction that differ by less belong to one scan [°]."""

MOST_ARMS = 72
"""Azimuths about the specular direction that still are scans through it."""

AT_CENTRE = 0.05
"""Angle from the specular direction below which a value is that of the specular direction [°]."""


def apart(a: Array, b: float) -> Array:
    """By how much azimuths differ from another one [°], at most 180.

    Examples
    --------
    >>> apart(np.array([350.0, 90.0]), 10.0).tolist()
    [20.0, 80.0]
    """
    return np.asarray(np.abs((a - b + 180.0) % 360.0 - 180.0))


def arms_of(r: Array, a: Array) -> Array:
    """Azimuths of scans [°] in order, with their mirror images if they lie on one side of the plane of incidence.

    Parameters
    ----------
    r, a : array, shape (n,)
        Angles from the specular direction and azimuths about it [°], of values beside it.

    Raises
    ------
    ArgumentError
        If there are fewer than two values, or they lie at one azimuth, or at more than `MOST_ARMS`.

    Examples
    --------
    >>> arms_of(np.array([10.0, 20.0, 10.0]), np.array([0.0, 1.0, 180.0])).tolist()
    [1.0, 180.0]
    """
    if r.size < 2:
        raise ArgumentError("fewer than two values beside the specular direction: nothing to interpolate")
    found = azimuths_of(r, a)
    if not 2 <= len(found) <= MOST_ARMS:
        raise ArgumentError(
            f"the values lie at {_counted(len(found))} about the specular direction; this method takes scans through it"
        )
    return np.array(sorted(found))


def _counted(azimuths: int) -> str:
    return f"{azimuths} azimuths" if azimuths > 1 else "one azimuth"


def azimuths_of(r: Array, a: Array) -> list[float]:
    """All azimuths [°] that differ by `ON_ARM`; with mirror images, if all lie on one side of the plane of incidence.

    Parameters
    ----------
    r, a : array, shape (n,)
        As of `arms_of`; azimuths of values far out count, since they are known best.

    Examples
    --------
    >>> azimuths_of(np.array([10.0, 20.0]), np.array([90.0, 91.0]))
    [91.0, 269.0]
    """
    one_side = any((apart(a, middle) < 90.0 + ON_ARM).all() for middle in (90.0, 270.0))
    found: list[float] = []
    for azimuth in a[np.argsort(-r)].tolist():
        for each in (azimuth % 360.0, -azimuth % 360.0)[: 2 if one_side else 1]:
            if all(apart(np.array(each), other) >= ON_ARM for other in found):
                found.append(each)
    return found


def beside(scans: Scans, incident: Array, own: npt.NDArray[np.intp]) -> tuple[Array, Array]:
    """Coordinates about the specular direction of the values of one incidence that lie beside it.

    Parameters
    ----------
    scans : Scans
        All incidences.
    incident, own
        One of `Scans.by_incidence`.

    Returns
    -------
    array, array
        Angles from the specular direction and azimuths about it [°].

    Examples
    --------
    >>> scans = Scans([[0, 0, 1]] * 2, [[0, 0, 1], [0, 0.5, 0.75**0.5]], [0.2, 0.1])
    >>> [one.round(6).tolist() for one in beside(scans, *scans.by_incidence()[0])]
    [[30.0], [90.0]]
    """
    frame = PolarGrid("specular", np.zeros(1), np.zeros(1))
    r, a = frame.coordinates(scans.scattered[own], incident, transmitted=False)
    return r[r >= AT_CENTRE], a[r >= AT_CENTRE]
