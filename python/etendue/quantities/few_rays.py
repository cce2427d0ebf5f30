"""What one ray more or less amounts to at the nodes of a far field: errors where few rays came."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.quantities.angle_table import hat_integrals
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]

ENOUGH = 8.0
"""Equal rays of the nodes around that tell the flux of a ray there."""

SECTORS = 64
"""Parts around the axis in which the flux of a ray is looked for first, row by row; then in half as many, of two rows."""


class NodeSums(NamedTuple):
    """What rays add up to at nodes, row by row, and where these are.

    Parameters
    ----------
    gamma : array, shape (rows,)
        Rows [°].
    row, c : array, shape (nodes,)
        Number of the row, and angle C [°].
    flux, error : array, shape (nodes,)
        Σ w φ, and √(Σ (w φ)²); NaN, or anything, where no ray came.

    Examples
    --------
    >>> gamma, row, c = np.array([0.0, 90.0, 180.0]), np.array([0, 1, 1, 2]), np.array([0.0, 0.0, 180.0, 0.0])
    >>> NodeSums(gamma, row, c, flux=np.array([1.0, 2, 2, 0]), error=np.array([0.1, 0.2, 0.2, np.nan])).flux.sum()
    np.float64(5.0)
    """

    gamma: Array
    row: npt.NDArray[np.intp]
    c: Array
    flux: Array
    error: Array


def one_ray(sums: NodeSums) -> Array:
    """√(Σ (w φ)²) that one ray has at each node on average, shape (nodes,); 0 if no error is known.

    n rays of flux w that are expected in the hat φ of a node give it n w ∫φ, with the variance n w² ∫φ². So they are like
    m = n ∫φ/r rays that each give it w r, with r = ∫φ²/∫φ: 4/9 where neither γ nor C is at its end. Seen are the shares of
    those that came, and few are uncertain by more than the root of the squares of what came: a ray at the edge of a hat
    gives next to nothing, and nothing ± next to nothing is wrong. As Poisson counts m ± √(m + 1) do, errors get that of one
    ray beside the sum of squares: (w r)².

    The flux w of a ray is Σ w²/Σ w of the nodes around that have `ENOUGH` rays, the fewest ones.

    Examples
    --------
    >>> row, c = np.repeat([0, 1, 2, 3], [1, 4, 4, 1]), np.array([0.0, *2 * [0, 90, 180, 270], 0])
    >>> flux = np.array([0.0, 0.001, 5, 5, 5, 5, 5, 5, 5, 0])
    >>> one_ray(NodeSums(np.array([0.0, 60, 120, 180]), row, c, flux, np.sqrt(flux * 0.42 * 0.7))).round(2).tolist()[:3]
    [0.32, 0.29, 0.29]
    """
    known = (sums.flux > 0.0) & (sums.error > 0.0)
    flux = np.where(known, sums.flux, 0.0)
    share = _square_share(sums.gamma)[sums.row] * np.where(np.bincount(sums.row) > 1, 2.0 / 3.0, 1.0)[sums.row]
    squares = np.where(known, sums.error, 0.0) ** 2 / share
    typical, found = np.zeros(flux.size), np.zeros(flux.size, dtype=np.bool_)
    level, whole = 0, False
    while not (whole or found.all()):
        sectors = max(SECTORS >> level, 1)
        cell = (sums.row >> level) * sectors + (sums.c / (360.0 / sectors)).astype(np.intp)
        whole = sectors == 1 and sums.gamma.size >> level == 0
        held, held_squares = np.bincount(cell, flux), np.bincount(cell, squares)
        enough = (held_squares > 0.0) & ((held**2 >= ENOUGH * held_squares) | whole)
        each = np.divide(held_squares, held, out=np.zeros(held.size), where=enough)
        typical = np.where(found, typical, each[cell])
        found |= enough[cell]
        level += 1
    return typical * share


def _square_share(gamma: Array) -> Array:
    """∫φ² sin γ dγ over ∫φ sin γ dγ of each row.

    Examples
    --------
    >>> _square_share(np.array([0.0, 1.0, 2.0, 180.0])).round(3).tolist()[:2]
    [0.5, 0.667]
    """
    low, width = np.radians(gamma[:-1])[:, None], np.radians(np.diff(gamma))[:, None]
    nodes, weights = gauss_legendre(8)
    up = (nodes + 1.0) / 2.0
    belt = np.sin(low + width * up) * width * weights / 2.0
    squares = np.zeros(gamma.size)
    squares[:-1] += (belt * (1.0 - up) ** 2).sum(axis=1)
    squares[1:] += (belt * up**2).sum(axis=1)
    return squares / hat_integrals(gamma)
