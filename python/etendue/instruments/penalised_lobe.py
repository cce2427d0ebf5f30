"""A lobe whose logarithm is smooth: penalised likelihood, with its smoothness and its error bands from the counts alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.instruments.operators import Operator, sparse_if_large
from etendue.instruments.richardson_lucy import deviances

Array = npt.NDArray[np.float64]

LEAST_START = 1e-4
"""Of the largest value: what the search begins with where the scan shows nothing."""

START_PENALTY = 1e-4
"""Of the third derivatives of what the search begins with."""

LEAST, LARGEST = 1e-8, 1e2
"""Of the weights of the penalty, angles in reaches: next to none, and a lobe whose logarithm is a parabola."""

WIDER = 1.5
"""Times the distance from one node of the penalty's weight to the next as that before it."""

FINEST, COARSEST, GROWTH = 1 / 24, 1 / 4, 0.06
"""Intervals of the logarithm: the least and the largest, in reaches, and in between their share of the angle."""

PIECES = 1.0
"""Of evidence that each node takes from all others: third derivatives that stand in for its own."""

SETTLED = 0.02
"""Change of the logarithm of the weights at which they are final."""

ENOUGH = 0.01
"""Of the logarithm of the likelihood: less than this is not searched for."""

OPERATOR = 1e-3
"""To which share of the largest flux an operator is right: no scan is taken for more certain."""

MOST_ROUNDS, MOST_STEPS = 200, 30

SMOOTHER = np.arange(-6.0, 6.1, 2.0)
"""Logarithms of the factors by which all weights are varied, since the counts do not tell them exactly."""


@dataclasses.dataclass(frozen=True, eq=False)
class PenalisedLobe:
    """What `penalised_lobe` found.

    Parameters
    ----------
    values : array, shape (m,)
        At the nodes of the operator, in the unit of its measured values.
    variance : array, shape (n,)
        Of the values at the positions of the operator.
    freedom : number
        Effective degrees of freedom.
    deviance : number
        Mean Poisson deviance by degree of freedom that is left, where a count is expected: 1 if the model holds.
    left : number
        Degrees of freedom that are left there.
    """

    values: Array
    variance: Array
    freedom: float
    deviance: float
    left: float


def penalised_lobe(model: Operator, measured: Array, background: float, gain: float) -> PenalisedLobe:
    """The lobe exp θ of the largest penalised likelihood, averaged over how smooth it may be.

    θ is a cubic spline of the angle, even about the middle of rings. Counts are Poisson about (A exp θ + b)/gain. The
    penalty is ½ ∫ λ(r) θ‴² dr, so that the smoothest lobe is a Gaussian ([Eilers1996]_, with the logarithm as the link);
    λ is linear between nodes, so that a narrow peak may stand on a wide foot. Its values maximise the marginal likelihood
    in Laplace's approximation, by the updates of [Wood2017]_, where each node takes `PIECES` of evidence from all together.
    All of them are then varied by common factors, and what is found is averaged, weighted by the marginal likelihood. The
    variance is that of the posterior, within and between these fits; it counts the bias that smoothing makes, on average
    over positions [Nychka1988]_.

    Parameters
    ----------
    model : Operator
        Rings, even about their middle, or a slice.
    measured : array, shape (n,)
        With the background in it; what lies below 0 counts as 0.
    background : number
        In the same unit.
    gain : number
        What one count stands for; more if the largest flux would be known to better than `OPERATOR`.

    Returns
    -------
    PenalisedLobe

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.instruments.operators import operator_of
    >>> goniometer = et.ScatterGoniometer()
    >>> sample = et.bsdf.Gaussian(peak=500, sigma=0.016, way="transmitted")
    >>> scan = goniometer.measure(sample, step=0.2, span=4, method="quadrature")
    >>> model = operator_of(scan, goniometer.instrument_function(), "rings", 0.0)
    >>> lobe = penalised_lobe(model, scan.flux, 0.0, 1e-6)
    >>> round(float(model.at_positions(lobe.values).max() / scan.solid_angle), -1)
    500.0
    """
    gain = max(gain, OPERATOR**2 * float(measured.max()))
    fit = _Fit(model, np.maximum(measured, 0.0) / gain, background / gain, gain)
    start = model.start(np.maximum(measured - background, 0.0))
    wanted = np.log(np.maximum(start, LEAST_START * start.max()))
    # The last spline may hardly reach the last node, which then says nothing of it.
    rows = np.vstack([fit.dense, START_PENALTY * fit.thirds])
    unknowns = np.linalg.lstsq(rows, np.append(wanted, np.zeros(len(fit.thirds))), rcond=None)[0]
    hats = _hats(fit.middles, model.reach)
    weights = np.full(len(hats), np.sqrt(LEAST * LARGEST))
    for i in range(MOST_ROUNDS):
        at = weights @ hats
        unknowns, curvature = fit.search(unknowns, at, MOST_STEPS if i == 0 else 3)
        left = curvature.variances(fit.thirds)
        known = np.maximum(weights * (hats @ (1.0 / at - left)), 1e-9)
        rough = np.maximum(hats @ (fit.thirds @ unknowns) ** 2, 1e-14)
        common = known.sum() / rough.sum()
        new = np.clip((known + PIECES) / (rough + PIECES / common), weights / 30.0, weights * 30.0)
        new = np.clip(new, LEAST, LARGEST)
        settled = np.abs(np.log(new / weights)).max() < SETTLED
        weights = new
        if settled:
            break
    return fit.averaged(unknowns, weights @ hats)


def _hats(distance: Array, reach: float) -> Array:
    """Linear between nodes that lie the further apart the further out; shape (nodes, intervals)."""
    nodes, apart = [0.0], reach
    while nodes[-1] < distance.max():
        nodes.append(nodes[-1] + apart)
        apart *= WIDER
    return np.stack([np.interp(distance, nodes, row) for row in np.eye(len(nodes))])


def _knots(last: float, spacing: float, reach: float) -> Array:
    """From 0 to at least `last`, the further apart the further out."""
    knots = [0.0]
    while knots[-1] < last:
        knots.append(knots[-1] + float(np.clip(GROWTH * knots[-1], spacing, max(spacing, COARSEST * reach))))
    return np.array(knots)


class _Fit:
    """A scan, its operator, the spline of its logarithm and the penalty."""

    def __init__(self, model: Operator, counts: Array, background: float, gain: float) -> None:
        reach = model.reach
        spacing = max(float(np.diff(model.nodes).min()), FINEST * reach)
        outward = _knots(float(np.abs(model.nodes).max()), spacing, reach)
        even = model.name == "rings"
        left = 0.0 if even else max(float(-model.nodes[0]), spacing)
        knots = np.concatenate([-outward[(outward > 0.0) & (outward < left + spacing)][::-1], outward])
        self.counts = counts
        self.background = background
        self.matrix = sparse_if_large(model.matrix / gain)
        self.dense = _splines(model.nodes, knots, even=even)
        self.splines = sparse_if_large(self.dense)
        self.thirds = _third_derivatives(knots / reach, even=even)
        self.middles = np.abs(0.5 * (knots[1:] + knots[:-1]))
        self.readout = sparse_if_large(model.at_positions(np.eye(model.nodes.size)))

    def objective(self, unknowns: Array, at: Array) -> float:
        """−ln likelihood and penalty, but for constants."""
        mean = self.matrix @ np.exp(self.splines @ unknowns) + self.background
        lit = self.counts > 0.0
        with np.errstate(divide="ignore"):
            own = float(mean.sum() - self.counts[lit] @ np.log(mean[lit]))
        return own + 0.5 * float(at @ (self.thirds @ unknowns) ** 2)

    def search(self, unknowns: Array, at: Array, most: int) -> tuple[Array, _Curvature]:
        """Fisher's scoring, with a step that is halved until it does no harm."""
        best = self.objective(unknowns, at)
        penalty = self.thirds.T @ (at[:, None] * self.thirds)
        for _ in range(most):
            lobe, mean, slopes, curvature = self._about(unknowns, penalty)
            slope = slopes.T @ (1.0 - self.counts / mean) + penalty @ unknowns
            step = -curvature.solve(slope)
            # What is dark may become as dark as it likes; what is bright is not to overshoot.
            change = np.abs(self.splines @ step)[lobe > 1e-12 * lobe.max()]
            length = min(1.0, 3.0 / max(float(change.max()), 3.0))
            found = self.objective(unknowns + length * step, at)
            while not found <= best + 1e-9 * abs(best) and length > 1e-6:
                length *= 0.5
                found = self.objective(unknowns + length * step, at)
            unknowns, gained, best = unknowns + length * step, best - found, found
            if abs(gained) < ENOUGH:
                break
        return unknowns, self._about(unknowns, penalty)[3]

    def averaged(self, unknowns: Array, at: Array) -> PenalisedLobe:
        """Over factors of the penalty, by their marginal likelihood."""
        scores, lobes, variances, freedoms = [], [], [], []
        for factor in SMOOTHER:
            weights = at * np.exp(factor)
            unknowns, curvature = self.search(unknowns, weights, MOST_STEPS)
            lobe = np.exp(self.splines @ unknowns)
            scores.append(0.5 * (at.size * factor - curvature.log_determinant) - self.objective(unknowns, weights))
            lobes.append(lobe)
            variances.append(curvature.variances(_dense(self.readout @ _scaled(self.splines, lobe))))
            freedoms.append(unknowns.size - float(weights @ curvature.variances(self.thirds)))
        share = np.exp(np.array(scores) - max(scores))
        share /= share.sum()
        values = share @ np.stack(lobes)
        apart = np.stack([self.readout @ (lobe - values) for lobe in lobes])
        freedom = float(share @ freedoms)
        mean = self.matrix @ values + self.background
        bright = mean > 1.0
        left = max(float(bright.sum()) - freedom, 1.0)
        deviance = float(deviances(self.counts, mean)[bright].sum()) / left
        return PenalisedLobe(values, share @ (np.stack(variances) + apart**2), freedom, deviance, left)

    def _about(self, unknowns: Array, penalty: Array) -> tuple[Array, Array, Any, _Curvature]:
        lobe = np.exp(self.splines @ unknowns)
        mean = np.maximum(self.matrix @ lobe + self.background, 1e-300)
        slopes = self.matrix @ _scaled(self.splines, lobe)
        data = _dense(slopes.T @ _scaled(slopes, 1.0 / mean))
        return lobe, mean, slopes, _Curvature(data + penalty)


class _Curvature:
    """A positive definite matrix: its inverse, as far as it is asked for."""

    def __init__(self, matrix: Array) -> None:
        # Rounding may leave it a little less than positive.
        np.einsum("ii->i", matrix)[:] += 1e-12 * np.diagonal(matrix).max() + 1e-9
        self.matrix = matrix

    @property
    def log_determinant(self) -> float:
        """Its logarithm."""
        return float(np.linalg.slogdet(self.matrix)[1])

    def solve(self, right: Array) -> Array:
        """Of shape (m,)."""
        return np.asarray(np.linalg.solve(self.matrix, right))

    def variances(self, rows: Array) -> Array:
        """Of linear combinations of the unknowns, `rows` of shape (n, m)."""
        return np.asarray(np.einsum("nm,nm->n", rows @ np.linalg.inv(self.matrix), rows))


def _scaled(rows: Any, factors: Array) -> Any:
    """Each row times its factor."""
    return rows.multiply(factors[:, None]).tocsr() if hasattr(rows, "multiply") else factors[:, None] * rows


def _dense(matrix: Any) -> Array:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


def _extended(knots: Array, *, even: bool) -> Array:
    """With three more on each side: those of an even spline mirror each other."""
    after = knots[-1] + (knots[-1] - knots[-2]) * np.arange(1.0, 4.0)
    if even:
        return np.concatenate([-knots[3:0:-1], knots, after])
    return np.concatenate([knots[0] - (knots[1] - knots[0]) * np.arange(3.0, 0.0, -1.0), knots, after])


def _folded(columns: Array, *, even: bool) -> Array:
    """Of an even spline the first coefficient is the third: where the knots mirror each other, so do their splines."""
    if not even:
        return columns
    folded = columns[:, 1:].copy()
    folded[:, 1] += columns[:, 0]
    return folded


def _basis(x: Array, t: Array, degree: int) -> Array:
    """B-splines of a degree by the recursion of de Boor; each value belongs to the interval that it begins."""
    found = ((x[:, None] >= t[:-1]) & (x[:, None] < t[1:])).astype(np.float64)
    for k in range(1, degree + 1):
        rise, fall = t[k:-1] - t[: -k - 1], t[k + 1 :] - t[1:-k]
        found = (x[:, None] - t[: -k - 1]) / rise * found[:, :-1] + (t[k + 1 :] - x[:, None]) / fall * found[:, 1:]
    return found


def _splines(x: Array, knots: Array, *, even: bool) -> Array:
    """Cubic B-splines at angles, shape (n, unknowns)."""
    return _folded(_basis(x, _extended(knots, even=even), 3), even=even)


def _third_derivatives(knots: Array, *, even: bool) -> Array:
    """Third derivative on each interval times the root of its length, shape (intervals, unknowns)."""
    t = _extended(knots, even=even)
    found = np.eye(t.size - 4)
    for k in (3, 2, 1):
        # Coefficients of the derivative, one degree lower.
        gap = t[4 : 4 + len(found) - 1] - t[4 - k : 4 - k + len(found) - 1]
        found = k * np.diff(found, axis=0) / gap[:, None]
    return _folded(np.sqrt(np.diff(knots))[:, None] * found, even=even)
