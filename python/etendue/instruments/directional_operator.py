"""What an instrument shows of a lobe in two dimensions, as a sparse matrix from its geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.bench import Bench
from etendue.instruments.lobe_splines import LobeSplines

Array = npt.NDArray[np.float64]

FINENESS = (4, 5)
"""Nodes across beam and aperture."""


def matrix_of(
    bench: Bench, arms: Array, theta: float, splines: LobeSplines, fineness: tuple[int, int] = FINENESS
) -> Any:
    """From weights of splines to the share of the beam in the aperture at each position, a sparse matrix.

    Each element is the integral of a spline over beam and aperture: the spot is an ellipse at an angle of incidence, seen
    from each position in its own way, and the étendue of each line holds |cos θₛ|. f is a function of β − β₀: a ray that
    comes from another direction sees the lobe moved.

    Parameters
    ----------
    bench : Bench
        The instrument.
    arms : array, shape (n, 3)
        Positions.
    theta : number
        Angle of incidence [°].
    splines : LobeSplines
        m of them.
    fineness : (int, int)
        Nodes across beam and aperture.

    Returns
    -------
    scipy.sparse.csr_array, shape (n, m)
    """
    sparse = scipy_part("sparse")
    m = splines.count
    blocks = []
    for sight in bench.sights(arms, theta, *fineness):
        i = len(sight.scattered)
        # β − β₀ + β₀ of the axis: β₀ = −(incident x, y).
        shift = sight.incident[:, :2] - np.array([-np.sin(np.radians(theta)), 0.0])
        beta = sight.scattered[..., :2] + shift[None, :, None]
        numbers, values = splines.rows(beta.reshape(-1, 2))
        weights = sight.weights.reshape(-1)
        row = np.repeat(np.arange(i), weights.size // i)
        numbers += (row * (m + 1) + 1)[:, None]
        dense = np.bincount(numbers.ravel(), (values * weights[:, None]).ravel(), i * (m + 1)).reshape(i, m + 1)
        blocks.append(sparse.csr_array(dense[:, 1:]))
    return sparse.csr_array(sparse.vstack(blocks, format="csr"))
