"""Maps in OpenEXR files, against the OpenEXR library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR
import pytest
from etendue.errors import FormatError
from etendue.formats.maps import read_map, save_map
from oracles.map_files import as_stored, assert_same, make_map


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


def test_exr_with_many_channels_is_refused(tmp_path: Path) -> None:
    """The library unpacks every channel, and a few bytes of a file may be a channel of zeros."""
    path = tmp_path / "map.exr"
    save_map(make_map(), path)
    resave_exr(path, {}, {f"c{number:02}": np.zeros((4, 3), np.float32) for number in range(10)})
    with pytest.raises(FormatError, match=r"channels: 13 channels, expected Y, rays, standard_error"):
        read_map(path)


def test_exr_with_damaged_pixels_says_why_and_prints_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.exr"
    save_map(make_map((37, 11)), path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FormatError, match=r"map\.exr: pixels: .*[Uu]nable to"):
        read_map(path)
    assert capsys.readouterr().out == ""
