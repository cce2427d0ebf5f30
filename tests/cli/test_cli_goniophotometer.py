"""The verb `goniophotometer`: what it says, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import etendue as et
import pytest
from etendue.quantities.measured import measured

from cli.outcome import Run

LAMP = """
name = "a die and its glow"
[[sources]]
kind = "surface"
shape = { kind = "rectangle", width = 1.0, height = 0.6 }
at = [0.2, 0.1, 0.0]
flux = 100
[[sources]]
kind = "surface"
shape = { kind = "disk", radius = 2.5 }
flux = 10
"""


@pytest.mark.slow
def test_a_scene_is_measured_and_becomes_rays_a_table_a_picture_and_a_file(run: Run) -> None:
    Path("lamp.toml").write_text(LAMP)
    settings = ("--camera-pixels", "32", "--positions", "30", "--exposures", "3", "--samples", "16")
    outputs = ("-o", "lamp.tm25ray", "-o", "lamp.ies", "-o", "lamp.png", "-o", "lamp.h5")
    told = run("goniophotometer", "lamp.toml", *settings, *outputs, "--rays", "2e4", "--json")
    assert told.status == 0, told.err
    facts = json.loads(told.out)
    assert facts["positions"] == 62
    assert abs(facts["total_flux"] - 110) < 5 * facts["total_flux_error"]
    assert et.read_rays("lamp.tm25ray").total_flux == pytest.approx(facts["total_flux"], rel=1e-6)
    assert et.read_intensity("lamp.ies").flux == pytest.approx(facts["total_flux"], rel=0.03)
    assert Path("lamp.png").stat().st_size > 10_000
    # The file holds all of it: other rays, without another measurement.
    again = run(
        "goniophotometer", "lamp.h5", "-o", "lamp.ray", "--format", "lighttools", "-n", "1000", "--surface", "box"
    )
    assert again.status == 0, again.err
    assert "note: rays start on box:" in again.err
    total = measured(facts["total_flux"], facts["total_flux_error"], facts["flux_unit"])
    assert f"total flux {total} by the photometer" in again.out
    assert len(et.read_rays("lamp.ray")) == 1000
    # Settings of the instrument would change nothing of it.
    late = run(
        "goniophotometer", "lamp.h5", "--exposures", "4", "--positions", "10", "--samples", "9", "-o", "late.ies"
    )
    assert late.status == 2
    assert "--positions, --exposures, --samples: lamp.h5 was measured before" in late.err
    assert not Path("late.ies").exists()


def test_mistakes_are_told_and_nothing_is_written(run: Run) -> None:
    Path("lamp.toml").write_text(LAMP)
    for wrong, told in (
        (("-o", "lamp.xyz"), "none of rays"),
        (("-o", "lamp.ray"), "--format"),
        (("-o", "out/lamp.ies"), "does not exist"),
        (("--positions", "7"), "whole number of steps"),
        (("--surface", "sphare", "-o", "lamp.tm25ray"), "sphere"),
        (("--centre", "0,0"), "3 numbers"),
        (("--bits", "24"), "bits"),
        (("--seed", "-1"), "--seed"),
        (("--exposure", "4"), "--exposures"),
    ):
        found = run("goniophotometer", "lamp.toml", *wrong)
        assert found.status in {1, 2}
        assert told in found.err, found.err
    assert sorted(p.name for p in Path().iterdir()) == ["lamp.toml"]
