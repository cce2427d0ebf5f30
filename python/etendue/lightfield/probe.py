"""A look at some of a set's rays: enough to size a surface or to choose a grid."""

from __future__ import annotations

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

STRETCH = 4096
"""Rays that are read in one piece."""


def probe_rays(rays: RayStream, at_most: int) -> RaySet:
    """Up to `at_most` rays that carry flux, from stretches spread evenly over the set, in its own scale of flux.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> len(probe_rays(et.RingSource(rays=100_000), 16_384)), len(probe_rays(et.RingSource(rays=1000), 16_384))
    (16384, 1000)
    """
    if not rays.has_position:
        raise ArgumentError("these rays have no positions (a far-field set), so no surface can carry them.")
    source, n = rays.core_source(), len(rays)
    pieces = max(at_most // STRETCH, 2)
    starts = range(0, n, STRETCH)
    if len(starts) > pieces:
        starts = range(0, n - STRETCH + 1, (n - STRETCH) // (pieces - 1))
    parts = [_core.read_rays(source, start, min(start + STRETCH, n)) for start in starts[:pieces]]
    if parts:
        position, direction, flux = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        lit = flux > 0
        if lit.any():
            return RaySet(position[lit], direction[lit], flux[lit], flux_unit=rays.flux_unit)
    raise ArgumentError("these rays carry no flux, so no light field can be fitted to them.")
