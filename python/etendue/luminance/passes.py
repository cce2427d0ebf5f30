"""Mean and spread of the independent passes of a map, and what they tell of its error."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.luminance.caustics import FEW, Forward, at_least_nearby
from etendue.luminance.gathering import blocks
from etendue.luminance.rare_light import RareLight
from etendue.quantities.relative_error import RelativeError

Array = npt.NDArray[np.float64]

MOST_TIMES = 64
"""How many times `rays_per_pixel` are followed at most to reach `until`."""


class Passes:
    """Mean and spread of independent passes, updated pass by pass (Welford): no difference of large numbers.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the map.
    area : ndarray
        Apparent area of its pixels, up to a factor.
    window : pair of slices
        Rows and columns outside of which no line of sight meets anything.
    compared : bool
        Whether the passes are to be compared with others, block by block.

    Examples
    --------
    >>> import numpy as np
    >>> one = np.ones((1, 1))
    >>> passes = Passes((1, 1), one)
    >>> for light in (1.0, 2.0, 3.0, 2.0):
    ...     passes.add(light * one, 0 * one, 0 * one, 0 * one, one, light * one)
    >>> values, error = passes.total(None)
    >>> float(values[0, 0]), round(float(error[0, 0]) ** -2)     # (1 + 0 + 1 + 0)/(3 · 4) = 1/6
    (2.0, 6)
    """

    def __init__(
        self,
        shape: tuple[int, int],
        area: Array,
        window: tuple[slice, slice] = (slice(None), slice(None)),
        *,
        compared: bool = False,
    ) -> None:
        self.done = 0
        self.blocks: list[Array] = []
        """The light of each pass by blocks of the map (`etendue.luminance.gathering.blocks`), if they are compared."""
        self._area, self._shape, self._window, self._compared = area, shape, window, compared
        part = area[window].shape
        self._all = _Spread(part)
        self._rare = RareLight(part)
        self._chance = _Spread(part)
        self._lucky = np.zeros(part, dtype=np.int64)
        self._lit = np.zeros(part, dtype=np.int64)
        self._smooth = np.zeros(part, dtype=bool)
        self._diffuse = np.zeros(part, dtype=bool)
        self._deviation = np.zeros(part)

    def add(
        self, values: Array, chance: Array, deviation: Array, smooth: Array, diffuse: Array, scattered: Array
    ) -> None:
        """One pass more.

        Its mean luminances, what of them was found by chance, the deviation that sources state of theirs, the shares of
        the lines that met a smooth surface first, and that saw a diffuse one directly, and the luminance of the light that
        was scattered on its way.
        """
        self.done += 1
        if self._compared:
            self.blocks.append(blocks(values))
        values, chance, deviation, smooth, diffuse, scattered = (
            sums[self._window] for sums in (values, chance, deviation, smooth, diffuse, scattered)
        )
        self._all.add(values, self.done)
        self._rare.add(scattered)
        self._lit += scattered > 0.0
        # Of nothing so far, nothing more changes neither mean nor spread.
        if chance.any() or self._lucky.any():
            self._chance.add(chance, self.done)
            self._lucky += chance > 0.0
        self._smooth |= smooth > 0.0
        self._diffuse |= diffuse > 0.0
        if deviation.any() or self._deviation.any():
            self._deviation += (deviation - self._deviation) / self.done

    def total(self, image: Forward | None, *, known: bool = True) -> tuple[Array, Array]:
        """The luminance of both routes and its standard error; with what the sources know of their own, if `known`.

        What is found by chance, in few passes of a pixel, errs by no less than in its neighbourhood; so does scattered light
        of a pixel that sees a diffuse surface and found such light in few passes, and scattered light that is rare
        (`RareLight`). The edge of a lamp beside a pixel tells nothing of it, and a lamp is brighter than what it lights.
        """
        chance, found = self._chance.variance(self.done), self._all.variance(self.done)
        scattered = self._rare.variance()
        # Whoever found light in each pass needs no neighbours.
        lit = np.where(self._lit < self.done, self._lit, FEW)
        variance = found + np.maximum(
            at_least_nearby(chance, self._lucky, self._smooth) - chance,
            at_least_nearby(scattered, lit, self._diffuse) - scattered,
        )
        variance = np.maximum(variance, self._rare.least_variance(self._diffuse))
        if known:
            variance = variance + self._deviation**2
        values = self._whole(self._all.mean)
        if image is None:
            return values, self._whole(np.sqrt(variance))
        forwards = image.with_neighbours(self._whole(self._diffuse)).error ** 2
        return values + image.values, np.sqrt(self._whole(variance) + forwards)

    def _whole(self, part: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """What is known of the window, on the map."""
        whole = np.zeros(self._shape, dtype=part.dtype)
        whole[self._window] = part
        return whole

    def relative_error(self, image: Forward | None) -> float:
        """Sampling error over the luminance, weighted by flux (`RelativeError`); 0 if there is no light."""
        found = RelativeError.of(*self.total(image, known=False), self._area)
        return 0.0 if found is None else found.flux_weighted

    def stated_error(self, image: Forward | None) -> float:
        """What the sources state of their own error over the luminance, weighted by flux; 0 if there is no light.

        A light field errs alike in neighbouring pixels, however many lines of sight look at it.
        """
        light = float((self.total(image)[0] * self._area).sum())
        return float((self._whole(self._deviation) * self._area).sum()) / light if light > 0.0 else 0.0

    def wanted(self, until: float, most: int, image: Forward | None) -> int:
        """Passes that should be made to reach a relative error: as many as its fall with 1/√n asks for, twice at most."""
        error = self.relative_error(image)
        if error < until:
            return self.done
        return min(most, 2 * self.done, max(self.done + 1, math.ceil(1.1 * self.done * (error / until) ** 2)))

    def notes(self, until: float | None, image: Forward | None) -> list[str]:
        """How sure the map is."""
        values, _ = self.total(image)
        notes = [] if (self._all.mean > 0.0).any() else ["no line of sight met light"]
        if not (values > 0.0).any():
            return notes
        reached = self.relative_error(image)
        notes.append(
            f"sampling error {reached:.2%} of the luminance, weighted by flux; that of lines of sight has "
            f"{self.done - 1} degrees of freedom"
        )
        if until is not None and reached >= until:
            notes.append(f"stopped before {until:.2%} was reached, at {MOST_TIMES} times rays_per_pixel")
        rare = (self._lucky > 0) & (self._lucky < self.done / 2)
        if rare.any():
            part = float(self._chance.mean.sum() / values.sum())
            largest = np.unravel_index(np.argmax(self._whole(np.where(rare, self._chance.mean, 0.0))), values.shape)
            row, column = (int(i) for i in largest)
            notes.append(
                f"{part:.2%} of the light was found by chance, behind lenses or in mirrors; pixels where fewer than half "
                f"of the passes found any: {int(rare.sum()):,}, most in row {row}, column {column} (from 0); single ones "
                "may err by more than their errors say"
            )
        return notes


class _Spread:
    """Mean of passes, and the sum of the squares of what they differ from it."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.mean = np.zeros(shape)
        self._squares = np.zeros(shape)
        # Room for what comes in between: memory that is asked for again for each pass takes longer than the sums.
        self._off, self._step = np.zeros(shape), np.zeros(shape)

    def add(self, values: Array, number: int) -> None:
        """One pass more, the so many-th."""
        np.subtract(values, self.mean, out=self._off)
        np.divide(self._off, number, out=self._step)
        self.mean += self._step
        np.subtract(values, self.mean, out=self._step)
        self._off *= self._step
        self._squares += self._off

    def variance(self, passes: int) -> Array:
        """Of the mean."""
        return self._squares / ((passes - 1) * passes)
