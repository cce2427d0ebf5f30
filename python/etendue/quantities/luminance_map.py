"""A luminance map: what the observer sees, pixel by pixel, with its error."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require, require_number
from etendue.quantities.observer import Observer, Screen, observer_from_dict, observer_to_dict
from etendue.quantities.pixel_map import MapValues, PixelMap
from etendue.quantities.provenance import Provenance
from etendue.quantities.relative_error import RelativeError
from etendue.units import LUMINANCE_NAME, LUMINANCE_UNIT, MM2_PER_M2, FluxUnit

FROM_0_ON = "a number from 0 on"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LuminanceMap(PixelMap):
    """Luminance of every pixel of a screen, with its standard error.

    Parameters
    ----------
    values : array, shape (rows, columns)
        Luminance [cd/m²], or radiance [W/(m² sr)] when `flux_unit` is ``"W"``. NaN marks a dead pixel: no ray.
    standard_error : array, shape (rows, columns)
        Standard error of `values`, same unit; NaN where dead or unknown.
    rays : array of int64, shape (rows, columns)
        Rays that each pixel rests on; -1 where unknown.
    observer, screen
        The geometry.
    flux_unit : {"lm", "W"}
        Unit of the flux the map was made from.
    provenance : Provenance
        Where it comes from.
    notes : tuple of str
        What the user should know: method, acceptance and why, dead pixels, skipped rays.
    common_error : float
        Standard error that pixels have in common, relative to the luminance; of each it is part of `standard_error`, and no
        more than that. It does not become less in means over pixels. Of a scene with light fields in it, what these do not
        know is such an error, weighted by flux. 0 where none is known.

    Raises
    ------
    ArgumentError
        If the arrays do not have the screen's shape, or the common error is no number from 0 on.
    UnknownNameError
        If there is no such unit of flux.

    Examples
    --------
    >>> import numpy as np
    >>> screen = Screen(2, 1, 2, 1)
    >>> lmap = LuminanceMap(np.array([[3.0, np.nan]]), np.array([[0.1, np.nan]]), np.array([[900, 0]]),
    ...                     Observer(0, 0, 1000), screen)
    >>> lmap.dead_pixels, lmap.unit
    (1, 'cd/m²')
    """

    values: MapValues
    standard_error: MapValues
    rays: npt.NDArray[np.int64]
    observer: Observer
    screen: Screen
    flux_unit: FluxUnit = "lm"
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()
    common_error: float = 0.0

    UNITS: ClassVar = LUMINANCE_UNIT
    QUANTITIES: ClassVar = LUMINANCE_NAME

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.observer, Observer, "LuminanceMap: observer", "an Observer: et.Observer(theta, phi, distance)")
        require_number(self.common_error, "LuminanceMap: common_error", FROM_0_ON)
        if not 0.0 <= self.common_error < math.inf:
            raise ArgumentError(f"LuminanceMap: common_error is {self.common_error!r}; give {FROM_0_ON}.")

    @property
    def dead_pixels(self) -> int:
        """Number of pixels that no ray reached (NaN in `values`)."""
        return int(np.isnan(self.values).sum())

    @property
    def relative_error(self) -> RelativeError | None:
        """Standard error over value, for the map as a whole; None if no pixel with light has a known error."""
        return RelativeError.of(self.values, self.standard_error, self.screen.cosine(self.observer))

    @property
    def intensity(self) -> float:
        """Luminous intensity towards the observer [cd] (or [W/sr]): Σ L · apparent pixel area; dead pixels add nothing.

        Exact for a far observer; for a near one it is the sum over pixels, each seen along its own line.
        """
        apparent = self.screen.pixel_area / MM2_PER_M2 * self.screen.cosine(self.observer)
        return float(np.nansum(self.values * apparent))

    def header(self) -> dict[str, Any]:
        """Everything but the arrays, as plain data for file headers; the common error only if there is one."""
        common = {"common_error": self.common_error} if self.common_error else {}
        return super().header() | common

    @classmethod
    def from_header(
        cls, header: dict[str, Any], values: MapValues, standard_error: MapValues, rays: npt.NDArray[np.int64]
    ) -> Self:
        """Inverse of `header`, for readers."""
        found = super().from_header(header, values, standard_error, rays)
        return found.replace(common_error=header.get("common_error", 0.0))

    def _geometry(self) -> dict[str, Any]:
        return {"observer": observer_to_dict(self.observer), "screen": dataclasses.asdict(self.screen)}

    @classmethod
    def _geometry_from(cls, header: dict[str, Any]) -> dict[str, Any]:
        return {"observer": observer_from_dict(header["observer"]), "screen": Screen(**header["screen"])}


DEAD = " pixels are dead (no ray): NaN"
"""How the note on dead pixels ends."""


def dead_note(dead: npt.NDArray[np.bool_]) -> str:
    """How many pixels are dead.

    Examples
    --------
    >>> dead_note(np.array([True, False, False]))
    '1 of 3 pixels are dead (no ray): NaN'
    """
    return f"{int(dead.sum()):,} of {dead.size:,}{DEAD}"


def errors_parted(values: MapValues, errors: MapValues, common: float) -> tuple[MapValues, MapValues]:
    """What of the standard errors of pixels they have in common, and the rest, so that the squares of both add up.

    Parameters
    ----------
    values, errors : array, of one shape
        Of pixels, or terms of a sum over them, in one unit; NaN where unknown.
    common : float
        `LuminanceMap.common_error`. No pixel has more of it than its own error.

    Returns
    -------
    shared, own : array
        In that shape and unit.

    Examples
    --------
    >>> shared, own = errors_parted(np.array([10.0, 9.0]), np.array([0.5, 0.1]), 0.03)
    >>> shared.round(9).tolist(), own.round(9).tolist()
    ([0.3, 0.1], [0.4, 0.0])
    """
    if not common:
        return np.zeros_like(errors), errors
    shared = np.minimum(common * np.abs(values), errors)
    return shared, np.sqrt(np.maximum(errors**2 - shared**2, 0.0))


def notes_that_stay(lmap: LuminanceMap) -> tuple[str, ...]:
    """The notes of a map that are true of it smoothed: how many pixels were dead is not.

    Examples
    --------
    >>> lmap = LuminanceMap([[np.nan]], [[np.nan]], [[0]], Observer(0, 0, 1000), Screen(1, 1, 1, 1))
    >>> notes_that_stay(lmap.replace(notes=("7 rays", dead_note(np.isnan(lmap.values)))))
    ('7 rays',)
    """
    return tuple(note for note in lmap.notes if not note.endswith(DEAD))


def check_luminance_map(given: object, asker: str) -> None:
    """Refuse what is no map of luminance, such as one of illuminance.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> check_luminance_map("map.exr", "compare")
    Traceback (most recent call last):
    etendue.errors.ArgumentError: compare: the map is 'map.exr'; give a LuminanceMap, of a file et.read_map(path).
    """
    require(given, LuminanceMap, f"{asker}: the map", "a LuminanceMap, of a file et.read_map(path)")
