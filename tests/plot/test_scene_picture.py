"""Drawings of scenes: to scale, complete, in the frame, the same bytes each time; and what they say of rays."""

from __future__ import annotations

import copy
import itertools
import math
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, SceneError, UnknownNameError
from etendue.plot.labels import HEIGHT, WIDTH, LabelPlacer
from etendue.plot.scene_drawing import MOST_LABELS
from etendue.plot.scene_layout import lay_out_scene
from etendue.plot.scene_legend import FILLS, FINISH_LINES, RAY, legend_handles
from etendue.plot.scene_parts import FINISH_KINDS
from etendue.plot.scene_picture import plot_layout
from etendue.scene import Scene, compile_scene
from etendue.tracing.section import Section
from etendue.tracing.trails import near_section, trace_trails
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.image import imread

SCREEN = {"width": 20, "height": 10, "columns": 4, "rows": 2}

LAMP: dict[str, Any] = {
    "name": "lamp",
    "sources": [{"name": "light", "kind": "surface", "shape": {"kind": "rectangle", "width": 1, "height": 1}, "flux": 9,
                 "at": [0, 0, 0.3]}],
    "solids": [
        {"name": "dome", "shape": {"kind": "dome", "radius": 3}, "medium": "silicone"},
        {"name": "chip", "shape": {"kind": "block", "width": 2, "height": 1.5, "depth": 0.8}, "medium": {"index": 2.4}},
        {"name": "sink", "shape": {"kind": "rod", "radius": 4, "height": 2}, "finish": "absorber", "at": [0, 0, -2]},
    ],
    "surfaces": [
        {"name": "reflector", "shape": {"kind": "paraboloid", "focal_length": 3, "radius": 15, "inner_radius": 5},
         "finish": "mirror", "at": [0, 0, -3]},
        {"name": "shade", "shape": {"kind": "cylinder", "radius": 15.5, "height": 18},
         "finish": {"kind": "lambertian", "reflectance": 0.9}},
        {"name": "pane", "shape": {"kind": "disk", "radius": 15}, "finish": "transparent", "at": [0, 0, 17]},
        {"name": "aside", "shape": {"kind": "sphere", "radius": 1}, "finish": "mirror", "at": [9, 9, 5]},
    ],
    "detectors": [
        {"name": "rcs", "kind": "rays", "shape": {"kind": "disk", "radius": 12}, "at": [0, 0, 20]},
        {"name": "floor", "kind": "illuminance", "width": 900, "height": 900, "columns": 3, "rows": 3, "at": [0, 0, 3000]},
        {"name": "far", "kind": "intensity"},
    ],
    "observers": [{"name": "eye", "theta": 40, "distance": 900, "screen": SCREEN}],
}  # fmt: skip

LENGTHS = {"radius", "inner_radius", "width", "height", "depth", "focal_length", "distance", "at"}


def scaled(part: Any, factor: float, key: str = "") -> Any:
    """A scene so many times larger."""
    if isinstance(part, dict):
        return {name: scaled(held, factor, name) for name, held in part.items()}
    if isinstance(part, list):
        return [scaled(held, factor, key) for held in part]
    return part * factor if key in LENGTHS else part


def solids_only() -> Scene:
    return Scene(solids=LAMP["solids"])


# --- what is shown ---------------------------------------------------------------------------------------------------


def test_every_face_that_a_section_cuts_is_there_and_what_is_not_is_told() -> None:
    layout = lay_out_scene(Scene(**LAMP))
    expected = {
        "dome.dome", "dome.base", "chip.top", "chip.bottom", "sink.side", "sink.top", "sink.bottom", "reflector", "shade",
        "pane",
    }  # fmt: skip
    across_x = {face.name for face in layout.views[0].faces}
    assert across_x == expected | {"chip.left", "chip.right"}
    assert {face.name for face in layout.views[1].faces} == expected | {"chip.front", "chip.back"}
    assert layout.uncut == ("aside",)
    assert layout.beyond == ("floor",)
    assert [part.name for part in layout.views[0].detectors] == ["rcs"]
    (glow,) = layout.views[0].sources
    np.testing.assert_allclose(sorted(glow.curves[0][:, 0]), [-0.5, 0.5])


def test_facts_are_plain_data() -> None:
    facts = lay_out_scene(Scene(**LAMP), "y=0", rays=7).to_dict()
    assert facts["bounds"] == {"x": [-15.5, 15.5], "y": [-15.5, 15.5], "z": [-2, 18]}
    assert facts["surfaces"] == ["reflector", "shade", "pane", "aside"]
    assert facts["media"] == {"air": 1, "silicone": 1.42, "chip.medium": 2.4}
    (section,) = facts["sections"]
    assert (section["plane"], section["across"], section["up"], section["rays"]) == ("y=0", "x", "z", 7)


def test_finishes_are_told_by_what_they_mostly_do() -> None:
    kinds = {face.name: face.kind for face in lay_out_scene(Scene(**LAMP)).views[0].faces}
    assert kinds["dome.dome"] == "interface"
    assert kinds["sink.top"] == "absorber"
    assert kinds["reflector"] == "mirror"
    assert kinds["shade"] == "diffuse"
    assert kinds["pane"] == "transparent"
    assert set(kinds.values()) == set(FINISH_KINDS) == set(FINISH_LINES)


def test_the_legend_names_solids_media_indices_and_finishes() -> None:
    texts = [text for _, text in legend_handles(lay_out_scene(Scene(**LAMP)))]
    assert texts[:3] == ["dome: silicone, n = 1.42", "chip: n = 2.4", "sink: opaque"]
    assert texts[3:] == [*FINISH_KINDS, "source", "ray", "detector"]
    assert [t for _, t in legend_handles(lay_out_scene(Scene(surroundings="water")))] == [
        "surroundings: water, n = 1.334"
    ]


def test_a_plane_without_an_end_widens_the_frame_if_it_is_near() -> None:
    def window(height: float) -> tuple[float, float, float, float]:
        ceiling = {"name": "ceiling", "shape": {"kind": "plane"}, "finish": "absorber", "at": [0, 0, height]}
        layout = lay_out_scene(Scene(solids=LAMP["solids"], surfaces=[ceiling]), "y=0", rays=0)
        assert ("ceiling" in layout.uncut) == (height > 100)
        return layout.views[0].window

    assert window(1000) == lay_out_scene(solids_only(), "y=0", rays=0).views[0].window
    assert window(6)[3] > 6 > window(1000)[3]


# --- to scale --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("section", [["y=0", "x=0"], ["z=0.4"], ["y=0.2", "z=0.4", "x=0"]])
@pytest.mark.parametrize("scene", [LAMP, {"sources": LAMP["sources"]}, {"solids": LAMP["solids"][:1]}, {}])
def test_a_millimetre_is_as_long_in_all_directions(scene: dict[str, Any], section: list[str]) -> None:
    layout = lay_out_scene(Scene(**scene), section, rays=3)
    figure = plot_layout(layout)
    scales = []
    for axes, view in zip(figure.axes, layout.views, strict=True):
        left, right, bottom, top = view.window
        assert (axes.get_xlim(), axes.get_ylim()) == ((left, right), (bottom, top))
        box = axes.get_window_extent()
        scales += [box.width / (right - left), box.height / (top - bottom)]
        assert (axes.get_xlabel(), axes.get_ylabel() or view.section.up + " [mm]") == (
            f"{view.section.across} [mm]",
            f"{view.section.up} [mm]",
        )
    assert max(scales) == pytest.approx(min(scales), rel=1e-9)
    size = figure.get_size_inches()
    assert (size < (11, 11)).all()


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_drawings_of_small_and_large_scenes_are_alike(factor: float) -> None:
    here, there = (lay_out_scene(Scene(**scaled(LAMP, f))) for f in (1.0, factor))
    for a, b in zip(here.views, there.views, strict=True):
        np.testing.assert_allclose(np.array(b.window) / factor, a.window, rtol=1e-9)
        assert [face.name for face in a.faces] == [face.name for face in b.faces]
        assert [len(face.curves) for face in a.faces] == [len(face.curves) for face in b.faces]
        for p, q in zip(a.trails, b.trails, strict=True):
            np.testing.assert_allclose(q / factor, p, atol=1e-6)
    plot_layout(there)


def test_the_window_is_what_is_shown() -> None:
    layout = lay_out_scene(Scene(**LAMP), "y=0", window=(-4, 4, -1, 4))
    assert layout.views[0].window == (-4, 4, -1, 4)
    assert "reflector" not in {face.name for face in layout.views[0].faces}
    assert layout.beyond == ("rcs", "floor")
    assert "mirror" not in {text for _, text in legend_handles(layout)}


def test_what_lies_above_covers_what_lies_below(tmp_path: Path) -> None:
    """Of nested solids the later one fills the space, in the picture as for the tracer: the colour of every point."""
    layout = lay_out_scene(solids_only(), "y=0", rays=0)
    figure = plot_layout(layout, tmp_path / "nested.png")
    picture = imread(tmp_path / "nested.png")
    axes = figure.axes[0]
    for point, colour in (
        ((0.0, 0.5), FILLS[1]),
        ((0.0, 2.0), FILLS[0]),
        ((2.5, 0.6), FILLS[0]),
        ((3.5, 2.5), "#ffffff"),
    ):
        x, y = axes.transData.transform(point) * (200 / figure.dpi)
        seen = picture[picture.shape[0] - 1 - int(y), int(x), :3]
        np.testing.assert_allclose(seen, to_rgb(colour), atol=1 / 128)


def test_a_hole_is_not_filled(tmp_path: Path) -> None:
    ring = {"name": "ring", "shape": {"kind": "torus", "major_radius": 8, "minor_radius": 2}, "medium": "BK7"}
    figure = et.draw_scene(Scene(solids=[ring]), tmp_path / "ring.png", section="z=0", rays=0)
    picture = imread(tmp_path / "ring.png")
    for x, colour in ((0.0, "#ffffff"), (9.0, FILLS[0])):
        column, row = figure.axes[0].transData.transform((x, 0.0))
        np.testing.assert_allclose(
            picture[picture.shape[0] - 1 - int(row), int(column), :3], to_rgb(colour), atol=1 / 128
        )


# --- rays ------------------------------------------------------------------------------------------------------------


def test_rays_are_cut_at_the_frame() -> None:
    layout = lay_out_scene(Scene(**LAMP), "y=0", rays=40)
    axes = plot_layout(layout).axes[0]
    left, right, bottom, top = layout.views[0].window
    drawn = [c for c in axes.collections if isinstance(c, LineCollection) and c.get_zorder() == 4.0]
    (rays,) = drawn
    points = np.concatenate(rays.get_segments())
    assert len(points) > 80
    slack = 1e-9 * (right - left)
    assert (points >= (left - slack, bottom - slack)).all()
    assert (points <= (right + slack, top + slack)).all()
    assert rays.get_colors()[:, :3] == pytest.approx(np.tile(to_rgb(RAY), (len(points) // 2, 1)))


def test_trails_are_those_of_the_trace() -> None:
    """A beam onto a flat mirror, tilted by 22.5°: every trail turns by 45° where it meets the mirror's plane."""
    turned = [math.sin(math.radians(22.5)), 0, -math.cos(math.radians(22.5))]
    scene = Scene(
        sources=[{"kind": "beam", "shape": {"kind": "disk", "radius": 2}, "flux": 1}],
        surfaces=[{"shape": {"kind": "disk", "radius": 9}, "finish": "mirror", "at": [0, 0, 5], "toward": turned}],
    )
    trails = trace_trails(compile_scene(scene), 50, 3, 100.0)
    assert len(trails) == 50
    for start, turn, end in trails:
        assert start[:2] == pytest.approx(turn[:2])
        assert (turn - (0, 0, 5)) @ turned == pytest.approx(0, abs=1e-12)
        assert (end - turn) / 100 == pytest.approx([math.sqrt(0.5), 0, -math.sqrt(0.5)])


def test_rays_are_chosen_by_their_beginning_alone() -> None:
    rng = np.random.default_rng(5)
    trails = list(rng.normal(size=(500, 3, 3)).cumsum(axis=1))
    chosen = near_section(trails, Section("y", 0.0), 20, 1.0)
    other_ends = near_section([t[:2] for t in trails], Section("y", 0.0), 20, 1.0)
    assert all((a[:2] == b).all() for a, b in zip(chosen, other_ends, strict=True))
    assert np.median([abs(t[0, 1]) for t in chosen]) < np.median([abs(t[0, 1]) for t in trails]) / 3


def test_rays_of_sources_in_the_section_come_first() -> None:
    beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1}
    layout = lay_out_scene(Scene(sources=[{**beam, "at": [0, 40, 0]}, beam]), rays=20)
    for view, reach in zip(layout.views, (0.2, 41), strict=True):
        assert len(view.trails) == 20
        assert max(abs(trail[0, 1]) for trail in view.trails) < reach
    assert [glow.near for glow in layout.views[0].sources] == [False, True]


def test_a_white_sphere_does_not_become_a_tangle() -> None:
    sphere = {"shape": {"kind": "sphere", "radius": 10}, "finish": {"kind": "lambertian", "reflectance": 0.999}}
    figure = et.draw_scene(Scene(sources=[{"kind": "point", "flux": 1}], surfaces=[sphere]), section="y=0", rays=30)
    (rays,) = (c for c in figure.axes[0].collections if isinstance(c, LineCollection) and c.get_zorder() == 4.0)
    assert 30 <= len(rays.get_segments()) < 30 * 8


# --- names -----------------------------------------------------------------------------------------------------------


def test_names_stand_side_by_side_in_the_frame() -> None:
    rng = np.random.default_rng(11)
    placer = LabelPlacer(4.0, 3.0, 7.5)
    boxes = []
    for number in range(12):
        curve = rng.uniform(0, (4, 3), (2, 2))
        placer.draw(curve)
        text = f"thing {number}"
        label = placer.place(text, [curve])
        assert label is not None
        half = np.array([len(text) * WIDTH, HEIGHT]) * 7.5 / 72 / 2
        boxes.append((np.array([label.x, label.y]) - half, np.array([label.x, label.y]) + half))
    for low, high in boxes:
        assert (low > 0).all()
        assert (high < (4, 3)).all()
    for (low, high), (left, right) in itertools.combinations(boxes, 2):
        assert not ((low < right).all() and (left < high).all())
    assert placer.place("outside", [np.array([[5.0, 1], [6, 1]])]) is None


@pytest.mark.slow
def test_many_things_do_not_get_a_name_each() -> None:
    rows = [{"shape": {"kind": "disk", "radius": 1}, "finish": "mirror", "at": [3 * i, 0, 0]} for i in range(60)]
    figure = et.draw_scene(Scene(surfaces=rows), rays=0, section="y=0")
    assert 1 <= len(figure.axes[0].texts) <= MOST_LABELS


# --- files and mistakes ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("extension", [".png", ".pdf", ".PNG"])
def test_the_same_scene_gives_the_same_bytes(tmp_path: Path, extension: str) -> None:
    paths = [tmp_path / f"{name}{extension}" for name in "ab"]
    for path in paths:
        et.draw_scene(Scene(**LAMP), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[0].stat().st_size > 10_000


def test_scenes_of_nothing_much_are_drawn() -> None:
    lone = {"observers": [{"distance": 10, "screen": SCREEN, "target": [5, 5, 5]}]}
    plane = {"surfaces": [{"shape": {"kind": "plane"}, "finish": "mirror"}]}
    for scene in ({}, lone, plane, {"detectors": LAMP["detectors"]}):
        figure = et.draw_scene(Scene(**scene), title="little")
        assert "little" in {text.get_text() for text in figure.texts}
        for axes in figure.axes:
            assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all()


def test_every_mistake_of_the_scene_is_told() -> None:
    wrong = copy.deepcopy(LAMP)
    wrong["solids"][0]["medium"] = "silicon"
    wrong["surfaces"][0]["finish"] = "miror"
    with pytest.raises(SceneError, match=r"(?s)2 mistakes.*Did you mean 'silicone'.*Did you mean 'mirror'"):
        et.draw_scene(Scene(**wrong))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"section": "x:0"}, "section 'x:0': give the plane"),
        ({"section": []}, "0 sections"),
        ({"section": ["y=0"] * 4}, "4 sections"),
        ({"rays": -1}, "rays is -1"),
        ({"rays": 1001}, "rays is 1001"),
        ({"rays": 2.5}, "rays is 2.5"),
        ({"rays": True}, "rays is True"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 1 << 64}, "seed is 18446744073709551616"),
        ({"window": (0, 0, 1, 2)}, "window is"),
        ({"window": (0, 1, 2)}, "window is"),
        ({"window": (0, math.nan, 1, 2)}, "window is"),
    ],
)
def test_arguments_out_of_their_domain_are_refused(arguments: dict[str, Any], told: str) -> None:
    with pytest.raises(ArgumentError, match=told):
        et.draw_scene(Scene(), **arguments)


def test_other_pictures_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"\.png"):
        et.draw_scene(Scene(), tmp_path / "scene.gif")
    assert not list(tmp_path.iterdir())
