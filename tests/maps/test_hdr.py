"""Maps in Radiance pictures, against a decoder written byte by byte from the format's description."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.maps import read_map, rgbe, save_map
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from hypothesis import given
from hypothesis import strategies as st
from oracles.map_files import NAN, as_stored, assert_same, decode_by_the_book, make_map


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
