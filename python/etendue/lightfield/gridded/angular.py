"""Angular bins: steps 4b to 4h of section 3.2.2 of [Audenaert2014]_, eqs. 3.1 to 3.3.

All bin edges of all steps of the sequence lie on multiples of half a degree, in θ and in φ. A direction is therefore
reduced to whole numbers first, its *ring* (half degrees of θ) and its *sector* (half degrees of φ), and a bin of any step
is a block of them. No bin edge is ever computed in floating point twice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers
from etendue.quantities.patches import AngularGrid

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

RINGS, SECTORS = 180, 720
"""Half degrees of θ from 0° to 90°, and of φ around the circle."""

COARSEST = (30, 90)
"""Δθ and Δφ of the first iteration [°]."""


FINEST = (1, 1)
"""Those of the last one [°], "a predefined minimum value"."""

WHOLE = (90, 360)
"""What Δθ and Δφ divide [°]."""


def sequence(coarsest: Sequence[int] = COARSEST, finest: Sequence[int] = FINEST) -> tuple[AngularGrid, ...]:
    """Steps that divide the quarter and the circle, k-th with k-th; the shorter list stays at its last step.

    Parameters
    ----------
    coarsest, finest : sequence of int, length 2
        Δθ and Δφ of the first and of the last iteration, whole degrees.

    Raises
    ------
    ArgumentError
        If one of them does not divide 90° or 360°, or the finest is above the coarsest.

    Examples
    --------
    >>> [(grid.theta_step, grid.phi_step) for grid in sequence((18, 60), (9, 36))]
    [(18, 60), (15, 45), (10, 40), (9, 36)]
    """
    for told, given in (("coarsest", coarsest), ("finest", finest)):
        wanted = "two whole numbers of degrees, Δθ and Δφ"
        shape = as_numbers(given, f"{told} bins", wanted).shape
        if shape != (2,):
            raise ArgumentError(f"{told} bins: shape {shape}; give {wanted}.")
    lists = []
    for name, whole, first, last in zip(("Δθ", "Δφ"), WHOLE, coarsest, finest, strict=True):
        steps = [step for step in range(whole, 0, -1) if whole % step == 0]
        for told, step in (("coarsest", first), ("finest", last)):
            if step not in steps:
                able = ", ".join(map(str, steps))
                raise ArgumentError(
                    f"{told} bins: {name} is {step}°, which does not divide {whole}°; give one of {able}."
                )
        if last > first:
            raise ArgumentError(f"the finest bins have {name} = {last}°, more than the coarsest, {first}°.")
        lists.append([step for step in steps if last <= step <= first])
    longest = max(map(len, lists))
    thetas, phis = (steps + steps[-1:] * (longest - len(steps)) for steps in lists)
    return tuple(AngularGrid(*pair) for pair in zip(thetas, phis, strict=True))


SEQUENCE = sequence()
"""Step 4h: (30°, 90°), (18°, 72°), (15°, 60°) … (1°, 18°), (1°, 15°) … (1°, 1°)."""


def rings_and_sectors(direction: Array) -> tuple[Indices, Indices]:
    """Ring and sector of directions in the axes of their patch (steps 4a and 4b).

    Parameters
    ----------
    direction : array, shape (m, 3)
        Unit vectors.

    Returns
    -------
    ring : array of int, shape (m,)
        Half degrees of θ: 0 to 179, and 180 or more where θ ≥ 90°, for which there is no bin.
    sector : array of int, shape (m,)
        Half degrees of φ, 0 to 719.

    Examples
    --------
    >>> rings_and_sectors(np.array([[0, 0, 1], [0.6, -0.8, 0], [0, 0.6, 0.8]]))
    (array([  0, 180,  73]), array([  0, 613, 180]))
    """
    x, y, z = direction.T
    ring = (np.arctan2(np.hypot(x, y), z) * (RINGS / (np.pi / 2))).astype(np.intp)
    sector = np.floor(np.arctan2(y, x) * (SECTORS / (2 * np.pi))).astype(np.intp)
    # -1e-20 is sector -1, and half a turn may be rounded up to 360.
    sector[sector < 0] += SECTORS
    return ring, sector


def bin_of(grid: AngularGrid, ring: Indices, sector: Indices) -> Indices:
    """Number of the bin of rings and sectors, row by row (step 4d).

    The first bin of θ reaches from 0° to Δθ/2, the others are centred on whole multiples of Δθ; those of φ are centred on
    whole multiples of Δφ. Edges belong to the bin above them.

    Examples
    --------
    >>> bin_of(AngularGrid(30, 90), np.array([0, 29, 30, 179]), np.array([0, 89, 90, 719])).tolist()
    [0, 0, 5, 12]
    """
    rows = (ring + grid.theta_step) // (2 * grid.theta_step)
    columns = (sector + grid.phi_step) // (2 * grid.phi_step) % grid.shape[1]
    index: Indices = rows * grid.shape[1] + columns
    return index


def edges(grid: AngularGrid) -> Array:
    """Bounds of the bins of θ [°], rising from 0 to 90.

    Examples
    --------
    >>> edges(AngularGrid(30, 90)).tolist()
    [0.0, 15.0, 45.0, 75.0, 90.0]
    """
    inner = (np.arange(90 // grid.theta_step) + 0.5) * grid.theta_step
    return np.concatenate([[0.0], inner, [90.0]])


def solid_angles(grid: AngularGrid) -> Array:
    """Ω of one bin in each row [sr]: eq. 3.1.

    Examples
    --------
    >>> grid = AngularGrid(18, 72)
    >>> bool(np.isclose(grid.shape[1] * solid_angles(grid).sum(), 2 * np.pi))
    True
    """
    result: Array = np.radians(grid.phi_step) * -np.diff(np.cos(np.radians(edges(grid))))
    return result


def intensities(grid: AngularGrid, flux: Array) -> Array:
    """Step 4e: intensity at the central direction of each bin, and 0 at θ = 90°.

    Parameters
    ----------
    grid : AngularGrid
        Δθ and Δφ.
    flux : array, shape (..., bins)
        Of the bins.

    Returns
    -------
    array, shape (..., rows, columns)
        Flux per sr, of `grid.shape`.

    Examples
    --------
    >>> intensities(AngularGrid(30, 90), np.ones(16)).round(2)[:, 0].tolist()
    [18.68, 2.46, 1.42, 2.46, 0.0]
    """
    rows, columns = grid.shape
    table = np.zeros((*flux.shape[:-1], rows, columns))
    table[..., :-1, :] = flux.reshape(*flux.shape[:-1], rows - 1, columns) / solid_angles(grid)[:, None]
    return table


def quadrature_factors(grid: AngularGrid) -> Array:
    """How often eq. 3.2 counts the flux of each ring, shape (RINGS,): Φ_int = Σ factor · Φ_ring.

    Eqs. 3.1 and 3.2 are linear in the flux of the bins, and Δφ cancels: what a bin of row k counts for is the weight of
    its node in eq. 3.2 over its solid angle, the same in all columns. The error E of eq. 3.3 hence does not depend on Δφ
    at all; it is blind to everything that happens along φ.

    Examples
    --------
    >>> quadrature_factors(AngularGrid(30, 90)).round(3)[[0, 30, 90, 179]].tolist()
    [1.966, 0.966, 0.82, 0.966]
    """
    one_bin = np.diag(1.0 / solid_angles(grid))
    table = np.pad(one_bin, ((0, 0), (0, 1)))
    cosine = np.cos(np.radians(grid.theta))
    rows = np.radians(grid.phi_step) * ((table[:, :-1] + table[:, 1:]) / 2.0 @ -np.diff(cosine))
    ring = np.arange(RINGS)
    factors: Array = rows[(ring + grid.theta_step) // (2 * grid.theta_step)]
    return factors


def quadrature_errors(rings: Array, grids: Sequence[AngularGrid] = SEQUENCE) -> Array:
    """Step 4g: E [%] of every step of the sequence, eq. 3.3, from the flux of the rings alone.

    Parameters
    ----------
    rings : array, shape (n, RINGS)
        Flux of each patch in each half degree of θ.
    grids : sequence of AngularGrid
        The steps.

    Returns
    -------
    array, shape (n, len(grids))
        NaN for patches without flux.

    Examples
    --------
    >>> cosine = np.cos(np.radians(np.arange(181) / 2))
    >>> lambertian = cosine[:-1] ** 2 - cosine[1:] ** 2
    >>> quadrature_errors(lambertian[None])[0, [0, 1, 5, 20]].round(4).tolist()
    [3.0126, 1.1787, 0.1364, 0.0038]
    """
    factors = np.stack([quadrature_factors(grid) for grid in grids], axis=1)
    flux = rings.sum(axis=1, keepdims=True)
    error = np.full((len(rings), len(grids)), np.nan)
    off = np.abs(np.einsum("nr,rs->ns", rings, factors) - flux)
    np.divide(100.0 * off, flux, out=error, where=flux > 0.0)
    return error


def first_within(errors: Array, threshold: float) -> Indices:
    """Step 4h: number of the first step whose error is not above the threshold [%], or of the finest one.

    Examples
    --------
    >>> first_within(np.array([[3.0, 1.0, 0.2, 0.5], [3.0, 2.5, 2.2, 2.1]]), 1.0).tolist()
    [1, 3]
    """
    within = errors <= threshold
    step: Indices = np.where(within.any(axis=1), within.argmax(axis=1), errors.shape[1] - 1)
    return step
