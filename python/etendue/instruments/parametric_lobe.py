"""A model of a lobe fitted through an instrument: the most likely parameters for the counts."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.extras import scipy_part
from etendue.instruments.counted_scan import CountedScan
from etendue.instruments.courses import halves_of
from etendue.instruments.directional_operator import FINENESS, Instrument, matrix_of
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.lobe_splines import DENSE, LobeSplines, splines_for
from etendue.instruments.richardson_lucy import deviances
from etendue.scatter.lobe_models import LOBE_MODELS, LobeModel, lobe_model

Array = npt.NDArray[np.float64]

STEP = 1e-4
"""Of parameters, all of which are logarithms or angles, when their influence is looked at."""

AXES = 4
"""Azimuths of the axis that a fit starts at, evenly over half a turn."""

HIGH = 0.3
"""Of the largest f above the floor: what is higher belongs to the lobe."""

FINER = 0.5
"""Of the cells of the scan: splines that carry a model to the positions are right to 1e-3 of the peak."""

TYPICAL, EVALUATIONS = 0.1, 60
"""Steps of parameters, and how many are made at most."""

FAINTEST = 1e-6
"""Of the largest f: a floor to start with where there is none."""


@dataclasses.dataclass(frozen=True, eq=False)
class ParametricLobe:
    """What was fitted.

    Parameters
    ----------
    model : LobeModel
        Which.
    parameters, covariance : array, shape (p,) and (p, p)
        Of the model, and of its parameters.
    expected : array, shape (n,)
        Counts.
    deviance : float
        Mean Poisson deviance of the counts.
    scores : dict of str to float
        Of all models, the mean deviance of counts that were kept back.
    regular, regular_error : float
        Share of the light that goes on in a single direction, and its standard error if it was fitted.
    """

    model: LobeModel
    parameters: Array
    covariance: Array
    expected: Array
    deviance: float
    scores: dict[str, float]
    regular: float
    regular_error: float

    def f(self, off: Array) -> Array:
        """F [1/sr] at β − β₀ of shape (n, 2)."""
        return self.model.f(self.parameters, off)

    def error(self, off: Array) -> Array:
        """Standard error of f from that of the parameters."""
        slopes = _slopes(lambda p: self.model.f(p, off), self.parameters)
        return np.asarray(np.sqrt(np.maximum(np.einsum("np,pq,nq->n", slopes, self.covariance, slopes), 0.0)))


@dataclasses.dataclass(frozen=True, eq=False)
class ModelLobe:
    """F [1/sr] at directions of shape (k, 3), by a model.

    Parameters
    ----------
    model : LobeModel
        Which.
    parameters : array, shape (p,)
        Of the model.
    origin : array, shape (2,)
        Projection of the regular direction on the surface.
    """

    model: LobeModel
    parameters: Array
    origin: Array

    def __call__(self, directions: Array) -> Array:
        """F, everywhere."""
        return self.model.f(self.parameters, directions[:, :2] - self.origin)


@dataclasses.dataclass(frozen=True, eq=False)
class _Seen:
    """What positions would count of a lobe whose f is known everywhere.

    Where positions are dense, through fine splines; elsewhere f hardly changes over an aperture.
    """

    near: npt.NDArray[np.bool_]
    splines: LobeSplines
    matrix: Any
    sees: Array
    off: Array
    background: Array
    bare: Array | None

    @classmethod
    def of(cls, instrument: Instrument, scan: DirectionalScan, counted: CountedScan, *, regular: bool) -> _Seen:
        near = scan.spacing <= DENSE * float(np.quantile(scan.spacing, 0.1))
        arms, per = scan.direction[near], counted.per_count
        cell = FINER * counted.model.cell
        splines = splines_for(arms, scan.regular, scan.spacing[near], cell, instrument.reach, even=True)
        matrix = matrix_of(instrument, arms, scan.incidence, splines)
        sees = np.zeros(scan.flux.shape)
        for sight in instrument.sights(scan.direction, scan.incidence, *FINENESS):
            sees[sight.positions] = sight.weights.sum(axis=(1, 2))
        off = scan.direction[:, :2] - scan.regular[:2]
        scaled = scipy_part("sparse").csr_array(matrix.multiply(1.0 / per[near, None]))
        bare = counted.model.bare / per if regular else None
        background = counted.with_regular(-counted.regular).background if regular else counted.background
        return cls(near, splines, scaled, sees / per, off, background, bare)

    def expected(self, model: LobeModel, given: Array) -> Array:
        """Counts; the last parameter is ln of what is mirrored in a single direction, if that is fitted."""
        parameters = given if self.bare is None else given[:-1]
        found = np.zeros(self.sees.shape)
        found[self.near] = self.matrix @ self.splines.weights_of(lambda off: model.f(parameters, off))
        far = ~self.near
        found[far] = self.sees[far] * model.f(parameters, self.off[far])
        if self.bare is not None:
            found += np.exp(min(float(given[-1]), 0.0)) * self.bare
        return found + self.background


def parametric_lobe(
    instrument: Instrument,
    scan: DirectionalScan,
    counted: CountedScan,
    models: Sequence[str],
    seed: int,
    *,
    regular: bool = False,
) -> ParametricLobe:
    """The most likely lobe of the model that predicts held-out counts best.

    Of models that predict them equally well, the one with the fewest parameters.

    Parameters
    ----------
    instrument : Instrument
        That took the scan.
    scan : DirectionalScan
        The scan.
    counted : CountedScan
        The same as counts.
    models : sequence of str
        To choose from, by the kinds of finishes.
    seed : int
        Of the counts that are kept back.
    regular : bool
        Whether the share of light in a single direction is fitted too, from the one that is known of the counts.

    Raises
    ------
    ArgumentError
        If no model is named, or the noise of the scan is not known.
    UnknownNameError
        If there is no such model.
    """
    if not models:
        raise ArgumentError(f"no model to fit; name one or more of {', '.join(LOBE_MODELS)}")
    if not counted.counted:
        raise ArgumentError("a fit needs the standard errors of the scan, by which its values count")
    candidates = sorted((lobe_model(name) for name in models), key=lambda one: len(one.extra))
    seen = _Seen.of(instrument, scan, counted, regular=regular)
    tail = [np.log(max(counted.regular, 1e-12))] if regular else []
    size = len(tail)
    learned, kept = halves_of(counted.counts, 1.0, seed)
    # The simplest finds the place and the axis, from which the others start.
    starts = [np.append(one, tail) for one in _starts(seen, counted, candidates[0])]
    fits: dict[str, Array] = {}
    missed: dict[str, Array] = {}
    for one in candidates:
        first = next(iter(fits.values()), None)
        again = starts if first is None else [np.append(one.start_from(first), first[first.size - size :])]
        fits[one.name] = _fit(seen, learned[:, 0], one, again)
        missed[one.name] = deviances(kept[:, 0], 0.5 * seen.expected(one, fits[one.name]))
    scores = {name: float(values.mean()) for name, values in missed.items()}
    least = min(scores, key=lambda name: scores[name])
    alike = [one for one in candidates if _alike(missed[one.name], missed[least])]
    best = min(alike, key=lambda one: (len(one.extra), scores[one.name]))
    parameters = best.normal_form(_fit(seen, counted.counts, best, [fits[best.name]]))
    expected = seen.expected(best, parameters)
    slopes = _slopes(lambda p: seen.expected(best, p), parameters)
    information = np.einsum("np,n,nq->pq", slopes, 1.0 / np.maximum(expected, 1e-9), slopes)
    covariance = np.asarray(np.linalg.pinv(information, rcond=1e-12, hermitian=True))
    # A model that the sample is not leaves more than noise.
    left = float(deviances(counted.counts, expected).mean())
    covariance = covariance * max(left, 1.0)
    own = parameters.size - size
    share = float(np.exp(parameters[-1])) if regular else counted.regular
    uncertain = share * float(np.sqrt(covariance[-1, -1])) if regular else 0.0
    return ParametricLobe(best, parameters[:own], covariance[:own, :own], expected, left, scores, share, uncertain)


def _alike(scores: Array, best: Array) -> bool:
    worse = scores - best
    return bool(worse.sum() <= worse.std() * np.sqrt(worse.size))


def _fit(seen: _Seen, counts: Array, model: LobeModel, starts: Sequence[Array]) -> Array:
    def residuals(parameters: Array) -> Array:
        """Whose squares add up to the Poisson deviance, so that least squares are most likely."""
        expected = np.maximum(seen.expected(model, parameters), 1e-9)
        return np.asarray(np.sign(counts - expected) * np.sqrt(np.maximum(deviances(counts, expected), 0.0)))

    fits = [
        scipy_part("optimize").least_squares(residuals, start, x_scale=TYPICAL, max_nfev=EVALUATIONS)
        for start in starts
    ]
    return np.asarray(min(fits, key=lambda one: float(one.cost)).x)


def _starts(seen: _Seen, counted: CountedScan, model: LobeModel) -> list[Array]:
    """From the largest value of the scan and the second moments of what rises high above the floor."""
    f = (counted.counts - counted.background) / seen.sees
    floor = max(float(np.quantile(f, 0.1)), FAINTEST * float(f.max()))
    high = np.maximum(f - floor, 0.0)
    high = np.where(high > HIGH * high.max(), high, 0.0)
    spread = float(np.sqrt(0.5 * np.average(np.sum(seen.off**2, axis=1), weights=high)))
    width = max(0.7 * spread, float(seen.splines.levels[0].size.min()))
    peak = 2.0 * float(f.max())
    return [model.start(peak, width, 1.5, azimuth, floor) for azimuth in np.arange(AXES) * (np.pi / AXES)]


def _slopes(of: Callable[[Array], Array], parameters: Array) -> Array:
    """Derivatives by the parameters, shape (n, p), from differences on both sides."""
    steps = STEP * np.eye(parameters.size)
    return np.stack([(of(parameters + step) - of(parameters - step)) / (2.0 * STEP) for step in steps], axis=1)
