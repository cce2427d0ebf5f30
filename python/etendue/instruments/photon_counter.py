"""`PhotonCounter`: what a detector that counts photons states of a flux."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class PhotonCounter:
    """Photon noise, counts without light, and a beam that changes while the positions are gone through.

    Parameters
    ----------
    photons : number, optional
        That the whole beam would be counted as at each position; None: there is no photon noise.
    dark : number
        Mean number of counts without light at each position, subtracted afterwards.
    drift : number
        By which share the beam has changed at the last position.

    Raises
    ------
    ArgumentError
        If a number is impossible.

    Examples
    --------
    >>> flux, error = PhotonCounter(1e6, dark=100.0).read(np.full(4, 1e-2), np.zeros(4), seed=1)
    >>> bool((np.abs(flux - 1e-2) < 5 * error).all()), error.round(4).tolist()
    (True, [0.0001, 0.0001, 0.0001, 0.0001])
    """

    photons: float | None = None
    dark: float = 0.0
    drift: float = 0.0

    def __post_init__(self) -> None:
        if self.photons is not None and not 0.0 < self.photons < math.inf:
            raise ArgumentError(f"{self.photons} photons; give more than 0, or None for no noise")
        if self.dark < 0.0 or (self.dark and self.photons is None):
            raise ArgumentError("dark counts are given without photons, or are negative; give both, and none below 0")
        if not -1.0 < self.drift < math.inf:
            raise ArgumentError(f"a drift of {self.drift:g}; give more than -1, at which nothing is left of the beam")

    @property
    def background(self) -> float:
        """The counts without light, as a share of those of the whole beam."""
        return 0.0 if self.photons is None else self.dark / self.photons

    def read(self, flux: Array, error: Array, seed: int) -> tuple[Array, Array]:
        """What is stated of a flux as a share of the beam, one position after the other, and its standard error.

        Parameters
        ----------
        flux, error : array, shape (n,)
            The flux, and the standard error to which it is known.
        seed : int
            Of the noise.

        Returns
        -------
        array, array, shape (n,)
        """
        drifted = 1.0 + self.drift * np.linspace(0.0, 1.0, flux.size)
        flux, error = flux * drifted, error * drifted
        if self.photons is None:
            return flux, error
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 2))))
        counts = rng.poisson(np.maximum(flux, 0.0) * self.photons + self.dark).astype(np.float64)
        noise = np.sqrt(np.maximum(counts, 1.0)) / self.photons
        return (counts - self.dark) / self.photons, np.hypot(error, noise)
