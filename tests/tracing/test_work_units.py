"""Work units: in any order and any process, and the bits of a trace that was never cut."""

from __future__ import annotations

import multiprocessing
import pickle
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue import _core
from etendue.errors import ArgumentError
from etendue.tracing import running, work
from oracles.results import bits

BATCHES = 4
"""Batches of a unit here: with fewer than usual a trace of several units is short."""

SHORT = f"from etendue.tracing import running, work\nrunning.BATCHES = work.BATCHES = {BATCHES}"
"""What makes the units of another process as short."""

ONE_UNIT = BATCHES * _core.batch_size()


@pytest.fixture(scope="module", autouse=True)
def _short_units() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for module in (work, running):
            patch.setattr(module, "BATCHES", BATCHES)
        yield


def few_rays(path: Path, n: int, seed: int) -> Path:
    """A ray file of a few rays without symmetry."""
    rng = np.random.default_rng(seed)
    position = rng.normal(size=(n, 3)) * [0.5, 0.2, 0.1]
    direction = np.array([0.1, -0.3, 1.0]) + rng.normal(size=(n, 3)) * [0.3, 0.2, 0.0]
    et.write_rays(path, et.RaySet(position, direction, rng.random(n) + 0.1))
    return path


def room(lamp: Path) -> et.Scene:
    """Few rays of a file, given out again and again, beside a lamp of its own; every kind of detector."""
    return et.Scene(
        sources=[
            {"name": "led", "kind": "rays", "file": str(lamp), "flux": 40},
            {"name": "pilot", "kind": "point", "flux": 10, "at": [3, 4, 1]},
        ],
        surfaces=[{"name": "wall", "shape": {"kind": "rectangle", "width": 50, "height": 40}, "at": [3, 0, 22],
                   "toward": [0.1, 0, -1], "finish": {"kind": "lambertian", "reflectance": 0.7}}],
        detectors=[
            {"name": "far", "kind": "intensity"},
            {"name": "desk", "kind": "illuminance", "width": 40, "height": 30, "columns": 3, "rows": 2, "at": [0, 0, 19],
             "toward": [0, 0, -1]},
            {"name": "eye", "kind": "image", "observer": "side"},
            {"name": "scatter", "kind": "scatter", "most": 25_000},
            {"name": "rcs", "kind": "rays", "shape": {"kind": "rectangle", "width": 6, "height": 6}, "at": [0, 0, 10]},
        ],
        observers=[{"name": "side", "theta": 150, "phi": 190, "distance": 200, "target": [3, 0, 22],
                    "screen": {"width": 50, "height": 40, "columns": 6, "rows": 4}}],
    )  # fmt: skip


@pytest.mark.slow
def test_other_processes_and_another_order_give_the_same_bits(tmp_path: Path) -> None:
    """Units with copies of rays that go on from one to the next, thinned events, collected rays and chosen nodes."""
    scene, n = room(few_rays(tmp_path / "led.tm25ray", 7, 1)), 2.25 * ONE_UNIT
    whole = et.trace(scene, n, 5)
    units = et.trace_work(scene, n, 5)
    assert len(units) == 3
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), exec, (SHORT,)) as pool:
        last, middle, first = pool.map(units, [2, 1, 0])
    part = units.join([first])
    assert all(len(held[0]) for held in part.sums.open_units[:3])
    assert part.sums.scattered[3].level > 0
    assert bits(part) == bits(next(et.trace_rounds(scene, n, 5)))
    assert bits(units.join([first, middle, last])) == bits(whole)
    # One after the other, the earlier ones from a file.
    part.save(tmp_path / "part.h5")
    assert bits(units.join([middle, last], et.TraceResult.load(tmp_path / "part.h5"))) == bits(whole)


@pytest.mark.slow
def test_units_are_joined_in_their_order_and_none_is_left_out(tmp_path: Path) -> None:
    units = et.trace_work(room(few_rays(tmp_path / "led.tm25ray", 7, 1)), 2.25 * ONE_UNIT, 5)
    first, last = units(0), units(2)
    with pytest.raises(ArgumentError, match="batches 8 to 9 cannot follow the first 4"):
        units.join([first, last])
    with pytest.raises(ArgumentError, match="cannot follow the first 0"):
        units.join([last])
    with pytest.raises(ArgumentError, match="no work units to join"):
        units.join([])
    for nonsense in (-1, 3):
        with pytest.raises(ArgumentError, match="they are 0 to 2"):
            units(nonsense)


def test_a_file_that_is_another_one_where_the_work_is_done_is_refused(tmp_path: Path) -> None:
    lamp = few_rays(tmp_path / "led.tm25ray", 7, 1)
    packed = pickle.dumps(et.trace_work(room(lamp), ONE_UNIT, 5))
    few_rays(lamp, 7, 2)
    with pytest.raises(ArgumentError, match="not the one that the trace was planned with"):
        pickle.loads(packed)(0)  # noqa: S301 - packed above
