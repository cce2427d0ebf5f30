"""The command line tells the errors of a far field, and what its steps cannot hold; so do the files."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import etendue as et
import pytest
from oracles.beams import beam, rays_of, searchlight

from cli.outcome import Run


@pytest.mark.slow
def test_asked_steps_that_cannot_hold_the_beam_are_told(run: Run, tmp_path: Path) -> None:
    et.write_rays(tmp_path / "spot.tm25ray", rays_of((beam(50_000, exponent=3e3, c=0.0, gamma=0.0, seed=5), 10.0)))
    status, out, _ = run(
        "intensity", "spot.tm25ray", "--gamma-step", 2.5, "--c-planes", 36, "-o", "a.ies", "-o", "a.ldt"
    )
    assert status == 0
    assert "steps too wide for the beam" in out
    assert "steps too wide for the beam" in (tmp_path / "a.ies").read_text("ascii")
    assert "steps too wide" in (tmp_path / "a.ldt").read_text("latin-1")
    far = et.read_intensity(tmp_path / "a.ies")
    assert far.flux == pytest.approx(10.0, rel=1e-5)
    _, out, _ = run("intensity", "spot.tm25ray", "--gamma-step", 0.25, "--c-planes", 4)
    assert "too wide" not in out


def test_a_peak_that_is_lost_nearly_whole_is_told_as_people_write_it() -> None:
    """Of a beam of exponent n in hats of width h about the axis, 1 - 6/(n h²) of the peak is lost: 99.7 %, not 1e+02 %."""
    rays = rays_of((beam(20_000, exponent=3e5, c=0.0, gamma=0.0, seed=5), 10.0))
    told = et.intensity_distribution(rays, 8, 5.0).notes[0]
    lost = 100.0 * (1.0 - 6.0 / (3e5 * math.radians(5.0) ** 2))
    assert f"peak about {lost:.3g} % too low" in told


@pytest.mark.slow
def test_the_program_tells_what_it_traced(run: Run, tmp_path: Path) -> None:
    searchlight(c_planes=36, gamma_step=2.5).save(tmp_path / "light.toml")
    status, out, _ = run("trace", "light.toml", "--rays", "1e5", "-o", "a.ies", "-o", "a.h5")
    assert status == 0
    assert re.search(r"far: flux \d+\.\d+ ± 0\.\d+ lm, peak \d+ ± \d+ cd at C = ", out)
    assert "steps too wide for the beam" in out
    assert "steps too wide for the beam" in (tmp_path / "a.ies").read_text("ascii")
    assert "steps too wide for the beam" in run("info", "a.h5")[1]
    far = json.loads(run("trace", "light.toml", "--rays", "1e5", "--json")[1])["detectors"][0]
    assert 0.0 < far["maximum_error"] < 0.1 * far["maximum"]
    assert 0.0 < far["flux_error"] < 0.01 * far["flux"]
    assert (far["flux_unit"], far["unit"]) == ("lm", "cd")
    assert "too wide" in far["notes"][0]
