"""Intensity distributions of each symmetry, and their interpolation and integral by another route."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from etendue.quantities.intensity import Intensity
from scipy.interpolate import RegularGridInterpolator

Array = npt.NDArray[np.float64]

TERMS = {
    "none": lambda c: 0.3 * np.cos(c) + 0.2 * np.sin(c) + 0.15 * np.sin(2 * c),
    "C0-C180": lambda c: 0.4 * np.cos(c) + 0.1 * np.cos(3 * c),
    "C90-C270": lambda c: 0.4 * np.sin(c) + 0.1 * np.cos(2 * c),
    "both": lambda c: 0.5 * np.cos(2 * c),
    "rotational": lambda c: 0.0 * c,
}
"""What makes each symmetry and no other one, as a function of C [rad]."""


def lid(
    symmetry: str, *, c: npt.ArrayLike = tuple(range(0, 360, 15)), gamma: npt.ArrayLike = tuple(range(0, 181, 5))
) -> Intensity:
    """A distribution that has this symmetry and no other, different in front and behind."""
    c, gamma = np.asarray(c, dtype=np.float64), np.asarray(gamma, dtype=np.float64)
    along, around = np.radians(gamma), np.radians(c)[:, None]
    shape = 1.2 + np.cos(along) + np.sin(along) ** 2 * TERMS[symmetry](around) * (1.0 + 0.3 * np.cos(along))
    return Intensity(c, gamma, 731.25 * np.round(shape, 6))


def interpolator(intensity: Intensity) -> RegularGridInterpolator:
    """The bilinear function by scipy, on a table that is continued over both ends of the circle."""
    c = np.concatenate([intensity.c - 360.0, intensity.c, intensity.c + 360.0])
    return RegularGridInterpolator((c, intensity.gamma), np.tile(intensity.values, (3, 1)))


def flux_by_quadrature(intensity: Intensity) -> float:
    """The integral over the sphere by Gauss-Legendre points between the nodes."""
    x, w = np.polynomial.legendre.leggauss(12)
    c_edges = np.unique(np.concatenate([[0.0, 360.0], intensity.c]))
    points, weights = [], []
    for edges in (c_edges, intensity.gamma):
        half = np.diff(edges)[:, None] / 2.0
        points.append(((edges[1:] + edges[:-1])[:, None] / 2.0 + half * x).ravel())
        weights.append(np.radians(half * w).ravel())
    grid = interpolator(intensity)(tuple(np.meshgrid(*points, indexing="ij")))
    return float(weights[0] @ grid @ (weights[1] * np.sin(np.radians(points[1]))))


def hat_means(
    function: Callable[[Array, Array], Array], *, c: Array, gamma: Array, sub: int = 24
) -> tuple[Array, Array]:
    """Means of a function of (C, γ) [°] weighted by the hats of a table's nodes, and the integrals of these, by quadrature.

    A midpoint rule of `sub` points between any two nodes; all planes of a pole are one node.
    """
    part = (np.arange(sub) + 0.5) / sub
    gaps, widths = np.diff(np.append(c, 360.0)), np.diff(gamma)
    fine_c = (c[:, None] + gaps[:, None] * part).ravel()
    fine_gamma = (gamma[:-1, None] + widths[:, None] * part).ravel()
    around = np.stack([np.interp(fine_c, np.append(c, 360.0), np.append(row, row[0])) for row in np.eye(c.size)])
    along = np.stack([np.interp(fine_gamma, gamma, row) for row in np.eye(gamma.size)])
    around = around * np.radians(np.repeat(gaps / sub, sub))
    along = along * np.radians(np.repeat(widths / sub, sub)) * np.sin(np.radians(fine_gamma))
    found = around @ function(fine_c[:, None], fine_gamma[None, :]) @ along.T
    weight = np.outer(around.sum(axis=1), along.sum(axis=1))
    for row in np.flatnonzero(np.isin(gamma, (0.0, 180.0))):
        found[:, row], weight[:, row] = found[:, row].sum(), weight[:, row].sum()
    return found / weight, weight


def read_by_trapezium(values: Array, *, c: Array, gamma: Array) -> float:
    """The flux of a table as readers find it: the trapezium rule over I sin γ along γ, and around all planes."""
    belts = np.trapezoid(values * np.sin(np.radians(gamma)), np.radians(gamma), axis=1)
    if c.size == 1:
        return float(2.0 * np.pi * belts[0])
    return float(np.trapezoid(np.append(belts, belts[0]), np.radians(np.append(c, c[0] + 360.0))))
