"""Maps and detectors that no memory holds are refused before anything is set aside for them."""

from __future__ import annotations

import tracemalloc
from typing import Any

import etendue as et
import pytest
from etendue.errors import MemoryLimitError
from etendue.lightfield.carrier import Disk
from etendue.quantities import memory

OBSERVER = et.Observer(10, 20, 300)
LAMP = {"name": "lamp", "kind": "surface", "shape": {"kind": "disk", "radius": 3}, "flux": 100}
GRID = {"name": "desk", "kind": "illuminance", "width": 9, "height": 9, "at": [0, 0, 50], "toward": [0, 0, -1]}


@pytest.fixture(scope="module")
def sources() -> dict[str, Any]:
    rings = et.RingSource(rays=2000, seed=2)
    field = et.LightField.fit(rings, Disk(radius=30), depths=(2, 2, 2, 2))
    paper = {"name": "paper", "shape": {"kind": "disk", "radius": 50}, "at": [0, 0, -9], "finish": "white"}
    white = {"white": {"kind": "lambertian", "reflectance": 0.8}}
    scene = et.Scene(name="room", sources=[LAMP], finishes=white, surfaces=[paper], detectors=[])
    with_scatter = scene.replace(detectors=({"name": "scatter", "kind": "scatter"},))
    events = et.trace(et.Scene.from_dict(with_scatter.to_dict()), 2000).events["scatter"]
    return {"rays": rings, "field": field, "scene": scene, "events": events}


@pytest.mark.parametrize("kind", ["rays", "field", "scene", "events"])
def test_a_map_that_no_memory_holds_names_its_size(
    kind: str, sources: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 200 << 20)
    screen = et.Screen(60, 60, 2048, 2048)
    tracemalloc.start()
    with pytest.raises(
        MemoryLimitError, match=r".+: a map of 2048 x 2048 pixels needs \d\.\d GB of memory, and 0\.2 GB"
    ):
        et.luminance_map(sources[kind], OBSERVER, screen)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e6


def test_several_maps_are_counted_together(sources: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 300 << 20)
    screen = et.Screen(60, 60, 1024, 1024)
    with pytest.raises(MemoryLimitError, match=r"20 maps of 1024 x 1024, 1024 x 1024, .* … pixels needs 1\.1 GB"):
        et.luminance_map(sources["field"], [OBSERVER] * 20, screen)


def test_detectors_that_no_memory_holds_name_their_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 200 << 20)
    scene = et.Scene(name="desk", sources=[LAMP], detectors=[{**GRID, "columns": 2048, "rows": 2048}])
    with pytest.raises(MemoryLimitError, match=r"desk: detectors with 4,194,304 cells needs 0\.4 GB"):
        et.trace(scene, 1000)
