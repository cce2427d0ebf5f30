"""A white LED from two files, one of which is in watts: one command, in the unit asked, and what it assumed."""

from __future__ import annotations

import struct
from pathlib import Path

import etendue as et
import numpy as np
import pytest

from cli.outcome import Run, files

V_450 = 0.038
"""V(450 nm), CIE 018:2019, table 1."""

K_M = 683.0


def part(unit: str, total: float, seed: int, **more: object) -> et.RaySet:
    rng = np.random.default_rng(seed)
    k = rng.normal((0.3, 0.1, 1.5), 0.6, (500, 3))
    k /= np.linalg.norm(k, axis=1)[:, None]
    weight = rng.random(500)
    place = np.c_[rng.random((500, 2)), np.zeros(500)]
    return et.RaySet(place, k, total * weight / weight.sum(), flux_unit=unit, **more)  # type: ignore[arg-type]


@pytest.fixture
def blue(tmp_path: Path) -> Path:
    """1 W at 450 nm, said of every ray."""
    et.write_rays(tmp_path / "blue.tm25ray", part("W", 1.0, 1, wavelength=np.full(500, 450.0)))
    return tmp_path / "blue.tm25ray"


@pytest.fixture
def yellow(tmp_path: Path) -> Path:
    """300 lm of which nothing else is known."""
    et.write_rays(tmp_path / "yellow.tm25ray", part("lm", 300.0, 2))
    return tmp_path / "yellow.tm25ray"


def radiometric(path: Path, watts: float, lumens: float) -> Path:
    """A file in watts without any spectrum, whose header states both totals."""
    et.write_rays(path, part("W", watts, 3))
    data = bytearray(path.read_bytes())
    struct.pack_into("<f", data, 12, lumens)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("more", [(), ("--unit", "lm")])
def test_files_in_different_units_become_lumens(
    run: Run, blue: Path, yellow: Path, tmp_path: Path, more: tuple[str, ...]
) -> None:
    done = run("convert", blue, yellow, tmp_path / "white.tm25ray", *more)
    assert done.status == 0, done.err
    white = et.read_rays(tmp_path / "white.tm25ray")
    assert white.flux_unit == "lm"
    assert white.total_flux == pytest.approx(K_M * V_450 + 300.0, rel=1e-6)
    assert white.flux[:500].sum() == pytest.approx(K_M * V_450, rel=1e-6)
    assert "blue.tm25ray: 1 W became 25.95 lm: W to lm through the wavelength of each ray" in done.err
    assert f"{K_M * V_450 + 300.0:.4g} lm" in done.out


def test_stated_lumens_are_stored_as_lumens(run: Run, blue: Path, tmp_path: Path) -> None:
    """Both files know their wavelengths, which TM-25 holds beside watts only: lumens were asked for."""
    et.write_rays(tmp_path / "amber.tm25ray", part("W", 1.0, 4, wavelength=np.full(500, 590.0)))
    target = tmp_path / "white.tm25ray"
    done = run("convert", blue, tmp_path / "amber.tm25ray", target, "--flux", "54.6lm", "--flux", "337lm")
    assert done.status == 0, done.err
    white = et.read_rays(target)
    assert (white.flux_unit, round(white.total_flux, 4)) == ("lm", 391.6)
    assert white.flux[:500].sum() == pytest.approx(54.6, rel=1e-6)
    assert "391.6 lm" in done.out
    assert "holds wavelengths and spectra of rays beside W only" in done.err
    # In watts the wavelengths are kept.
    done = run(
        "convert", blue, tmp_path / "amber.tm25ray", target, "--flux", "54.6lm", "--flux", "337lm", "--unit", "W"
    )
    assert done.status == 0, done.err
    white = et.read_rays(target)
    assert white.flux_unit == "W"
    assert white.flux[:500].sum() == pytest.approx(54.6 / (K_M * V_450), rel=1e-6)
    assert set(np.round(white.wavelength, 3)) == {450.0, 590.0}  # type: ignore[arg-type]


def test_the_two_totals_of_a_header_convert_it(run: Run, yellow: Path, tmp_path: Path) -> None:
    blue = radiometric(tmp_path / "blue.tm25ray", 0.694, 54.6)
    done = run("convert", blue, yellow, tmp_path / "white.ray", "--format", "lighttools")
    assert done.status == 0, done.err
    white = et.read_rays(tmp_path / "white.ray")
    assert (white.flux_unit, round(white.total_flux, 3)) == ("lm", 354.6)
    assert "54.6 lm and 0.694 W, as if all rays had one spectrum" in done.err


@pytest.mark.parametrize(("lumens", "told"), [(K_M * V_450, False), (1.005 * K_M * V_450, False), (300.0, True)])
def test_totals_of_a_header_that_the_wavelengths_contradict_are_told(
    run: Run, blue: Path, tmp_path: Path, lumens: float, told: bool
) -> None:
    """1 W at 450 nm is 683 V(450) lm, whatever the header says of it and whatever total in W is stated."""
    data = bytearray(blue.read_bytes())
    struct.pack_into("<f", data, 12, lumens)
    blue.write_bytes(data)
    for more, total in (((), 1.0), (("--flux", "2W"), 2.0)):
        done = run("convert", blue, tmp_path / "lm.csv", "--unit", "lm", *more, "--json")
        assert done.json["total_flux"] == pytest.approx(total * K_M * V_450, rel=1e-5)
        said = f"the header says {lumens:.4g} lm beside 1 W, and the rays give {K_M * V_450:.4g} lm for it"
        assert any(said in complaint for complaint in done.json["complaints"]) is told


def test_a_stated_flux_in_another_unit_is_an_assumption_that_is_told(run: Run, yellow: Path, tmp_path: Path) -> None:
    et.write_rays(tmp_path / "dull.tm25ray", part("W", 2.0, 5))
    done = run(
        "convert", tmp_path / "dull.tm25ray", yellow, tmp_path / "white.tm25ray", "--flux", "54.6lm", "--flux", "300"
    )
    assert done.status == 0, done.err
    assert et.read_rays(tmp_path / "white.tm25ray").total_flux == pytest.approx(354.6, rel=1e-6)
    assert "one spectrum for all" in done.err


def test_what_cannot_be_known_is_refused_in_words_of_the_command_line(run: Run, yellow: Path, tmp_path: Path) -> None:
    et.write_rays(tmp_path / "dull.tm25ray", part("W", 2.0, 5))
    refused = run("convert", tmp_path / "dull.tm25ray", yellow, tmp_path / "white.tm25ray")
    assert refused.status == 1
    assert "dull.tm25ray: W cannot become lumens" in refused.err
    assert "--flux 54.6lm" in refused.err
    assert "in_unit" not in refused.err
    assert "with_total_flux" not in refused.err
    assert files(tmp_path) == ["dull.tm25ray", "yellow.tm25ray"]
