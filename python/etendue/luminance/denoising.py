"""The denoiser of maps that rest on counts: every dyadic partition of the map, averaged by its posterior probability."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.ray_stream import checked_threads

Array = npt.NDArray[np.float64]

CONCENTRATIONS = (1.0, 3.0, 10.0, 30.0, 100.0)
"""Concentrations c of the Beta priors among which the evidence chooses."""

LATTICE = (0.7548776662466927, 0.5698402909980532)
"""Steps of the two-dimensional golden lattice, 1/g and 1/g² with g³ = g + 1: shifts spread evenly for any number of them."""


def denoise_map(lmap: LuminanceMap, shifts: int = 16, threads: int | None = None) -> LuminanceMap:
    r"""Smooth a map without a knob: optional Pólya tree on its counts, averaged over shifts of the grid.

    The flux of each pixel is a sample of a Poisson process over the pixels, whose étendue is the base measure. The tree
    (theory eqs. 29 to 32) averages over all ways to halve the map again and again, each with its posterior probability:
    where the counts tell no structure it averages over large areas, and it keeps every edge that they prove. As edges are
    sought on a dyadic grid, the result is averaged over positions of that grid (theory eq. 33). The concentration is
    the one with the greatest evidence.

    Parameters
    ----------
    lmap : LuminanceMap
        A map whose pixels are independent and whose standard errors are known: straight from `luminance_map`.
    shifts : int
        Positions of the dyadic grid, 1 to 1024; they are a fixed sequence, so the result has no randomness.
    threads : int, optional
        All cores if None. The result has the same bits for any number.

    Returns
    -------
    LuminanceMap
        Every pixel has a value above 0. The flux Σ L · étendue is that of the input exactly. `standard_error` is the
        root mean square of the posterior standard deviations at the single positions, which bounds that of their
        average from above (theory eq. 33), together with the Poisson error of the map's total; errors of neighbouring
        pixels are correlated. `rays` is that of the input.

    Raises
    ------
    ArgumentError
        If the map has no flux, a negative value, or a live pixel without a standard error above 0; if `shifts` is out of
        its domain; or if the map has more than 16 million pixels.

    Examples
    --------
    >>> import etendue as et
    >>> noisy = et.luminance_map(et.RingSource(rays=3_000_000), et.Observer(0, 0, 150), et.Screen(70, 70, 32, 32),
    ...                          method="cone")
    >>> smooth = denoise_map(noisy)
    >>> abs(smooth.intensity / noisy.intensity - 1) < 1e-12, smooth.dead_pixels
    (True, 0)
    """
    if not (isinstance(shifts, int) and 1 <= shifts <= 1024):
        raise ArgumentError(f"denoise_map: shifts is {shifts!r}; give a whole number from 1 to 1024.")
    if lmap.values.size > 1 << 24:
        raise ArgumentError(
            f"denoise_map: the map has {lmap.values.size:,} pixels; at most 16,777,216 can be denoised."
        )
    etendue = lmap.screen.cosine(lmap.observer)  # relative: constant factors cancel
    weight, weight_squared = _poisson_sums(lmap, etendue)
    depths = [_depth(n) for n in lmap.values.shape]
    corners = _corners(shifts, [2**d - n for d, n in zip(depths, lmap.values.shape, strict=True)])

    def tree(corner: tuple[int, int], c: float) -> tuple[Array, Array, float]:
        window = tuple(slice(at, at + n) for at, n in zip(corner, lmap.values.shape, strict=True))
        padded = [np.zeros([2**d for d in depths]) for _ in range(3)]
        for grid, values in zip(padded, (weight, weight_squared, etendue / etendue.sum()), strict=True):
            grid[window] = values
        rays, rays_squared, base = (grid.ravel() for grid in padded)
        ratio, squared, evidence = _core.polya_posterior(depths, rays, rays_squared, base, c)
        shape = padded[0].shape
        return ratio.reshape(shape)[window], squared.reshape(shape)[window], evidence

    with ThreadPoolExecutor(checked_threads(threads) or os.cpu_count() or 1) as pool:
        evidences = list(pool.map(lambda c: tree(corners[0], c)[2], CONCENTRATIONS))
        c = CONCENTRATIONS[int(np.argmax(evidences))]
        mean, mean_square, square = (np.zeros_like(weight) for _ in range(3))
        for ratio, squared, _ in pool.map(lambda corner: tree(corner, c), corners):
            mean += ratio / shifts
            mean_square += ratio**2 / shifts
            square += squared / shifts
    level = weight.sum() / etendue.sum()
    total_variance = weight_squared.sum() / weight.sum() ** 2
    variance = np.maximum(square - mean_square, 0.0) + mean**2 * total_variance
    notes = (
        f"optional Pólya tree averaged over {shifts} grid positions, concentration {c:g} by evidence; flux kept exactly",
        "standard errors are posterior ones, on the safe side; those of neighbouring pixels are correlated",
    )
    return lmap.replace(
        values=mean * level,
        standard_error=np.sqrt(variance) * level,
        provenance=lmap.provenance.then(f"denoised by optional Pólya tree, {shifts} shifts, concentration {c:g}"),
        notes=(*lmap.notes, *notes),
    )


def _poisson_sums(lmap: LuminanceMap, etendue: Array) -> tuple[Array, Array]:
    """Σ w and Σ w² of each pixel, in units of the map's value times relative étendue."""
    live = ~np.isnan(lmap.values)
    values, errors = np.where(live, lmap.values, 0.0), np.where(live, lmap.standard_error, 0.0)
    if (values < 0).any():
        raise ArgumentError("denoise_map: the map has negative values, which no count of rays gives.")
    lit = values > 0
    if not lit.any():
        raise ArgumentError("denoise_map: no pixel of the map has flux, so there is nothing to denoise.")
    if not (errors[lit] > 0).all():
        raise ArgumentError(
            "denoise_map: the map has pixels without a standard error, so the counts behind them are not known. "
            "Denoise the map as it came from luminance_map, or from a file that holds errors (.exr .tif .npz .csv)."
        )
    return values * etendue, (errors * etendue) ** 2 * lit


def _depth(n: int) -> int:
    """Halvings of a grid that holds n pixels at more than one position."""
    return max(1, math.ceil(math.log2(n + 1))) if n > 1 else 0


def _corners(shifts: int, room: list[int]) -> list[tuple[int, int]]:
    """Where the map lies in the grid, for each shift."""
    steps = np.outer(np.arange(shifts), LATTICE) % 1.0
    return [(int(a * (room[0] + 1)), int(b * (room[1] + 1))) for a, b in steps]
