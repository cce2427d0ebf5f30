"""How much of each estimate, and where: what half of the rays say about estimates from the other half."""

from __future__ import annotations

import dataclasses
from concurrent.futures import Executor

import numpy as np

from etendue.denoising.estimates import Estimates, Estimator
from etendue.denoising.fourier_plane import Array, blurred

WINDOW = 16.0
"""Cells near and far count for a cell's shares with weights exp(−r²/2s²), and this is s."""

LEAST_VARIANCE = 1e-4
"""Least variance of the shares over the image: below it, they are the same everywhere."""

PROOF = 6.0
"""Gain in log-likelihood over the trees alone without which the others get no share: 400 to 1."""

PURPOSE = 0x5448_494E
"""Keeps the random numbers of the thinning apart from all others."""


@dataclasses.dataclass(frozen=True, eq=False)
class Mixture:
    """Shares of the estimates in every cell.

    Parameters
    ----------
    shares : array, shape (3, rows, columns)
        None negative; they add up to one.
    """

    shares: Array

    def mass(self, estimates: Estimates, total: float) -> Array:
        """The mixed image with this total."""
        mixed: Array = (self.shares * estimates.masses).sum(axis=0)
        scaled: Array = mixed * (total / mixed.sum())
        return scaled


def cross_fitted_mixture(
    estimator: Estimator, weight: Array, weight_squared: Array, shifts: int, pool: Executor
) -> Mixture:
    r"""The shares with which estimates from one half of the rays predict the other half best, and vice versa.

    With first estimate a, differences d_k of the others from it and held-out weight t, the shares of the others minimise
    Σ (t − a − Σ λ_k d_k)²/μ over the cells: theory eq. 35. Halves of a Poisson process are independent, so nothing is
    gained by fitting noise. What is best for the whole image is the expectation of what is best around each cell; how
    far the two differ more than chance explains is their prior variance.
    """
    first, second = halves(weight, weight_squared)
    moments = np.zeros((2, *weight.shape))
    products = np.zeros((2, 2, *weight.shape))
    for fitted, held_out in ((first, second), (second, first)):
        masses = estimator(*fitted, shifts, pool).masses * (held_out[0].sum() / fitted[0].sum())
        spread = np.where(estimator.supported, masses.mean(axis=0) * estimator.quantum, np.inf)
        difference = masses[1:] - masses[0]
        moments += (held_out[0] - masses[0]) * difference / spread
        products += difference[:, None] * difference[None] / spread
    whole_products, whole_moments = products.sum(axis=(2, 3)), moments.sum(axis=(1, 2))
    overall = least_squares_shares(whole_products, whole_moments)
    if whole_moments @ overall - 0.5 * overall @ whole_products @ overall < PROOF:
        return Mixture(np.concatenate([np.ones((1, *weight.shape)), np.zeros_like(moments)]))
    area = 2 * np.pi * WINDOW**2  # turns the blur's average into a sum
    moments = np.array([blurred(m, WINDOW) * area for m in moments])
    products = np.array([[blurred(p, WINDOW) * area for p in row] for row in products])
    excess = moments - np.einsum("kl...,l->k...", products, overall)
    chance = np.trace(products).sum()
    variance = max(float(((excess**2).sum() - chance) / max((products**2).sum(), 1e-300)), LEAST_VARIANCE)
    prior = np.eye(2)[..., None, None] / variance
    others = least_squares_shares(products + prior, moments + overall[:, None, None] / variance)
    return Mixture(np.concatenate([1.0 - others.sum(axis=0, keepdims=True), others]))


def halves(weight: Array, weight_squared: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Both sums of two independent halves of the rays, from those of all of them.

    Of n equal rays each goes to either half with probability ½, which makes independent Poisson counts of one
    [Kingman1993]_ [Neufeld2024]_. Of unequal ones only n = (Σ w)²/Σ w² is known; they are dealt as ⌊n⌋ or ⌈n⌉ equal
    ones, with the probability that makes the variance of the half Σ w²/4. Then the halves are uncorrelated, and all
    that is built on them here uses first and second moments only.
    """
    generator = np.random.Generator(np.random.Philox(key=PURPOSE))
    effective = np.divide(weight**2, weight_squared, out=np.ones_like(weight), where=weight_squared > 0)
    fewer = np.maximum(np.floor(effective * (1 + 1e-12)), 1.0)
    rounded_down = np.clip((fewer + 1) * fewer / np.maximum(effective, 1.0) - fewer, 0.0, 1.0)
    dealt = np.where(generator.random(weight.shape) < rounded_down, fewer, fewer + 1)
    share = generator.binomial(dealt.astype(np.int64), 0.5) / dealt
    first = (weight * share, weight_squared * share)
    return first, (weight - first[0], weight_squared - first[1])


def least_squares_shares(products: Array, moments: Array) -> Array:
    """The λ ≥ 0, λ₁ + λ₂ ≤ 1, with the least ½ λ·P·λ − m·λ; arrays of problems along the trailing axes.

    The objective is convex: if its least value over the plane is not in the triangle, it is on one of the three sides.
    """
    (a, b), (_, d) = products
    m, n = moments
    tiny = 1e-300
    determinant = a * d - b * b
    regular = determinant > 1e-12 * a * d + tiny
    scale = np.where(regular, determinant, 1.0)
    inner = (m * d - n * b) / scale, (n * a - m * b) / scale
    within = regular & (inner[0] >= 0) & (inner[1] >= 0) & (inner[0] + inner[1] <= 1)
    along = np.clip((m - n + d - b) / np.maximum(a - 2 * b + d, tiny), 0.0, 1.0)
    zero = np.zeros_like(m)
    best, least = np.zeros((2, *np.shape(m))), np.full(np.shape(m), np.inf)
    for x, y in (
        (np.clip(m / np.maximum(a, tiny), 0.0, 1.0), zero),
        (zero, np.clip(n / np.maximum(d, tiny), 0.0, 1.0)),
        (along, 1.0 - along),
        (np.where(within, inner[0], 0.0), np.where(within, inner[1], 0.0)),
    ):
        value = 0.5 * (a * x * x + 2 * b * x * y + d * y * y) - m * x - n * y
        better = value < least
        best, least = np.where(better, np.array([x, y]), best), np.where(better, value, least)
    return best
