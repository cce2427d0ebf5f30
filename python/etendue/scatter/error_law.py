"""How standard errors of measured values depend on the values, so that a fit can take them at the model instead."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.intp]

CLOSE = 0.2
"""Spread of ln σ² about the law above which it is none."""

FLAT = 0.1
"""Exponent below which errors do not depend on the values."""

ENOUGH = 5
"""Values above 0 that a law is found from at least."""


@dataclasses.dataclass(frozen=True, eq=False)
class ErrorLaw:
    """σ² = c(incidence) · value^k · |cosθₛ|^m: counts have k = 1 and m = −1, relative errors k = 2.

    Parameters
    ----------
    exponent : float
        k.
    rest : array, shape (n,)
        ln σ² of each value less k ln value.

    Examples
    --------
    >>> ErrorLaw(1.0, np.zeros(2)).at(np.array([4.0, 9.0])).round(9).tolist()
    [2.0, 3.0]
    """

    exponent: float
    rest: Array

    def at(self, values: Array) -> Array:
        """σ if these were the true values, shape (n,); they are above 0."""
        return np.asarray(np.exp(0.5 * (self.exponent * np.log(values) + self.rest)))


def error_law(values: Array, errors: Array, cosines: Array, incidence: Integers) -> ErrorLaw | None:
    """The law that standard errors follow, if they rise with the values and follow one.

    An error that was taken from the value itself, as the square root of a count, is small where the value is low by chance.
    Weights made of it prefer low values: of counts about 10 the mean comes out 10 % low (Neyman's χ²).

    Parameters
    ----------
    values, errors : array, shape (n,)
        Errors above 0; values of 0 follow the law of the others.
    cosines : array, shape (n,)
        |cosθₛ|.
    incidence : array of int, shape (n,)
        Which scan a value belongs to: each may have been counted as long as it liked.

    Examples
    --------
    >>> counts = np.array([7.0, 12.0, 9.0, 14.0, 10.0, 8.0])
    >>> law = error_law(counts, np.sqrt(counts), np.ones(6), np.zeros(6, int))
    >>> round(law.exponent, 6), law.at(np.full(6, 9.0)).round(6).tolist()[:2]
    (1.0, [3.0, 3.0])
    """
    lit = values > 0.0
    if lit.sum() < ENOUGH:
        return None
    members = (incidence[:, None] == np.unique(incidence)).astype(np.float64)
    others = np.column_stack([np.log(np.maximum(cosines, 1e-9)), members])
    # A scan without any value above 0 has no law of its own.
    if not members[lit].any(axis=0).all():
        return None
    known = np.column_stack([np.log(values[lit]), others[lit]])
    wanted = 2.0 * np.log(errors[lit])
    found = np.linalg.lstsq(known, wanted, rcond=1e-9)[0]
    off = wanted - known @ found
    if off.std() > CLOSE or found[0] < FLAT:
        return None
    rest = others @ found[1:]
    rest[lit] += off
    return ErrorLaw(float(found[0]), rest)
