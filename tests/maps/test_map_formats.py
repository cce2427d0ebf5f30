"""Files of luminance maps: every format of the registry goes through the same trials."""

from __future__ import annotations

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
import OpenEXR
import pytest
import tifffile
from etendue.errors import ArgumentError, FormatError, MemoryLimitError, UnknownNameError
from etendue.formats.maps import MAP_FORMATS, read_map, save_map
from etendue.quantities import memory
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles.little_memory import told
from oracles.map_files import EXACT, FLOAT32, NAN, as_stored, assert_same, make_map, path_of

ALL = pytest.mark.parametrize("name", MAP_FORMATS)


SHAPES = {
    "small": make_map(),
    "one pixel": make_map((1, 1)),
    "one row": make_map((1, 23)),
    "one column": make_map((23, 1)),
    "wide": make_map((3, 300)),
    "taller than a chunk": make_map((37, 11)),
    "radiance": make_map(flux_unit="W"),
    "pixels that err together": make_map(common_error=0.0123),
    "fixed plane": make_map(screen=Screen(5, 6, 3, 4, "xy")),
    "no ray": LuminanceMap(
        np.full((4, 9), NAN), np.full((4, 9), NAN), np.zeros((4, 9)), Observer(0, 0, 1), Screen(1, 1, 9, 4)
    ),
    "names that are no text": make_map(
        provenance=Provenance("\udcff.ray", software=""), notes=("\udcff", "", "\0", "#" * 5000)
    ),
}


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


SMALL = make_map((3, 9), provenance=Provenance(software="s"), notes=())


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small map in a file of each format: written once, and damaged in many ways."""
    folder = tmp_path_factory.mktemp("sound")
    for name in MAP_FORMATS:
        save_map(SMALL, path_of(name, folder))
    return {name: path_of(name, folder).read_bytes() for name in MAP_FORMATS}


@pytest.mark.slow
@ALL
def test_cut_at_every_byte(name: str, sound: dict[str, bytes], tmp_path: Path) -> None:
    path, whole = path_of(name, tmp_path), sound[name]
    assert len(whole) > 300
    # Headers are within the first bytes, tables of what is where within the last ones.
    for length in sorted({*range(300), *range(300, len(whole), 5), *range(len(whole) - 50, len(whole))}):
        path.write_bytes(whole[:length])
        with pytest.raises(FormatError, match="map"):
            read_map(path)


@pytest.mark.slow
@ALL
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_gives_a_format_error_or_the_right_map(
    name: str, data: st.DataObject, sound: dict[str, bytes], tmp_path: Path
) -> None:
    """Bytes overwritten, removed and inserted; absurd lengths must not set memory aside."""
    path = path_of(name, tmp_path)
    content = bytearray(sound[name])
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
        assert_same(restored, as_stored(SMALL, name))
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
    claim(path, name, rows=5555, columns=11111)
    tracemalloc.start()
    with pytest.raises(FormatError, match="61721605"):
        read_map(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6


def test_npz_sizes_that_the_file_cannot_hold_set_no_memory_aside(tmp_path: Path) -> None:
    """An archive whose directory, array headers and JSON header agree on 0.5 GB that are not there."""
    path = tmp_path / "map.npz"
    save_map(make_map((11, 12)), path)
    with np.load(path) as archive:
        header = json.loads(archive["header"].item())
    header["screen"] |= {"rows": 5555, "columns": 11111}
    arrays = io.BytesIO()
    np.lib.format.write_array_header_1_0(arrays, {"shape": (5555, 11111), "fortran_order": False, "descr": "<f8"})
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


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_csv_with_the_line_ends_of_any_system(end: bytes, tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    lmap = make_map()
    save_map(lmap, path)
    path.write_bytes(path.read_bytes().replace(b"\n", end))
    assert np.array_equal(read_map(path).values, lmap.values, equal_nan=True)
    path.write_bytes(path.read_bytes()[: -len(end) - 1])
    with pytest.raises(FormatError, match="a line cut short"):
        read_map(path)


def announcing_more(content: bytes, tag: int) -> bytes:
    """A TIFF file whose tag states 2³¹ numbers."""
    for at in range(0, len(content) - 12, 2):
        number, kind, count = struct.unpack_from("<HHI", content, at)
        if number == tag and kind in {2, 3, 4} and count < 10_000:
            return content[: at + 2] + struct.pack("<HI", 4, 1 << 31) + content[at + 8 :]
    raise AssertionError(f"no tag {tag}")


def test_tiff_tags_that_announce_more_than_the_file_has_are_refused_in_little_memory(tmp_path: Path) -> None:
    """A count of 2³¹: 8 GB of numbers, for which the library would make room."""
    whole, tags = tmp_path / "map.tif", (256, 270, 273, 305)
    save_map(make_map(), whole)
    paths = [tmp_path / f"map-{tag}.tif" for tag in tags]
    for path, tag in zip(paths, tags, strict=True):
        path.write_bytes(announcing_more(whole.read_bytes(), tag))
    found = told(
        imports="from etendue.formats.maps import read_map\nimport tifffile",
        call="read_map(path)",
        paths=paths,
        spare=300 << 20,
    )
    for line, path, tag in zip(found, paths, tags, strict=True):
        assert line.startswith(f"{path}: tag {tag}: 2,147,483,648 values"), line


def test_a_packed_tiff_is_refused_with_advice(tmp_path: Path) -> None:
    """A strip that unpacks to more than it announces would be unpacked whole."""
    path = tmp_path / "map.tif"
    save_map(make_map(), path)
    with tifffile.TiffFile(path) as file:
        pages = [page.asarray() for page in file.pages]
        text = file.pages.first.description
    with tifffile.TiffWriter(path) as writer:
        for number, page in enumerate(pages):
            writer.write(page, compression="zlib", description=None if number else text, metadata=None)
    with pytest.raises(FormatError, match=r"packed by ADOBE_DEFLATE.*without compression"):
        read_map(path)


def test_maps_that_no_memory_holds_name_file_and_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "NOTEWORTHY", 0)
    monkeypatch.setattr(memory, "available_memory", lambda: 10)
    for name in ("tiff", "exr", "hdr"):
        path = path_of(name, tmp_path)
        save_map(make_map(), path)
        with pytest.raises(MemoryLimitError, match=rf"{path.name}: a map of \d+ pixels needs"):
            read_map(path)


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


# --- numbers and archives that were made to do harm --------------------------------------------------------------------


def altered(path: Path, name: str, old: str, new: str) -> None:
    """Another text in the JSON header, of the same length if the format has no room for more."""
    save_map(make_map(), path)
    if name == "npz":
        with np.load(path) as archive:
            arrays = dict(archive)
        with path.open("wb") as stream:
            np.savez(stream, **(arrays | {"header": np.array(arrays["header"].item().replace(old, new))}))
    else:
        content = path.read_bytes()
        assert content.count(old.encode()) == 1
        path.write_bytes(content.replace(old.encode(), new.encode()))


@ALL
@pytest.mark.parametrize("number", ["1e400", "  NaN", " 1e99"])
def test_numbers_that_are_none_in_the_header(name: str, number: str, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    altered(path, name, '"distance": 812.5', f'"distance": {number}')
    with pytest.raises(FormatError, match="checksum" if "1e99" in number else "is no finite number"):
        read_map(path)


@pytest.mark.parametrize("name", ["csv", "npz"])
@pytest.mark.parametrize("number", ["9" * 6000, "-" + "9" * 400, "Infinity", "\u0663", "[" * 100_000])
def test_long_and_foreign_numbers_in_the_header(name: str, number: str, tmp_path: Path) -> None:
    path = path_of(name, tmp_path)
    altered(path, name, '"distance": 812.5', f'"distance": {number}')
    with pytest.raises(FormatError, match="not valid JSON"):
        read_map(path)


@pytest.mark.slow
def test_npz_members_are_not_unpacked_beyond_what_a_map_holds(tmp_path: Path) -> None:
    """Blanks where the JSON text should be, zeros behind the pixels; few bytes in the
    file, 120 MB unpacked."""
    long = 120 << 20
    npy = b"\x93NUMPY\x02\x00" + long.to_bytes(4, "little")
    save_map(make_map(), tmp_path / "map.npz")
    paths = []
    for member in ("header.npy", "values.npy"):
        path = tmp_path / f"long-{member}.npz"
        with zipfile.ZipFile(tmp_path / "map.npz") as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
            for name in old.namelist():
                new.writestr(name, old.read(name) if name != member else npy + b" " * long)
        assert path.stat().st_size < 1e6
        paths.append(path)
    imports = "import numpy.lib.format\nfrom etendue.formats.maps import read_map, MAP_FORMATS"
    found = told(imports=imports, call="read_map(path)", paths=paths, spare=100 << 20)
    assert [
        f"{member}: 125,829,1" in line for member, line in zip(("header.npy", "values.npy"), found, strict=True)
    ] == [
        True,
        True,
    ]


def test_maps_that_shrink_as_far_as_anything_can(tmp_path: Path) -> None:
    path = tmp_path / "dead.npz"
    lmap = make_map((600, 700))
    dead = lmap.replace(
        values=np.full((600, 700), np.nan), standard_error=np.full((600, 700), np.nan), rays=0 * lmap.rays
    )
    save_map(dead, path)
    with zipfile.ZipFile(path) as archive:
        packed = archive.getinfo("rays.npy")
    assert packed.file_size > 500 * packed.compress_size
    assert_same(read_map(path), dead)
