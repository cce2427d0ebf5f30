"""Gridded sources in scenes: lines of sight read the tables of the patches that they meet; verdicts at 1e-4."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import SceneError
from etendue.luminance.gridded_map import gridded_luminance_map
from etendue.scene import compile_scene
from etendue.scene.sources.gridded import SeenGridded
from oracles.both_ways import forwards_and_backwards_agree
from oracles.verdicts import assert_agree, assert_differ
from scipy.stats import chi2

PLACE: dict[str, Any] = {"at": [1.5, -2.0, 3.0], "rotation": [20, -35, 50]}


def lopsided(count: int, seed: int) -> et.RaySet:
    """Rays from a small box, more to one side, with places and directions that go together."""
    rng = np.random.default_rng(seed)
    position = rng.random((count, 3)) * [1.6, 1.0, 0.2] - [0.5, 0.6, 0.0]
    direction = rng.normal(size=(count, 3)) * [0.7, 0.5, 0.0] + [0.3, -0.2, 1.0]
    direction[:, 0] += 0.4 * position[:, 1]
    return et.RaySet(position, direction, np.full(count, 100.0 / count))


SURFACES = {
    "plane": et.Plane(z=0.2),
    "dome": et.Dome(radius=2.0, centre=(0.1, 0.2)),
    "cylinder": et.Cylinder(radius=2.0, bottom=-1.0, top=2.0),
}


@pytest.fixture(scope="module")
def grids() -> dict[str, et.GriddedSource]:
    rays = lopsided(60_000, 1)
    return {name: et.GriddedSource.fit(rays, surface, 0.5, 5.0) for name, surface in SURFACES.items()}


@pytest.mark.slow
@pytest.mark.parametrize("surface", SURFACES)
def test_a_line_of_sight_reads_what_the_gridded_source_says(grids: dict[str, et.GriddedSource], surface: str) -> None:
    """Line by line, through pixels of a nanometre, in a place that is turned and shifted: equal to 1e-9."""
    grid = grids[surface]
    scene = et.Scene(sources=[{"kind": "gridded", "gridded": grid, "draws": 10, **PLACE}])
    frame = compile_scene(scene).record["sources"][0]["frame"]
    origin, axes = np.array(frame[:3]), np.array(frame[3:]).reshape(3, 3)
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(12):
        # A point in the source, and an observer on the side that most light goes to.
        target = origin + (rng.random(3) * [1.6, 1.2, 0.5] - [0.4, 0.6, 0.0]) @ axes
        towards = (rng.normal(size=3) * [0.5, 0.5, 0.2] + [0.2, -0.1, 1.0]) @ axes
        towards /= np.linalg.norm(towards)
        theta, phi = np.degrees(np.arccos(towards[2])), np.degrees(np.arctan2(towards[1], towards[0]))
        observer = et.Observer(float(theta), float(phi), 50.0, target=tuple(map(float, target)))
        lmap = et.luminance_map(scene, observer, et.Screen(1e-12, 1e-12, 1, 1), rays_per_pixel=1, seed=1)
        sight = observer.position - target
        (expected,) = grid.luminance([axes @ (target - origin)], [axes @ sight])
        assert lmap.values[0, 0] == pytest.approx(expected, rel=1e-9)
        seen += expected > 0.0
    assert seen > 5


def test_the_map_is_that_of_the_patches(grids: dict[str, et.GriddedSource]) -> None:
    """Pixel by pixel against the regular points of `gridded_luminance_map`, the right way round."""
    grid = grids["plane"]
    scene = et.Scene(sources=[{"kind": "gridded", "gridded": grid, "draws": 10, "flux": 50}])
    observer, screen = et.Observer(35, 60, 200, target=(0.3, 0.0, 0.2)), et.Screen(3, 2, 6, 4)
    found = et.luminance_map(scene, observer, screen, rays_per_pixel=512, seed=2)
    expected = gridded_luminance_map(grid.emitting(50), observer, screen, samples=3600).values
    lit = expected > 0.05 * expected.max()
    assert_agree(values=found.values[lit], expected=expected[lit], standard_error=found.standard_error[lit])
    assert_differ(values=found.values[lit], other=expected[::-1, ::-1][lit], standard_error=found.standard_error[lit])
    assert any("multiplied by" in note for note in found.notes)
    assert any("in no standard error" in note for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["plane", "dome", "cylinder"])
def test_rays_of_light_images_are_those_of_sample(grids: dict[str, et.GriddedSource], surface: str) -> None:
    """χ² of two samples over place and direction: the core's draws against `GriddedSource.sample`."""
    grid, n = grids[surface], 100_000
    collector = {"kind": "rays", "name": "all", "shape": {"kind": "sphere", "radius": 50}}
    scene = et.Scene(sources=[SeenGridded(gridded=grid)], detectors=[collector])
    ours, theirs = et.trace(scene, rays=n, seed=4).rays["all"], grid.sample(n, 9)
    assert ours.total_flux == pytest.approx(grid.emitted_flux, rel=1e-9)

    def cells(rays: et.RaySet) -> Any:
        pixel = grid.surface.owner(rays.position, rays.direction)
        part = np.digitize(rays.direction[:, 0], [-0.3, 0.0, 0.3, 0.6]) * 4 + np.digitize(
            rays.direction[:, 1], [-0.4, -0.1, 0.2]
        )
        # Those of squares that the edge of the surface cuts may have none.
        return np.bincount((pixel + 1) * 20 + part, minlength=(grid.surface.count + 1) * 20).astype(float)

    one, other = cells(ours), cells(theirs)
    filled = one + other > 40
    one, other = one[filled], other[filled]
    statistic = ((one - other) ** 2 / (one + other)).sum()
    assert filled.sum() > 100
    assert statistic < chi2.ppf(1 - 1e-4, filled.sum()), (statistic, filled.sum())


PAPER = {
    "shape": {"kind": "rectangle", "width": 30, "height": 30},
    "finish": {"kind": "lambertian", "reflectance": 0.7},
}


@pytest.fixture(scope="module")
def lamp() -> dict[str, Any]:
    return {"kind": "gridded", "gridded": et.GriddedSource.fit(lopsided(60_000, 1), et.Plane(z=0.2), 0.5, 5.0)}


@pytest.mark.slow
def test_patches_light_a_paper_the_same_both_ways(lamp: dict[str, Any]) -> None:
    """Connections to patches picked by flux against rays drawn from the tables."""
    forwards_and_backwards_agree(surfaces=[PAPER], lamp={**lamp, "draws": 200_000})


@pytest.mark.slow
def test_patches_behind_a_lens_are_the_same_both_ways(lamp: dict[str, Any]) -> None:
    """A lens below paper: lines of sight meet the patches through paper and lens."""
    front, back = {"radius_of_curvature": 9}, {"radius_of_curvature": -9}
    lens = {
        "shape": {"kind": "lens", "radius": 4, "thickness": 3, "front": front, "back": back},
        "at": [3.1, 1.7, -6],
        "toward": [-0.3, -0.1, 1],
        "medium": "BK7",
    }
    screen = {**PAPER, "finish": {"kind": "lambertian", "reflectance": 0.1, "transmittance": 0.6}}
    forwards_and_backwards_agree(
        surfaces=[screen], solids=[lens], lamp={**lamp, "draws": 200_000}, below=True, sharp=0.4, lines=8000
    )


@pytest.mark.slow
def test_the_light_field_route_shows_the_same_source(lamp: dict[str, Any]) -> None:
    """A field that is fitted to rays drawn from the patches, another estimator: the same picture, within its own blur."""
    grid = lamp["gridded"]
    observer, screen = et.Observer(20, 60, 200, target=(0.3, 0.0, 0.2)), et.Screen(2, 2, 8, 8)
    field = et.LightField.fit(grid.sample(100_000, 3), et.Plane(z=0.2, focus=(0, 0, 0, 0)), depths=(3, 3, 3, 3))
    sources: list[dict[str, Any]] = [{**lamp, "draws": 10}, {"kind": "light-field", "field": field}]
    one, other = (
        et.luminance_map(et.Scene(sources=[source]), observer, screen, rays_per_pixel=64, seed=1) for source in sources
    )
    right_way = et.compare(one, other).ncc
    assert right_way > 0.995
    for turned in (one.values[::-1, ::-1], one.values[::-1], one.values[:, ::-1]):
        assert et.compare(one.replace(values=turned), other).ncc < 0.99


def test_a_folder_of_patches_is_a_source_again(grids: dict[str, et.GriddedSource], tmp_path: Path) -> None:
    """Written and put into a scene: the map of the source, with the digits of the intensity files."""
    grid = grids["dome"]
    grid.save_patches(tmp_path / "patches")
    observer, screen = et.Observer(20, 60, 200), et.Screen(2, 2, 4, 4)
    by_folder = et.Scene.from_dict({"sources": [{"kind": "gridded", "file": "patches"}]}, folder=tmp_path)
    in_memory = et.Scene(sources=[{"kind": "gridded", "gridded": grid}])
    one, other = (et.luminance_map(s, observer, screen, rays_per_pixel=16, seed=3) for s in (by_folder, in_memory))
    np.testing.assert_allclose(one.values, other.values, rtol=1e-4)
    assert one.values.max() > 0.0
    cut = et.Scene.from_dict({"sources": [{"kind": "gridded", "file": "patches", "pixel": 1}]}, folder=tmp_path)
    with pytest.raises(SceneError, match="whose pixels are cut already; leave out 'pixel'"):
        compile_scene(cut)
