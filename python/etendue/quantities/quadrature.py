"""The rule of Gauss and Legendre, whose nodes take longer to find than most sums over them."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MOST = 64
"""Rules that are kept, those asked for last."""


@functools.lru_cache(maxsize=MOST)
def gauss_legendre(n: int) -> tuple[Array, Array]:
    """Nodes and weights of the rule of `n` nodes from -1 to 1, of shape (n,). They are shared: nobody can write to them.

    Examples
    --------
    >>> x, w = gauss_legendre(3)
    >>> round(float(w @ x**4), 12)  # 2/5
    0.4
    """
    nodes, weights = np.polynomial.legendre.leggauss(n)
    for values in (nodes, weights):
        values.flags.writeable = False
    return nodes, weights
