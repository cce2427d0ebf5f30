"""What solids are filled with: refractive index and absorption over wavelength."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import Discriminator, Tag, model_validator

from etendue.description.files import Files, read_columns
from etendue.description.keys import Description
from etendue.description.mistakes import BY_NAME, DESCRIBED, NUMBER, TABLE
from etendue.description.values import (
    SHORTEST_WAVELENGTH,
    AsNumber,
    AsRow,
    Finite,
    FirstMistake,
    NotNegative,
    Number,
    Rising,
    rises,
)
from etendue.errors import ArgumentError
from etendue.units import NM_PER_UM

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

Index = Annotated[float, Finite, Ge(1.0), Le(10.0), AsNumber]


class Spectral(Description):
    """A table over wavelength, linear between its nodes and constant outside.

    Parameters
    ----------
    wavelength : numbers
        [nm], rising.
    values : numbers
        As many.
    file : path
        A text file of two columns, wavelength [nm] and value, instead of both.

    Examples
    --------
    >>> Spectral(wavelength=[400, 700], values=[1.5, 1.4]).table(Files())[1].tolist()
    [1.5, 1.4]
    """

    wavelength: Rising | None = None
    values: Annotated[tuple[NotNegative, ...], MinLen(1), MaxLen(1 << 20), FirstMistake, AsRow] | None = None
    file: Path | None = None

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        if (self.file is None) == (self.wavelength is None and self.values is None):
            raise ValueError("give either 'wavelength' and 'values', or a 'file'")
        if self.file is None:
            if self.wavelength is None or self.values is None or len(self.wavelength) != len(self.values):
                raise ValueError("'wavelength' and 'values' belong together: two rows of the same length")
            rises("wavelength", self.wavelength)
        return self

    def table(self, files: Files) -> tuple[Array, Array]:
        """Wavelengths [nm] and values.

        Raises
        ------
        FormatError
            If the file is no table.
        ArgumentError
            If a wavelength of the file is below 10 nm, or a value is negative.
        OSError
            If the file cannot be opened.
        """
        if self.file is None:
            return np.array(self.wavelength), np.array(self.values)
        path = files.find(self.file)
        columns = read_columns(path)
        if columns[0, 0] < SHORTEST_WAVELENGTH or (columns[:, 1] < 0.0).any():
            raise ArgumentError(
                f"{path}: wavelengths are in nm, and {SHORTEST_WAVELENGTH:g} nm at least, and values must not be negative"
            )
        return columns[:, 0].copy(), columns[:, 1].copy()


class Sellmeier(Description):
    """n² = 1 + Σ bᵢ λ²/(λ² - cᵢ) with λ in µm.

    Parameters
    ----------
    b : numbers
    c : numbers
        [µm²], as many.

    Examples
    --------
    >>> Sellmeier(b=[1.1819], c=[0.011313]).index([587.6]).round(4).tolist()
    [1.4906]
    """

    b: Annotated[tuple[Number, ...], MinLen(1), MaxLen(16), AsRow]
    c: Annotated[tuple[Number, ...], MinLen(1), MaxLen(16), AsRow]

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if len(self.b) != len(self.c):
            raise ValueError("'b' and 'c' belong together: two rows of the same length")
        return self

    def index(self, wavelength: npt.ArrayLike) -> Array:
        """Refractive index at wavelengths [nm]; NaN where the formula has none."""
        l2 = np.square(np.asarray(wavelength, dtype=np.float64) / NM_PER_UM)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            squared = 1.0 + sum(b * l2 / (l2 - c) for b, c in zip(self.b, self.c, strict=True))
            index: Array = np.sqrt(squared)
        return index


def _number_or_table(value: Any) -> str:
    """Which of the two a value is meant to be, so that only the mistakes of that one are told."""
    return TABLE if isinstance(value, Mapping | Spectral) else NUMBER


Absorption = Annotated[
    Annotated[NotNegative, Tag(NUMBER)] | Annotated[Spectral, Tag(TABLE)], Discriminator(_number_or_table)
]


class Medium(Description):
    """A medium: exactly one of `index`, `table` and `sellmeier`, and absorption.

    Parameters
    ----------
    index : number, optional
        Refractive index for every wavelength, 1 to 10.
    table : Spectral, optional
        Refractive index over wavelength.
    sellmeier : Sellmeier, optional
        Dispersion formula.
    absorption : number or Spectral
        Napierian absorption coefficient α [1/mm]: of light, exp(-α s) is left after s mm.

    Examples
    --------
    >>> Medium(index=1.49, absorption=0.001).record(Files())["index"]
    {'kind': 'constant', 'n': 1.49}
    """

    index: Index | None = None
    table: Spectral | None = None
    sellmeier: Sellmeier | None = None
    absorption: Absorption = 0.0

    @model_validator(mode="after")
    def _one_index(self) -> Self:
        given = [name for name in ("index", "table", "sellmeier") if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(repr(name) for name in given) if given else "nothing"
            raise ValueError(f"the refractive index is given by {found}; give one of 'index', 'table', 'sellmeier'")
        return self

    def index_at(self, wavelength: npt.ArrayLike, files: Files) -> Array:
        """Refractive index at wavelengths [nm]; NaN where a dispersion formula has none."""
        at = np.asarray(wavelength, dtype=np.float64)
        if self.sellmeier is not None:
            return self.sellmeier.index(at)
        if self.table is not None:
            return np.interp(at, *self.table.table(files))
        return np.full(at.shape, self.index)

    def record(self, files: Files) -> Record:
        """The medium as the core takes it.

        Raises
        ------
        FormatError, ArgumentError, OSError
            As `Spectral.table`.
        """
        index: Record
        if self.sellmeier is not None:
            index = {"kind": "sellmeier", "b": list(self.sellmeier.b), "c": list(self.sellmeier.c)}
        elif self.table is not None:
            wavelength, n = self.table.table(files)
            index = {"kind": "table", "wavelength": wavelength, "n": n}
        else:
            index = {"kind": "constant", "n": self.index}
        if isinstance(self.absorption, Spectral):
            wavelength, alpha = self.absorption.table(files)
        else:
            wavelength, alpha = np.array([555.0]), np.array([self.absorption])
        return {"index": index, "absorption": {"wavelength": wavelength, "per_mm": alpha}}


def _name_or_description(value: Any) -> str:
    return DESCRIBED if isinstance(value, Mapping | Medium) else BY_NAME


MediumOrName = Annotated[
    Annotated[Medium, Tag(DESCRIBED)] | Annotated[str, Tag(BY_NAME)], Discriminator(_name_or_description)
]
"""A medium, or the name of one that is described elsewhere."""
