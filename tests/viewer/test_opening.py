"""From files and values to pages: what is shown, what is refused, and that the light around a scene is the scene's."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.viewer.file_output import write_page
from etendue.viewer.geometry import scene_geometry
from etendue.viewer.opening import exhibit_of, light_of, open_viewable
from etendue.viewer.subjects import first_view, intensity_solid
from scipy import interpolate

from viewer.conftest import FIELDS
from viewer.viewables import LAMP, make_files, spot, traced


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """One of each kind."""
    return make_files(tmp_path)


def test_files_are_what_they_hold(files: Path) -> None:
    for name, kind in (
        ("lamp.h5", et.LightField),
        ("rings.tm25ray", et.RaySet),
        ("map.exr", et.LuminanceMap),
        ("scene.toml", et.Scene),
    ):
        assert isinstance(open_viewable(files / name), kind)
    assert isinstance(open_viewable(files / "trace.h5", "card"), et.IlluminanceMap)
    assert isinstance(open_viewable(files / "trace.h5", "disk"), et.RaySet)


def test_what_cannot_be_shown_is_refused(files: Path) -> None:
    with pytest.raises(ArgumentError, match="disk"):
        open_viewable(files / "trace.h5")
    with pytest.raises(UnknownNameError, match="'card'"):
        open_viewable(files / "trace.h5", "cart")
    with pytest.raises(ArgumentError, match="results of traces"):
        open_viewable(files / "lamp.h5", "card")
    with pytest.raises(FormatError):
        open_viewable(files / "notes.txt")
    with pytest.raises(FileNotFoundError):
        open_viewable(files / "missing.h5")
    with pytest.raises(ArgumentError, match="scenes"):
        exhibit_of(FIELDS["lamp"], name="lamp", rays=1000)
    with pytest.raises(ArgumentError, match="results of traces"):
        exhibit_of(FIELDS["lamp"], name="lamp", detector="card")
    with pytest.raises(ArgumentError, match="nothing in it has an end"):
        light_of(et.Scene(name="void"), 100)
    point = et.RaySet(np.zeros((2, 3)), [[0, 0, 1], [0.6, 0, 0.8]], [1.0, 1.0])
    with pytest.raises(ArgumentError, match="one point"):
        light_of(et.Scene(sources=[{"kind": "rays", "rays": point}]), 100)
    dark = et.Scene(sources=[LAMP], surfaces=[{"shape": {"kind": "sphere", "radius": 9}, "finish": "absorber"}])
    with pytest.raises(ArgumentError, match="leaves it"):
        light_of(dark, 1000)


def test_all_light_of_a_scene_of_nothing_but_rays_is_collected() -> None:
    """Each ray once, in its place: along the same lines as in the file."""
    rays = et.RingSource(rays=500).ray_set()
    found = light_of(et.Scene(sources=[{"kind": "rays", "rays": rays, "at": [1, 2, 3]}]), 500)
    assert isinstance(found, et.RaySet)
    order, other = (np.lexsort(np.round(one.direction, 9).T) for one in (found, rays))
    np.testing.assert_allclose(found.direction[order], rays.direction[other], atol=1e-9)
    off = found.position[order] - (rays.position[other] + (1, 2, 3))
    assert np.abs(np.cross(off, rays.direction[other])).max() < 1e-6
    np.testing.assert_allclose(found.total_flux, rays.total_flux)


def test_a_trace_shows_what_one_detector_saw() -> None:
    result = traced()
    exhibit = exhibit_of(result, name="trace.h5", detector="card")
    assert exhibit.subject["kind"] == "map"
    assert exhibit.subject["quantity"] == "illuminance"
    assert exhibit.subject["unit"] == "lx"
    assert exhibit.source is result.illuminance["card"]


def test_the_light_around_a_scene_is_all_of_it() -> None:
    """A lamp that loses nothing: every ray leaves, once, and its lines are those of the lamp.

    Rays that leave a Lambertian rectangle have E[cos θ] = 2/3 with variance 1/18, and begin evenly on it: variance of x is
    w²/12. 4.5 standard errors: 10⁻⁵ by chance in three figures.
    """
    n = 40_000
    light = light_of(et.Scene(sources=[LAMP]), n, seed=3)
    assert isinstance(light, et.RaySet)
    assert len(light) == n
    assert light.total_flux == pytest.approx(100, rel=1e-9)
    cosine = light.direction[:, 2]
    assert abs(cosine.mean() - 2 / 3) < 4.5 * np.sqrt(1 / 18 / n)
    along = (1.0 - light.position[:, 2]) / cosine
    x, y = (light.position + along[:, None] * light.direction)[:, :2].T
    assert abs(x.mean() - 0.3) < 4.5 * 2 / np.sqrt(12 * n)
    assert abs(y.mean() + 0.2) < 4.5 * 1 / np.sqrt(12 * n)
    assert np.abs(x - 0.3).max() <= 1 + 1e-6


@pytest.mark.slow
def test_the_progress_of_a_scene_goes_on_through_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """It rises from the first rays to all of them, and most of it is the fit's."""
    solid = {"c": [0, 180], "gamma": [0, 90, 180], "values": [1, 0, 0, 1, 0, 0], "unit": "cd"}
    monkeypatch.setattr("etendue.viewer.subjects.intensity_solid", lambda _: solid)
    seen: list[int] = []
    lamp = {"kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 5}
    exhibit_of(et.Scene(sources=[lamp]), name="lamp", rays=5000, cache=False, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 5000
    assert sum(done > 1250 for done in seen) > 3


@pytest.mark.slow
def test_the_intensity_solid_holds_the_beam() -> None:
    """Of a spot of 7° in an oblique direction: what is drawn, linear between the nodes, is off by 8 % of the top at most.

    Between even nodes of 10° and 2.5° it is by 21 %. Against the core's sums for directions all over the spot. The first
    look is from where it is brightest, within 1° of its middle.
    """
    theta, phi = 23.7, 33.3
    field = spot(width=7.0, theta=theta, phi=phi)
    solid = intensity_solid(field)
    c, gamma = np.array(solid["c"]), np.array(solid["gamma"])
    assert c.size * gamma.size <= 24_000
    values = np.array(solid["values"]).reshape(c.size, gamma.size)
    drawn = interpolate.RegularGridInterpolator((np.append(c, 360.0), gamma), np.append(values, values[:1], axis=0))
    lean, turn = np.meshgrid(theta + np.linspace(-9.1, 9.3, 24), phi + np.linspace(-21.1, 20.7, 23))
    t, p = np.radians(lean).ravel(), np.radians(turn).ravel()
    k = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    truth = field.core.intensity(k, 64)
    found = drawn(np.stack([turn.ravel(), lean.ravel()], axis=1))
    assert np.abs(found - truth).max() < 0.08 * truth.max()
    view = first_view(field, solid)
    assert et.Observer(view["theta"], view["phi"], 1).direction @ et.Observer(theta, phi, 1).direction > math.cos(
        math.radians(1.0)
    )


def test_curves_lie_on_the_faces_and_in_their_planes() -> None:
    """Of a ball: |x - c| = r within what simplification may take, in every plane that cuts it; and none is left out."""
    ball = {"shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [1, -2, 5]}
    geometry = scene_geometry(et.Scene(sources=[LAMP], solids=[ball]))
    assert geometry is not None
    assert not geometry["left_out"]
    size = float(np.linalg.norm(np.subtract(geometry["high"], geometry["low"])))
    cut = 0
    for plane in geometry["planes"]:
        axis = "xyz".index(plane["axis"])
        for line in plane["lines"]:
            points = np.array(line).reshape(-1, 3)
            cut += len(points)
            assert np.abs(points[:, axis] - plane["at"]).max() < 1e-4 * size
            assert np.abs(np.linalg.norm(points - (1, -2, 5), axis=1) - 3).max() < 1e-3 * size
            # Chords of a circle of radius ρ with the sagitta s reach s = ρ - sqrt(ρ² - (chord/2)²) into it.
            chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
            assert chord.max() < 2 * np.sqrt(2 * 3 * 1.1e-3 * size)
    assert cut > 500
    assert len(geometry["rays"]) > 100
    assert json.dumps(geometry)


def test_many_faces_are_cut_in_the_middle_only() -> None:
    surfaces = [
        {"shape": {"kind": "disk", "radius": 0.1}, "at": [i % 40, i // 40, 0], "finish": "absorber"}
        for i in range(1600)
    ]
    geometry = scene_geometry(et.Scene(surfaces=surfaces))
    assert geometry is not None
    assert [plane["axis"] for plane in geometry["planes"]] == ["x", "y", "z"]
    assert geometry["left_out"]


def test_a_notebook_shows_the_same_page(files: Path) -> None:
    """The widget holds the page of a file of its own; its frame may run a script and hand out files."""
    pytest.importorskip("anywidget")
    widget = et.view(files / "map.exr", height=500)
    assert widget.title == "map.exr"
    assert widget.height == 500
    run_file = files / "page.html"
    write_page(exhibit_of(et.read_map(files / "map.exr"), name="map.exr", file=str(files / "map.exr")), run_file)
    assert widget.page == run_file.read_text("utf-8")
    named = et.view(et.read_map(files / "map.exr"))
    assert named.page.startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            {"source": 3},
            "view: source is 3; give a light field, rays, a map, the result of a trace, a scene, or the path",
        ),
        ({"title": 3}, "view: title is 3; give the title of the page, or None"),
        ({"height": "tall"}, "view: height is 'tall'; give a number of CSS pixels"),
    ],
)
def test_a_notebook_is_told_what_cannot_be_shown(keys: dict[str, Any], words: str) -> None:
    whole: dict[str, Any] = {"source": et.IlluminanceMap([[5.0]], [[0.1]], [[9]], et.Screen(2, 1, 1, 1, "xy")), **keys}
    with pytest.raises(ArgumentError, match=re.escape(words)):
        et.view(whole.pop("source"), **whole)
