"""``etendue sweep``: the API's numbers, ranges, files, and what Ctrl-C leaves."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.sweeps import running

from cli.outcome import Run, files

SCENE = """
name = "die"
[[sources]]
name = "die"
kind = "surface"
shape = { kind = "disk", radius = 1 }
flux = 100
[[surfaces]]
name = "screen"
shape = { kind = "disk", radius = 2 }
at = [0, 0, 3]
finish = "absorber"
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "die.toml").write_text(SCENE, encoding="utf-8")
    return tmp_path / "die.toml"


def test_the_numbers_are_those_of_python(run: Run, scene: Path, tmp_path: Path) -> None:
    call = ["sweep", scene, "--set", "screen.at.2=1:3:1", "--measure", "absorbed:screen,escaped", "--measure", "mean"]
    call += ["--observer", "120,0", "--target", "0,0,1", "--size", "5", "--pixels", 8, "--region=-2,2,-2,2"]
    call += ["--rays", "2k", "--rays-per-pixel", 16, "--seed", 5]
    table = et.sweep(
        scene,
        {"screen.at.2": [1, 2, 3]},
        ["absorbed:screen", "escaped", "mean"],
        et.Observer(120, 0, 1000, (0, 0, 1)),
        et.Screen(5, 5, 8, 8),
        region=et.Region(-2, 2, -2, 2),
        rays=2000,
        rays_per_pixel=16,
        seed=5,
    )
    outcome = run(*call, "-o", "a.csv", "-o", "a.png", "--json")
    assert outcome.status == 0, outcome.err
    found = outcome.json
    assert [row["absorbed:screen"] for row in found["rows"]] == table["absorbed:screen"].tolist()
    assert [row["standard error of mean"] for row in found["rows"]] == table.standard_error["mean"].tolist()
    assert (found["steps"], found["done"], found["interrupted"]) == (3, 3, False)
    rows = list(csv.reader((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()))
    assert rows[0] == table.headings()
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float), np.array(list(table.rows())))
    plain = run(*call)
    assert "screen.at.2" in plain.out.splitlines()[0]
    assert f"largest escaped: {table['escaped'].max():.4g} lm at screen.at.2 = 3 mm" in plain.out


def test_ctrl_c_keeps_the_steps_that_are_done(
    run: Run, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    traced: list[Any] = []
    trace = running.trace_rounds

    def stopped(*arguments: Any, **options: Any) -> Iterator[Any]:
        traced.append(arguments)
        if len(traced) == 3:
            raise KeyboardInterrupt
        return trace(*arguments, **options)

    monkeypatch.setattr(running, "trace_rounds", stopped)
    call = ("sweep", scene, "--set", "screen.at.2=1:5:1", "--measure", "escaped", "--rays", 1000, "-o", "a.csv")
    outcome = run(*call, "-o", "a.png")
    assert outcome.status == 130
    assert "2 of 5 steps" in outcome.err
    assert len((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()) == 3
    assert files(tmp_path) == ["a.csv", "a.png", "die.toml"]
    # Before the first step is done there is nothing to keep.
    traced[:] = [None, None]
    outcome = run(*call[:-1], "b.csv")
    assert outcome.status == 130
    assert "b.csv" not in files(tmp_path)


def test_a_picture_without_room_is_refused_before_anything_is_traced(
    run: Run, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def traced(*_: Any, **__: Any) -> Iterator[Any]:
        pytest.fail("a step was made")

    monkeypatch.setattr(running, "trace_rounds", traced)
    three = ["--set", "screen.at.2=1,2", "--set", "die.flux=1,2", "--set", "screen.shape.radius=1,2"]
    many = ["--set", "die.flux=1,2", "--set", "screen.at.2=1:13:1"]
    for settings, told in ((three, "one or two parameters"), (many, "13 lines in a diagram")):
        outcome = run("sweep", scene, *settings, "--measure", "escaped", "-o", "a.csv", "-o", "a.png")
        assert outcome.status == 1
        assert told in outcome.err


def test_a_table_is_kept_where_its_picture_has_no_room(run: Run, scene: Path, tmp_path: Path) -> None:
    """Of one parameter, how many lines a diagram has is known when the units of the measures are."""
    names = [f"wall {i}" for i in range(13)]
    shape = 'shape = { kind = "disk", radius = 2 }\nfinish = "absorber"'
    walls = [f'[[surfaces]]\nname = "{name}"\nat = [0, 0, {4 + i}]\n{shape}' for i, name in enumerate(names)]
    scene.write_text("\n".join([SCENE, *walls]), encoding="utf-8")
    measures = ",".join(f"absorbed:{name}" for name in names)
    call = ("sweep", scene, "--set", "die.flux=1,2", "--measure", measures, "--rays", 100)
    outcome = run(*call, "-o", "a.png", "-o", "a.csv")
    assert outcome.status == 1
    assert "a.png: not written:" in outcome.err
    assert "13 lines in a diagram" in outcome.err
    assert files(tmp_path) == ["a.csv", "die.toml"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--set", "screen.at.2=1:5:0", "--measure", "escaped"], "the step is 0"),
        (["--set", "scren.at.2=1:5:1", "--measure", "escaped"], "Did you mean 'screen'"),
        (["--set", "screen.at.2=1,2", "--set", "screen.at.2=3", "--measure", "escaped"], "is given twice"),
        (["--set", "screen.at.2=1,2", "--measure", "escapd"], "Did you mean 'escaped'"),
        (["--set", "screen.at.2=1,2", "--measure", "mean"], "nobody looks at the scene"),
        (["--set", "screen.at.2=1,2", "--measure", "escaped", "--size", "4"], "screens of their own"),
        (["--set", "screen.at.2=1,2", "--measure", "escaped", "-o", "a.xlsx"], "none of the known ones"),
        (["--set", "screen.at.2=1,2", "--measure", "escaped", "-o", "die.toml"], "also an input"),
        (["--measure", "escaped"], "--set"),
    ],
)
def test_mistakes_are_told(run: Run, scene: Path, arguments: list[str], told: str) -> None:
    outcome = run("sweep", scene, *arguments)
    assert outcome.status in (1, 2)
    assert told in outcome.err
