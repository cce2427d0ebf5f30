"""The cone estimator: luminance from the rays that head for the observer ([Audenaert2014]_ chapter 2)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.formats.rays.ray_index import RayIndex
from etendue.luminance.observer_disk import disk_etendue
from etendue.quantities.memory import require_memory
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, RayStream, Tally, checked_threads
from etendue.units import MM2_PER_M2

FloatArray = npt.NDArray[np.float64]


def cone_solid_angle(acceptance: float) -> float:
    """Solid angle of a cone, 2π(1 - cos α) [sr], α in degrees.

    Written as 4π sin²(α/2), which does not cancel for narrow cones.

    Examples
    --------
    >>> round(cone_solid_angle(1.5), 9)
    0.002153091
    """
    return 4.0 * math.pi * math.sin(math.radians(acceptance) / 2.0) ** 2


CELL_BYTES = 72
"""Bytes for a pixel and acceptance: three sums of the core, and the estimate with its error that is made of them."""


@dataclasses.dataclass(frozen=True)
class ConeView:
    """An observer, his screen, and the acceptance half-angles [°], rising, under which rays are counted at once.

    With `disk` [mm] the observer is a disk of that radius instead, and the one acceptance is a bound of the angles to it.
    """

    observer: Observer
    screen: Screen
    acceptances: tuple[float, ...]
    disk: float | None = None

    def etendue(self) -> FloatArray:
        """ΔΩ_o ΔA_p cos θ_p of eq. 2.3 (theory eq. 6) [m² sr], shape (acceptances, rows, columns).

        Of a disk: ∫∫ cos θ dΩ dA over the pixel and the disk, without approximation.
        """
        if self.disk is not None:
            return disk_etendue(self.observer, self.screen, self.disk)[None]
        apparent = self.screen.pixel_area / MM2_PER_M2 * self.screen.cosine(self.observer)
        solid_angles = np.array([cone_solid_angle(a) for a in self.acceptances])
        product: FloatArray = solid_angles[:, None, None] * apparent
        return product


@dataclasses.dataclass(frozen=True)
class ConeEstimate:
    """What a pass leaves for one view; all arrays of shape (acceptances, rows, columns).

    Parameters
    ----------
    luminance : array
        Eq. 2.4 [cd/m² or W/(m² sr)]; 0 where no ray was seen.
    variance : array
        Of `luminance`: Σ w² over the étendue squared, for a Poisson process of weighted rays (theory eq. 8).
    rays : array of int64
        Rays seen.
    etendue : array
        [m² sr]
    looked : int
        Rays that had to be looked at: all of them, but of an index.
    """

    view: ConeView
    luminance: FloatArray
    variance: FloatArray
    rays: npt.NDArray[np.int64]
    etendue: FloatArray
    looked: int


def cone_estimates(
    rays: RayStream,
    views: Sequence[ConeView],
    threads: int | None = None,
    progress: Progress | None = None,
    excess: float = 1.0,
) -> tuple[list[ConeEstimate], Tally]:
    """Eqs. 2.2 to 2.4 of [Audenaert2014]_ for any number of views in one pass over the rays, or from an index of them.

    A ray is carried along its line to the screen; if it crosses pixel p and its direction is within the acceptance of the
    line from p's centre to the observer (eq. 2.2), its flux counts for p. For a Lambertian source the expectation is
    L (1 + cos α)/2 (theory eq. 9): the cone's solid angle stands where its projected solid angle would be exact, 0.017 %
    at α = 1.5°. `excess` multiplies the variances, of rays that hold copies of each other (`DistinctRays`).

    Raises
    ------
    ArgumentError
        If the rays have no position.
    MemoryLimitError
        If the maps do not fit into memory.
    """
    if not rays.has_position:
        raise ArgumentError(
            f"{rays.provenance.source}: the rays have no position (far-field data), so they have no luminance. "
            "Ask for a near-field ray file."
        )
    cells = sum(math.prod(view.screen.shape) * len(view.acceptances) for view in views)
    require_memory(cells * CELL_BYTES, f"{rays.provenance.source}: maps with {cells:,} pixels in all")
    cones = [_core_cone(view) for view in views]
    if isinstance(rays, RayIndex):
        found, tally, scale = rays.cone_sums(cones, threads, progress), rays.tally, rays.flux_scale
    else:
        sums, raw_tally = _core.cone_sums(rays.core_source(), cones, checked_threads(threads), progress)
        tally = Tally.from_core(raw_tally)
        scale = rays.accept_tally(tally)
        found = [(of_cone, tally.rays) for of_cone in sums]
    estimates = []
    for view, ((flux, flux_squared, counts), looked) in zip(views, found, strict=True):
        etendue = view.etendue()
        factor = scale / etendue
        variance = flux_squared * factor**2 * excess
        estimates.append(ConeEstimate(view, flux * factor, variance, counts.astype(np.int64), etendue, looked))
    return estimates, tally


def _core_cone(view: ConeView) -> _core._Cone:
    return {
        "view": view.screen.core_view(view.observer),
        "acceptances": [math.radians(a) for a in view.acceptances],
        "disk": view.disk,
    }
