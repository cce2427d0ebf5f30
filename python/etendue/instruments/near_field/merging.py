"""One image from several exposures: saturated pixels replaced, times checked against each other, weights by noise."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.camera import Camera, Counts

Array = npt.NDArray[np.float64]

TRUSTED = 0.9
"""Share of the highest count above which an exposure is not used: noise may have saturated some of its light."""

CALIBRATING = 0.3
"""Share of the highest count above which a pixel of the longer exposure tells how much longer that was."""

ENOUGH = 100
"""Pixels that must do so; with fewer the stated ratio is used."""

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
    found : tuple of bool
        Of each exposure but the first, whether its time was found from the pixels; otherwise it is the stated one.
    """

    camera: Camera
    times: Array
    found: tuple[bool, ...]

    @classmethod
    def calibrated(cls, camera: Camera, counts: Iterable[Counts]) -> Merging:
        """With times from the pixels that two neighbouring exposures both see well.

        Parameters
        ----------
        camera : Camera
            That took them.
        counts : iterable of arrays, shape (n, exposures)
            All pixels, some at a time.

        Examples
        --------
        >>> camera = Camera(bits=16, exposures=2, exposure_ratio=10)
        >>> rate = np.linspace(2000.0, 6000.0, 500)
        >>> seen = np.stack([rate, 10.4 * rate], axis=1).clip(0, camera.top).round().astype(np.uint16)
        >>> Merging.calibrated(camera, [seen]).times.round(2).tolist()
        [1.0, 10.4]
        """
        sums = np.zeros((camera.exposures, 3))
        for some in counts:
            for j in range(1, camera.exposures):
                longer = some[:, j].astype(np.float64)
                good = (longer > CALIBRATING * camera.top) & (longer < TRUSTED * camera.top)
                sums[j] += good.sum(), some[good, j - 1].sum(), longer[good].sum()
        times, found = [1.0], []
        for j in range(1, camera.exposures):
            pixels, shorter, longer_sum = sums[j]
            usable = pixels >= ENOUGH and shorter > 0.0
            found.append(bool(usable))
            times.append(times[-1] * (longer_sum / shorter if usable else camera.exposure_ratio))
        return cls(camera, np.array(times), tuple(found))

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
        >>> values, saturated = Merging(camera, np.array([1.0, 10.0]), (True,)).merged(np.array([[20, 199], [30, 255]]))
        >>> values.round(2).tolist(), saturated.tolist()
        ([19.91, 30.0], [False, False])
        """
        c = np.asarray(counts, dtype=np.float64)
        usable = c < TRUSTED * self.camera.top
        # The shortest exposure is used whatever it reads: there is nothing better.
        usable[:, 0] = True
        saturated = c[:, 0] >= self.camera.top
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
        usable = expected < TRUSTED * self.camera.top
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
