"""Lamps far smaller than a pixel, seen directly, in a mirror and in glass: closed forms, and the same from close by."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue import _core
from etendue.luminance.scene_map import MOST_EVENTS
from etendue.scene import compile_scene
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE
from scipy.stats import chi2

RADIUS = 0.01
LAMP = {"kind": "surface", "shape": {"kind": "disk", "radius": RADIUS}, "flux": 100.0}
LUMINANCE = 100.0 / (math.pi * math.pi * RADIUS**2)
"""Of the lamp [lm/(mm² sr)]."""


def agree(scene: et.Scene, observer: et.Observer, screen: et.Screen, expected: float) -> None:
    """Σ L · pixel of a few maps is `expected`, in units of the errors that each states, which are below a quarter; and
    an error of 5 % would be seen."""
    area = screen.width * screen.height / (screen.rows * screen.columns) * 1e-6
    maps = [et.luminance_map(scene, observer, screen, rays_per_pixel=256, seed=seed) for seed in range(1, 41)]
    light = area * np.array([lmap.values.sum() for lmap in maps])
    error = area * np.array([math.sqrt((lmap.standard_error**2).sum()) for lmap in maps])
    assert (error < 0.25 * expected).all()
    assert chi2.sf((((light - expected) / error) ** 2).sum(), len(maps)) > SIGNIFICANCE
    known = math.sqrt((error**2).mean() / len(maps))
    assert known < 0.05 * expected / LARGEST_Z
    assert abs(light.mean() - expected) < LARGEST_Z * known


@pytest.mark.slow
def test_a_lamp_seen_directly_and_in_a_mirror() -> None:
    """A screen at the target, at right angles to the view of an eye D away: a lamp of area A at the distance d from the eye,
    turned by θ, makes ∫ L dA = L A cos θ (D/d)² of it."""
    eye, distance = et.Observer(theta=0, phi=0, distance=200.0), 200.0
    screen = et.Screen(40, 40, 9, 9)
    # Upwards at (-9, 3, 5); the mirror stands upright in the plane x = 10 and faces -x.
    lamp = {**LAMP, "at": [-9, 3, 5], "toward": [0.6, 0, 0.8]}
    mirror = {"shape": {"kind": "rectangle", "width": 300, "height": 300}, "at": [10, 0, 0], "toward": [-1, 0, 0],
              "finish": {"kind": "mirror", "reflectance": 0.7}}  # fmt: skip

    def expected(at: list[float], way: list[float]) -> float:
        to_eye = np.array([0, 0, distance]) - np.array(at)
        d = float(np.linalg.norm(to_eye))
        # Obliquity of the line on the screen: cos⁻³ of what lies off axis is in (D/d)² of the depth along the axis.
        cosine = float(to_eye @ np.array(way)) / d
        slant = to_eye[2] / d
        return LUMINANCE * math.pi * RADIUS**2 * cosine / d**2 * distance**2 / slant**3

    direct = expected([-9, 3, 5], [0.6, 0, 0.8])
    agree(et.Scene(sources=[lamp]), eye, screen, direct)
    # Its image stands at x = 29.
    mirrored = 0.7 * expected([29, 3, 5], [-0.6, 0, 0.8])
    wide = et.Screen(80, 40, 15, 9)
    agree(et.Scene(sources=[lamp], surfaces=[mirror]), eye, wide, direct + mirrored)


@pytest.mark.parametrize("lines", [4, 8])
def test_few_lines_of_sight_find_them(lines: int) -> None:
    """No map of 40 misses the lamp that the search has found, and their mean is the closed form."""
    lamp = {**LAMP, "toward": [0, 0, 1]}
    eye, screen = et.Observer(theta=0, phi=0, distance=200.0), et.Screen(40, 40, 9, 9)
    maps = [
        et.luminance_map(et.Scene(sources=[lamp]), eye, screen, rays_per_pixel=lines, seed=seed)
        for seed in range(1, 41)
    ]
    light = (40.0 / 9.0) ** 2 * 1e-6 * np.array([lmap.values.sum() for lmap in maps])
    assert (light > 0.0).all()
    assert all(lmap.standard_error[lmap.values > 0.0].all() for lmap in maps)
    expected = LUMINANCE * math.pi * RADIUS**2
    error = light.std(ddof=1) / math.sqrt(len(light))
    assert error < 0.06 * expected
    assert abs(light.mean() - expected) < LARGEST_Z * error


def glass(kind: str) -> dict[str, Any]:
    """A small lamp before a ball or a ring of glass, off all axes."""
    shapes = {
        "ball": {"shape": {"kind": "ball", "radius": 5}, "medium": {"index": 1.5}, "at": [1, 0.5, 10]},
        "torus": {"shape": {"kind": "torus", "major_radius": 5, "minor_radius": 2}, "medium": "PMMA", "at": [0, 1, 8]},
    }
    lamp = {**LAMP, "shape": {"kind": "disk", "radius": 0.08}}
    return {"sources": [{**lamp, "at": [4, 2, 30], "toward": [-0.1, -0.05, -1]}], "solids": [shapes[kind]]}


@pytest.mark.parametrize("kind", ["ball", "torus"])
def test_what_has_no_index_hides_no_glint(kind: str) -> None:
    """Blocks of nothing stand around all of it, and around the lamp alone: lines of sight go on behind their faces as they
    came, those beside them too."""
    scene = glass(kind)
    block = {"kind": "block", "width": 80, "height": 80, "depth": 90}
    around = [{"shape": block, "medium": {"index": 1.0}, "at": [0, 0, z]} for z in (-30, 25)]
    eye, screen = et.Observer(55, 20, 300, target=(1, 0.5, 9)), et.Screen(18, 14, 9, 7)
    with_glints = []
    for blocks in ([], around[:1], around[1:]):
        solids = [*blocks, *scene["solids"]]
        core = _core.Scene(compile_scene(et.Scene(sources=scene["sources"], solids=solids)).record)
        with_glints.append(_core.Glints(core, screen.core_view(eye), MOST_EVENTS).pixels())
    assert with_glints[0] == with_glints[1] == with_glints[2] > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ball", "torus"])
def test_glints_in_glass(kind: str) -> None:
    """Each glint from close by, where it fills pixels and no line is aimed at it, shows the light of the coarse map."""
    scene = et.Scene(**glass(kind))
    eye, screen = et.Observer(55, 20, 300, target=(1, 0.5, 9)), et.Screen(18, 14, 9, 7)
    core = _core.Scene({**compile_scene(scene).record, "detectors": []})
    assert _core.Glints(core, screen.core_view(eye), MOST_EVENTS).pixels() > 0
    maps = [et.luminance_map(scene, eye, screen, rays_per_pixel=64, seed=seed) for seed in range(1, 7)]
    values = np.array([lmap.values for lmap in maps])
    error = np.array([lmap.standard_error for lmap in maps])
    mean = values.mean(axis=0)
    # The brightest pixel, as finer screens show it.
    row, column = (int(i) for i in np.unravel_index(np.argmax(mean), mean.shape))
    view = dict(screen.core_view(eye))
    width, height = view["width"] / 9, view["height"] / 7
    off = ((column + 0.5) * width - view["width"] / 2, view["height"] / 2 - (row + 0.5) * height)
    view["target"] = tuple(np.array(view["target"]) + np.array(view["right"]) * off[0] + np.array(view["up"]) * off[1])
    view.update(width=width, height=height, columns=600, rows=600)
    fine, *_ = _core.look_at_scene(core, view, 1, 5, MOST_EVENTS, "nothing", 0, 1)
    shown = fine[fine > 0]
    assert len(shown) > 20
    expected = 1e6 * fine.mean()
    # Pixels of the rim are met or not by one line each.
    known = 1e6 * math.sqrt((shown**2).sum()) / fine.size
    z = (values[:, row, column] - expected) / np.hypot(error[:, row, column], known)
    assert (error[:, row, column] < 0.25 * expected).all()
    assert chi2.sf((z**2).sum(), len(z)) > SIGNIFICANCE


@pytest.mark.slow
def test_a_ghost_leaves_the_image_about_it_without_noise() -> None:
    """In the midst of the image of a die in a ball of glass of reflectance R: L (1 − R)², and where the ghost of two
    reflections lies as well, L (1 − R)²(1 + R² + …). A place half a millimetre off the axis, under 8°, has 10⁻⁴ less at
    most."""
    index, flux, area = 1.5, 100.0, 2.0 * 1.6
    die = {"kind": "surface", "shape": {"kind": "rectangle", "width": 2.0, "height": 1.6}, "flux": flux}
    ball = {"shape": {"kind": "ball", "radius": 4}, "medium": {"index": index}, "at": [0.3, 0.2, 6]}
    eye, screen = et.Observer(0, 0, 500.0, target=(0.3, 0.2, 0.0)), et.Screen(8, 8, 21, 21)
    scene = et.Scene(sources=[die], solids=[ball])
    maps = [et.luminance_map(scene, eye, screen, rays_per_pixel=64, seed=seed) for seed in range(1, 4)]
    assert any("lamps are small" in note for note in maps[0].notes)
    found = np.array([lmap.values[9:12, 9:12] for lmap in maps])
    r = ((index - 1) / (index + 1)) ** 2
    once = flux / (math.pi * area) * 1e6 * (1 - r) ** 2
    assert (found > once * (1 - 1e-4)).all()
    assert (found < once / (1 - r * r) * (1 + 1e-4)).all()
    assert (found.std(axis=0, ddof=1) < 2e-4 * once).all()
    assert all((lmap.standard_error[9:12, 9:12] < 2e-4 * once).all() for lmap in maps)


@pytest.mark.slow
def test_the_number_of_threads_does_not_matter() -> None:
    scene, eye, screen = (
        et.Scene(**glass("torus")),
        et.Observer(55, 20, 300, target=(1, 0.5, 9)),
        et.Screen(18, 14, 36, 28),
    )

    def looked(threads: int) -> et.LuminanceMap:
        return et.luminance_map(scene, eye, screen, rays_per_pixel=4, threads=threads)

    one = looked(1)
    assert any("lamps are small" in note for note in one.notes)
    found = looked(7)
    assert found.notes == one.notes
    np.testing.assert_array_equal(found.values, one.values)
