"""Speos text ray files: an index before and an energy behind each ray, and no total."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnitError
from etendue.formats.rays import detect_format, read_rays, speos_text, text_output

Read = Callable[[str], et.RaySet]

ROWS = "1\t1.5\t-2\t3\t0\t0.6\t0.8\t450\t0.25\r\n2\t-4.25\t5e-1\t6\t0.8\t0\t-0.6\t632.8\t1\r\n"


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(text: str) -> et.RaySet:
        path = tmp_path / "led.txt"
        path.write_bytes(text.encode())
        assert detect_format(path) is speos_text.FORMAT
        return read_rays(path)

    return read


def test_two_rays(read: Read) -> None:
    rays = read(f"2\r\n{ROWS}")
    assert rays.position.tolist() == [[1.5, -2, 3], [-4.25, 0.5, 6]]
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [450, 632.8]
    assert rays.flux.tolist() == [0.25, 1]
    assert rays.flux_unit == "W"


def test_the_total_is_unknown_until_it_is_given(read: Read) -> None:
    rays = read(f"2\r\n{ROWS}")
    (complaint,) = rays.complaints
    assert (complaint.severity, complaint.place) == ("warning", "total flux")
    assert "with_total_flux" in complaint.found
    assert rays.with_total_flux(10).flux.tolist() == [2, 8]


def test_polarised_rays_lose_their_polarisation(read: Read) -> None:
    rows = "1 1 2 3 0 0.6 0.8 450 0.25 1 0 0 0.5 0\n2 4 5 6 0.8 0 -0.6 632 1 0 1 0 1 1\n"
    rays = read(f"2\n{rows}")
    assert rays.flux.tolist() == [0.25, 1]
    assert rays.columns == ("wavelength",)
    assert ["polarisation" in c.found for c in rays.complaints if c.severity == "note"] == [True]


def test_counts(read: Read) -> None:
    rays = read(f"5\r\n{ROWS}")
    assert len(rays) == 2
    assert any(c.severity == "error" and c.place == "line 1" for c in rays.complaints)


def test_a_bad_row_is_refused_with_its_line(read: Read) -> None:
    with pytest.raises(FormatError, match="line 3: 8 entries where 9 are expected"):
        read("2\n1 1 2 3 0 0 1 450 1\n2 1 2 3 0 0 1 450\n")
    with pytest.raises(FormatError, match="line 3: 'x' is not a number"):
        read("2\n1 1 2 3 0 0 1 450 1\n2 1 2 x 0 0 1 450 1\n")


def test_wavelengths_that_are_none(read: Read) -> None:
    rays = read("1\n1 1 2 3 0 0 1 -1 1\n")
    assert any("wavelength that is not above 0" in c.found for c in rays.complaints)


@pytest.mark.parametrize("text", ["2.5\n" + ROWS, "-2\n" + ROWS, "2 4\n" + ROWS, "2\n", "2\n1 2 3 0 0 1 5\n", ROWS])
def test_what_is_no_speos_text(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.txt"
    path.write_text(text)
    assert not speos_text.recognise(speos_text.Head.of(path))
    with pytest.raises(FormatError):
        speos_text.read(path)


def test_what_is_written(tmp_path: Path) -> None:
    """Energies are relative to the strongest ray, rays are counted from 1, and lumens become watts."""
    path = tmp_path / "led.txt"
    rays = et.RaySet(
        [[1, 2, 3.5], [0, 0, np.inf], [4, 5, 6]], [[0, 0.6, 0.8], [0, 0, 1], [0.8, 0, -0.6]], [0.1, 7, 0.4],
        flux_unit="W", wavelength=[450.0, 500.0, 600.0],
    )  # fmt: skip
    with pytest.warns(UserWarning, match="left out"):
        notes = speos_text.write(rays, path)
    assert "The total flux, 0.5 W" in notes[0]
    assert "1 of 3 rays are not written" in notes[1]
    lines = path.read_bytes().decode().split("\r\n")
    assert lines[0] == "2"
    assert [float(v) for v in lines[1].split()] == [1, 1, 2, 3.5, 0, 0.6, 0.8, 450, 0.25]
    assert [float(v) for v in lines[2].split()] == [2, 4, 5, 6, 0.8, 0, -0.6, 600, 1]


def test_lumens_become_watts(tmp_path: Path) -> None:
    watts = et.RaySet(
        [[1, 2, 3], [4, 5, 6]], [[0, 0, 1], [0, 0, 1]], [1.0, 3.0], flux_unit="W", wavelength=[450.0, 555.0]
    )
    notes = speos_text.write(watts.in_unit("lm"), tmp_path / "led.txt")
    assert "turned into watts" in notes[0]
    np.testing.assert_allclose(read_rays(tmp_path / "led.txt").flux, [1 / 3, 1], rtol=1e-12)
    dark = et.RaySet([[1, 2, 3]], [[0, 0, 1]], [1.0], wavelength=[950.0])
    with pytest.raises(UnitError):
        speos_text.write(dark, tmp_path / "dark.txt")


def test_rays_without_wavelength_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="wavelength of every ray"):
        speos_text.write(et.RingSource(rays=100), tmp_path / "rings.txt")


def test_rays_are_counted_over_stretches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_output, "STRETCH", 2)
    n = 5
    direction = np.tile([0.0, 0.0, 1.0], (n, 1))
    rays = et.RaySet(np.zeros((n, 3)), direction, np.ones(n), flux_unit="W", wavelength=np.full(n, 500.0))
    speos_text.write(rays, tmp_path / "led.txt")
    rows = (tmp_path / "led.txt").read_text().split("\n")[1:-1]
    assert [row.split()[0] for row in rows] == ["1", "2", "3", "4", "5"]


def test_rays_without_flux_are_written(tmp_path: Path) -> None:
    rays = et.RaySet([[1, 2, 3]], [[0, 0, 1]], [0.0], flux_unit="W", wavelength=[500.0])
    speos_text.write(rays, tmp_path / "led.txt")
    assert read_rays(tmp_path / "led.txt").flux.tolist() == [0]
