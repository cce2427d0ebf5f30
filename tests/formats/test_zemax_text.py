"""Zemax text source files: the first line in all its forms, and rows with and without wavelength."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import detect_format, read_rays, zemax_text

Read = Callable[[str], et.RaySet]

ROWS = """ 1.5\t-2 3  0 0.6 0.8  0.25
-4.25 5e-1 6  0.8 0 -0.6\t1.75
"""
SPECTRAL_ROWS = """1.5 -2 3 0 0.6 0.8 0.25 0.45
-4.25 .5 6 0.8 0 -0.6 1.75 0.6328
"""


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(text: str) -> et.RaySet:
        path = tmp_path / "led.dat"
        path.write_bytes(text.encode())
        assert detect_format(path) is zemax_text.FORMAT
        return read_rays(path)

    return read


def warnings_of(rays: et.RaySet) -> list[str]:
    return [c.found for c in rays.complaints if c.severity == "warning"]


def test_two_rays(read: Read) -> None:
    rays = read(f"2 4 0 1\n{ROWS}")
    assert rays.position.tolist() == [[1.5, -2, 3], [-4.25, 0.5, 6]]
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.flux.tolist() == [0.25, 1.75]
    assert (rays.flux_unit, rays.wavelength, rays.complaints) == ("lm", None, ())


@pytest.mark.parametrize(("unit", "mm"), [(0, 1000.0), (1, 25.4), (2, 10.0), (3, 304.8), (4, 1.0)])
def test_length_units(read: Read, unit: int, mm: float) -> None:
    rays = read(f"2 {unit} 0 0\n{ROWS}")
    np.testing.assert_allclose(rays.position, np.array([[1.5, -2, 3], [-4.25, 0.5, 6]]) * mm, rtol=1e-15)


def test_wavelengths_are_micrometres(read: Read) -> None:
    rays = read(f"2 4 2 0\n{SPECTRAL_ROWS}")
    assert rays.wavelength is not None
    np.testing.assert_allclose(rays.wavelength, [450.0, 632.8], rtol=1e-15)
    assert (rays.flux_unit, rays.complaints) == ("W", ())


@pytest.mark.parametrize(
    ("first", "unit", "warning"),
    [
        ("2 4", "W", "the flux unit is not stated; taken as W"),
        ("2 4 0", "W", "the flux unit is not stated; taken as W"),
        ("2 4 0 0", "W", None),
        ("2 4 0 1", "lm", None),
        ("2.0 4.000 0.0 1.0", "lm", None),
        ("2 4 0 0 0 0 0", "W", "the flux unit is not stated; taken as W"),
        ("2.000000\t4.000000\t0.0\t1.0\t0.0\t0.0\t0.0", "lm", None),
        ("2 4 0 2", "lm", "flux type 2"),
        ("2 4 2 0", "W", "record format 2 has 8 columns, but the rows have 7"),
        ("2 4 2 1", "W", "flux type 1 in a spectral file"),
        ("2 4 1 0", "W", "record format 1"),
    ],
)
def test_first_lines(read: Read, first: str, unit: str, warning: str | None) -> None:
    rays = read(f"{first}\n{ROWS}")
    assert len(rays) == 2  # the first line is no ray, whatever it looks like
    assert rays.flux_unit == unit
    assert any(warning in found for found in warnings_of(rays)) if warning else not rays.complaints


@pytest.mark.parametrize(
    ("first", "unit", "warnings"),
    [
        ("2 4", "W", 0),
        ("2 4 2 0", "W", 0),
        ("2 4 0 0 0 0 0 0", "W", 0),
        ("2 4 0 1", "lm", 1),
        ("2 4 2 1 0 0 0 0", "W", 1),
    ],
)
def test_first_lines_above_wavelengths(read: Read, first: str, unit: str, warnings: int) -> None:
    rays = read(f"{first}\n{SPECTRAL_ROWS}")
    assert (len(rays), rays.flux_unit, len(warnings_of(rays))) == (2, unit, warnings)
    assert rays.wavelength is not None


@pytest.mark.parametrize(
    ("first", "found"),
    [
        ("2 5", "length unit 5 does not exist"),
        ("2 -1", "length unit -1 does not exist"),
        ("2 0.5", "length unit 0.5 does not exist"),
        ("2.5 4", "2.5 is no number of rays"),
        ("-2 4", "-2 is no number of rays"),
        ("0 4", "0 is no number of rays"),
        ("nan 4 0 0 0 0 0", "nan is no number of rays"),
        ("inf 4", "inf is no number of rays"),
        ("2 4 0 7", "flux type 7 does not exist"),
        ("2 4 0 nan", "flux type nan does not exist"),
    ],
)
def test_first_lines_that_mean_nothing(read: Read, first: str, found: str) -> None:
    with pytest.raises(FormatError) as caught:
        read(f"\n{first}\n{ROWS}")
    assert (caught.value.place, caught.value.found) == ("line 2", found)


def test_missing_rows_are_an_error(read: Read) -> None:
    rays = read(f"3 4 0 1\n{ROWS}")
    assert len(rays) == 2
    (complaint,) = rays.complaints
    assert (complaint.severity, complaint.place) == ("error", "line 1")
    assert complaint.found == "3 rays are stated, 2 rows follow; 1 are missing"


def test_a_bad_row_is_refused_with_its_line(read: Read) -> None:
    with pytest.raises(FormatError, match="line 3: 8 entries where 7 are expected"):
        read("2 4 0 1\n1 2 3 0 0 1 5\n1 2 3 0 0 1 5 0.5\n")


def test_nanometres_in_the_column_of_micrometres(read: Read) -> None:
    rays = read("1 4 2 0\n1 2 3 0 0 1 5 550\n")
    assert any("550 µm" in found for found in warnings_of(rays))
    assert any("wavelength that is not above 0" in f for f in warnings_of(read("1 4 2 0\n1 2 3 0 0 1 5 0\n")))


@pytest.mark.parametrize(
    "text",
    [
        "2 4 0 0 1 0 5\n1 2 3 0 0 1 5\n",  # bare rows: the first is a ray along +l
        "2\n1 2 3 0 0 1 5\n",
        "2 4\n1 2 3 0 0 1\n",
        "2 x\n1 2 3 0 0 1 5\n",
        "2 4\n",
    ],
)
def test_what_is_no_zemax_text(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.dat"
    path.write_text(text)
    assert not zemax_text.recognise(zemax_text.Head.of(path))
    if not text.startswith("2 4 0 0 1"):
        with pytest.raises(FormatError):
            zemax_text.read(path)


def test_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / "led.dat"
    watts = et.RaySet([[1, 2, 3.5]], [[0, 0.6, 0.8]], [0.1], flux_unit="W", wavelength=[550.0])
    assert zemax_text.write(watts, path) == ()
    lines = path.read_bytes().decode().split("\r\n")
    assert lines[0] == "1 4 2 0"
    assert [float(v) for v in lines[1].split()] == [1, 2, 3.5, 0, 0.6, 0.8, 0.1, 0.55]
    assert lines[2:] == [""]

    lumens = et.RaySet([[1, 2, 3.5]], [[0, 0.6, 0.8]], [0.1], wavelength=[550.0])
    (lost, why) = zemax_text.write(lumens, path)
    assert "a wavelength each" in lost
    assert "in_unit('W')" in why
    first, row = path.read_text().splitlines()
    assert first == "1 4 0 1"
    assert [float(v) for v in row.split()] == [1, 2, 3.5, 0, 0.6, 0.8, 0.1]


def test_what_cannot_be_written_is_told(tmp_path: Path) -> None:
    records = np.zeros(2, [("direction", "<f8", 3), ("flux", "<f8"), ("stokes", "<f8", 3)])
    records["direction"] = [[0, 0, 1], [0, 1, 0]]
    records["flux"] = [0.0, 2.0]
    spectrum = et.Spectrum([400.0, 500.0], [1.0, 2.0])
    meaning = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], spectra=(spectrum,)).meaning
    notes = zemax_text.write(et.RaySet.from_records(records, meaning), tmp_path / "far.dat")
    text = " ".join(notes)
    for word in ("stokes", "one spectrum for all", ".spcd", "1 rays carry no flux"):
        assert word in text
    assert read_rays(tmp_path / "far.dat").position.tolist() == [[0, 0, 0], [0, 0, 0]]


def test_a_source_that_is_drawn_on_demand(tmp_path: Path) -> None:
    source = et.RingSource(rays=1000, seed=4)
    assert zemax_text.write(source, tmp_path / "rings.dat") == ()
    back, drawn = read_rays(tmp_path / "rings.dat"), source.ray_set()
    assert np.array_equal(back.position, drawn.position)
    assert np.array_equal(back.flux, drawn.flux)
    assert back.flux_unit == "lm"


@pytest.mark.parametrize(
    ("name", "mm", "wavelength"),
    [("ZemaxText.txt", 1.0, None), ("ZemaxWavelengthText.txt", 10.0, [510, 520, 530, 540, 550, 560, 570, 580, 450])],
)
def test_sample(samples: Path, name: str, mm: float, wavelength: list[float] | None) -> None:
    rays = read_rays(samples / "rays" / name)
    assert rays.provenance.format == "zemax-text"
    assert len(rays) == 9
    np.testing.assert_allclose(rays.position[1], np.array([9.922475, 14.276640, 0]) * mm, rtol=1e-15)
    np.testing.assert_allclose(rays.direction[8], [0.080512, -0.363838, 0.927976], atol=1e-6)
    assert rays.total_flux == pytest.approx(138.865937, rel=1e-12)
    assert rays.flux_unit == "W"
    if wavelength is None:
        assert rays.wavelength is None
    else:
        assert rays.wavelength is not None
        np.testing.assert_allclose(rays.wavelength, wavelength, rtol=1e-12)
    assert all(c.severity == "warning" for c in rays.complaints)
