"""TM-25: files put together with `struct` from the tables of the standard, and written files taken apart with it."""

from __future__ import annotations

import datetime as dt
import math
import struct
import tracemalloc
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import detect_format, read_rays, write_rays
from etendue.quantities.file_records import FileRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.report import RayFileWarning
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

QUIET_NAN = "0000c07f"

# Without symmetry: every column of every ray is another number.
GEOMETRY = (
    (1.0, -2.0, 0.5, 0.6, 0.0, 0.8),
    (-3.25, 4.5, 0.25, 0.0, -0.28, 0.96),
    (7.0, 0.125, -1.5, -0.48, 0.64, 0.6),
)
FLUX = (1.0, 2.5, 4.5)
RAYS = tuple((*g, f) for g, f in zip(GEOMETRY, FLUX, strict=True))


def f32(value: float | str) -> bytes:
    """Four bytes of a header: a number, or the bytes as they stand in the file."""
    return bytes.fromhex(value) if isinstance(value, str) else struct.pack("<f", value)


def tm25_bytes(
    rows: Sequence[Sequence[Any]] = RAYS,
    record: str = "<7f",
    *,
    flags: Sequence[int] = (1, 1, 0, 0, 1, 0, 0, 0),
    version: int = 2013,
    method: int = 1,
    lumens: float | str = 8.0,
    watts: float | str = QUIET_NAN,
    count: int | None = None,
    date: bytes = b"2013-09-04T08:30:29+01:00",
    start: int = 0,
    spectral: int = 0,
    single: float | str = QUIET_NAN,
    tables: Sequence[Sequence[tuple[float, float]]] = (),
    table_count: int | None = None,
    table_padding: bool = True,
    labels: Sequence[str] = (),
    text: bytes = b"",
    descriptions: dict[int, bytes] | None = None,
) -> bytes:
    """A file by the byte tables of the reference, §1.1 to §1.3."""
    data = b"TM25" + struct.pack("<2i", version, method) + f32(lumens) + f32(watts)
    data += struct.pack("<Q", len(rows) if count is None else count) + date.ljust(28, b"\0")
    data += struct.pack("<2i", start, spectral) + f32(single) + f32(400.0) + f32(700.0)
    data += struct.pack("<3i", len(tables) if table_count is None else table_count, len(labels), len(text))
    data = data.ljust(256, b"\0") + struct.pack("<8i", *flags)
    for i in range(9):
        data += (descriptions or {}).get(i, b"").ljust(4000, b"\0")
    assert len(data) == 36288
    block = b"".join(struct.pack("<i", len(t)) + b"".join(struct.pack("<2f", *pair) for pair in t) for t in tables)
    data += block
    if table_padding:
        data += bytes(-len(block) % 32)
    for label in labels:
        data += label.encode("utf-32-le").ljust(512, b"\0")
    return data + text + b"".join(struct.pack(record, *row) for row in rows)


@pytest.fixture
def made(tmp_path: Path) -> Callable[..., et.RaySet]:
    """Read the file that `tm25_bytes` makes of the arguments, from under a wrong extension."""

    def make(*args: Any, **kwargs: Any) -> et.RaySet:
        path = tmp_path / "led.zip"
        path.write_bytes(tm25_bytes(*args, **kwargs))
        return read_rays(path)

    return make


def places(rays: et.RaySet, severity: str) -> list[str]:
    """Places of the reader's complaints."""
    return [c.place for c in rays.meaning.complaints if c.severity == severity]


# --- reading ---------------------------------------------------------------------------------------------------------


def test_luminous_rays(made: Callable[..., et.RaySet]) -> None:
    names = {0: "LED blå", 3: "RiGO", 7: "at 350 mA"}
    rays = made(start=5, descriptions={i: text.encode("utf-32-le") for i, text in names.items()})
    assert isinstance(rays.records, FileRecords)
    assert rays.position.tolist() == [list(g[:3]) for g in GEOMETRY]
    assert np.allclose(rays.direction, [g[3:] for g in GEOMETRY], atol=1e-7)
    assert rays.flux.tolist() == list(FLUX)
    assert (rays.flux_unit, rays.total_flux, rays.columns, rays.complaints) == ("lm", 8.0, (), ())
    expected = {
        "version": 2013, "date": "2013-09-04T08:30:29+01:00", "creation_method": "measurement",
        "start_position": "cuboid", "light_source": "LED blå", "creator": "RiGO", "information": "at 350 mA",
        "luminous_flux": 8.0, "total_flux": 8.0,
    }  # fmt: skip
    assert dict(rays.header) == expected
    assert (rays.provenance.source, rays.provenance.format) == ("led.zip", "tm25")


def test_relative_flux_is_scaled_to_the_total_with_a_warning_that_names_both(made: Callable[..., et.RaySet]) -> None:
    rays = made(lumens=2.0)
    with pytest.warns(RayFileWarning, match=r"header says 2 lm, the rays sum to 8"):
        assert rays.total_flux == 2.0
    assert rays.flux.tolist() == [0.25, 0.625, 1.125]


@pytest.mark.parametrize("unknown", ["0100807f", "0100c07f", "0000c07f", "7f800001", 0.0, -1.0, math.inf])
def test_total_in_every_disguise_of_unknown(made: Callable[..., et.RaySet], unknown: float | str) -> None:
    rays = made(lumens=unknown)
    assert (rays.total_flux, rays.meaning.declared_flux) == (8.0, None)
    assert "total_flux" not in rays.header
    assert places(rays, "warning") == ["byte 12"]


def test_both_totals_are_kept(made: Callable[..., et.RaySet]) -> None:
    assert made(watts=0.5).header["radiant_flux"] == 0.5
    rays = made(flags=(1, 1, 1, 0, 0, 0, 0, 0), watts=8.0, lumens=54.6)
    assert (rays.flux_unit, rays.total_flux) == ("W", 8.0)
    assert rays.header["luminous_flux"] == pytest.approx(54.6, rel=1e-7)


def test_lighttools_writes_watts_in_the_place_of_lumens(made: Callable[..., et.RaySet]) -> None:
    creator = {3: "LightTools 8.7.0".encode("utf-32-le")}
    radiometric = {"flags": (1, 1, 1, 0, 0, 0, 0, 0), "lumens": 2.0, "watts": 0.0}
    rays = made(**radiometric, descriptions=creator)
    with pytest.warns(RayFileWarning, match="header says 2 W"):
        assert rays.total_flux == 2.0
    assert places(rays, "warning") == ["byte 16"]
    assert made(**radiometric).total_flux == 8.0  # from anyone else, lumens are lumens


def test_radiant_beside_luminous_flux(made: Callable[..., et.RaySet]) -> None:
    rows = [(*g, f / 100, f) for g, f in zip(GEOMETRY, FLUX, strict=True)]
    rays = made(rows, "<8f", flags=(1, 1, 1, 0, 1, 0, 0, 0), watts=0.08)
    assert (rays.flux_unit, rays.flux.tolist()) == ("lm", list(FLUX))
    assert np.allclose(rays.column("radiant_flux"), np.divide(FLUX, 100))


def test_single_wavelength(made: Callable[..., et.RaySet]) -> None:
    rays = made(spectral=1, single=450.5)
    assert rays.meaning.single_wavelength == 450.5
    for wrong in (0.0, -450.0, QUIET_NAN):
        rays = made(spectral=1, single=wrong)
        assert rays.meaning.single_wavelength is None
        assert places(rays, "warning") == ["byte 64"]


def test_wavelength_of_each_ray(made: Callable[..., et.RaySet]) -> None:
    rows = [(*g, f, w) for g, f, w in zip(GEOMETRY, FLUX, (405.5, 530.25, 660.0), strict=True)]
    kwargs = {"flags": (1, 1, 1, 1, 0, 0, 0, 0), "watts": 8.0, "spectral": 2}
    rays = made(rows, "<8f", **kwargs)
    assert (rays.flux_unit, rays.flux.tolist()) == ("W", list(FLUX))
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [405.5, 530.25, 660.0]
    assert rays.complaints == ()
    rows[1] = (*rows[1][:-1], 0.0)
    assert places(made(rows, "<8f", **kwargs), "warning") == ["rays"]


def spectrum(pairs: int) -> list[tuple[float, float]]:
    return [(400.0 + i, 1.0 + i % 7) for i in range(pairs)]


@pytest.mark.parametrize("pairs", [1, 3, 76, 86])
def test_one_spectrum_is_padded_once_to_32_bytes(made: Callable[..., et.RaySet], pairs: int) -> None:
    rays = made(spectral=3, tables=[spectrum(pairs)])
    (only,) = rays.spectra
    assert list(zip(only.wavelength, only.weight, strict=True)) == spectrum(pairs)
    assert rays.flux.tolist() == list(FLUX)
    assert rays.complaints == ()


@pytest.mark.parametrize("code", ["i", "f"])
def test_spectrum_index_as_integer_and_as_float(made: Callable[..., et.RaySet], code: str) -> None:
    rows = [(*g, f, i) for g, f, i in zip(GEOMETRY, FLUX, (3, 1, 2), strict=True)]
    tables = [spectrum(2), spectrum(5), spectrum(4)]
    kwargs: dict[str, Any] = {"flags": (1, 1, 1, 0, 0, 0, 0, 1), "watts": 8.0, "spectral": 4, "tables": tables}
    rays = made(rows, f"<7f{code}", **kwargs)
    assert rays.column("spectrum_index").tolist() == [3, 1, 2]
    assert [len(s.weight) for s in rays.spectra] == [2, 5, 4]
    assert rays.flux.tolist() == list(FLUX)
    assert places(rays, "warning") == ([] if code == "i" else ["rays"])
    rows[0] = (*rows[0][:-1], 4)
    assert places(made(rows, "<7fi", **kwargs), "warning") == ["rays"]


def test_tables_that_no_ray_uses_still_take_room(made: Callable[..., et.RaySet]) -> None:
    rays = made(tables=[spectrum(3), spectrum(8)])
    assert (rays.spectra, rays.flux.tolist()) == ((), list(FLUX))
    assert places(rays, "note") == ["byte 36288"]


@pytest.mark.parametrize(
    "table", [[(500.0, 1.0), (400.0, 1.0)], [(400.0, -1.0)], [(0.0, 1.0)], [(400.0, math.nan)], []]
)
def test_table_that_is_no_spectrum(made: Callable[..., et.RaySet], table: list[tuple[float, float]]) -> None:
    rays = made(spectral=3, tables=[table])
    assert (rays.spectra, rays.flux.tolist()) == ((), list(FLUX))
    assert places(rays, "warning") == ["byte 36288"]


STOKES = ((0.5, -0.25, 0.125), (0.0, 1.0, 0.0), (-0.75, 0.5, 0.25))
AXES = ((0.8, 0.0, -0.6), (1.0, 0.0, 0.0), (0.0, 0.6, -0.8))


@pytest.mark.parametrize("version", [2013, 2020])
@pytest.mark.parametrize("axis", [False, True])
def test_stokes_parameters_with_and_without_axis(made: Callable[..., et.RaySet], version: int, axis: bool) -> None:
    rows = [(*r, *s, *(a if axis else ())) for r, s, a in zip(RAYS, STOKES, AXES, strict=True)]
    rays = made(rows, f"<{len(rows[0])}f", version=version, flags=(1, 1, 1, 0, 0, 1, 0, 0), watts=8.0)
    assert rays.column("stokes").tolist() == [list(s) for s in STOKES]
    assert rays.flux.tolist() == list(FLUX)
    if axis:
        assert np.allclose(rays.column("polarisation_axis"), AXES, atol=1e-7)
    assert ("polarisation_axis" in rays.columns) == axis
    assert places(rays, "warning") == ([] if axis else ["byte 276"])


def test_truncated_stokes_file_of_2013_is_ambiguous(tmp_path: Path) -> None:
    rows = [(*r, *s, *a) for r, s, a in zip(RAYS, STOKES, AXES, strict=True)]
    path = tmp_path / "a.tm25ray"
    path.write_bytes(tm25_bytes(rows, "<13f", flags=(1, 1, 1, 0, 0, 1, 0, 0), watts=8.0)[:-4])
    with pytest.raises(FormatError, match="byte 276"):
        read_rays(path)


def test_tristimulus_values(made: Callable[..., et.RaySet]) -> None:
    rows = [(*r, x, z) for r, x, z in zip(RAYS, (1.5, 2.25, 4.75), (9.0, 0.5, 0.25), strict=True)]
    rays = made(rows, "<9f", flags=(1, 1, 0, 0, 1, 0, 1, 0))
    assert rays.flux.tolist() == list(FLUX)
    assert rays.column("tristimulus_x").tolist() == [1.5, 2.25, 4.75]
    assert rays.column("tristimulus_z").tolist() == [9.0, 0.5, 0.25]
    assert rays.complaints == ()


def test_additional_columns_and_text(made: Callable[..., et.RaySet]) -> None:
    extra = ((10.0, 0.5), (20.0, 0.25), (30.0, 0.125))
    rows = [(*r, *e) for r, e in zip(RAYS, extra, strict=True)]
    text = "phase and Ω".encode("utf-32-le").ljust(64, b"\0")
    rays = made(rows, "<9f", labels=["phase [rad]", "µ"], text=text, tables=[spectrum(2)], spectral=3)
    assert rays.column("additional").tolist() == [list(e) for e in extra]
    assert rays.header["additional_labels"] == ("phase [rad]", "µ")
    assert rays.header["additional_text"] == "phase and Ω"
    assert rays.flux.tolist() == list(FLUX)
    assert rays.complaints == ()


def test_every_column_at_once(made: Callable[..., et.RaySet]) -> None:
    """The order of §1.3, although the flags contradict each other."""
    rows = [
        (*g, 1.0 + i, 500.0 + i, 10.0 + i, *s, *a, 20.0 + i, 30.0 + i, 2 - i % 2, 40.0 + i)
        for i, (g, s, a) in enumerate(zip(GEOMETRY, STOKES, AXES, strict=True))
    ]
    rays = made(
        rows, "<17fif", flags=(1,) * 8, lumens=33.0, watts=6.0, spectral=4, tables=[spectrum(2), spectrum(3)], labels=["l"]
    )  # fmt: skip
    assert rays.flux.tolist() == [10.0, 11.0, 12.0]
    assert rays.column("radiant_flux").tolist() == [1.0, 2.0, 3.0]
    assert rays.column("wavelength").tolist() == [500.0, 501.0, 502.0]
    assert rays.column("stokes").tolist() == [list(s) for s in STOKES]
    assert np.allclose(rays.column("polarisation_axis"), AXES, atol=1e-7)
    assert rays.column("tristimulus_x").tolist() == [20.0, 21.0, 22.0]
    assert rays.column("tristimulus_z").tolist() == [30.0, 31.0, 32.0]
    assert rays.column("spectrum_index").tolist() == [2, 1, 2]
    assert rays.column("additional").tolist() == [[40.0], [41.0], [42.0]]
    assert places(rays, "warning") == ["byte 256"] * 3


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"version": 2007}, "byte 4"),
        ({"method": 5}, "byte 8"),
        ({"start": 8}, "byte 56"),
        ({"start": -1}, "byte 56"),
        ({"spectral": 7}, "byte 60"),
        ({"spectral": 3}, "byte 76"),
        ({"flags": (1, 1, 0, 0, 3, 0, 0, 0)}, "byte 272"),
        ({"flags": (1, 0, 0, 0, 1, 0, 0, 0)}, "byte 256"),
        ({"spectral": 3, "tables": [spectrum(2), spectrum(3)]}, "byte 76"),
        ({"text": bytes(33)}, "byte 84"),
    ],
)
def test_violations_that_leave_the_meaning_certain(
    made: Callable[..., et.RaySet], change: dict[str, Any], place: str
) -> None:
    rays = made(**change)
    assert rays.flux.tolist() == list(FLUX)
    assert places(rays, "warning") == [place]


@pytest.mark.parametrize(
    ("flags", "record", "extra"),
    [
        ((1, 1, 1, 0, 0, 0, 1, 0), "<9f", (1.0, 2.0)),  # tristimulus without luminous flux
        ((1, 1, 1, 0, 0, 0, 0, 1), "<7fi", (1,)),  # index without tables
        ((1, 1, 1, 1, 0, 0, 0, 0), "<8f", (500.0,)),  # wavelengths without identifier 2
    ],
)
def test_flags_that_break_the_rules(
    made: Callable[..., et.RaySet], flags: tuple[int, ...], record: str, extra: tuple[float, ...]
) -> None:
    rays = made([(*r, *extra) for r in RAYS], record, flags=flags, watts=8.0)
    assert rays.flux.tolist() == list(FLUX)
    assert "byte 256" in places(rays, "warning")


def test_rays_without_flux_are_refused(made: Callable[..., et.RaySet]) -> None:
    with pytest.raises(FormatError, match="neither radiant nor luminous"):
        made([g[:6] for g in GEOMETRY], "<6f", flags=(1, 1, 0, 0, 0, 0, 0, 0))


# --- size ------------------------------------------------------------------------------------------------------------


def test_truncated_tail_keeps_whole_rays(tmp_path: Path) -> None:
    path = tmp_path / "a.tm25ray"
    path.write_bytes(tm25_bytes()[:-5])
    rays = read_rays(path)
    assert len(rays) == 2
    (complaint,) = rays.meaning.complaints
    assert complaint.severity == "error"
    assert "rays missing: 1" in complaint.found
    assert "23 bytes of the next" in complaint.found
    assert complaint.place == f"byte {36288 + 84 - 5}"
    with pytest.warns(RayFileWarning, match="header says 8 lm"):
        assert rays.flux.tolist() == pytest.approx([8 * 1.0 / 3.5, 8 * 2.5 / 3.5])


@pytest.mark.parametrize(
    ("rows", "record", "kwargs", "found"),
    [
        (RAYS, "<7f4x", {}, "96 bytes follow"),  # a column that no flag mentions
        ([r[:6] for r in (*RAYS, *RAYS)], "<6f", {"count": 7}, "no directions stand"),
        (RAYS, "<7f", {"count": 2}, "84 bytes follow"),
        (RAYS, "<7f", {"count": 0}, "not one is there"),
        ((), "<7f", {"count": 3}, "not one is there"),
        # One column less than the flags say: read as truncated, the columns of all rays but the first would be shifted.
        (RAYS * 3, "<7f", {"flags": (1, 1, 1, 0, 1, 0, 0, 0)}, "252 bytes follow"),
    ],
)
def test_size_that_fits_no_reading(
    made: Callable[..., et.RaySet], rows: Any, record: str, kwargs: dict[str, Any], found: str
) -> None:
    with pytest.raises(FormatError, match=found):
        made(rows, record, **kwargs)


def test_a_few_surplus_bytes_are_ignored(tmp_path: Path) -> None:
    path = tmp_path / "a.tm25ray"
    path.write_bytes(tm25_bytes() + b"\r\n")
    rays = read_rays(path)
    assert rays.flux.tolist() == list(FLUX)
    assert places(rays, "warning") == [f"byte {36288 + 84}"]


def test_blocks_that_were_not_padded(made: Callable[..., et.RaySet]) -> None:
    rays = made(
        spectral=3,
        tables=[spectrum(3)],
        table_padding=False,
        labels=["a"],
        rows=[(*r, 5.0) for r in RAYS],
        record="<8f",
    )
    assert rays.flux.tolist() == list(FLUX)
    assert rays.header["additional_labels"] == ("a",)
    assert len(rays.spectra[0].weight) == 3
    assert places(rays, "warning") == [f"byte {36288 + 28 + 512}"]


@pytest.mark.parametrize(
    ("offset", "value"),
    [(20, b"\xff" * 8), (76, b"\xff\xff\xff\x7f"), (76, b"\xff\xff\x0f\0"), (80, b"\xff\xff\xff\x7f"),
     (80, b"\0\x0f\0\0"), (84, b"\xff\xff\xff\x7f"), (76, b"\xff" * 4), (80, b"\xff" * 4), (84, b"\xff" * 4),
     (36288, b"\xff\xff\xff\x7f"), (36288, b"\xff" * 4)],
)  # fmt: skip
def test_absurd_counts_allocate_nothing(tmp_path: Path, offset: int, value: bytes) -> None:
    data = bytearray(tm25_bytes(spectral=3, tables=[spectrum(3)]))
    data[offset : offset + len(value)] = value
    path = tmp_path / "a.tm25ray"
    path.write_bytes(data)
    tracemalloc.start()
    try:
        rays = read_rays(path)
    except FormatError:
        pass
    else:
        # Only an absurd number of rays leaves it certain where the rays are.
        assert (offset, len(rays), places(rays, "error")) == (20, 3, [f"byte {len(data)}"])
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < 4e6


@pytest.mark.parametrize("offset", [36288 + 4, 36288 + 32 + 28])
def test_signalling_nan_in_tables_and_indices(tmp_path: Path, offset: int) -> None:
    rows = [(*r, i % 2 + 1) for i, r in enumerate(RAYS)]
    data = bytearray(
        tm25_bytes(
            rows, "<7fi", flags=(1, 1, 1, 0, 0, 0, 0, 1), watts=8.0, spectral=4, tables=[spectrum(1), spectrum(2)]
        )
    )
    data[offset : offset + 4] = bytes.fromhex("0100807f")
    path = tmp_path / "a.tm25ray"
    path.write_bytes(data)
    rays = read_rays(path)
    assert rays.flux.tolist() == list(FLUX)
    assert len(places(rays, "warning")) == 1


FULL_FILE = tm25_bytes(
    [(*r, i % 2 + 1, 0.5 * i, 7.0) for i, r in enumerate(RAYS)], "<7fi2f", flags=(1, 1, 1, 0, 0, 0, 0, 1), watts=8.0,
    spectral=4, tables=[spectrum(3), spectrum(4)], labels=["a", "b"], text="µ".encode("utf-32-le").ljust(32, b"\0"),
)  # fmt: skip
PLACE = st.one_of(st.integers(0, 288), st.integers(36288, len(FULL_FILE) - 1))
BYTE = st.sampled_from([0, 1, 2, 3, 4, 127, 128, 255])


@pytest.mark.slow
@settings(max_examples=400, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(damage=st.dictionaries(PLACE, BYTE, min_size=1, max_size=5), cut=st.integers(0, 100))
def test_damaged_file_with_all_blocks(tmp_path: Path, damage: dict[int, int], cut: int) -> None:
    data = bytearray(FULL_FILE)
    for place, value in damage.items():
        data[place] = value
    path = tmp_path / "a.tm25ray"
    path.write_bytes(data[: len(data) - cut])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        try:
            rays = read_rays(path)
        except FormatError:
            return
        assert 1 <= len(rays) <= 3
        assert len(rays.flux) == len(rays)
        assert all(complaint.place for complaint in rays.complaints)


def test_tables_that_fill_gigabytes_are_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "a.tm25ray"
    path.write_bytes(tm25_bytes((), spectral=3, table_count=1, count=3) + struct.pack("<i", 1 << 27))
    with path.open("rb+") as file:
        file.truncate(36288 + 4 + 8 * (1 << 27) + 28 + 3 * 28)  # sparse: takes no room on the disk
    tracemalloc.start()
    with pytest.raises(FormatError, match="spectral table 1"):
        read_rays(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4e6


# --- writing ---------------------------------------------------------------------------------------------------------


def written(path: Path, rays: Any) -> tuple[dict[str, Any], bytes, tuple[str, ...]]:
    """Header fields of a written file, its bytes, and the notes of the writer."""
    notes = write_rays(path, rays, "tm25")
    data = path.read_bytes()
    names = ("magic", "version", "method", "lumens", "watts", "rays", "date", "start", "spectral", "single", "low",
             "high", "tables", "additional", "text")  # fmt: skip
    header = dict(zip(names, struct.unpack_from("<4s2iffQ28s2i3f3i", data), strict=True))
    header["flags"] = struct.unpack_from("<8i", data, 256)
    assert not any(data[88:256])
    assert header["magic"] == b"TM25"
    return header, data, notes


def ray_set(extra: dict[str, Any] | None = None, **meaning: Any) -> et.RaySet:
    """The asymmetric rays with further columns."""
    columns = {"position": [g[:3] for g in GEOMETRY], "direction": [g[3:] for g in GEOMETRY], "flux": FLUX}
    arrays = {n: np.asarray(v, "<i4" if n == "spectrum_index" else "<f8") for n, v in (columns | (extra or {})).items()}
    records = np.zeros(3, [(n, a.dtype, a.shape[1:]) for n, a in arrays.items()])
    for name, array in arrays.items():
        records[name] = array
    return et.RaySet.from_records(records, RaySetMeaning(**meaning))


def test_written_lumens_byte_by_byte(tmp_path: Path) -> None:
    header, data, notes = written(tmp_path / "a.tm25ray", ray_set())
    assert (header["version"], header["method"], header["rays"]) == (2013, 0, 3)
    assert header["lumens"] == 8.0
    assert data[16:20].hex() == data[64:68].hex() == data[68:72].hex() == data[72:76].hex() == QUIET_NAN
    assert header["flags"] == (1, 1, 0, 0, 1, 0, 0, 0)
    assert (header["spectral"], header["tables"], header["additional"], header["text"]) == (0, 0, 0, 0)
    date = dt.datetime.fromisoformat(header["date"].rstrip(b"\0").decode())
    assert date.utcoffset() is not None
    assert abs(dt.datetime.now(dt.UTC) - date) < dt.timedelta(hours=1)
    assert data[288 + 3 * 4000 :].startswith("etendue ".encode("utf-32-le"))
    assert len(data) == 36288 + 3 * 28
    rows = [struct.unpack_from("<7f", data, 36288 + 28 * i) for i in range(3)]
    assert np.allclose(rows, RAYS, rtol=6e-8)
    assert len(notes) == 1
    assert "simulated" in notes[0]


def test_written_wavelengths(tmp_path: Path) -> None:
    wavelengths = (405.5, 530.25, 660.0)
    rays = ray_set({"wavelength": wavelengths}, flux_unit="W")
    header, data, _ = written(tmp_path / "a.tm25ray", rays)
    assert (header["spectral"], header["flags"]) == (2, (1, 1, 1, 1, 0, 0, 0, 0))
    assert (header["watts"], header["low"], header["high"]) == (8.0, 405.5, 660.0)
    assert header["lumens"] == pytest.approx(rays.in_unit("lm").total_flux, rel=1e-6)
    rows = [struct.unpack_from("<8f", data, 36288 + 32 * i) for i in range(3)]
    assert [row[6] for row in rows] == list(FLUX)
    assert [row[7] for row in rows] == list(wavelengths)


def test_lumens_with_wavelengths_become_watts(tmp_path: Path) -> None:
    rays = ray_set({"wavelength": (450.0, 555.0, 600.0)})
    header, data, notes = written(tmp_path / "a.tm25ray", rays)
    assert header["spectral"] == 2
    assert header["lumens"] == pytest.approx(8.0, rel=1e-6)
    flux = [struct.unpack_from("<f", data, 36288 + 32 * i + 24)[0] for i in range(3)]
    assert np.allclose(flux, rays.in_unit("W").flux, rtol=1e-6)
    assert flux[1] == pytest.approx(2.5 / 683, rel=1e-6)
    assert "watts" in notes[0]


def test_lumens_at_invisible_wavelengths_stay_lumens(tmp_path: Path) -> None:
    header, _, notes = written(tmp_path / "a.tm25ray", ray_set({"wavelength": (450.0, 950.0, 600.0)}))
    assert (header["spectral"], header["flags"], header["lumens"]) == (0, (1, 1, 0, 0, 1, 0, 0, 0), 8.0)
    assert "V(λ) is 0" in notes[0]
    assert any("a wavelength each" in note for note in notes)


def test_impossible_wavelengths_are_not_written(tmp_path: Path) -> None:
    for wrong in (0.0, -5.0, math.nan):
        header, _, notes = written(
            tmp_path / "a.tm25ray", ray_set({"wavelength": (450.0, wrong, 600.0)}, flux_unit="W")
        )
        assert (header["spectral"], header["watts"]) == (0, 8.0)
        assert any("not above 0" in note for note in notes)


def test_written_single_wavelength_and_one_spectrum(tmp_path: Path) -> None:
    header, _, _ = written(tmp_path / "a.tm25ray", ray_set(single_wavelength=555.0))
    assert (header["spectral"], header["single"]) == (1, 555.0)
    assert header["watts"] == pytest.approx(8.0 / 683, rel=1e-6)
    one = et.Spectrum([400.0, 500.0, 650.0], [1.0, 3.0, 2.0])
    header, data, _ = written(tmp_path / "a.tm25ray", ray_set(spectra=(one,)))
    assert (header["spectral"], header["tables"], header["low"], header["high"]) == (3, 1, 400.0, 650.0)
    assert struct.unpack_from("<i6f", data, 36288) == (3, 400.0, 1.0, 500.0, 3.0, 650.0, 2.0)
    assert data[36288 + 28 : 36288 + 32] == bytes(4)
    assert len(data) == 36288 + 32 + 84
    assert header["watts"] == pytest.approx(8.0 / one.luminous_efficacy, rel=1e-6)


def test_written_spectrum_index(tmp_path: Path) -> None:
    spectra = tuple(et.Spectrum([400.0, 500.0 + 10 * i], [1.0, 3.0]) for i in range(3))
    header, data, _ = written(
        tmp_path / "a.tm25ray", ray_set({"spectrum_index": (3, 1, 2)}, flux_unit="W", spectra=spectra)
    )
    assert (header["spectral"], header["tables"], header["flags"]) == (4, 3, (1, 1, 1, 0, 0, 0, 0, 1))
    start = 36288 + 64  # three tables of 20 bytes, padded once
    assert [struct.unpack_from("<i", data, start + 32 * i + 28)[0] for i in range(3)] == [3, 1, 2]
    header, _, notes = written(
        tmp_path / "a.tm25ray", ray_set({"spectrum_index": (3, 1, 4)}, flux_unit="W", spectra=spectra)
    )
    assert (header["spectral"], header["tables"]) == (0, 0)
    assert any("outside 1..3" in note for note in notes)


FULL = {
    "stokes": {"flux_unit": "W", "extra": {"stokes": STOKES}},
    "stokes and axis": {"flux_unit": "W", "extra": {"stokes": STOKES, "polarisation_axis": AXES}},
    "tristimulus": {
        "flux_unit": "lm",
        "extra": {"tristimulus_x": (1.5, 2.25, 4.75), "tristimulus_z": (9.0, 0.5, 0.25)},
    },
    "both fluxes and stokes": {"flux_unit": "lm", "extra": {"radiant_flux": (0.5, 0.25, 1.0), "stokes": STOKES}},
    "additional": {"flux_unit": "lm", "extra": {"additional": ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0))}},
}


@pytest.mark.parametrize("case", FULL)
def test_columns_come_back(tmp_path: Path, case: str) -> None:
    kwargs = dict(FULL[case])
    rays = ray_set(kwargs.pop("extra"), **kwargs)
    header, _, _ = written(tmp_path / "a.tm25ray", rays)
    assert header["version"] == (2020 if "polarisation_axis" in rays.columns else 2013)
    back = read_rays(tmp_path / "a.tm25ray")
    assert back.columns == rays.columns
    assert back.flux_unit == rays.flux_unit
    assert np.allclose(back.flux, FLUX)
    for name in rays.columns:
        assert np.allclose(back.column(name), rays.column(name), atol=1e-7), name
    assert places(back, "error") == []


def test_tristimulus_shares_the_scale_of_the_flux(tmp_path: Path) -> None:
    rays = ray_set({"tristimulus_x": (1.5, 2.25, 4.75), "tristimulus_z": (9.0, 0.5, 0.25)}, declared_flux=2.0)
    write_rays(tmp_path / "a.tm25ray", rays)
    back = read_rays(tmp_path / "a.tm25ray")
    assert back.total_flux == 2.0
    assert np.allclose(back.column("tristimulus_x") / back.flux, np.divide((1.5, 2.25, 4.75), FLUX))


def test_unusable_rays_are_left_out_with_all_their_columns(tmp_path: Path) -> None:
    rays = ray_set({"wavelength": (450.0, 555.0, 600.0), "additional": ((1.0,), (2.0,), (3.0,))}, flux_unit="W")
    records = rays.records.copy()
    records["direction"][1] = 0.0
    broken = et.RaySet.from_records(records, rays.meaning)
    header, _, notes = written(tmp_path / "a.tm25ray", broken)
    back = read_rays(tmp_path / "a.tm25ray")
    assert header["rays"] == len(back) == 2
    assert back.column("wavelength").tolist() == [450.0, 600.0]
    assert back.column("additional").tolist() == [[1.0], [3.0]]
    assert back.complaints == ()
    assert any("1 of 3 rays are not written" in note for note in notes)


def test_facts_survive_a_round_trip(made: Callable[..., et.RaySet], tmp_path: Path) -> None:
    rays = made(
        [(*r, 5.0) for r in RAYS], "<8f", start=2, method=1, watts=0.25, labels=["phase"],
        text="µ".encode("utf-32-le").ljust(32, b"\0"), descriptions={1: "Maker".encode("utf-32-le")},
    )  # fmt: skip
    header, _, notes = written(tmp_path / "a.tm25ray", rays)
    assert notes == ()
    assert (header["method"], header["start"], header["watts"], header["lumens"]) == (1, 2, 0.25, 8.0)
    back = read_rays(tmp_path / "a.tm25ray")
    for name in ("manufacturer", "additional_labels", "additional_text", "creation_method", "start_position"):
        assert back.header[name] == rays.header[name], name
    # The ratio of the two totals holds for another current, too, but not for some of the rays.
    header, _, _ = written(tmp_path / "b.tm25ray", rays.with_total_flux(16.0))
    assert (header["lumens"], header["watts"]) == (16.0, 0.5)
    header, _, _ = written(tmp_path / "b.tm25ray", rays.moved((0, 0, 1)))
    assert header["start"] == 0  # wherever they start now, it is not what the file said
    header, _, _ = written(tmp_path / "b.tm25ray", rays.subset(2, seed=1))
    assert math.isnan(header["watts"])
    assert rays.subset(2, seed=1).provenance.steps[0] in read_rays(tmp_path / "b.tm25ray").header["information"]


def test_stream_is_written_without_being_a_ray_set(tmp_path: Path) -> None:
    source = et.RingSource(rays=1000, seed=7)
    header, data, notes = written(tmp_path / "a.tm25ray", source)
    _, same, _ = written(tmp_path / "b.tm25ray", source.ray_set())
    assert (header["rays"], notes) == (1000, ())
    assert header["lumens"] == pytest.approx(600.0, rel=1e-6)
    assert data[36288:] == same[36288:]


def test_recognised_by_magic_alone(tmp_path: Path) -> None:
    path = tmp_path / "led.ray"
    path.write_bytes(tm25_bytes())
    assert detect_format(path).name == "tm25"
    path.write_bytes(b"TM25")
    with pytest.raises(FormatError, match="ends inside its header"):
        read_rays(path)
