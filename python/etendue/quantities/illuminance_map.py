"""Illuminance on a rectangle, cell by cell, with its error."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.luminance_map import PLOT_MAP, SAVE_MAP
from etendue.quantities.observer import Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.relative_error import RelativeError
from etendue.units import FLUX_UNITS, ILLUMINANCE_NAME, ILLUMINANCE_UNIT, MM2_PER_M2, FluxUnit

Array = npt.NDArray[np.float64]
Point = tuple[float, float, float]

ROUNDING = 1e-9
"""By which axes that were computed may miss being orthonormal."""


@dataclasses.dataclass(frozen=True, eq=False)
class IlluminanceMap:
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

    values: Array
    standard_error: Array
    rays: npt.NDArray[np.int64]
    screen: Screen
    centre: Point = (0.0, 0.0, 0.0)
    right: Point = (1.0, 0.0, 0.0)
    up: Point = (0.0, 1.0, 0.0)
    flux_unit: FluxUnit = "lm"
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Size, brightest cell and origin."""
        brightest = np.max(self.values, initial=0.0, where=np.isfinite(self.values))
        rows, columns = self.screen.shape
        size = f"{columns} × {rows} cells"
        return f"<IlluminanceMap of {size} up to {brightest:.4g} {self.unit} from {self.provenance.source}>"

    def __post_init__(self) -> None:
        if self.flux_unit not in FLUX_UNITS:
            raise UnknownNameError("flux unit", self.flux_unit, FLUX_UNITS)
        for name, dtype in (("values", np.float64), ("standard_error", np.float64), ("rays", np.int64)):
            with np.errstate(invalid="ignore"):  # signalling NaN of damaged files
                array = np.array(getattr(self, name), dtype=dtype)
            if array.shape != self.screen.shape:
                raise ArgumentError(
                    f"IlluminanceMap: {name} has shape {array.shape}, the grid has (rows, columns) = {self.screen.shape}."
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        for name in ("centre", "right", "up"):
            point = tuple(float(c) for c in getattr(self, name))
            if len(point) != 3 or not np.isfinite(point).all():
                raise ArgumentError(f"IlluminanceMap: {name} is {point}; give three finite numbers.")
            object.__setattr__(self, name, point)
        axes = np.array([self.right, self.up])
        if np.abs(axes @ axes.T - np.eye(2)).max() > ROUNDING:
            raise ArgumentError(f"IlluminanceMap: {self.right} and {self.up} are no unit vectors at right angles.")

    @property
    def unit(self) -> str:
        """``"lx"`` or ``"W/m²"``."""
        return ILLUMINANCE_UNIT[self.flux_unit]

    @property
    def quantity(self) -> str:
        """``"illuminance"`` or ``"irradiance"``."""
        return ILLUMINANCE_NAME[self.flux_unit]

    @property
    def normal(self) -> Point:
        """Unit vector on the front: right × up."""
        x, y, z = np.cross(self.right, self.up).tolist()
        return x, y, z

    @property
    def points(self) -> Array:
        """Centres of the cells [mm], shape (rows, columns, 3)."""
        across = self.screen.x[None, :, None] * np.array(self.right)
        upwards = self.screen.y[:, None, None] * np.array(self.up)
        points: Array = np.array(self.centre) + across + upwards
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
    def uniformity(self) -> float:
        """Least over mean illuminance of the cells (U₀ of the trade); NaN if it is dark."""
        return float(self.values.min()) / self.mean if self.mean > 0.0 else float("nan")

    def replace(self, **changes: Any) -> IlluminanceMap:
        """A copy with some fields changed (`dataclasses.replace`)."""
        return dataclasses.replace(self, **changes)

    def save(self, path: str | os.PathLike[str]) -> tuple[str, ...]:
        """Write the map; the format follows the extension: .exr .tif .npz .csv, and .png for a picture.

        Returns
        -------
        tuple of str
            What the format could not express, one sentence each; empty when it holds everything.
        """
        return SAVE_MAP[0](self, Path(path))

    def plot(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """Draw the map in false colour; see `etendue.plot.plot_map` for the options."""
        return PLOT_MAP[0](self, path, **options)

    def header(self) -> dict[str, Any]:
        """Everything but the arrays, as plain data for file headers."""
        return {
            "quantity": self.quantity,
            "unit": self.unit,
            "flux_unit": self.flux_unit,
            "screen": dataclasses.asdict(self.screen),
            "centre": list(self.centre),
            "right": list(self.right),
            "up": list(self.up),
            "provenance": self.provenance.to_dict(),
            "notes": list(self.notes),
        }

    @classmethod
    def from_header(
        cls, header: dict[str, Any], values: Array, standard_error: Array, rays: npt.NDArray[np.int64]
    ) -> IlluminanceMap:
        """Inverse of `header`, for readers."""
        return cls(
            values,
            standard_error,
            rays,
            Screen(**header["screen"]),
            header["centre"],
            header["right"],
            header["up"],
            header["flux_unit"],
            Provenance.from_dict(header["provenance"]),
            tuple(header["notes"]),
        )
