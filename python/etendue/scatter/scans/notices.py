"""What is told of the shares of scans: noise below 0 in them, and light beyond the measured directions."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.formats.bsdf.points import below_zero
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

TOLD = 0.02
"""Share of the light beyond the measured directions from which on it is told, as it is of tables in files."""

FAINT = 1e-4
"""Light that is not worth a word, of that which arrives."""

POINTS = 20_000
"""Of a spiral over the disk of direction cosines."""

ROUNDING = 1e-9
"""Distance in direction cosines by which a point may be outside and counts as inside: rounding of unit vectors."""


def outside(points: Array, at: Array) -> npt.NDArray[np.bool_]:
    """Which points of a plane lie outside the smallest convex polygon around others.

    Parameters
    ----------
    points, at : array, shape (n, 2), (m, 2)
        Those that the polygon is around, and those that are asked for.

    Returns
    -------
    array of bool, shape (m,)
        All True if the points of the polygon lie on a line.

    Examples
    --------
    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [0.4, 0.6]])
    >>> outside(square, np.array([[0.5, 0.5], [1.0, 0.5], [1.1, 0.5], [-0.1, -0.1]])).tolist()
    [False, False, True, True]
    """
    ordered = np.unique(points, axis=0)
    corners = np.array([*_chain(ordered), *_chain(ordered[::-1])])
    if len(corners) < 3:
        return np.ones(len(at), np.bool_)
    found = np.zeros(len(at), np.bool_)
    for corner, following in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along, offset = following - corner, at - corner
        found |= along[0] * offset[:, 1] - along[1] * offset[:, 0] < -ROUNDING * np.hypot(*along)
    return found


def _chain(ordered: Array) -> list[Array]:
    """The corners on one side of ordered points, counter-clockwise, without the last one: a monotone chain."""
    kept: list[Array] = []
    for point in ordered:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-1] - kept[-2], point - kept[-2]
            if ax * by - ay * bx > 0.0:
                break
            kept.pop()
        kept.append(point)
    return kept[:-1]


def even_directions() -> Array:
    """Unit vectors to one side, shape (n, 3), even in direction cosines: each stands for a projected solid angle of π / n.

    Examples
    --------
    >>> to = even_directions()
    >>> bool(abs((to[:, 0] < 0.5).mean() - (2 / 3 + 3**0.5 / 4 / np.pi)) < 1e-3)
    True
    """
    number = np.arange(POINTS) + 0.5
    radius, angle = np.sqrt(number / POINTS), number * (np.pi * (3.0 - np.sqrt(5.0)))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1.0 - number / POINTS)])


class Beyond:
    """The light beyond the measured directions, where f is taken for that of the last: at the incidence where it is most.

    Examples
    --------
    >>> found = Beyond()
    >>> found.note(30.0, 0.5, 0.001), found.told("reflected light")
    (None, [])
    """

    def __init__(self) -> None:
        self.most: tuple[float, float, float] | None = None
        """Angle of incidence [°], the share of all light there, and that of light beyond the measured directions."""

    def note(self, theta: float, share: float, beyond: float) -> None:
        """The share at an incidence, and what of it lies beyond the measured directions."""
        if beyond > max(TOLD * share, FAINT) and (self.most is None or beyond > self.most[2]):
            self.most = theta, share, beyond

    def told(self, way: str) -> list[Complaint]:
        """What is told of it."""
        if self.most is None:
            return []
        theta, share, beyond = self.most
        found = (
            f"of the {share:.4g} of the light that the scans add up to, {beyond:.4g} lies beyond the measured directions, "
            "where f is taken for that of the last: the share is as uncertain as that"
        )
        return [Complaint("warning", f"{way}, {theta:.3g}° of incidence", found)]


class BelowZero:
    """What values below 0 do to the shares: at the incidence where it is most.

    Examples
    --------
    >>> below = BelowZero()
    >>> below.note(30.0, 0.01, 0.02)
    >>> print(*below.told(np.array([0.3, -0.1]), "reflected light"))  # doctest: +ELLIPSIS
    note: reflected light: 1 of 2 below 0, ... at 30° of incidence it is 0.01, and would be 0.02 if they were 0
    """

    def __init__(self) -> None:
        self.most: tuple[float, float, float] | None = None

    def note(self, theta: float, share: float, lifted: float) -> None:
        """The share at an incidence, and what it would be if values below 0 were 0."""
        if self.most is None or lifted - share > self.most[2] - self.most[1]:
            self.most = theta, share, lifted

    def told(self, values: Array, place: str) -> list[Complaint]:
        """How many they are, and their light."""
        found = below_zero(values, place)
        if self.most is not None:
            theta, share, lifted = self.most
            more = f": at {theta:.3g}° of incidence it is {share:.4g}, and would be {lifted:.4g} if they were 0"
            found = [dataclasses.replace(one, found=one.found + more) for one in found]
        return found
