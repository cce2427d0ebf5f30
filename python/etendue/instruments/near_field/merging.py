"""One image from several exposures: saturated pixels replaced, times checked against each other, weights by noise."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.camera import Camera, Counts

Array = npt.NDArray[np.float64]

TRUSTED = 0.9
"""Share of the highest signal above which an exposure is not used: noise may have saturated some of its light."""

BLURRED = 0.5
"""Noise of reading [counts] from which the mean of many readings of a faint signal is that signal."""

STEPS = 3.0
"""Counts of the shorter exposure, else, for the same."""

LIKE = 1 << 20
"""Pixels at a time."""


@dataclasses.dataclass(frozen=True, eq=False)
class Merging:
    """How exposures are put together.

    Parameters
    ----------
    camera : Camera
    times : array, shape (exposures,)
        Relative to the shortest, as found.
    errors : array, shape (exposures,)
        Standard error of each time against the one before, as a share.

    Examples
    --------
    >>> Merging.calibrated(Camera(exposures=3), []).times.tolist()
    [1.0, 10.0, 100.0]
    """

    camera: Camera
    times: Array
    errors: Array

    @classmethod
    def calibrated(cls, camera: Camera, counts: Iterable[Counts]) -> Merging:
        """With times from the pixels that two neighbouring exposures both see.

        The ratio of two times is that of the sums of their signals, over all lit pixels that are not near saturation in the
        longer one. How faint they are does not matter where the noise of reading blurs the converter's steps. Otherwise the
        shorter exposure must have some counts, as what is less than half a count reads 0.

        The ratio is averaged with the stated one, each by the reciprocal of its variance; exact times stay as stated.

        Parameters
        ----------
        camera : Camera
            That took them.
        counts : iterable of arrays, shape (n, exposures)
            All pixels, some at a time.

        Examples
        --------
        >>> camera = Camera(bits=16, exposures=2, exposure_ratio=10, exposure_error=0.05)
        >>> rate = np.linspace(2000.0, 5000.0, 500)
        >>> seen = camera.dark_level + np.stack([rate, 10.4 * rate], axis=1).round()
        >>> Merging.calibrated(camera, [seen]).times.round(2).tolist()
        [1.0, 10.4]
        """
        sums = np.zeros((camera.exposures, 3))
        blurred = camera.read_noise >= BLURRED * camera.electrons_per_count
        least = -np.inf if blurred else STEPS * camera.exposure_ratio
        for some in counts:
            for j in range(1, camera.exposures):
                shorter, longer = (some[:, i].astype(np.float64) - camera.dark_level for i in (j - 1, j))
                good = (longer < TRUSTED * camera.highest) & (longer > least)
                sums[j] += good.sum(), shorter[good].sum(), longer[good].sum()
        stated = math.sqrt(2.0) * camera.exposure_error
        times, errors = [1.0], [0.0]
        for pixels, shorter_sum, longer_sum in sums[1:]:
            noise = math.sqrt(max(shorter_sum, 0.0) / camera.electrons_per_count + pixels * camera.dark_noise**2)
            found = noise / shorter_sum if shorter_sum > noise else math.inf
            share = stated**2 / (stated**2 + found**2) if stated > 0.0 else 0.0
            measured = longer_sum / shorter_sum if share > 0.0 else camera.exposure_ratio
            times.append(times[-1] * (share * measured + (1.0 - share) * camera.exposure_ratio))
            errors.append(math.sqrt(share) * found if share > 0.0 else stated)
        return cls(camera, np.array(times), np.array(errors))

    def merged(self, counts: Counts) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Counts per time of the shortest exposure, 0 where it is dark; and which pixels are saturated in all exposures.

        Each exposure that is not near saturation counts by the reciprocal of its variance: that of its electrons, of
        reading, and of the converter's steps.

        Parameters
        ----------
        counts : array, shape (n, exposures)
            As they were read.

        Examples
        --------
        >>> camera = Camera(bits=8, exposures=2)
        >>> counts = np.array([[22, 201], [32, 255]])                    # the dark level is 2
        >>> values, saturated = Merging(camera, np.array([1.0, 10.0]), np.zeros(2)).merged(counts)
        >>> values.round(2).tolist(), saturated.tolist()
        ([19.91, 30.0], [False, False])
        """
        c = np.asarray(counts, dtype=np.float64) - self.camera.dark_level
        usable = c < TRUSTED * self.camera.highest
        # The shortest exposure is used whatever it reads: there is nothing better.
        usable[:, 0] = True
        saturated = c[:, 0] >= self.camera.highest
        rate = np.where(usable, c, 0.0).sum(axis=1) / np.where(usable, self.times, 0.0).sum(axis=1)
        variance = (
            np.maximum(rate[:, None] * self.times / self.camera.electrons_per_count, 0.0) + self.camera.dark_noise**2
        )
        weight = np.where(usable, self.times / variance, 0.0)
        values = (weight * c).sum(axis=1) / (weight * self.times).sum(axis=1)
        longest = self.camera.exposures - 1 - np.argmax(usable[:, ::-1], axis=1)
        dark = np.take_along_axis(c, longest[:, None], axis=1)[:, 0] <= self.camera.least_count
        return np.where(dark, 0.0, values), saturated

    def standard_error(self, values: Array) -> Array:
        """Of merged values of that size: the noise of the exposures that are not near saturation."""
        expected = values[..., None] * self.times
        usable = expected < TRUSTED * self.camera.highest
        usable[..., 0] = True
        variance = expected / self.camera.electrons_per_count + self.camera.dark_noise**2
        information = np.where(usable, self.times**2 / variance, 0.0).sum(axis=-1)
        return np.asarray(1.0 / np.sqrt(information))


def stretches(size: int) -> Iterator[slice]:
    """Of `size` pixels, some at a time.

    Examples
    --------
    >>> [(s.start, s.stop) for s in stretches(3)]
    [(0, 3)]
    """
    for start in range(0, size, LIKE):
        yield slice(start, min(start + LIKE, size))
