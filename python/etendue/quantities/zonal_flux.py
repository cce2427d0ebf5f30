"""Flux of an intensity distribution between cones about its axis."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.angle_table import gaps_of, hat_integrals, kinks_along, kinks_around
from etendue.quantities.arguments import INTENSITY, as_numbers, require
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import NEIGHBOURS
from etendue.quantities.node_errors import known_errors, shared_around

Array = npt.NDArray[np.float64]


def zonal_flux(intensity: Intensity, edges: npt.ArrayLike) -> tuple[Array, Array]:
    """Flux between cones about the axis, as tables of UGR and of utilisation factors need it.

    Parameters
    ----------
    intensity : Intensity
        The distribution.
    edges : array_like, shape (n + 1,)
        γ of the cones [°], rising, 0 to 180.

    Returns
    -------
    (array, array), each of shape (n,)
        Flux of each zone and its standard error [`flux_unit`]: the exact integral of the bilinear function. Errors of
        nodes add as those of a far field made of rays do, neighbours having a correlation of ¼; where nodes err together
        (`Intensity.smooth`) they add as they are, an upper bound. NaN where no error is known, as of zones that no ray
        reached.

    Raises
    ------
    ArgumentError
        If the angles do not rise, or leave 0° to 180°.

    Examples
    --------
    A Lambertian emitter of 1 cd sends π sin² γ into the cone γ:

    >>> import numpy as np
    >>> gamma = np.arange(0, 90.1, 0.5)
    >>> lambertian = Intensity(c=[0], gamma=gamma, values=[np.cos(np.radians(gamma))])
    >>> (zonal_flux(lambertian, [0, 30, 60, 90])[0] / np.pi).round(4).tolist()
    [0.25, 0.5, 0.25]
    """
    require(intensity, Intensity, "zonal_flux: intensity", INTENSITY)
    wanted = as_numbers(edges, "zonal_flux: edges", "two or more angles γ that rise")
    if wanted.ndim != 1 or wanted.size < 2 or not (np.isfinite(wanted).all() and (np.diff(wanted) > 0.0).all()):
        raise ArgumentError("zonal_flux: give at least two angles γ that rise.")
    if wanted[0] < 0.0 or wanted[-1] > 180.0:
        raise ArgumentError(f"zonal_flux: γ runs from {wanted[0]:g}° to {wanted[-1]:g}°; it must be 0 to 180.")
    weights = np.array([_zone_weights(intensity.gamma, low, high) for low, high in itertools.pairwise(wanted)])
    gaps = np.radians(gaps_of(intensity.c))
    planes = (gaps + np.roll(gaps, 1)) / 2.0
    flux = np.asarray(weights @ (planes @ intensity.values))
    errors = known_errors(intensity)
    if np.isnan(errors).all():
        return flux, np.full(flux.size, np.nan)
    # Of nodes that no ray reached, no error is known; of what lies beyond the table, nothing is missing.
    dark = np.isnan(intensity.standard_error).all(axis=0) & ~intensity.values.any(axis=0)
    unknown = (weights[:, dark] > 0.0).any(axis=1) & ~(weights[:, ~dark] > 0.0).any(axis=1)
    if intensity.smooth:
        return flux, np.where(unknown, np.nan, weights @ (planes @ errors))
    kinks = kinks_around(intensity.c, intensity.values)
    around = np.array([_around(intensity.c, *row) for row in zip(kinks.T, errors.T, strict=True)])
    # Between two rows of nodes the function is linear in γ: its weight is that of the two.
    rows = kinks_along(intensity.gamma, intensity.values).any(axis=0)
    nodes = intensity.gamma[rows]
    row, up = _between(nodes, intensity.gamma)
    spread = np.zeros((wanted.size - 1, nodes.size))
    np.add.at(spread.T, row, ((1.0 - up) * weights).T)
    np.add.at(spread.T, row + 1, (up * weights).T)
    spread *= around[rows]
    error = np.sqrt((spread**2).sum(axis=1) + 2.0 * NEIGHBOURS * (spread[:, 1:] * spread[:, :-1]).sum(axis=1))
    return flux, np.where(unknown, np.nan, error)


def _zone_weights(gamma: Array, low: float, high: float) -> Array:
    """What each node γ contributes to ∫ sin γ dγ of the piecewise linear function from `low` to `high`."""
    weights = np.zeros(gamma.size)
    low, high = max(low, float(gamma[0])), min(high, float(gamma[-1]))
    if not high > low:
        return weights
    inner = np.concatenate([[low], gamma[(gamma > low) & (gamma < high)], [high]])
    row, up = _between(gamma, inner)
    hats = hat_integrals(inner)
    np.add.at(weights, row, (1.0 - up) * hats)
    np.add.at(weights, row + 1, up * hats)
    return weights


def _between(gamma: Array, wanted: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The node before each angle, and how far it is on the way to the next one, 0 to 1."""
    row = (np.searchsorted(gamma, wanted, side="right") - 1).clip(0, gamma.size - 2)
    return row, (wanted - gamma[row]) / (gamma[row + 1] - gamma[row])


def _around(c: Array, kinks: npt.NDArray[np.bool_], errors: Array) -> float:
    """Standard error of the integral over C of one row."""
    if kinks.sum() < 2:
        return 2.0 * math.pi * float(errors[0])
    gaps = np.radians(gaps_of(c[kinks]))
    spread = errors[kinks] * (gaps + np.roll(gaps, 1)) / 2.0
    return math.sqrt(shared_around(spread, spread))
