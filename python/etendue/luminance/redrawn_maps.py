"""Maps drawn anew: what else a map might have been, whose noise is known."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PURPOSE = 0x5245_4452
"""Keeps these random numbers apart from all others."""

MANY = 1e6
"""Rays beyond which their number is as good as normally distributed: its skewness is below 0.001."""


def redrawn(known: Array, value: Array, error: Array, times: int) -> Iterator[Array]:
    """Maps of the luminances `known` with noise like that of another map, always the same ones.

    Parameters
    ----------
    known : array, shape (rows, columns)
        What is drawn about; pixels not above 0 stay as they are, but for those of the last kind below.
    value, error : array, shape (rows, columns)
        The map whose noise it is and its standard errors, 0 or NaN where it has none, which is not so everywhere. A pixel
        is taken for the sum of a Poisson number of rays that contribute σ²/f each; where it has none, they are those of
        the whole map, Σσ²/Σf. A pixel with a value and an error of 0 or NaN stays as it is in `known`; one with an error and
        a value not above 0 errs normally.
    times : int
        How many.

    Examples
    --------
    >>> f, sigma = np.full((50, 50), 9.0), np.full((50, 50), 3.0)
    >>> (again,) = redrawn(np.full((50, 50), 4.0), f, sigma, 1)
    >>> round(float(again.mean())), round(float(again.var())), np.unique(again)[:3].tolist()
    (4, 4, [0.0, 1.0, 2.0])
    """
    noisy = (value > 0.0) & (error > 0.0)
    # Of one scale, so that no square leaves the range of numbers.
    scale = float(value[noisy].max())
    f, sigma = np.where(noisy, value / scale, 1.0), np.where(noisy, error / scale, 0.0)
    common = float((sigma**2).sum() / f[noisy].sum())
    ray = scale * np.where(noisy, sigma**2 / f, np.where(value == 0.0, common, 0.0))
    drawn = (known > 0.0) & (ray > 0.0)
    expected = np.divide(known, ray, out=np.zeros_like(known), where=drawn)
    few = drawn & (expected < MANY)
    many = drawn & ~few
    plain = (error > 0.0) & ~(value > 0.0)
    generator = np.random.Generator(np.random.Philox(key=PURPOSE))
    for _ in range(times):
        again = known.copy()
        again[few] = ray[few] * generator.poisson(expected[few])
        again[many] = ray[many] * generator.normal(expected[many], np.sqrt(expected[many]))
        again[plain] = generator.normal(known[plain], error[plain])
        yield again
