"""Light that few of the passes of a map find: what pixels that have not found it yet may lack."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FEWEST = 12
"""Passes from which their moments tell rare light."""

RARE = 3.0
"""Passes that hold the spread of a pixel, fewer than which are few: of 16 normal ones it is more than 5."""


MUCH = 10.0
"""Times that a pixel is darker than one beside it, beyond which its rare light is taken to be weaker as well as rarer."""


class RareLight:
    """Variances that pixels have at least, by scattered light that single passes found, theirs or those of their neighbours.

    A pixel that is lit by a wall close to a lamp, or through a narrow lobe, finds most of its light on few lines of sight.
    Where none of its passes has found any, their spread tells nothing of it: value and error are both too small. The spread
    of a pixel's passes is held by K = (Σ d²)²/Σ d⁴ of them, d being what each differs from their mean: n over their
    kurtosis, about n/3 of n normal ones, and about 1 if a single pass differs. Where K is small

    - the pixel's own variance rests on few passes, and is no less than the median of those beside it;
    - it is that of rare light, and its mean over the pixel and those beside it is what each of them is expected to have of
      it, found or not. Where the regular light is less, rare light of the same kind is as much rarer: its variance is in
      proportion; where it is much less, it falls by the square.

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
    >>> rare.least_variance(np.ones((2, 2), dtype=bool)).round(3).tolist()      # (32/16)², and 2/4 of it
    [[4.0, 4.0], [2.0, 2.0]]
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

    def variance(self) -> Array:
        """Of the means of pixels, by their own passes."""
        if self._moments is None:
            return np.zeros(self._shape)
        return self._moments[1] / (self._passes * (self._passes - 1))

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
        variance = self.variance()
        beside = _mean_beside(variance, rare, _regular(self._moments, self._passes), possible)
        return np.where(possible, np.maximum(_median_beside(variance, rare), beside), 0.0)


def _regular(moments: list[Array], passes: int) -> Array:
    """The luminance of pixels without what K of the passes found beside, each of them alike."""
    mean, second, _, fourth = moments
    even = np.full(mean.shape, passes / 2)
    held = np.divide(second * second, fourth, out=even, where=fourth > 0.0).clip(1.0, passes / 2)
    regular: Array = np.maximum(mean - np.sqrt(second / passes * held / (passes - held)), 0.0)
    return regular


def _mean_beside(
    variance: Array, rare: npt.NDArray[np.bool_], regular: Array, possible: npt.NDArray[np.bool_]
) -> Array:
    """Of all pixels, the mean of the variance of rare light there and in the next pixels."""
    rows, columns = variance.shape
    padded = [np.pad(part.astype(np.float64), 1) for part in (variance * rare, regular, possible)]
    sums, pixels = np.zeros(variance.shape), np.zeros(variance.shape)
    for row, column in np.ndindex(3, 3):
        found, level, counts = (part[row : row + rows, column : column + columns] for part in padded)
        darker = np.divide(regular, level, out=np.ones(variance.shape), where=level > regular)
        sums += found * darker * np.minimum(1.0, MUCH * darker)
        pixels += counts
    return sums / np.maximum(pixels, 1.0)


def _median_beside(values: Array, which: npt.NDArray[np.bool_]) -> Array:
    """Of those pixels, the median of their values and those of the next pixels; 0 of others."""
    rows, columns = np.nonzero(which)
    beside = np.array(np.meshgrid([-1, 0, 1], [-1, 0, 1])).reshape(2, -1, 1)
    # What lies beyond an edge is the pixel at the edge once more.
    those = (
        np.clip(at + step, 0, size - 1) for at, step, size in zip((rows, columns), beside, values.shape, strict=True)
    )
    result = np.zeros(values.shape)
    result[rows, columns] = np.median(values[tuple(those)], axis=0)
    return result
