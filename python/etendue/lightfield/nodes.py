"""From the means of cells to the values at their centres, between which a field is linear."""

from __future__ import annotations

import numpy as np

from etendue.lightfield.counting import FloatArray

LARGEST_STEP = 8.0
"""Factor by which the value at a cell's centre may differ from the cell's mean."""


def node_values(means: FloatArray) -> FloatArray:
    """Values at the cell centres whose linear interpolation has, to second order, the given means over the cells.

    The mean of the interpolation over a cell is ¾ of its own value and ⅛ of either neighbour's along each axis, and at a
    border ⅞ of its own: call that T v. One step of v ← v + (m - T v) from v = m takes away the blur of T but for its
    square; steps beyond a factor of 8 would be noise, or the shadow of an edge, and are cut off. Theory eq. 39.

    Examples
    --------
    >>> node_values(np.array([1.0, 1.0, 4.0, 4.0])).tolist()
    [1.0, 0.625, 4.375, 4.0]
    """
    blurred = means
    for axis in range(means.ndim):
        if means.shape[axis] == 1:
            continue
        lower = np.roll(blurred, 1, axis)
        upper = np.roll(blurred, -1, axis)
        _at(lower, axis, 0)[...] = _at(blurred, axis, 0)
        _at(upper, axis, -1)[...] = _at(blurred, axis, -1)
        blurred = 0.75 * blurred + 0.125 * (lower + upper)
    sharpened: FloatArray = np.clip(2.0 * means - blurred, means / LARGEST_STEP, means * LARGEST_STEP)
    return sharpened


def _at(values: FloatArray, axis: int, index: int) -> FloatArray:
    """One layer across an axis, as a view."""
    return values[(slice(None),) * axis + (slice(index, index + 1) if index >= 0 else slice(-1, None),)]
