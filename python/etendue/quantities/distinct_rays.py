"""Rays of which several are copies of one, as independent rays: what errors are made of."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from etendue.quantities.ray_records import RayRecords
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.quantities.repeated_rays import keys_of

MOST_JOINED = 1 << 23
"""Rays of which copies are joined: 1 GB."""


class DistinctRays(NamedTuple):
    """Rays that are independent of each other, as far as they are known to be.

    Parameters
    ----------
    rays : RayStream
        Those that were given, or each of them once, with the flux of all its copies.
    excess : float
        By which sums of squared fluxes are still too small; above 1 only where copies could not be joined.
    told : str or None
        What is to be said of copies; None if there are none.
    unusable : int
        Rays that could not be used, and are not among those that were joined.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=300)
    >>> DistinctRays.of(rays).rays is rays
    True
    """

    rays: RayStream
    excess: float = 1.0
    told: str | None = None
    unusable: int = 0

    @classmethod
    def of(cls, rays: RayStream, *, join: bool = True) -> DistinctRays:
        """Copies of a ray as one ray that has their flux; up to `MOST_JOINED` rays, which are held in memory then.

        Parameters
        ----------
        rays : RayStream
            Without positions, nothing is joined: different rays of a far-field set may share a direction.
        join : bool
            False where their order or their further columns are needed, as in an index: they are told, and not joined.

        Examples
        --------
        >>> import etendue as et
        >>> once = et.RingSource(rays=300).ray_set()
        >>> twice = DistinctRays.of(et.RaySet.merge([once, once]))
        >>> len(twice.rays), twice.excess, twice.told
        (300, 1.0, '300 of 600 rays repeat another one, with its place and direction')
        >>> round(DistinctRays.of(et.RaySet.merge([once, once]), join=False).excess, 9)
        2.0
        """
        if not (isinstance(rays, RayRecords) and rays.has_position):
            return cls(rays)
        found = rays.repeats()
        if found.told is None:
            return cls(rays)
        if not join or len(rays) > MOST_JOINED:
            return cls(rays, found.excess, found.told)
        parts = [(batch.position, batch.direction, batch.flux) for batch in rays.batches()]
        position, direction, flux = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        _, first, number = np.unique(keys_of(position, direction), return_index=True, return_inverse=True)
        order = np.argsort(first)
        flux, first = np.bincount(number, flux)[order], first[order]
        joined = RaySet(position[first], direction[first], flux, flux_unit=rays.flux_unit, provenance=rays.provenance)
        told = f"{len(position) - len(first):,} of {len(rays):,} rays repeat another one, with its place and direction"
        return cls(joined, 1.0, told, len(rays) - len(position))

    @property
    def notes(self) -> tuple[str, ...]:
        """What errors that are made of these rays and of `excess` should tell."""
        if self.told is None:
            return ()
        if self.excess > 1.0:
            return (f"{self.told}: all standard errors are {math.sqrt(self.excess):.3g} times as large for it",)
        return (f"{self.told}: each counts once, with the flux of all its copies",)
