"""The fixtures that the tests of all verbs share."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import etendue as et
import pytest
import typer.main
from etendue.cli import main, verbs
from etendue.lightfield.carrier import Surface
from etendue.quantities.ray_stream import RayStream

from cli.outcome import Outcome, Run

# What the options of all verbs are: found out once, as in a process of the program, and not for each call of a test.
verbs_of = functools.cache(typer.main.get_command)
command_of = functools.cache(verbs.command_of)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run the program in an empty folder, in this process."""
    monkeypatch.setenv("COLUMNS", "300")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(typer.main, "get_command", verbs_of)
    monkeypatch.setattr(verbs, "command_of", command_of)

    def call(*arguments: object) -> Outcome:
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", ["etendue", *map(str, arguments)])
        with pytest.raises(SystemExit) as leaving:
            main()
        out, err = capsys.readouterr()
        return Outcome(int(leaving.value.code or 0), out, err)

    return call


@pytest.fixture
def stand_on(monkeypatch: pytest.MonkeyPatch) -> Callable[[Surface], None]:
    """State a surface for light fields whose surface is left to the search, which takes seconds and is tried elsewhere."""

    def stated(known: Surface) -> None:
        fit = et.LightField.fit

        def fitted(rays: RayStream, surface: Surface | Literal["auto"] = "auto", **options: Any) -> et.LightField:
            return fit(rays, known if surface == "auto" else surface, **options)

        monkeypatch.setattr(et.LightField, "fit", fitted)

    return stated
