"""What more rays would bring: the field fitted again to parts of its rays, and a law through what each doubling gained."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.concurrency import on_one_blas_thread
from etendue.errors import ArgumentError
from etendue.lightfield.candidate import (
    MIXED_IN,
    Score,
    all_images,
    grow_candidate,
)
from etendue.lightfield.counting import EtendueCounts, FloatArray, PartGrids, count_rays
from etendue.lightfield.etendue_density import PartField
from etendue.lightfield.light_field import LightField
from etendue.lightfield.pilot_sample import pilot_sample, selected_rays
from etendue.lightfield.symmetry import fold
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream, checked_threads

MOST_RAYS = 1 << 22
"""Rays that are fitted again; of larger sets as many, spread over the set, and the law does the rest."""

FEWEST_RAYS = 4000
"""Below, the smallest part has too few rays for its fit to tell anything of a larger one's."""

PARTS = 16
"""The rays are dealt into so many parts: half of them to fit, half to score, and then the other way round."""

RUNGS = (2, 4, 8)
"""Parts that are fitted together: each rung has twice the rays of the one before."""

REFITS = 2 * len(RUNGS)
"""Fits in all."""

LAW_HOLDS = 0.1
"""How closely fields follow the law, as a share of each gain: so that 68 % of forecasts hold on the tests' sources."""

EXPONENTS = np.linspace(0.25, 1.0, 31)
"""Exponents of the law that are thought possible: from sharp edges in four dimensions to cells that all have many rays."""

ROUNDING = 1e-9
"""Of a mean score [nat per ray]."""

DEVIATES = np.linspace(-3.0, 3.0, 31)
"""Standard deviations at which the height of the law is tried."""

SPREAD = (0.16, 0.5, 0.84)
"""Quantiles of a forecast: low, value, high."""


class Predicted(NamedTuple):
    """An extrapolated number, and the interval that holds it with a probability of 68 %."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True, eq=False)
class Forecast:
    """How the error of a field falls with the number of rays.

    The *loss* is what the score per held-out ray lacks of what this grid can reach with endless rays [nat]; small losses
    are half the mean square of the relative error of luminance at the rays, so √(2 · loss) is called the *error*.

    Parameters
    ----------
    field_rays : int
        Rays that the field was fitted to.
    rays : array, shape (n,)
        Rays of each rung.
    gains, gain_errors : array, shape (n - 1,)
        Gain of score from each rung to the next [nat per ray], and its standard error.
    exponents, losses, weights : array, shape (m,)
        The law's posterior: pairs of exponent β and loss for `field_rays`, and the probability of each.

    Examples
    --------
    >>> curve = law_of_gains(np.array([1e4, 2e4, 4e4]), np.array([0.008, 0.004]), np.eye(2) * 1e-8, 80_000)
    >>> f"{curve.error().value:.2f}", round(curve.factor(0.5).value)
    ('0.07', 5)
    """

    field_rays: int
    rays: FloatArray
    gains: FloatArray
    gain_errors: FloatArray
    exponents: FloatArray
    losses: FloatArray
    weights: FloatArray

    @property
    def measurable(self) -> bool:
        """Whether more rays are likelier to gain anything than not; if not, an error of 0 means no more than that.

        Examples
        --------
        >>> rays = np.array([1e4, 2e4, 4e4])
        >>> [law_of_gains(rays, np.array(g), np.eye(2) * 1e-8, 80_000).measurable for g in ([8e-3, 4e-3], [-1e-4, 5e-5])]
        [True, False]
        """
        return self.loss().value > 0.0

    @property
    def exponent(self) -> Predicted:
        """β of loss ∝ rays^-β."""
        return self._forecast(self.exponents)

    def loss(self, rays: float | None = None) -> Predicted:
        """Loss with so many rays [nat per ray]; as many as the field has if None."""
        return self._forecast(self._loss(rays))

    def error(self, rays: float | None = None) -> Predicted:
        """Relative error of luminance with so many rays, √(2 · loss)."""
        return self._forecast(np.sqrt(2.0 * self._loss(rays)))

    def gain(self, factor: float) -> Predicted:
        """Gain of score [nat per ray] from so many times the rays."""
        return self._forecast(self._loss(None) - self._loss(factor * self.field_rays))

    def factor(self, share: float = 0.5) -> Predicted:
        """How many times the rays leave this share of the error.

        Raises
        ------
        ArgumentError
            If the share is not above 0.
        """
        if not share > 0.0:
            raise ArgumentError(f"share is {share!r}; give what shall be left of the error, above 0.")
        return self._forecast(share ** (-2.0 / self.exponents))

    def _loss(self, rays: float | None) -> FloatArray:
        if rays is None:
            return self.losses
        if not rays > 0:
            raise ArgumentError(f"rays is {rays!r}; give a number above 0.")
        falls: FloatArray = self.losses * (rays / self.field_rays) ** -self.exponents
        return falls

    def _forecast(self, values: FloatArray) -> Predicted:
        order = np.argsort(values)
        reached = np.cumsum(self.weights[order])
        low, value, high = values[order][np.searchsorted(reached, np.array(SPREAD) * reached[-1])]
        return Predicted(float(value), float(low), float(high))


@on_one_blas_thread
def make_forecast(
    field: LightField,
    rays: RayStream,
    *,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Forecast:
    """Fit the field again to an eighth, a quarter and half of its rays, and judge each fit on the other half.

    Surface, grid, the cells of the images, symmetry, base measure and concentrations stay as they are. A fit of more rays
    may have finer cells, which gain something as well: the forecast is what more rays bring at least.

    Parameters
    ----------
    field : LightField
        What was fitted to the rays.
    rays : RayStream
        The rays it was fitted to; of more than 4 million, 4 million are used.
    seed : int
        Deals the rays into parts.
    threads : int, optional
        All cores if None.
    progress : callable, optional
        Called with the number of fits done, of `REFITS`.

    Raises
    ------
    ArgumentError
        If there are fewer than 4000 rays, or fewer than the field was fitted to.
    """
    threads = checked_threads(threads)
    if len(rays) < field.report.rays:
        raise ArgumentError(
            f"the field was fitted to {field.report.rays:,} rays, and this set has {len(rays):,}; give the rays of the fit."
        )
    some = pilot_sample(rays, MOST_RAYS)
    if len(some) < FEWEST_RAYS:
        raise ArgumentError(
            f"{len(some):,} rays are too few to forecast what more would bring; {FEWEST_RAYS:,} are not."
        )
    part = _core.deal_parts(0, len(some), PARTS, seed)
    half = part // (PARTS // 2)
    scores: list[list[Score]] = []
    for fitted in (0, 1):
        held_out = selected_rays(some, half != fitted)
        rungs = []
        for parts in RUNGS:
            mine = selected_rays(some, (half == fitted) & (part % (PARTS // 2) < parts))
            again = _refit(field, _count(field, mine, seed, threads), threads)
            rungs.append(_score(again, held_out, threads))
            if progress is not None:
                progress(len(scores) * len(RUNGS) + len(rungs))
        scores.append(rungs)
    gains, covariance = _gains(scores)
    return law_of_gains(len(some) * np.array(RUNGS) / PARTS, gains, covariance, field.report.rays)


def law_of_gains(rays: FloatArray, gains: FloatArray, covariance: npt.NDArray[np.float64], field_rays: int) -> Forecast:
    """The law loss = a (rays / field_rays)^-β through what the steps from rung to rung gained.

    Only gains are measured, never the loss itself, so the height of the law follows from how fast they fall. For each β
    in `EXPONENTS`, all thought equally likely, a has a normal posterior, of which what is below 0 counts as 0.
    """
    noise = covariance + np.diag((LAW_HOLDS * gains) ** 2)
    precision = np.linalg.inv(noise + np.eye(len(gains)) * ROUNDING**2)
    exponents, losses, weights = [], [], []
    for exponent in EXPONENTS:
        falls = -np.diff((rays / field_rays) ** -exponent)
        sharpness = float(falls @ precision @ falls)
        best = float(falls @ precision @ gains) / sharpness
        heights = best + DEVIATES / math.sqrt(sharpness)
        misfit = float(gains @ precision @ gains) - best**2 * sharpness
        exponents.append(np.full(len(heights), exponent))
        losses.append(np.maximum(heights, 0.0))
        weights.append(-(misfit + DEVIATES**2) / 2)
    logarithms = np.concatenate(weights)
    return Forecast(
        field_rays=field_rays,
        rays=rays,
        gains=gains,
        gain_errors=np.sqrt(np.diag(covariance)),
        exponents=np.concatenate(exponents),
        losses=np.concatenate(losses),
        weights=np.exp(logarithms - logarithms.max()),
    )


def _count(field: LightField, rays: RaySet, seed: int, threads: int | None) -> EtendueCounts:
    """The rays in the cells of the field, those of its images among them.

    A fit of fewer rays would have coarser images: at four times fewer, so that of two rungs with twice the rays the first
    would gain what cells of half the size do, and the second nothing, or the other way round.
    """
    grids = [_grids_of(part) for part in field.parts]
    return count_rays(rays, field.surface, grids, held_out=0.0, seed=seed, threads=threads)


def _grids_of(part: PartField) -> PartGrids:
    """The grids that a part of a field was made on; where it has no images, the coarsest that go with its cells."""
    s1, s2, a, b = (n.bit_length() - 1 for n in part.ratio.shape)
    place, direction = (0 if f is None else len(f).bit_length() - 1 for f in (part.space, part.direction))
    return PartGrids((s1, s2, a, b), (max(place, s1, s2), max(direction, a, b)))


def _refit(field: LightField, counts: EtendueCounts, threads: int | None) -> LightField:
    """The field of other rays, with everything chosen as it was for this one, and a flux of 1."""
    if field.report.symmetry != "none":
        counts = fold(counts, field.report.symmetry)
    recipe, images = field.report.bases[0], all_images(counts, "all", threads)
    parts = grow_candidate(counts, "all", recipe, images, field.report.concentrations, threads).fields(counts)
    flux = sum(counts.part_flux)
    return field.replace(parts=tuple(dataclasses.replace(part, level=part.level / flux) for part in parts))


def _score(field: LightField, rays: RaySet, threads: int | None) -> Score:
    """Ln of the density in étendue [1/(mm² sr)] at each of the rays, for a field with a flux of 1."""
    density = field.core.luminance(rays.position, rays.direction, threads)[0]
    even = 1.0 / sum(chart.etendue for chart in field.surface.parts())
    return Score(np.log((1.0 - MIXED_IN) * density + MIXED_IN * even), rays.flux)


def _gains(scores: list[list[Score]]) -> tuple[FloatArray, FloatArray]:
    """Gain of score from rung to rung, over all rays, and the covariance of the gains."""
    values = np.concatenate([np.diff([rung.values for rung in rungs], axis=0) for rungs in scores], axis=1)
    weights = np.concatenate([rungs[0].weights for rungs in scores])
    shares = weights / weights.sum()
    gains = values @ shares
    away = (values - gains[:, None]) * shares
    return gains, away @ away.T
