"""Outputs that cannot be written take neither the others with them nor what was computed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.cli import trace as trace_verb

from cli.outcome import Run, files

LAMP = """
[[sources]]
kind = "surface"
shape = { kind = "disk", radius = 1 }
flux = 5
"""
DETECTORS = """
[[detectors]]
name = "far"
kind = "intensity"
c_planes = 4
gamma_step = 30
[[detectors]]
name = "desk"
kind = "illuminance"
width = 10
height = 10
columns = 1
rows = 1
at = [0, 0, 9]
toward = [0, 0, -1]
"""
BOX = """
[[surfaces]]
shape = { kind = "sphere", radius = 20 }
finish = "absorber"
"""


@pytest.fixture
def dark(tmp_path: Path) -> Path:
    """No light leaves the scene, and a EULUMDAT file of no light cannot be written: that shows after the trace."""
    (tmp_path / "lamp.toml").write_text(LAMP + BOX + DETECTORS, encoding="utf-8")
    return tmp_path / "lamp.toml"


def test_a_trace_is_not_lost_with_one_of_its_files(run: Run, dark: Path, tmp_path: Path) -> None:
    outputs = ("-o", "far.ldt", "-o", "desk.csv", "-o", "all.h5")
    outcome = run("trace", dark, "--rays", 1000, *outputs)
    assert outcome.status == 1
    assert "far.ldt: not written:" in outcome.err
    assert "flux of 0 lm" in outcome.err
    assert "5 lm" in outcome.out
    assert files(tmp_path) == ["all.h5", "desk.csv", "lamp.toml"]
    found = run("trace", dark, "--rays", 1000, *outputs, "--json")
    assert found.status == 1
    assert found.json["outputs"] == ["all.h5", "desk.csv"]


def test_radiant_intensity_is_refused_before_anything_is_traced(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lamp.toml").write_text(LAMP + 'flux_unit = "W"\n' + DETECTORS, encoding="utf-8")
    rounds = trace_verb.trace_rounds

    class Planned:
        def __init__(self, *arguments: Any, **options: Any) -> None:
            self.plan = rounds(*arguments, **options).plan

        def __iter__(self) -> Iterator[Any]:
            pytest.fail("rays were traced")

    monkeypatch.setattr(trace_verb, "trace_rounds", Planned)
    outcome = run("trace", "lamp.toml", "--rays", 1000, "-o", "far.ldt")
    assert outcome.status == 1
    assert "this is radiant intensity [W/sr]" in outcome.err


def test_a_measurement_is_not_lost_with_one_of_its_files(run: Run, tmp_path: Path) -> None:
    (tmp_path / "lamp.toml").write_text(LAMP + 'flux_unit = "W"\n', encoding="utf-8")
    measured = ("goniophotometer", "lamp.toml", "--positions", "30,90", "--camera-pixels", 8)
    outcome = run(*measured, "-o", "far.ldt", "-o", "all.h5", "--json")
    assert outcome.status == 1
    assert "far.ldt: not written:" in outcome.err
    assert outcome.json["outputs"] == ["all.h5"]
    assert files(tmp_path) == ["all.h5", "lamp.toml"]


def test_other_files_of_an_intensity_are_written(run: Run, tmp_path: Path) -> None:
    et.write_intensity("dark.ies", et.Intensity([0.0], [0.0, 90.0, 180.0], np.zeros((1, 3))))
    outcome = run("intensity", "dark.ies", "-o", "dark.ldt", "-o", "other.ies")
    assert outcome.status == 1
    assert "flux of 0 lm" in outcome.err
    assert files(tmp_path) == ["dark.ies", "other.ies"]
