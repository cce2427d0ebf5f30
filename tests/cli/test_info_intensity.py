"""``etendue info`` of intensity files: the figures of `etendue intensity`, and every complaint."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import etendue as et
import pytest
from etendue.cli import main
from etendue.quantities.powers_of_ten import rounded
from oracles.intensity import lid
from oracles.luminaire_files import archive, emitter, gldf_of, product, tm33

from cli.outcome import Run


def test_intensity_files(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    led = lid("none")
    et.write_intensity("a.ies", led)
    Path("b.gldf").write_bytes(gldf_of(led, tmp_path))
    Path("c.xml").write_bytes(tm33(emitter(h=[0], v=led.gamma, values=led.values[:1], number=2)))

    def run(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["etendue", "info", *arguments])
        with pytest.raises(SystemExit) as leaving:
            main()
        assert not leaving.value.code
        return capsys.readouterr().out

    out = run("a.ies", "b.gldf", "c.xml")
    assert out.count(f"flux {rounded(led.flux)} lm, symmetry none") == 2
    assert "photometry p of the container" in out
    assert "there are 2 of this emitter" in out
    facts = json.loads(run("--json", "a.ies", "c.xml"))
    assert facts[0]["flux"] == pytest.approx(led.flux, rel=1e-5)
    assert "there are 2 of this emitter" in facts[1]["complaints"][0]["found"]


def test_one_of_several_photometries(run: Run) -> None:
    led = lid("none")
    for name, factor in (("p", 1), ("q", 2)):
        et.write_intensity(f"{name}.ies", dataclasses.replace(led, values=factor * led.values))
    files = {f"f-{name}": ("ldc/ies", "localFileName", f"{name}.ies") for name in "pq"}
    members: dict[str, bytes | str] = {f"ldc/{name}.ies": Path(f"{name}.ies").read_bytes() for name in "pq"}
    xml = product(files, {name: f"f-{name}" for name in "pq"})
    Path("two.gldf").write_bytes(archive({"product.xml": xml, **members}))
    (facts,) = run("info", "--json", "--photometry", "q", "two.gldf").json
    assert facts["flux"] == pytest.approx(2 * led.flux, rel=1e-5)
    several = run("info", "two.gldf")
    assert several.status == 1
    assert "--photometry" in several.err
    et.write_rays("led.tm25ray", et.RingSource(rays=100, seed=1))
    refused = run("info", "led.tm25ray", "--photometry", "q")
    assert refused.status == 1
    assert "--photometry is for intensity files" in refused.err


@pytest.mark.parametrize("name", ["lamp.ies", "lamp.ldt"])
def test_a_power_of_0_is_none_that_was_measured(run: Run, name: str) -> None:
    """The files have a place for it that has to be filled."""
    led = lid("none")
    for power, told in ((0.0, "not stated"), (12.5, "12.5 W")):
        et.write_intensity(name, led.replace(luminaire={"input_power": power}))
        assert f"input power: {told}\n" in run("intensity", name).out
        assert run("info", name, "--json").json[0]["luminaire"]["input_power"] == (power or None)
