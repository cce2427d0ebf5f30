"""Files of trace results that announce more than they hold, and sums that no memory holds."""

from __future__ import annotations

import json
import re
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import h5py
import numpy as np
import pytest
from etendue.errors import FormatError, MemoryLimitError, OutputError
from etendue.tracing.result import TraceResult
from oracles.little_memory import told

SPARE = 300 << 20


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small result with a detector of each kind that keeps arrays."""
    paper = {"name": "paper", "shape": {"kind": "disk", "radius": 50}, "at": [0, 0, -9], "finish": "white"}
    scene = et.Scene(
        sources=[{"name": "lamp", "kind": "point", "flux": 100}],
        finishes={"white": {"kind": "lambertian", "reflectance": 0.8}},
        surfaces=[paper],
        detectors=[
            {"name": "all", "kind": "rays", "shape": {"kind": "sphere", "radius": 80}},
            {"name": "scatter", "kind": "scatter"},
            {"name": "far", "kind": "intensity"},
        ],
    )
    path = tmp_path_factory.mktemp("results") / "result.h5"
    et.trace(scene, rays=3000, seed=1).save(path)
    return path


def test_a_large_result_is_written_where_it_stands(
    result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond some size a file is not made in memory first: its temporary file is locked, and written all the same."""
    monkeypatch.setattr("etendue.tracing.storage.IMAGE_LIMIT", 1)
    TraceResult.load(result).save(tmp_path / "large.h5")
    before, after = TraceResult.load(result), TraceResult.load(tmp_path / "large.h5")
    assert (before.rays["all"].position == after.rays["all"].position).all()


def instead(place: str, **made: Any) -> Callable[[Any], None]:
    """Another dataset."""

    def change(file: Any) -> None:
        group, _, name = place.rpartition("/")
        del file[place]
        file[group].create_dataset(name, **made)

    return change


def zeros(place: str, shape: tuple[int, ...], dtype: str) -> Callable[[Any], None]:
    """Zeros that deflate has packed a thousandfold, of a chunk that is written once."""

    def change(file: Any) -> None:
        chunk = (1 << 20, *shape[1:])
        instead(place, shape=shape, dtype=dtype, chunks=chunk, compression=9)(file)
        data, packed = file[place], zlib.compress(bytes(np.dtype(dtype).itemsize * int(np.prod(chunk))), 9)
        for start in range(0, shape[0], chunk[0]):
            data.id.write_direct_chunk((start, *[0] * len(shape[1:])), packed)

    return change


def many_names(file: Any) -> None:
    text = json.dumps(["a" * 3] * 6_000_000).encode()
    instead("plan/loss_names", data=np.frombuffer(text, np.uint8), chunks=(1 << 20,), compression=9)(file)


BOMBS: dict[str, tuple[Callable[[Any], None], str]] = {
    "a never written ledger": (instead("sums/lost/flux", shape=(1 << 27,), dtype="<f8"), "lost/ dataset 'flux'"),
    "never written sums": (instead("sums/births/sum", shape=(1, 2), dtype="<f8", fillvalue=1.0), "were written|not in it"),
    "never written chunks": (
        instead("sums/detector_0/records", shape=(1 << 30, 8), dtype="<f8", chunks=(8192, 8)), "not in it",
    ),
    "sums of more cells": (zeros("sums/births/sum", (1 << 25,), "<f8"), "expected float64 with 2 axes|shape"),
    "events without end": (zeros("sums/detector_1/flux", (1 << 25,), "<f8"), "shape"),
    "six million names": (many_names, "loss_names.*bytes"),
}  # fmt: skip


@pytest.mark.slow
def test_what_a_file_cannot_hold_is_refused_in_little_memory(result: Path, tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.h5" for name in BOMBS]
    for path, (change, _) in zip(paths, BOMBS.values(), strict=True):
        shutil.copy(result, path)
        with h5py.File(path, "r+") as file:
            change(file)
    every = told(imports="import etendue, h5py", call="etendue.TraceResult.load(path)", paths=paths, spare=SPARE)
    for path, found, (_, expected) in zip(paths, every, BOMBS.values(), strict=True):
        assert found.startswith(f"{path}: "), found
        assert re.search(expected, found), found


def test_more_events_than_are_kept_are_refused(result: Path, tmp_path: Path) -> None:
    path = tmp_path / "more.h5"
    shutil.copy(result, path)
    with h5py.File(path, "r+") as file:
        detectors = json.loads(bytes(file["plan/detectors"][()]))
        events = len(file["sums/detector_1/ray"])
        assert events > 100
        detectors[1]["most"] = 100
        instead("plan/detectors", data=np.frombuffer(json.dumps(detectors).encode(), np.uint8))(file)
    with pytest.raises(FormatError, match=f"{events:,} scatter events, but 100 are kept"):
        TraceResult.load(path)


@pytest.mark.slow
def test_records_that_find_no_room_on_the_disk_name_the_file(
    result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "large.h5"
    shutil.copy(result, path)
    with h5py.File(path, "r+") as file:
        zeros("sums/detector_0/records", (1 << 21, 8), "<f8")(file)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 10**9 - 5, 5))  # type: ignore[attr-defined]
    with pytest.raises(
        OutputError, match=r"134,217,728 bytes are needed for the records of .*large\.h5, and 5 are free"
    ):
        TraceResult.load(path)


def test_sums_that_no_memory_holds_name_file_and_size(result: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from etendue.quantities import memory

    monkeypatch.setattr(memory, "NOTEWORTHY", 0)
    monkeypatch.setattr(memory, "available_memory", lambda: 500)
    with pytest.raises(MemoryLimitError, match=r"result\.h5: .* needs .* GB of memory"):
        TraceResult.load(result)
