"""What a sweep found: a number with its standard error for each measure and each step."""

from __future__ import annotations

import csv
import dataclasses
import io
import itertools
import numbers
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.output import atomic_output
from etendue.quantities.arguments import require, require_known, require_path
from etendue.quantities.labelled import dataset
from etendue.quantities.notebook import InNotebook
from etendue.quantities.provenance import Provenance

if TYPE_CHECKING:
    import xarray

Array = npt.NDArray[np.float64]

EXTENSIONS = (".csv",)
"""Of files that hold a table."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SweepTable(InNotebook):
    """Measures of a scene over one parameter, or over a grid of several; made by `sweep`.

    Parameters
    ----------
    parameters : mapping of str to array, shape (n,)
        The values of each parameter, by its path. Their lengths are the shape of the grid.
    values, standard_error : mapping of str to array, shape of the grid
        By the name of the measure, in `units`; NaN for steps that are not done. An error is NaN where it is unknown, and
        that of the value itself: see `sweep` on differences.
    units : mapping of str to str
        Of parameters and measures; empty where there is none.
    done : int
        Steps that are done; the last parameter changes fastest.
    provenance : Provenance
    notes : tuple of str
        What the user should know.

    Raises
    ------
    ArgumentError
        If an array has not the shape of the grid.

    Examples
    --------
    >>> table = SweepTable({"lens.at.2": [5.0, 6.0]}, {"maximum": [3.0, 4.0]}, {"maximum": [0.1, 0.1]},
    ...                    {"lens.at.2": "mm", "maximum": "cd/m²"}, done=2)
    >>> table, table["maximum"].tolist()
    (<SweepTable of 2 steps over lens.at.2: maximum>, [3.0, 4.0])
    >>> print(table.to_csv(), end="")
    lens.at.2 [mm],maximum [cd/m²],standard error of maximum [cd/m²]
    5.0,3.0,0.1
    6.0,4.0,0.1
    """

    parameters: Mapping[str, Array]
    values: Mapping[str, Array]
    standard_error: Mapping[str, Array]
    units: Mapping[str, str]
    done: int
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("parameters", "values", "standard_error", "units"):
            require(getattr(self, field), Mapping, f"SweepTable: {field}", "a mapping by name")
        require(self.done, numbers.Integral, "SweepTable: done", "a whole number of steps")
        axes = {name: _frozen(values) for name, values in self.parameters.items()}
        shape = tuple(axis.size for axis in axes.values())
        object.__setattr__(self, "parameters", axes)
        for field in ("values", "standard_error"):
            arrays = {name: _frozen(values) for name, values in getattr(self, field).items()}
            for name, array in arrays.items():
                if array.shape != shape:
                    raise ArgumentError(
                        f"SweepTable: {field} of {name!r} has shape {array.shape}, the grid has {shape}."
                    )
            object.__setattr__(self, field, arrays)
        if set(self.values) != set(self.standard_error) or not 0 <= self.done <= self.steps:
            raise ArgumentError("SweepTable: give an error for each value, and no more steps done than there are.")

    def __repr__(self) -> str:
        """Steps, parameters and measures."""
        steps = f"{self.steps:,} steps" if self.complete else f"{self.done:,} of {self.steps:,} steps"
        line = f"<SweepTable of {steps} over {', '.join(self.parameters)}: {', '.join(self.values)}"
        return (line if len(line) < 200 else line[:199] + "…") + ">"

    def __getitem__(self, name: str) -> Array:
        """The values of a parameter or of a measure.

        Raises
        ------
        UnknownNameError
            If there is none of this name; suggests the nearest.
        """
        columns = {**self.parameters, **self.values}
        require_known(name, columns, "parameter or measure")
        return columns[name]

    def __len__(self) -> int:
        """Number of steps that are done."""
        return self.done

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the grid."""
        return tuple(axis.size for axis in self.parameters.values())

    @property
    def steps(self) -> int:
        """Of the whole grid."""
        return int(np.prod(self.shape))

    @property
    def complete(self) -> bool:
        """Whether all steps are done."""
        return self.done == self.steps

    def unit(self, name: str) -> str:
        """Of a parameter or measure; empty if it has none."""
        require(name, str, "SweepTable.unit: name", "that of a parameter or measure")
        return self.units.get(name, "")

    def best(self, measure: str) -> dict[str, float]:
        """The values of the parameters at which a measure is largest.

        Examples
        --------
        >>> SweepTable({"a": [5, 6]}, {"m": [3, 4]}, {"m": [0.1, 0.1]}, {}, done=2).best("m")
        {'a': 6.0}
        """
        require_known(measure, self.values, "measure")
        if np.isnan(self.values[measure]).all():
            raise ArgumentError(f"SweepTable: {measure} is unknown at all steps.")
        place = np.unravel_index(np.nanargmax(self.values[measure]), self.shape)
        return {name: float(axis[i]) for (name, axis), i in zip(self.parameters.items(), place, strict=True)}

    def rows(self) -> Iterator[tuple[float, ...]]:
        """The steps that are done: parameters, then value and standard error of each measure."""
        columns = [array.ravel() for name in self.values for array in (self.values[name], self.standard_error[name])]
        for number, place in enumerate(itertools.product(*(axis.tolist() for axis in self.parameters.values()))):
            if number == self.done:
                return
            yield (*place, *(float(column[number]) for column in columns))

    def headings(self) -> list[str]:
        """Of the columns of `rows`, with their units."""
        found = [self._with_unit(name, name) for name in self.parameters]
        for name in self.values:
            found += [self._with_unit(name, name), self._with_unit(f"standard error of {name}", name)]
        return found

    def _with_unit(self, text: str, name: str) -> str:
        return f"{text} [{self.units[name]}]" if self.units.get(name) else text

    def to_csv(self) -> str:
        """The table as text with a line of headings; what is unknown is empty."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.headings())
        writer.writerows(["" if value != value else value for value in row] for row in self.rows())  # noqa: PLR0124 - NaN
        return text.getvalue()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the steps that are done as a CSV file in UTF-8, whole or not at all.

        Raises
        ------
        UnknownNameError
            If the extension is not .csv.
        ArgumentError
            If the folder does not exist.
        """
        require_path(path)
        if Path(path).suffix.lower() not in EXTENSIONS:
            raise UnknownNameError("extension of a table", Path(path).suffix, EXTENSIONS)
        with atomic_output(path) as temporary:
            temporary.write_text(self.to_csv(), encoding="utf-8")

    def to_xarray(self) -> xarray.Dataset:
        """The table as a dataset of xarray: each measure and its standard error over the parameters.

        Raises
        ------
        MissingLibraryError
            If xarray is not installed: ``pip install 'etendue[xarray]'``.

        Examples
        --------
        >>> found = SweepTable({"a": [5, 6]}, {"m": [3, 4]}, {"m": [0.1, 0.1]}, {"m": "lm"}, done=2).to_xarray()
        >>> float(found["m"].sel(a=6)), found["m"].attrs["units"]
        (4.0, 'lm')
        """
        variables = {}
        for name in self.values:
            variables[name] = (self.values[name], self.unit(name))
            variables[f"standard error of {name}"] = (self.standard_error[name], self.unit(name))
        axes = {name: (axis, self.unit(name)) for name, axis in self.parameters.items()}
        facts = {"provenance": self.provenance.to_dict(), "notes": list(self.notes), "done": self.done}
        return dataset(variables, axes, facts)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: the steps that are done, one mapping each."""
        names = [*self.parameters, *(key for name in self.values for key in (name, f"standard error of {name}"))]
        return {
            "parameters": {name: axis.tolist() for name, axis in self.parameters.items()},
            "units": dict(self.units),
            "steps": self.steps,
            "done": self.done,
            "rows": [dict(zip(names, row, strict=True)) for row in self.rows()],
            "provenance": self.provenance.to_dict(),
            "notes": list(self.notes),
        }


def _frozen(values: npt.ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
