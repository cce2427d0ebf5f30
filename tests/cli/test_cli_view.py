"""``etendue view``: pages, what is refused, and how it serves."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import etendue as et
import pytest
from etendue.lightfield.carrier import Surface
from viewer.viewables import make_files

from cli.outcome import Run


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """One of each kind, where the program runs."""
    return make_files(tmp_path)


@pytest.mark.slow
def test_the_verb_writes_a_page_and_says_how_exact_it_is(run: Run, files: Path) -> None:
    outcome = run("view", files / "lamp.h5", "-o", "lamp.html", "--title", "A <lamp>", "--json")
    assert outcome.status == 0, outcome.err
    assert outcome.json["bound"] == pytest.approx(0.002, rel=0.01)
    assert outcome.json["bytes"] == (files / "lamp.html").stat().st_size
    assert "A &lt;lamp&gt; – étendue" in (files / "lamp.html").read_text("utf-8")
    outcome = run("view", files / "map.exr", "-o", "map.html")
    assert outcome.out.startswith("map.html: ")
    assert "single precision" in outcome.out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "options", "flux"),
    [("rings.tm25ray", ["--flux", "300"], 300.0), ("trace.h5", ["--detector", "disk"], 100.0)],
)
def test_the_command_of_the_page_has_the_options_of_the_page(
    run: Run, files: Path, stand_on: Callable[[Surface], None], file: str, options: list[str], flux: float
) -> None:
    """The map that the command makes is one of the light that the page shows: as much flux, of the same detector."""
    stand_on(et.Plane(z=0.5, width=80, height=80, centre=(0, 0), focus=(0, 0, 0, 0)))
    assert run("view", files / file, "-o", "a.html", *options).status == 0
    page = (files / "a.html").read_text("utf-8")
    spelled = re.search(r'"options":"([^"]*) "', page)[1].split(" ")  # type: ignore[index]
    assert spelled == ["--method", "lightfield", *options]
    view = ["--observer=0,0", "--distance", 1000, "--size", "80,80", "--pixels", "8,8", "--json"]
    assert run("luminance", files / file, *spelled, *view, "-o", "map.npz").status == 0
    # Lambertian sources seen along their axis: π I is the flux, of few rays.
    assert et.read_map(files / "map.npz").intensity * math.pi == pytest.approx(flux, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("lamp.h5", "-o", "lamp.png"), ".html"),
        (("lamp.h5", "-o", "nowhere/lamp.html"), "nowhere"),
        (("lamp.h5", "-o", "lamp.h5"), "also an input"),
        (("map.exr", "-o", "a.html", "--flux", "3"), "--flux"),
        (("map.exr", "-o", "a.html", "--unit", "W"), "--unit"),
        (("map.exr", "-o", "a.html", "--rays", "10"), "scenes"),
        (("notes.txt", "-o", "a.html"), "notes.txt"),
        (("trace.h5", "-o", "a.html"), "card, disk"),
    ],
)
def test_the_verb_refuses_and_leaves_nothing(run: Run, files: Path, arguments: tuple[str, ...], words: str) -> None:
    before = {path.name: path.read_bytes() for path in files.iterdir()}
    outcome = run("view", *arguments)
    assert outcome.status in {1, 2}
    assert words in outcome.err + outcome.out
    assert {path.name: path.read_bytes() for path in files.iterdir()} == before


def test_without_an_output_it_serves_until_it_is_stopped(
    run: Run, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The address is told and opened; Ctrl-C is how it ends, and no error."""
    opened: list[str] = []

    def stopped(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("etendue.viewer.server.ViewerServer.serve_forever", stopped)
    outcome = run("view", files / "map.exr")
    assert outcome.status == 0
    assert opened == [outcome.out.split(" ")[0]]
    assert opened[0].startswith("http://127.0.0.1:")
    assert run("view", files / "map.exr", "--no-browser").status == 0
    assert len(opened) == 1
