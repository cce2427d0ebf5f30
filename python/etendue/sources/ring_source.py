"""The three-ring source of [Audenaert2014]_ section 2.3, as a stream of rays."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, as_whole, require
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import DrawnRays
from etendue.units import MM2_PER_M2, FluxUnit

FloatArray = npt.NDArray[np.float64]

MOST_SUBDIVISION = 1024
"""Points along each side of a pixel."""


def allocate_rays(rays: int, weights: Sequence[float]) -> tuple[int, ...]:
    """Share a number of rays in proportion to weights, to the nearest ray, with exactly that total.

    Eqs. 2.7 and 2.8 of [Audenaert2014]_ with weights Φ·A. Largest remainder: each share is rounded down, and the rays
    left over go to the largest remainders.

    Examples
    --------
    >>> allocate_rays(50_000_000, [300 * 1, 200 * 3, 100 * 5])
    (10714286, 21428571, 17857143)
    """
    # In fractions: above 2^53 rays, floats would not add up to the number asked for.
    exact_weights = [Fraction(w) for w in weights]
    exact = [rays * w / sum(exact_weights) for w in exact_weights]
    shares = [math.floor(e) for e in exact]
    by_remainder = sorted(range(len(weights)), key=lambda i: shares[i] - exact[i])
    for i in by_remainder[: rays - sum(shares)]:
        shares[i] += 1
    return tuple(shares)


class RingSource(DrawnRays):
    """Concentric Lambertian rings in the plane z = 0 that emit towards +Z, each with its own luminance.

    The defaults are the source of [Audenaert2014]_ section 2.3: radii 10, 20, 30 mm, 300, 200, 100 lm.

    Parameters
    ----------
    radii : sequence of float
        Outer radius of each ring [mm], rising; the first ring is a disk.
    flux : sequence of float
        Flux of each ring [lm], > 0.
    rays : int
        Rays per run; shared between rings in proportion to Φ·A (eqs. 2.7, 2.8).
    runs : int
        Runs with seeds ``seed``, ``seed + 1`` …, which together carry the flux.
    seed : int
        0 to 2⁶⁴ - 1.

    Raises
    ------
    ArgumentError
        If a parameter is out of its domain, or a number of rays, runs or the seed is no integer.

    Examples
    --------
    >>> source = RingSource(rays=50_000_000, runs=28)
    >>> len(source), source.allocation
    (1400000000, (10714286, 21428571, 17857143))
    >>> [round(value) for value in source.zone_luminance]
    [303964, 67547, 20264]
    """

    def __init__(
        self,
        radii: Sequence[float] = (10.0, 20.0, 30.0),
        flux: Sequence[float] = (300.0, 200.0, 100.0),
        rays: int = 1_000_000,
        runs: int = 1,
        seed: int = 1,
    ) -> None:
        outer = as_numbers(radii, "RingSource: radii", "rising radii in mm")
        edges = (0.0, *np.ravel(outer).tolist())
        rising = all(b > a and math.isfinite(b) for a, b in itertools.pairwise(edges))
        if outer.ndim != 1 or len(edges) < 2 or not rising:
            raise ArgumentError(f"RingSource: radii {edges[1:]} mm; give rising radii > 0.")
        given_flux = as_numbers(flux, "RingSource: flux", "one flux in lm for each ring")
        flux = tuple(np.ravel(given_flux).tolist())
        if given_flux.shape != outer.shape or any(not (math.isfinite(f) and f > 0) for f in flux):
            raise ArgumentError(
                f"RingSource: flux {flux} lm; give one finite flux > 0 for each of {len(edges) - 1} rings."
            )
        rays = as_whole(rays, "RingSource: rays", 1)
        runs, seed = as_whole(runs, "RingSource: runs", 1), as_whole(seed, "RingSource: seed")
        if rays * runs >= 2**63:
            raise ArgumentError(f"RingSource: {rays} rays in {runs} runs; give fewer than 2^63 in all.")
        self.edges = edges
        self.ring_flux = flux
        self.runs = runs
        self.seed = seed
        self.allocation = allocate_rays(rays, [f * a for f, a in zip(flux, self.ring_area, strict=True)])
        if min(self.allocation) == 0:
            raise ArgumentError(f"RingSource: {rays} rays leave a ring without any ({self.allocation}); give more.")
        rings = zip(edges, edges[1:], self.ring_flux, self.allocation, strict=False)
        self._core = _core.RingSource(list(rings), runs, seed)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the compiled part is made anew."""
        return RingSource, (self.edges[1:], self.ring_flux, sum(self.allocation), self.runs, self.seed)

    def __repr__(self) -> str:
        """How to make it again."""
        rays = f"rays={sum(self.allocation)}, runs={self.runs}, seed={self.seed}"
        return f"RingSource(radii={self.edges[1:]}, flux={self.ring_flux}, {rays})"

    @property
    def ring_area(self) -> tuple[float, ...]:
        """Area of each ring [mm²]."""
        return tuple(math.pi * (b * b - a * a) for a, b in itertools.pairwise(self.edges))

    @property
    def zone_luminance(self) -> tuple[float, ...]:
        """Luminance of each ring [cd/m²], Φ/(π A) (eq. 2.9)."""
        return tuple(f / (math.pi * a) * MM2_PER_M2 for f, a in zip(self.ring_flux, self.ring_area, strict=True))

    def luminance(self, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Luminance at points of the plane [mm], in any direction above it [cd/m²]; 0 outside the rings."""
        x, y = as_numbers(x, "RingSource.luminance: x"), as_numbers(y, "RingSource.luminance: y")
        zone = np.searchsorted(self.edges[1:], np.hypot(x, y), side="left")  # NaN sorts beyond the last ring
        seen: FloatArray = np.append(self.zone_luminance, 0.0)[zone]
        return seen

    def pixel_luminance(self, observer: Observer, screen: Screen, subdivision: int = 32) -> FloatArray:
        """What the observer truly sees: mean luminance over each pixel [cd/m²], shape (rows, columns).

        The line of sight through each point of a grid of `subdivision` × `subdivision` points per pixel is followed to
        the rings; it is what a reverse ray tracer does, and it has no noise. Error per edge pixel: below 1/`subdivision`
        of the step of luminance. The observer must be above the plane of the rings.
        """
        require(observer, Observer, "RingSource: observer", "an Observer: et.Observer(theta, phi, distance)")
        require(screen, Screen, "RingSource: screen", "a Screen: et.Screen(width, height, columns, rows)")
        subdivision = as_whole(subdivision, "RingSource: subdivision", 1, MOST_SUBDIVISION)
        if observer.position[2] <= 0:
            raise ArgumentError(
                "RingSource: the observer is not above the plane z = 0, and the rings emit upwards only."
            )
        columns = screen.columns * subdivision
        x = (np.arange(columns) + 0.5) * (screen.width / columns) - screen.width / 2
        within = (0.5 - (np.arange(subdivision) + 0.5) / subdivision) * (screen.height / screen.rows)
        right, up, _ = screen.axes(observer)
        viewpoint, target = observer.position, np.asarray(observer.target)
        rows = []
        for centre in screen.y:
            points = target + x[None, :, None] * right + (centre + within)[:, None, None] * up
            sight = points - viewpoint
            along = -viewpoint[2] / np.where(sight[..., 2] < 0, sight[..., 2], np.nan)
            seen = self.luminance(viewpoint[0] + along * sight[..., 0], viewpoint[1] + along * sight[..., 1])
            rows.append(seen.reshape(subdivision, screen.columns, subdivision).mean(axis=(0, 2)))
        return np.array(rows)

    @property
    def flux_unit(self) -> FluxUnit:
        """Lumens."""
        return "lm"

    @property
    def total_flux(self) -> float:
        """Sum over the rings [lm]."""
        return math.fsum(self.ring_flux)

    @property
    def provenance(self) -> Provenance:
        """The parameters, which are all that is needed to draw the same rays again."""
        rings = ", ".join(f"{f:g} lm to r = {r:g} mm" for f, r in zip(self.ring_flux, self.edges[1:], strict=True))
        step = f"{sum(self.allocation)} rays x {self.runs} runs, seed {self.seed}"
        return Provenance(source=f"ring source ({rings})", format="synthetic", steps=(step,))

    def ray_set(self) -> RaySet:
        """All rays as a ray set, for sets that fit into memory."""
        position, direction, flux = _core.read_rays(self._core, 0, len(self))
        return RaySet(position, direction, flux, provenance=self.provenance)
