"""``etendue luminance --orbit``: who looks, on which screen, and what is written."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.plot import animation_files
from PIL import Image

from cli.outcome import Run, files

LAMP = """
name = "lamp"
[[sources]]
kind = "surface"
shape = { kind = "rectangle", width = 3, height = 1 }
at = [0.5, 0, 0]
flux = 100
"""
AROUND = ("--observer", "40,15", "--orbit", 5, "--pixels", "8,6", "--rays-per-pixel", 16)


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    (tmp_path / "lamp.toml").write_text(LAMP, encoding="utf-8")
    return tmp_path / "lamp.toml"


@pytest.mark.slow
def test_observers_go_around_in_even_steps_on_one_screen(run: Run, lamp: Path, tmp_path: Path) -> None:
    outcome = run("luminance", lamp, *AROUND, "-o", "a.gif", "-o", "a.html", "-o", "map-{phi}.npz", "--json")
    assert outcome.status == 0, outcome.err
    names = [f"map-{phi}.npz" for phi in (15, 87, 159, 231, 303)]
    assert files(tmp_path) == sorted(["a.gif", "a.html", "lamp.toml", *names])
    maps = [et.read_map(tmp_path / name) for name in names]
    assert [lmap.observer.phi for lmap in maps] == [15, 87, 159, 231, 303]
    assert {(lmap.observer.theta, lmap.observer.up) for lmap in maps} == {(40.0, (0.0, 0.0, 1.0))}
    assert len({lmap.screen for lmap in maps}) == 1
    alone = et.luminance_map(et.Scene.load(lamp), maps[2].observer, maps[2].screen, rays_per_pixel=16)
    np.testing.assert_array_equal(alone.values, maps[2].values)
    with Image.open(tmp_path / "a.gif") as image:
        assert image.n_frames == 5
    assert outcome.json["moving"] == ["a.gif", "a.html"]
    assert len(outcome.json["maps"]) == 5
    plain = run("luminance", lamp, *AROUND, "-o", "b.gif")
    assert (tmp_path / "b.gif").read_bytes() == (tmp_path / "a.gif").read_bytes()
    assert plain.out.count("16 lines of sight per pixel") == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--observer", "40,0", "-o", "a.gif"], "give --orbit 36"),
        (["--observer", "0,0", "--orbit", "4", "-o", "a.gif"], "all views are of the same side"),
        (["--observer", "40,0", "--observer", "50,0", "--orbit", "4", "-o", "a.gif"], "and 2 are given"),
        (["--observer", "40,0", "--orbit", "1", "-o", "a.gif"], "give 2 to 720 observers"),
        (["--orbit", "4", "-o", "a.gif"], "--observer 30,0"),
        (["--observer", "40,0", "--orbit", "4", "-o", "a.npz"], "put {theta} and {phi}"),
        (["--observer", "40,0", "--orbit", "4", "-o", "nowhere/a.gif"], "does not exist"),
    ],
)
def test_mistakes_are_told(run: Run, lamp: Path, tmp_path: Path, arguments: list[str], told: str) -> None:
    outcome = run("luminance", lamp, *arguments)
    assert outcome.status in (1, 2)
    assert told in outcome.err
    assert files(tmp_path) == ["lamp.toml"]


def test_a_video_without_ffmpeg_is_refused_before_any_work(
    run: Run, lamp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation_files.shutil, "which", lambda _: None)
    outcome = run("luminance", lamp, *AROUND, "-o", "a.mp4")
    assert outcome.status == 1
    assert "ffmpeg is not installed" in outcome.err
    assert ".gif or .html" in outcome.err
    assert files(tmp_path) == ["lamp.toml"]
