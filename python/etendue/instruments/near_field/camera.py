"""`Camera`: from luminance to counts, as an image sensor sees it, with one exposure or several."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require_numbers

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.uint16]

MOST_EXPOSURES = 12
"""Of one image."""

DARK_LEVEL = 6.0
"""Of the counts, in standard deviations of their noise."""

REACH = 4.0
"""Standard deviations to which the spread of a point is followed."""

SIGMA_PER_FWHM = 1.0 / np.sqrt(8.0 * np.log(2.0))


@dataclasses.dataclass(frozen=True)
class Camera:
    """An image sensor behind a lens.

    A pixel collects electrons in proportion to its luminance and the time, with the noise of their number and of reading;
    they become counts of a converter, which lie above a dark level, so that its noise is not cut.

    Parameters
    ----------
    pixels : int
        Along each side of the square image.
    bits : int
        Of the converter: it tells 2^bits levels apart.
    full_well : number
        Electrons of the highest count.
    read_noise : number
        Standard deviation [electrons].
    blur : number
        Full width at half maximum of the image of a point [pixels].
    exposures : int
        Images of each position, at times that rise by `exposure_ratio`.
    exposure_ratio : number
        From each exposure to the next, longer one.
    level : number
        Share of the highest signal that the brightest pixel of all positions reaches in the shortest exposure; above 1 it is
        saturated.
    exposure_error : number
        Standard deviation by which the true times differ from the stated ones, as a share: once for a measurement.
    threshold : number
        How many times the noise of a dark pixel a count must exceed, or it is taken for dark.

    Raises
    ------
    ArgumentError
        If a number is impossible.

    Examples
    --------
    >>> camera = Camera(bits=12, exposures=3, exposure_ratio=10)
    >>> camera.times.tolist(), camera.dark_level, camera.highest, round(camera.dark_noise, 2), round(camera.dynamic_range)
    ([1.0, 10.0, 100.0], 13, 4082, 2.07, 39483)
    """

    pixels: int = 512
    bits: int = 12
    full_well: float = 20_000.0
    read_noise: float = 10.0
    blur: float = 0.0
    exposures: int = 1
    exposure_ratio: float = 10.0
    level: float = 0.9
    exposure_error: float = 0.0
    threshold: float = 5.0

    def __post_init__(self) -> None:
        require_numbers(self, *(one.name for one in dataclasses.fields(self)))
        for name, least, most in (("pixels", 8, 8192), ("bits", 4, 16), ("exposures", 1, MOST_EXPOSURES)):
            value = getattr(self, name)
            if not (least <= value <= most and int(value) == value):
                raise ArgumentError(f"{name} is {value}; give a whole number from {least} to {most}.")
        for name, low, high in (
            ("full_well", 100.0, 1e9),
            ("read_noise", 0.0, 1e6),
            ("blur", 0.0, 100.0),
            ("exposure_ratio", 1.5, 1000.0),
            ("level", 0.01, 1000.0),
            ("exposure_error", 0.0, 0.2),
            ("threshold", 3.0, 1000.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ArgumentError(f"{name} is {value}; give a number from {low:g} to {high:g}.")

    @property
    def times(self) -> Array:
        """Stated times, in units of the shortest, shape (exposures,)."""
        return np.asarray(float(self.exposure_ratio) ** np.arange(self.exposures), dtype=np.float64)

    @property
    def top(self) -> int:
        """The highest count of the converter: a pixel that reads it is saturated."""
        return int(2**self.bits - 1)

    @property
    def dark_level(self) -> int:
        """Mean count of a pixel without light: so high that noise does not reach 0."""
        return math.ceil(DARK_LEVEL * self.dark_noise)

    @property
    def highest(self) -> int:
        """The highest signal [counts above the dark level]."""
        return self.top - self.dark_level

    @property
    def electrons_per_count(self) -> float:
        """Of the converter."""
        return self.full_well / self.top

    @property
    def dark_noise(self) -> float:
        """Standard deviation of a pixel without light, that of the converter's steps included [counts]."""
        return float(np.hypot(self.read_noise / self.electrons_per_count, 1.0 / np.sqrt(12.0)))

    @property
    def least_count(self) -> float:
        """At and below this signal a pixel is taken for dark [counts above the dark level]."""
        return self.threshold * self.dark_noise

    @property
    def dynamic_range(self) -> float:
        """Of the brightest luminance that is not saturated to the faintest that is not taken for dark."""
        return float(self.highest / self.least_count * self.times[-1])

    def true_times(self, seed: int) -> Array:
        """The times as they are, shape (exposures,)."""
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 0))))
        return self.times * (1.0 + self.exposure_error * rng.standard_normal(self.exposures))

    def expose(self, luminance: Array, counts_per_luminance: float, times: Array, rng: np.random.Generator) -> Counts:
        """Counts of some pixels in each exposure, the dark level among them, shape (n, exposures).

        Parameters
        ----------
        luminance : array, shape (n,)
            In any unit.
        counts_per_luminance : number
            In the shortest exposure, by that unit.
        times : array, shape (exposures,)
            As they are.
        rng : Generator
            Of the noise.
        """
        per = self.electrons_per_count
        electrons = rng.poisson(
            np.minimum(luminance[:, None] * (counts_per_luminance * per) * times, 4.0 * self.full_well)
        )
        read = electrons + self.read_noise * rng.standard_normal(electrons.shape)
        counts: Counts = np.clip(np.rint(read / per) + self.dark_level, 0, self.top).astype(np.uint16)
        return counts

    def blurred(self, image: Array) -> Array:
        """An image as the lens throws it: each point spread by a Gaussian of the stated width."""
        if self.blur == 0.0:
            return image
        sigma = self.blur * SIGMA_PER_FWHM
        reach = max(1, int(np.ceil(REACH * sigma)))
        # Shares of a Gaussian that falls into pixels: differences of its integral would need erf; eight points do.
        fine = (np.arange(8 * (2 * reach + 1)) + 0.5) / 8.0 - reach - 0.5
        kernel = np.exp(-0.5 * (fine / sigma) ** 2).reshape(-1, 8).sum(axis=1)
        kernel /= kernel.sum()
        for axis in (0, 1):
            width = [(reach, reach) if a == axis else (0, 0) for a in (0, 1)]
            padded = np.pad(image, width)
            size = image.shape[axis]
            spread = np.zeros_like(image)
            for i, share in enumerate(kernel):
                spread += share * np.take(padded, np.arange(i, i + size), axis=axis)
            image = spread
        return image
