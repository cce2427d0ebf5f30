"""Illuminance on a rectangle, cell by cell, with its error."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_point, require_number
from etendue.quantities.observer import Screen
from etendue.quantities.pixel_map import MapValues, PixelMap
from etendue.quantities.provenance import Provenance
from etendue.quantities.relative_error import RelativeError
from etendue.units import ILLUMINANCE_NAME, ILLUMINANCE_UNIT, MM2_PER_M2, FluxUnit

Point = tuple[float, float, float]

ROUNDING = 1e-9
"""By which axes that were computed may miss being orthonormal."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class IlluminanceMap(PixelMap):
    """Illuminance of every cell of a rectangle, with its standard error, for light that arrives on its front.

    Parameters
    ----------
    values : array, shape (rows, columns)
        Mean over the cell [lx], or irradiance [W/m²] when `flux_unit` is ``"W"``. Row 0 is the top, column 0 the left.
    standard_error : array, shape (rows, columns)
        Same unit; NaN where unknown: where no ray arrived.
    rays : array of int64, shape (rows, columns)
        Rays that each cell rests on.
    screen : Screen
        The grid, ``plane="xy"``: in the plane that `right` and `up` span.
    centre : 3 floats
        Of the rectangle [mm].
    right, up : 3 floats
        Unit vectors along the rows and up the columns. The front is the side of right × up.
    flux_unit : {"lm", "W"}
    provenance : Provenance
    notes : tuple of str
        What the user should know.
    flux_error : float
        Standard error of the flux of all cells [`flux_unit`]; NaN where unknown. A ray may come to several cells, by the
        walls of a room, and what it brings to them is not independent: errors of the cells do not tell it.

    Raises
    ------
    ArgumentError
        If the arrays do not have the screen's shape, or the axes are no unit vectors at right angles.
    UnknownNameError
        If there is no such unit of flux.

    Examples
    --------
    >>> desk = IlluminanceMap([[400.0, 600.0]], [[4.0, 5.0]], [[900, 1100]], Screen(2000, 1000, 2, 1, "xy"))
    >>> desk.mean, desk.flux, desk.unit
    (500.0, 1000.0, 'lx')
    >>> desk.points[0, 1].tolist(), desk.normal
    ([500.0, 0.0, 0.0], (0.0, 0.0, 1.0))
    """

    values: MapValues
    standard_error: MapValues
    rays: npt.NDArray[np.int64]
    screen: Screen
    centre: Point = (0.0, 0.0, 0.0)
    right: Point = (1.0, 0.0, 0.0)
    up: Point = (0.0, 1.0, 0.0)
    flux_unit: FluxUnit = "lm"
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()
    flux_error: float = math.nan

    UNITS: ClassVar = ILLUMINANCE_UNIT
    QUANTITIES: ClassVar = ILLUMINANCE_NAME
    PIXELS: ClassVar = "cells"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("centre", "right", "up"):
            object.__setattr__(
                self, name, as_point(getattr(self, name), f"IlluminanceMap: {name}", "three finite numbers")
            )
        require_number(self.flux_error, "IlluminanceMap: flux_error", "a standard error, or leave it out")
        axes = np.array([self.right, self.up])
        if np.abs(axes @ axes.T - np.eye(2)).max() > ROUNDING:
            raise ArgumentError(f"IlluminanceMap: {self.right} and {self.up} are no unit vectors at right angles.")

    @property
    def normal(self) -> Point:
        """Unit vector on the front: right × up."""
        x, y, z = np.cross(self.right, self.up).tolist()
        return x, y, z

    @property
    def points(self) -> MapValues:
        """Centres of the cells [mm], shape (rows, columns, 3)."""
        across = self.screen.x[None, :, None] * np.array(self.right)
        upwards = self.screen.y[:, None, None] * np.array(self.up)
        points: MapValues = np.array(self.centre) + across + upwards
        return points

    @property
    def flux(self) -> float:
        """Flux on the front of the rectangle [`flux_unit`]."""
        return float(self.values.sum()) * self.screen.pixel_area / MM2_PER_M2

    @property
    def relative_error(self) -> RelativeError | None:
        """Standard error over value, for the map as a whole; None if no cell with light has a known error."""
        return RelativeError.of(self.values, self.standard_error)

    @property
    def mean(self) -> float:
        """Mean illuminance [`unit`]."""
        return float(self.values.mean())

    @property
    def mean_error(self) -> float:
        """Standard error of the mean illuminance [`unit`]; NaN where unknown."""
        return self.flux_error * MM2_PER_M2 / (self.screen.pixel_area * self.values.size)

    @property
    def uniformity(self) -> float:
        """Least over mean illuminance of the cells (U₀ of the trade); NaN if it is dark."""
        return float(self.values.min()) / self.mean if self.mean > 0.0 else float("nan")

    def _geometry(self) -> dict[str, Any]:
        axes = {name: list(getattr(self, name)) for name in ("centre", "right", "up")}
        flux_error = None if math.isnan(self.flux_error) else self.flux_error
        return {"screen": dataclasses.asdict(self.screen), **axes, "flux_error": flux_error}

    @classmethod
    def _geometry_from(cls, header: dict[str, Any]) -> dict[str, Any]:
        # Files of earlier versions do not say it.
        flux_error = header.get("flux_error")
        axes = {name: header[name] for name in ("centre", "right", "up")}
        return {
            "screen": Screen(**header["screen"]),
            **axes,
            "flux_error": math.nan if flux_error is None else flux_error,
        }
