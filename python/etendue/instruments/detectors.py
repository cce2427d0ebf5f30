"""`Detector`, `Baffle`: what a detector states of a flux, how long it takes, and what else it sees."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require_number, require_numbers
from etendue.quantities.ray_stream import checked_seed

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Readings:
    """What a detector stated at each position.

    Parameters
    ----------
    flux : array, shape (n,)
        As a share of the beam; the mean of the dark is subtracted. Where the detector was saturated, the least it can be.
    standard_error : array, shape (n,)
        Of the noise, as the detector knows it from its own counts.
    seconds : array, shape (n,)
        From one position to the next, pause included.
    saturated : array of bool, shape (n,)
        Where there was more light than fits.

    Examples
    --------
    >>> Detector(rate=1e12, full_well=1e9).read([1e-3, 0.5]).saturated.tolist()
    [False, True]
    """

    flux: Array
    standard_error: Array
    seconds: Array
    saturated: npt.NDArray[np.bool_]

    @property
    def hours(self) -> float:
        """Of all positions."""
        return float(self.seconds.sum()) / 3600.0


@dataclasses.dataclass(frozen=True)
class Detector:
    """Collects electrons behind an aperture: a CCD behind filters, whose time is chosen at each position, or a photometer.

    A flux Φ, as a share of the beam, and stray light Φ₀ give (Φ + Φ₀) · rate · T · t electrons behind a filter of
    transmittance T in t seconds, and the dark gives dark · t more. Their number is Poisson's, and the readout adds normal
    noise. The time is that which fills the well to `fill`, behind the clearest filter that lets it be `shortest` or longer,
    and at most `longest`. With both the same, the time is fixed, and so is the filter: the first.

    Parameters
    ----------
    rate : number
        Electrons per second if the whole beam got in.
    full_well : number
        Electrons that fit.
    read_noise : number
        Standard deviation of a readout [electrons].
    dark : number
        Electrons per second without light.
    shortest, longest : number
        Integration times [s].
    filters : tuple of numbers
        Transmittances, that of no filter being 1.
    filter_error : number
        Relative standard error to which those below 1 are known; the same at all positions of a scan.
    fill : number
        Part of the well that is aimed at.
    pause : number
        To move on, settle and read out [s].
    stray : number
        Light of the surroundings in the aperture, as a share of the beam, which is not subtracted.

    Raises
    ------
    ArgumentError
        If a number is impossible.

    Examples
    --------
    >>> import numpy as np
    >>> ccd = Detector(rate=3e9, full_well=3e5, read_noise=10, shortest=0.01, longest=60, filters=(1, 0.01))
    >>> seconds, transmittance = ccd.exposures(np.array([1e-2, 1e-5, 1e-9]))
    >>> seconds.round(2).tolist(), transmittance.tolist()
    ([0.8, 8.0, 60.0], [0.01, 1.0, 1.0])
    """

    rate: float
    full_well: float
    _: dataclasses.KW_ONLY
    read_noise: float = 0.0
    dark: float = 0.0
    shortest: float = 0.1
    longest: float = 0.1
    filters: tuple[float, ...] = (1.0,)
    filter_error: float = 0.0
    fill: float = 0.8
    pause: float = 0.0
    stray: float = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, "rate", "full_well", "shortest", "longest", "read_noise", "dark")
        require_numbers(self, "filter_error", "fill", "pause", "stray")
        for name in ("rate", "full_well", "shortest", "longest"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ArgumentError(f"{name} is {getattr(self, name)}; give more than 0")
        for name in ("read_noise", "dark", "filter_error", "pause", "stray"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ArgumentError(f"{name} is {getattr(self, name)}; give 0 or more")
        if self.longest < self.shortest:
            raise ArgumentError(
                f"times from {self.shortest:g} to {self.longest:g} s; give a longest that is no shorter than the shortest"
            )
        if not 0.0 < self.fill <= 1.0:
            raise ArgumentError(f"a fill of {self.fill:g}; give a part of the well, above 0 and up to 1")
        given = as_numbers(self.filters, "Detector: filters", "transmittances above 0, up to 1")
        if given.ndim != 1 or not given.size or not ((given > 0.0) & (given <= 1.0)).all():
            raise ArgumentError("filters are transmittances above 0, up to 1; give one at least")
        object.__setattr__(self, "filters", tuple(given.tolist()))

    @property
    def dynamic_range(self) -> float:
        """Of one time and filter: the full well over the noise of the dark and the readout in the shortest time."""
        return self.full_well / math.sqrt(max(self.dark * self.shortest + self.read_noise**2, 1.0))

    def exposures(self, flux: npt.ArrayLike) -> tuple[Array, Array]:
        """Times [s] and transmittances of filters for fluxes, shape (n,) each: an automatic exposure, found in the pause."""
        share = as_numbers(flux, "Detector.exposures: flux", "fluxes as a share of that of the beam") + self.stray
        if share.ndim != 1:
            raise ArgumentError(f"Detector.exposures: flux has shape {share.shape}; give a row of numbers.")
        if self.shortest == self.longest:
            return np.full(share.shape, self.shortest), np.full(share.shape, float(self.filters[0]))
        clear = np.sort(np.asarray(self.filters, np.float64))[::-1]
        with np.errstate(divide="ignore"):
            filling = self.fill * self.full_well / (np.maximum(share, 0.0)[:, None] * self.rate * clear + self.dark)
        fits = filling >= self.shortest
        # Behind the darkest filter if even that is too clear.
        chosen = np.where(fits.any(axis=1), np.argmax(fits, axis=1), clear.size - 1)
        seconds = np.clip(filling[np.arange(share.size), chosen], self.shortest, self.longest)
        return seconds, clear[chosen]

    def read(self, flux: npt.ArrayLike, seed: int = 1) -> Readings:
        """Read fluxes, as a share of the beam, one position after the other.

        Parameters
        ----------
        flux : array, shape (n,)
            As `GoniometerScan.flux` of an instrument without noise.
        seed : int
            Of the noise.

        Raises
        ------
        ArgumentError
            If a flux is negative or not finite, or the seed is negative.

        Examples
        --------
        >>> photometer = Detector(rate=1e16, full_well=1e13, read_noise=1e4, pause=1.0)
        >>> readings = photometer.read([1e-3, 1e-9], seed=2)
        >>> [f"{one:.2g}" for one in readings.flux], round(3600 * readings.hours, 3)
        (['0.001', '1e-09'], 2.2)
        """
        share = as_numbers(flux, "Detector.read: flux", "fluxes as a share of that of the beam")
        if share.ndim != 1 or not np.isfinite(share).all() or (share < 0.0).any():
            raise ArgumentError("fluxes are a row of numbers that are not negative")
        seed = checked_seed(seed)
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 3))))
        seconds, transmittance = self.exposures(share)
        distinct, own = np.unique(transmittance, return_inverse=True)
        off = np.where(distinct < 1.0, self.filter_error * rng.standard_normal(distinct.size), 0.0)
        gain = self.rate * transmittance * seconds
        expected = (share + self.stray) * gain * (1.0 + off[own]) + self.dark * seconds
        electrons = np.asarray(rng.poisson(expected), np.float64) + self.read_noise * rng.standard_normal(share.size)
        saturated = electrons >= self.full_well
        electrons = np.minimum(electrons, self.full_well)
        noise = np.sqrt(np.maximum(electrons, 0.0) + self.read_noise**2)
        found = (electrons - self.dark * seconds) / gain
        return Readings(found, np.maximum(noise, 1.0) / gain, seconds + self.pause, saturated)


@dataclasses.dataclass(frozen=True)
class Baffle:
    """An opening in front of a round aperture, on the same axis: what the detector sees of the sample, and of the rest.

    Parameters
    ----------
    opening : number
        Its diameter [mm].
    length : number
        From the aperture to it [mm].

    Examples
    --------
    >>> baffle = Baffle(opening=24.0, length=200.0)
    >>> tuple(round(d, 1) for d in baffle.field(25.0, 886.0))  # of a sample at 886 mm
    (20.6, 192.1)
    >>> round(math.pi * 12.5**2 * math.pi / baffle.etendue(25.0))  # less of an even surrounding than without it
    280
    """

    opening: float
    length: float

    def __post_init__(self) -> None:
        require_numbers(self, "opening", "length", instead="a length in mm")
        if not (0.0 < self.opening < math.inf and 0.0 < self.length < math.inf):
            raise ArgumentError("the opening of a baffle and its distance from the aperture are more than 0")

    def field(self, aperture: float, distance: float) -> tuple[float, float]:
        """Diameters [mm] of what an aperture sees in full, and of what it sees at all, at a distance; 0 if nothing in full.

        From lines through the rims of both.
        """
        require_number(aperture, "Baffle.field: aperture", "a diameter in mm")
        require_number(distance, "Baffle.field: distance", "a length in mm")
        if not (0.0 < aperture < math.inf and distance < math.inf):
            raise ArgumentError(f"an aperture of {aperture:g} mm, seen at {distance:g} mm; give lengths above 0")
        if not 0.0 < self.length < distance:
            raise ArgumentError(f"a baffle {self.length:g} mm before the aperture; the sample is at {distance:g} mm")
        straight, crossed = self.opening * distance, aperture * (distance - self.length)
        return max((straight - crossed) / self.length, 0.0), (straight + crossed) / self.length

    def etendue(self, aperture: float) -> float:
        """Of the aperture through the opening [mm² sr]: π A F of two disks on an axis.

        Even surroundings of the radiance L send L times this into the detector.
        """
        require_number(aperture, "Baffle.etendue: aperture", "a diameter in mm")
        if not 0.0 < aperture < math.inf:
            raise ArgumentError(f"Baffle.etendue: aperture is {aperture:g}; give a diameter in mm, above 0.")
        r1, r2 = 0.5 * aperture / self.length, 0.5 * self.opening / self.length
        x = 1.0 + (1.0 + r2 * r2) / (r1 * r1)
        factor = 0.5 * (x - math.sqrt(x * x - 4.0 * (r2 / r1) ** 2))
        return math.pi * math.pi * (0.5 * aperture) ** 2 * factor
