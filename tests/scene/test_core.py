"""Records are what the tracer takes: every kind of body, surface, source, detector and finish, and no ray is lost."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import etendue as et
import pytest
from etendue.description.files import Files
from etendue.plot.scene_parts import FINISH_KINDS, finish_kind
from etendue.scene import Scene, compile_scene
from etendue.scene.detectors import DETECTORS
from etendue.scene.finishes import FINISHES
from etendue.scene.sources import SOURCES
from oracles.scenes import BODIES, SHAPES, shown

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


FINISH_KEYS: dict[str, dict[str, Any]] = {
    "bsdf": {"bsdf": et.bsdf.Gaussian(peak=3.0, sigma=0.2)},
    "diffuse-specular": {
        "total_reflectance": {"wavelength": [400, 700], "values": [0.8, 0.9]},
        "specular_reflectance": {"angle": [0, 80], "values": [0.1, 0.5]},
    },
}
"""Of finishes that show more than the example of their docstring."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", FINISHES)
def test_the_core_takes_every_finish(kind: str) -> None:
    """And no light is lost or made at a disk that has it."""
    finish = {"kind": kind, **(FINISH_KEYS.get(kind) or shown(FINISHES[kind]))}
    disk = {"name": "disk", "shape": {"kind": "disk", "radius": 5}, "finish": finish}
    ledger = et.trace(Scene(sources=[LAMP], surfaces=[disk]), rays=20_000, seed=7).ledger
    assert ledger.lost == ()
    assert ledger.closes
    assert finish_kind(FINISHES[kind](**finish).record(Files())) in FINISH_KINDS


SOURCE_KEYS: dict[str, dict[str, Any]] = {
    "beam": {"shape": {"kind": "polygon", "vertices": [[0, 0], [1, 0], [0, 1]]}, "flux": 1},
    "gridded": {"draws": 1000},
    "light-field": {},
    "rays": {},
}
"""Of sources whose docstring shows a file, or less than this."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", SOURCES)
def test_the_core_takes_every_source_with_its_flux(kind: str) -> None:
    """What is emitted is what the record says."""
    rings = et.RingSource(rays=20_000)
    memory: dict[str, Any] = {}
    if kind == "gridded":
        memory["gridded"] = et.GriddedSource.fit(rings, et.Disk(radius=30), 10.0, 5.0)
    elif kind == "light-field":
        memory["field"] = et.LightField.fit(rings, et.Disk(radius=30), depths=(2, 2, 2, 2))
    elif kind == "rays":
        memory["rays"] = rings
    keys = SOURCE_KEYS[kind] if kind in SOURCE_KEYS else shown(SOURCES[kind])
    scene = Scene(sources=[{"kind": kind, **keys, **memory, "spectrum": [[450, 1], [600, 2]]}])
    flux = sum(record["flux"] for record in compile_scene(scene).record["sources"])
    # The rays of a set, each once; others are drawn, with equal flux.
    ledger = et.trace(scene, rays=None if kind == "rays" else 30_000, seed=5).ledger
    assert sum(entry.flux for entry in ledger.emitted.values()) == pytest.approx(flux, rel=1e-9)


DETECTOR_KEYS: dict[str, dict[str, Any]] = {"image": {"observer": "me"}, "scatter": {}}
"""Of detectors whose docstring shows one for another scene."""


@pytest.mark.parametrize("kind", DETECTORS)
def test_every_detector_measures_and_is_kept(kind: str, tmp_path: Path) -> None:
    """What it measured is said in a line, and a file of the result gives the same."""
    keys = DETECTOR_KEYS[kind] if kind in DETECTOR_KEYS else shown(DETECTORS[kind])
    screen = {"width": 9, "height": 9, "columns": 4, "rows": 4}
    paper = {"shape": {"kind": "disk", "radius": 5}, "finish": {"kind": "lambertian", "reflectance": 0.5}}
    scene = Scene(
        sources=[LAMP],
        surfaces=[paper],
        detectors=[{"kind": kind, "name": "it", **keys}],
        observers=[{"name": "me", "distance": 100, "screen": screen}],
    )
    result = et.trace(scene, rays=20_000, seed=6)
    result.save(tmp_path / "result.h5")
    again = et.TraceResult.load(tmp_path / "result.h5")
    (detection,), (kept,) = result.plan.detections, again.plan.detections
    assert detection == kept
    assert kind == detection.KIND
    # The core has a face for each that is named, those of detectors too.
    assert len(result.plan.face_names) == len(result.sums.ledger["on_face"][0])
    line = detection.summary(result.quantity_of("it"))
    assert line == kept.summary(again.quantity_of("it"))
    assert re.search(r"[1-9]", line)
    assert "\n" not in line
    assert detection.figures(result.quantity_of("it")) == kept.figures(again.quantity_of("it"))
    assert result.relative_error > 0.0 or not detection.judged
