"""What holds for every ray format: the registry is the list of tests."""

from __future__ import annotations

import importlib
import pkgutil
import struct
import tracemalloc
import warnings
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, FormatError
from etendue.formats import rays as package
from etendue.formats.head import Head
from etendue.formats.rays import RAY_FORMATS, detect_format, read_rays, write_rays
from etendue.formats.rays.ray_format import RayFormat
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_stream import BATCH
from etendue.quantities.report import RayFileWarning
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

NAMES = tuple(f.name for f in RAY_FORMATS)
BINARY = ("tm25", "lighttools", "zemax", "speos", "asap")
NEED_WAVELENGTHS = ("speos", "speos-text")
UNCOUNTED = ("speos", "csv")
"""Formats that say neither how many rays there are nor where they end: cut between two rays, a file is whole."""

WITHOUT_TOTAL = ("speos-text",)
"""Formats whose energies are relative, with no total in the file."""

FAR_FIELD = ("lighttools", "lighttools-text", "csv")
"""Formats that hold rays without start points."""

WHOLE_ONLY = ("etd",)
"""Formats of which a part is worth nothing, and is refused."""

LUMENS_ONLY_BY_NAME = ("tracepro",)
"""Formats that do not say the unit of flux."""

every_format = pytest.mark.parametrize("ray_format", RAY_FORMATS, ids=lambda f: f.name)


def asymmetric(n: int = 6, unit: Any = "W", seed: int = 3, *, wavelength: bool = True) -> et.RaySet:
    """Rays without any symmetry, with fluxes that differ by a factor of 1e4."""
    random = np.random.default_rng(seed)
    direction = np.add(random.normal(size=(n, 3)), (0.3, -0.2, 2.0))
    return et.RaySet(
        np.add(random.normal(size=(n, 3)) * (1.0, 3.0, 0.2), (4.0, -1.0, 0.5)),
        direction / np.linalg.norm(direction, axis=1, keepdims=True),
        10.0 ** random.uniform(-4, 0, n),
        flux_unit=unit,
        wavelength=random.uniform(410, 690, n) if wavelength else None,
    )


def assert_same_rays(back: et.RaySet, rays: et.RaySet, *through: str) -> None:
    """32-bit floats keep seven digits; the total is kept by all formats on the way but those that have none, the order
    by all but the index, which has its own: then rays are compared by their x, of which there are no two."""
    assert len(back) == len(rays)
    mine, theirs = (slice(None), slice(None))
    if "etd" in (*through, back.provenance.format):
        mine, theirs = np.argsort(back.position[:, 0]), np.argsort(rays.position[:, 0])
    assert np.allclose(back.position[mine], rays.position[theirs], rtol=1e-6, atol=1e-6)
    assert np.allclose(back.direction[mine], rays.direction[theirs], rtol=0, atol=2e-7)
    lost = not set(through).isdisjoint(WITHOUT_TOTAL)
    scale = rays.total_flux / back.total_flux if lost else 1.0
    assert np.allclose(back.flux[mine] * scale, rays.flux[theirs], rtol=1e-6, atol=0)
    assert back.total_flux * scale == pytest.approx(rays.total_flux, rel=1e-6)


def test_the_registry_is_complete() -> None:
    assert len(set(NAMES)) == len(NAMES) > 10
    modules = [importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)]
    exported = {module.FORMAT.name for module in modules if hasattr(module, "FORMAT")}
    assert exported == set(NAMES)
    for f in RAY_FORMATS:
        assert f.title
        assert all(e == e.lower() and e.startswith(".") for e in f.extensions)


# --- round trips -----------------------------------------------------------------------------------------------------


@every_format
def test_round_trip(ray_format: RayFormat, tmp_path: Path) -> None:
    rays = asymmetric()
    path = tmp_path / "a.bin"
    write_rays(path, rays, ray_format.name)
    back = read_rays(path)
    assert back.provenance.format == ray_format.name
    assert_same_rays(back, rays, ray_format.name)
    if back.wavelength is not None:
        assert np.allclose(np.sort(back.wavelength), np.sort(rays.wavelength), rtol=1e-6)
    if ray_format.name not in LUMENS_ONLY_BY_NAME:
        assert back.flux_unit == "W"
    assert list(tmp_path.iterdir()) == [path]


@every_format
def test_round_trip_in_lumens(ray_format: RayFormat, tmp_path: Path) -> None:
    rays = asymmetric(unit="lm", wavelength=False)
    path = tmp_path / "a.bin"
    if ray_format.name in NEED_WAVELENGTHS:
        with pytest.raises(ArgumentError, match="wavelength"):
            write_rays(path, rays, ray_format.name)
        assert list(tmp_path.iterdir()) == []
        return
    write_rays(path, rays, ray_format.name)
    back = read_rays(path)
    assert_same_rays(back, rays)
    if ray_format.name not in LUMENS_ONLY_BY_NAME:
        assert back.flux_unit == "lm"


@pytest.mark.slow
@pytest.mark.parametrize("second", NAMES)
@pytest.mark.parametrize("first", NAMES)
def test_written_by_one_and_read_through_another(first: str, second: str, tmp_path: Path) -> None:
    rays = asymmetric(seed=11)
    write_rays(tmp_path / "a", rays, first)
    between = read_rays(tmp_path / "a")
    if second in NEED_WAVELENGTHS and between.wavelength is None:
        with pytest.raises(ArgumentError, match="wavelength"):
            write_rays(tmp_path / "b", between, second)
        return
    write_rays(tmp_path / "b", between, second)
    assert_same_rays(read_rays(tmp_path / "b"), rays, first, second)


@every_format
def test_large_flux_total_is_kept(ray_format: RayFormat, tmp_path: Path) -> None:
    rays = asymmetric(1000, seed=5).with_total_flux(54321.0)
    write_rays(tmp_path / "a", rays, ray_format.name)
    back = read_rays(tmp_path / "a")
    if ray_format.name != "speos-text":
        assert back.total_flux == pytest.approx(54321.0, rel=1e-6)
    assert_same_rays(back, rays, ray_format.name)


@every_format
def test_stream_is_written_in_batches(ray_format: RayFormat, tmp_path: Path) -> None:
    source = et.RingSource(rays=1500, seed=2)
    if ray_format.name in NEED_WAVELENGTHS:
        with pytest.raises(ArgumentError, match="wavelength"):
            write_rays(tmp_path / "a", source, ray_format.name)
        return
    write_rays(tmp_path / "a", source, ray_format.name)
    assert_same_rays(read_rays(tmp_path / "a"), source.ray_set())


@pytest.mark.slow
@pytest.mark.parametrize("name", BINARY)
def test_columns_stay_together_over_several_batches(name: str, tmp_path: Path) -> None:
    n = BATCH + 1000
    rays = asymmetric(n)
    records = rays.records.copy()
    records["direction"][: BATCH // 2 : 7] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        write_rays(tmp_path / "a", et.RaySet.from_records(records, rays.meaning), name)
    back = read_rays(tmp_path / "a")
    left = et.RaySet.from_records(records[records["direction"].any(axis=1)], rays.meaning)
    assert_same_rays(back, left)
    if back.wavelength is not None:
        assert np.allclose(back.wavelength, left.wavelength, rtol=1e-6)


@every_format
def test_unusable_rays_are_left_out_and_mentioned(ray_format: RayFormat, tmp_path: Path) -> None:
    rays = asymmetric()
    records = rays.records.copy()
    records["direction"][0] = 0.0
    records["position"][2, 1] = np.nan
    records["flux"][5] = -1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        notes = write_rays(tmp_path / "a", et.RaySet.from_records(records, rays.meaning), ray_format.name)
    assert any("3 of 6 rays are not written" in note for note in notes)
    left = et.RaySet.from_records(records[[1, 3, 4]], rays.meaning)
    assert_same_rays(read_rays(tmp_path / "a"), left, ray_format.name)


@every_format
def test_nothing_usable_is_refused(ray_format: RayFormat, tmp_path: Path) -> None:
    records = asymmetric().records.copy()
    records["direction"] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        with pytest.raises(ArgumentError, match="not one of 6 rays is usable"):
            write_rays(tmp_path / "a", et.RaySet.from_records(records, RaySetMeaning(flux_unit="W")), ray_format.name)
    assert list(tmp_path.iterdir()) == []


@every_format
def test_far_field_sets(ray_format: RayFormat, tmp_path: Path) -> None:
    rays = asymmetric()
    records = np.zeros(
        6, [(n, rays.records.dtype[n].base, rays.records.dtype[n].shape) for n in ("direction", "flux", "wavelength")]
    )
    for name in records.dtype.names:
        records[name] = rays.records[name]
    far = et.RaySet.from_records(records, rays.meaning)
    assert ray_format.far_field == (ray_format.name in FAR_FIELD)
    if not ray_format.far_field:
        with pytest.raises(ArgumentError, match="Formats for far-field rays: lighttools, lighttools-text, csv"):
            write_rays(tmp_path / "a", far, ray_format.name)
        assert list(tmp_path.iterdir()) == []
        return
    write_rays(tmp_path / "a", far, ray_format.name)
    back = read_rays(tmp_path / "a")
    assert not back.has_position
    assert_same_rays(back, far, ray_format.name)


# --- recognition -----------------------------------------------------------------------------------------------------


@every_format
@pytest.mark.parametrize("extension", [".ray", ".tm25ray", ".dat", ".dis", ".csv", ".pdf", ""])
def test_recognised_by_content_and_by_no_other_format(ray_format: RayFormat, extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"led{extension}"
    write_rays(path, asymmetric(), ray_format.name)
    head = Head.of(path)
    assert [f.name for f in RAY_FORMATS if f.recognise(head)] == [ray_format.name]
    assert detect_format(path) is ray_format


def test_nobody_recognises_what_is_no_ray_file(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    path = tmp_path / "a"
    for data in (b"", b"\0" * 500, b"\xff" * 500, b"hello\n", b"1\n2\n3\n", random.bytes(5000), b"\n" * 999):
        path.write_bytes(data)
        assert [f.name for f in RAY_FORMATS if f.recognise(Head.of(path))] == []


# --- damage ----------------------------------------------------------------------------------------------------------


def look_at_everything(path: Path) -> et.RaySet:
    """Read a file and use the rays as the rest of the package does."""
    rays = read_rays(path)
    assert repr(rays)
    assert rays.total_flux >= 0
    assert all(complaint.place for complaint in rays.complaints)
    # numpy warns of signalling NaN when it copies a column; the rays that carry one are complained about anyway.
    with np.errstate(invalid="ignore"):
        assert len(rays.flux) == len(rays)
        assert rays.wavelength is None or len(rays.wavelength) == len(rays)
    usable = sum(len(batch.flux) for batch in rays.batches())
    # A pass, because an index says what its tally was and cannot know of records that were damaged since.
    assert usable == len(rays) - rays.pass_over().unusable
    return rays


def read_or_refuse(path: Path) -> et.RaySet | FormatError:
    """The rays, or the error that names the file; any other exception is a defect."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        try:
            return look_at_everything(path)
        except FormatError as error:
            return error


@pytest.mark.slow
@every_format
def test_cut_at_every_byte(ray_format: RayFormat, tmp_path: Path) -> None:
    """Either an error, or exactly the rays that are there and a complaint that there were more."""
    path = tmp_path / "whole"
    write_rays(path, asymmetric(), ray_format.name)
    data, whole = path.read_bytes(), read_rays(path)
    readable = 0
    cut = tmp_path / "cut"
    cut.write_bytes(data)
    # A new file for each cut would be slow: the same one shrinks.
    for size in range(len(data) - 1, -1, -1):
        with cut.open("rb+") as file:
            file.truncate(size)
        rays = read_or_refuse(cut)
        if isinstance(rays, FormatError):
            continue
        readable += 1
        # The last number of a text without a final line end may be cut, and nobody can know.
        certain = len(rays) if ray_format.name in BINARY or data[size - 1 : size] == b"\n" else len(rays) - 1
        assert rays.records.dtype == whole.records.dtype
        assert np.array_equal(rays.records[:certain], whole.records[:certain]), size
        fresh = set(rays.meaning.complaints) - set(whole.meaning.complaints)
        complained = any(c.severity in ("warning", "error") for c in fresh)
        between_rays = ray_format.name in UNCOUNTED and len(rays) < len(whole)
        assert complained or between_rays or data[size:].strip() == b"", size
    assert (readable > 0) == (ray_format.name not in WHOLE_ONLY)


FILES: dict[str, bytes] = {}


def small_file(name: str, folder: Path) -> bytes:
    if name not in FILES:
        path = folder / f"small-{name}"
        write_rays(path, asymmetric(4), name)
        FILES[name] = path.read_bytes()
        path.unlink()
    return FILES[name]


def damage(data: bytes, places: list[tuple[int, int]]) -> bytes:
    """Bytes at relative positions replaced; half of the positions lie in the header and around the rays' beginning."""
    damaged = bytearray(data)
    for position, value in places:
        damaged[position % len(data)] = value
    return bytes(damaged)


POSITION = st.one_of(st.integers(0, 300), st.integers(-200, -1), st.integers(0, 1 << 20))


@pytest.mark.slow
@every_format
@settings(max_examples=50, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(places=st.lists(st.tuples(POSITION, st.integers(0, 255)), min_size=1, max_size=8), cut=st.integers(0, 40))
def test_damaged_bytes(ray_format: RayFormat, tmp_path: Path, places: list[tuple[int, int]], cut: int) -> None:
    data = damage(small_file(ray_format.name, tmp_path), places)
    path = tmp_path / "damaged"
    path.write_bytes(data[: len(data) - cut])
    tracemalloc.start()
    try:
        outcome = read_or_refuse(path)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert str(path) in str(outcome) if isinstance(outcome, FormatError) else 0 < len(outcome) <= len(data)
    assert peak < 32e6


@pytest.mark.slow
@every_format
@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(noise=st.binary(max_size=400))
def test_noise_behind_a_true_beginning(ray_format: RayFormat, tmp_path: Path, noise: bytes) -> None:
    path = tmp_path / "noise"
    path.write_bytes(small_file(ray_format.name, tmp_path)[:36] + noise)
    outcome = read_or_refuse(path)
    assert not isinstance(outcome, FormatError) or str(path) in str(outcome)


# --- size ------------------------------------------------------------------------------------------------------------

MANY = 100_000_000


def grown_file(name: str, path: Path) -> None:
    """A file of `MANY` rays of zeros, which takes no room on the disk."""
    write_rays(path, asymmetric(4), name)
    starts = {"tm25": 36288, "lighttools": 44, "zemax": 208, "speos": 28, "asap": 140}
    width = 28 if name == "asap" else 32
    counts: dict[str, tuple[int, bytes]] = {
        "tm25": (20, struct.pack("<Q", MANY)),
        "zemax": (4, struct.pack("<I", MANY)),
        "asap": (104, struct.pack("<fi", MANY, -MANY)),
    }
    with path.open("rb+") as file:
        if name in counts:
            file.seek(counts[name][0])
            file.write(counts[name][1])
        file.truncate(starts[name] + MANY * width)


@pytest.mark.parametrize("name", BINARY)
def test_opening_a_large_file_costs_no_memory(name: str, tmp_path: Path) -> None:
    path = tmp_path / "large"
    grown_file(name, path)
    tracemalloc.start()
    rays = read_rays(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (len(rays), isinstance(rays.records, FileRecords)) == (MANY, True)
    assert peak < 16e6


# --- failure ---------------------------------------------------------------------------------------------------------


@every_format
@pytest.mark.parametrize("failure", [OSError, KeyboardInterrupt])
@pytest.mark.parametrize("existing", [False, True])
def test_failed_write_leaves_nothing(
    ray_format: RayFormat, failure: type[BaseException], existing: bool, tmp_path: Path
) -> None:
    def dying(_done: int) -> None:
        raise failure("the disk died")

    path = tmp_path / "led.ray"
    if existing:
        path.write_bytes(b"old")
    with pytest.raises(failure):
        write_rays(path, asymmetric().watched(dying), ray_format.name)
    assert [p.read_bytes() for p in tmp_path.iterdir()] == ([b"old"] if existing else [])
