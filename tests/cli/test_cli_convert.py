"""`etendue convert` tells what it wrote, and verbs name the files that a refused option is for."""

from __future__ import annotations

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
