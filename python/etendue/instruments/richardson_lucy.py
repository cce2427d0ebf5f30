"""Richardson and Lucy's iteration, on any number of scans at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


LEAST = 1e-6
"""Of the largest value of the start: what is 0 there would stay 0."""


def iterations(
    matrix: Any,
    measured: Array,
    start: Array,
    background: float | Array = 0.0,
    shrink: Callable[[Array], Array] | None = None,
) -> Iterator[tuple[Array, Array]]:
    """Lobes one after the other: x ← x · Aᵀ(y/(A x + b))/Aᵀ1 [Richardson1972]_, without end.

    Parameters
    ----------
    matrix : array or sparse matrix, shape (n, m)
        A.
    measured : array, shape (n,) or (n, k)
        y with the background b in it; what lies below 0 counts as 0.
    start : array, shape (m,) or (m, k)
        The lobe that the iteration begins with; 0 is raised to a millionth of the largest value.
    background : number, or array of shape (n,)
        b.
    shrink : callable, optional
        By x what each step multiplies x with besides: what a prior says.

    Yields
    ------
    x, A x : array, shapes (m,) and (n,), or (m, k) and (n, k)

    Examples
    --------
    >>> blur = np.array([[0.8, 0.2], [0.2, 0.8]])
    >>> steps = iterations(blur, np.array([1.0, 4.0]), np.ones(2))
    >>> for _ in range(20_000):
    ...     x, _ = next(steps)
    >>> x.round(3).tolist(), round(float((blur @ x).sum()), 6)
    ([0.0, 5.0], 5.0)
    """
    y = np.maximum(measured, 0.0)
    x = np.maximum(start, LEAST * start.max(axis=0))
    weight = np.asarray(matrix.T @ np.ones(y.shape[0]))
    seen = weight > 1e-9 * weight.max()
    per = np.where(seen, 1.0 / np.where(seen, weight, 1.0), 0.0).reshape((-1,) + (1,) * (y.ndim - 1))
    b = np.reshape(background, (-1,) + (1,) * (y.ndim - 1))
    image = matrix @ x
    while True:
        total = image + b
        ratio = np.divide(y, total, out=np.zeros_like(total), where=total > 0.0)
        x = x * (matrix.T @ ratio) * (per if shrink is None else per * shrink(x))
        image = matrix @ x
        yield x, image


def deviances(counts: Array, expected: Array) -> Array:
    """2 (n ln(n/μ) + μ − n): 1 on average if n is Poisson about μ, both large.

    Examples
    --------
    >>> round(float(deviances(np.array(100.0), np.array(110.0))), 3)
    0.938
    """
    mean = np.maximum(expected, 1e-12)
    log = np.where(counts > 0.0, counts * np.log(np.maximum(counts, 1e-300) / mean), 0.0)
    return np.asarray(2.0 * (log + mean - counts))
