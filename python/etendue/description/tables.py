"""Shares of light over angle of incidence and wavelength: what reflectance and transmittance may be."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import Discriminator, Tag, model_validator

from etendue.description.files import Files, read_columns
from etendue.description.keys import Description
from etendue.description.mistakes import NUMBER, TABLE
from etendue.description.values import (
    SHORTEST_WAVELENGTH,
    AsNumber,
    AsRow,
    Finite,
    FirstMistake,
    Rising,
    Share,
    rises,
)
from etendue.errors import ArgumentError

Array = npt.NDArray[np.float64]
Angle = Annotated[float, Finite, Ge(0.0), Le(90.0), AsNumber]


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """A table as the core takes it: bilinear between the nodes, constant outside.

    Parameters
    ----------
    angle : array, shape (n,)
        Of incidence, from the normal [°], rising.
    wavelength : array, shape (m,)
        [nm], rising.
    values : array, shape (n, m)

    Examples
    --------
    >>> slope = Grid(np.array([0.0, 90.0]), np.array([555.0]), np.array([[0.2], [0.8]]))
    >>> slope.at(np.array([45.0]), np.array([400.0, 700.0])).tolist()
    [[0.5, 0.5]]
    """

    angle: Array
    wavelength: Array
    values: Array

    def at(self, angle: Array, wavelength: Array) -> Array:
        """Values at every pair of angle and wavelength, shape (angles, wavelengths)."""
        by_angle = np.stack([np.interp(angle, self.angle, column) for column in self.values.T], axis=1)
        return np.stack([np.interp(wavelength, self.wavelength, row) for row in by_angle])

    def record(self) -> dict[str, Array]:
        """The table in radians."""
        return {"angle": np.radians(self.angle), "wavelength": self.wavelength, "values": self.values}


def constant(value: float) -> Grid:
    """The same share for every angle and wavelength.

    Examples
    --------
    >>> constant(0.5).values.tolist()
    [[0.5]]
    """
    return Grid(np.array([0.0]), np.array([555.0]), np.array([[value]]))


def on_common_nodes(grids: list[Grid]) -> tuple[Array, Array, list[Array]]:
    """The same functions on the union of their nodes, where sums and differences of bilinear functions are exact.

    Examples
    --------
    >>> on_common_nodes([constant(0.5), constant(0.25)])[2]
    [array([[0.5]]), array([[0.25]])]
    """
    angle = np.unique(np.concatenate([grid.angle for grid in grids]))
    wavelength = np.unique(np.concatenate([grid.wavelength for grid in grids]))
    return angle, wavelength, [grid.at(angle, wavelength) for grid in grids]


class ShareTable(Description):
    """Shares of the incident light in a table.

    Parameters
    ----------
    angle : numbers, optional
        Angles of incidence from the normal [°], rising, 0 to 90.
    wavelength : numbers, optional
        [nm], rising.
    values : numbers, or rows of numbers
        One for each angle or each wavelength; if both are given one row for each angle, with one value for each
        wavelength.
    file : path
        A text file of two columns instead of all these; `by` says what the first one is.
    by : {"angle", "wavelength"}

    Examples
    --------
    >>> ShareTable(angle=[0, 60, 90], values=[0.04, 0.09, 1]).grid(Files()).values.ravel().tolist()
    [0.04, 0.09, 1.0]
    """

    angle: Annotated[tuple[Angle, ...], MinLen(1), MaxLen(1 << 16), FirstMistake, AsRow] | None = None
    wavelength: Rising | None = None
    values: Annotated[tuple[Any, ...], MinLen(1), MaxLen(1 << 16), FirstMistake, AsRow] | None = None
    file: Path | None = None
    by: Literal["angle", "wavelength"] | None = None

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        if (self.file is None) != (self.by is None):
            raise ValueError("'file' and 'by' belong together: by = 'angle' or by = 'wavelength'")
        if (self.file is None) == (self.values is None):
            raise ValueError("give either 'values', or a 'file'")
        if self.file is not None and (self.angle or self.wavelength):
            raise ValueError("'angle' and 'wavelength' are columns of the file; leave them out")
        if self.file is None:
            if self.angle is None and self.wavelength is None:
                raise ValueError("give 'angle', 'wavelength' or both")
            for name in ("angle", "wavelength"):
                if getattr(self, name) is not None:
                    rises(name, getattr(self, name))
            self._given()
        return self

    def _given(self) -> Grid:
        try:
            values = np.array(self.values, dtype=np.float64)
        except (ValueError, TypeError, OverflowError):
            raise ValueError("'values' must be numbers, or rows of the same length") from None
        if not (np.isfinite(values).all() and (values >= 0.0).all() and (values <= 1.0).all()):
            raise ValueError("'values' must lie between 0 and 1")
        lengths = [len(nodes) for nodes in (self.angle, self.wavelength) if nodes is not None]
        if values.shape != tuple(lengths):
            asked = " rows of ".join(map(str, lengths))
            raise ValueError(f"'values' has the shape {values.shape}; the nodes ask for {asked} values")
        angle, wavelength = np.array(self.angle or (0.0,)), np.array(self.wavelength or (555.0,))
        return Grid(angle, wavelength, values.reshape(angle.size, wavelength.size))

    def grid(self, files: Files) -> Grid:
        """The table.

        Raises
        ------
        FormatError
            If the file is no table.
        ArgumentError
            If a number of the file is outside its domain.
        OSError
            If the file cannot be opened.
        """
        if self.file is None:
            return self._given()
        path = files.find(self.file)
        nodes, values = read_columns(path).T
        low, high = (0.0, 90.0) if self.by == "angle" else (SHORTEST_WAVELENGTH, np.inf)
        if not (low <= nodes[0] and nodes[-1] <= high and (values >= 0.0).all() and (values <= 1.0).all()):
            raise ArgumentError(
                f"{path}: angles must be 0 to 90°, and values 0 to 1; wavelengths are in nm, and "
                f"{SHORTEST_WAVELENGTH:g} nm at least"
            )
        if self.by == "angle":
            return Grid(nodes.copy(), np.array([555.0]), values[:, None].copy())
        return Grid(np.array([0.0]), nodes.copy(), values[None, :].copy())


def _number_or_table(value: Any) -> str:
    return TABLE if isinstance(value, Mapping | ShareTable) else NUMBER


Shares = Annotated[Annotated[Share, Tag(NUMBER)] | Annotated[ShareTable, Tag(TABLE)], Discriminator(_number_or_table)]
"""A number, or a table over angle, wavelength or both."""


def grid_of(shares: float | ShareTable, files: Files) -> Grid:
    """What a number or a table stands for.

    Examples
    --------
    >>> grid_of(0.5, Files()).values.tolist()
    [[0.5]]
    """
    return shares.grid(files) if isinstance(shares, ShareTable) else constant(shares)
