"""The base of a table: what leaves a side of a surface with one distribution, wherever the light came from.

f of it is a(incident) l(scattered)/π. Paint under a clear coat sends out such light, and matt surfaces little else. It does
not move with the specular direction as a lobe does, so it is taken off the slices before they are interpolated; and patches
of a scene can know it (see "gather" in docs/tracing.md). The most of this form that f is nowhere less than is a problem of
the kind of nonnegative underapproximation [GillisGlineur2010]; with l known the greatest a follow and with a the greatest l,
so a few are tried.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_slice import BsdfSlice

Array = npt.NDArray[np.float64]

RINGS = 128
"""About the normal, by even steps of the cosine."""

WITHIN = 2
"""Parts of a ring, at whose edges f is asked for."""

AROUND = 36
"""Directions around the normal at which f is asked for."""

FEW = 2
"""Of these, as many as do not decide what is in the base: a hole in a measurement."""

SPAN = 0.5
"""How far the specular direction has to move between slices, in direction cosines, before what stays can be told from it."""

CLEARLY = 1.02
"""By how much more than a Lambertian base another one has to be."""

STEPS = 4.0
"""Shares in the base of neighbouring incidences differ by this factor at most."""

FAINT = 0.02
"""Part of the greatest l below which it is 0."""

ENOUGH = 0.02
"""Part of the light of a slice below which a base is not worth having."""

PARTS = (0.1, 0.25, 0.5, 0.75)
"""Of the directions, below whose f a try begins."""


@dataclasses.dataclass(frozen=True, eq=False)
class Base:
    """How a base leaves.

    Parameters
    ----------
    luminances : array, shape (n,)
        l, over that of Lambertian light of the same flux, at cosines of the angle from the normal that fall evenly from 1 to
        0; none: 1 throughout.

    Examples
    --------
    >>> Base(np.array([1.5, 0.0])).at(np.sqrt([1.0, 0.5, 0.0])).round(6).tolist()
    [1.5, 0.75, 0.0]
    """

    luminances: Array = dataclasses.field(default_factory=lambda: np.ones(0))

    def at(self, cosine: Array) -> Array:
        """The luminance l by the cosine of the angle from the normal, of any shape; linear in its square between those."""
        if not self.luminances.size:
            return np.ones(np.shape(cosine))
        edges = np.linspace(1.0, 0.0, self.luminances.size)
        return np.interp(1.0 - np.square(cosine), 1.0 - edges**2, self.luminances)


def base_of(slices: Sequence[BsdfSlice]) -> Base:
    """The base of slices on grids whose light leaves on the same side.

    Parameters
    ----------
    slices : sequence of BsdfSlice
        Of any incidences, wavelengths and ways. Those of single points are left out, as points say little of rings. Where
        incidences lie close together a lobe about the specular direction looks like a base; then the base is Lambertian.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.quantities.polar_grid import PolarGrid
    >>> grid = PolarGrid("normal", [0.0, 45.0, 90.0], [0.0])
    >>> falling = [BsdfSlice(direction(theta, 0.0), [[0.3, 0.2, 0.0]], grid=grid) for theta in (0.0, 50.0)]
    >>> base = base_of(falling)
    >>> [round(float(base.at(np.array(cosine)) / base.at(np.array(1.0))), 2) for cosine in (1.0, 0.7, 0.1)]
    [1.0, 0.67, 0.09]
    """
    known = [one for one in slices if one.grid is not None and not np.isnan(one.values).all()]
    if np.ptp([math.sin(math.radians(one.theta)) for one in known] or [0.0]) < SPAN:
        return Base()
    least = np.array([_least(one) for one in known])
    squares = _squares(1)
    areas = 0.5 * (np.diff(squares, prepend=0.0) + np.diff(squares, append=1.0))
    lambertian = float(least.min(axis=1).sum())
    amount, leaving = _split(least, areas)
    return Base() if amount <= CLEARLY * lambertian else Base(leaving / float(areas @ leaving))


def _squares(parts: int) -> Array:
    """Squares of the sines at the edges of rings, or of so many parts of each."""
    return 1.0 - np.linspace(1.0, 0.0, RINGS * parts + 1) ** 2


def _least(one: BsdfSlice) -> Array:
    """A function of the angle from the normal, linear between the edges of rings, that is nowhere more than f of a slice."""
    squares = _squares(WITHIN)
    turn = np.arctan2(one.incident[1], one.incident[0]) + np.arange(AROUND) * (2.0 * np.pi / AROUND)
    sine = np.sqrt(squares)[:, None]
    height = np.sqrt(1.0 - squares)[:, None] * (1.0 if one.front != one.transmitted else -1.0)
    around = [sine * np.cos(turn), sine * np.sin(turn), np.broadcast_to(height, (squares.size, AROUND))]
    f = np.maximum(np.partition(one.at(np.stack(around, axis=-1)), FEW, axis=1)[:, FEW], 0.0)
    at_edges = f[::WITHIN]
    line = np.interp(squares, squares[::WITHIN], at_edges)
    # Where f falls steeply within a ring, less at both of its edges.
    part = np.divide(f, line, out=np.ones_like(f), where=line > 0.0)[:-1].reshape(RINGS, WITHIN).min(axis=1)
    part = np.minimum(part, 1.0)
    return np.asarray(at_edges * np.minimum(np.append(part, 1.0), np.append(1.0, part)))


def _split(least: Array, areas: Array) -> tuple[float, Array]:
    """The best l of some tries, shape (RINGS + 1,), and the sum of the shares a that go with it, over π.

    A try begins with an a that is what f is in most directions, and leaves those slices out that have least light where
    there is least of it: their a follows from l.
    """
    best, found = 0.0, np.ones(RINGS + 1)
    for part in PARTS:
        typical = np.array([_exceeded(f, areas, part) for f in least])
        lit = least[typical > 0.0] / typical[typical > 0.0, None]
        ordered = lit[np.argsort(-lit.min(axis=1), kind="stable")]
        kept = len(ordered)
        while kept:
            leaving = _smoother(ordered[:kept].min(axis=0))
            there = leaving > 0.0
            mean = float(leaving @ areas)
            if mean > 0.0:
                amount = mean * float((least[:, there] / leaving[there]).min(axis=1).sum())
                if amount > best:
                    best, found = amount, leaving
            kept = kept * 3 // 4
    return best, found


def _smoother(values: Array) -> Array:
    """Without dips of single values, which grids of slices could not show: a closing in the sense of morphology [Serra1982].

    And without the last value before there is nothing: within this ring, where f ends, it may be less than a straight line.
    """
    padded = np.pad(values, 2, mode="edge")
    raised = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    closed = np.pad(np.minimum(np.minimum(raised[:-2], raised[1:-1]), raised[2:]), 1, mode="edge")
    least = np.minimum(np.minimum(closed[:-2], closed[1:-1]), closed[2:])
    return np.asarray(np.where(least < FAINT * closed.max(), 0.0, closed[1:-1]))


def _exceeded(f: Array, areas: Array, part: float) -> float:
    """What f is more than in all but this part of the directions."""
    order = np.argsort(f, kind="stable")
    return float(f[order[np.searchsorted(np.cumsum(areas[order]), part)]])


def share_in(f: Array, leaving: Array, share: float) -> float:
    """The greatest share a of the flux for which a l/π is nowhere more than f, and 0 where that is next to nothing.

    Parameters
    ----------
    f, leaving : array, of the same shape
        f [1/sr], NaN where there is none; and l.
    share : float
        All of it.

    Examples
    --------
    >>> round(share_in(np.array([0.2, 0.1, np.nan]) / np.pi, np.array([1.0, 0.25, 1.0]), 0.3), 6)
    0.2
    """
    there = ~np.isnan(f) & (leaving > 0.0)
    least = float((np.pi * f[there] / leaving[there]).min()) if there.any() else 0.0
    return 0.0 if least < ENOUGH * share else min(least, share)


def even_out(shares: Sequence[float]) -> list[float]:
    """Shares in the base of slices that are interpolated together, none more than `STEPS` times that of its neighbour.

    Beside a slice with a large hole is none: what is diffuse of it is in its lobe, and a mean of lobes with and without it
    is neither.

    Examples
    --------
    >>> even_out([0.5, 0.4, 0.05, 0.0]), even_out([0.5, 0.4, 0.05, 0.02])
    ([0.0, 0.0, 0.0, 0.0], [0.5, 0.2, 0.05, 0.02])
    """
    found = list(shares)
    for order in (range(1, len(found)), range(len(found) - 2, -1, -1)):
        for k in order:
            found[k] = min(found[k], STEPS * found[k - order.step])
    return found
