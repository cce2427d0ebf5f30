"""`etendue convert` tells what it wrote, and verbs name the files that a refused option is for."""

from __future__ import annotations

import struct
from pathlib import Path

import etendue as et
import numpy as np
import pytest

from cli.outcome import Run

UP = np.tile([0.0, 0.0, 1.0], (10, 1))


def test_rays_that_are_left_out_are_not_counted(run: Run, tmp_path: Path) -> None:
    flux = np.where(np.arange(10) % 2, 2.0, -1.0)
    table = np.column_stack([np.zeros((10, 3)), UP, flux])
    (tmp_path / "half.csv").write_text("x,y,z,l,m,n,flux\n" + "\n".join(",".join(map(str, row)) for row in table))
    found = run("convert", "half.csv", "half.dat")
    assert (found.status, found.out.strip()) == (0, "half.dat: 5 rays, 10 lm")
    assert run("convert", "half.csv", "half.dat", "--json").json["rays"] == len(et.read_rays("half.dat")) == 5


def test_no_flux_cannot_be_shared(run: Run) -> None:
    et.write_rays("dark.tm25ray", et.RaySet(np.zeros((10, 3)), UP, np.zeros(10)))
    found = run("convert", "dark.tm25ray", "lit.dat", "--flux", "5")
    assert found.status != 0
    assert "dark.tm25ray: its rays carry no flux, so 5 lm cannot be shared" in found.err
    assert not Path("lit.dat").exists()


@pytest.mark.parametrize(
    ("option", "files"),
    [("--flux", "ray files"), ("--unit", "ray files and light fields"), ("--c-planes", "ray files and")],
)
def test_options_are_refused_with_the_files_that_they_are_for(run: Run, option: str, files: str) -> None:
    et.write_intensity(
        "i.ies", et.Intensity(c=[0, 90, 180, 270], gamma=[0, 90], values=[[1, 0], [2, 0], [3, 0], [2, 0]])
    )
    found = run("intensity", "i.ies", option, "lm" if option == "--unit" else "8")
    assert found.status == 2
    assert f"{option}: for {files}" in found.err
    assert ("light fields" in found.err) == (option != "--flux")


def test_rays_are_turned_and_then_moved(run: Run) -> None:
    """About y by 90°: +z becomes +x, +x becomes −z; then 5 mm along x."""
    start = np.column_stack([np.arange(10.0), np.full(10, 2.0), np.full(10, 3.0)])
    et.write_rays("up.tm25ray", et.RaySet(start, UP, np.ones(10)))
    found = run("convert", "up.tm25ray", "side.tm25ray", "--rotate", "0,2,0,90", "--move", "5,0,-1")
    assert found.status == 0
    side = et.read_rays("side.tm25ray")
    np.testing.assert_allclose(side.direction, np.tile([1.0, 0, 0], (10, 1)), atol=1e-7)
    np.testing.assert_allclose(
        side.position, np.column_stack([start[:, 2] + 5, start[:, 1], -start[:, 0] - 1]), atol=1e-6
    )
    for option, value, told in (
        ("--rotate", "0,0,1", "'0,0,1': give 4 numbers separated by commas, e.g. --rotate 0,1,0,90"),
        ("--rotate", "0,0,0,90", "--rotate 0,0,0,90: the axis has no length"),
        ("--move", "up", "'up': give 3 numbers"),
    ):
        found = run("convert", "up.tm25ray", "none.tm25ray", option, value)
        assert found.status == 2
        assert told in found.err
        assert not Path("none.tm25ray").exists()


GREEN = 555.0
"""Wavelength at which V(λ) is 1 [nm]: a watt is 683 lm."""


@pytest.mark.parametrize(
    ("name", "format", "column", "start"),
    [("led.tm25ray", "tm25", (6, 8), 36288), ("led.dis", "speos", (7, 8), 28), ("led.dat", "zemax", (6, 7), 208)],
)
def test_the_flux_that_is_told_is_that_of_the_file(
    run: Run, name: str, format: str, column: tuple[int, int], start: int
) -> None:
    """Lumens with a wavelength each become watts where the format wants it; the bytes of the file decide.

    Of Speos' relative energies the first four bytes are the total.
    """
    flux = np.arange(1.0, 11.0)
    et.write_rays("green.csv", et.RaySet(np.zeros((10, 3)), UP, flux, wavelength=np.full(10, GREEN)))
    told = run("convert", "green.csv", name, "--format", format, "--json").json
    data = Path(name).read_bytes()
    stored = float(np.frombuffer(data, "<f4", offset=start).reshape(10, column[1])[:, column[0]].sum())
    if format == "speos":
        (stored,) = struct.unpack_from("<f", data)
    assert told["total_flux"] == pytest.approx(stored, rel=1e-6)
    assert told["total_flux"] == pytest.approx(55.0 if told["flux_unit"] == "lm" else 55.0 / 683, rel=1e-6)
    assert (told["flux_unit"] == "lm") == (format == "zemax")
    assert any("55 lm became 0.08053 W" in note for note in told["notes"]) == (format != "zemax")


@pytest.mark.parametrize(
    ("fluxes", "unit", "total"),
    [
        (("2W", "68.3lm"), "lm", 2 * 683 + 68.3),
        (("2", "68.3lm"), "lm", 2 * 683 + 68.3),
        (("2", "0.1"), "W", 2.1),
        (("1366lm", "68.3lm"), "lm", 2.1 * 683),
    ],
)
def test_fluxes_of_two_units_become_lumens(run: Run, fluxes: tuple[str, str], unit: str, total: float) -> None:
    """The unit is that of the fluxes and of the inputs where a flux has none; lm if these differ."""
    for name in ("a.csv", "b.csv"):
        green = et.RaySet(np.zeros((10, 3)), UP, np.arange(1.0, 11.0), flux_unit="W", wavelength=np.full(10, GREEN))
        et.write_rays(name, green)
    done = run("convert", "a.csv", "b.csv", "both.csv", "--flux", fluxes[0], "--flux", fluxes[1], "--json")
    assert done.status == 0, done.err
    both = et.read_rays("both.csv")
    assert (both.flux_unit, done.json["flux_unit"]) == (unit, unit)
    assert both.total_flux == pytest.approx(total, rel=1e-9)


def test_a_unit_that_the_format_does_not_have_is_refused(run: Run) -> None:
    et.write_rays("green.csv", et.RaySet(np.zeros((10, 3)), UP, np.ones(10), wavelength=np.full(10, GREEN)))
    refused = run("convert", "green.csv", "green.ray", "--format", "speos", "--unit", "lm")
    assert (refused.status, Path("green.ray").exists()) == (2, False)
    assert "in a Speos binary ray file rays have W" in refused.err
