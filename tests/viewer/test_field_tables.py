"""What the page holds of a light field: every luminance within the bound that is stated, read back by other means."""

from __future__ import annotations

import base64
import math
import zlib
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.viewer.field_tables import STEPS, FieldTables, LogTable
from oracles.light_fields import SURFACES, make_field

Array = npt.NDArray[np.float64]


def unpacked(packed: dict[str, Any]) -> Array:
    """A table as the page states it, read number by number."""
    planes = zlib.decompress(base64.b64decode(packed["data"]))
    count = math.prod(packed["shape"])
    assert len(planes) == 2 * count
    values, code = [], 0
    for low, high in zip(planes[:count], planes[count:], strict=True):
        folded = low + 256 * high
        code = (code + ((folded >> 1) if folded % 2 == 0 else -(folded >> 1) - 1)) % 65536
        values.append(0.0 if code == 0 else packed["lowest"] * math.exp((code - 1) * packed["step"]))
    return np.array(values).reshape(packed["shape"])


def lines_through(field: et.LightField, n: int, seed: int) -> tuple[Array, Array]:
    """Half of them lines that light goes along, half from everywhere."""
    rng = np.random.default_rng(seed)
    light = field.sample(n // 2, seed=seed)
    k = rng.normal(size=(n // 2, 3))
    anywhere = rng.uniform(-2, 2, (n // 2, 3))
    return np.concatenate([light.position, anywhere]), np.concatenate([light.direction, k])


def test_a_table_comes_back_within_half_a_step() -> None:
    """|ln of the ratio of what went in to what came out| ≤ step/2, and 0 stays 0; large steps of both signs survive."""
    rng = np.random.default_rng(3)
    values = np.exp(rng.uniform(-20, 20, (13, 7, 5)))
    values[rng.random(values.shape) < 0.2] = 0.0
    for step in (0.002, 0.06):
        table = LogTable.of(values, step)
        found = unpacked(table.packed())
        assert ((found == 0.0) == (values == 0.0)).all()
        above = values > 0.0
        assert np.abs(np.log(found[above] / values[above])).max() <= step / 2 * (1 + 1e-9)
        np.testing.assert_allclose(found, table.values(), rtol=1e-12)


def test_numbers_that_span_too_much_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"do not fit into steps of 0\.002"):
        LogTable.of(np.array([1e-60, 1e60]), 0.002)
    assert LogTable.of(np.zeros(3), 0.002).values().tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("steps", [STEPS[0], STEPS[-1]])
def test_every_luminance_is_within_the_bound(name: str, steps: tuple[float, float]) -> None:
    """Against the core's own reading of the field, along lines from everywhere: none is off by more than is stated."""
    field = make_field(SURFACES[name], seed=5)
    tables = FieldTables.of(field, *steps)
    points, directions = lines_through(field, 4000, seed=7)
    truth = field.luminance(points, directions)[0]
    found = tables.luminance(points, directions)
    assert ((truth > 0) == (found > 0)).all()
    lit = truth > 0
    assert lit.sum() > 100
    off = np.abs(found[lit] / truth[lit] - 1)
    # Rounding of the ratio to 32 bits comes on top.
    assert off.max() <= tables.bound + 1e-6
    assert off.max() > tables.bound / 50  # the bound is one that is about what happens


def test_tables_grow_coarser_until_they_fit() -> None:
    """The first steps whose letters fit; if none do, the last."""
    field = make_field(SURFACES["plane"], cells=(16, 16, 8, 8), factors=(64, 32))
    sizes = []
    for steps in STEPS:
        packed = FieldTables.of(field, *steps).packed()
        tables = [t for part in packed["parts"] for t in part.values() if isinstance(t, dict) and "data" in t]
        sizes.append(sum(len(table["data"]) for table in tables))
    assert sizes == sorted(sizes, reverse=True)
    for most, expected in ((10**9, 0), (sizes[2], 2), (1, len(STEPS) - 1)):
        tables, packed = FieldTables.within(field, most)
        assert (tables.step, tables.error_step) == STEPS[expected]
        assert packed["bound"] == tables.bound
