"""Zemax binary source files, put together and taken apart with `struct` by the byte table."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.formats.rays import detect_format, read_rays, write_rays, zemax
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.report import RayFileWarning

ROWS = (
    (1.0, -2.0, 0.5, 0.6, 0.0, 0.8, 1.0),
    (-3.25, 4.5, 0.25, 0.0, -0.28, 0.96, 2.5),
    (7.0, 0.125, -1.5, -0.48, 0.64, 0.6, 4.5),
)
SPECTRAL_ROWS = tuple((*row, w) for row, w in zip(ROWS, (0.4055, 0.53025, 0.66), strict=True))


def zemax_bytes(
    rows: Any = ROWS,
    *,
    identifier: int = 1010,
    count: int | None = None,
    description: bytes = b"a LED",
    fluxes: tuple[float, float] = (8.0, 8.0),
    wavelength: float = 0.0,
    unit: int = 4,
    location: tuple[float, ...] = (0.0, 0.0, 0.0),
    rotation: tuple[float, ...] = (0.0, 0.0, 0.0),
    kind: int = 0,
    flux_type: int = 1,
) -> bytes:
    data = struct.pack("<iI", identifier, len(rows) if count is None else count)
    data += description.ljust(100, b"\0") + struct.pack("<3f", *fluxes, wavelength)
    data += struct.pack("<4f", 0.0, 180.0, -10.0, 350.0) + struct.pack("<i", unit)
    data += struct.pack("<6f", *location, *rotation) + bytes(28)
    data += struct.pack("<4i", kind, flux_type, 28, 0)
    assert len(data) == 208
    return data + b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)


def read(tmp_path: Path, *args: Any, **kwargs: Any) -> et.RaySet:
    path = tmp_path / "led.ray"
    path.write_bytes(zemax_bytes(*args, **kwargs))
    return read_rays(path)


def places(rays: et.RaySet, severity: str) -> list[str]:
    return [c.place for c in rays.meaning.complaints if c.severity == severity]


@pytest.mark.parametrize("identifier", [1010, 8675309])
@pytest.mark.parametrize(("flux_type", "flux_unit"), [(0, "W"), (1, "lm")])
def test_flux_only(tmp_path: Path, identifier: int, flux_type: int, flux_unit: str) -> None:
    rays = read(tmp_path, identifier=identifier, flux_type=flux_type)
    assert isinstance(rays.records, FileRecords)
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert np.allclose(rays.direction, [row[3:6] for row in ROWS], atol=1e-7)
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert (rays.flux_unit, rays.wavelength, rays.complaints) == (flux_unit, None, ())
    assert rays.header["description"] == "a LED"
    assert rays.header["inclination"] == (0.0, 180.0)
    assert rays.header["azimuth"] == (-10.0, 350.0)
    assert rays.provenance.format == "zemax"


@pytest.mark.parametrize(("unit", "scale"), [(0, 1000.0), (1, 25.4), (2, 10.0), (3, 304.8), (4, 1.0)])
def test_length_units(tmp_path: Path, unit: int, scale: float) -> None:
    rays = read(tmp_path, unit=unit)
    assert np.allclose(rays.position, np.multiply([row[:3] for row in ROWS], scale))
    assert np.allclose(next(rays.batches()).position, rays.position)


def test_spectral_files_carry_watts_and_micrometres(tmp_path: Path) -> None:
    rays = read(tmp_path, SPECTRAL_ROWS, kind=2, flux_type=0, wavelength=0.55)
    assert (rays.flux_unit, rays.flux.tolist()) == ("W", [1.0, 2.5, 4.5])
    assert rays.wavelength is not None
    assert np.allclose(rays.wavelength, [405.5, 530.25, 660.0], rtol=1e-7)
    assert places(read(tmp_path, SPECTRAL_ROWS, kind=2, flux_type=1), "warning") == ["byte 196"]
    assert read(tmp_path, SPECTRAL_ROWS, kind=2, flux_type=1).flux_unit == "W"
    dark = [(*row[:7], 0.0) for row in SPECTRAL_ROWS]
    assert places(read(tmp_path, dark, kind=2, flux_type=0), "warning") == ["rays"]


@pytest.mark.parametrize(("stored", "nm"), [(0.55, 550.0), (0.0, None), (math.nan, None), (-1.0, None)])
def test_single_wavelength_is_in_micrometres(tmp_path: Path, stored: float, nm: float | None) -> None:
    single = read(tmp_path, wavelength=stored).meaning.single_wavelength
    assert single == (None if nm is None else pytest.approx(nm, rel=1e-7))


def test_nanometres_in_the_place_of_micrometres(tmp_path: Path) -> None:
    rays = read(tmp_path, wavelength=550.0)
    assert (rays.meaning.single_wavelength, places(rays, "warning")) == (550.0, ["byte 116"])
    rays = read(tmp_path, [(*row, 550.0) for row in ROWS], kind=2, flux_type=0)
    assert places(rays, "warning") == ["byte 236"]


def test_sum_is_kept_and_header_reported(tmp_path: Path) -> None:
    rays = read(tmp_path, fluxes=(5.0, 1.0))
    with pytest.warns(RayFileWarning, match=r"header says 1 lm, the rays sum to 8; the rays' sum is kept"):
        assert rays.total_flux == 8.0
    assert (rays.header["source_flux"], rays.header["ray_set_flux"], rays.header["total_flux"]) == (5.0, 1.0, 1.0)
    assert read(tmp_path, fluxes=(8.0, math.nan)).header["total_flux"] == 8.0
    assert read(tmp_path, fluxes=(0.0, 0.0)).complaints == ()


def test_placement_is_ignored_and_mentioned(tmp_path: Path) -> None:
    rays = read(tmp_path, location=(1.0, 2.0, 3.0), rotation=(0.1, 0.0, 0.0))
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert places(rays, "note") == ["byte 140"]
    assert rays.header["location"] == (1.0, 2.0, 3.0)


def test_flux_type_of_an_early_converter(tmp_path: Path) -> None:
    rays = read(tmp_path, flux_type=2)
    assert (rays.flux_unit, places(rays, "warning")) == ("lm", ["byte 196"])


@pytest.mark.parametrize(
    ("change", "place"), [({"unit": 5}, "byte 136"), ({"unit": -1}, "byte 136"), ({"kind": 1}, "byte 192")]
)
def test_numbers_that_mean_nothing(tmp_path: Path, change: dict[str, int], place: str) -> None:
    with pytest.raises(FormatError, match=place):
        read(tmp_path, **change)


@pytest.mark.parametrize(
    ("rows", "kwargs"),
    [
        (SPECTRAL_ROWS, {"kind": 0}),  # the records are wider than the header says
        ([(*r, *r[:7]) for r in ROWS], {"kind": 2, "count": 6, "flux_type": 0}),  # and narrower
        (ROWS, {"count": 2}),
        (ROWS, {"count": 0}),
        ((), {"count": 4_000_000_000}),
    ],
)
def test_size_that_contradicts_the_header(tmp_path: Path, rows: Any, kwargs: dict[str, int]) -> None:
    with pytest.raises(FormatError, match="header describes"):
        read(tmp_path, rows, **kwargs)


def test_truncated(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_bytes(zemax_bytes()[:-1])
    rays = read_rays(path)
    assert np.array_equal(rays.flux, [1.0, 2.5])
    assert places(rays, "error") == ["byte 291"]
    path.write_bytes(zemax_bytes(count=4_000_000_000))
    assert len(read_rays(path)) == 3
    assert "3,999,999,997" in str(read_rays(path).meaning.complaints[0])


def test_other_files_that_begin_alike_are_not_recognised(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    path.write_bytes(struct.pack("<i", 1010) + b"something else".ljust(300))
    with pytest.raises(FormatError, match="begins no ray file"):
        detect_format(path)


# --- writing ---------------------------------------------------------------------------------------------------------


def ray_set(wavelength: tuple[float, ...] | None = None, **meaning: Any) -> et.RaySet:
    names: list[Any] = [("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8")]
    records = np.zeros(3, names + ([("wavelength", "<f8")] if wavelength else []))
    records["position"], records["direction"] = [r[:3] for r in ROWS], [r[3:6] for r in ROWS]
    records["flux"] = [r[6] for r in ROWS]
    if wavelength:
        records["wavelength"] = wavelength
    return et.RaySet.from_records(records, RaySetMeaning(**meaning))


def test_written_flux_only_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    assert write_rays(path, ray_set(), "zemax") == ()
    data = path.read_bytes()
    assert len(data) == 208 + 3 * 28
    assert struct.unpack_from("<iI", data) == (1010, 3)
    assert data[8:14] == b"memory"
    assert struct.unpack_from("<3f", data, 108) == (8.0, 8.0, 0.0)
    assert struct.unpack_from("<i", data, 136) == (4,)
    assert struct.unpack_from("<4i", data, 192) == (0, 1, 0, 0)
    rows = [struct.unpack_from("<7f", data, 208 + 28 * i) for i in range(3)]
    assert np.allclose(rows, ROWS, rtol=6e-8)


def test_written_spectral(tmp_path: Path) -> None:
    path = tmp_path / "a.sdf"
    assert write_rays(path, ray_set((405.5, 530.25, 660.0), flux_unit="W")) == ()
    data = path.read_bytes()
    assert struct.unpack_from("<2i", data, 192) == (2, 0)
    rows = [struct.unpack_from("<8f", data, 208 + 32 * i) for i in range(3)]
    assert np.allclose(rows, SPECTRAL_ROWS, rtol=1e-7)


def test_what_cannot_be_said_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    notes = write_rays(path, ray_set((405.5, 530.25, 660.0)), "zemax")
    assert any("in_unit('W')" in note for note in notes)
    assert read_rays(path).wavelength is None
    notes = write_rays(path, ray_set(spectra=(et.Spectrum([400.0, 700.0], [1.0, 2.0]),)), "zemax")
    assert any(".spcd" in note for note in notes)
    assert write_rays(path, ray_set(single_wavelength=450.0), "zemax") == ()
    assert read_rays(path).meaning.single_wavelength == pytest.approx(450.0, rel=1e-7)
    dark = ray_set()
    records = dark.records.copy()
    records["flux"][1] = 0.0
    notes = write_rays(path, et.RaySet.from_records(records, dark.meaning), "zemax")
    assert any("1 rays carry no flux" in note for note in notes)


def test_more_rays_than_opticstudio_reads(tmp_path: Path) -> None:
    source = et.RingSource(rays=50_000_000, runs=100)
    with pytest.raises(ArgumentError, match="at most 4,000,000,000"):
        write_rays(tmp_path / "a.dat", source, "zemax")
    assert list(tmp_path.iterdir()) == []


def test_values_that_32_bits_cannot_hold(tmp_path: Path) -> None:
    path = tmp_path / "a.dat"
    far = ray_set().scaled(1e39)
    with pytest.raises(ArgumentError, match=r"3\.4e38"):
        write_rays(path, far, "zemax")
    for total in (1e-50, 4e38):
        with pytest.raises(ArgumentError, match="too"):
            write_rays(path, ray_set().with_total_flux(total), "zemax")
    assert list(tmp_path.iterdir()) == []


def test_format_is_exported() -> None:
    assert (zemax.FORMAT.name, zemax.FORMAT.extensions) == ("zemax", (".dat", ".sdf"))
