"""The denoiser of maps that rest on counts: flux exact, error bars kept, nothing to set."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.denoising.smoothing import smooth_counts
from etendue.errors import ArgumentError
from etendue.luminance.filters import TOGETHER, pixels_err_together
from etendue.quantities.luminance_map import LuminanceMap, check_luminance_map, errors_parted, notes_that_stay

Array = npt.NDArray[np.float64]

LEAST_SHARE = 1e-6
"""Of a pixel's error that is taken for its own, where all of it is in common with the others."""


def denoise_map(lmap: LuminanceMap, shifts: int = 16, threads: int | None = None) -> LuminanceMap:
    r"""Smooth a map without tuning parameters: what its counts prove stays sharp, the rest becomes smooth.

    The flux of each pixel is a sample of a Poisson process over the pixels, whose étendue is the base measure. The map
    is a mixture of three estimates of that process (`smooth_counts`, theory section 12): optional Pólya trees, which
    average over all ways to halve the map again and again; a filter that follows edges and lines at any angle; and
    shrunk rings of frequencies, which are as good as the best linear filter of fixed shape. Each pixel's shares are those
    with which estimates from half of the rays predict the other half best.

    Parameters
    ----------
    lmap : LuminanceMap
        A map whose pixels are independent and whose standard errors are known: straight from `luminance_map`, by the cone or
        of a scene. The errors of light fields, and of maps that were smoothed before, do not go out; a note says so.
    shifts : int
        Positions of the trees' dyadic grid, 1 to 1024; they are a fixed sequence.
    threads : int, optional
        All cores if None. The result has the same bits for any number.

    Returns
    -------
    LuminanceMap
        Every pixel has a value above 0. The flux Σ L · étendue is that of the input exactly. `standard_error` is
        calibrated on counts drawn from a known map much like this one (theory eq. 36): one standard error covers about
        68 % of the pixels, two about 95 %, fewer where structure is too fine for the rays to show; what all pixels have in
        common, `LuminanceMap.common_error`, is added. Errors of neighbouring pixels are correlated. Maps of fewer than 16
        pixels a side or 100 effective rays are left to the trees alone, with errors on the safe side. `rays` is that of the
        input.

    Raises
    ------
    ArgumentError
        If the map has no flux, a negative value, or a live pixel without a standard error above 0; if `shifts` is out of
        its domain; or if the map has more than 16 million pixels, or is none of luminance.

    Examples
    --------
    >>> import etendue as et
    >>> noisy = et.luminance_map(et.RingSource(rays=3_000_000), et.Observer(0, 0, 150), et.Screen(70, 70, 32, 32),
    ...                          method="cone")
    >>> smooth = denoise_map(noisy)
    >>> abs(smooth.intensity / noisy.intensity - 1) < 1e-12, smooth.dead_pixels
    (True, 0)
    """
    check_luminance_map(lmap, "denoise_map")
    if not (isinstance(shifts, int) and 1 <= shifts <= 1024):
        raise ArgumentError(f"denoise_map: shifts is {shifts!r}; give a whole number from 1 to 1024.")
    if lmap.values.size > 1 << 24:
        raise ArgumentError(
            f"denoise_map: the map has {lmap.values.size:,} pixels; at most 16,777,216 can be denoised."
        )
    etendue = lmap.screen.cosine(lmap.observer)  # relative: constant factors cancel
    smooth = smooth_counts(*_poisson_sums(lmap, etendue), etendue, shifts=shifts, threads=threads)
    error, notes = smooth.standard_error / etendue, (*notes_that_stay(lmap), *smooth.notes)
    values = smooth.mass / etendue
    if pixels_err_together(lmap):
        error = np.fmax(error, lmap.standard_error)
        notes = (*notes, TOGETHER)
    else:
        error = np.hypot(error, lmap.common_error * values)
    return lmap.replace(
        values=values,
        standard_error=error,
        provenance=lmap.provenance.then(f"denoised by trees, edges and rings, {shifts} shifts"),
        notes=notes,
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
    if not pixels_err_together(lmap):
        # What all pixels err by in common is no noise of counts.
        _, own = errors_parted(values, errors, lmap.common_error)
        errors = np.fmax(own, LEAST_SHARE * errors)
    return values * etendue, (errors * etendue) ** 2 * lit
