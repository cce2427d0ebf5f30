"""Records that are gathered in memory or in a file without a name: the same records, and nothing left behind."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import tempfile
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from etendue.quantities.spool import spool
from hypothesis import given, settings
from hypothesis import strategies as st

DTYPE = np.dtype([("position", "<f8", 3), ("flux", "<f4"), ("tag", "<i2")])


def stretch(start: int, n: int) -> np.ndarray:
    part = np.zeros(n, DTYPE)
    part["flux"] = np.arange(start, start + n)
    part["position"][:, 1] = np.arange(start, start + n) * 0.5
    part["tag"] = -7
    return part


def stretches(sizes: list[int]) -> Iterator[np.ndarray]:
    start = 0
    for n in sizes:
        yield stretch(start, n)
        start += n


def open_files(folder: Path) -> list[Path]:
    """Files in this folder that this process has open, with or without a name."""
    opened = []
    for entry in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # the one of the listing itself is closed by now
            opened.append(entry.readlink())
    return [path for path in opened if path.is_relative_to(folder)]


@settings(derandomize=True, deadline=None, max_examples=150)
@given(st.lists(st.integers(0, 50), max_size=12), st.integers(0, 6000))
def test_gathers_the_stretches_in_order_whatever_the_limit(sizes: list[int], limit: int) -> None:
    gathered = spool(stretches(sizes), DTYPE, memory_limit=limit)
    np.testing.assert_array_equal(gathered, stretch(0, sum(sizes)))
    assert gathered.dtype == DTYPE
    in_file = sum(sizes) * DTYPE.itemsize > limit
    assert isinstance(gathered, np.memmap) == in_file
    assert not gathered.flags.writeable


def test_converts_the_stretches_to_the_asked_type() -> None:
    wide = np.dtype([("position", "<f8", 3), ("flux", "<f8"), ("tag", "<i2")])
    for limit in (0, 1 << 20):
        np.testing.assert_array_equal(spool(stretches([3, 4]), wide, memory_limit=limit), stretch(0, 7).astype(wide))


def test_strided_stretches_are_gathered_too() -> None:
    for limit in (0, 1 << 20):
        np.testing.assert_array_equal(
            spool([stretch(0, 20)[::3]], DTYPE, memory_limit=limit)["flux"], np.arange(0, 20, 3)
        )


def test_nothing_is_left_in_the_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gathered = spool(stretches([1000] * 5), DTYPE, memory_limit=1000)
    assert isinstance(gathered, np.memmap)
    assert list(tmp_path.iterdir()) == []  # the file has no name from the start
    assert len(open_files(tmp_path)) >= 1
    assert gathered["flux"][-1] == 4999
    del gathered
    assert open_files(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("limit", [0, 1 << 30])
def test_a_failing_stretch_leaves_nothing(limit: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def failing() -> Iterator[np.ndarray]:
        yield stretch(0, 100)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        spool(failing(), DTYPE, memory_limit=limit)
    assert open_files(tmp_path) == []
    assert list(tmp_path.iterdir()) == []


def test_memory_stays_below_the_limit_and_one_stretch() -> None:
    n = 1 << 15
    spool(stretches([n]), DTYPE, memory_limit=0)
    tracemalloc.start()
    try:
        gathered = spool(stretches([n] * 40), DTYPE, memory_limit=4 * n * DTYPE.itemsize)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(gathered) == 40 * n
    # Four stretches held, the one that goes beyond the limit, the one being made and its parts.
    assert peak < 9 * n * DTYPE.itemsize


def test_a_full_disk_is_an_os_error_and_never_a_short_file() -> None:
    """A limit on file size stands in for the disk: it strikes inside the last bytes, which a buffer may hold back."""
    script = """
import resource, numpy as np
from etendue.quantities.spool import spool
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
for n in (100_001, 100_700, 104_000, 300_000):
    try:
        spool([np.ones(50_000, 'u1'), np.ones(n - 50_000, 'u1')], np.dtype('u1'), memory_limit=0)
    except OSError as error:
        print(type(error).__name__, end=' ')
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["OutputError"] * 4
