"""How the errors of the nodes of an intensity distribution hang together."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import NEIGHBOURS

Array = npt.NDArray[np.float64]


def known_errors(intensity: Intensity) -> Array:
    """Standard errors of the nodes, shape (n_c, n_gamma) [unit of the intensity].

    Where a table with errors knows none, it is that of a single ray, which is its value.

    Examples
    --------
    >>> import math
    >>> known_errors(Intensity([0], [0, 45, 90], [[4.0, 1, 0]], [[0.5, math.nan, math.nan]])).tolist()
    [[0.5, 1.0, 0.0]]
    """
    errors = intensity.standard_error
    return np.where(np.isnan(errors) & np.isfinite(errors).any(), np.abs(intensity.values), errors)


def shared_around(first: Array, second: Array) -> float:
    """Covariance of two sums over nodes around the axis, in units of the squares of their errors.

    Parameters
    ----------
    first, second : array, shape (n,)
        Weight of each node in the two sums. Neighbours have the correlation ¼; of two nodes, each is the other's
        neighbour twice.

    Examples
    --------
    >>> shared_around(np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    0.5
    """
    beside = np.roll(second, 1) + np.roll(second, -1)
    return float(first @ second + NEIGHBOURS * (first @ beside))
