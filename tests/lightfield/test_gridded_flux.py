"""What a source made of patches sends out has the flux of its rays: one factor over all of its tables, which it tells."""

from __future__ import annotations

import json
import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.luminance.gridded_map import gridded_luminance_map

Array = npt.NDArray[np.float64]
FLUX = 500.0


def lamp() -> et.RaySet:
    """A rectangle with a slanted beam, without any symmetry, brighter towards one corner."""
    rng = np.random.default_rng(3)
    position = np.column_stack([rng.random((4000, 2)) ** 0.7 * [3, 2], np.zeros(4000)])
    direction = np.column_stack([rng.normal(size=(4000, 2)) * [0.8, 0.5] + [0.1, 0.3], np.ones(4000)])
    return et.RaySet(position, direction, np.full(4000, FLUX / 4000))


@pytest.fixture(scope="module")
def grid() -> et.GriddedSource:
    return et.GriddedSource.fit(lamp(), et.Plane(z=0, width=4, height=4, centre=(2, 2)), 1.0, 2.0)


@pytest.fixture(scope="module")
def folder(grid: et.GriddedSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("patches") / "p"
    grid.save_patches(folder, scenes=["radiance", "mitsuba"])
    return folder


def between(nodes: Array, points: int) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights of every interval between nodes [°], in radians."""
    x, w = np.polynomial.legendre.leggauss(points)
    low, high = np.radians(nodes[:-1])[:, None], np.radians(nodes[1:])[:, None]
    return ((low + high) / 2 + (high - low) / 2 * x).ravel(), ((high - low) / 2 * w).ravel()


def quadrature(gamma: Array, c: Array) -> tuple[Array, Array]:
    """Directions and solid angles [sr] that integrate what is bilinear between the nodes of a table."""
    (theta, across), (phi, around) = between(gamma, 6), between(np.append(c, 360.0), 2)
    sine = np.sin(theta)[:, None]
    parts = [sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)[:, None] * np.ones(len(phi))]
    return np.stack(parts, axis=-1).reshape(-1, 3), (across[:, None] * sine * around).ravel()


def of_files(folder: Path) -> list[et.Intensity]:
    """The intensity files of the patches, as any reader has them."""
    return [et.read_intensity(path) for path in sorted((folder / "lids").iterdir())]


def flux_of_files(folder: Path) -> float:
    """What they integrate to."""
    total = 0.0
    for table in of_files(folder):
        direction, weight = quadrature(table.gamma, table.c)
        total += float((table.in_direction(direction) * weight).sum())
    return total


def test_the_factor_makes_the_flux_of_the_files_that_of_the_rays(grid: et.GriddedSource, folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text("utf-8"))
    found = flux_of_files(folder)
    assert abs(found / FLUX - 1) > 0.02
    assert (manifest["flux"], manifest["table_flux"]) == pytest.approx((FLUX, found), rel=1e-5)
    assert manifest["factor"] * found == pytest.approx(FLUX, rel=1e-5)
    assert grid.emitted_flux == pytest.approx(FLUX, rel=1e-12)
    assert any(f"multiplied by {grid.factor:.4g}, to 500 lm" in note for note in manifest["notes"])


def test_luminance_over_area_and_angle_is_the_flux_of_the_rays(grid: et.GriddedSource, folder: Path) -> None:
    """∫ L cos θ dA dω by quadrature, for the source and for its tables alone."""
    sums = np.zeros(2)
    for i, centre in enumerate(grid.patches.centre):
        direction, weight = quadrature(grid.patches.grid(i).theta, grid.patches.grid(i).phi)
        points = np.tile(centre, (len(direction), 1))
        for k, source in enumerate((grid, grid.as_printed)):
            seen = source.luminance(points=points, directions=direction)
            sums[k] += float((seen * direction[:, 2] * weight).sum()) * grid.patches.area[i] / 1e6
    assert sums[0] == pytest.approx(FLUX, rel=1e-9)
    assert sums[1] == pytest.approx(flux_of_files(folder), rel=1e-5)


def test_samples_have_the_flux_of_the_rays_and_say_so(grid: et.GriddedSource) -> None:
    drawn = grid.sample(10_000, seed=2)
    assert drawn.total_flux == pytest.approx(FLUX, rel=1e-9)
    assert any(f"multiplied by {grid.factor:.4g}, to 500 lm" in note for note in drawn.notes)
    assert any("multiplied by" in str(complaint) for complaint in drawn.complaints)
    printed = grid.as_printed.sample(10_000, seed=2)
    assert printed.total_flux == pytest.approx(grid.table_flux, rel=1e-9)
    assert np.array_equal(printed.direction, drawn.direction)
    assert not any("multiplied by" in note for note in printed.notes)
    assert any("as the tables have it" in note for note in printed.notes)


def test_maps_show_the_flux_of_the_rays_and_say_so(grid: et.GriddedSource, folder: Path) -> None:
    """Luminance over the apparent area is the intensity: that of the files, times the factor."""
    observer, screen = et.Observer(30, 20, 1e8, target=(2, 2, 0)), et.Screen(4, 4, 4, 4, plane="xy")
    towards = observer.position / np.linalg.norm(observer.position)
    files = sum(float(table.in_direction(towards[None])[0]) for table in of_files(folder))
    lmap = gridded_luminance_map(grid, observer, screen)
    printed = gridded_luminance_map(grid.as_printed, observer, screen)
    assert lmap.values.sum() * towards[2] / 1e6 == pytest.approx(files * FLUX / flux_of_files(folder), rel=1e-4)
    assert printed.values.sum() * towards[2] / 1e6 == pytest.approx(files, rel=1e-4)
    assert any(f"multiplied by {grid.factor:.4g}, to 500 lm" in note for note in lmap.notes)
    assert any("as the tables have it" in note for note in printed.notes)


def test_the_far_field_has_the_flux_of_the_rays_and_says_so(grid: et.GriddedSource) -> None:
    led = grid.intensity(36, 2.5)
    assert led.flux == pytest.approx(FLUX, rel=1e-3)
    assert any(f"multiplied by {grid.factor:.4g}" in note for note in led.notes)
    assert np.allclose(grid.as_printed.intensity(36, 2.5).values * grid.factor, led.values, rtol=1e-12)


def test_scenes_hold_the_tables_and_state_the_factor(grid: et.GriddedSource, folder: Path, tmp_path: Path) -> None:
    """Ray tracers are run in test_scenes.py; here, that tables and files stay as they are printed."""
    grid.as_printed.save_patches(tmp_path / "p", scenes=["radiance", "mitsuba"])
    for path in (folder / "lids", folder / "radiance" / "tables", folder / "mitsuba" / "tables"):
        for one in path.iterdir():
            assert one.read_bytes() == (tmp_path / "p" / one.relative_to(folder)).read_bytes()
    for name in ("radiance/scene.rad", "mitsuba/scene.xml"):
        assert f"times {grid.factor:.9g}" in (folder / name).read_text("utf-8")
        assert "times 1" in (tmp_path / "p" / name).read_text("utf-8")
    assert json.loads((tmp_path / "p" / "manifest.json").read_text("utf-8"))["factor"] == 1.0


def test_a_stated_flux(grid: et.GriddedSource) -> None:
    dim = grid.emitting(5.0)
    assert dim.sample(100, 1).total_flux == pytest.approx(5.0, rel=1e-9)
    assert (dim.total_flux, dim.table_flux) == (grid.total_flux, grid.table_flux)
    assert any(f"multiplied by {5 / grid.table_flux:.4g}, to 5 lm as stated" in note for note in dim.notes)
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ArgumentError, match="flux"):
            grid.emitting(wrong)


def test_the_map_of_a_scene_tells_the_factor(grid: et.GriddedSource) -> None:
    scene = et.Scene(sources=[{"name": "led", "kind": "gridded", "gridded": grid, "draws": 3000, "wavelength": 600}])
    lmap = et.luminance_map(scene, et.Observer(20, 30, 1000, target=(2, 1, 0)), et.Screen(4, 4, 2, 2), rays_per_pixel=4)
    assert any(note.startswith("led: ") and f"multiplied by {grid.factor:.4g}" in note for note in lmap.notes)
