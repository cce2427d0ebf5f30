"""The largest of many noisy values, less what chance lifts it by."""

from __future__ import annotations

from statistics import NormalDist
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


ROUNDS = 24
"""After which what is found moves by less than a hundredth of its error."""

SHARE = 0.5
"""Of the values alike that count: nodes of a far field share rays with those beside them, and peaks are round. With it the
peaks of beams of 1 to 20 000 cd and of even light are found within a third of their errors on average, on chosen and on
stated nodes; with all of them they are half an error too low."""

FAR = 60.0
"""Exponent beyond which a value counts as none: e⁻⁶⁰ is below the rounding of a sum of 10⁹."""


class Unlifted(NamedTuple):
    """The largest of values without the lift of chance, and its standard error; NaN where no error is known.

    Examples
    --------
    >>> value, error = Unlifted(500.0, 20.0)
    """

    value: float
    error: float


def unlifted(values: Array, errors: Array, weight: Array) -> Unlifted:
    """The largest value, less what chance lifts the largest of many values by.

    The largest of K values that are as good as equal is too large by m of their standard errors s on average, m being the
    mean of the largest of K normal deviates, Φ⁻¹((K − ⅜)/(K + ¼)) [Blom1958]_. K is counted softly, as the sum of the
    weights of all values, each times exp(−(difference/error)²) with the root mean square of the errors of both. The
    difference is that from what is found, not from the largest value itself, which most of its equals are well below: the
    two equations are solved from the largest value downwards. K is 1 where nothing comes near. Values of smaller errors than
    that of the largest one lift it less: they count with the cube of the ratio of both errors, about as the mean of the
    normal deviates above the largest of the smaller ones falls.

    Of a few values just above very many others it can be too low by as much as their difference.

    Parameters
    ----------
    values, errors : array, of one shape
        The values and their standard errors, in one unit.
    weight : array, of the same shape
        1 for a value with an error of its own, 0 for one between others, 1/n for n that are the same.

    Examples
    --------
    >>> unlifted(np.array([5.0, 1.0]), np.array([0.5, 0.5]), np.ones(2))
    Unlifted(value=5.0, error=0.5)
    >>> round(unlifted(np.full(100, 5.0), np.full(100, 0.5), np.ones(100)).value, 3)
    3.878
    """
    values, errors = values.ravel(), errors.ravel()
    highest = int(values.argmax())
    largest, error = float(values[highest]), float(errors[highest])
    if not error > 0.0:
        return Unlifted(largest, error)
    known = np.nan_to_num(errors)
    scale, weight = 2.0 / (error**2 + known**2), SHARE * weight.ravel() * np.minimum(known / error, 1.0) ** 3
    # The lowest that can be found is as far down as if all values were alike: what is far below that counts nothing.
    lowest = largest - error * _lift(max(float(weight.sum()), 1.0))
    near = scale * np.maximum(lowest - values, 0.0) ** 2 < FAR
    values, scale, weight = values[near], scale[near], weight[near]
    found, alike = largest, 1.0
    for _ in range(ROUNDS):
        alike = max(float((np.exp(-scale * (found - values) ** 2) * weight).sum()), alike)
        # Half of the way, so that one does not pass over the highest solution.
        found += (largest - error * _lift(alike) - found) / 2.0
    return Unlifted(found, error)


def _lift(alike: float) -> float:
    """Mean of the largest of so many normal deviates."""
    return NormalDist().inv_cdf((alike - 0.375) / (alike + 0.25))
