"""Sizes that nobody means are refused by the command line, with the size and what to do, before anything is set aside."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import etendue as et
import pytest
from etendue.cli.terminal import count
from etendue.lightfield.carrier import Disk
from oracles.light_fields import SURFACES, make_field

from cli.outcome import Run

LAMP = {"name": "lamp", "kind": "surface", "shape": {"kind": "disk", "radius": 3}, "flux": 100}
GRID = {"name": "desk", "kind": "illuminance", "width": 9, "height": 9, "columns": 2, "rows": 77, "at": [0, 0, 50]}

ABSURD: dict[str, tuple[str, tuple[object, ...]]] = {
    "pixels": ("Screen: columns is 1000000", ("luminance", "lamp.toml", "--pixels", "1000000,1000000", "-o", "a.npz")),
    "samples": ("samples is 1000000000", ("luminance", "led.h5", "--pixels", "2,2", "--samples", 10**9, "-o", "a.npz")),
    "lines": (
        "--rays-per-pixel is",
        ("luminance", "lamp.toml", "--pixels", "2,2", "--rays-per-pixel", 10**12, "-o", "a.npz"),
    ),
    "planes": ("--c-planes is 1000000000", ("intensity", "led.tm25ray", "--c-planes", 10**9, "-o", "a.ies")),
    "steps": ("180,000,001 cells", ("intensity", "led.tm25ray", "--gamma-step", "1e-6", "-o", "a.ies")),
    "rows": ('"desk": rows: is 1000000000', ("trace", "rows.toml", "--rays", 1000)),
    "rays": ("rays is 1000000000000000000", ("trace", "lamp.toml", "--rays", "1e18")),
    "sample": ("a.ray: cannot write: 280,000,000,000,000 bytes", ("sample", "led.h5", "-n", "1e13", "-o", "a.ray")),
    "pixel": (
        "more than 67,108,864 pixels",
        ("patches", "led.tm25ray", "--surface", "disk:radius=9", "--pixel", "1e-6", "-o", "a"),
    ),
}  # fmt: skip


@pytest.mark.slow
def test_absurd_sizes_are_refused_with_the_size(run: Run, tmp_path: Path) -> None:
    et.write_rays(tmp_path / "led.tm25ray", et.RingSource(rays=5000, seed=2))
    et.LightField.fit(et.RingSource(rays=5000, seed=2), Disk(radius=30), depths=(2, 2, 2, 2)).save(tmp_path / "led.h5")
    et.Scene(sources=[LAMP]).save(tmp_path / "lamp.toml")
    rows = et.Scene(sources=[LAMP], detectors=[GRID]).to_toml(tmp_path)
    (tmp_path / "rows.toml").write_text(rows.replace("rows = 77", f"rows = {10**9}"))
    before = sorted(path.name for path in tmp_path.iterdir())
    look = ("--observer", "0,0", "--distance", "200", "--size", "60,60")
    for name, (expected, arguments) in ABSURD.items():
        more = look if arguments[0] == "luminance" else ("--format", "lighttools") if name == "sample" else ()
        tracemalloc.start()
        status, _, err = run(*arguments, *more)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert (status, expected in err) == (1, True), (name, err)
        assert peak < 50e6, (name, peak)
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_every_count_of_rays_may_be_a_power_of_ten(run: Run, tmp_path: Path) -> None:
    """And digits stay exact where a float would round."""
    rays = et.RingSource(rays=5000, seed=2)
    et.write_rays(tmp_path / "led.tm25ray", rays)
    et.LightField.fit(rays, Disk(radius=30), depths=(2, 2, 2, 2)).save(tmp_path / "led.h5")
    et.Scene(sources=[LAMP]).save(tmp_path / "lamp.toml")
    for words in (
        ("sample", "led.h5", "-n", "2e3", "-o", "a.tm25ray"),
        ("convert", "led.tm25ray", "b.tm25ray", "--subset", "2e3"),
        ("trace", "lamp.toml", "--rays", "2e3"),
    ):
        outcome = run(*words)
        assert outcome.status == 0, outcome.err
        assert "2,000 rays" in outcome.out
    view = ("--observer", "0,0", "--distance", "200", "--size", "6,6", "--pixels", "1,1", "-o", "a.npz")
    assert run("luminance", "lamp.toml", *view, "--rays-per-pixel", "2e1").status == 0
    assert count()(str(2**53 + 1)) == 2**53 + 1


def test_more_rays_than_one_of_the_formats_holds_are_refused_before_any_is_written(run: Run, tmp_path: Path) -> None:
    make_field(SURFACES["plane"]).save(tmp_path / "led.h5")
    refused = run("sample", "led.h5", "-n", "2147483648", "-o", "a.csv", "-o", "a.dis")
    assert refused.status == 1
    assert "a.dis: 2,147,483,648 rays" in refused.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["led.h5"]
