"""Values as datasets of xarray: arrays with names, coordinates and units."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from etendue.extras import require

if TYPE_CHECKING:
    import xarray

Variable = tuple[npt.NDArray[Any], str]
"""Numbers, and their unit."""


def dataset(
    variables: Mapping[str, Variable], coordinates: Mapping[str, Variable], facts: Mapping[str, Any]
) -> xarray.Dataset:
    """A dataset whose variables all have the dimensions of the coordinates, in their order.

    Parameters
    ----------
    variables, coordinates : mapping
        By name; an empty unit is none.
    facts : mapping
        Become attributes; what is neither text nor a number becomes JSON, so that files hold it.

    Raises
    ------
    MissingLibraryError
        If xarray is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> table = dataset({"flux": (np.ones(2), "lm")}, {"x": (np.arange(2.0), "mm")}, {"notes": ("dark",)})
    >>> table["flux"].attrs["units"], table["x"].attrs["units"], table.attrs["notes"]
    ('lm', 'mm', '["dark"]')
    """
    library = require("xarray")
    axes = tuple(coordinates)
    made: xarray.Dataset = library.Dataset(
        {name: (axes, numbers, _unit(unit)) for name, (numbers, unit) in variables.items()},
        coords={name: (name, numbers, _unit(unit)) for name, (numbers, unit) in coordinates.items()},
        attrs={
            name: fact if isinstance(fact, str | float | int) else json.dumps(fact, ensure_ascii=False)
            for name, fact in facts.items()
        },
    )
    return made


def _unit(unit: str) -> dict[str, str]:
    return {"units": unit} if unit else {}
