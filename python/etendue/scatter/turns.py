"""Azimuths of incidence at which an anisotropic BSDF is tabled: as close as a table that is linear between them asks for."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_directions import NORMAL, light_from

Array = npt.NDArray[np.float64]
Evaluate = Callable[[Array, Array], Array]
"""Of an incident direction, shape (3,), and scattered ones, shape (n, 3): f [1/sr], shape (n,)."""

STEP = 45.0
"""Between the first azimuths [°]."""

TOLERANCE = 0.05
"""Part of the light by which f in the middle between two azimuths may be off the mean of both."""

MOST, LEAST, MOST_SLICES = 64, 8, 1024
"""Azimuths at most and at least, and tables of one incidence each: 1024 of these are some hundred megabytes of text."""

RADII = np.concatenate([[0.0], np.geomspace(2e-3, 2.0, 48)])
AROUND = 72
"""Directions about the specular one, in direction cosines, at which f is compared."""


@dataclasses.dataclass(frozen=True)
class Turns:
    """Where a BSDF is tabled.

    Parameters
    ----------
    azimuths : tuple of float
        To where the light goes [°], in order.
    off : float
        The largest part of the light by which f in the middle of two of them is off the mean of both.

    Examples
    --------
    >>> Turns((0.0, 90.0, 180.0, 270.0), 0.01).off
    0.01
    """

    azimuths: tuple[float, ...]
    off: float


def turns_of(
    evaluate: Evaluate, incidences: Sequence[float], ways: Sequence[bool], known: Sequence[float] = (), most: int = MOST
) -> Turns:
    """Azimuths that are halved where f between two is not the mean of both, turned with the plane of incidence.

    Parameters
    ----------
    evaluate : callable
        f of an incident and of scattered directions.
    incidences : sequence of float
        Angles of incidence [°] of the table; up to three of them are looked at.
    ways : sequence of bool
        Whether reflected (False) or transmitted light (True) is in it.
    known : sequence of float
        Azimuths [°] at which f is known, where it is a table itself: the first ones.
    most : int
        Azimuths at most. If they do not suffice the worst gaps are halved.

    Examples
    --------
    >>> across = lambda i, s: np.exp(-50.0 * (s[:, 0] + i[0]) ** 2 - 200.0 * (s[:, 1] + i[1]) ** 2)
    >>> found = turns_of(across, [30.0], [False])
    >>> len(found.azimuths), found.off < TOLERANCE
    (32, True)
    """
    first = sorted({round(float(turn) % 360.0, 6) % 360.0 for turn in known})
    first = first if len(first) > 1 else np.arange(0.0, 360.0, STEP).tolist()
    oblique = [theta for theta in incidences if theta >= NORMAL]
    if not oblique:
        return Turns(tuple(first), 0.0)
    chosen = sorted({oblique[len(oblique) * k // 4] for k in (1, 2, 3)})
    kept: dict[float, Array] = {}

    def at(turn: float) -> Array:
        if turn not in kept:
            kept[turn] = np.stack(
                [_about(evaluate, theta, turn, way) for theta, way in itertools.product(chosen, ways)]
            )
        return kept[turn]

    def off(low: float, high: float) -> float:
        middle = at(0.5 * (low + high) % 360.0)
        apart = np.abs(middle - 0.5 * (at(low % 360.0) + at(high % 360.0))).sum(axis=1)
        light = np.abs(middle).sum(axis=1)
        return float(np.max(np.divide(apart, light, out=np.zeros_like(apart), where=light > 0.0)))

    gaps = [(off(low, high), low, high) for low, high in itertools.pairwise([*first, first[0] + 360.0])]
    while len(gaps) < most:
        worst = max(gaps)
        if worst[0] <= TOLERANCE:
            break
        gaps.remove(worst)
        _, low, high = worst
        middle = 0.5 * (low + high)
        gaps += [(off(low, middle), low, middle), (off(middle, high), middle, high)]
    return Turns(tuple(sorted(round(low % 360.0, 9) for _, low, _ in gaps)), max(gaps)[0])


def _about(evaluate: Evaluate, theta: float, turn: float, transmitted: bool) -> Array:
    """F about the specular direction of light that goes on towards an azimuth, times what each place stands for."""
    incident = light_from(theta, (180.0 + turn) % 360.0)
    angle = np.radians(turn + np.arange(AROUND) * (360.0 / AROUND))
    off = RADII[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    beta = (off - incident[:2]).reshape(-1, 2)
    square = 1.0 - np.sum(beta * beta, axis=1)
    there = square > 0.0
    height = np.sqrt(square[there]) * (-1.0 if transmitted else 1.0)
    part = np.broadcast_to((np.gradient(RADII) * RADII)[:, None], (RADII.size, AROUND)).ravel()
    found = np.zeros(len(beta))
    found[there] = evaluate(incident, np.column_stack([beta[there], height])) * part[there]
    return found
