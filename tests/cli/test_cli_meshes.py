"""The command line on STEP files: bodies are listed, and how far triangles are from surfaces is told."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest
from etendue.scene import Scene
from oracles import step

from cli.outcome import Run

pytestmark = pytest.mark.skipif(importlib.util.find_spec("cascadio") is None, reason="STEP files need the extra [step]")


@pytest.mark.slow
def test_info_lists_bodies(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "optics.step"
    path.write_text(step.optics(), encoding="ascii")
    lines = run("info", str(path)).out.splitlines()
    assert lines[0].endswith("STEP, 4 bodies")
    assert lines[2].split(maxsplit=1) == ["chip", "1 × 1 × 1 mm, volume 1 mm³, 12 triangles, all faces plane"]
    assert "chord error 0.00" in lines[4]
    (facts,) = json.loads(run("info", "--json", str(path)).out)
    assert [body["name"] for body in facts["bodies"]] == ["block", "chip", "twin", "lens"]


def test_the_chord_error_is_printed(run: Run, tmp_path: Path) -> None:
    (tmp_path / "ball.step").write_text(step.sphere(10.0), encoding="ascii")
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 3}, "flux": 7, "at": [0, 0, -15]}
    ball = {"shape": {"kind": "mesh", "file": "ball.step", "tolerance": 0.1}, "medium": "BK7"}
    Scene.from_dict({"sources": [lamp], "solids": [ball]}, folder=tmp_path).save(tmp_path / "scene.toml")
    scene = str(tmp_path / "scene.toml")
    view = ["--observer", "20,0", "--distance", "99", "--size", "22,22", "--pixels", "4,4", "-o", "map.npz"]
    for words in (["trace", scene, "--rays", "1000"], ["luminance", scene, *view]):
        done = run(*words)
        assert done.status == 0, done.err
        assert "(chord error)" in " ".join((done.out + done.err).split())
