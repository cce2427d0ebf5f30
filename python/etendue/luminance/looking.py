"""Maps from a light field: luminance averaged over each pixel, by quadrature."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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
        notes=(*field.notes, *_dark(field, values)),
    )


def _dark(field: LightField, values: npt.NDArray[np.float64]) -> tuple[str, ...]:
    """What is to be said of a map without any light."""
    if values.any():
        return ()
    report = field.report
    left_out = report.unmet_flux / (report.unmet_flux + field.total_flux) if report.unmet_flux > 0.0 else 0.0
    if left_out == 0.0:
        return ("the map is dark: the field has no light for this observer",)
    told = (
        f"the map is dark: the light field, {field.surface.told}, has no light for this observer; "
        f"{report.unmet_rays:,} rays ({100.0 * left_out:.2g} % of the flux) do not leave that surface and are in no pixel, "
        "and may be what is seen from here: a surface that holds them, a sphere about the lamp, or the cone shows them"
    )
    return (told,)
