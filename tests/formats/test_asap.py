"""ASAP binary ray files, put together and taken apart with `struct` by the table of header records."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.formats.rays import read_rays, write_rays
from etendue.quantities.file_records import FileRecords
from etendue.quantities.report import RayFileWarning

ROWS = (
    (1.0, -2.0, 0.5, 0.6, 0.0, 0.8, 1.0),
    (-3.25, 4.5, 0.25, 0.0, -0.28, 0.96, 2.5),
    (7.0, 0.125, -1.5, -0.48, 0.64, 0.6, 4.5),
)


def asap_bytes(
    rows: Any = ROWS,
    *,
    columns: int = 7,
    stride: int = 28,
    total: float = 8.0,
    label: bytes = b"XYZABCF MM _",
    count: int | None = None,
    largest: float | None = None,
    title: bytes = b"LED",
) -> bytes:
    n = -len(rows) if count is None else count
    header = (
        struct.pack("<i", 247 + 1024 * columns),
        title.ljust(24) + struct.pack("<i", 1),
        b"Tot Flux" + struct.pack("<f", total) + label.ljust(16),
        b"Ray number".ljust(16) + struct.pack("<2fi", 1.0, abs(n) if largest is None else largest, n),
        b"Wavelength".ljust(16) + struct.pack("<2fi", 0.0, 0.0, 1),
    )
    data = b"".join(record.ljust(stride, b"\0") for record in header)
    return data + b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)


def read(tmp_path: Path, *args: Any, **kwargs: Any) -> et.RaySet:
    path = tmp_path / "led.ray"
    path.write_bytes(asap_bytes(*args, **kwargs))
    return read_rays(path)


def places(rays: et.RaySet, severity: str) -> list[str]:
    return [c.place for c in rays.meaning.complaints if c.severity == severity]


def test_seven_columns(tmp_path: Path) -> None:
    assert asap_bytes()[:4].hex() == "f71c0000"
    rays = read(tmp_path)
    assert isinstance(rays.records, FileRecords)
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert np.allclose(rays.direction, [row[3:6] for row in ROWS], atol=1e-7)
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert (rays.flux_unit, rays.complaints, rays.header["title"]) == ("lm", (), "LED")
    assert rays.header["total_flux"] == 8.0


def test_sum_is_kept(tmp_path: Path) -> None:
    rays = read(tmp_path, total=100.0)
    with pytest.warns(RayFileWarning, match="header says 100 lm, the rays sum to 8; the rays' sum is kept"):
        assert rays.total_flux == 8.0


@pytest.mark.parametrize(
    ("word", "scale"), [(b"M", 1e3), (b"CM", 10.0), (b"MM", 1.0), (b"INCH", 25.4), (b"mm", 1.0), (b"FEET", 304.8)]
)
def test_length_units(tmp_path: Path, word: bytes, scale: float) -> None:
    rays = read(tmp_path, label=b"XYZABCF " + word + b" _")
    assert np.allclose(rays.position, np.multiply([row[:3] for row in ROWS], scale))


@pytest.mark.parametrize("label", [b"XYZABCF", b"XYZABCF _"])
def test_missing_unit_is_millimetres_with_a_warning(tmp_path: Path, label: bytes) -> None:
    rays = read(tmp_path, label=label)
    assert (rays.position[2, 0], places(rays, "warning")) == (7.0, ["byte 68"])


def test_unknown_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="'PARSEC' is unknown"):
        read(tmp_path, label=b"XYZABCF PARSEC")


def test_watts(tmp_path: Path) -> None:
    assert read(tmp_path, label=b"XYZABCF MM W").flux_unit == "W"


@pytest.mark.parametrize("columns", [8, 9, 12])
@pytest.mark.parametrize("wide_header", [False, True])
def test_more_columns_with_either_length_of_header_records(tmp_path: Path, columns: int, wide_header: bool) -> None:
    stride = 4 * columns if wide_header else 28
    rows = [(*row, *range(100, 93 + columns)) for row in ROWS]
    rays = read(tmp_path, rows, columns=columns, stride=stride)
    assert rays.position.tolist() == [list(row[:3]) for row in ROWS]
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert places(rays, "warning") == [f"byte {2 * stride + 12}"]
    path = tmp_path / "cut.dis"
    path.write_bytes(asap_bytes(rows, columns=columns, stride=stride)[:-3])
    assert read_rays(path).flux.tolist() == [1.0, 2.5]


def test_letters_say_where_the_columns_are(tmp_path: Path) -> None:
    rows = [(row[6], *row[3:6], 99.0, *row[:3]) for row in ROWS]
    rays = read(tmp_path, rows, columns=8, label=b"FABCOXYZ CM")
    assert np.allclose(rays.position, np.multiply([row[:3] for row in ROWS], 10))
    assert rays.flux.tolist() == [1.0, 2.5, 4.5]
    assert "byte 68" in places(read(tmp_path, label=b"UVWABCF MM"), "warning")
    with pytest.raises(FormatError, match="7 columns are labelled"):
        read(tmp_path, label=b"OXYZABCF MM")


def test_number_of_rays_without_minus_sign(tmp_path: Path) -> None:
    rays = read(tmp_path, count=3)
    assert (rays.flux.tolist(), places(rays, "warning")) == ([1.0, 2.5, 4.5], ["byte 108"])


def test_truncated_and_contradictory(tmp_path: Path) -> None:
    path = tmp_path / "a.dis"
    path.write_bytes(asap_bytes()[:-1])
    rays = read_rays(path)
    assert (rays.flux.tolist(), places(rays, "error")) == ([1.0, 2.5], [f"byte {140 + 83}"])
    for kwargs in ({"count": -2}, {"count": 0}, {"count": -5, "largest": 3.0}, {"rows": ()}):
        with pytest.raises(FormatError):
            read(tmp_path, **kwargs)
    path.write_bytes(asap_bytes()[:139])
    with pytest.raises(FormatError, match="begins no ray file"):
        read_rays(path)


def test_binary_that_merely_has_the_key(tmp_path: Path) -> None:
    path = tmp_path / "a.dis"
    path.write_bytes(bytes.fromhex("f71c0000") + bytes(range(128, 256)) * 3)
    with pytest.raises(FormatError, match="begins no ray file"):
        read_rays(path)


def test_written_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.dis"
    rays = et.RaySet([r[:3] for r in ROWS], [r[3:6] for r in ROWS], [r[6] for r in ROWS])
    assert write_rays(path, rays) == ()
    data = path.read_bytes()
    assert len(data) == 140 + 84
    assert data[:4].hex() == "f71c0000"
    assert data[28:56] == b"memory".ljust(24) + b"\x01\0\0\0"
    assert data[56:84] == b"Tot Flux" + struct.pack("<f", 8.0) + b"XYZABCF MM _".ljust(16)
    assert data[84:112] == b"Ray number".ljust(16) + struct.pack("<2fi", 1.0, 3.0, -3)
    assert data[112:140] == b"Wavelength".ljust(16) + struct.pack("<2fi", 0.0, 0.0, 1)
    rows = [struct.unpack_from("<7f", data, 140 + 28 * i) for i in range(3)]
    assert np.allclose(rows, ROWS, rtol=6e-8)


def test_what_cannot_be_said_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.dis"
    rays = et.RaySet(
        [r[:3] for r in ROWS], [r[3:6] for r in ROWS], [r[6] for r in ROWS], flux_unit="W", wavelength=[400, 500, 600]
    )
    notes = write_rays(path, rays)
    assert any("a wavelength each" in note for note in notes)
    assert any("says W" in note for note in notes)
    assert read_rays(path).flux_unit == "W"


def test_more_rays_than_the_header_can_say(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="at most 2,147,483,647"):
        write_rays(tmp_path / "a.dis", et.RingSource(rays=50_000_000, runs=50))
    assert list(tmp_path.iterdir()) == []
