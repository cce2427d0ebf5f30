"""Many vectors of three components at once."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def lengths(vectors: Array) -> Array:
    """Lengths of vectors of shape (…, 3), in a fraction of the time that `numpy.linalg.norm` takes for so short ones.

    Examples
    --------
    >>> lengths(np.array([[1.0, 2.0, 2.0], [0.0, 3.0, 4.0]])).tolist()
    [3.0, 5.0]
    """
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.asarray(np.sqrt(x * x + y * y + z * z))
