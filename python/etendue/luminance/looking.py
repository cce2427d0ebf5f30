"""Maps from a light field: luminance averaged over each pixel, by quadrature."""

from __future__ import annotations

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.light_field import LightField
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import checked_threads
from etendue.units import MM2_PER_M2

MOST_SAMPLES = 2048
"""Points per pixel: more resolve nothing that a field holds."""


def look_at_field(
    field: LightField, observer: Observer, screen: Screen, samples: int, threads: int | None
) -> LuminanceMap:
    """The map of a field for one observer; see `luminance_map`."""
    if not (isinstance(samples, int) and 1 <= samples <= MOST_SAMPLES):
        raise ArgumentError(f"samples is {samples!r}; give a whole number of points per pixel, 1 to {MOST_SAMPLES}.")
    values, deviation = field.core.look(screen.core_view(observer), samples, checked_threads(threads))
    return LuminanceMap(
        values=values * MM2_PER_M2,
        standard_error=deviation * MM2_PER_M2,
        rays=np.full(screen.shape, -1),
        observer=observer,
        screen=screen,
        flux_unit=field.flux_unit,
        provenance=field.provenance.then(f"luminance by light field, {samples} points per pixel"),
        notes=field.notes,
    )
