"""Screens that are found from where the light is, and the share of it that a stated screen shows."""

from __future__ import annotations

import math
import re
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.field_rays import FieldRays
from etendue.luminance.framing import FEW_SEEN, centre_of_light, framed, framed_screens, light_towards, missed_notes
from etendue.luminance.opening import open_source
from oracles.light_fields import make_field
from scipy import stats

SIGNIFICANCE = 1e-4


def lamp(rays: int = 150_000) -> et.RaySet:
    """Two Lambertian squares, 2 mm wide with 3 parts of the flux and 1 mm wide with 1 part, 10 mm apart; no symmetry."""
    rng = np.random.default_rng(11)
    small = rng.random(rays) < 0.25
    half = np.where(small, 0.5, 1.0)[:, None]
    place = np.where(small[:, None], (14.0, 3.0), (4.0, 3.0)) + half * rng.uniform(-1, 1, (rays, 2))
    sine, azimuth = np.sqrt(rng.random(rays)), rng.uniform(0, 2 * np.pi, rays)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)], axis=1)
    return et.RaySet(np.column_stack([place, np.full(rays, 7.0)]), direction, np.full(rays, 1 / rays))


def test_the_share_is_that_of_the_flux_on_the_screen() -> None:
    """A screen about the large square shows three quarters of the light, by the binomial of the rays that head there."""
    observer = et.Observer(20, 35, 2000, target=(4, 3, 7))
    screen = et.Screen(6, 6, 4, 4)
    light = light_towards(lamp(380_000), observer, screen)
    shown, rays = light.share(screen) * light.flux.size, light.flux.size
    assert rays > 1000
    assert stats.binomtest(round(shown), rays, 0.75).pvalue > SIGNIFICANCE
    assert stats.binomtest(round(1.05 * shown), rays, 0.75).pvalue < SIGNIFICANCE


@pytest.mark.parametrize("theta", [0, 40, 75])
def test_a_framed_screen_holds_all_light_and_little_else(theta: float) -> None:
    """The corners of the larger extent, projected, lie on it, and it is not a third larger."""
    rays = lamp()
    observer = et.Observer(theta, 35, 2000, target=(8, 3, 7))
    screen = framed(rays, observer, 64, 64)
    corners = np.array([(x, y, 7.0) for x, y in ((3, 2), (3, 4), (14.5, 2.5), (14.5, 3.5))])
    right, up, _ = screen.axes(observer)
    reach = np.abs((corners - observer.target) @ np.array([right, up]).T).max()
    assert reach < screen.width / 2 < 1.35 * reach
    assert screen.width / 64 == pytest.approx(screen.height / 64, rel=1e-12)
    assert light_towards(rays, observer, screen).share(screen) > 0.99


def test_strays_do_not_frame() -> None:
    """0.3 % of the flux spread over a metre leaves the screen as it is."""
    rays = lamp()
    position = rays.position.copy()
    position[::333] += np.random.default_rng(2).uniform(-500, 500, (len(position[::333]), 3)) * (1, 1, 0)
    strayed = et.RaySet(position, rays.direction, rays.flux)
    observer = et.Observer(10, 0, 2000, target=(8, 3, 7))
    assert framed(strayed, observer).width < 1.3 * framed(rays, observer).width


def test_the_centre_is_where_the_lines_are_closest() -> None:
    """The flux-weighted middle of the squares: x = (3 · 4 + 14)/4."""
    np.testing.assert_allclose(centre_of_light(lamp()), (6.5, 3.0, 7.0), atol=0.3)


def test_a_map_of_a_path_needs_no_screen(tmp_path: Path) -> None:
    path = tmp_path / "lamp.tm25ray"
    et.write_rays(path, lamp(50_000))
    observer = et.Observer(20, 35, 2000, target=(6.5, 3, 7))
    lmap = et.luminance_map(str(path), observer, method="cone", acceptance=10)
    assert lmap.screen == framed(et.read_rays(path).subset(50_000, 1), observer)
    assert not any("the screen shows" in note for note in lmap.notes)


def test_a_field_and_its_file_are_framed_alike(tmp_path: Path) -> None:
    field = make_field(et.Disk(radius=1.3, z=-0.2, centre=(0.5, 1 / 7)))
    field.save(tmp_path / "field.h5")
    observer = et.Observer(20, 35, 2000, target=(0.5, 0, 0))
    one, other = et.luminance_map(field, observer), et.luminance_map(tmp_path / "field.h5", observer)
    assert one.screen == other.screen
    assert 2.6 < one.screen.width < 4.2


def test_a_scene_needs_no_screen_and_no_object(tmp_path: Path) -> None:
    source = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    scene = et.Scene(sources=[source])
    scene.save(tmp_path / "lamp.toml")
    lmap = et.luminance_map(tmp_path / "lamp.toml", et.Observer(30, 0, 500), rays_per_pixel=16)
    assert 4.0 < lmap.screen.width < 4.2
    assert et.trace(tmp_path / "lamp.toml", rays=1000).rays_done == 1000


@pytest.mark.slow
@pytest.mark.parametrize("method", ["cone", "lightfield"])
def test_a_screen_that_misses_light_says_so(method: str) -> None:
    observer = et.Observer(20, 35, 2000, target=(4, 3, 7))
    how = et.Cone(acceptance=10) if method == "cone" else et.FromField(surface=et.Disk(12, z=6.9, centre=(9, 3)))
    lmap = et.luminance_map(lamp(20_000), observer, et.Screen(6, 6, 8, 8), method=how)
    (note,) = [note for note in lmap.notes if note.startswith("the screen shows")]
    share = float(re.search(r"shows ([\d.]+)%", note)[1])
    assert share == pytest.approx(75, abs=7)
    advised = re.search(r"one of ([\d.]+) × [\d.]+ mm about the target ([\d.,]+) shows", note)
    x, y, z = map(float, advised[2].split(","))
    screen = et.Screen(float(advised[1]), float(advised[1]), 8, 8)
    whole = et.luminance_map(lamp(20_000), et.Observer(20, 35, 2000, target=(x, y, z)), screen, method="cone")
    assert not any("the screen shows" in note for note in whole.notes)


@pytest.mark.slow
@pytest.mark.parametrize("wide", [True, False])
def test_a_frame_about_few_rays_that_misses_light_of_their_field_says_so(*, wide: bool) -> None:
    """60 rays of a strip, and the field of a plane on which some of their light lies far beside it."""
    rng = np.random.default_rng(3)
    place = np.column_stack([rng.uniform(-1, 1, 60), rng.uniform(-0.5, 0.5, 60), np.zeros(60)])
    sine, turn = np.sqrt(rng.random(60)), 2 * np.pi * rng.random(60)
    direction = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)])
    rays = et.RaySet(place, direction, np.full(60, 100 / 60))
    surface = et.Plane(0, 40, 40, centre=(3, 2)) if wide else et.Plane(0, 2, 1, centre=(0, 0))
    eye, how = et.Observer(20, 0, 1000), et.FromField(surface=surface)
    lmap = et.luminance_map(rays, eye, method=how)
    share = lmap.intensity / et.luminance_map(rays, eye, et.Screen(90, 90, 256, 256), method=how).intensity
    told = [note for note in lmap.notes if note.startswith("the screen shows")]
    assert bool(told) == bool(share < 0.9) == wide
    for note in told:
        # Of the field's light within 12° of the direction, which is not all alike.
        assert float(note.split("shows ")[1].split("%")[0]) == pytest.approx(100 * share, abs=5)


def test_a_map_that_shows_the_whole_field_asks_no_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its intensity is that of the field towards the observer, which is a sum over the surface; drawn rays take 50 times as
    long."""
    field = make_field(et.Disk(radius=1.3, z=-0.2, centre=(0.5, 1 / 7)))
    observer = et.Observer(20, 35, 2000, target=(0.5, 0, 0))
    drawn = []
    monkeypatch.setattr(et.LightField, "sample", lambda _, n: drawn.append(n) or FieldRays(field, n).ray_set())
    et.luminance_map(field, observer, et.Screen(4, 4, 16, 16))
    assert drawn == []
    part = et.luminance_map(field, observer, et.Screen(1, 1, 16, 16))
    assert len(drawn) == 1
    assert any("the screen shows" in note for note in part.notes)


def test_a_file_that_is_dark_from_there_is_named(tmp_path: Path) -> None:
    et.write_rays(tmp_path / "lamp.tm25ray", lamp(5000))
    with pytest.raises(et.ArgumentError, match=r"no ray of lamp\.tm25ray heads for"):
        et.luminance_map(tmp_path / "lamp.tm25ray", et.Observer(150, 0, 2000))


def test_from_behind_it_is_dark() -> None:
    with pytest.raises(et.ArgumentError, match="from there the source is dark"):
        et.luminance_map(lamp(5000), et.Observer(150, 0, 2000), method="cone")
    lmap = et.luminance_map(lamp(5000), et.Observer(150, 0, 2000), et.Screen(9, 9, 4, 4), method="cone")
    assert any("from there the source is dark" in note for note in lmap.notes)


@pytest.mark.slow
def test_scenes_of_nothing_but_measured_sources_are_framed_by_their_light(tmp_path: Path) -> None:
    """As the rays themselves are, turned and moved as the source is; whatever kind of source holds them."""
    rays = lamp(20_000)
    observer = et.Observer(20, 35, 2000, target=(4, 3, 7))
    place = {"at": [1, 2, 3], "rotation": [0, 0, 90]}
    scene = et.Scene(sources=[{"kind": "rays", "rays": rays, **place}])
    turned = rays.rotated((0, 0, 1), 90).moved((1, 2, 3))
    assert framed_screens(scene, [observer], 64, 32) == [framed(turned, observer, 64, 32)]
    with pytest.raises(ArgumentError, match="nothing in the scene has an end"):
        framed_screens(et.Scene(sources=[{"kind": "point", "flux": 1}]), [observer])
    # Rays of a field and of patches are others, of the same light.
    folder = tmp_path / "patches"
    et.GriddedSource.fit(rays, et.Plane(z=7), pixel=1.0, threshold=20).save_patches(folder)
    field = et.LightField.fit(rays, et.Plane(z=7, focus=(0, 0, 0, 0)), depths=(3, 3, 3, 3))
    for source in ({"kind": "light-field", "field": field}, {"kind": "gridded", "file": str(folder), "draws": 1000}):
        (screen,) = framed_screens(et.Scene(sources=[source]), [observer], 64, 32)
        assert abs(screen.width / framed(rays, observer, 64, 32).width - 1) < 0.25
    opened = open_source(folder)
    assert isinstance(opened, et.Scene)
    assert opened.sources[0].kind == "gridded"


def test_an_observer_within_the_source_is_told_no_share() -> None:
    """A thousandth of a millimetre above a square of 2 mm all pixels are lit; few rays or none head for there."""
    rays = lamp()
    near = [et.Observer(10, 0, distance, target=(4, 3, 7)) for distance in (1e-3, 0.1)]
    for observer in near:
        screen = et.Screen(observer.distance / 2, observer.distance / 2, 4, 4)
        assert missed_notes(rays, observer, screen) == ()
    assert missed_notes(rays, et.Observer(10, 0, 2000, target=(4, 3, 7)), et.Screen(0.1, 0.1, 4, 4))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["cone", "lightfield"])
def test_light_that_starts_beyond_the_observer_is_told(method: str) -> None:
    """A lamp, and one of a third of its flux as far behind the observer as he is in front of the first, which sends its rays
    away from him: through him and the screen pass lines of both in the ratio of their fluxes."""
    rng = np.random.default_rng(3)
    n = 400_000 if method == "cone" else 20_000
    sine, azimuth = 0.2 * np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)], axis=1)
    behind = rng.random(n) < 0.25
    place = np.column_stack([rng.uniform(-10, 10, (n, 2)), np.where(behind, 600.0, 0.0)])
    lamps = et.RaySet(place, direction, np.full(n, 1 / n))
    view, screen = et.Observer(0, 0, 300), et.Screen(40, 40, 8, 8)
    wall = et.Plane(z=0, width=300, height=300, focus=(0, 0, 0, 0))
    how = et.Cone(acceptance=5) if method == "cone" else et.FromField(surface=wall)
    (note,) = (m for m in et.luminance_map(lamps, view, screen, method=how).notes if "beyond" in m)
    share, seen = float(re.search(r"about (\d+)%", note)[1]) / 100, FEW_SEEN if method == "lightfield" else 250  # type: ignore[index]
    assert abs(share - 0.25) < 4 * math.sqrt(0.25 * 0.75 / seen) + 0.005
    first = et.RaySet(place[~behind], direction[~behind], lamps.flux[~behind])
    for rays in (first, lamps.moved((0, 0, -700))):
        told = et.luminance_map(rays, view, screen, method=et.Cone(acceptance=5)).notes
        assert not any("beyond" in note for note in told)


def test_a_dark_map_of_a_field_names_the_rays_that_it_leaves_out() -> None:
    """Two disks, of which the lower one shines down with 10⁻⁴ of the flux: where the field is that of the upper one, the
    view from below says what is missing."""
    rng = np.random.default_rng(3)
    u = rng.random((2000, 4))
    r, sine = np.sqrt(u[:, 0]), np.sqrt(u[:, 2])
    turn, azimuth = 2 * np.pi * u[:, 1], 2 * np.pi * u[:, 3]
    down = np.arange(len(u)) % 2 == 1
    away = np.where(down, -1.0, 1.0)
    place = np.stack([r * np.cos(turn), r * np.sin(turn), np.where(down, -1.0, 0.0)], axis=1)
    direction = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), away * np.sqrt(1 - sine**2)], axis=1)
    rays = et.RaySet(place, direction, np.where(down, 1e-6, 1e-2))
    field = et.LightField.fit(rays, et.Disk(radius=1), depths=(2, 2, 2, 2))
    lmap = et.luminance_map(field, et.Observer(150, 0, 1000, target=(0, 0, -1)), et.Screen(1, 1, 4, 4))
    (told,) = [note for note in lmap.notes if note.startswith("the map is dark")]
    assert "1,000 rays (0.01 % of the flux)" in told
    assert not any(
        "dark" in note for note in et.luminance_map(field, et.Observer(10, 0, 1000), et.Screen(1, 1, 4, 4)).notes
    )
