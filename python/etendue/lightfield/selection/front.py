"""Where a source looks."""

from __future__ import annotations

import numpy as np

from etendue.lightfield.counting import FloatArray

FLAT = 1e-4
"""Thickness, against the extent, up to which start points lie in a plane: single precision and what tools round."""


def mean_direction(direction: FloatArray, flux: FloatArray) -> FloatArray:
    """Flux-weighted mean of unit vectors, shape (3,): shorter than 1 by how far they spread.

    Examples
    --------
    >>> mean_direction(np.array([[0.0, 0.6, 0.8], [0.0, -0.6, 0.8]]), np.ones(2)).tolist()
    [0.0, 0.0, 0.8]
    """
    mean: FloatArray = np.average(direction, weights=flux, axis=0)
    return mean


def start_normal(position: FloatArray, towards: FloatArray) -> FloatArray | None:
    """The normal of the plane on which rays start, on the side of their mean direction; None if they start on none.

    Parameters
    ----------
    position : array, shape (n, 3)
        Start points [mm].
    towards : array, shape (3,)
        The mean direction, of any length.

    Examples
    --------
    >>> corners = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 0], [1, 1, 1]], dtype=float)
    >>> (start_normal(corners, np.array([-1.0, 0.0, 1.0])) * 2**0.5).round(9).tolist()
    [-1.0, 0.0, 1.0]
    """
    away = position - position.mean(axis=0)
    extents, axes = np.linalg.eigh(away.T @ away)
    # Of a line or a point there is no one plane.
    if not extents[0] <= FLAT**2 * extents[1]:
        return None
    normal: FloatArray = axes[:, 0]
    return normal if normal @ towards > 0 else -normal
