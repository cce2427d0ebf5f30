"""``etendue draw``: the picture and the facts of the API, and mistakes told before anything is written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import etendue as et
import pytest
from etendue.plot.scene_layout import lay_out_scene

from cli.outcome import Run

SCENE: dict[str, Any] = {
    "name": "lamp",
    "sources": [{"name": "led", "kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 9}],
    "solids": [{"name": "dome", "shape": {"kind": "dome", "radius": 3}, "medium": "silicone"}],
    "surfaces": [{"name": "wall", "shape": {"kind": "rectangle", "width": 9, "height": 8}, "finish": "mirror",
                  "at": [0, 0, 8]}],
    "detectors": [{"name": "far away", "kind": "illuminance", "width": 90, "height": 90, "columns": 3, "rows": 2,
                   "at": [0, 0, 900]}],
}  # fmt: skip


@pytest.fixture(autouse=True)
def lamp(tmp_path: Path) -> None:
    """The scene, in the folder that the program works in."""
    et.Scene(**SCENE).save(tmp_path / "lamp.toml")


@pytest.mark.slow
def test_the_picture_is_that_of_the_api(run: Run, tmp_path: Path) -> None:
    status, out, _ = run("draw", "lamp.toml", "-o", "a.png", "-o", "a.pdf", "--rays", 9, "--seed", 4)
    assert status == 0
    et.draw_scene(et.Scene(**SCENE), tmp_path / "b.png", rays=9, seed=4)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    assert out.splitlines() == [
        "lamp",
        "  x          -4.5 to 4.5 mm",
        "  y          -4 to 4 mm",
        "  z          0 to 8 mm",
        "  sources    led",
        "  solids     dome",
        "  surfaces   wall",
        "  detectors  far away",
        "  air        n = 1 at 555 nm",
        "  silicone   n = 1.42 at 555 nm",
        "  farther away: far away",
        "  a.png",
        "  a.pdf",
    ]


def test_options_reach_the_api_and_json_tells_all(run: Run) -> None:
    options = ("--section", "z=1", "--section", "y=0.5", "--window=-3,3,-2,4", "--rays", 5)
    status, out, _ = run("draw", "lamp.toml", *options, "--json")
    assert status == 0
    layout = lay_out_scene(et.Scene(**SCENE), ["z=1", "y=0.5"], rays=5, window=(-3, 3, -2, 4))
    assert json.loads(out) == {"file": "lamp.toml", **layout.to_dict(), "outputs": []}
    assert [section["window"] for section in json.loads(out)["sections"]] == [[-3, 3, -2, 4]] * 2


def test_an_empty_scene_has_bounds_that_json_can_tell(run: Run, tmp_path: Path) -> None:
    (tmp_path / "empty.toml").write_text("")
    status, out, _ = run("draw", "empty.toml", "--json", "-o", "empty.png")
    assert status == 0
    assert json.loads(out)["bounds"] == {axis: [None, None] for axis in "xyz"}
    assert run("draw", "empty.toml")[:2] == (0, "scene\n  air        n = 1 at 555 nm\n")


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (("--section", "w=1"), 1, "section 'w=1'"),
        (("--rays", "1001"), 1, "rays is 1001"),
        (("--rays", "many"), 2, "'--rays'"),
        (("--window", "1,2,3"), 2, "give 4 numbers"),
        (("--window", "4,2,0,1"), 1, "left < right"),
        (("--sections", "y=0"), 2, "--section"),
        (("-o", "lamp.bmp"), 1, "'.bmp' is none of the known ones: .png, .svg, .pdf"),
        (("-o", "nowhere/lamp.png"), 1, "the directory nowhere does not exist"),
    ],
)
def test_wrong_options_are_told(run: Run, tmp_path: Path, arguments: tuple[str, ...], status: int, told: str) -> None:
    found, out, err = run("draw", "lamp.toml", "-o", "kept-out.png", *arguments)
    assert found == status
    assert told in err
    assert not out
    assert [path.name for path in tmp_path.iterdir()] == ["lamp.toml"]


def test_all_mistakes_of_the_scene_are_told_before_anything_is_drawn(run: Run, tmp_path: Path) -> None:
    text = (tmp_path / "lamp.toml").read_text().replace('"silicone"', '"silicon"').replace('"mirror"', '"miror"')
    (tmp_path / "wrong.toml").write_text(text)
    status, _, err = run("draw", "wrong.toml", "-o", "wrong.png")
    assert status == 1
    assert "2 mistakes" in err
    assert "Did you mean 'silicone'?" in err
    assert "Did you mean 'mirror'?" in err
    assert not (tmp_path / "wrong.png").exists()
    told = run("info", "wrong.toml")
    assert (told.status, told.out, told.err) == (1, "", err)
