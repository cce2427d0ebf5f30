"""The screen that a scene is framed on: all of it is seen, and not much else."""

from __future__ import annotations

import itertools

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.scene import compile_scene
from etendue.scene.framing import MARGIN, framed_screen

PLANE = {"shape": {"kind": "plane"}, "finish": "absorber", "at": [0, 0, -9]}


@pytest.mark.parametrize("pixels", [(64, 32), (16, 90)])
@pytest.mark.parametrize("view", [(0, 0, 50), (35, 200, 40), (90, 70, 900), (150, -20, 33)])
def test_all_of_the_scene_is_seen_and_it_fills_the_screen(
    view: tuple[float, float, float], pixels: tuple[int, int]
) -> None:
    """The corners of a rectangle of triangles, turned and moved, through the pinhole of the eye by similar triangles."""
    at = np.array([3.0, -2.0, 1.0])
    sheet = {
        "shape": {"kind": "rectangle", "width": 7, "height": 4},
        "finish": "absorber",
        "at": at,
        "toward": [1, 0, 0],
    }
    observer = et.Observer(*view, target=(1, 1, 0))
    compiled = compile_scene(et.Scene(surfaces=[sheet, PLANE]))
    screen = framed_screen(compiled, observer, *pixels)
    assert (screen.columns, screen.rows) == pixels
    assert screen.width / screen.columns == pytest.approx(screen.height / screen.rows)
    # It stands upright: its normal is +x, one side is along y and the other along z.
    sides = [(7.0, 4.0), (4.0, 7.0)]
    tried = []
    for along_y, along_z in sides:
        corners = at + [(0.0, y * along_y, z * along_z) for y, z in itertools.product((-0.5, 0.5), repeat=2)]
        right, up, normal = screen.axes(observer)
        sight = corners - observer.position
        reach = (np.array(observer.target) - observer.position) @ normal / (sight @ normal)
        hit = observer.position + sight * reach[:, None] - observer.target
        tried.append(max(2 * np.abs(hit @ right).max() / screen.width, 2 * np.abs(hit @ up).max() / screen.height))
    assert min(abs(fill - 1 / MARGIN) for fill in tried) < 1e-9


def test_of_a_scene_without_faces_the_sources_count() -> None:
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 1}
    screen = framed_screen(compile_scene(et.Scene(sources=[lamp])), et.Observer(0, 0, 1000), 10, 10)
    assert screen.width == pytest.approx(4 * MARGIN)


def test_what_cannot_be_framed_is_told() -> None:
    endless = compile_scene(et.Scene(sources=[{"kind": "point", "flux": 1}], surfaces=[PLANE]))
    with pytest.raises(ArgumentError, match="nothing in the scene has an end"):
        framed_screen(endless, et.Observer(0, 0, 1000))
    wide = compile_scene(et.Scene(surfaces=[{"shape": {"kind": "disk", "radius": 50}, "finish": "absorber"}]))
    with pytest.raises(ArgumentError, match="as far as the observer"):
        framed_screen(wide, et.Observer(90, 0, 40))
