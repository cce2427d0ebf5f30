"""Files of luminance maps: every format of the registry goes through the same trials, then each through its own."""

from __future__ import annotations

import csv as standard_csv
import importlib
import io
import json
import math
import pkgutil
import struct
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import etendue.formats.maps
import numpy as np
import numpy.typing as npt
import OpenEXR
import pytest
import tifffile
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.formats.maps import MAP_FORMATS, read_map, rgbe, save_map
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

NAN = math.nan
ALL = pytest.mark.parametrize("name", MAP_FORMATS)
EXACT, FLOAT32 = {"npz", "csv"}, {"exr", "tiff"}


def make_map(shape: tuple[int, int] = (4, 3), seed: int = 1, **fields: Any) -> LuminanceMap:
    """No symmetry anywhere; dead, black and very bright pixels; runs of equal values; unknown errors and counts."""
    rng = np.random.default_rng(seed)
    values = rng.gamma(1.5, 2000.0, shape)
    values[:, : shape[1] // 2] = values[0, 0]
    values.flat[0] = 0.0
    values.flat[values.size // 2] = NAN
    values.flat[-1] = 3.3e7
    error = values * rng.uniform(0.01, 0.2, shape)
    error.flat[values.size // 3] = NAN
    rays = np.where(np.isnan(values), 0, rng.integers(-1, 10**6, shape))
    plain = {
        "observer": Observer(41.7, -13.2, 812.5, (0.1, -2.0, 3.0)),
        "screen": Screen(12.3, 7.7, shape[1], shape[0]),
        "provenance": Provenance("LED »x«, ü.ray", "tm25", "ab12", ("cone 1.5°", "filter"), "étendue 0.1"),
        "notes": ("first, with a comma", 'second "quoted"\nand broken'),
    }
    return LuminanceMap(values, error, rays, **(plain | fields))


SHAPES = {
    "small": make_map(),
    "one pixel": make_map((1, 1)),
    "one row": make_map((1, 23)),
    "one column": make_map((23, 1)),
    "wide": make_map((3, 300)),
    "taller than a chunk": make_map((37, 11)),
    "radiance": make_map(flux_unit="W"),
    "fixed plane": make_map(screen=Screen(5, 6, 3, 4, "xy")),
    "no ray": LuminanceMap(
        np.full((4, 9), NAN), np.full((4, 9), NAN), np.zeros((4, 9)), Observer(0, 0, 1), Screen(1, 1, 9, 4)
    ),
    "names that are no text": make_map(
        provenance=Provenance("\udcff.ray", software=""), notes=("\udcff", "", "\0", "#" * 5000)
    ),
}


def path_of(name: str, folder: Path) -> Path:
    return folder / f"map{MAP_FORMATS[name].extensions[0]}"


def as_stored(lmap: LuminanceMap, name: str) -> LuminanceMap:
    """What a file of this format can hold of a map, worked out independently of the writers."""
    if name in EXACT:
        return lmap
    if name in FLOAT32:
        values, error = (a.astype(np.float32).astype(np.float64) for a in (lmap.values, lmap.standard_error))
        return lmap.replace(values=values, standard_error=error)
    assert name == "hdr"
    unit = 179.0 if lmap.flux_unit == "lm" else 1.0
    values = np.vectorize(lambda value: eight_bits(value / unit) * unit, otypes=[float])(lmap.values)
    dead = np.isnan(lmap.values)
    return lmap.replace(values=values, standard_error=np.full(values.shape, NAN), rays=np.where(dead, 0, -1))


def eight_bits(value: float) -> float:
    if math.isnan(value) or value == 0.0:
        return value
    step = 2.0 ** (math.floor(math.log2(value)) - 7)
    return (math.floor(value / step) + 0.5) * step


def assert_same(one: LuminanceMap, other: LuminanceMap) -> None:
    for field in ("values", "standard_error", "rays"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    assert one.header() == other.header()


# --- every format ----------------------------------------------------------------------------------------------------


def test_the_registry_holds_every_module_that_has_a_format() -> None:
    assert set(MAP_FORMATS) == {"exr", "hdr", "tiff", "npz", "csv"}
    package = etendue.formats.maps
    modules = [
        importlib.import_module(f"{package.__name__}.{info.name}") for info in pkgutil.iter_modules(package.__path__)
    ]
    assert {m.FORMAT.name for m in modules if hasattr(m, "FORMAT")} == set(MAP_FORMATS)
    extensions = [extension for entry in MAP_FORMATS.values() for extension in entry.extensions]
    assert len(set(extensions)) == len(extensions) >= 5


@ALL
@pytest.mark.parametrize("which", SHAPES)
def test_round_trip(name: str, which: str, tmp_path: Path) -> None:
    lmap, path = SHAPES[which], path_of(name, tmp_path)
    lost = lmap.save(path)
    stored = as_stored(lmap, name)
    assert_same(read_map(path), stored)
    unchanged = np.array_equal(stored.values, lmap.values, equal_nan=True)
    unchanged &= np.array_equal(stored.standard_error, lmap.standard_error, equal_nan=True)
    assert bool(lost) == (name == "hdr" or not unchanged)
    assert list(tmp_path.iterdir()) == [path]


@ALL
def test_what_was_read_is_written_without_further_loss(name: str, tmp_path: Path) -> None:
    first, second = path_of(name, tmp_path), path_of(name, tmp_path).with_stem("again")
    save_map(make_map((5, 40)), first)
    save_map(read_map(first), second)
    assert first.read_bytes() == second.read_bytes()


@ALL
def test_the_content_decides_not_the_extension(name: str, tmp_path: Path) -> None:
    save_map(make_map(), path_of(name, tmp_path))
    disguised = path_of(name, tmp_path).rename(tmp_path / "map.dat")
    assert_same(read_map(disguised), as_stored(make_map(), name))


@ALL
def test_each_extension_saves_in_its_format(name: str, tmp_path: Path) -> None:
    for extension in MAP_FORMATS[name].extensions:
        path = tmp_path / f"map{extension.upper()}"
        save_map(make_map(), path)
        assert [entry.name for entry in MAP_FORMATS.values() if entry.sniff(path.read_bytes()[:64])] == [name]


@ALL
def test_cut_at_every_byte(name: str, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    save_map(make_map((3, 9), provenance=Provenance(software="s"), notes=()), path)
    whole = path.read_bytes()
    assert len(whole) > 300
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(FormatError, match="map"):
            read_map(path)


@ALL
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_gives_a_format_error_or_the_right_map(name: str, data: st.DataObject, tmp_path: Path) -> None:
    """Bytes overwritten, removed and inserted; absurd lengths must not set memory aside."""
    path = path_of(name, tmp_path)
    lmap = make_map((3, 9), provenance=Provenance(software="s"), notes=())
    save_map(lmap, path)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        new = data.draw(st.binary(max_size=6) | st.sampled_from([b"\xff\xff\xff\x7f", b"\xff" * 8, b"\0" * 4]))
        content[at : at + data.draw(st.integers(0, 8))] = new
    path.write_bytes(content)
    tracemalloc.start()
    try:
        restored = read_map(path)
    except FormatError as error:
        assert str(path) in str(error)  # noqa: PT017 - either outcome is right
    else:
        assert_same(restored, as_stored(lmap, name))
    finally:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert peak < 50e6


def claim(path: Path, name: str, rows: int, columns: int) -> None:
    """Alter a file of 11 x 12 pixels so that it claims another size wherever a size is written."""
    content = path.read_bytes()
    for key, old, new in (("rows", 11, rows), ("columns", 12, columns)):
        text = f'"{key}": {old}'.encode()
        assert content.count(text) == 1
        # Blanks elsewhere make room, so that lengths stored in the file stay true.
        content = content.replace(text, f'"{key}":{new}'.encode())
        content = content.replace(b', "', b',"', len(str(new)) - len(str(old)) - 1)
    if name == "hdr":
        assert content.count(b"-Y 11 +X 12") == 1
        content = content.replace(b"-Y 11 +X 12", f"-Y {rows} +X {columns}".encode())
    elif name == "exr":
        window = struct.pack("<4i", 0, 0, 11, 10)
        assert content.count(window) == 2
        content = content.replace(window, struct.pack("<4i", 0, 0, columns - 1, rows - 1))
    elif name == "tiff":
        for tag, old, new in ((256, 12, columns), (257, 11, rows), (278, 11, rows)):
            entry = struct.pack("<HHII", tag, 4, 1, old)
            assert content.count(entry) == 3
            content = content.replace(entry, struct.pack("<HHII", tag, 4, 1, new))
    path.write_bytes(content)


@pytest.mark.parametrize("name", sorted(set(MAP_FORMATS) - {"npz"}))
def test_sizes_that_the_file_cannot_hold_set_no_memory_aside(name: str, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    save_map(make_map((11, 12)), path)
    claim(path, name, rows=11111, columns=22222)
    tracemalloc.start()
    with pytest.raises(FormatError, match="246908642"):
        read_map(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


def test_npz_sizes_that_the_file_cannot_hold_set_no_memory_aside(tmp_path: Path) -> None:
    """An archive whose directory, array headers and JSON header agree on 2 GB that are not there."""
    path = tmp_path / "map.npz"
    save_map(make_map((11, 12)), path)
    with np.load(path) as archive:
        header = json.loads(archive["header"].item())
    header["screen"] |= {"rows": 11111, "columns": 22222}
    arrays = io.BytesIO()
    np.lib.format.write_array_header_1_0(arrays, {"shape": (11111, 22222), "fortran_order": False, "descr": "<f8"})
    text = io.BytesIO()
    np.save(text, np.array(json.dumps(header)))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", text.getvalue())
        for name in ("values", "standard_error", "rays"):
            archive.writestr(f"{name}.npy", arrays.getvalue())
    tracemalloc.start()
    with pytest.raises(FormatError, match=r"array 'values'|zip archive"):
        read_map(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


@ALL
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"etendue_map": 1', '"etendue_map": 2'),
        ('"theta": 41.7', '"theta": 41.8'),
        ('"flux_unit": "lm"', '"flux_unit": "kg"'),
        ('"phi": -13.2', '"phi": "low"'),
    ],
)
def test_altered_headers_are_refused(name: str, old: str, new: str, tmp_path: Path) -> None:
    """Geometry is as much part of a map as its pixels: the checksum covers both."""
    path = path_of(name, tmp_path)
    save_map(make_map(), path)
    if name == "npz":
        with np.load(path) as archive:
            arrays = dict(archive)
        np.savez(path, **(arrays | {"header": np.array(arrays["header"].item().replace(old, new))}))
    else:
        content = path.read_bytes()
        assert content.count(old.encode()) == 1
        path.write_bytes(content.replace(old.encode(), new.ljust(len(old)).encode()))
    with pytest.raises(FormatError, match="update it" if "etendue_map" in old else "checksum"):
        read_map(path)


@pytest.mark.parametrize("field", ["value", "standard_error", "rays"])
def test_the_checksum_covers_every_array(field: str, tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    save_map(make_map(), path)
    *lines, last = path.read_text("ascii").splitlines()
    cells = dict(zip(lines[2].split(","), last.split(","), strict=True))
    cells[field] = "1" + cells[field]
    path.write_text("\n".join((*lines, ",".join(cells.values()), "")), "ascii")
    with pytest.raises(FormatError, match="checksum"):
        read_map(path)


@ALL
def test_failure_keeps_the_old_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = path_of(name, tmp_path)
    path.write_bytes(b"old")

    def fail(_: LuminanceMap) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(LuminanceMap, "header", fail)
    with pytest.raises(KeyboardInterrupt):
        save_map(make_map(), path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n", b"{}", b"PK", b"v/1", b"\0" * 100, bytes(range(256))])
def test_other_files_are_refused_with_the_list_of_formats(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "map.exr"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=r"map\.exr: first bytes: .*\.exr.*\.hdr.*\.tif.*\.npz.*\.csv"):
        read_map(path)


def test_a_missing_file_is_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_map(tmp_path / "map.exr")


def test_unknown_extensions_get_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"Did you mean '\.exr'"):
        save_map(make_map(), tmp_path / "map.exrr")
    with pytest.raises(ArgumentError, match="does not exist"):
        save_map(make_map(), tmp_path / "absent" / "map.exr")


def test_numpy_scalars_in_the_geometry(tmp_path: Path) -> None:
    observer = Observer(np.float32(30), np.int64(5), np.float64(1000))  # type: ignore[arg-type]
    save_map(make_map(observer=observer), tmp_path / "map.csv")
    assert read_map(tmp_path / "map.csv").observer == Observer(30, 5, 1000)


# --- files of other makers -------------------------------------------------------------------------------------------


def foreign_exr(path: Path) -> None:
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"Y": np.ones((4, 5), np.float32)}) as file:
        file.write(str(path))


def foreign_hdr(path: Path) -> None:
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes(8))


def foreign_rgbe(path: Path) -> None:
    path.write_bytes(b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes(8))


def foreign_tiff(path: Path) -> None:
    tifffile.imwrite(path, np.ones((4, 5), np.float32), description="a photograph")


def foreign_npz(path: Path) -> None:
    with path.open("wb") as stream:
        np.savez(stream, values=np.ones((4, 5)))


@pytest.mark.parametrize("write", [foreign_exr, foreign_hdr, foreign_rgbe, foreign_tiff, foreign_npz])
def test_files_without_our_header_are_told_what_they_lack(write: Any, tmp_path: Path) -> None:
    write(tmp_path / "map")
    with pytest.raises(FormatError, match="observer, screen size and unit"):
        read_map(tmp_path / "map")


# --- limits of the number types --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(FLOAT32 | {"hdr"}))
def test_numbers_that_do_not_fit_are_refused(name: str, tmp_path: Path) -> None:
    lmap = LuminanceMap([[1e41, 1.0]], [[1.0, 1.0]], [[1, 1]], Observer(0, 0, 1), Screen(2, 1, 2, 1))
    with pytest.raises(ArgumentError, match=r"1e\+41.*Save it as \.npz or \.csv|5\.58\d*e\+38.*Save it as \.npz"):
        save_map(lmap, path_of(name, tmp_path))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", sorted(FLOAT32))
def test_ray_counts_beyond_32_bits_are_clipped_and_told(name: str, tmp_path: Path) -> None:
    lmap = LuminanceMap([[1.0, 2.0]], [[0.5, 0.5]], [[2**32 - 2, 2**40]], Observer(0, 0, 1), Screen(2, 1, 2, 1))
    assert save_map(lmap, path_of(name, tmp_path)) == ("ray counts above 4294967294 are written as 4294967294",)
    assert read_map(path_of(name, tmp_path)).rays.tolist() == [[2**32 - 2] * 2]


@pytest.mark.parametrize("name", sorted(EXACT))
def test_exact_formats_hold_every_float64(name: str, tmp_path: Path) -> None:
    values = np.array([[5e-324, 1.7976931348623157e308, 0.1, -0.0, math.inf, 2.0**-1074 * 3]])
    lmap = LuminanceMap(values, values[:, ::-1], [[-1, 0, 2**62, 1, 2, 3]], Observer(0, 0, 1), Screen(6, 1, 6, 1))
    assert save_map(lmap, path_of(name, tmp_path)) == ()
    restored = read_map(path_of(name, tmp_path))
    assert restored.values.tobytes() == lmap.values.tobytes()
    assert restored.standard_error.tobytes() == lmap.standard_error.tobytes()
    assert restored.rays.tolist() == lmap.rays.tolist()


# --- OpenEXR ---------------------------------------------------------------------------------------------------------


def test_exr_agrees_with_the_library(tmp_path: Path) -> None:
    lmap, path = make_map((37, 11)), tmp_path / "map.exr"
    save_map(lmap, path)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        header = dict(file.header())
    np.testing.assert_array_equal(channels["Y"], lmap.values.astype(np.float32))
    np.testing.assert_array_equal(channels["standard_error"], lmap.standard_error.astype(np.float32))
    np.testing.assert_array_equal(channels["rays"], np.where(lmap.rays < 0, 2**32 - 1, lmap.rays))
    assert channels["rays"].dtype == np.uint32
    assert header["unit"] == "cd/m²"
    assert header["observerTheta"] == pytest.approx(41.7, rel=1e-6)
    assert header["observerTarget"].tolist() == pytest.approx([0.1, -2.0, 3.0])
    assert header["pixelAspectRatio"] == pytest.approx((12.3 / 11) / (7.7 / 37))
    assert "second" in header["comments"]


def resave_exr(path: Path, extra: dict[str, Any], channels: dict[str, npt.NDArray[Any]]) -> None:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = {key: value for key, value in file.header().items() if key not in {"channels", "dataWindow"}}
        pixels = {name: channel.pixels for name, channel in file.channels().items()}
    with OpenEXR.File(header | extra, pixels | channels) as file:
        file.write(str(path))


@pytest.mark.parametrize("compression", ["NO_COMPRESSION", "ZIPS_COMPRESSION", "ZIP_COMPRESSION"])
def test_exr_packed_otherwise_and_with_more_channels(compression: str, tmp_path: Path) -> None:
    lmap, path = make_map((37, 11)), tmp_path / "map.exr"
    save_map(lmap, path)
    half = np.random.default_rng(2).random((37, 11)).astype(np.float16)
    resave_exr(path, {"compression": getattr(OpenEXR, compression)}, {"Z": half})
    assert_same(read_map(path), as_stored(lmap, "exr"))


def test_exr_with_lossy_or_foreign_packing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.exr"
    save_map(make_map(), path)
    resave_exr(path, {"compression": OpenEXR.PIZ_COMPRESSION}, {})
    with pytest.raises(FormatError, match="compression: number 4"):
        read_map(path)


def test_exr_with_changed_pixels_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.exr"
    save_map(make_map(), path)
    resave_exr(path, {}, {"Y": np.ones((4, 3), np.float32)})
    with pytest.raises(FormatError, match="checksum"):
        read_map(path)
    resave_exr(path, {}, {"Y": np.ones((4, 3), np.float16)})
    with pytest.raises(FormatError, match="channel 'Y'"):
        read_map(path)


# --- TIFF, npz, csv --------------------------------------------------------------------------------------------------


def test_tiff_has_three_pages(tmp_path: Path) -> None:
    lmap, path = make_map((5, 7)), tmp_path / "map.tif"
    save_map(lmap, path)
    with tifffile.TiffFile(path) as file:
        pages = [page.asarray() for page in file.pages]
        names = [page.tags["PageName"].value for page in file.pages]
        resolution = file.pages[0].resolution
    assert names == ["values", "standard_error", "rays"]
    assert [page.dtype for page in pages] == [np.float32, np.float32, np.uint32]
    np.testing.assert_array_equal(pages[0], lmap.values.astype(np.float32))
    np.testing.assert_array_equal(pages[1], lmap.standard_error.astype(np.float32))
    np.testing.assert_array_equal(pages[2], np.where(lmap.rays < 0, 2**32 - 1, lmap.rays))
    assert resolution == pytest.approx((10 * 7 / 12.3, 10 * 5 / 7.7), rel=1e-6)


def test_npz_opens_with_numpy_alone(tmp_path: Path) -> None:
    lmap = make_map()
    save_map(lmap, tmp_path / "map.npz")
    with np.load(tmp_path / "map.npz") as archive:
        np.testing.assert_array_equal(archive["values"], lmap.values)
        assert json.loads(archive["header"].item())["observer"]["theta"] == 41.7


def test_csv_opens_with_any_reader(tmp_path: Path) -> None:
    lmap = make_map()
    save_map(lmap, tmp_path / "map.csv")
    lines = (tmp_path / "map.csv").read_text("ascii").splitlines()
    rows = list(standard_csv.DictReader(io.StringIO("\n".join(line for line in lines if not line.startswith("#")))))
    assert len(rows) == 12
    for index, row in enumerate(rows):
        y, x = divmod(index, 3)
        assert (int(row["row"]), int(row["column"])) == (y, x)
        assert (float(row["x_mm"]), float(row["y_mm"])) == (lmap.screen.x[x], lmap.screen.y[y])
        np.testing.assert_equal(float(row["value"]), lmap.values[y, x])
        np.testing.assert_equal(float(row["standard_error"]), lmap.standard_error[y, x])
        assert int(row["rays"]) == lmap.rays[y, x]


def test_csv_with_the_line_ends_of_another_system(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    save_map(make_map(), path)
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert_same(read_map(path), make_map())


def test_csv_in_another_order_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    save_map(make_map(), path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join((*lines[:3], *lines[:2:-1])))
    with pytest.raises(FormatError, match="count up"):
        read_map(path)


# --- Radiance --------------------------------------------------------------------------------------------------------


def decode_by_the_book(data: bytes) -> tuple[list[str], npt.NDArray[np.int64]]:
    """Header lines and RGBE bytes (rows, columns, 4), byte by byte from "Radiance File Formats"."""
    header, _, rest = data.partition(b"\n\n")
    resolution, _, rest = rest.partition(b"\n")
    _, rows, _, columns = resolution.split()
    height, width = int(rows), int(columns)
    pixels = np.zeros((height, width, 4), dtype=np.int64)
    stream = iter(rest)
    for line in range(height):
        if 8 <= width < 32768:
            assert (next(stream), next(stream), 256 * next(stream) + next(stream)) == (2, 2, width)
            for component in range(4):
                column = 0
                while column < width:
                    code = next(stream)
                    if code > 128:
                        value, count = next(stream), code - 128
                        pixels[line, column : column + count, component] = value
                    else:
                        count = code
                        for offset in range(count):
                            pixels[line, column + offset, component] = next(stream)
                    column += count
                assert column == width
        else:
            for column in range(width):
                pixels[line, column] = [next(stream) for _ in range(4)]
    assert next(stream, None) is None
    return header.decode("ascii").split("\n"), pixels


@pytest.mark.parametrize("shape", [(4, 3), (3, 7), (5, 8), (3, 300), (2, 1000)])
@pytest.mark.parametrize("flux_unit", ["lm", "W"])
def test_hdr_by_the_book(shape: tuple[int, int], flux_unit: Any, tmp_path: Path) -> None:
    """Luminance is 179 times any channel, within the half step of 8 bits, and dead pixels are all zero."""
    lmap = make_map(shape, flux_unit=flux_unit)
    save_map(lmap, tmp_path / "map.hdr")
    header, pixels = decode_by_the_book((tmp_path / "map.hdr").read_bytes())
    assert header[0] == "#?RADIANCE"
    assert "FORMAT=32-bit_rle_rgbe" in header
    assert max(map(len, header)) < 2048
    assert (pixels[..., 0] == pixels[..., 1]).all()
    assert (pixels[..., 0] == pixels[..., 2]).all()
    dead, black = np.isnan(lmap.values), lmap.values == 0.0
    assert (pixels[dead] == 0).all()
    assert (pixels[black] == [0, 0, 0, 1]).all()
    lit = ~dead & ~black
    value = (pixels[lit][:, 0] + 0.5) * 2.0 ** (pixels[lit][:, 3] - 136) * (179.0 if flux_unit == "lm" else 1.0)
    np.testing.assert_allclose(value, lmap.values[lit], rtol=1 / 256)
    assert (pixels[lit][:, 0] >= 128).all()


def test_hdr_run_lengths_pack() -> None:
    assert rgbe.pack_line((np.full(300, 7, np.uint8),) * 4) == b"\2\2\1\x2c" + 4 * bytes((255, 7, 255, 7, 174, 7))


@given(data=st.data(), columns=st.integers(8, 700))
def test_hdr_scan_lines_survive(data: st.DataObject, columns: int) -> None:
    runs = data.draw(st.lists(st.tuples(st.integers(1, 300), st.integers(0, 3)), min_size=4 * columns // 300 + 1))
    stream = np.resize(np.repeat([value for _, value in runs], [count for count, _ in runs]), (4, columns))
    line = stream.astype(np.uint8)
    packed = rgbe.pack_line(tuple(line))
    np.testing.assert_array_equal(rgbe.unpack_lines(packed, 1, columns), line[None])
    assert len(packed) <= 4 + 4 * (columns + columns // 128 + 1)


def test_hdr_values_at_the_limits() -> None:
    values = np.array(
        [2.0**-128, np.nextafter(2.0**127, 0), 1.0, np.nextafter(1.0, 0), np.nextafter(2.0**-128, 0), -1.0]
    )
    mantissa, exponent = rgbe.encode_grey(values)
    assert mantissa.tolist() == [128, 255, 128, 255, 0, 0]
    assert exponent.tolist() == [1, 255, 129, 128, 1, 1]
    np.testing.assert_allclose(rgbe.decode(mantissa, exponent)[:4], values[:4], rtol=1 / 256)
    assert rgbe.decode(mantissa, exponent)[4:].tolist() == [0.0, 0.0]


def test_hdr_tells_about_values_it_cannot_hold(tmp_path: Path) -> None:
    lmap = LuminanceMap([[-5.0, 1e-37, 1.0]], [[1.0] * 3], [[1] * 3], Observer(0, 0, 1), Screen(3, 1, 3, 1))
    lost = save_map(lmap, tmp_path / "map.hdr")
    assert [sentence.split()[0] for sentence in lost] == ["a", "values", "values"]
    assert read_map(tmp_path / "map.hdr").values[0, :2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("columns", [5, 30])
def test_hdr_reader_takes_flat_scan_lines_and_colours(columns: int, tmp_path: Path) -> None:
    """A tool may write the same picture flat, or tint it; the luminance is Radiance's mean of the colours."""
    path = tmp_path / "map.hdr"
    save_map(make_map((4, columns)), path)
    header, pixels = decode_by_the_book(path.read_bytes())
    head = "\n".join(header).encode()
    flat = head + f"\n\n-Y        4 +X {columns:8}\n".encode() + pixels.astype(np.uint8).tobytes()
    path.write_bytes(flat)
    assert_same(read_map(path), as_stored(make_map((4, columns)), "hdr"))
    pixels[..., 0] //= 2
    path.write_bytes(head + b"\nEXPOSURE=1\n\n" + f"-Y 4 +X {columns}\n".encode() + pixels.astype(np.uint8).tobytes())
    weighted = pixels[..., :3] @ [0.265074126, 0.670114631, 0.064811243]
    expected = np.where(weighted > 0, (weighted + 0.5) * 2.0 ** (pixels[..., 3] - 136) * 179, 0.0)
    expected[pixels[..., 3] == 0] = NAN
    np.testing.assert_allclose(read_map(path).values, expected, rtol=1e-12)


def test_hdr_exposures_multiply_and_are_divided_out(tmp_path: Path) -> None:
    path, lmap = tmp_path / "map.hdr", make_map()
    save_map(lmap, path)
    plain = read_map(path)
    path.write_bytes(path.read_bytes().replace(b"\n\n", b"\nEXPOSURE=4\nEXPOSURE= 5.0e-1\n\n", 1))
    changed = read_map(path)
    np.testing.assert_array_equal(changed.values, plain.values / 2)
    assert changed.notes[-1] == "another tool changed the exposure to 2; it was divided out"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"FORMAT=32-bit_rle_rgbe", b"FORMAT=32-bit_rle_xyze"),
        (b"\n\n", b"\nCOLORCORR=1 2 1\n\n"),
        (b"\n\n", b"\nEXPOSURE=0\n\n"),
        (b"\n\n", b"\nEXPOSURE=nan\n\n"),
        (b"\n\n", b"\nEXPOSURE=much\n\n"),
        (b"-Y 4 +X 3", b"-Y 4 -X 3"),
        (b"-Y 4 +X 3", b"-Y 3 +X 4"),
    ],
)
def test_hdr_that_means_something_else_is_refused(old: bytes, new: bytes, tmp_path: Path) -> None:
    path = tmp_path / "map.hdr"
    save_map(make_map(), path)
    content = path.read_bytes()
    assert content.count(old) == 1
    path.write_bytes(content.replace(old, new))
    with pytest.raises(FormatError):
        read_map(path)


def test_hdr_with_the_oldest_run_lengths_is_refused() -> None:
    with pytest.raises(ValueError, match="1991"):
        rgbe.unpack_lines(bytes((9, 9, 9, 9, 1, 1, 1, 3)), 1, 2)


def view_of(path: Path) -> dict[str, list[float]]:
    """Options of the VIEW line, by name."""
    (line,) = (line for line in path.read_bytes().split(b"\n") if line.startswith(b"VIEW="))
    options: dict[str, list[float]] = {}
    for word in line.decode().split()[1:]:
        if word[0] == "-" and word[1].isalpha():
            options[name := word] = []
        else:
            options[name].append(float(word))
    return options


@pytest.mark.parametrize(
    ("observer", "screen"),
    [
        (Observer(40, 70, 300, (1, 2, 3)), Screen(30, 20, 12, 9)),
        (Observer(180, 25, 100), Screen(10, 20, 5, 10)),
        (Observer(50, 200, 150), Screen(70, 60, 14, 9, "xy")),
        (Observer(0, 0, 5, (0, 0, 7)), Screen(70, 60, 14, 9, "xy")),
        (Observer(40, 70, 1e9), Screen(30, 20, 12, 9)),
    ],
)
def test_hdr_view_sees_the_pixels(observer: Observer, screen: Screen, tmp_path: Path) -> None:
    """Rays through the pixels, computed as Radiance's `viewray` does, pass through the pixel centres of the screen."""
    ones = np.ones(screen.shape)
    save_map(LuminanceMap(ones, ones, ones, observer, screen), tmp_path / "map.hdr")
    view = view_of(tmp_path / "map.hdr")
    eye, ahead, up = (np.array(view[name]) for name in ("-vp", "-vd", "-vu"))
    right = np.cross(ahead, up)
    right, up = right / np.linalg.norm(right), np.cross(right, ahead) / np.linalg.norm(np.cross(right, ahead))
    x = (np.arange(screen.columns) + 0.5) / screen.columns - 0.5 + view.get("-vs", [0.0])[0]
    y = 0.5 - (np.arange(screen.rows) + 0.5) / screen.rows + view.get("-vl", [0.0])[0]
    parallel = "-vtl" in view
    assert parallel == (observer.distance > 1e6)
    width, height = (
        view[name][0] if parallel else 2 * math.tan(math.radians(view[name][0] / 2)) for name in ("-vh", "-vv")
    )
    aside = x[None, :, None] * width * right + y[:, None, None] * height * up
    origin, direction = (eye + aside, ahead) if parallel else (eye, ahead + aside)
    direction = np.broadcast_to(direction / np.linalg.norm(direction, axis=-1, keepdims=True), aside.shape)
    screen_right, screen_up, _ = screen.axes(observer)
    centres = observer.target + screen.x[None, :, None] * screen_right + screen.y[:, None, None] * screen_up
    missed_by = np.linalg.norm(np.cross(centres - origin, direction), axis=-1)
    assert missed_by.max() < 1e-4 * screen.width / screen.columns


@pytest.mark.parametrize(
    ("observer", "screen"),
    [
        (Observer(130, 0, 100), Screen(3, 3, 3, 3, "xy")),
        (Observer(30, 0, 1e9), Screen(3, 3, 3, 3, "xy")),
        (Observer(0, 0, 1e-6), Screen(3, 3, 3, 3)),
    ],
)
def test_hdr_without_a_view_says_so(observer: Observer, screen: Screen, tmp_path: Path) -> None:
    ones = np.ones(screen.shape)
    lost = save_map(LuminanceMap(ones, ones, ones, observer, screen), tmp_path / "map.hdr")
    assert "no VIEW" in lost[-1]
    assert b"VIEW=" not in (tmp_path / "map.hdr").read_bytes()
