"""What rays add up to in the hats of even steps of an angle, for steps that are halved again and again."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.quantities.angle_table import even_hats

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.intp]

FEWEST_CELLS = 1 << 12
"""Cells of the finest table of moments, at least; else one for each ray."""


class HatSums(NamedTuple):
    """Sums over rays of weight w, each of shape (rows, nodes), with h the hat of a node and h₂ one of half its width."""

    change: Array
    """Σ w (h₂/∫h₂ − h/∫h): how much the value of the node changes if the steps are halved."""
    variance: Array
    """Σ of the squares of its terms."""
    held: Array
    """Σ w h."""
    squares: Array
    """Σ (w h)²."""
    wide: Array | float
    """∫h [°], or weighed by the sine of γ."""


@dataclasses.dataclass(frozen=True)
class Hats:
    """Rays at angles γ from 0° to 180°, or C from 0° to 360°, in rows that are looked at each by itself.

    A hat is linear over each half of a step. So what rays add up to, and their squares, is known from five moments of each
    half, and those of a step from those of its halves: few passes over the rays tell the sums for all widths of steps but
    those in which there are fewer rays than steps.

    Parameters
    ----------
    angle, weight, row : array, shape (n,)
        Angle [°], weight, and number of the row.
    rows : int
        Rows.
    span : float
        180 or 360 [°]. At the ends of the former are nodes of their own, those of the latter are one.
    moments : list of array, shape (5, rows, cells)
        Σw, Σwt, Σw², Σw²t, Σw²t² of even cells, with t from 0 to 1 in each: of the finest ones, and of wider ones.

    Examples
    --------
    >>> hats = Hats.of(np.array([10.0, 50.0]), np.ones(2), np.zeros(2, dtype=np.intp), 1, 360.0, 1, 3)
    >>> hats.sums(4).held.round(3).tolist()
    [[1.333, 0.667, 0.0, 0.0]]
    """

    angle: Array
    weight: Array
    row: Counts
    rows: int
    span: float
    moments: list[Array]

    @classmethod
    def of(cls, angle: Array, weight: Array, row: Counts, rows: int, span: float, widest: int, depth: int) -> Hats:
        """For `widest` steps of the span, and those halved up to `depth` times."""
        cells = 2 * widest
        while cells < widest << depth and 2 * cells * rows <= max(FEWEST_CELLS, angle.size):
            cells *= 2
        place = angle / (span / cells)
        first = np.minimum(place.astype(np.intp), cells - 1)
        t = np.subtract(place, first, out=place)
        index = row * cells + first
        finest = np.zeros((5, rows * cells))
        term = weight
        for moment in range(5):
            term = weight * weight if moment == 2 else term if moment == 0 else term * t
            finest[moment] = np.bincount(index, term, rows * cells)
        moments = [finest.reshape(5, rows, cells)]
        while moments[-1].shape[2] > 2 * widest:
            moments.append(_halved(moments[-1]))
        return cls(angle, weight, row, rows, span, moments)

    def sums(self, size: int) -> HatSums:
        """Of so many even steps; of C two or more, between which there are as many nodes."""
        wide: Array | float = self.span / size
        narrow: Array | float = self.span / size / 2.0
        if self.span == 180.0:
            wide, narrow = even_hats(size)
        known = next((table for table in self.moments if table.shape[2] == 2 * size), None)
        if known is None:
            return self._by_rays(size, wide, narrow)
        return self._by_moments(known, wide, narrow)

    def _by_moments(self, table: Array, wide: Array | float, narrow: Array | float) -> HatSums:
        left, right = table[:, :, 0::2], table[:, :, 1::2]
        poles = self.span == 180.0
        sums = np.zeros((4, self.rows, left.shape[2] + poles))
        for first in (True, False):
            at = slice(None, -1) if first else slice(1, None)
            wider = wide if isinstance(wide, float) else wide[at]
            narrower = narrow if isinstance(narrow, float) else narrow[at]
            # What is left of the middle of a step, and right of it, with s from 0 to 1 there: a + b s, as hat and as change.
            hats = ((1.0, -0.5), (0.5, -0.5)) if first else ((0.0, 0.5), (0.5, 0.5))
            halves = ((1.0, -1.0), (0.0, 0.0)) if first else ((0.0, 0.0), (0.0, 1.0))
            some = np.zeros((4, self.rows, left.shape[2]))
            for moments, (a, b), (c, d) in zip((left, right), hats, halves, strict=True):
                some[:2] += _linear(moments, c / narrower - a / wider, d / narrower - b / wider)
                some[2:] += _linear(moments, a, b)
            if not poles:
                sums += some if first else np.roll(some, 1, axis=2)
            else:
                sums[:, :, at] += some
        change, variance, held, squares = sums
        return HatSums(change, variance, held, squares, wide)

    def _by_rays(self, size: int, wide: Array | float, narrow: Array | float) -> HatSums:
        nodes = size + (self.span == 180.0)
        place = self.angle / (self.span / size)
        first = np.minimum(place.astype(np.intp), size - 1)
        on = np.subtract(place, first, out=place)
        second = first + 1
        second[second == nodes] = 0
        row = self.row * nodes
        sums = np.zeros((4, self.rows * nodes))
        # The values of many rays are made in the same places: fresh ones take as long as what is reckoned.
        hat, other = 1.0 - on, np.zeros(on.shape)
        for node in (first, second):
            if node is second:
                hat = on
            half = np.maximum(np.subtract(np.multiply(hat, 2.0, out=other), 1.0, out=other), 0.0, out=other)
            half /= narrow if isinstance(narrow, float) else narrow[node]
            half -= hat / (wide if isinstance(wide, float) else wide[node])
            half *= self.weight
            index = row + node
            sums[0] += np.bincount(index, half, self.rows * nodes)
            half *= half
            sums[1] += np.bincount(index, half, self.rows * nodes)
            w = np.multiply(self.weight, hat, out=half)
            sums[2] += np.bincount(index, w, self.rows * nodes)
            w *= w
            sums[3] += np.bincount(index, w, self.rows * nodes)
        change, variance, held, squares = sums.reshape(4, self.rows, nodes)
        return HatSums(change, variance, held, squares, wide)


def _linear(moments: Array, a: Array | float, b: Array | float) -> Array:
    """Σ w (a + b t) and Σ w² (a + b t)² in each cell, shape (2, rows, cells)."""
    squares = a * a * moments[2] + 2.0 * a * b * moments[3] + b * b * moments[4]
    # Rays all of which lie where a + b t is 0 may leave less than nothing, by rounding.
    return np.stack([a * moments[0] + b * moments[1], np.maximum(squares, 0.0)])


def _halved(moments: Array) -> Array:
    """The moments of cells that are twice as wide."""
    left, right = moments[:, :, 0::2], moments[:, :, 1::2]
    found = left + right
    found[1] = (left[1] + right[0] + right[1]) / 2.0
    found[3] = (left[3] + right[2] + right[3]) / 2.0
    found[4] = (left[4] + right[2] + 2.0 * right[3] + right[4]) / 4.0
    return found
