"""Quantiles of values that count by their weights, as those of rays do by their flux."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def weighted_quantile(values: Array, weights: Array, share: float) -> float:
    """The least value, shape (n,), which this share of the weights, shape (n,), does not exceed.

    Examples
    --------
    >>> weighted_quantile(np.array([3.0, 1.0, 2.0]), np.array([1.0, 5.0, 1.0]), 0.5)
    1.0
    >>> weighted_quantile(np.array([3.0, 1.0, 2.0]), np.ones(3), 0.5)
    2.0
    """
    if (weights == weights[0]).all():  # which need not be put into the order of the values, and that takes longest
        summed = np.cumsum(weights)
        rank = min(int(np.searchsorted(summed, share * summed[-1])), len(values) - 1)
        return float(np.partition(values, rank)[rank])
    order = np.argsort(values)
    summed = np.cumsum(weights[order])
    return float(values[order][min(int(np.searchsorted(summed, share * summed[-1])), len(order) - 1)])
