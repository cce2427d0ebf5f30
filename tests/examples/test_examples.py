"""Every example runs, with few rays, and writes the pictures it promises."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from oracles.examples import EXAMPLES, run_example

RUNS = {
    "appendix_b.py": (["--rays", "2000"], 7),
    "chapter_2.py": (["--rays", "50000", "--seeds", "2"], 4),
    "chapter_2_details.py": ([], 2),
    "chapter_3_drawings.py": ([], 4),
    "chapter_4.py": (["--lines", "1", "--rays", "500"], 6),
    "chapter_5.py": ([], 4),
    "chapter_5_luminaire.py": ([], 2),
    "chapter_5_round_robin.py": ([], 1),
    "chapter_5_scan_time.py": ([], 1),
    "collimator.py": ([], 1),
    "deconvolution_2d.py": ([], 2),
    "dome_led.py": (["--rays", "3000"], 3),
    "error_bars.py": ([], 1),
    "first_picture.py": (["--rays", "100000", "--output", "picture.png"], 1),
    "half_against_half.py": ([], 1),
    "how_many_rays.py": ([], 1),
    "ies_round_trip.py": ([], 1),
    "integrating_sphere.py": ([], 1),
    "light_guide.py": ([], 1),
    "many_observers.py": ([], 1),
    "many_rays.py": (["--rays", "500"], 3),
    "narrow_beam.py": (["--rays", "1000", "--pixels", "4"], 3),
    "near_field.py": ([], 4),
    "opal_diffuser.py": ([], 1),
    "prism.py": ([], 1),
    "radiance_mitsuba.py": ([], 1),
    "ray_file_audit.py": ([], 1),
    "reflector_spot.py": ([], 1),
    "remote_phosphor.py": (["--rays", "4000", "--lines", "1", "--pixel", "4.6"], 3),
    "rings_traced.py": (["--rays", "5000"], 1),
    "sweep.py": ([], 1),
    "threshold_sweep.py": (["--rays", "5000"], 1),
    "white_led.py": ([], 1),
}


def test_every_example_is_run() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(RUNS)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(RUNS))
def test_runs_and_draws(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options, pictures = RUNS[name]
    monkeypatch.chdir(tmp_path)
    printed = run_example(name, options)
    drawn = list(tmp_path.rglob("*.png"))
    assert len(drawn) == pictures
    assert all(path.stat().st_size > 5000 for path in drawn)
    assert printed.count("\n") >= 3


@pytest.mark.slow
def test_an_example_runs_here_as_one_that_is_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Words and pictures, to the byte: the others do not start a process each."""
    here, apart = tmp_path / "here", tmp_path / "apart"
    here.mkdir()
    apart.mkdir()
    name, (options, _) = "first_picture.py", RUNS["first_picture.py"]
    monkeypatch.chdir(here)
    printed = run_example(name, options)
    command = [sys.executable, str(EXAMPLES / name), *options]
    result = subprocess.run(command, cwd=apart, capture_output=True, text=True, check=True)
    assert (printed, "") == (result.stdout, result.stderr)
    assert (here / "picture.png").read_bytes() == (apart / "picture.png").read_bytes()
