"""What every source of rays offers: rays in batches, and one pass over them all."""

from __future__ import annotations

import abc
import copy
import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_whole, require_callable
from etendue.quantities.provenance import Provenance
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import FluxUnit

FloatArray = npt.NDArray[np.float64]
Progress = Callable[[int], None]
"""Called between rounds of batches with the number of rays done."""

BATCH = 1 << 18
"""Rays per batch: some 14 MB of f64, far above the cost of a call and far below any memory limit."""


def checked_threads(threads: int | None) -> int | None:
    """A number of threads the core can take; `ArgumentError` if it is none."""
    if threads is not None and not (isinstance(threads, int) and 1 <= threads <= 4096):
        raise ArgumentError(f"threads is {threads!r}; give a whole number from 1 to 4096, or None for one per core.")
    return threads


def checked_seed(seed: int) -> int:
    """A seed of random numbers; `ArgumentError` if it is none."""
    if isinstance(seed, bool) or not (isinstance(seed, int | np.integer) and 0 <= seed < 1 << 64):
        raise ArgumentError(f"seed is {seed!r}; give a whole number from 0 to 2⁶⁴ − 1.")
    return int(seed)


def squares_hold(flux_squared: float) -> bool:
    """Whether a sum of squared fluxes is one: none of it is lost to underflow, nor is it infinite.

    A square below the normal numbers is off by 2⁻¹⁰⁷⁵ at most, and so 10¹⁰ of them by 10⁻⁶ of the smallest normal number.

    Examples
    --------
    >>> squares_hold(1.0), squares_hold(0.0), squares_hold(math.inf)
    (True, False, False)
    """
    return float(np.finfo(np.float64).tiny) <= flux_squared < math.inf


def flux_power(flux: FloatArray) -> float:
    """The power of two at the largest flux; 1 without any: over it, squares are numbers, and no bit of theirs is another.

    Examples
    --------
    >>> flux_power(np.array([0.3, 3.0])), flux_power(np.zeros(2)), flux_power(np.array([1e-200])) ** 2
    (4.0, 1.0, 0.0)
    """
    largest = float(flux.max(initial=0.0))
    return math.ldexp(1.0, min(math.frexp(largest)[1], 1023)) if largest > 0.0 else 1.0


@dataclasses.dataclass(frozen=True)
class Tally:
    """The flux account of a pass over rays, before any scaling.

    Parameters
    ----------
    rays : int
        Rays looked at.
    not_finite, no_direction, negative_flux : int
        Rays that cannot be used, by reason; they carry nothing.
    flux, flux_squared : float
        Σ w and Σ w² over the usable rays as stored, [flux unit as stored].
    norm_error : float
        Largest ``| |k| - 1 |`` of the stored directions.
    dark : int
        Usable rays without flux.
    """

    rays: int
    not_finite: int
    no_direction: int
    negative_flux: int
    flux: float
    flux_squared: float
    norm_error: float
    dark: int = 0

    @classmethod
    def from_core(cls, data: Mapping[str, Any]) -> Tally:
        """From the dictionary that the core returns."""
        not_finite, no_direction, negative_flux = data["defects"]
        sums = {name: data[name] for name in ("rays", "dark", "flux", "flux_squared", "norm_error")}
        return cls(not_finite=not_finite, no_direction=no_direction, negative_flux=negative_flux, **sums)

    @property
    def unusable(self) -> int:
        """Rays that cannot be used."""
        return self.not_finite + self.no_direction + self.negative_flux

    @property
    def usable(self) -> int:
        """Rays that can be used."""
        return self.rays - self.unusable

    @property
    def lit(self) -> int:
        """Rays that carry flux."""
        return self.usable - self.dark

    @property
    def effective_rays(self) -> float:
        """(Σ w)²/Σ w²: the number of equal rays with the same relative error of the total; 0 without flux.

        NaN if the fluxes are so small or so large that their squares are no numbers.
        """
        if self.flux == 0.0:
            return 0.0
        return (self.flux / math.sqrt(self.flux_squared)) ** 2 if squares_hold(self.flux_squared) else math.nan


@dataclasses.dataclass(frozen=True)
class RayBatch:
    """A stretch of a source's usable rays.

    Parameters
    ----------
    start : int
        Index of the stretch's first record.
    usable : array of bool, shape (m,)
        Which of the stretch's records the arrays below hold.
    position : array, shape (k, 3)
        [mm]; k is the number of usable rays.
    direction : array, shape (k, 3)
        Unit vectors.
    flux : array, shape (k,)
        [flux unit of the source], scaled.
    """

    start: int
    usable: npt.NDArray[np.bool_]
    position: FloatArray
    direction: FloatArray
    flux: FloatArray


class RayStream(abc.ABC):
    """A finite sequence of rays that is read in batches and never needs to be in memory as a whole."""

    @property
    @abc.abstractmethod
    def flux_unit(self) -> FluxUnit:
        """``"lm"`` or ``"W"``."""

    @property
    @abc.abstractmethod
    def provenance(self) -> Provenance:
        """Where the rays come from."""

    @property
    @abc.abstractmethod
    def has_position(self) -> bool:
        """False for far-field sets, whose rays have directions only."""

    @property
    @abc.abstractmethod
    def total_flux(self) -> float:
        """Flux of all usable rays [`flux_unit`]."""

    @abc.abstractmethod
    def core_source(self) -> Any:
        """The source as the compiled core takes it."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What all that is made of the rays should tell."""
        return ()

    def coloured_source(self) -> Any:
        """The source as the compiled core takes it, with the colour of each ray if it has one of its own."""
        return self.core_source()

    def total_spectrum(
        self,
        progress: Progress | None = None,  # noqa: ARG002 - for those that need a pass
        threads: int | None = None,  # noqa: ARG002
    ) -> Spectrum | SpectralLines | None:
        """The spectrum of all rays together; None if it is not known."""
        return None

    def wavelength_of(self, batch: RayBatch) -> FloatArray | None:  # noqa: ARG002 - for those that know it
        """Wavelength of each ray of a batch [nm], shape (k,); None if the stream does not know it."""
        return None

    @abc.abstractmethod
    def accept_tally(self, tally: Tally) -> float:
        """Take note of a pass over all rays, and return the factor from stored flux to `flux_unit`."""

    @abc.abstractmethod
    def __len__(self) -> int:
        """Number of rays, usable or not."""

    def pass_over(self, progress: Progress | None = None, threads: int | None = None) -> Tally:
        """One pass over all rays for the flux account."""
        require_callable(progress)
        tally, _ = _core.scan(self.core_source(), checked_threads(threads), progress)
        result = Tally.from_core(tally)
        self.accept_tally(result)
        return result

    @property
    @abc.abstractmethod
    def flux_scale(self) -> float:
        """Factor from stored flux to `flux_unit`."""

    _watcher: Progress | None = None

    def watched(self, progress: Progress) -> Self:
        """The same rays, whose `batches` tell `progress` how many were read: for work that has no progress of its own.

        Examples
        --------
        >>> import etendue as et
        >>> seen = []
        >>> [len(b.flux) for b in et.RingSource(rays=10).watched(seen.append).batches(size=4)], seen
        ([4, 4, 2], [4, 8, 10])
        """
        require_callable(progress)
        same = copy.copy(self)
        same._watcher = progress  # noqa: SLF001 - its own kind
        return same

    @property
    def watcher(self) -> Progress | None:
        """The function that `watched` was given."""
        return self._watcher

    def batches(self, size: int = BATCH) -> Iterator[RayBatch]:
        """The usable rays in order, `size` records at a time.

        Examples
        --------
        >>> import etendue as et
        >>> [len(b.flux) for b in et.RingSource(rays=10).batches(size=4)]
        [4, 4, 2]
        """
        size = as_whole(size, "batches: size", 1)
        source, scale = self.core_source(), self.flux_scale
        for start in range(0, len(self), size):
            stop = min(start + size, len(self))
            position, direction, flux = _core.read_rays(source, start, stop)
            usable: npt.NDArray[np.bool_] = np.any(direction != 0.0, axis=1)
            if usable.all():
                yield RayBatch(start, usable, position, direction, flux * scale)
            else:
                yield RayBatch(start, usable, position[usable], direction[usable], flux[usable] * scale)
            if self._watcher is not None:
                self._watcher(stop)


class DrawnRays(RayStream):
    """Rays that the compiled core draws on demand: each has a place, and their flux is known before any is drawn."""

    _core: Any

    def __len__(self) -> int:
        """Number of rays."""
        return len(self._core)

    @property
    def has_position(self) -> bool:
        """They start on their source."""
        return True

    @property
    def flux_scale(self) -> float:
        """They are drawn with their flux in `flux_unit`."""
        return 1.0

    def core_source(self) -> Any:
        """The source as the compiled core takes it."""
        return self._core

    def accept_tally(self, tally: Tally) -> float:
        """Nothing is found by a pass: the flux is known."""
        del tally
        return 1.0
