"""How the errors of the nodes of an intensity distribution hang together."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import NEIGHBOURS

Array = npt.NDArray[np.float64]


def known_errors(intensity: Intensity) -> Array:
    """Standard errors of the nodes: where a table with errors knows none, that of a single ray, which is its value.

    Examples
    --------
    >>> import math
    >>> known_errors(Intensity([0], [0, 45, 90], [[4.0, 1, 0]], [[0.5, math.nan, math.nan]])).tolist()
    [[0.5, 1.0, 0.0]]
    """
    errors = intensity.standard_error
    return np.where(np.isnan(errors) & np.isfinite(errors).any(), np.abs(intensity.values), errors)


def covariance_around(nodes: int) -> Array:
    """Of the errors of nodes around the axis, in units of their squares; of two, each is the other's neighbour twice.

    Examples
    --------
    >>> covariance_around(2).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """
    one = np.eye(nodes)
    return one + NEIGHBOURS * (np.roll(one, 1, axis=0) + np.roll(one, -1, axis=0))
