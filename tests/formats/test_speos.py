"""Speos binary ray files, put together and taken apart with `struct`."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError, UnitError, UnsupportedFormatError
from etendue.formats.rays import read_rays, write_rays
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning

ROWS = (
    (1.0, -2.0, 0.5, 0.6, 0.0, 0.8, 450.5, 0.125),
    (-3.25, 4.5, 0.25, 0.0, -0.28, 0.96, 555.0, 0.25),
    (7.0, 0.125, -1.5, -0.48, 0.64, 0.6, 610.25, 1.0),
)


def speos_bytes(
    rows: Any = ROWS, *, watts: float = 1.375, markers: tuple[float, ...] = (2.0,) * 5, lumens: float = 300.0
) -> bytes:
    return struct.pack("<7f", watts, *markers, lumens) + b"".join(struct.pack("<8f", *row) for row in rows)


def read(tmp_path: Path, data: bytes) -> et.RaySet:
    path = tmp_path / "led.dat"
    path.write_bytes(data)
    return read_rays(path)


def places(rays: et.RaySet, severity: str) -> list[str]:
    return [c.place for c in rays.meaning.complaints if c.severity == severity]


def test_columns(tmp_path: Path) -> None:
    rays = read(tmp_path, speos_bytes())
    assert isinstance(rays.records, FileRecords)
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert np.allclose(rays.direction, [row[3:6] for row in ROWS], atol=1e-7)
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [450.5, 555.0, 610.25]
    assert rays.flux.tolist() == [0.125, 0.25, 1.0]
    assert (rays.flux_unit, rays.total_flux, rays.complaints) == ("W", 1.375, ())
    assert rays.header["luminous_flux"] == 300.0


def test_energies_are_relative(tmp_path: Path) -> None:
    rays = read(tmp_path, speos_bytes(watts=5.5))
    assert rays.flux.tolist() == [0.5, 1.0, 4.0]
    # Relative by the format's definition: both numbers are told, but nothing is wrong with the file.
    assert [(c.severity, c.place) for c in rays.complaints] == [("note", "total flux")]
    assert "the header says 5.5 W, the rays sum to 1.375" in rays.complaints[0].found


def test_header_without_totals(tmp_path: Path) -> None:
    rays = read(tmp_path, speos_bytes(lumens=0.0))
    assert "luminous_flux" not in rays.header
    assert rays.complaints == ()
    assert places(read(tmp_path, speos_bytes(watts=0.0)), "warning") == ["byte 0"]


@pytest.mark.parametrize("markers", [(3.0,) * 5, (2.0, 2.0, 2.0, 2.0, 1.0), (2.0, 3.0, 2.0, 2.0, 2.0)])
def test_other_markers_are_refused_by_name(tmp_path: Path, markers: tuple[float, ...]) -> None:
    with pytest.raises(UnsupportedFormatError, match="polarised"):
        read(tmp_path, speos_bytes(markers=markers))


@pytest.mark.parametrize("markers", [(0.0,) * 5, (2.5,) * 5, (20.0,) * 5])
def test_other_floats_are_no_speos_file(tmp_path: Path, markers: tuple[float, ...]) -> None:
    with pytest.raises(FormatError, match="begins no ray file"):
        read(tmp_path, speos_bytes(markers=markers))


@pytest.mark.parametrize("wrong", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_wavelength(tmp_path: Path, wrong: float) -> None:
    rows = [ROWS[0], (*ROWS[1][:6], wrong, 0.25), ROWS[2]]
    assert places(read(tmp_path, speos_bytes(rows)), "warning") == ["rays"]


def test_truncated(tmp_path: Path) -> None:
    rays = read(tmp_path, speos_bytes()[:-1])
    assert rays.records["flux"].tolist() == [0.125, 0.25]
    assert places(rays, "error") == [f"byte {28 + 95}"]
    with pytest.raises(FormatError, match="not one whole ray"):
        read(tmp_path, speos_bytes()[:50])
    with pytest.raises(FormatError, match="not one whole ray"):
        read(tmp_path, speos_bytes(()))


# --- writing ---------------------------------------------------------------------------------------------------------


def ray_set(wavelength: Any = (450.5, 555.0, 610.25), **meaning: Any) -> et.RaySet:
    names: list[Any] = [("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8")]
    records = np.zeros(3, names + ([("wavelength", "<f8")] if wavelength is not None else []))
    records["position"], records["direction"] = [r[:3] for r in ROWS], [r[3:6] for r in ROWS]
    records["flux"] = [r[7] for r in ROWS]
    if wavelength is not None:
        records["wavelength"] = wavelength
    return et.RaySet.from_records(records, RaySetMeaning(**{"flux_unit": "W", **meaning}))


def test_written_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    assert write_rays(path, ray_set(), "speos") == ()
    data = path.read_bytes()
    watts, *markers, lumens = struct.unpack_from("<7f", data)
    assert (watts, markers) == (1.375, [2.0] * 5)
    # V(450.5) and V(610.25) by linear interpolation of CIE 018:2019 between 1 nm steps.
    v = (0.038 + (0.0399 - 0.038) * 0.5, 1.0, 0.503 + (0.4905 - 0.503) * 0.25)
    assert lumens == pytest.approx(683 * np.dot(v, (0.125, 0.25, 1.0)), rel=2e-3)
    assert len(data) == 28 + 96
    rows = [struct.unpack_from("<8f", data, 28 + 32 * i) for i in range(3)]
    assert np.allclose(rows, ROWS, rtol=6e-8)


def test_energies_stay_below_one(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    write_rays(path, ray_set().with_total_flux(1375.0), "speos")
    data = path.read_bytes()
    assert struct.unpack_from("<f", data) == (1375.0,)
    assert [struct.unpack_from("<f", data, 28 + 32 * i + 28)[0] for i in range(3)] == [0.125, 0.25, 1.0]


def test_lumens_become_watts(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    rays = ray_set(flux_unit="lm")
    (note,) = write_rays(path, rays, "speos")
    assert "watts" in note
    back = read_rays(path)
    assert np.allclose(back.flux, rays.in_unit("W").flux, rtol=1e-6)
    assert back.header["luminous_flux"] == pytest.approx(1.375, rel=1e-6)
    with pytest.raises(UnitError):
        write_rays(path, ray_set((450.0, 950.0, 600.0), flux_unit="lm"), "speos")


@pytest.mark.parametrize("meaning", [{"single_wavelength": 620.0}, {"spectra": (et.Spectrum([620.0], [1.0]),)}])
def test_single_wavelength(tmp_path: Path, meaning: dict[str, Any]) -> None:
    path = tmp_path / "a.ray"
    assert write_rays(path, ray_set(None, **meaning), "speos") == ()
    assert read_rays(path).column("wavelength").tolist() == [620.0] * 3


@pytest.mark.parametrize("meaning", [{}, {"spectra": (et.Spectrum([400.0, 700.0], [1.0, 2.0]),)}])
def test_sets_without_wavelengths_are_refused_with_advice(tmp_path: Path, meaning: dict[str, Any]) -> None:
    with pytest.raises(ArgumentError, match="Write 'lighttools'"):
        write_rays(tmp_path / "a.ray", ray_set(None, **meaning), "speos")
    with pytest.raises(ArgumentError, match="wavelength of every ray"):
        write_rays(tmp_path / "a.ray", et.RingSource(rays=10), "speos")
    with pytest.raises(ArgumentError, match="wavelength of every ray"):
        write_rays(tmp_path / "a.ray", ray_set((450.0, 0.0, 600.0)), "speos")
    assert list(tmp_path.iterdir()) == []
