"""The file of a ray index: what docs/formats/ray-index.md says stands in it, and no damage goes unnoticed."""

from __future__ import annotations

import json
import struct
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.report import Complaint

HEADER = "<8sIIQQIIQQII"
FIELDS = ("magic", "version", "side", "rays", "leaves", "leaf", "width", "text", "records", "checksum", "zero")


def rays_of(n: int, seed: int = 4) -> et.RaySet:
    """Rays of both hemispheres with all that a set may know besides."""
    random = np.random.default_rng(seed)
    dtype = [
        ("flux", "<f4"),
        ("direction", "<f4", 3),
        ("position", "<f4", 3),
        ("wavelength", "<f4"),
        ("additional", "<f4", 2),
    ]
    records = np.zeros(n, dtype)
    direction = random.normal((0.2, 0.1, 0.5), 1.0, (n, 3))
    records["direction"] = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    records["position"] = random.normal((3, -1, 0), (2, 1, 0.1), (n, 3))
    records["flux"] = random.exponential(1.0, n)
    records["wavelength"] = random.uniform(400, 700, n)
    records["additional"] = random.uniform(size=(n, 2))
    meaning = RaySetMeaning(
        flux_unit="W",
        declared_flux=12.5,
        relative_by_format=True,
        length_scale=25.4,
        spectra=(et.Spectrum([450.0, 550.0], [1.0, 0.25]),),
        header={"creator": "Größe", "total_flux": 12.5, "additional_labels": ("a", "b")},
        complaints=(Complaint("note", "byte 7", "odd", "clause 1"),),
    )
    return et.RaySet.from_records(records, meaning)


def parts(path: Path) -> tuple[dict[str, Any], dict[str, Any], npt.NDArray[np.uint64], npt.NDArray[np.float32], bytes]:
    """Header, JSON, first rays of the cells, boxes and records, by the page alone."""
    data = path.read_bytes()
    header = dict(zip(FIELDS, struct.unpack_from(HEADER, data), strict=True))
    text = json.loads(data[64 : 64 + header["text"]])
    at = -(-(64 + header["text"]) // 64) * 64
    cells = 2 * header["side"] ** 2
    starts = np.frombuffer(data, "<u8", cells + 1, at)
    at = -(-(at + 8 * (cells + 1)) // 64) * 64
    bounds = np.frombuffer(data, "<f4", 8 * header["leaves"], at).reshape(-1, 8)
    assert header["records"] == -(-(at + 32 * header["leaves"]) // 4096) * 4096
    assert len(data) == header["records"] + header["rays"] * header["width"]
    blank = data[:56] + bytes(4) + data[60 : header["records"]]
    assert zlib.crc32(blank) == header["checksum"]
    return header, text, starts, bounds, data[header["records"] :]


def cell_of(k: npt.NDArray[np.float64], side: int) -> npt.NDArray[np.int64]:
    """The cell of a direction as the page has it."""
    x, y = (k[:, i] / np.sqrt(1 + np.abs(k[:, 2])) for i in (0, 1))
    wide = np.abs(x) > np.abs(y)
    along, across = np.where(wide, x, y), np.where(wide, y, x)
    r = np.copysign(np.hypot(x, y), along)
    other = r * np.arctan(across / along) * 4 / np.pi
    a, b = np.where(wide, r, other), np.where(wide, other, r)
    i, j = (np.clip(((c + 1) / 2 * side).astype(int), 0, side - 1) for c in (a, b))
    morton = sum((((i >> bit) & 1) << (2 * bit)) + (((j >> bit) & 1) << (2 * bit + 1)) for bit in range(8))
    return np.where(k[:, 2] < 0, side * side, 0) + morton


def frame_of(cell: int, side: int) -> npt.NDArray[np.float64]:
    """The rows are the axes x, y, z of a cell's frame as the page has it."""
    morton, lower = cell % side**2, cell >= side**2
    i, j = (sum(((morton >> (2 * bit + odd)) & 1) << bit for bit in range(8)) for odd in (0, 1))
    a, b = 2 * (i + 0.5) / side - 1, 2 * (j + 0.5) / side - 1
    if abs(a) > abs(b):
        x, y = a * np.cos(np.pi / 4 * b / a), a * np.sin(np.pi / 4 * b / a)
    else:
        x, y = b * np.sin(np.pi / 4 * a / b), b * np.cos(np.pi / 4 * a / b)
    r2 = x * x + y * y
    z = np.array([x * np.sqrt(2 - r2), y * np.sqrt(2 - r2), (r2 - 1) if lower else (1 - r2)])
    across = np.cross([1.0, 0, 0] if abs(z[0]) < 0.8 else [0, 1.0, 0], z)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(z, across), z])


def test_the_file_is_what_the_page_says(tmp_path: Path) -> None:
    rays = rays_of(3000)
    et.RayIndex.build(rays, tmp_path / "a.etd")
    header, text, starts, bounds, data = parts(tmp_path / "a.etd")
    assert (header["magic"], header["version"], header["zero"]) == (b"\x89ETD\r\n\x1a\n", 1, 0)
    assert (header["side"], header["rays"], header["leaf"], header["width"]) == (8, 3000, 128, 40)
    assert [column["name"] for column in text["columns"]] == [
        "flux",
        "direction",
        "position",
        "wavelength",
        "additional",
    ]
    records = np.frombuffer(data, rays.records.dtype)
    assert sorted(map(bytes, records)) == sorted(map(bytes, rays.records))
    k = records["direction"].astype(float)
    k /= np.linalg.norm(k, axis=1, keepdims=True)
    x = records["position"].astype(float) * 25.4 - np.array(text["centre"])
    cells = cell_of(k, 8)
    assert np.array_equal(starts, np.searchsorted(cells, np.arange(129)))
    leaf = 0
    for cell in range(128):
        frame = frame_of(cell, 8)
        for first in range(int(starts[cell]), int(starts[cell + 1]), 128):
            own = slice(first, min(first + 128, int(starts[cell + 1])))
            direction, place = k[own] @ frame.T, x[own] @ frame.T
            u, v = (place - place[:, 2:] / direction[:, 2:] * direction)[:, :2].T
            for axis, values in enumerate((u, v, direction[:, 0], direction[:, 1])):
                low, high = bounds[leaf, 2 * axis : 2 * axis + 2]
                assert np.allclose([low, high], [values.min(), values.max()], rtol=1e-6, atol=1e-6)
                assert low <= values.min() + 1e-9
                assert high >= values.max() - 1e-9
            leaf += 1
    assert leaf == header["leaves"]


def test_everything_that_a_set_knows_comes_back(tmp_path: Path) -> None:
    rays = rays_of(500)
    built = et.RayIndex.build(rays, tmp_path / "a.etd")
    opened = et.read_rays(tmp_path / "a.etd")
    assert isinstance(opened, et.RayIndex)
    assert isinstance(opened.records, FileRecords)
    for back in (built, opened):
        assert back.records.dtype == rays.records.dtype
        assert back.header == rays.header
        assert back.complaints[0] == rays.meaning.complaints[0]
        assert (back.flux_unit, back.total_flux, back.tally) == ("W", 12.5, built.tally)
        assert back.meaning.length_scale == 25.4
        (spectrum,) = back.spectra
        assert (spectrum.wavelength.tolist(), spectrum.weight.tolist()) == ([450.0, 550.0], [1.0, 0.25])
        assert (back.provenance.source, back.provenance.format) == ("a.etd", "etd")
        assert back.provenance.steps == ("rays of memory (memory)", "indexed by direction and position")
        order, before = np.lexsort(back.position.T), np.lexsort(rays.position.T)
        for name in ("position", "direction", "flux", "wavelength"):
            assert np.array_equal(getattr(back, name)[order], getattr(rays, name)[before])
        assert np.array_equal(back.column("additional")[order], rays.column("additional")[before])


def test_an_index_of_an_index_holds_the_same_rays(tmp_path: Path) -> None:
    et.RayIndex.build(rays_of(2000), tmp_path / "a.etd")
    assert et.write_rays(tmp_path / "b.etd", et.read_rays(tmp_path / "a.etd")) == ()
    (_, one, starts, _, records), (_, two, other_starts, _, others) = (parts(tmp_path / f"{c}.etd") for c in "ab")
    assert np.array_equal(starts, other_starts)
    assert sorted(np.frombuffer(records, "V40").tolist()) == sorted(np.frombuffer(others, "V40").tolist())
    assert one["meaning"]["declared_flux"] == two["meaning"]["declared_flux"]
    assert two["meaning"]["provenance"]["steps"][-1] == "indexed by direction and position"


def refused(path: Path) -> FormatError:
    """The error that names the file, raised before much memory is set aside."""
    tracemalloc.start()
    try:
        with pytest.raises(FormatError) as caught:
            et.read_rays(path)
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()
    assert str(path) in str(caught.value)
    assert caught.value.place
    assert caught.value.advice
    return caught.value


@pytest.mark.slow
def test_every_damaged_byte_before_the_records_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    data = path.read_bytes()
    for at in range(parts(path)[0]["records"]):
        with path.open("r+b") as file:
            file.seek(at)
            file.write(bytes([data[at] ^ (1 + at % 255)]))
        refused(path)
        with path.open("r+b") as file:
            file.seek(at)
            file.write(data[at : at + 1])
    assert len(et.read_rays(path)) == 5


@pytest.mark.slow
def test_every_cut_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    for size in range(path.stat().st_size - 1, -1, -1):
        with path.open("r+b") as file:
            file.truncate(size)
        refused(path)


def test_surplus_bytes_are_found(tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    path.write_bytes(path.read_bytes() + b"\0")
    assert "describes" in refused(path).found


def sealed(data: bytearray) -> bytes:
    """A file with its checksum made right again, as somebody would who means harm."""
    data[56:60] = bytes(4)
    (records,) = struct.unpack_from("<Q", data, 48)
    data[56:60] = struct.pack("<I", zlib.crc32(data[: min(records, len(data))]))
    return bytes(data)


@pytest.mark.parametrize("value", [0, 1, 7, 2**31, 2**32 - 1, 2**63, 2**64 - 1])
@pytest.mark.parametrize("field", FIELDS[1:])
def test_absurd_numbers_are_refused(field: str, value: int, tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    data = bytearray(path.read_bytes())
    header = parts(path)[0]
    widths = dict(zip(FIELDS, (8, 4, 4, 8, 8, 4, 4, 8, 8, 4, 4), strict=True))
    value %= 256 ** widths[field]
    if header[field] == value:
        value = 9
    struct.pack_into(HEADER, data, 0, *(header | {field: value}).values())
    path.write_bytes(sealed(data) if field != "checksum" else bytes(data))
    refused(path)


def with_text(path: Path, change: Any) -> None:
    """Change the JSON text of a file, within its length, and make the checksum right again."""
    data = bytearray(path.read_bytes())
    length = parts(path)[0]["text"]
    text = change(bytes(data[64 : 64 + length]))
    assert len(text) <= length
    data[64 : 64 + length] = text.ljust(length)
    path.write_bytes(sealed(data))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"columns"', b'"column5"'),
        (b'"meaning"', b'"meanin9"'),
        (b"{", b"["),
        (b'"<f4"', b'"<f9"'),
        (b'"<f4"', b'"|O8"'),
        (b'"offset": 4', b'"offset":-9'),
        (b'"shape": [3]', b'"shape": [9]'),
        (b'"shape": [3]', b'"shape": "x"'),
        (b'"flux_unit": "W"', b'"flux_unit": "K"'),
        (b'"centre": [', b'"centre": {'),
        (b"450.0", b"-50.0"),
        (b'"length_scale"', b'"length_scal9"'),
        (b"Gr", b"\xff\xfe"),
    ],
)
def test_texts_that_make_no_index_are_refused(old: bytes, new: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    with_text(path, lambda text: text.replace(old, new, 1))
    assert "JSON" in refused(path).found


@pytest.mark.parametrize("cell", [0, 1, 60, 128])
def test_cells_that_do_not_rise_are_refused(cell: int, tmp_path: Path) -> None:
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(5), path)
    header = parts(path)[0]
    at = -(-(64 + header["text"]) // 64) * 64
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, at + 8 * cell, 2**64 - 3)
    path.write_bytes(sealed(data))
    assert "first rays" in refused(path).found


def test_boxes_of_nan_rule_nothing_out(tmp_path: Path) -> None:
    """Numbers that no comparison holds for make an index slow, not wrong."""
    path = tmp_path / "a.etd"
    rays = rays_of(20_000)
    et.RayIndex.build(rays, path)
    data = bytearray(path.read_bytes())
    bounds = parts(path)[3]
    at = bytes(data).index(bounds.tobytes())
    data[at : at + bounds.nbytes] = np.full(bounds.size, np.nan, "<f4").tobytes()
    path.write_bytes(sealed(data))
    where = et.Observer(10, 20, 500), et.Screen(200, 200, 4, 4)
    found = et.luminance_map(et.RayIndex.open(path), *where, acceptance=10)
    expected = et.luminance_map(rays, *where, method="cone", acceptance=10)
    np.testing.assert_array_equal(found.rays, expected.rays)
    assert expected.rays.sum() > 100


def test_damaged_rays_are_found_by_a_pass(tmp_path: Path) -> None:
    """Records are under no checksum, which would mean reading them all; `info` and `pass_over` look at them."""
    path = tmp_path / "a.etd"
    et.RayIndex.build(rays_of(50), path)
    data = bytearray(path.read_bytes())
    data[-40:-36] = struct.pack("<f", np.nan)
    path.write_bytes(data)
    index = et.RayIndex.open(path)
    assert index.tally.unusable == 0
    assert index.pass_over().unusable == 1
    assert any("not finite" in complaint.found for complaint in index.complaints)


def test_a_disk_without_room_is_told_before_anything_is_mapped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from etendue.formats.rays import index_file

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(index_file.os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space"):
        et.RayIndex.build(rays_of(5), tmp_path / "a.etd")
    assert list(tmp_path.iterdir()) == []


def test_room_is_made_without_the_help_of_the_system_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from etendue.formats.rays import index_file

    et.RayIndex.build(rays_of(500), tmp_path / "a.etd")
    monkeypatch.delattr(index_file.os, "posix_fallocate")
    et.RayIndex.build(rays_of(500), tmp_path / "b.etd")
    assert (tmp_path / "a.etd").read_bytes() == (tmp_path / "b.etd").read_bytes()
