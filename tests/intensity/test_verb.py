"""``etendue intensity``: the numbers of the API, and nothing left behind by a failure."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.cli import main
from etendue.quantities.measured import measured_peak
from oracles.intensity import lid
from oracles.luminaire_files import archive, ies_of, product, tm33_of

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Run the program in an empty folder: exit status, standard output, standard error."""
    monkeypatch.setenv("COLUMNS", "300")
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", ["etendue", "intensity", *map(str, arguments)])
        with pytest.raises(SystemExit) as leaving:
            main()
        return int(leaving.value.code or 0), *capsys.readouterr()

    return call


@pytest.fixture
def led(tmp_path: Path) -> et.RaySet:
    rng = np.random.default_rng(4)
    direction = rng.normal(size=(30_000, 3)) + np.array([0.5, 0.3, 1.5])
    rays = et.RaySet(rng.normal(size=(30_000, 3)), direction, rng.random(30_000))
    et.write_rays(tmp_path / "led.tm25ray", rays)
    return et.read_rays(tmp_path / "led.tm25ray")


@pytest.mark.slow
def test_rays_to_files_and_pictures(run: Run, led: et.RaySet, tmp_path: Path) -> None:
    outputs = ["a.ies", "a.ldt", "a.png", "a.pdf"]
    options = [part for name in outputs for part in ("-o", name)]
    status, out, err = run("led.tm25ray", *options, "--c-planes", 12, "--gamma-step", 10, "--json")
    facts = json.loads(out)
    expected = et.intensity_distribution(led, 12, 10)
    assert (status, err) == (0, "")
    assert facts["flux"] == expected.flux
    assert facts["maximum"] == expected.maximum
    assert (facts["planes"], facts["gammas"], facts["unit"], facts["outputs"]) == (12, 19, "cd", outputs)
    assert any("standard errors" in note for note in facts["losses"])
    for name in ("a.ies", "a.ldt"):
        assert np.allclose(et.read_intensity(name).values, expected.values, rtol=1e-5)
    assert {p.name for p in tmp_path.iterdir()} == {"led.tm25ray", *outputs}


@pytest.mark.slow
@pytest.mark.usefixtures("led")
def test_defaults_flux_and_text(run: Run) -> None:
    status, out, _ = run("led.tm25ray", "--flux", "500lm")
    assert status == 0
    assert "flux 500.0 ± 3.3 lm" in out
    status, out, _ = run("led.tm25ray")
    far = et.intensity_distribution(et.read_rays("led.tm25ray"))
    assert f"{far.c.size} planes, {far.gamma.size} angles" in out
    assert measured_peak(far) in out
    status, out, _ = run("led.tm25ray", "--json")
    facts = json.loads(out)
    assert facts["maximum_error"] > 0.0
    assert facts["flux_error"] > 0.0


@pytest.mark.slow
def test_files_are_turned_and_converted(run: Run) -> None:
    et.write_intensity("a.ies", lid("none").replace(luminaire={"lamp": "x", "input_power": 12.5}))
    status, out, err = run("a.ies", "-o", "b.ldt", "--rotate", 90, "--mirror", "-o", "b.png", "--kind", "cartesian")
    assert status == 0
    assert "lamp: x" in out
    assert "input power: 12.5 W\n" in out
    assert "turns them" not in err
    c = np.arange(0, 360, 30.0)[:, None]
    found, source = et.read_intensity("b.ldt"), et.read_intensity("a.ies")
    assert np.allclose(found.at(90 - c, [30, 100]), source.at(c, [30, 100]), rtol=1e-5)
    _, _, err = run("a.ies", "-o", "b.ldt")
    assert "--rotate 90 turns" in err


def test_one_of_several_photometries(run: Run) -> None:
    files = {"f": ("ldc/ies", "localFileName", "a.ies"), "g": ("ldc/ies", "localFileName", "b.ies")}
    two = {"ldc/a.ies": ies_of(lid("none"), Path()), "ldc/b.ies": ies_of(lid("both"), Path())}
    Path("two.gldf").write_bytes(archive({"product.xml": product(files, {"p": "f", "q": "g"}), **two}))
    status, _, err = run("two.gldf")
    assert status == 1
    assert "p (a.ies); q (b.ies)" in err
    status, out, err = run("two.gldf", "--photometry", "q", "-o", "q.ies")
    assert (status, err) == (0, "")
    assert "symmetry both" in out
    assert "photometry q of the container" in out
    assert et.read_intensity("q.ies").symmetry() == "both"
    status, _, err = run("two.gldf", "--photometry", "r")
    assert status == 1
    assert "Known: p, q" in err


def test_a_file_of_tm33(run: Run) -> None:
    Path("a.xml").write_bytes(tm33_of(lid("C0-C180")))
    status, out, err = run("a.xml", "-o", "a.ldt", "--rotate", 90)
    assert status == 0
    assert err.count("\n") == 1
    assert "a.ldt: texts changed" in err
    assert "manufacturer ('Ł' became '?'); catalogue number ('№' became 'No')" in err
    assert "manufacturer: Łampa & Söhne" in out
    assert et.read_intensity("a.ldt").symmetry(1e-4) == "C90-C270"


def test_a_turned_table_is_not_said_to_be_unturned(run: Run) -> None:
    et.write_intensity("a.ies", lid("none"))
    assert "nothing was turned or mirrored" in run("a.ies")[1]
    assert "nothing was turned" not in run("a.ies", "--rotate", 45)[1]


@pytest.mark.parametrize(("keyword", "told"), [("", "50.5 lm"), ("[_INTENSITYUNITS] mW/sr\n", "0.0505 W")])
def test_a_stated_flux_has_its_unit(run: Run, keyword: str, told: str) -> None:
    head = f"IESNA:LM-63-2002\n[TEST] x\n[MANUFAC] y\n{keyword}[_TOTALLUMINAIRELUMENS] 50.5\nTILT=NONE\n"
    Path("a.ies").write_text(f"{head}1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n8 8\n")
    assert f"  stated flux: {told}\n" in run("a.ies")[1]


@pytest.mark.usefixtures("led")
@pytest.mark.parametrize(
    ("arguments", "status", "hint"),
    [
        (["a.ies", "--c-planes", "12"], 2, "--c-planes: for ray files"),
        (["led.tm25ray", "--photometry", "1"], 2, "--photometry: for intensity files"),
        (["a.ies", "--photometry", "1"], 1, "hold one distribution"),
        (["a.ies", "--kind", "ploar"], 2, "'polar'"),
        (["a.ies", "-o", "b.tiff"], 1, ".tiff"),
        (["a.ies", "-o", "none/b.ies"], 1, "does not exist"),
        (["led.tm25ray", "--gamma-step", "7"], 1, "does not divide"),
        (["nothing.ies"], 1, "nothing.ies"),
    ],
)
def test_failures_leave_nothing(run: Run, tmp_path: Path, arguments: list[str], status: int, hint: str) -> None:
    et.write_intensity("a.ies", lid("none"))
    before = sorted(tmp_path.iterdir())
    found, out, err = run(*arguments)
    assert (found, out) == (status, "")
    assert hint in err
    assert sorted(tmp_path.iterdir()) == before


def test_what_a_format_does_not_take_is_told_beside_the_figures(run: Run, tmp_path: Path) -> None:
    et.write_intensity("w.ies", lid("none").replace(flux_unit="W"))
    found, out, err = run("w.ies", "-o", "b.ldt")
    assert found == 1
    assert out.startswith("radiant intensity")
    assert "luminous intensity only" in err
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".ldt"] == []
