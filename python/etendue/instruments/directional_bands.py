"""How sure a deconvolved lobe is: what noise does to it, and what the stop leaves out."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.counted_scan import CountedScan, Shrink
from etendue.instruments.richardson_lucy import iterations

Array = npt.NDArray[np.float64]

FURTHER = 5
"""Times the iterations after which hardly anything is left out: from 4 to 8, bands of known lobes hold alike."""

NEAR = 0.75
"""Of the reach of the instrument function: over what surroundings a bias is averaged [standard deviations]."""


def error_of(
    counted: CountedScan, arms: Array, reach: float, count: int, shrink: Shrink, replicates: int, seed: int
) -> Array:
    """Standard errors of f at the positions [1/sr], shape (n,).

    Two parts. Noise: the spread of `replicates` scans drawn about what was found. Bias: the difference d between the lobe at
    the stop and the lobe after five times as many iterations, of which the latter is as good as unbiased. E d² is the square
    of the bias plus the variance of d, which the same replicates tell; what remains of d² after it is subtracted is averaged
    over the surroundings of each position, since a single d² is as noisy as a single count.

    Parameters
    ----------
    counted : CountedScan
        What was deconvolved.
    arms : array, shape (n, 3)
        Positions.
    reach : number
        Of the instrument function [°].
    count : int
        Iterations at which it was stopped.
    shrink : callable, optional
        Prior of the iteration.
    replicates, seed : int
        How many, and their seed.
    """
    at = counted.model.at_positions
    found = counted.after(count, shrink)
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 1))))
    expected = np.maximum(counted.expected(found), 0.0)
    drawn = rng.poisson(expected[:, None], (expected.size, replicates)).astype(np.float64)
    both = np.hstack([counted.counts[:, None], drawn])
    start = counted.start(both - counted.background[:, None])
    for i, (x, _) in enumerate(iterations(counted.matrix, both, start, counted.background, shrink), 1):
        if i == count:
            early = at @ x
        if i == FURTHER * count:
            off = at @ x - early
            break
    variance = early[:, 1:].var(axis=1, ddof=1)
    bias = off[:, 0] ** 2 - off[:, 1:].var(axis=1, ddof=1)
    return np.asarray(np.sqrt(variance + np.maximum(_surroundings(arms, NEAR * reach) @ bias, 0.0)))


def _surroundings(arms: Array, width: float) -> object:
    """Means over neighbours, by a Gaussian of a standard deviation [°], as a sparse matrix."""
    sigma = float(np.radians(width))
    tree = scipy_part("spatial").cKDTree(arms)
    apart = tree.sparse_distance_matrix(tree, 3.0 * sigma, output_type="coo_matrix")
    sparse = scipy_part("sparse")
    near = sparse.csr_array((np.exp(-0.5 * (apart.data / sigma) ** 2), (apart.row, apart.col)), shape=apart.shape)
    return sparse.csr_array(near.multiply(1.0 / near.sum(axis=1)[:, None]))
