"""Light that few of the passes of a map find: what pixels that have not found it yet may lack."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FEWEST = 12
"""Passes from which their moments tell rare light."""

RARE = 3.0
"""Passes that hold the spread of a pixel, fewer than which are few: of 16 normal ones it is more than 5."""

BORDERS = (1, 4, 12)
"""Pixels on each side of one, of the neighbourhoods in which rare light is looked for: the rarer it is, the farther off."""

FEWEST_FINDS = 2
"""Pixels of a neighbourhood that have found rare light: one alone may be an accident of its own spread."""


class RareLight:
    """Variances that pixels have at least, by scattered light that single passes found, theirs or those of their neighbours.

    A pixel that is lit by a wall close to a lamp, or through a narrow lobe, finds most of its light on few lines of sight.
    Where none of its passes has found any, their spread tells nothing of it: value and error are both too small. The spread
    of a pixel's passes is held by K = (Σ d²)²/Σ d⁴ of them, d being what each differs from their mean: n over their
    kurtosis, about n/3 of n normal ones, and about 1 if a single pass differs. Where K is small

    - the pixel's own variance rests on few passes, and is no less than the mean of those beside it;
    - it is that of rare light, and its mean over a neighbourhood is what every pixel there is expected to have of it, found
      or not; farther off than the next pixels, relative to the luminance that is usual at either place.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns.

    Examples
    --------
    >>> import numpy as np
    >>> light = np.ones((16, 2, 2))
    >>> light[3, 0, 0] = light[8, 0, 1] = 33.0
    >>> rare = RareLight((2, 2))
    >>> for values in light:
    ...     rare.add(values)
    >>> rare.least_variance(np.ones((2, 2), dtype=bool)).round(3).tolist()      # 2 · (32/16)² · 1/4
    [[2.0, 2.0], [2.0, 2.0]]
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self._passes = 0
        self._shape = shape
        self._moments: list[Array] | None = None
        self._room: list[Array] = []

    def add(self, values: Array) -> None:
        """One pass more: moments about the mean up to the fourth, updated as in [Pebay2008]."""
        self._passes += 1
        if self._moments is None:
            if not values.any():
                return
            self._moments = [np.zeros(self._shape) for _ in range(4)]
            # Room for what comes in between: memory that is asked for again for each pass takes longer than the sums.
            self._room = [np.zeros(self._shape) for _ in range(4)]
        n, (mean, second, third, fourth), (off, step, more, part) = self._passes, self._moments, self._room
        np.subtract(values, mean, out=off)
        np.divide(off, n, out=step)
        np.multiply(off, step, out=more)
        more *= n - 1
        square = np.multiply(step, step, out=off)
        for sums, one, other, times in (
            (fourth, more, square, n * n - 3 * n + 3),
            (fourth, square, second, 6),
            (fourth, step, third, -4),
            (third, more, step, n - 2),
            (third, step, second, -3),
        ):
            np.multiply(one, other, out=part)
            part *= times
            np.add(sums, part, out=sums)
        second += more
        mean += step

    def least_variance(self, diffuse: npt.NDArray[np.bool_]) -> Array:
        """The least variances of the means of pixels, 0 where there is nothing to tell.

        Parameters
        ----------
        diffuse : array of bool, shape (rows, columns)
            Pixels that see a diffuse surface, which scattered light may reach though none was found.
        """
        if self._moments is None or self._passes < FEWEST:
            return np.zeros(self._shape)
        mean, second, _, fourth = self._moments
        possible = diffuse | (mean > 0.0)
        rare = second * second < RARE * fourth
        if not rare.any():
            return np.zeros(self._shape)
        variance = second / (self._passes * (self._passes - 1))
        root = np.sqrt(np.maximum(mean, 0.0))
        least = np.zeros(self._shape)
        for border in BORDERS:
            pixels = np.maximum(_around(possible, border), 1.0)
            several = _around(rare, border) >= FEWEST_FINDS
            if border == BORDERS[0]:
                every, found = (_around(part, border) / pixels for part in (variance, variance * rare))
                least = np.where(rare, every, np.where(several, found, 0.0))
                continue
            usual = (_around(root, border) / pixels) ** 2
            relative = np.divide(variance * rare, usual**2, out=np.zeros(self._shape), where=usual > 0.0)
            found = np.where(several, _around(relative, border) / pixels, 0.0)
            least = np.maximum(least, found * np.minimum(mean, usual) ** 2)
        return np.where(possible, least, 0.0)


def _around(values: npt.NDArray[Any], border: int) -> Array:
    """Sums over each pixel and its neighbours, of values that are not negative."""
    sums = values.astype(np.float64)
    for axis in (0, 1):
        sums = np.moveaxis(sums, axis, 0)
        last = len(sums)
        up_to = np.concatenate([np.zeros((1, sums.shape[1])), sums.cumsum(axis=0)])
        place = np.arange(last)
        sums = up_to[np.minimum(place + border + 1, last)] - up_to[np.maximum(place - border, 0)]
        sums = np.moveaxis(np.maximum(sums, 0.0), 0, axis)
    return sums
