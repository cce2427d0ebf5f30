"""Error bars of a smoothed image, calibrated where the truth is known: on counts drawn from an image much like it."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from etendue.denoising.estimates import Estimates, Estimator
from etendue.denoising.fourier_plane import Array, blurred
from etendue.denoising.mixture import Mixture

PURPOSE = 0x5452_4941
"""Keeps the random numbers of the trial apart from all others."""

ROUNDS = 60
"""Steps of the fit, whose objective falls with each."""

MOST_CELLS = 1 << 17
"""More cells than these are sampled evenly for the fit."""


def variance_of_mixture(
    estimator: Estimator, found: Estimates, mixture: Mixture, mass: Array, shifts: int, pool: Executor
) -> Array:
    """Mean square error of each cell's mass, given the total.

    Counts are drawn from a known image, the estimate is made again from them, and its squared errors are explained by
    what it knows of itself: theory eq. 36. The known image lies halfway between the estimate and the estimate of that
    estimate: the first still has wiggles that are only noise, the second has lost some that are not.

    The fewer rays a cell holds, the more structure leaves no trace in the estimate, and so none in the known image: then
    half of the squared difference of the two is added.
    """
    total, quantum = float(mass.sum()), estimator.quantum
    smoother = mixture.mass(estimator(mass, mass * quantum, max(1, shifts // 4), pool), total)
    known = (mass + smoother) / 2
    generator = np.random.Generator(np.random.Philox(key=PURPOSE))
    drawn = generator.poisson(known / quantum) * quantum
    again = estimator(drawn, drawn * quantum, max(1, shifts // 2), pool)
    retried = mixture.mass(again, total)
    cells = np.flatnonzero(estimator.supported)
    cells = cells[:: -(-len(cells) // MOST_CELLS)]
    indicators = np.array([s.ravel()[cells] for s in _indicators(estimator, again, retried)])
    squares = ((retried - known) ** 2).ravel()[cells]
    factors = fitted_factors(indicators, squares)
    factors *= _stretch(squares / (factors @ indicators + np.finfo(np.float64).tiny))
    variance: Array = np.einsum("k,k...->...", factors, _indicators(estimator, found, mass))
    typical = float((mass**2).sum()) / total
    return variance + _around((mass - smoother) ** 2, 1.5) / (2 * (1 + typical))


def fitted_factors(indicators: Array, squares: Array) -> Array:
    """Factors b ≥ 0 that maximise the likelihood of errors ~ N(0, Σ b_k s_k) with these squares.

    Multiplicative steps for the Itakura-Saito divergence [FevotteBertinDurrieu2009]_; each factor stays positive.

    Parameters
    ----------
    indicators : array, shape (kinds, cells)
        What each kind of indicator says about the variance.
    squares : array, shape (cells,)
        Squared errors.
    """
    tiny = np.finfo(np.float64).tiny
    scale = indicators.mean(axis=1, keepdims=True) + tiny
    indicators = indicators / scale
    factors = np.full(len(indicators), squares.mean() / len(indicators) + tiny)
    for _ in range(ROUNDS):
        variance = factors @ indicators + 1e-6 * squares.mean() + tiny
        factors = factors * np.sqrt(indicators @ (squares / variance**2) / (indicators @ (1 / variance) + tiny))
    fitted: Array = factors / scale[:, 0]
    return fitted


def _stretch(squares: Array) -> float:
    """Factor for variances with which one and two standard deviations cover what they do of a normal distribution.

    `squares` are those of errors over their supposed variances. One factor cannot do both: their geometric mean.
    """
    one, two = np.quantile(squares, [0.6827, 0.9545])
    return float(np.sqrt(one * two / 4))


def _around(values: Array, width: float) -> Array:
    """Average of what lies around each cell, as far as there are cells."""
    average: Array = np.maximum(blurred(values, width), 0.0) / blurred(np.ones_like(values), width)
    return average


def _indicators(estimator: Estimator, estimates: Estimates, mass: Array) -> Array:
    """What tells how far off a cell may be, as variances of its mass."""
    tree, edges, rings = estimates.masses
    disagreement = ((tree - edges) ** 2 + (tree - rings) ** 2 + (edges - rings) ** 2) / 3
    down, right = np.gradient(estimator.density(mass))
    return np.array(
        [
            _around(estimates.tree.variance, 1.0),
            _around(estimates.tree.spread, 1.0),
            estimates.edge_variance,
            _around(disagreement, 1.5),
            _around((down**2 + right**2) * estimator.base**2, 1.0),
            mass**2 / mass.sum(),
        ]
    )
