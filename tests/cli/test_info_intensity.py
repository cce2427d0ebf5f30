"""``etendue info`` of intensity files: the figures of `etendue intensity`, and every complaint."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import etendue as et
import pytest
from etendue.cli import main
from oracles.intensity import lid
from oracles.luminaire_files import emitter, gldf_of, tm33


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
    assert out.count(f"flux {led.flux:.6g} lm, symmetry none") == 2
    assert "photometry p of the container" in out
    assert "there are 2 of this emitter" in out
    facts = json.loads(run("--json", "a.ies", "c.xml"))
    assert facts[0]["flux"] == pytest.approx(led.flux, rel=1e-5)
    assert "there are 2 of this emitter" in facts[1]["complaints"][0]["found"]
