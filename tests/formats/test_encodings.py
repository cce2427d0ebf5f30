"""Encodings of text files: read where a mark makes them certain, refused by name where they only seem to be one."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.description.files import read_columns
from etendue.errors import FormatError
from etendue.formats.encodings import decoded, in_utf8, unmarked_encoding, wide_encoding
from hypothesis import given
from hypothesis import strategies as st

MARKED = pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-32"])
UNMARKED = pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"])
TEXT_FORMATS = pytest.mark.parametrize(
    "format_name", ["csv", "zemax-text", "lighttools-text", "speos-text", "tracepro"]
)


def rays() -> et.RaySet:
    return et.RaySet(
        [[1, 2, 3]] * 40, [[0, 0, 1]] * 40, np.linspace(1, 2, 40), flux_unit="W", wavelength=np.full(40, 500.0)
    )


def recoded(path: Path, encoding: str) -> None:
    path.write_bytes(path.read_bytes().decode("ascii").encode(encoding))


@MARKED
@TEXT_FORMATS
def test_ray_files_with_a_mark(format_name: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "led.txt"
    et.write_rays(path, rays(), format_name)
    plain = et.read_rays(path)
    recoded(path, encoding)
    again = et.read_rays(path)
    assert np.array_equal(again.flux, plain.flux)
    assert np.array_equal(again.position, plain.position)
    assert again.provenance.source == "led.txt"


@UNMARKED
@TEXT_FORMATS
def test_ray_files_without_a_mark(format_name: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "led.txt"
    et.write_rays(path, rays(), format_name)
    recoded(path, encoding)
    with pytest.raises(FormatError, match=f"led.txt: byte 0: text in {encoding.upper()} without"):
        et.read_rays(path)


def test_errors_name_the_file_itself(tmp_path: Path) -> None:
    path = tmp_path / "led.csv"
    et.write_rays(path, rays(), "csv")
    path.write_bytes(path.read_text(encoding="ascii").replace("1,2,3", "1,x,3", 3).encode("utf-16"))
    with pytest.raises(FormatError) as error:
        et.read_rays(path)
    assert str(error.value).startswith(f"{path}: ")
    (tmp_path / "cut.csv").write_bytes("x,y,z,l,m,n,flux\n".encode("utf-16")[:-1])
    with pytest.raises(FormatError, match="no UTF-16-LE"):
        et.read_rays(tmp_path / "cut.csv")


@MARKED
def test_maps_and_tables_with_a_mark(encoding: str, tmp_path: Path) -> None:
    lmap = et.LuminanceMap([[1.5]], [[0.1]], [[9]], et.Observer(0, 0, 9), et.Screen(1, 1, 1, 1))
    lmap.save(tmp_path / "map.csv")
    recoded(tmp_path / "map.csv", encoding)
    assert et.read_map(tmp_path / "map.csv").values.tolist() == [[1.5]]
    (tmp_path / "index.csv").write_bytes("400; 1.6\r700; 1.4 # größer\r".encode(encoding))
    assert read_columns(tmp_path / "index.csv").tolist() == [[400.0, 1.6], [700.0, 1.4]]


@UNMARKED
def test_maps_and_tables_without_a_mark(encoding: str, tmp_path: Path) -> None:
    lmap = et.LuminanceMap([[1.5]], [[0.1]], [[9]], et.Observer(0, 0, 9), et.Screen(1, 1, 1, 1))
    lmap.save(tmp_path / "map.csv")
    recoded(tmp_path / "map.csv", encoding)
    (tmp_path / "index.csv").write_bytes("400; 1.6\n700; 1.4\n".encode(encoding))
    for read, name in ((et.read_map, "map.csv"), (read_columns, "index.csv")):
        with pytest.raises(FormatError, match=encoding.upper()):
            read(tmp_path / name)


@given(st.binary(max_size=40), st.sampled_from([b"", b"\xff\xfe", b"\xfe\xff", b"\xff\xfe\0\0", b"\0\0\xfe\xff"]))
def test_any_bytes_are_a_text_or_an_error(data: bytes, mark: bytes) -> None:
    wide_encoding(mark + data)
    unmarked_encoding(mark + data)
    try:
        decoded(Path("a"), mark + data)
    except FormatError:
        return


def test_nothing_is_copied_without_need(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"1,2\n")
    with in_utf8(tmp_path / "a.csv") as path:
        assert path == tmp_path / "a.csv"
