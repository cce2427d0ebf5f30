"""LightTools binary ray files, put together and taken apart with `struct` by the byte table."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.rays import read_rays, write_rays
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.report import RayFileWarning

ROWS = (
    (1.0, -2.0, 0.5, 0.6, 0.0, 0.8, 1.0),
    (-3.25, 4.5, 0.25, 0.0, -0.28, 0.96, 2.5),
    (7.0, 0.125, -1.5, -0.48, 0.64, 0.6, 4.5),
)


def ltrf_bytes(
    rows: Any = ROWS,
    *,
    version: tuple[int, int] = (2, 0),
    data_type: int = 1,
    far_field: int = 0,
    colour: int = 0,
    unit: int = 1,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    total: bytes = struct.pack("<f", 8.0),
    trailer: bytes = b"LTRFEND",
) -> bytes:
    data = (
        b"LTRF" + struct.pack("<6I", *version, data_type, far_field, colour, unit) + struct.pack("<3f", *origin) + total
    )
    assert len(data) == 44
    return data + b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows) + trailer


def read(tmp_path: Path, *args: Any, **kwargs: Any) -> et.RaySet:
    path = tmp_path / "led.txt"
    path.write_bytes(ltrf_bytes(*args, **kwargs))
    return read_rays(path)


def places(rays: et.RaySet, severity: str) -> list[str]:
    return [c.place for c in rays.meaning.complaints if c.severity == severity]


@pytest.mark.parametrize(("data_type", "flux_unit"), [(0, "W"), (1, "lm")])
def test_flux_only(tmp_path: Path, data_type: int, flux_unit: str) -> None:
    rays = read(tmp_path, data_type=data_type)
    assert isinstance(rays.records, FileRecords)
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert np.allclose(rays.direction, [row[3:6] for row in ROWS], atol=1e-7)
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert (rays.flux_unit, rays.total_flux, rays.complaints) == (flux_unit, 8.0, ())
    assert (rays.header["version"], rays.header["far_field"], rays.header["length_unit"]) == ("2.0", False, "mm")


def test_values_larger_by_the_number_of_traced_rays(tmp_path: Path) -> None:
    rays = read(tmp_path, [(*row[:6], row[6] * 500_000) for row in ROWS])
    with pytest.warns(RayFileWarning, match=r"header says 8 lm, the rays sum to 4000000"):
        assert rays.total_flux == 8.0
    assert np.allclose(rays.flux, [1.0, 2.5, 4.5])


@pytest.mark.parametrize("total", ["00000000", "0000c07f", "0100807f", "7f800001", "000080ff"])
def test_unknown_total(tmp_path: Path, total: str) -> None:
    rays = read(tmp_path, total=bytes.fromhex(total))
    assert (rays.total_flux, places(rays, "warning")) == (8.0, ["byte 40"])


@pytest.mark.parametrize(
    ("unit", "scale"), [(1, 1.0), (2, 10.0), (3, 1000.0), (4, 25.4), (5, 304.8), (6, 1e-3), (7, 1e-6)]
)
def test_length_units(tmp_path: Path, unit: int, scale: float) -> None:
    rays = read(tmp_path, unit=unit)
    assert np.allclose(rays.position, np.multiply([row[:3] for row in ROWS], scale))


def test_system_unit_is_millimetres_with_a_warning(tmp_path: Path) -> None:
    rays = read(tmp_path, unit=0)
    assert (rays.position[2, 0], places(rays, "warning"), rays.header["length_unit"]) == (7.0, ["byte 24"], "system")


def test_wavelengths(tmp_path: Path) -> None:
    rows = [(*row, w) for row, w in zip(ROWS, (405.5, 530.25, 660.0), strict=True)]
    rays = read(tmp_path, rows, colour=2, data_type=0)
    assert rays.column("wavelength").tolist() == [405.5, 530.25, 660.0]
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    rows[2] = (*rows[2][:7], -1.0)
    assert places(read(tmp_path, rows, colour=2, data_type=0), "warning") == ["rays"]


def test_tristimulus_values_stand_in_place_of_the_flux(tmp_path: Path) -> None:
    rows = [(*row[:6], x, row[6], z) for row, x, z in zip(ROWS, (1.5, 2.25, 4.75), (9.0, 0.5, 0.25), strict=True)]
    rays = read(tmp_path, rows, colour=1)
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert rays.column("tristimulus_x").tolist() == [1.5, 2.25, 4.75]
    assert rays.column("tristimulus_z").tolist() == [9.0, 0.5, 0.25]


def test_far_field(tmp_path: Path) -> None:
    rays = read(tmp_path, [row[3:] for row in ROWS], far_field=1)
    assert not rays.has_position
    assert np.allclose(rays.direction, [row[3:6] for row in ROWS], atol=1e-7)
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]


def test_data_origin_is_reported_and_not_added(tmp_path: Path) -> None:
    rays = read(tmp_path, origin=(1.0, 2.0, -3.0))
    assert rays.position[0].tolist() == [1.0, -2.0, 0.5]
    assert (rays.header["data_origin"], places(rays, "warning")) == ((1.0, 2.0, -3.0), ["byte 28"])


def test_versions(tmp_path: Path) -> None:
    assert places(read(tmp_path, version=(2, 1)), "warning") == ["byte 8"]
    with pytest.raises(UnsupportedFormatError, match="without polarisation"):
        read(tmp_path, version=(3, 0))
    with pytest.raises(UnsupportedFormatError, match="version 4"):
        read(tmp_path, version=(4, 0))


@pytest.mark.parametrize(
    ("change", "place"),
    [({"data_type": 2}, 12), ({"far_field": 2}, 16), ({"colour": 3}, 20), ({"unit": 8}, 24), ({"unit": 2**32 - 1}, 24)],
)
def test_numbers_that_mean_nothing(tmp_path: Path, change: dict[str, int], place: int) -> None:
    with pytest.raises(FormatError, match=f"byte {place}: "):
        read(tmp_path, **change)


def test_truncated(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    for cut, rays_left in ((1, 3), (7, 3), (8, 2), (7 + 28, 2), (7 + 29, 1)):
        path.write_bytes(ltrf_bytes()[:-cut])
        rays = read_rays(path)
        assert rays.records["flux"].tolist() == [1.0, 2.5, 4.5][:rays_left]
        (complaint,) = rays.meaning.complaints
        assert (complaint.severity, complaint.place) == ("error", f"byte {44 + 84 + 7 - cut}")
    path.write_bytes(ltrf_bytes()[:60])
    with pytest.raises(FormatError, match="not one whole ray"):
        read_rays(path)
    path.write_bytes(ltrf_bytes(()))
    with pytest.raises(FormatError, match="not one whole ray"):
        read_rays(path)


def test_records_of_another_width(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="do not fill whole records"):
        read(tmp_path, [row[1:] for row in ROWS])


# --- writing ---------------------------------------------------------------------------------------------------------


def ray_set(extra: dict[str, Any] | None = None, *, position: bool = True, **meaning: Any) -> et.RaySet:
    columns = {"direction": [r[3:6] for r in ROWS], "flux": [r[6] for r in ROWS], **(extra or {})}
    if position:
        columns = {"position": [r[:3] for r in ROWS], **columns}
    arrays = {name: np.asarray(value, "<f8") for name, value in columns.items()}
    records = np.zeros(3, [(name, array.dtype, array.shape[1:]) for name, array in arrays.items()])
    for name, array in arrays.items():
        records[name] = array
    return et.RaySet.from_records(records, RaySetMeaning(**meaning))


def test_written_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    assert write_rays(path, ray_set(), "lighttools") == ()
    data = path.read_bytes()
    assert data[:4] == b"LTRF"
    assert struct.unpack_from("<6I4f", data, 4) == (2, 0, 1, 0, 0, 1, 0.0, 0.0, 0.0, 8.0)
    assert data[-7:] == b"LTRFEND"
    assert len(data) == 44 + 84 + 7
    rows = [struct.unpack_from("<7f", data, 44 + 28 * i) for i in range(3)]
    assert np.allclose(rows, ROWS, rtol=6e-8)


def test_written_wavelengths(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    waves = (405.5, 530.25, 660.0)
    assert write_rays(path, ray_set({"wavelength": waves}, flux_unit="W"), "lighttools") == ()
    data = path.read_bytes()
    assert struct.unpack_from("<3I", data, 12) == (0, 0, 2)
    assert [struct.unpack_from("<f", data, 44 + 32 * i + 28)[0] for i in range(3)] == list(waves)
    assert write_rays(path, ray_set(single_wavelength=555.0, flux_unit="W"), "lighttools") == ()
    assert read_rays(path).column("wavelength").tolist() == [555.0] * 3
    notes = write_rays(path, ray_set({"wavelength": waves}), "lighttools")
    assert any("in_unit('W')" in note for note in notes)
    assert (read_rays(path).columns, read_rays(path).total_flux) == ((), 8.0)
    notes = write_rays(path, ray_set(spectra=(et.Spectrum([400.0, 700.0], [1.0, 2.0]),)), "lighttools")
    assert any(".sre" in note for note in notes)


def test_written_tristimulus_values(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    xz = {"tristimulus_x": (1.5, 2.25, 4.75), "tristimulus_z": (9.0, 0.5, 0.25)}
    assert write_rays(path, ray_set(xz, declared_flux=16.0), "lighttools") == ()
    data = path.read_bytes()
    assert struct.unpack_from("<3I", data, 12) == (1, 0, 1)
    assert [struct.unpack_from("<3f", data, 44 + 36 * i + 24) for i in range(3)] == [
        (3.0, 2.0, 18.0), (4.5, 5.0, 1.0), (9.5, 9.0, 0.5),
    ]  # fmt: skip


def test_written_far_field(tmp_path: Path) -> None:
    path = tmp_path / "a.ray"
    assert write_rays(path, ray_set(position=False), "lighttools") == ()
    data = path.read_bytes()
    assert struct.unpack_from("<I", data, 16) == (1,)
    rows = [struct.unpack_from("<4f", data, 44 + 16 * i) for i in range(3)]
    assert np.allclose(rows, [row[3:] for row in ROWS], rtol=6e-8)
    assert not read_rays(path).has_position
