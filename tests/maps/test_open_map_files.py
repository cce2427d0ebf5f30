"""Maps in TIFF, npz and CSV open without étendue."""

from __future__ import annotations

import csv as standard_csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
import tifffile
from etendue.errors import FormatError
from etendue.formats.maps import read_map, save_map
from oracles.map_files import assert_same, make_map


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
