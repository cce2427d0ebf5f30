"""Datasets of xarray hold all that the values hold, at the right coordinates."""

from __future__ import annotations

import json
import sys
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.quantities.provenance import Provenance
from oracles.map_files import make_map


def illuminance() -> et.IlluminanceMap:
    """A desk that no symmetry keeps from being turned."""
    values = np.arange(6.0).reshape(2, 3)
    screen = et.Screen(30, 10, 3, 2, "xy")
    return et.IlluminanceMap(values, 0.1 * values, np.arange(6).reshape(2, 3), screen, (1, 2, 3), (0, 1, 0), (0, 0, 1))


def plain(facts: dict[str, Any], like: dict[str, Any]) -> dict[str, Any]:
    """Attributes with JSON read back where the facts were no texts and no numbers."""
    return {name: fact if isinstance(like[name], str | float) else json.loads(fact) for name, fact in facts.items()}


@pytest.mark.parametrize("lmap", [make_map(), make_map().replace(flux_unit="W"), illuminance()], ids=repr)
def test_maps_come_back(lmap: Any) -> None:
    """values, errors, rays and header of a dataset make the same map again; each value stands at its coordinates."""
    table = lmap.to_xarray()
    header = plain(table.attrs, lmap.header())
    again = type(lmap).from_header(
        header, table[lmap.quantity].values, table.standard_error.values, table["rays"].values
    )
    for name in ("values", "standard_error", "rays"):
        np.testing.assert_array_equal(getattr(again, name), getattr(lmap, name))
    assert again.header() == lmap.header()
    assert table[lmap.quantity].dims == ("y", "x")
    assert {name: table[name].attrs.get("units") for name in ("x", "y", lmap.quantity, "standard_error")} == {
        "x": "mm", "y": "mm", lmap.quantity: lmap.unit, "standard_error": lmap.unit
    }  # fmt: skip
    top_right = table[lmap.quantity].sel(x=lmap.screen.width, y=lmap.screen.height, method="nearest")
    np.testing.assert_array_equal(top_right, lmap.values[0, -1])


def test_intensities_come_back() -> None:
    rng = np.random.default_rng(3)
    far = et.Intensity(
        c=[0, 30, 200],
        gamma=[0, 40, 90, 170],
        values=rng.random((3, 4)),
        standard_error=rng.random((3, 4)),
        luminaire={"lamp": "a µ-LED", "keywords": (("A", "b"),)},
        provenance=Provenance("far.ies").then("read"),
        notes=("one", "two"),
    )
    table = far.to_xarray()
    again = et.Intensity(table.c, table.gamma, table.intensity, table.standard_error, table.attrs["flux_unit"])
    for name in ("c", "gamma", "values", "standard_error"):
        np.testing.assert_array_equal(getattr(again, name), getattr(far, name))
    assert Provenance.from_dict(json.loads(table.attrs["provenance"])) == far.provenance
    assert json.loads(table.attrs["notes"]) == ["one", "two"]
    assert json.loads(table.attrs["luminaire"]) == {"lamp": "a µ-LED", "keywords": [["A", "b"]]}
    assert table.attrs["flux"] == far.flux
    assert float(table.intensity.sel(c=30, gamma=90)) == far.at(30, 90)
    assert table.intensity.attrs["units"] == "cd"


def test_without_xarray_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(et.MissingLibraryError, match=r"pip install 'etendue\[xarray\]'"):
        make_map().to_xarray()
