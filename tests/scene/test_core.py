"""Records are what the tracer takes: every kind of body, surface, source, detector and finish, and no ray is lost."""

from __future__ import annotations

from typing import Any

import etendue as et
import pytest
from etendue import _core
from etendue.scene import Scene, compile_scene
from etendue.scene.finishes import FINISHES
from oracles.scenes import BODIES, SHAPES

LAMP = {"kind": "surface", "shape": {"kind": "sphere", "radius": 20}, "side": "back", "flux": 100}
"""Light from everywhere, onto whatever stands in the middle."""


@pytest.mark.parametrize("kind", BODIES)
def test_no_ray_is_lost_in_a_body(kind: str) -> None:
    """A body of clear glass absorbs nothing: all light comes out again, whatever the shape and its edges do to it."""
    solid = {"name": "body", "shape": {"kind": kind, **BODIES[kind][0]}, "medium": "BK7", "rotation": [10, 20, 30]}
    ledger = et.trace(Scene(sources=[LAMP], solids=[solid]), rays=50_000, seed=3).ledger
    assert ledger.lost == ()
    assert ledger.escaped.flux == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("kind", SHAPES)
def test_the_core_takes_every_surface(kind: str) -> None:
    """As a surface, as a detector and, if it has an end, as a source; a half mirror absorbs half of what meets it."""
    shape = {"kind": kind, **SHAPES[kind]}
    endless = kind == "plane"
    scene = Scene(
        sources=[LAMP] if endless else [LAMP, {"kind": "surface", "shape": shape, "flux": 1, "exponent": 2}],
        surfaces=[{"shape": shape, "finish": {"kind": "mirror", "reflectance": 0.5}, "at": [0, 0, 1]}],
        detectors=[{"kind": "rays", "shape": shape, "at": [0, 0, 2]}],
    )
    ledger = et.trace(scene, rays=20_000, seed=4).ledger
    assert ledger.lost == ()
    assert ledger.by_surface["surfaces[0]"].flux > 0.0


SPECIMENS: dict[str, dict[str, Any]] = {
    "lambertian": {"reflectance": 0.5},
    "diffuse-specular": {
        "total_reflectance": {"wavelength": [400, 700], "values": [0.8, 0.9]},
        "specular_reflectance": {"angle": [0, 80], "values": [0.1, 0.5]},
    },
}


@pytest.mark.parametrize("kind", FINISHES)
def test_the_core_takes_every_finish(kind: str) -> None:
    finish = {"kind": kind, **SPECIMENS.get(kind, {})}
    disk = {"shape": {"kind": "disk", "radius": 5}, "finish": finish}
    _core.Scene(compile_scene(Scene(sources=[LAMP], surfaces=[disk])).record)


@pytest.mark.parametrize(
    "source",
    [
        {"kind": "rings", "radii": [1, 2], "flux": [3, 4]},
        {"kind": "point", "flux": 5},
        {"kind": "beam", "shape": {"kind": "polygon", "vertices": [[0, 0], [1, 0], [0, 1]]}, "flux": 1},
        {"kind": "gridded", "draws": 1000},
        {"kind": "light-field"},
        {"kind": "rays"},
    ],
    ids=lambda source: source["kind"],
)
def test_the_core_takes_every_source_with_its_flux(source: dict[str, Any]) -> None:
    """What is emitted is what the record says."""
    rings = et.RingSource(rays=20_000)
    memory: dict[str, Any] = {}
    if source["kind"] == "gridded":
        memory["gridded"] = et.GriddedSource.fit(rings, et.Disk(radius=30), 10.0, 5.0)
    elif source["kind"] == "light-field":
        memory["field"] = et.LightField.fit(rings, et.Disk(radius=30), depths=(2, 2, 2, 2))
    elif source["kind"] == "rays":
        memory["rays"] = rings
    scene = Scene(sources=[{**source, **memory, "spectrum": [[450, 1], [600, 2]]}])
    flux = sum(record["flux"] for record in compile_scene(scene).record["sources"])
    # The rays of a set, each once; others are drawn, with equal flux.
    ledger = et.trace(scene, rays=None if source["kind"] == "rays" else 30_000, seed=5).ledger
    assert sum(entry.flux for entry in ledger.emitted.values()) == pytest.approx(flux, rel=1e-9)


def test_the_core_takes_every_detector() -> None:
    screen = {"width": 1, "height": 1, "columns": 4, "rows": 4}
    scene = Scene(
        sources=[LAMP],
        detectors=[
            {"kind": "illuminance", "width": 1, "height": 1, "columns": 2, "rows": 3},
            {"kind": "intensity"},
            {"kind": "image", "observer": "me"},
            {"kind": "scatter"},
        ],
        observers=[{"name": "me", "distance": 100, "screen": screen}],
    )
    _core.Scene(compile_scene(scene).record)
