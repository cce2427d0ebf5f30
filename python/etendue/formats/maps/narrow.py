"""Maps in the number types of picture files: float32 luminance, uint32 ray counts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.formats.maps.map_format import AnyMap
from etendue.quantities.pixel_map import MapValues

UNKNOWN_RAYS = 2**32 - 1
"""Stands for "number of rays unknown" (-1 in a `LuminanceMap`) in a channel that has no negative numbers."""

MAX_RAYS = UNKNOWN_RAYS - 1


def narrowed(lmap: AnyMap) -> tuple[AnyMap, tuple[str, ...]]:
    """Round a map to what float32 and uint32 hold.

    Parameters
    ----------
    lmap : LuminanceMap or IlluminanceMap
        Any map.

    Returns
    -------
    LuminanceMap or IlluminanceMap
        The map that will be read back: values and errors rounded to 24 bits (relative 6e-8).
    tuple of str
        What was lost, one sentence each.

    Raises
    ------
    ArgumentError
        If a value is too large for float32.
    """
    values, standard_error = (_rounded(array) for array in (lmap.values, lmap.standard_error))
    rays = np.minimum(lmap.rays, MAX_RAYS)
    notes = []
    pairs = ((values, lmap.values), (standard_error, lmap.standard_error))
    if not all(np.array_equal(new, old, equal_nan=True) for new, old in pairs):
        notes.append("luminances and standard errors are rounded to float32 (relative 6e-8)")
    if (rays != lmap.rays).any():
        notes.append(f"ray counts above {MAX_RAYS} are written as {MAX_RAYS}")
    return lmap.replace(values=values, standard_error=standard_error, rays=rays), tuple(notes)


def _rounded(array: MapValues) -> MapValues:
    largest = np.abs(array[np.isfinite(array)]).max(initial=0.0)
    if largest > np.finfo(np.float32).max:
        raise ArgumentError(f"the map holds {largest:g}, which float32 cannot express. Save it as .npz or .csv.")
    return array.astype(np.float32).astype(np.float64)


def rays_to_uint32(rays: npt.NDArray[np.int64]) -> npt.NDArray[np.uint32]:
    """Ray counts of a narrowed map, `UNKNOWN_RAYS` where unknown."""
    return np.where(rays < 0, UNKNOWN_RAYS, rays).astype(np.uint32)


def rays_from_uint32(stored: npt.NDArray[np.uint32]) -> npt.NDArray[np.int64]:
    """Inverse of `rays_to_uint32`."""
    rays = stored.astype(np.int64)
    rays[rays == UNKNOWN_RAYS] = -1
    return rays
