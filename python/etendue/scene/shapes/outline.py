"""Polygons in a plane: their area, and whether they are simple."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def signed_area(vertices: npt.ArrayLike) -> float:
    """Area of a polygon [mm²] by the shoelace formula; negative if its corners run clockwise.

    Parameters
    ----------
    vertices : array_like, shape (n, 2)
        Corners [mm].

    Examples
    --------
    >>> signed_area([(0, 0), (2, 0), (2, 3), (0, 3)])
    6.0
    """
    corners = np.asarray(vertices, dtype=np.float64)
    # From the first corner, so that a polygon far from the origin loses no digits.
    x, y = (corners - corners[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2.0)


def simple_polygon(vertices: npt.ArrayLike) -> None:
    """Refuse a polygon whose sides touch or cross anywhere but at shared corners.

    Parameters
    ----------
    vertices : array_like, shape (n, 2)
        Corners [mm].

    Raises
    ------
    ValueError
        With the numbers of the two sides.

    Examples
    --------
    >>> simple_polygon([(0, 0), (1, 1), (1, 0), (0, 1)])
    Traceback (most recent call last):
    ...
    ValueError: 'vertices': sides 0 and 2 touch or cross
    """
    start = np.asarray(vertices, dtype=np.float64)
    end = np.roll(start, -1, axis=0)
    n = len(start)
    same = np.nonzero((start == end).all(axis=1))[0]
    if same.size:
        raise ValueError(f"'vertices': corner {same[0]} stands there twice in a row")
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.argsort(low[:, 0], kind="stable")
    ends_before = np.searchsorted(low[order, 0], high[:, 0], side="right")
    for rank, side in enumerate(order):
        # Sides that begin, from left to right, between this one's beginning and its end.
        others = order[rank + 1 : ends_before[side]]
        others = others[(low[others, 1] <= high[side, 1]) & (high[others, 1] >= low[side, 1])]
        for other in others[_touch(start[side], end[side], start[others], end[others])]:
            first, second = sorted((int(side), int(other)))
            # Neighbours share a corner. If the second ran back along the first, its other end, or that of the first,
            # would lie on it, and so would the side that begins or ends there.
            if second - first in (1, n - 1):
                continue
            raise ValueError(f"'vertices': sides {first} and {second} touch or cross")
    if signed_area(start) == 0.0:
        raise ValueError("'vertices': the polygon has no area")


def _touch(a: Array, b: Array, c: Array, d: Array) -> npt.NDArray[np.bool_]:
    """Whether the segment from a to b has a point in common with each of those from c to d, whose boxes overlap."""

    def side(p: Array, q: Array, r: Array) -> Array:
        area: Array = np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )
        return area

    across = side(a, b, c) * side(a, b, d) <= 0.0
    along = side(c, d, a) * side(c, d, b) <= 0.0
    touching: npt.NDArray[np.bool_] = across & along
    return touching
