"""What maps of luminance and of illuminance share: a value, an error and a ray count for every pixel of a screen."""

from __future__ import annotations

import abc
import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require, require_fields, require_known, require_path
from etendue.quantities.labelled import dataset
from etendue.quantities.notebook import InNotebook
from etendue.quantities.observer import Screen
from etendue.quantities.outlets import GoesOut
from etendue.quantities.provenance import Provenance
from etendue.units import FLUX_UNITS, FluxUnit

if TYPE_CHECKING:
    import xarray

MapValues = npt.NDArray[np.float64]


class PixelMap(InNotebook, GoesOut, abc.ABC):
    """A map on a screen: frozen, with its error and its origin.

    A kind of map is a dataclass that has these fields and those of its geometry, and says how both are called.

    Parameters
    ----------
    values : array, shape (rows, columns)
        [`unit`]
    standard_error : array, shape (rows, columns)
        Same unit; NaN where unknown.
    rays : array of int64, shape (rows, columns)
        Rays that each pixel rests on.
    screen : Screen
    flux_unit : {"lm", "W"}
    provenance : Provenance
    notes : tuple of str

    Raises
    ------
    ArgumentError
        If the arrays do not have the screen's shape.
    UnknownNameError
        If there is no such unit of flux.
    """

    values: MapValues
    standard_error: MapValues
    rays: npt.NDArray[np.int64]
    screen: Screen
    flux_unit: FluxUnit
    provenance: Provenance
    notes: tuple[str, ...]

    UNITS: ClassVar[Mapping[FluxUnit, str]]
    QUANTITIES: ClassVar[Mapping[FluxUnit, str]]
    PIXELS: ClassVar[str] = "pixels"

    def __repr__(self) -> str:
        """Size, brightest pixel and origin."""
        brightest = np.max(self.values, initial=0.0, where=np.isfinite(self.values))
        rows, columns = self.screen.shape
        size = f"{columns} × {rows} {self.PIXELS}"
        return f"<{type(self).__name__} of {size} up to {brightest:.4g} {self.unit} from {self.provenance.source}>"

    def __post_init__(self) -> None:
        require_known(self.flux_unit, FLUX_UNITS, "flux unit")
        kind = type(self).__name__
        require(self.provenance, Provenance, f"{kind}: provenance", "a Provenance, or leave it out")
        require(self.screen, Screen, f"{kind}: screen", "an et.Screen(width, height, columns, rows)")
        for name, dtype in (("values", np.float64), ("standard_error", np.float64), ("rays", np.int64)):
            with np.errstate(invalid="ignore"):  # signalling NaN of damaged files
                array = as_numbers(getattr(self, name), f"{kind}: {name}", dtype=dtype, copy=True)
            if array.shape != self.screen.shape:
                raise ArgumentError(
                    f"{kind}: {name} has shape {array.shape}, the screen has (rows, columns) = {self.screen.shape}."
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def unit(self) -> str:
        """Unit of the values, as ``"cd/m²"`` or ``"lx"``; radiometric if `flux_unit` is ``"W"``."""
        return self.UNITS[self.flux_unit]

    @property
    def quantity(self) -> str:
        """What is mapped: ``"luminance"`` or ``"illuminance"``; ``"radiance"`` or ``"irradiance"`` if in watts."""
        return self.QUANTITIES[self.flux_unit]

    def replace(self, **changes: Any) -> Self:
        """A copy with some fields changed (`dataclasses.replace`)."""
        require_fields(changes, type(self))
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]  # its kinds are dataclasses

    def save(self, path: str | os.PathLike[str]) -> tuple[str, ...]:
        """Write the map; the format follows the extension.

        That is .exr, .tif, .npz, .csv, for luminance also .hdr, and .png, .svg or .pdf for a picture.

        Returns
        -------
        tuple of str
            What the format could not express, one sentence each; empty when it holds everything.
        """
        require_path(path)
        return self.outlets.save(self, Path(path))

    def plot(self, path: str | os.PathLike[str] | None = None, **options: Any) -> Any:
        """Draw the map in false colour; see `etendue.plot_map` for the options: `ax`, `cmap`, `scale` and so on."""
        return self.outlets.plot(self, path, **options)

    def to_xarray(self) -> xarray.Dataset:
        """The map as a dataset of xarray, for work by name and position.

        Returns
        -------
        xarray.Dataset
            Variables of the name of the `quantity`, ``standard_error`` and ``rays`` over ``y`` and ``x``: centres of the
            pixels from the middle of the screen [mm], y falling as rows do. The attributes are those of `header`; what is
            neither text nor a number is JSON.

        Raises
        ------
        MissingLibraryError
            If xarray is not installed: ``pip install 'etendue[xarray]'``.

        Examples
        --------
        >>> import etendue as et
        >>> screen = et.Screen(60, 60, 6, 6)
        >>> how = et.Cone(acceptance=5)
        >>> lmap = et.luminance_map(et.RingSource(rays=5000), et.Observer(0, 0, 1000), screen, method=how)
        >>> table = lmap.to_xarray()
        >>> bool(table.luminance.sel(x=-5, y=5) == lmap.values[2, 2]), table.luminance.attrs["units"]
        (True, 'cd/m²')
        """
        return dataset(
            {
                self.quantity: (self.values, self.unit),
                "standard_error": (self.standard_error, self.unit),
                "rays": (self.rays, ""),
            },
            {"y": (self.screen.y, "mm"), "x": (self.screen.x, "mm")},
            self.header(),
        )

    def header(self) -> dict[str, Any]:
        """Everything but the arrays, as plain data for file headers."""
        return {
            "quantity": self.quantity,
            "unit": self.unit,
            "flux_unit": self.flux_unit,
            **self._geometry(),
            "provenance": self.provenance.to_dict(),
            "notes": list(self.notes),
        }

    @classmethod
    def from_header(
        cls, header: dict[str, Any], values: MapValues, standard_error: MapValues, rays: npt.NDArray[np.int64]
    ) -> Self:
        """Inverse of `header`, for readers."""
        fields: dict[str, Any] = {
            "values": values,
            "standard_error": standard_error,
            "rays": rays,
            **cls._geometry_from(header),
            "flux_unit": header["flux_unit"],
            "provenance": Provenance.from_dict(header["provenance"]),
            "notes": tuple(header["notes"]),
        }
        return cls(**fields)

    @abc.abstractmethod
    def _geometry(self) -> dict[str, Any]:
        """Where the screen is, as plain data."""

    @classmethod
    @abc.abstractmethod
    def _geometry_from(cls, header: dict[str, Any]) -> dict[str, Any]:
        """Inverse of `_geometry`: fields by name."""
