"""Files of scans that contradict themselves or what was stated, and slices that cannot be."""

from __future__ import annotations

import dataclasses
import gzip
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.instruments.goniometer_scan import read_goniometer_scan
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice

NAMES = "theta_i,phi_i,theta_s,phi_s,bsdf"
STAGES = "# solid_angle = 1e-3\nalpha,beta,gamma,delta,flux\n0,0,0,10,0.5\n"


def test_errors_of_some_files_alone_are_refused(tmp_path: Path) -> None:
    """They were dropped without a word."""
    with_errors, without = tmp_path / "a.csv", tmp_path / "b.csv"
    with_errors.write_text(f"{NAMES},standard_error\n30,180,30,0,2.5,0.1\n")
    without.write_text(f"{NAMES}\n30,180,20,0,0.4\n")
    with pytest.raises(ArgumentError, match=r"a\.csv has standard errors and .*b\.csv has none"):
        et.read_scans([with_errors, without])
    assert et.read_scans([with_errors]).standard_error is not None
    assert et.read_scans([without]).standard_error is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"{NAMES},standard_error\n30,180,30,0,2.5,-0.1\n", "line 2: a standard error of -0.1"),
        (f"{NAMES.replace(',', ';')}\n30;180;30;0;2,5\n", "'2,5' has a decimal comma"),
    ],
)
def test_fields_that_cannot_be(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=said):
        et.read_scans([path])


def test_compressed_files_are_told(tmp_path: Path) -> None:
    path = tmp_path / "scan.csv.gz"
    path.write_bytes(gzip.compress(f"{NAMES}\n30,180,30,0,2.5\n".encode()))
    with pytest.raises(FormatError, match=r"compressed by gzip.*gunzip"):
        et.read_scans([path])


def test_a_solid_angle_that_contradicts_the_file(tmp_path: Path) -> None:
    path, incident = tmp_path / "scan.csv", tmp_path / "incident.csv"
    path.write_text(STAGES)
    incident.write_text(STAGES)
    assert et.read_scans([path], incident_flux=incident, solid_angle=1e-3).values.size == 1
    with pytest.raises(FormatError, match=r"1e-3 sr, and 0\.002 sr is stated"):
        et.read_scans([path], incident_flux=incident, solid_angle=2e-3)


@pytest.mark.parametrize("name", ["solid angle", "incidance", "backgrund"])
def test_slips_in_the_names_of_lines(tmp_path: Path, name: str) -> None:
    """A name that nearly is one is refused; remarks of people are let be."""
    path = tmp_path / "scan.csv"
    path.write_text(f"# {name} = 0.5\n# operator = Ada\n# date = today\nangle,flux\n0,4\n1,3\n")
    with pytest.raises(FormatError, match="Did you mean '# "):
        read_goniometer_scan(path)
    path.write_text("# operator = Ada\n# date = today\nangle,flux\n0,4\n1,3\n")
    assert read_goniometer_scan(path).flux.tolist() == [4.0, 3.0]


def test_slices_that_cannot_be() -> None:
    """Solid angles below 0, and points on the other side of the surface."""
    light, to = light_from(30.0, 180.0), direction([10.0, 20.0], 0.0)
    one = BsdfSlice(light, [0.1, 0.2], points=to, projected=[0.1, 0.1])
    with pytest.raises(ArgumentError, match="not below 0 sr"):
        dataclasses.replace(one, projected=[0.1, -0.1])
    with pytest.raises(ArgumentError, match=r"points\[0\].*transmitted light leaves on the other side"):
        dataclasses.replace(one, transmitted=True)
    with pytest.raises(ArgumentError, match=r"points\[1\].*reflected light leaves on the lit side"):
        dataclasses.replace(one, points=to * np.array([[1, 1, 1], [1, 1, -1]]))


@pytest.mark.slow
def test_a_scan_that_states_another_solid_angle_than_its_instrument_has() -> None:
    """The same values either way, and a note with both."""
    goniometer = et.ScatterGoniometer(photons=1e8)
    lobe = et.bsdf.CosinePower(peak=598.5, exponent=3761, way="transmitted")
    scan = goniometer.measure_window(lobe, 20.0, 0.8, 4, method="quadrature")
    again = dataclasses.replace(scan, solid_angle=2.0 * goniometer.solid_angle)
    plain, told = (
        et.deconvolve_directions(one, goniometer, method="richardson-lucy", stop=5, replicates=0)
        for one in (scan, again)
    )
    assert not any("solid angle" in note for note in plain.notes)
    assert any("the scan states a solid angle" in note for note in told.notes)
    np.testing.assert_allclose(told.values, plain.values, rtol=1e-9)
