"""``etendue patches``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np

from cli.outcome import Run


def rays_aslant(n: int) -> tuple[Any, Any]:
    """From 1.9 × 1.1 mm about (0.31, −0.17)."""
    rng = np.random.default_rng(1)
    position = np.column_stack([rng.uniform(-0.64, 1.26, n), rng.uniform(-0.72, 0.38, n), np.zeros(n)])
    direction = rng.normal([0.2, -0.1, 1.5], 0.3, (n, 3))
    direction[:, 2] = np.abs(direction[:, 2]) + 0.1
    return position, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def test_squares_and_steps_are_as_stated(run: Run, tmp_path: Path) -> None:
    position, direction = rays_aslant(2000)
    et.write_rays(tmp_path / "a.tm25ray", et.RaySet(position, direction, np.ones(2000)))
    options = ["--pixel", 0.7, "--centre-on", "pixel", "--coarsest", "10,40", "--finest", "5,20"]
    facts = run("patches", "a.tm25ray", "-o", "folder", *options, "--json").json
    manifest = json.loads((tmp_path / "folder" / "manifest.json").read_text())
    assert facts["centre_on"] == manifest["centre_on"] == "pixel"
    expected = et.GriddedSource.fit(
        et.read_rays(tmp_path / "a.tm25ray"), et.Plane(z=0), 0.7, centre_on="pixel", coarsest_bins=(10, 40),
        finest_bins=(5, 20),
    )  # fmt: skip
    assert facts["patches"] == len(expected.patches)
    wrong = run("patches", "a.tm25ray", "-o", "other", "--centre-on", "pixle")
    assert wrong.status == 2
    assert "pixel" in wrong.err


def test_the_threshold_that_is_chosen_is_told(run: Run, tmp_path: Path) -> None:
    position, direction = rays_aslant(2000)
    et.write_rays(tmp_path / "a.tm25ray", et.RaySet(position, direction, np.ones(2000)))
    chosen = et.GriddedSource.fit(et.read_rays(tmp_path / "a.tm25ray"), et.Plane(z=0), 0.7).threshold
    assert (
        f"threshold {chosen:g} %, chosen from the number of rays"
        in run("patches", "a.tm25ray", "-o", "chosen", "--pixel", 0.7).out
    )
    assert et.GriddedSource.load(tmp_path / "chosen").threshold == chosen
    assert "chosen" not in "".join(run("patches", "a.tm25ray", "-o", "b", "--threshold", 2, "--json").json["notes"])


def test_rays_drawn_from_patches_tell_each_note_once(run: Run, tmp_path: Path) -> None:
    position, direction = rays_aslant(2000)
    source = et.GriddedSource.fit(et.RaySet(position, direction, np.ones(2000)), et.Plane(z=0), 0.7)
    source.save_patches(tmp_path / "folder")
    told = run("sample", "folder", "-n", 100, "-o", "a.csv", "-o", "b.tm25ray", "--json").json["notes"]
    assert sum(source.flux_note in note for note in told) == 1
    assert any(note.startswith("b.tm25ray: ") for note in told)
