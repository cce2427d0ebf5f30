"""Sets that give out more rays than they hold: copies are not independent, and errors are those of distinct rays."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.luminance import scene_map
from etendue.scene import compile_scene
from etendue.tracing.result import TraceResult
from etendue.tracing.work import BATCHES
from oracles.results import bits
from oracles.verdicts import SIGNIFICANCE, assert_covers
from scipy.stats import t

Array = npt.NDArray[np.float64]

GRID = {"name": "grid", "kind": "illuminance", "width": 30, "height": 24, "columns": 5, "rows": 4, "at": [2, -1, 20],
        "toward": [0, 0, -1]}  # fmt: skip
CELL = 30 / 5 * 24 / 4 * 1e-6
"""Area of a cell of the grid [m²]."""


def lopsided(n: int, seed: int, *, equal: bool = False) -> et.RaySet:
    """A set of rays of unequal weights towards the grid, from a tilted spot beside its axis."""
    rng = np.random.default_rng(seed)
    position = np.array([1.0, 2.0, 0.0]) + rng.normal(size=(n, 3)) * [0.5, 0.2, 0.1]
    direction = np.array([0.1, -0.3, 1.0]) + rng.normal(size=(n, 3)) * [0.3, 0.2, 0.0]
    return et.RaySet(position, direction, np.ones(n) if equal else rng.random(n) + 0.1)


def axes() -> tuple[Array, Array]:
    """Unit vectors along the rows of the grid and up its columns."""
    seen = et.trace(et.Scene(sources=[{"kind": "point", "flux": 1}], detectors=[GRID]), 10).illuminance["grid"]
    return np.array(seen.right), np.array(seen.up)


def cells_of(rays: et.RaySet) -> npt.NDArray[np.int64]:
    """The cell of the grid that each ray meets, −1 for none: plain geometry."""
    x, d = rays.position, rays.direction
    foot = x + d * ((20 - x[:, 2]) / d[:, 2])[:, None]
    local = foot - [2, -1, 20]
    right, up = axes()
    u, v = local @ right / 30 + 0.5, 0.5 - local @ up / 24
    inside = (u > 0) & (u < 1) & (v > 0) & (v < 1)
    return np.where(inside, np.floor(v * 4) * 5 + np.floor(u * 5), -1).astype(np.int64)


def sum_and_error(rays: et.RaySet, flux: float) -> tuple[Array, Array]:
    """Illuminance of each cell by the n rays of a set, and the standard error of a sample of n of this total flux.

    Σ w² − 2p Σ w v + p² Σ v² with p = Σ w/Σ v of the rays' flux v, of which w is what gets to the cell: all of it, or none,
    so that Σ w v is Σ w².
    """
    v, cell, n = rays.flux * flux / rays.flux.sum(), cells_of(rays), len(rays)
    total, squares = (np.bincount(cell[cell >= 0], u[cell >= 0], 20) for u in (v, v * v))
    share, square = total / flux, (v * v).sum()
    error = np.sqrt(n / (n - 1) * (squares - 2 * share * squares + share**2 * square))
    error[total == 0] = np.nan
    return total.reshape(4, 5) / CELL, error.reshape(4, 5) / CELL


@pytest.mark.parametrize(("n", "rays"), [(2000, 200_000), (3, 1_100_000), (517, 70_001)])
def test_errors_are_those_of_the_distinct_rays(n: int, rays: int) -> None:
    """2000 rays traced as 200 000 are 2000 rays; so are 3 whose copies span many batches and two rounds. Where nothing
    is drawn by chance, sum and error are those of the set."""
    lamp = lopsided(n, 7)
    result = et.trace(et.Scene(sources=[{"name": "led", "kind": "rays", "rays": lamp}], detectors=[GRID]), rays)
    seen = result.illuminance["grid"]
    values, error = sum_and_error(lamp, lamp.total_flux)
    # A ray has ⌊rays/n⌋ copies or one more.
    tolerance = 3 * n / rays if rays % n else 1e-9
    np.testing.assert_allclose(seen.values, values, rtol=tolerance)
    np.testing.assert_allclose(seen.standard_error, error, rtol=tolerance + 1e-9)
    assert seen.rays.sum() == (cells_of(lamp) >= 0).sum()
    kish = lamp.flux.sum() ** 2 / (lamp.flux**2).sum()
    assert result.effective_rays == pytest.approx(kish, rel=tolerance + 1e-9)
    assert result.effective_rays_by_source == {"led": pytest.approx(kish, rel=tolerance + 1e-9)}
    (note,) = (note for note in result.notes if "copies" in note)
    assert note.startswith(f"led: {rays:,} rays are copies of {n:,} rays of the set, as good as {kish:,.0f} equal rays")


def test_a_set_beside_another_source_keeps_its_errors() -> None:
    """The variance of a cell is that of the set's rays and of the other source's."""
    lamp = lopsided(2000, 7)
    point = {"name": "pilot", "kind": "point", "flux": 300, "at": [0, 0, 5]}
    both = et.trace(et.Scene(sources=[{"name": "led", "kind": "rays", "rays": lamp, "flux": 700}, point],
                             detectors=[GRID]), 10**6)  # fmt: skip
    alone = et.trace(et.Scene(sources=[point], detectors=[GRID]), 300_000, seed=5)
    _, error = sum_and_error(lamp, 700)
    expected = np.hypot(error, alone.illuminance["grid"].standard_error)
    # The error of the pilot's error is some percent of a tenth of the whole.
    np.testing.assert_allclose(both.illuminance["grid"].standard_error, expected, rtol=0.01)
    assert both.effective_rays_by_source["pilot"] == pytest.approx(300_000)
    kish = lamp.flux.sum() ** 2 / (lamp.flux**2).sum()
    assert both.effective_rays == pytest.approx(1 / (0.7**2 / kish + 0.3**2 / 300_000))


def test_a_set_that_repeats_its_rays_has_the_errors_of_its_distinct_rays() -> None:
    """2000 rays that a set holds twice are 2000 rays. Where each has a colour they are told, not joined."""
    lamp = lopsided(2000, 7)
    twice = et.RaySet.merge([lamp, lamp])
    result = et.trace(et.Scene(sources=[{"name": "led", "kind": "rays", "rays": twice}], detectors=[GRID]), 4000)
    values, error = sum_and_error(lamp, twice.total_flux)
    np.testing.assert_allclose(result.illuminance["grid"].values, values, rtol=1e-9)
    np.testing.assert_allclose(result.illuminance["grid"].standard_error, error, rtol=1e-9)
    told = "led: 2,000 of 4,000 rays repeat another one, with its place and direction: each counts once"
    assert sum(note.startswith(told) for note in result.notes) == 1
    coloured = et.RaySet(twice.position, twice.direction, twice.flux, wavelength=np.repeat([450.0, 600.0], 2000))
    result = et.trace(et.Scene(sources=[{"name": "led", "kind": "rays", "rays": coloured}], detectors=[GRID]), 4000)
    assert any("are up to 1.41 times too small; give each ray once" in note for note in result.notes)


@pytest.mark.slow
def test_until_is_not_reached_by_copies() -> None:
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": lopsided(500, 3)}, {"kind": "point", "flux": 1}], detectors=[GRID]
    )
    result = et.trace(scene, 3 * BATCHES * _core.batch_size(), until=0.02)
    assert result.complete
    assert result.relative_error > 0.05


def test_sources_that_share_a_file_share_its_rays(tmp_path: Path) -> None:
    """Twice the same set at one place is that set with twice its flux, however often the file is read."""
    lamp = lopsided(800, 9)
    et.write_rays(tmp_path / "led.ray", lamp, format="zemax")
    twice = [{"name": name, "kind": "rays", "file": tmp_path / "led.ray"} for name in ("left", "right")]
    for rays in (400_000, 1200):  # many copies of each ray; some of the rays only, which both sources give out
        one = et.trace(et.Scene(sources=[twice[0] | {"flux": 100}], detectors=[GRID]), rays // 2).illuminance["grid"]
        found = et.trace(et.Scene(sources=[s | {"flux": 50} for s in twice], detectors=[GRID]), rays)
        two = found.illuminance["grid"]
        np.testing.assert_allclose(two.values, one.values, rtol=1e-9)
        np.testing.assert_allclose(two.standard_error, one.standard_error, rtol=2 / min(rays, 800))
        assert any(note.startswith("left, right: ") and "copies" in note for note in found.notes)


def test_a_set_that_is_long_enough_has_no_copies() -> None:
    lamp = lopsided(5000, 3)
    result = et.trace(et.Scene(sources=[{"kind": "rays", "rays": lamp}], detectors=[GRID]), 5000)
    _, error = sum_and_error(lamp, lamp.total_flux)
    # Rays of their own: without the factor n/(n − 1).
    np.testing.assert_allclose(result.illuminance["grid"].standard_error, error * math.sqrt(1 - 1 / 5000), rtol=1e-9)
    assert not any("copies" in note for note in result.notes)
    assert result.effective_rays == pytest.approx(lamp.flux.sum() ** 2 / (lamp.flux**2).sum())


def test_what_one_ray_says_has_no_error() -> None:
    lamp = et.RaySet([[0, 0, 0]], [[0.1, 0.05, 1]], [5.0])
    seen = et.trace(et.Scene(sources=[{"kind": "rays", "rays": lamp}], detectors=[GRID]), 1000).illuminance["grid"]
    assert seen.values.max() == pytest.approx(5.0 / CELL, rel=1e-12)
    assert np.isnan(seen.standard_error).all()


# --- through scattering surfaces ---------------------------------------------------------------------------------------


def room(*lamps: et.RaySet, most: int = 10**6, **more: Any) -> et.Scene:
    """A diffuse wall that lights of few rays shine at, beside a source of its own; every kind of detector."""
    keys: dict[str, Any] = {
        "sources": [
            *({"name": f"led{i}", "kind": "rays", "rays": lamp, "flux": 40 + i} for i, lamp in enumerate(lamps)),
            {"name": "pilot", "kind": "point", "flux": 10, "at": [3, 4, 1]},
        ],
        "surfaces": [{"name": "wall", "shape": {"kind": "rectangle", "width": 50, "height": 40}, "at": [3, 0, 22],
                      "toward": [0.1, 0, -1], "finish": {"kind": "lambertian", "reflectance": 0.7}}],
        "detectors": [
            {"name": "far", "kind": "intensity", "c_planes": 6, "gamma_step": 30},
            GRID,
            {"name": "eye", "kind": "image", "observer": "side"},
            {"name": "scatter", "kind": "scatter", "most": most},
            {"name": "rcs", "kind": "rays", "shape": {"kind": "rectangle", "width": 60, "height": 60}, "at": [0, 0, 10]},
        ],
        "observers": [{"name": "side", "theta": 150, "phi": 190, "distance": 200, "target": [3, 0, 22],
                       "screen": {"width": 50, "height": 40, "columns": 6, "rows": 4}}],
    }  # fmt: skip
    return et.Scene(**(keys | more))


@pytest.mark.slow
def test_the_same_bits_for_threads_and_after_stops(tmp_path: Path) -> None:
    """Three rays and five, whose copies are on their way at the end of every batch and round."""
    scene = room(lopsided(3, 1), lopsided(5, 2), detectors=[d for d in room(most=10**5).detectors if d.name != "rcs"])
    n = (BATCHES + 1.25) * _core.batch_size()
    whole = et.trace(scene, n, 3, threads=2)
    first = next(et.trace_rounds(scene, n, 3, threads=7))
    assert sum(len(cell) for cell, *_ in first.sums.open_units) > 20
    assert bits(et.trace(scene, n, 3, threads=1, resume=first)) == bits(whole)
    assert not any(len(cell) for cell, *_ in whole.sums.open_units)
    first.save(tmp_path / "part.h5")
    loaded = TraceResult.load(tmp_path / "part.h5")
    assert bits(loaded) == bits(first)
    assert loaded.notes == first.notes
    assert loaded.effective_rays == first.effective_rays
    again = et.trace(scene, n, 3, threads=7, resume=tmp_path / "part.h5")
    assert bits(again) == bits(whole)
    np.testing.assert_array_equal(again.illuminance["grid"].standard_error, whole.illuminance["grid"].standard_error)


@pytest.mark.slow
def test_scatter_events_looked_at_later_have_the_errors_of_the_light_image() -> None:
    """Two routes to one number: copies gathered while rays are traced, and from stored events afterwards."""
    scene = room(lopsided(30, 1), lopsided(700, 2))
    result = et.trace(scene, 400_000, 3)
    image = result.images["eye"]
    later = et.luminance_map(result.events["scatter"], image.observer, image.screen)
    np.testing.assert_allclose(later.values, image.values, rtol=1e-9)
    np.testing.assert_allclose(later.standard_error, image.standard_error, rtol=1e-6)
    np.testing.assert_array_equal(later.rays, image.rays)
    assert image.rays.sum() < 0.3 * len(result.events["scatter"])


@pytest.mark.slow
def test_collected_rays_tell_that_they_are_copies(tmp_path: Path) -> None:
    rays = et.trace(room(lopsided(50, 1)), 25_000, 3).rays["rcs"]
    told = [str(c) for c in rays.complaints if "copies" in c.found]
    assert len(told) == 1
    assert "20 times" in told[0]
    observer, screen = et.Observer(150, 0, 500, target=(0, 0, 10)), et.Screen(60, 60, 4, 4)
    made = [
        et.luminance_map(rays, observer, screen, acceptance=10),
        et.intensity_distribution(rays, c_planes=4, gamma_step=30),
        et.LightField.fit(rays.subset(2000, seed=1), et.Plane(z=10)),
    ]
    for result in made:
        assert sum("copies of one ray" in note for note in result.notes) == 1
    assert any("copies" in loss for loss in et.write_rays(tmp_path / "rays.tm25ray", rays))
    own = et.trace(room(), 25_000, 3).rays["rcs"]
    assert not any("copies" in c.found for c in own.complaints)


def test_scenes_of_collected_rays_tell_that_they_are_copies(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 copies of each of 50 rays: errors made as if all were independent are up to √100 times too small."""
    sphere = et.Sphere(radius=10.0, centre=(1.0, 2.0, 0.0))  # for which nothing is searched
    fit = functools.partial(et.LightField.fit, surface=sphere, depths=(2, 2, 2, 2))
    monkeypatch.setattr(scene_map, "fit_or_recall", lambda rays, **_: fit(rays))
    ball = {"kind": "rays", "name": "ball", "shape": {"kind": "sphere", "radius": 1e3}}
    source = {"kind": "rays", "name": "led", "rays": lopsided(50, 1)}
    copies = et.trace(et.Scene(sources=[source], detectors=[ball]), 5000, 3).rays["ball"]
    for rays, times in ((copies, 1), (lopsided(50, 1), 0)):
        scene = et.Scene(sources=[{**source, "rays": rays}])
        seen, fits = scene_map.with_fields(scene)
        for notes in (et.trace(scene, None).notes, compile_scene(seen).notes):
            told = [note for note in notes if "copies of one ray of a set" in note]
            assert len(told) == times
            assert all(note.startswith("led: up to 100 ") and "up to 10 times" in note for note in told)
        assert not any("copies of one ray" in note for note in fits)


# --- coverage ----------------------------------------------------------------------------------------------------------

RADIUS, REFLECTANCE = 40.0, 0.6
LAMP, AXIS = np.array([3.0, -4.0, 2.0]), np.array([0.36, 0.48, 0.8])
PILOT = np.array([-5.0, 2.0, 6.0])
FLUX = 70.0, 30.0


def ball(lamp: et.RaySet) -> et.Scene:
    """A white ball around a lamp of few rays, another source, and the grid."""
    return et.Scene(
        sources=[
            {"kind": "rays", "rays": lamp, "flux": FLUX[0]},
            {"kind": "point", "flux": FLUX[1], "at": PILOT.tolist()},
        ],
        surfaces=[{"shape": {"kind": "sphere", "radius": RADIUS},
                   "finish": {"kind": "lambertian", "reflectance": REFLECTANCE}}],
        detectors=[GRID | {"columns": 2, "rows": 2}],
    )  # fmt: skip


def direct(points: Array, *, normals: Array) -> Array:
    """Illuminance by the lamp, I = Φ cos θ/π about its axis, and by the point, I = Φ/4π; `normals` run along the light."""
    total = np.zeros(points.shape[:-1])
    for flux, at, intensity in (
        (FLUX[0], LAMP, lambda d: np.maximum(d @ AXIS, 0) / math.pi),
        (FLUX[1], PILOT, lambda d: np.full(d.shape[:-1], 1 / (4 * math.pi))),
    ):
        away = points - at
        r = np.linalg.norm(away, axis=-1)
        total += flux * intensity(away / r[..., None]) * (away * normals).sum(axis=-1) / r**3
    return total


def reflected_once(points: Array) -> Array:
    """Illuminance of a plane that faces down, by light that the wall below it has reflected once."""
    node, weight = np.polynomial.legendre.leggauss(120)
    top = points.flat[2]
    z, turn = -RADIUS + (top + RADIUS) * (node + 1) / 2, 2 * math.pi * np.arange(240) / 240
    # Equal heights of a sphere have equal areas.
    area = np.repeat(weight / 2 * (top + RADIUS) * RADIUS * 2 * math.pi / 240, 240)
    r = np.sqrt(RADIUS**2 - z**2)[:, None]
    wall = np.stack([r * np.cos(turn), r * np.sin(turn), np.broadcast_to(z[:, None], (120, 240))], axis=-1).reshape(
        -1, 3
    )
    normals = wall / RADIUS
    sent = REFLECTANCE / math.pi * direct(wall, normals=normals) * area

    def at(point: Array) -> float:
        away = point - wall
        return float(sent @ (-(away * normals).sum(axis=1) * away[:, 2] / (away**2).sum(axis=1) ** 2))

    return np.array([at(point) for point in points.reshape(-1, 3)]).reshape(points.shape[:-1])


def truth() -> Array:
    """Illuminance of the cells, by quadrature over each: direct; by the wall, from what it gets directly, which is uneven;
    and by the wall again, which gets any reflected light evenly, so that it sends ρ²/(1 − ρ) Φ/(4π R²) to every place."""
    right, up = axes()
    total = np.full((2, 2), REFLECTANCE**2 / (1 - REFLECTANCE) * sum(FLUX) / (4 * math.pi * RADIUS**2))
    for nodes, part in ((48, lambda x: direct(x, normals=np.array([0.0, 0.0, 1.0]))), (6, reflected_once)):
        node, weight = np.polynomial.legendre.leggauss(nodes)
        step = (np.arange(2)[:, None] + 0.5 + node / 2) / 2 - 0.5
        across, along = 30 * step[None, :, None, :, None] * right, 24 * step[:, None, :, None, None] * up
        total += np.einsum("rcvu,v,u->rc", part(np.array([2, -1, 20]) + across - along), weight, weight) / 4
    return total * 1e6


def file_of(n: int, rng: np.random.Generator) -> et.RaySet:
    """n rays of the lamp, I ∝ cos θ about its axis, as they come: their weights are part of the sample."""
    x = np.cross(AXIS, [1, 0, 0])
    frame = np.array([x / np.linalg.norm(x), np.cross(AXIS, x) / np.linalg.norm(x), AXIS])
    s, a = rng.random(n), rng.random(n) * 2 * math.pi
    local = np.stack([np.sqrt(s) * np.cos(a), np.sqrt(s) * np.sin(a), np.sqrt(1 - s)], axis=1)
    return et.RaySet(np.tile(LAMP, (n, 1)), local @ frame, np.ones(n))


def deviations(*, files: int, n: int, rays: int) -> Iterator[tuple[float, float]]:
    """Of a cell of each of many files, in turn: deviation from the truth over the stated error; and that of all cells
    together over the truth."""
    rng = np.random.default_rng(11)
    expected = truth().ravel()
    for number in range(files):
        seen = et.trace(ball(file_of(n, rng)), rays, seed=number).illuminance["grid"]
        values, cell = seen.values.ravel(), number % expected.size
        off = (values[cell] - expected[cell]) / seen.standard_error.ravel()[cell]
        yield float(off), float(values.sum() / expected.sum() - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("files", "n", "rays"), [(200, 800, 14_000), (60, 400, 150_000)])
def test_stated_errors_cover_the_truth_over_independent_files(files: int, n: int, rays: int) -> None:
    """12 copies of each ray, and 260 across batches, beside another source, through many scatters."""
    off, relative = np.array(list(deviations(files=files, n=n, rays=rays))).T
    assert_covers(deviations=off)
    # Errors of single files are too large to show a bias of a few per cent; their mean shows it.
    error = relative.std(ddof=1) / math.sqrt(files)
    assert error < 0.01
    assert abs(relative.mean()) < t.isf(SIGNIFICANCE / 2, files - 1) * error
