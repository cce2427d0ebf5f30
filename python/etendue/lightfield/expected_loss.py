"""The score that a field loses against the truth, by what it knows of its own errors."""

from __future__ import annotations

import numpy as np

from etendue.lightfield.counting import FloatArray


def loss_of_gamma(certainty: FloatArray) -> FloatArray:
    """E[x ln x] of a gamma variable of mean 1 and shape `certainty`: ψ(k + 1) - ln k, which is 1/2k where k is large.

    That is the loss, per unit of its mass, of a cell whose luminance has a relative variance of 1/k. Half the relative
    variance itself would let dark cells with large error bars, which no ray ever meets, drown all others.

    Examples
    --------
    >>> loss_of_gamma(np.array([0.5, 50.0])).round(4).tolist()  # ψ(3/2) + ln 2, and nearly 1/100
    [0.7296, 0.01]
    """
    k = np.maximum(certainty, 1e-300)
    # ψ(k + 1) = ψ(k + 7) - Σ 1/(k + i), and Stirling's series of ψ is good to 1e-9 from there on.
    y = k + 7.0
    stirling = np.log1p(7.0 / k) - 1.0 / (2.0 * y) - 1.0 / (12.0 * y**2) + 1.0 / (120.0 * y**4)
    losses: FloatArray = np.maximum(stirling - sum(1.0 / (k + i) for i in range(1, 7)), 0.0)
    return losses
