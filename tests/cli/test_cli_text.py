"""Texts of files and users on their way to a terminal: shown, never obeyed, and never taken for lines of our own."""

from __future__ import annotations

import io
import json
import re
import warnings
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.cli import terminal
from etendue.errors import SceneError
from etendue.quantities.intensity import Intensity
from etendue.scene import Scene
from rich.console import Console

from cli.outcome import Outcome, Run

HOSTILE = "\x1b[2J\x1b]0;pwn\x07\x9b31m\u202e:smile:[red]\u2028x\x85y\nerror: forged $\\bad$"
SHOWN = "\\x1b[2J\\x1b]0;pwn\\x07\\x9b31m\\u202e:smile:[red]\\u2028x\\x85y\\nerror: forged $\\bad$"

SOURCE = '[[sources]]\nkind = "surface"\nshape = { kind = "disk", radius = 1 }\nflux = 10\n'
FAR = '[[detectors]]\nkind = "intensity"\n'


def assert_harmless(outcome: Outcome, *, shown: bool = True) -> None:
    """Neither stream holds anything but printable lines, none of which the text began; it is shown as it is."""
    for stream in (outcome.out, outcome.err):
        assert re.fullmatch(r"[^\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e]*", stream)
        assert not any(line.startswith("error: forged") for line in stream.splitlines())
    if shown:
        assert SHOWN in outcome.out + outcome.err


def as_toml(text: str) -> str:
    return json.dumps(text)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """Names of everything that a trace speaks of."""
    name = as_toml(HOSTILE)
    path = tmp_path / "scene.toml"
    path.write_text(
        f"name = {name}\n[media.{name}]\nindex = 1.5\nabsorption = 0.1\n"
        f"{SOURCE}name = {name}\n{FAR}name = {name}\n"
        f'[[solids]]\nname = {name}\nshape = {{ kind = "ball", radius = 3 }}\nat = [0, 0, 9]\nmedium = {name}\n',
        encoding="utf-8",
    )
    return path


def test_names_of_a_scene(run: Run, scene: Path) -> None:
    for outcome in (
        run("trace", scene, "--rays", 1000, "-o", "result.h5"),
        run("info", "result.h5"),
    ):
        assert outcome.status == 0, outcome.err
        assert_harmless(outcome)


def test_json_stays_json_and_loses_nothing(run: Run, scene: Path) -> None:
    outcome = run("trace", scene, "--rays", 1000, "--json")
    assert_harmless(outcome, shown=False)
    assert HOSTILE in outcome.json["ledger"]["emitted"]


def test_a_key_of_a_scene(run: Run, tmp_path: Path) -> None:
    (tmp_path / "key.toml").write_text(f"{as_toml(HOSTILE)} = 1\n{as_toml(HOSTILE + '2')} = 2\n{SOURCE}{FAR}")
    outcome = run("trace", "key.toml")
    assert outcome.status == 1
    assert_harmless(outcome)
    # The lines that the message itself has stay lines.
    assert len(outcome.err.splitlines()) == 3


def test_header_of_an_intensity_file(run: Run, tmp_path: Path) -> None:
    lines = ("\x9b31m\x7f\u202e:smile:[red]\u2028error: forged", "TILT=NONE", "1 1 1 2 1 1 2 0 0 0 1 1 10 0 90 0 1 1")
    text = "IESNA:LM-63-2002\n[LUMINAIRE] " + "\n".join(lines) + "\n"
    (tmp_path / "led.ies").write_text(text, encoding="utf-8")
    outcome = run("intensity", "led.ies")
    assert outcome.status == 0, outcome.err
    assert_harmless(outcome, shown=False)
    assert "luminaire: \\x9b31m\\x7f\\u202e:smile:[red]\\u2028error: forged" in outcome.out


@pytest.mark.parametrize("verb", ["info", "luminance", "intensity", "trace", "convert", "fit", "sample"])
def test_name_of_a_file_that_is_not_there_or_no_file(run: Run, verb: str, tmp_path: Path) -> None:
    name = HOSTILE.replace("/", "") + ".ray"
    more = {
        "luminance": ("-o", "map.csv", "--observer", "0,0", "--size", "1,1", "--pixels", "1,1"),
        "convert": ("out.tm25ray",),
        "fit": ("-o", "x.h5"),
        "sample": ("-o", "out.tm25ray", "--rays", 9),
    }.get(verb, ())
    for outcome in (run(verb, name, *more), (tmp_path / name).write_bytes(b"\1\2") and run(verb, name, *more)):
        assert outcome.status in (1, 2)
        assert_harmless(outcome)


@pytest.mark.parametrize(
    "arguments",
    [
        ("luminance", "x", "--observer", HOSTILE),
        ("luminance", "x", f"--{HOSTILE}"),
        ("luminance", "x", "--seed", HOSTILE),
        ("intensity", "x", "--kind", HOSTILE),
        (HOSTILE,),
        ("intensity", "x", "y", HOSTILE),
    ],
)
def test_arguments_of_the_command_line(run: Run, arguments: tuple[str, ...]) -> None:
    outcome = run(*arguments)
    assert outcome.status in (1, 2)
    assert_harmless(outcome, shown=False)
    assert "Error: " in outcome.err


def test_warnings_about_a_scene(run: Run, tmp_path: Path) -> None:
    name = as_toml(HOSTILE)
    ball = f'[[solids]]\nname = {name}\nshape = {{ kind = "ball", radius = 3 }}\nmedium = "BK7"\n'
    (tmp_path / "two.toml").write_text(f"{SOURCE}{FAR}{ball}{ball.replace('forged', 'second')}at = [4, 0, 0]\n")
    outcome = run("trace", "two.toml", "--rays", 100)
    assert "warning" in outcome.err
    assert_harmless(outcome)


def test_notes_of_maps(run: Run, tmp_path: Path) -> None:
    for number, factor in enumerate((1.0, 2.0)):
        lmap = et.LuminanceMap(
            [[factor]], [[0.1]], [[9]], et.Observer(0, 0, 9), et.Screen(1, 1, 1, 1), notes=(HOSTILE,)
        )
        for extension in (".csv", ".npz", ".exr", ".tif", ".hdr"):
            lmap.save(tmp_path / f"{number}{extension}")
            assert et.read_map(tmp_path / f"{number}{extension}").notes == (HOSTILE,)
    stored = (tmp_path / "0.exr").read_bytes()
    assert b"\x1b" not in stored[: stored.index(b"dataWindow")]
    assert_harmless(run("compare", "0.csv", "1.csv"), shown=False)
    assert_harmless(run("compare", "0.csv", "1.csv", "--json"), shown=False)


def test_progress_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(terminal, "errors", Console(file=stream, force_terminal=True, width=200, markup=False))
    with terminal.progress_bar(HOSTILE, 10) as progress:
        assert progress is not None
        progress(5)
    assert SHOWN in stream.getvalue()
    assert "pwn\x07" not in stream.getvalue()


def test_mistakes_of_a_scene_know_their_lines() -> None:
    with pytest.raises(SceneError) as error:
        Scene(**{HOSTILE: 1, "b": 2})
    assert len(error.value.lines) == 3
    assert str(error.value) == "\n  ".join(error.value.lines)


@pytest.mark.slow
@pytest.mark.parametrize("extension", [".png", ".pdf"])
def test_pictures_of_names_that_look_like_formulas(scene: Path, extension: str, tmp_path: Path) -> None:
    """A formula that cannot be set raises ValueError in the drawing library."""
    observer, screen = et.Observer(0, 0, 100), et.Screen(2, 2, 2, 2)
    lmap = et.LuminanceMap(np.ones((2, 2)), np.ones((2, 2)), np.ones((2, 2), int), observer, screen, notes=(HOSTILE,))
    led = Intensity([0], [0, 90], [[1000, 0]], luminaire={"luminaire": HOSTILE})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lmap.plot(tmp_path / f"map{extension}", title=HOSTILE)
        et.plot.plot_intensity(led, tmp_path / f"led{extension}", title=HOSTILE)
        et.plot.draw_scene(Scene.load(scene), tmp_path / f"scene{extension}")
    assert (tmp_path / f"scene{extension}").stat().st_size > 1000


def test_an_error_that_nobody_foresaw(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its traceback is shown line by line, with its cause; what text of a file says in it is not obeyed."""

    def fail(*_: object, **__: object) -> None:
        try:
            {}["\x1b[31m"]
        except KeyError as cause:
            error = RuntimeError(HOSTILE)
            error.add_note(HOSTILE)
            raise error from cause

    monkeypatch.setattr("etendue.cli.sample.LightField.load", fail)
    outcome = run("sample", "x.h5", "-n", 9, "-o", "x.tm25ray")
    assert outcome.status == 70
    assert_harmless(outcome)
    lines = outcome.err.splitlines()
    assert lines.count("Traceback (most recent call last):") == 2
    assert f"RuntimeError: {SHOWN}" in lines
    assert f"  {SHOWN}" in lines
    cause = next(n for n, line in enumerate(lines) if line.startswith("KeyError"))
    assert lines.index(f"RuntimeError: {SHOWN}") > cause
    assert lines[-1].startswith("error: this is a mistake in etendue")
