"""TracePro text source files: a header for people that holds the length unit, and rows without units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import detect_format, read_rays, tracepro

Read = Callable[..., et.RaySet]

HEADER = {
    "source": "!! Source file: LED.RAY",
    "count": "# NbrRays Requested: 5000000,  NbrRays Generated: 2",
    "range": "Angular Range PolarBeg:   0.0000, PolarEnd: 180.0000, AzimuthBeg:   0.0000, AzimuthEnd: 360.0000",
    "rotation": "Rotation AboutX   0.0000, AboutY   0.0000, AboutZ   0.0000",
    "translation": "Translation X   0.0000, Y   0.0000, Z   0.0000",
    "scale": "Scale X   1.0000, Y   1.0000, Z   1.0000",
    "unit": "Conversion Factor From Meters   1000.0000",
    "columns": "X Pos Y Pos Z Pos X Vec Y Vec Z Vec Inc Flux",
}
ROWS = "1.5 -2 3 0 0.6 0.8 0.25\r\n-4.25 5e-1 6 0.8 0 -0.6 1.75\r\n"


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(rows: str = ROWS, **changes: str | None) -> et.RaySet:
        path = tmp_path / "led.src"
        lines = [line for line in {**HEADER, **changes}.values() if line is not None]
        path.write_bytes(("\r\n".join(lines) + "\r\n" + rows).encode())
        assert detect_format(path) is tracepro.FORMAT
        return read_rays(path)

    return read


def surprises(rays: et.RaySet) -> list[tuple[str, str]]:
    """All complaints but the one on the flux unit, which every file has."""
    found = [(c.severity, c.place) for c in rays.complaints if "the flux unit is not stated" not in c.found]
    assert len(found) == len(rays.complaints) - 1
    return found


def test_two_rays(read: Read) -> None:
    rays = read()
    assert rays.position.tolist() == [[1.5, -2, 3], [-4.25, 0.5, 6]]
    np.testing.assert_allclose(rays.direction, [[0, 0.6, 0.8], [0.8, 0, -0.6]], atol=1e-16)
    assert rays.flux.tolist() == [0.25, 1.75]
    assert (rays.flux_unit, rays.wavelength) == ("W", None)
    assert rays.header["title"] == "Source file: LED.RAY"
    assert surprises(rays) == []


@pytest.mark.parametrize(
    ("line", "mm"),
    [
        ("Conversion Factor From Meters   1.0000", 1000.0),
        ("conversion factor from meters 1000", 1.0),
        ("Conversion Factor From Meters   100.0", 10.0),
        ("Conversion Factor From Meters\t39.37007874015748", 25.4),
    ],
)
def test_length_units(read: Read, line: str, mm: float) -> None:
    np.testing.assert_allclose(read(unit=line).position[0], np.array([1.5, -2, 3]) * mm, rtol=1e-14)


def test_an_unstated_length_unit(read: Read) -> None:
    rays = read(unit=None)
    assert rays.position[0].tolist() == [1.5, -2, 3]
    assert surprises(rays) == [("warning", "header")]


@pytest.mark.parametrize("value", ["", "0", "-1", "nan", "inf", "mm"])
def test_length_units_that_are_none(read: Read, value: str) -> None:
    with pytest.raises(FormatError, match=r"line 7: .* states no length unit"):
        read(unit=f"Conversion Factor From Meters {value}")


@pytest.mark.parametrize(
    ("key", "line", "place"),
    [
        ("rotation", "Rotation AboutX   0.0000, AboutY   90.0000, AboutZ   0.0000", "line 4"),
        ("translation", "Translation X   0.0000, Y   0.0000, Z   -1e-3", "line 5"),
        ("scale", "Scale X   1.0000, Y   2.0000, Z   1.0000", "line 6"),
    ],
)
def test_placements_are_not_applied(read: Read, key: str, line: str, place: str) -> None:
    rays = read(**{key: line})
    assert rays.position[0].tolist() == [1.5, -2, 3]
    assert surprises(rays) == [("warning", place)]


def test_an_eighth_column_is_ignored(read: Read) -> None:
    rays = read("1 2 3 0 0.6 0.8 0.25 550\n4 5 6 0.8 0 -0.6 1.75 450\n", columns=HEADER["columns"] + " Wavelength")
    assert rays.flux.tolist() == [0.25, 1.75]
    assert rays.wavelength is None
    assert surprises(rays) == [("warning", "line 8")]


def test_numbers_of_rays(read: Read) -> None:
    assert surprises(read(count=None)) == []
    assert surprises(read(count="# NbrRays Requested: 3, NbrRays Generated: 3")) == [("error", "line 2")]
    with pytest.raises(FormatError, match="line 9: 6 numbers in the first row"):
        read("1 2 3 0 0.6 0.8\n")
    with pytest.raises(FormatError, match="line 10: 6 entries where 7 are expected"):
        read("1 2 3 0 0.6 0.8 1\n1 2 3 0 0.6 0.8\n")
    with pytest.raises(FormatError, match="no ray follows"):
        read("")


def test_names_of_columns_are_needed(tmp_path: Path) -> None:
    path = tmp_path / "led.src"
    path.write_text("\n".join(list(HEADER.values())[:-1]) + "\n" + ROWS)
    assert not tracepro.recognise(tracepro.Head.of(path))
    with pytest.raises(FormatError, match="no line 'X Pos"):
        tracepro.read(path)


def test_what_is_written(tmp_path: Path) -> None:
    """In metres: if the factor were understood the other way round, 1 would still mean the same."""
    path = tmp_path / "led.src"
    rays = et.RaySet([[1, 2, 3.5], [4, 5, 6]], [[0, 0.6, 0.8], [0, 0, 1]], [0.1, 0.2], wavelength=[450.0, 550.0])
    notes = tracepro.write(rays, path)
    assert "flux is in lm" in notes[0]
    assert "a wavelength each" in notes[1]
    lines = path.read_bytes().decode().split("\r\n")
    assert lines[:2] == ["!! Source file: memory", "# NbrRays Requested: 2,  NbrRays Generated: 2"]
    assert lines[2:6] == [HEADER[key] for key in ("range", "rotation", "translation", "scale")]
    assert lines[6:8] == ["Conversion Factor From Meters   1.0000", HEADER["columns"]]
    assert [float(v) for v in lines[8].split()] == [1e-3, 2e-3, 3.5e-3, 0, 0.6, 0.8, 0.1]
    assert len(lines) == 11
    assert surprises(read_rays(path)) == []


def test_a_source_that_is_drawn_on_demand(tmp_path: Path) -> None:
    source = et.RingSource(rays=1000, seed=4)
    tracepro.write(source, tmp_path / "rings.src")
    back, drawn = read_rays(tmp_path / "rings.src"), source.ray_set()
    np.testing.assert_allclose(back.position, drawn.position, rtol=4e-16)
    assert np.array_equal(back.flux, drawn.flux)
