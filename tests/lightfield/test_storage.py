"""Light fields in files: nothing that matters is lost, and nothing that is damaged, foreign or absurd is taken."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import h5py
import numpy as np
import pytest
from docs.pages import ROOT, blocks
from etendue.errors import FormatError
from etendue.lightfield import carrier
from etendue.lightfield.etendue_density import FineErrors, PartField
from etendue.lightfield.light_field import LightField
from etendue.lightfield.storage import as_stored, is_field_file
from etendue.quantities.provenance import Provenance
from oracles.light_fields import SURFACES, make_field

PAGE = ROOT / "docs" / "formats" / "light-fields.md"

EVERY = pytest.mark.parametrize("which", SURFACES)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A file of a field on each surface."""
    folder = tmp_path_factory.mktemp("fields")
    paths = {which: folder / f"{number}.h5" for number, which in enumerate(SURFACES)}
    for which, path in paths.items():
        make_field(SURFACES[which]).save(path)
    return paths


def assert_same_values(one: PartField | FineErrors, other: PartField | FineErrors) -> None:
    """All arrays and numbers of both."""
    for field in dataclasses.fields(one):
        x, y = getattr(one, field.name), getattr(other, field.name)
        assert (x is None) == (y is None)
        assert isinstance(x, FineErrors) or np.array_equal(x, y)
        assert getattr(x, "dtype", None) == getattr(y, "dtype", None)


def assert_same(one: LightField, other: LightField) -> None:
    """Both fields in every bit; NaN in a report is like NaN."""
    assert (one.surface, one.flux_unit, one.provenance, one.notes) == (
        other.surface, other.flux_unit, other.provenance, other.notes,
    )  # fmt: skip
    assert repr(one.report) == repr(other.report)
    for a, b in zip(one.parts, other.parts, strict=True):
        assert_same_values(a, b)
        assert_same_values(a.errors, b.errors)


def lines_across(field: LightField, n: int = 4000) -> tuple[Any, Any]:
    """Lines in all directions, through points about the middle of the parts."""
    rng = np.random.default_rng(5)
    middles = np.array([part.centre for part in field.surface.parts()])
    direction = rng.normal(size=(n, 3))
    points = middles[rng.integers(len(middles), size=n)] + rng.normal(0, 0.3, (n, 3))
    return points, direction / np.linalg.norm(direction, axis=1)[:, None]


# --- what comes back ---------------------------------------------------------------------------------------------------


def test_every_surface_is_tried() -> None:
    assert {type(surface) for surface in SURFACES.values()} == set(carrier.SURFACES.values())


@EVERY
def test_what_is_loaded_is_what_was_stored(which: str, saved: dict[str, Path]) -> None:
    field, loaded = make_field(SURFACES[which]), LightField.load(saved[which])
    assert_same(loaded, as_stored(field))
    assert loaded.surface == field.surface
    assert loaded.part_flux == pytest.approx(field.part_flux, rel=1e-12)


@EVERY
def test_a_loaded_field_gives_the_same_file(which: str, saved: dict[str, Path], tmp_path: Path) -> None:
    LightField.load(saved[which]).save(tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == saved[which].read_bytes()
    assert list(tmp_path.iterdir()) == [tmp_path / "again.h5"]


@EVERY
def test_luminance_is_kept_to_a_fraction_of_its_error(which: str, saved: dict[str, Path]) -> None:
    """The bounds of docs/formats/light-fields.md; what is added is that the level makes up for lost or gained flux."""
    field, loaded = make_field(SURFACES[which]), LightField.load(saved[which])
    (was, error), (value, new_error) = (f.luminance(*lines_across(field)) for f in (field, loaded))
    assert np.count_nonzero(was) > 50
    levels = [abs(b.level / a.level - 1) for a, b in zip(field.parts, loaded.parts, strict=True)]
    assert max(levels) < 0.01
    relative = max(levels) + 2 * 2.0**-11
    assert (np.abs(value - was) <= np.minimum(1.07 * error, was) / 32 + 1.1 * relative * was).all()
    assert (np.abs(new_error - error) <= (2.0**-4 + 1.1 * relative) * error).all()


def test_rounding_is_as_fine_as_the_page_says() -> None:
    """And no finer: a bound that is far from reached would cost bytes."""
    field = make_field(SURFACES["plane"], cells=(16, 8, 8, 16))
    stored = as_stored(field)
    (a,), (b,) = field.parts, stored.parts
    lit = a.ratio > 0
    moved = np.abs(b.ratio.astype(float) - a.ratio)
    in_sigmas, relative = moved[lit] / b.deviation[lit], moved[lit] / a.ratio[lit]
    for worst, bound in (
        (in_sigmas.max(), 1 / 32),
        (relative.max(), 2.0**-5),
        (np.abs(b.deviation[lit] / a.deviation[lit] - 1).max(), 2.0**-4),
        (np.abs(b.space / a.space - 1).max(), 2.0**-11),
        (np.abs(b.direction / a.direction - 1).max(), 2.0**-11),
    ):
        assert 0.6 * bound < worst <= bound * (1 + 1e-6)
    assert (b.ratio[~lit] == 0).all()


def test_without_a_deviation_the_ratio_stays_as_it_is() -> None:
    field = make_field(SURFACES["disk"])
    (part,) = field.parts
    exact = dataclasses.replace(part, deviation=np.zeros_like(part.deviation))
    (stored,) = as_stored(field.replace(parts=(exact,))).parts
    np.testing.assert_array_equal(stored.ratio, part.ratio)


def test_a_part_without_light(tmp_path: Path) -> None:
    field = make_field(SURFACES["dome"], factors=None)
    window, dome = field.parts
    field = field.replace(parts=(dataclasses.replace(window, ratio=np.zeros_like(window.ratio)), dome))
    field.save(tmp_path / "field.h5")
    loaded = LightField.load(tmp_path / "field.h5")
    assert loaded.part_flux[0] == 0
    assert loaded.parts[1].space is None
    assert_same(loaded, as_stored(field))


@pytest.mark.parametrize(
    "changes",
    [
        {"notes": ()},
        {"notes": ("\udcff", "", "\0", "#" * 200_000)},
        {"flux_unit": "W"},
        {"provenance": et.RingSource(rays=1000).provenance},
    ],
    ids=["no note", "names that are no text", "watts", "provenance"],
)
def test_other_texts_and_units(changes: dict[str, Any], tmp_path: Path) -> None:
    field = make_field(SURFACES["plane"]).replace(**changes)
    field.save(tmp_path / "field.h5")
    assert_same(LightField.load(tmp_path / "field.h5"), as_stored(field))


def test_one_cell_and_very_uneven_grids(tmp_path: Path) -> None:
    for cells in ((1, 1, 1, 1), (64, 1, 2, 1), (1, 2, 32, 16)):
        field = make_field(SURFACES["cylinder"], cells=cells, factors=(1, 2))
        field.save(tmp_path / "field.h5")
        assert_same(LightField.load(tmp_path / "field.h5"), as_stored(field))


def test_a_field_that_trees_made_takes_a_fraction_of_its_bytes(tmp_path: Path) -> None:
    """Constant over dyadic boxes, but for the read-out's linear pieces: 8 bytes per cell become less than a third."""
    rng = np.random.default_rng(8)
    field = make_field(SURFACES["plane"], cells=(32, 32, 16, 16), factors=None)
    blocks_of = np.ones((4, 4, 2, 2))
    ratio = np.kron(rng.gamma(2.0, 0.5, (8, 8, 8, 8)), blocks_of).astype(np.float32)
    deviation = (0.2 * np.sqrt(ratio) * np.kron(rng.uniform(0.8, 1.2, (8, 8, 8, 8)), blocks_of)).astype(np.float32)
    field = field.replace(parts=(dataclasses.replace(field.parts[0], ratio=ratio, deviation=deviation),))
    field.save(tmp_path / "field.h5")
    assert (tmp_path / "field.h5").stat().st_size < 0.3 * 8 * ratio.size


# --- what others read and write ----------------------------------------------------------------------------------------


@pytest.mark.slow
@EVERY
def test_the_reader_on_the_page_finds_the_luminance(which: str, saved: dict[str, Path]) -> None:
    """The page's code knows nothing of étendue: every chart, the sums over parts and the read-out, written twice."""
    (code,) = (block.text for block in blocks(PAGE) if "def luminance(" in block.text)
    names: dict[str, Any] = {}
    exec(code[: code.index("\npoint, direction =")], names)  # noqa: S102
    field = LightField.load(saved[which])
    points, directions = lines_across(field, 100)
    expected = np.stack(field.luminance(points=points, directions=directions), axis=1)
    found = [names["luminance"](saved[which], x, k) for x, k in zip(points, directions, strict=True)]
    assert np.count_nonzero(expected) > 12
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * expected.max())


def test_the_page_names_everything_that_is_in_the_files(saved: dict[str, Path]) -> None:
    page = PAGE.read_text(encoding="utf-8")
    found: set[str] = set()

    def note(name: str, node: Any) -> None:
        found.update([name.rpartition("/")[2], *node.attrs])

    for path in saved.values():
        with h5py.File(path) as file:
            note("", file)
            file.visititems(note)
    found = {name for name in found if name and not name.isdigit()}
    assert len(found) > 40
    assert not {name for name in found if f"`{name}`" not in page}


def test_texts_of_any_length_and_plain_datasets_are_read(saved: dict[str, Path], tmp_path: Path) -> None:
    """A file as h5py makes it when nobody takes care."""
    expected = LightField.load(saved["dome"])
    with h5py.File(saved["dome"]) as source, h5py.File(tmp_path / "plain.h5", "w", libver="earliest") as target:

        def copy(name: str, node: Any) -> None:
            new = target.create_dataset(name, data=node[:]) if isinstance(node, h5py.Dataset) else None
            new = target.require_group(name) if new is None else new
            copy_attributes(node, new)

        def copy_attributes(node: Any, new: Any) -> None:
            for key, value in node.attrs.items():
                new.attrs[key] = value.decode("utf-8") if isinstance(value, bytes) else value

        copy_attributes(source, target)
        source.visititems(copy)
    assert is_field_file(tmp_path / "plain.h5")
    assert_same(LightField.load(tmp_path / "plain.h5"), expected)


def test_a_light_field_is_known_by_its_content(saved: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "file"
    shutil.copy(saved["disk"], path)
    assert is_field_file(path)
    path.write_bytes(path.read_bytes()[:-1])
    assert is_field_file(path)  # so that somebody says what is wrong with it
    et.write_rays(path, et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0]), format="tm25")
    assert not is_field_file(path)
    path.write_bytes(b"")
    assert not is_field_file(path)
    for value in (None, 3, "another format", np.zeros(3), ["etendue light field"] * 2):
        with h5py.File(path, "w") as file:
            if value is not None:
                file.attrs["format"] = value
        assert not is_field_file(path)
        with pytest.raises(FormatError, match="not a light field"):
            LightField.load(path)


# --- what is refused ---------------------------------------------------------------------------------------------------


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        LightField.load(tmp_path / "none.h5")
    with pytest.raises(FileNotFoundError):
        is_field_file(tmp_path / "none.h5")


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n", b"solid\n", b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" * 999])
def test_what_is_no_hdf5(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "x.h5").write_bytes(content)
    with pytest.raises(FormatError, match=r"x\.h5"):
        LightField.load(tmp_path / "x.h5")


@pytest.mark.slow
def test_cut_at_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "cut.h5"
    field = make_field(SURFACES["plane"], cells=(2, 1, 1, 1), factors=None)
    field.replace(notes=(), provenance=Provenance(software="s")).save(path)
    assert LightField.load(path).notes == ()
    for length in reversed(range(path.stat().st_size)):
        os.truncate(path, length)
        with pytest.raises(FormatError, match=r"cut\.h5"):
            LightField.load(path)


@pytest.mark.slow
def test_damage_gives_a_format_error_or_the_right_field(saved: dict[str, Path], tmp_path: Path) -> None:
    """Every 61st byte is another one; the rest of them is space that the library left between its headers."""
    rng = np.random.default_rng(4)
    path, whole, expected = tmp_path / "field.h5", saved["dome"].read_bytes(), LightField.load(saved["dome"])
    shutil.copy(saved["dome"], path)
    refused = 0
    for at in range(0, len(whole), 61):
        set_byte(path, at, whole[at] ^ int(rng.integers(1, 256)))
        try:
            loaded = LightField.load(path)
        except FormatError as error:
            assert str(path) in str(error)  # noqa: PT017 - either outcome is right
            refused += 1
        else:
            assert_same(loaded, expected)
        set_byte(path, at, whole[at])
    assert path.read_bytes() == whole
    assert refused > 0.5 * len(whole) / 61


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ratio", "deviation", "space", "direction"])
@pytest.mark.parametrize("cells", [(16, 8, 8, 16), (2, 1, 1, 1)], ids=["large", "small"])
def test_damaged_arrays_are_never_taken(name: str, cells: Any, tmp_path: Path) -> None:
    """Wherever a bit of them is turned: also in a few cells, which compression would not make smaller."""
    rng = np.random.default_rng(6)
    path = tmp_path / "field.h5"
    make_field(SURFACES["disk"], cells=cells, factors=(cells[1], cells[2])).save(path)
    whole = path.read_bytes()
    with h5py.File(path) as file:
        chunk = file[f"parts/0/{name}"].id.get_chunk_info(0)
    for at in range(chunk.byte_offset, chunk.byte_offset + chunk.size, max(chunk.size // 20, 1)):
        set_byte(path, at, whole[at] ^ 1 << int(rng.integers(8)))
        with pytest.raises(FormatError, match=r"field\.h5"):
            LightField.load(path)
        set_byte(path, at, whole[at])
    assert LightField.load(path).notes


def set_byte(path: Path, at: int, byte: int) -> None:
    """Change a byte where it stands: to write the whole file anew takes longer than to read it."""
    with path.open("r+b") as file:
        file.seek(at)
        file.write(bytes([byte]))


def put(name: str, value: Any, place: str = "/") -> Callable[[Any], None]:
    """Another attribute."""
    return lambda file: file[place].attrs.__setitem__(name, value)


def drop(name: str, place: str = "/") -> Callable[[Any], None]:
    """No such attribute."""
    return lambda file: file[place].attrs.__delitem__(name)


def dataset(name: str, part: int = 0, **made: Any) -> Callable[[Any], None]:
    """Another dataset."""

    def change(file: Any) -> None:
        group = file[f"parts/{part}"]
        del group[name]
        group.create_dataset(name, **made)

    return change


def value(name: str, new: float) -> Callable[[Any], None]:
    """One value of the window's dataset is another one."""

    def change(file: Any) -> None:
        array = file[f"parts/0/{name}"][:]
        array.flat[array.size // 3] = new
        dataset(name, data=array)(file)

    return change


def link(place: str, target: Any) -> Callable[[Any], None]:
    """A member that is somewhere else."""

    def change(file: Any) -> None:
        del file[place]
        file[place] = target

    return change


def virtual(file: Any) -> None:
    layout = h5py.VirtualLayout((4, 2, 2, 4), "<f4")
    layout[:] = h5py.VirtualSource("elsewhere.h5", "ratio", (4, 2, 2, 4))
    del file["parts/0/ratio"]
    file["parts/0"].create_virtual_dataset("ratio", layout, fillvalue=1.0)


def chunked(file: Any, *filters: int) -> Any:
    """A ratio of one chunk that is written as it is given, packed as the file says."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((4, 2, 2, 4))
    for number in filters:
        plan.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (9,))
    del file["parts/0/ratio"]
    space = h5py.h5s.create_simple((4, 2, 2, 4))
    return h5py.h5d.create(file["parts/0"].id, b"ratio", h5py.h5t.IEEE_F32LE, space, plan)


def first_chunk(file: Any) -> None:
    dataset("ratio", shape=(8, 8, 8, 8), dtype="<f4", chunks=(4, 4, 4, 4), fillvalue=1.0)(file)
    file["parts/0/ratio"][:4, :4, :4, :4] = np.random.default_rng(1).random((4, 4, 4, 4))


def packed_twice(file: Any) -> None:
    data = chunked(file, 1, 1)
    data.write_direct_chunk((0, 0, 0, 0), zlib.compress(zlib.compress(np.ones(64, "<f4").tobytes())))


def unpacks_to_more(file: Any) -> None:
    """To 300 MB instead of 8, for which the library would make room."""
    dataset("ratio", shape=(32, 32, 32, 64), dtype="<f4", chunks=(32, 32, 32, 64), compression=9)(file)
    file["parts/0/ratio"].id.write_direct_chunk((0, 0, 0, 0), zlib.compress(bytes(300 << 20), 9))


def larger_chunk(file: Any) -> None:
    chunked(file, 1).write_direct_chunk((0, 0, 0, 0), zlib.compress(np.random.default_rng(1).bytes(5000)))


CHANGES: dict[str, tuple[Callable[[Any], None], str]] = {
    "no format": (drop("format"), "attribute 'format'"),
    "another format": (put("format", "picture"), "LightField.save"),
    "a later version": (put("version", 2), "version 2.*update"),
    "a version that is text": (put("version", "1"), "attribute 'version'"),
    "no version": (drop("version"), "attribute 'version': there is none"),
    "a list of versions": (put("version", [1, 1]), "attribute 'version'"),
    "kilograms": (put("flux_unit", "kg"), "'kg' is none of lm, W"),
    "no unit": (drop("flux_unit"), "attribute 'flux_unit'"),
    "notes that are no JSON": (put("notes", "[}"), "JSONDecodeError"),
    "notes that are numbers": (put("notes", "[1, 2]"), "attribute 'notes'"),
    "one note": (put("notes", '"one"'), "attribute 'notes'"),
    "a provenance of its own": (put("provenance", json.dumps({"where": "here"})), "where"),
    "a provenance of numbers": (put("provenance", json.dumps({"source": 3})), "attribute 'provenance'"),
    "steps that are numbers": (put("provenance", json.dumps({"steps": [3]})), "attribute 'provenance'"),
    "a number that is software": (put("provenance", json.dumps({"software": 3})), "attribute 'provenance'"),
    "provenance of bytes": (put("provenance", b"\xff\xfe"), "DecodeError"),
    "an unknown surface": (put("name", "torus", "surface"), "torus"),
    "another surface": (put("name", "hemisphere", "surface"), "attribute 'centre'"),
    "another radius": (put("radius", 1.3, "surface"), "dimensions are those of dome:radius=1.3"),
    "a radius beyond the digits of the text": (put("radius", 1.264 * (1 + 3e-12), "surface"), "/parts/0/ attribute"),
    "no radius": (drop("radius", "surface"), "dimensions are those of dome:z=0.3"),
    "a radius of NaN": (put("radius", np.nan, "surface"), "not finite"),
    "a negative radius": (put("radius", -1.264, "surface"), "radius"),
    "a radius that is text": (put("radius", "1.264", "surface"), "attribute 'radius'"),
    "a centre in space": (put("centre", [0.1, -0.2, 0.0], "surface"), "attribute 'centre'"),
    "no surface": (lambda file: file.__delitem__("surface"), "group 'surface': there is none"),
    "no report": (lambda file: file.__delitem__("report"), "group 'report'"),
    "a report without score": (drop("score", "report"), "attribute 'score'"),
    "rays and a half": (put("rays", 1.5, "report"), "attribute 'rays'"),
    "a symmetry of triangles": (put("symmetry", "c3", "report"), "attribute 'symmetry'.*mirror-x"),
    "a number for a symmetry": (put("symmetry", 2.0, "report"), "attribute 'symmetry'"),
    "one part": (lambda file: file.__delitem__("parts/1"), "1 parts, expected 2"),
    "three parts": (lambda file: file.create_group("parts/2"), "3 parts, expected 2"),
    "a part of another name": (lambda file: file.move("parts/1", "parts/one"), "group '1'"),
    "a dome that is a window": (put("name", "window", "parts/1"), "/parts/1/ attribute 'name'"),
    "a turned part": (put("axes", np.eye(3)[[1, 2, 0]], "parts/1"), "attribute 'axes'"),
    "axes in the plane": (put("axes", np.eye(2), "parts/1"), "attribute 'axes'"),
    "a level of NaN": (put("level", np.nan, "parts/0"), "attribute 'level'"),
    "a negative level": (put("level", -1.0, "parts/0"), "level"),
    "another level": (put("level", 3.8, "parts/0"), "/parts/0, attribute 'flux'"),
    "another flux": (put("flux", 3.8, "parts/1"), "/parts/1, attribute 'flux'"),
    "no ratio": (lambda file: file.__delitem__("parts/0/ratio"), "dataset 'ratio': there is none"),
    "no space": (lambda file: file.__delitem__("parts/1/space"), "attribute 'flux'"),
    "NaN": (value("ratio", np.nan), "dataset 'ratio'.*negative or not finite"),
    "an infinite deviation": (value("deviation", np.inf), "dataset 'deviation'"),
    "a negative ratio": (value("ratio", -1e-30), "dataset 'ratio'"),
    "NaN in a factor": (value("space", np.nan), "dataset 'space'"),
    "another ratio": (value("ratio", 7.0), "attribute 'flux'"),
    "three cells": (dataset("ratio", data=np.ones((4, 3, 2, 4), "<f4")), r"shape \(4, 3, 2, 4\)"),
    "no cell": (dataset("ratio", data=np.ones((4, 0, 2, 4), "<f4")), r"shape \(4, 0, 2, 4\)"),
    "three axes": (dataset("ratio", data=np.ones((8, 2, 4), "<f4")), "expected float32 with 4 axes"),
    "a scalar": (dataset("ratio", data=np.float32(1)), "expected float32 with 4 axes"),
    "nothing": (dataset("ratio", data=h5py.Empty("<f4")), "expected float32 with 4 axes"),
    "doubles": (dataset("ratio", data=np.ones((4, 2, 2, 4))), "float64 of shape"),
    "the other end first": (dataset("ratio", data=np.ones((4, 2, 2, 4), ">f4")), ">f4"),
    "records": (dataset("ratio", data=np.ones((4, 2, 2, 4), [("x", "<f4")])), "dataset 'ratio'"),
    "texts": (dataset("ratio", data=np.full((4, 2, 2, 4), "x", h5py.string_dtype())), "dataset 'ratio'"),
    "more deviations than ratios": (dataset("deviation", data=np.ones((4, 2, 4, 4), "<f4")), "deviation"),
    "a factor that is no square": (dataset("space", data=np.ones((4, 8))), "factor"),
    "a factor with three axes": (dataset("space", data=np.ones((4, 4, 1))), "dataset 'space'"),
    "a trillion cells": (dataset("ratio", shape=(1024,) * 4, dtype="<f4", chunks=(16,) * 4), "are not in it"),
    "cells that are not there": (dataset("ratio", shape=(64, 64, 128, 128), dtype="<f4", chunks=(16,) * 4), "not in it"),
    "a factor that is not there": (dataset("space", shape=(8192, 8192), dtype="<f8", chunks=(64, 64)), "not in it"),
    "a chunk of 64 MB": (
        dataset("ratio", data=np.ones((4, 2, 2, 4), "<f4"), chunks=(64,) * 4, maxshape=(None,) * 4, compression=9),
        "chunks of shape",
    ),
    "no value written": (dataset("ratio", shape=(4, 2, 2, 4), dtype="<f4", fillvalue=1.0), "not in it|were written"),
    "no chunk written": (dataset("ratio", shape=(4, 2, 2, 4), dtype="<f4", fillvalue=1.0, chunks=True), "not in it"),
    "one chunk of sixteen": (first_chunk, "1 of its 16 chunks were written"),
    "chunks that are packed twice": (packed_twice, r"filters \[1, 1\].*h5repack"),
    "a chunk that unpacks to more": (unpacks_to_more, "unpacks to more"),
    "a chunk that is larger in the file": (larger_chunk, "takes more than its"),
    "other chunks": (
        dataset("ratio", data=np.ones((4, 2, 2, 4), "<f4"), chunks=(2, 2, 2, 2), compression="lzf"),
        r"filters \[32000\].*h5repack",
    ),
    "a group for an array": (link("parts/0/ratio", h5py.SoftLink("/surface")), "dataset 'ratio'"),
    "a link to a link": (link("parts/0/ratio", h5py.SoftLink("/parts/0/ratio")), "dataset 'ratio'"),
    "a link to another file": (link("parts/0/ratio", h5py.ExternalLink("other.h5", "/parts/0/ratio")), "dataset 'ratio'"),
    "a group in another file": (link("report", h5py.ExternalLink("other.h5", "/report")), "group 'report'"),
    "an array for a group": (link("report", np.ones(3)), "group 'report'"),
    "an array of others": (virtual, "not in it"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_what_does_not_fit_is_refused(change: str, saved: dict[str, Path], tmp_path: Path) -> None:
    path = tmp_path / "field.h5"
    shutil.copy(saved["dome"], path)
    shutil.copy(saved["dome"], tmp_path / "other.h5")  # where links may lead
    alter, expected = CHANGES[change]
    with h5py.File(path, "r+") as file:
        alter(file)
    tracemalloc.start()
    with pytest.raises(FormatError) as refusal:
        LightField.load(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert str(path) in str(refusal.value)
    assert re.search(expected, str(refusal.value)), refusal.value
    assert peak < 5e6


def test_an_altered_file_that_fits_is_taken(saved: dict[str, Path], tmp_path: Path) -> None:
    """The changes above are refused for what they change, not because the file was opened and closed."""
    path = tmp_path / "field.h5"
    shutil.copy(saved["dome"], path)
    with h5py.File(path, "r+") as file:
        put("notes", '["new"]')(file)
        dataset("ratio", data=file["parts/0/ratio"][:], chunks=(2, 2, 2, 2), compression="gzip")(file)
    assert_same(LightField.load(path), LightField.load(saved["dome"]).replace(notes=("new",)))


def test_a_field_that_cannot_be_written_leaves_what_was_there(
    saved: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "field.h5"
    shutil.copy(saved["disk"], path)

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        make_field(SURFACES["dome"]).save(path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == saved["disk"].read_bytes()
