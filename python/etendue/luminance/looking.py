"""Maps from a light field: luminance averaged over each pixel, by quadrature."""

from __future__ import annotations

import numpy as np

from etendue.lightfield.light_field import LightField
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import checked_threads
from etendue.units import MM2_PER_M2


def look_at_field(
    field: LightField, observer: Observer, screen: Screen, samples: int, threads: int | None
) -> LuminanceMap:
    """The map of a field for one observer; see `luminance_map`."""
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
