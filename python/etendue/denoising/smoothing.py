"""A smooth image from few rays: three estimates of it, mixed as held-out rays ask for, with error bars that hold."""

from __future__ import annotations

import dataclasses
import os
from concurrent.futures import Executor, ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from etendue.denoising.error_calibration import variance_of_mixture
from etendue.denoising.estimates import Estimator, ray_quantum
from etendue.denoising.mixture import cross_fitted_mixture
from etendue.denoising.shifted_trees import ShiftedTrees
from etendue.errors import ArgumentError
from etendue.quantities.ray_stream import checked_threads

Array = npt.NDArray[np.float64]

FEWEST_RAYS = 100.0
"""Effective rays without which nothing can be held out."""

LEAST_SIDE = 16
"""Cells along either side below which an image has no room for directions."""


@dataclasses.dataclass(frozen=True, eq=False)
class Smoothed:
    """An image estimated from counts.

    Parameters
    ----------
    mass : array, shape (rows, columns)
        Weight that each cell would hold on average: above 0 wherever the base measure is, and adding up to the total
        weight.
    standard_error : array, shape (rows, columns)
        Of the mass. The errors of neighbouring cells are correlated.
    notes : tuple of str
        What was mixed in which proportions, and how the errors were found.
    """

    mass: Array
    standard_error: Array
    notes: tuple[str, ...]


def smooth_counts(
    weight: npt.ArrayLike,
    weight_squared: npt.ArrayLike,
    base: npt.ArrayLike,
    *,
    shifts: int = 16,
    threads: int | None = None,
) -> Smoothed:
    r"""Estimate the intensity of a Poisson process on the cells of an image, without tuning parameters.

    Three estimates are made. The average of optional Pólya trees over positions of their grid (theory eqs. 29 to 33)
    is unsurpassed at edges along the axes. A Wiener filter on a frame of octaves and directions follows edges and lines
    at any angle. Stein's shrinkage on rings of spatial frequencies is as good as the best linear filter of
    fixed shape, a Gaussian of any width among them. Each cell gets the convex combination with which estimates from one
    half of the rays predict the other half best around it (theory eq. 35).

    Errors are calibrated on counts drawn from a known image much like the estimate (theory eq. 36). Structure that leaves no
    trace in the counts, fine lines with less than one ray per cell, is in no error bar.

    Parameters
    ----------
    weight, weight_squared : array_like, shape (rows, columns)
        Σ w and Σ w² over the rays of each cell, in any unit; for counts, the counts twice.
    base : array_like, shape (rows, columns)
        Relative measure of each cell, its étendue say: where nothing is known, mass is in proportion to it. 0 where
        nothing can be.
    shifts : int
        Positions of the trees' dyadic grid, 1 to 1024.
    threads : int, optional
        All cores if None. The result has the same bits for any number.

    Returns
    -------
    Smoothed
        Its total is that of `weight` to rounding. Random numbers (halves, drawn counts) have fixed addresses, so equal
        input gives equal output. Images with fewer than 16 cells along a side, or fewer than 100 effective rays
        (Σ w)²/Σ w², are left to the trees alone, and their errors to the trees' posterior, which is on the safe side.

    Raises
    ------
    ArgumentError
        If the arrays differ in shape, are not two-dimensional or empty; if a value is negative or not finite; if a cell
        has weight but no base measure, or only one of the two sums; if no cell has weight; if `shifts` or `threads` is
        out of its domain.

    Examples
    --------
    >>> import numpy as np
    >>> rows, columns = np.mgrid[0:64, 0:64]
    >>> truth = np.where(np.hypot(rows - 30, columns - 35) < 20, 3.0, 0.2)
    >>> counts = np.random.default_rng(1).poisson(truth)
    >>> smooth = smooth_counts(counts, counts, np.ones((64, 64)))
    >>> bool(abs(smooth.mass.sum() / counts.sum() - 1) < 1e-12)
    True
    >>> raw, found = (float(np.sqrt(np.mean((m - truth) ** 2))) for m in (counts, smooth.mass))
    >>> found < raw / 3
    True
    """
    rays, rays_squared, measure = _checked(weight, weight_squared, base)
    if not (isinstance(shifts, int) and 1 <= shifts <= 1024):
        raise ArgumentError(f"smooth_counts: shifts is {shifts!r}; give a whole number from 1 to 1024.")
    flux = float(rays.sum())
    unit = float(rays_squared.sum()) / flux  # the flux of a typical ray: from here on, weights are counts
    rays, rays_squared, measure = rays / unit, rays_squared / unit**2, measure / measure.max()
    with ThreadPoolExecutor(checked_threads(threads) or os.cpu_count() or 1) as pool:
        trees = ShiftedTrees(measure)
        trees.choose_concentration(rays, rays_squared, pool)
        if min(measure.shape) < LEAST_SIDE or rays.sum() < FEWEST_RAYS:
            mass, variance, notes = _trees_alone(trees, rays, rays_squared, shifts, pool)
        else:
            mass, variance, notes = _mixed(trees, rays, rays_squared, measure, shifts, pool)
    variance = variance + mass**2 / rays.sum()  # the total is a Poisson count, too
    scale = flux / mass.sum()
    return Smoothed(mass=mass * scale, standard_error=np.sqrt(variance) * scale, notes=notes)


def _mixed(
    trees: ShiftedTrees, rays: Array, rays_squared: Array, measure: Array, shifts: int, pool: Executor
) -> tuple[Array, Array, tuple[str, ...]]:
    """Mass, its variance given the total, and notes."""
    estimator = Estimator(trees, measure, ray_quantum(rays, rays_squared))
    estimates = estimator(rays, rays_squared, shifts, pool)
    mixture = cross_fitted_mixture(estimator, rays, rays_squared, max(1, shifts // 4), pool)
    mass = mixture.mass(estimates, float(rays.sum()))
    variance = variance_of_mixture(estimator, estimates, mixture, mass, shifts, pool)
    tree, edges, rings = (mixture.shares * mass).sum(axis=(1, 2)) / mass.sum()
    what = (
        f"smoothed: {tree:.0%} optional Pólya tree ({shifts} grid positions, concentration {trees.concentration:g} by "
        f"evidence), {edges:.0%} filter along edges, {rings:.0%} shrunk rings of frequencies, mixed locally as held-out "
        "rays ask for; flux kept exactly"
    )
    errors = (
        "standard errors are calibrated on counts drawn from a known image much like this one; those of neighbouring "
        "cells are correlated"
    )
    return mass, variance, (what, errors)


def _trees_alone(
    trees: ShiftedTrees, rays: Array, rays_squared: Array, shifts: int, pool: Executor
) -> tuple[Array, Array, tuple[str, ...]]:
    average = trees.average(rays, rays_squared, shifts, pool)
    what = (
        f"smoothed: optional Pólya tree alone ({shifts} grid positions, concentration {trees.concentration:g} by "
        f"evidence), for want of {FEWEST_RAYS:g} rays or {LEAST_SIDE} cells a side; flux kept exactly"
    )
    errors = "standard errors are posterior ones, on the safe side; those of neighbouring cells are correlated"
    return average.mass, average.variance, (what, errors)


def _checked(*sums: npt.ArrayLike) -> tuple[Array, Array, Array]:
    weight, squared, base = (np.array(values, dtype=np.float64) for values in sums)
    if weight.ndim != 2 or weight.size == 0 or not weight.shape == squared.shape == base.shape:
        raise ArgumentError(
            f"smooth_counts: weight, weight_squared and base have the shapes {weight.shape}, {squared.shape} and "
            f"{base.shape}; give three arrays of one shape (rows, columns), not empty."
        )
    for name, values in (("weight", weight), ("weight_squared", squared), ("base", base)):
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise ArgumentError(
                f"smooth_counts: {name} has a value that is negative or not finite; sums over rays never are."
            )
    if not (weight > 0).any():
        raise ArgumentError("smooth_counts: no cell has weight, so there is nothing to smooth.")
    if ((weight > 0) != (squared > 0)).any():
        raise ArgumentError(
            "smooth_counts: a cell has Σ w without Σ w² or the reverse; give both sums over the same rays."
        )
    if (weight[base == 0] > 0).any():
        raise ArgumentError("smooth_counts: a cell has weight where base is 0; give it a base measure above 0.")
    return weight, squared, base
