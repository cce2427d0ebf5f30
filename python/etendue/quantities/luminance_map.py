"""A luminance map: what the observer sees, pixel by pixel, with its error."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.observer import Observer, Screen, observer_from_dict
from etendue.quantities.provenance import Provenance
from etendue.quantities.relative_error import RelativeError
from etendue.units import FLUX_UNITS, LUMINANCE_NAME, LUMINANCE_UNIT, MM2_PER_M2, FluxUnit

MapValues = npt.NDArray[np.float64]

SAVE_MAP: list[Callable[[Any, Path], tuple[str, ...]]] = []
"""The door through which a map, of luminance or of illuminance, leaves to a file; `etendue.formats` opens it (floors
import downwards only)."""

PLOT_MAP: list[Callable[..., Any]] = []
"""The door through which a map becomes a picture; `etendue.plot` opens it."""


@dataclasses.dataclass(frozen=True, eq=False)
class LuminanceMap:
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

    Raises
    ------
    ArgumentError
        If the arrays do not have the screen's shape.
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

    def __repr__(self) -> str:
        """Size, brightest pixel and origin."""
        brightest = np.max(self.values, initial=0.0, where=np.isfinite(self.values))
        rows, columns = self.screen.shape
        return f"<LuminanceMap of {columns} × {rows} pixels up to {brightest:.4g} {self.unit} from {self.provenance.source}>"

    def __post_init__(self) -> None:
        if self.flux_unit not in FLUX_UNITS:
            raise UnknownNameError("flux unit", self.flux_unit, FLUX_UNITS)
        for name, dtype in (("values", np.float64), ("standard_error", np.float64), ("rays", np.int64)):
            with np.errstate(invalid="ignore"):  # signalling NaN of damaged files
                array = np.array(getattr(self, name), dtype=dtype)
            if array.shape != self.screen.shape:
                raise ArgumentError(
                    f"LuminanceMap: {name} has shape {array.shape}, the screen has (rows, columns) = {self.screen.shape}."
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def unit(self) -> str:
        """``"cd/m²"`` or ``"W/(m² sr)"``."""
        return LUMINANCE_UNIT[self.flux_unit]

    @property
    def quantity(self) -> str:
        """``"luminance"`` or ``"radiance"``."""
        return LUMINANCE_NAME[self.flux_unit]

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

    def replace(self, **changes: Any) -> LuminanceMap:
        """A copy with some fields changed (`dataclasses.replace`)."""
        return dataclasses.replace(self, **changes)

    def save(self, path: str | os.PathLike[str]) -> tuple[str, ...]:
        """Write the map; the format follows the extension: .exr .hdr .tif .npz .csv, and .png for a picture.

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
            "observer": dataclasses.asdict(self.observer),
            "screen": dataclasses.asdict(self.screen),
            "provenance": self.provenance.to_dict(),
            "notes": list(self.notes),
        }

    @classmethod
    def from_header(
        cls, header: dict[str, Any], values: MapValues, standard_error: MapValues, rays: npt.NDArray[np.int64]
    ) -> LuminanceMap:
        """Inverse of `header`, for readers."""
        return cls(
            values,
            standard_error,
            rays,
            observer_from_dict(header["observer"]),
            Screen(**header["screen"]),
            header["flux_unit"],
            Provenance.from_dict(header["provenance"]),
            tuple(header["notes"]),
        )
