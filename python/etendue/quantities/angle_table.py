"""Tables over C and γ that stand for bilinear functions: gaps of planes, integrals, and where a function is not linear."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ROUNDING = 1e-9
"""Degrees by which γ may lie outside a table and still belong to its edge, and share of the largest value by which a
function may leave a straight line and still be one: both are computed."""


def gaps_of(c: Array) -> Array:
    """Degrees from each plane to the next one, around the circle.

    Examples
    --------
    >>> gaps_of(np.array([0.0, 90.0, 270.0])).tolist()
    [90.0, 180.0, 90.0]
    """
    return np.append(np.diff(c), 360.0 - (c[-1] - c[0]))


def kinks_along(gamma: Array, values: Array) -> npt.NDArray[np.bool_]:
    """Where values, shape (rows, n_gamma), are not linear across a node γ [°]; the ends, and what stands twice, count.

    Examples
    --------
    >>> kinks_along(np.array([0.0, 1, 2, 3]), np.array([[4.0, 3, 2, 0]])).tolist()
    [[True, False, True, True]]
    """
    width = np.diff(gamma)
    slope = np.divide(np.diff(values, axis=1), width, out=np.zeros_like(values[:, 1:]), where=width > 0.0)
    narrow = np.minimum(width[1:], width[:-1])
    kinks = np.ones(values.shape, dtype=np.bool_)
    limit = ROUNDING * float(np.abs(values).max())
    kinks[:, 1:-1] = (np.abs(np.diff(slope, axis=1)) * narrow > limit) | (narrow == 0.0)
    return kinks


def kinks_around(c: Array, values: Array) -> npt.NDArray[np.bool_]:
    """Where values are not linear in C across a plane, shape (n_c, n_gamma), around the circle.

    Examples
    --------
    >>> kinks_around(np.array([0.0, 90, 180, 270]), np.array([[1.0, 0], [1, 1], [1, 2], [1, 1]])).T.tolist()
    [[False, False, False, False], [True, False, True, False]]
    """
    gaps = gaps_of(c)[:, None]
    rise = (np.roll(values, -1, axis=0) - values) / gaps
    bend = np.abs(rise - np.roll(rise, 1, axis=0)) * np.minimum(gaps, np.roll(gaps, 1, axis=0))
    return np.asarray(bend > ROUNDING * float(np.abs(values).max()))


def hat_integrals(gamma: Array) -> Array:
    """∫ (hat function of the node) sin γ dγ for nodes γ [°], in closed form: with 2π, solid angles.

    Examples
    --------
    >>> round(float(hat_integrals(np.array([0.0, 40.0, 180.0])).sum()), 12)
    2.0
    """
    before, after = hat_halves(gamma)
    weights = np.zeros(gamma.size)
    weights[:-1] += before
    weights[1:] += after
    return weights


def hat_halves(gamma: Array) -> tuple[Array, Array]:
    """The same over each interval between nodes by itself: of the hat of the node before it, and of the one after it.

    Examples
    --------
    >>> [round(float(part.sum()), 12) for part in hat_halves(np.array([0.0, 90.0, 180.0]))]
    [1.0, 1.0]
    """
    gamma = np.radians(gamma)
    half, middle = np.diff(gamma) / 2.0, (gamma[1:] + gamma[:-1]) / 2.0
    even = np.sin(middle) * np.sin(half)
    # cos h − sin h / h, whose two terms are equal to rounding for the smallest steps: its series below 0.01.
    square = half * half
    slope = np.where(half < 0.01, -square / 3.0 * (1.0 - square / 10.0), np.cos(half) - np.sin(half) / half)
    odd = np.cos(middle) * slope
    return even + odd, even - odd


@functools.lru_cache(maxsize=32)
def even_hats(size: int) -> tuple[Array, Array]:
    """`hat_integrals` of so many even steps of γ, and of hats half as wide at the same nodes; nobody can write to them.

    Examples
    --------
    >>> wide, narrow = even_hats(90)
    >>> wide.shape, round(float((narrow[1:-1] / wide[1:-1]).max()), 3)
    ((91,), 0.5)
    """
    wide, narrow = (hat_integrals(np.linspace(0.0, 180.0, n * size + 1))[::n] for n in (1, 2))
    for values in (wide, narrow):
        values.flags.writeable = False
    return wide, narrow
