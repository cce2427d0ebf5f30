"""Every format of BSDF files: round trips of a table without symmetry, recognition, damage, and what is refused."""

from __future__ import annotations

import contextlib
import functools
import io
import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, EtendueError, FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.bsdf import BSDF_FORMATS, read_bsdf_data, write_bsdf_data
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.klems import BASES
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from formats.slanted import Slanted, SlantedOnce, coarsen
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from oracles.bsdf_files import READ_ONLY
from oracles.tracepro_files import small_files

Array = npt.NDArray[np.float64]


FORMATS = list(BSDF_FORMATS.values())
KINDS = small_files()
WRITTEN = [form for form in FORMATS if form.write is not None]


def test_there_is_a_file_of_each_format() -> None:
    assert {form.name for form in FORMATS if form.write is None} == set(READ_ONLY)


def tabled(form: BsdfFormat, bsdf: Tabulated) -> BsdfData:
    assert form.tabulate is not None
    with pytest.MonkeyPatch.context() as patch:
        coarsen(patch)
        return form.tabulate(bsdf)


def as_bytes(form: BsdfFormat, data: BsdfData) -> bytes:
    assert form.write is not None
    stream = io.BytesIO()
    form.write(data, stream)
    return stream.getvalue()


@functools.cache
def small(form: BsdfFormat) -> bytes:
    """A file of one angle of incidence."""
    return READ_ONLY[form.name]() if form.write is None else as_bytes(form, tabled(form, SlantedOnce()))


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
def test_round_trip(form: BsdfFormat, tmp_path: Path) -> None:
    """The same directions and values: a wrong azimuth zero, sense, side or order of a matrix would be seen."""
    data = tabled(form, Slanted())
    assert form.fits is not None
    assert form.fits(data)
    path = tmp_path / "table.any"
    path.write_bytes(as_bytes(form, data))
    again = read_bsdf_data(path)
    assert len(again.slices) == len(data.slices)
    incident = np.array([other.incident for other in data.slices])
    transmitted = np.array([other.transmitted for other in data.slices])
    for one in again.slices:
        apart = np.abs(incident - one.incident).max(axis=1)
        (near,) = np.flatnonzero((apart < 1e-8) & (transmitted == one.transmitted))
        assert np.allclose(one.directions, data.slices[near].directions, atol=1e-7, equal_nan=True)
        assert np.allclose(one.values, data.slices[near].values, rtol=1e-7, atol=1e-9, equal_nan=True)
    # And the values are the function there, or its mean over cells, as well as the rule of `tabulate` has it.
    if form.name == "tensor-tree":
        return  # its cells are looked at in test_tensor_tree
    for one in again.slices[:: max(1, len(again.slices) // 40)]:
        there = ~np.isnan(one.directions[..., 0])
        to = one.directions[there]
        # Rounding may put directions along the surface behind it.
        to[:, 2] = np.copysign(to[:, 2], 1.0 if one.front != one.transmitted else -1.0)
        f = mean_of_patches(one) if form.name == "klems" else Slanted().evaluate(one.incident, to)
        assert np.abs(one.values[there] - f).max() < (1e-6 if one.grid is not None else 0.03 * f.max() + 1e-4)


def patches(points: Array) -> Array:
    """(n, 16, 3): the nodes of a Gauss rule over the full basis of Klems, patch by patch, about directions of it."""
    at, _ = np.polynomial.legendre.leggauss(4)
    weighed = np.array([0.0, 5, 15, 25, 35, 45, 55, 65, 75, 90])
    counts = np.array([1, 8, 16, 20, 24, 24, 24, 16, 12])
    theta = np.degrees(np.arccos(np.clip(np.abs(points[:, 2]), 0, 1)))
    band = np.clip(np.searchsorted(weighed, theta, side="right") - 1, 0, 8)
    low, high = (np.sin(np.radians(weighed[band + k])) ** 2 for k in (0, 1))
    # Patches are even in sin²θ and φ: the projected solid angle.
    height = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * at
    phi = np.arctan2(points[:, 1], points[:, 0])[:, None] + np.pi / counts[band][:, None] * at
    u, p = np.broadcast_arrays(np.sqrt(height)[:, :, None], phi[:, None, :])
    z = np.sign(points[:, 2])[:, None, None] * np.sqrt(1.0 - u * u)
    return np.stack([u * np.cos(p), u * np.sin(p), z], axis=-1).reshape(len(points), 16, 3)


def mean_of_patches(one: BsdfSlice) -> Array:
    _, weight = np.polynomial.legendre.leggauss(4)
    weights = (weight[:, None] * weight).ravel() / 4.0
    incident, scattered = patches(one.incident[None])[0], patches(one.directions)
    f = Slanted().evaluate(incident[:, None, None, :], scattered)
    return np.einsum("i,j,inj->n", weights, weights, f)


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_recognised_by_content_and_by_no_other_format(form: BsdfFormat, tmp_path: Path) -> None:
    """And what was read keeps the name of its format."""
    head = small(form)[:4096]
    assert [other.name for other in FORMATS if other.recognise(head)] == [form.name]
    path = tmp_path / "file.any"
    path.write_bytes(small(form))
    assert read_bsdf_data(path).format == form.name


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_cut_anywhere(form: BsdfFormat, tmp_path: Path) -> None:
    """At bytes all over the file, and each of the first and last: an error that says so."""
    whole = small(form)
    rng = np.random.default_rng(4)
    cuts = {*range(40), *range(len(whole) - 12, len(whole) - 1), *rng.integers(0, len(whole) - 12, 6).tolist()}
    if len(whole) > 1 << 24:
        cuts = {0, 7, 100, len(whole) // 2, len(whole) - 1}
    path = tmp_path / "cut"
    for cut in sorted(cuts):
        path.write_bytes(whole[:cut])
        with pytest.raises(FormatError):
            read_bsdf_data(path)


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_damaged_bytes(form: BsdfFormat, tmp_path: Path) -> None:
    """A table or an error of ours, whatever stands there."""
    damage(small(form), tmp_path)


def damage(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged"

    @settings(max_examples=8 if len(whole) < 1 << 24 else 2, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.integers(0, len(whole) - 9), st.binary(min_size=1, max_size=8))
    def check(at: int, bad: bytes) -> None:
        path.write_bytes(whole[:at] + bad + whole[at + len(bad) :])
        with contextlib.suppress(EtendueError):
            read_bsdf_data(path)

    check()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_scatter_of_tracepro(kind: str, tmp_path: Path) -> None:
    """As the files of all formats: recognised by one, and after damage a BSDF or an error of ours.

    Cut at every byte they are in test_tracepro_damage.py.
    """
    whole = KINDS[kind]
    assert [form.name for form in FORMATS if form.recognise(whole[:4096])] == ["tracepro"]
    damage(whole, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
def test_tables_in_scenes_are_those_that_were_written(
    form: BsdfFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 20.0, 35.0, 50.0, 60.0))
    bsdf = et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.3}, {"kind": "gaussian", "peak": 2, "sigma": 0.2}]
    )
    path = tmp_path / f"film{form.extensions[0]}"
    assert isinstance(et.write_bsdf(path, bsdf), tuple)
    again = et.read_bsdf(path)
    for theta in (0.0, 27.0, 55.0):
        assert float(again.reflectance(theta)) == pytest.approx(float(bsdf.reflectance(theta)), rel=0.015), theta


def test_directional_hemispherical_values_of_klems_are_exact(tmp_path: Path) -> None:
    """Σ M Λ by hand over the text of the file."""
    path = tmp_path / "x.xml"
    path.write_bytes(small(BSDF_FORMATS["klems"]))
    data = read_bsdf_data(path)
    text = path.read_text().split("Reflection Back")[1].split("<ScatteringData>")[1].split("</Scatt")[0]
    matrix = np.array([float(word) for word in text.replace(",", " ").split()]).reshape(145, 145)
    lambdas = BASES["LBNL/Klems Full"].projected
    assert float(lambdas.sum()) == pytest.approx(math.pi, rel=1e-12)
    found = [one.integral() for one in data.slices if not one.front and not one.transmitted]
    assert found == pytest.approx((lambdas @ matrix).tolist(), rel=1e-12)


def test_bases_of_klems() -> None:
    assert {name: basis.size for name, basis in BASES.items()} == {
        "LBNL/Klems Full": 145, "LBNL/Klems Half": 77, "LBNL/Klems Quarter": 41,
    }  # fmt: skip


ZEMAX = """# made by hand
Source  Measured
symmetry  planesymmetrical
SpectralContent  Monochrome
ScatterType  BRDF
SampleRotation  1
0
AngleOfIncidence  1
40
ScatterAzimuth  3
0 90 180
ScatterRadial  2
0 20

Monochrome
DataBegin
TIS 0.5
1 2
1 3
1 4
DataEnd
"""


def test_azimuth_zero_of_zemax_points_from_the_specular_direction_to_the_normal(tmp_path: Path) -> None:
    path = tmp_path / "hand.bsdf"
    path.write_text(ZEMAX)
    (one,) = read_bsdf_data(path).slices
    incident = one.incident
    assert one.theta == pytest.approx(40.0)
    # In the plane of incidence, 20° from the specular direction towards the normal, and away from it.
    towards, away = (direction(angle, one.phi + 180.0) for angle in (20.0, 60.0))
    assert float(one.at(towards)) == pytest.approx(2.0)
    assert float(one.at(away)) == pytest.approx(4.0)
    # Both sides are alike, and the specular direction is common to all.
    specular = incident * [-1, -1, 1]
    assert float(one.at(specular)) == pytest.approx(1.0)
    across = np.cross(specular, towards)
    side = [specular * math.cos(0.3) + sign * across / np.linalg.norm(across) * math.sin(0.3) for sign in (1, -1)]
    assert one.at(side[0]) == pytest.approx(one.at(side[1]))
    assert any("stated share" in str(complaint) for complaint in read_bsdf_data(path).complaints)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("AngleOfIncidence  1", "AngleOfIncidence  999999999999", "words follow"),
        ("1 3", "1 nan", "no finite number"),
        ("0 90 180", "0 180 90", "do not rise"),
        ("planesymmetrical", "round", "not one of"),
        ("\n40\n", "\n95\n", "0 to 90"),
        ("DataEnd", "", "DataEnd"),
    ],
)
def test_mistakes_of_zemax_files_are_told_with_their_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "hand.bsdf"
    path.write_text(ZEMAX.replace(old, new))
    with pytest.raises(FormatError, match=said) as caught:
        read_bsdf_data(path)
    assert "line" in caught.value.place


def test_the_vinyl_of_zemax(samples: Path) -> None:
    """Its integrals beside what it states: reference values found by another program."""
    data = read_bsdf_data(samples / "bsdf" / "planesymmetric_brdf_zemax.bsdf")
    found = [(one.theta, one.integral(), one.stated) for one in data.slices[:3]]
    for (theta, share, stated), expected in zip(
        found, [(15, 0.1359, 0.1345), (20, 0.1355, 0.1322), (25, 0.1403, 0.1371)], strict=True
    ):
        assert theta == pytest.approx(expected[0])
        assert share == pytest.approx(expected[1], abs=2e-4)
        assert stated == pytest.approx(expected[2], abs=1e-4)


def test_a_binary_file_of_speos_is_refused_by_name(samples: Path) -> None:
    with pytest.raises(UnsupportedFormatError, match="Speos"):
        read_bsdf_data(samples / "bsdf" / "R_test.anisotropicbsdf")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("x.bsdf180", b"\x01\x02", "BSDF180"),
        ("x.ddr", b"File format: 1", "Integra"),
        ("x.unpolished", b"OPTIS - Unpolished surface file v1.0\n", "another kind"),
        ("x.brdf", b"OPTIS - brdf surface file v9.0\n1\n\0\1", "binary"),
    ],
)
def test_what_is_known_and_not_read_is_refused_by_name(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UnsupportedFormatError, match=said):
        read_bsdf_data(tmp_path / name)


def test_a_klems_file_that_lacks_values_is_refused_with_its_line(samples: Path) -> None:
    with pytest.raises(FormatError, match="line 107, ScatteringData: 4 values; the bases have 21025"):
        read_bsdf_data(samples / "bsdf" / "2011-SA1-small.xml")


@pytest.mark.parametrize("count", ["nan", "1e999", "2.5", "0"])
def test_a_basis_of_klems_has_whole_numbers_of_patches(tmp_path: Path, samples: Path, count: str) -> None:
    text = (samples / "bsdf" / "2011-SA1-small.xml").read_text()
    assert "<nPhis>8</nPhis>" in text
    (tmp_path / "x.xml").write_text(text.replace("<nPhis>8</nPhis>", f"<nPhis>{count}</nPhis>", 1))
    with pytest.raises(FormatError, match=r"x\.xml: line \d+, AngleBasisBlock: a band from 5 to 15° in "):
        read_bsdf_data(tmp_path / "x.xml")


def test_what_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="klems"):
        et.write_bsdf(tmp_path / "x.xml", et.bsdf.Gaussian(peak=1, sigma=0.1), format="klem")
    with pytest.raises(UnknownNameError):
        et.write_bsdf(tmp_path / "x.abc", et.bsdf.Gaussian(peak=1, sigma=0.1))
    with pytest.raises(ArgumentError, match="nothing of this BSDF is scattered"):
        et.write_bsdf(tmp_path / "x.xml", et.bsdf.Mirror(reflectance=0.9))
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.array([0.0]))
    with pytest.raises(FormatError, match="does not fit"):
        write_bsdf_data(tmp_path / "x.bsdf", BsdfData([BsdfSlice(direction(10, 0), np.full((1, 2), 0.1), grid=grid)]))
    assert list(tmp_path.iterdir()) == []
