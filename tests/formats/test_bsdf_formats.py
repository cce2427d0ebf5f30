"""Every format of BSDF files: round trips of a table without symmetry, recognition, damage, and what is refused."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, EtendueError, FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.bsdf import BSDF_FORMATS, read_bsdf_data, write_bsdf_data
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.formats.bsdf.klems import BASES
from etendue.quantities.bsdf_data import BsdfData, BsdfSlice, PolarGrid, direction
from formats.slanted import Slanted
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


class Opal:
    """A Lambertian surface; light that is neither reflected nor transmitted has no f."""

    name, isotropic, reflects, transmits, both_sides = "opal", True, True, True, True
    wavelengths: tuple[float, ...] = ()
    incidences = (0.0, 45.0, 65.0, 80.0)

    def evaluate(self, incident: npt.ArrayLike, scattered: npt.ArrayLike, *, wavelength: float | None = None) -> Array:
        assert wavelength is None
        i, s = np.broadcast_arrays(np.asarray(incident, float), np.asarray(scattered, float))
        sides = np.sign(i[..., 2]) * np.sign(s[..., 2])
        return np.select([sides > 0.0, sides < 0.0], [0.2 / math.pi, 0.1 / math.pi], 0.0)


def tabled(form: BsdfFormat) -> BsdfData:
    assert form.tabulate is not None
    return form.tabulate(Slanted())


def as_bytes(form: BsdfFormat, data: BsdfData) -> bytes:
    assert form.write is not None
    stream = io.BytesIO()
    form.write(data, stream)
    return stream.getvalue()


@pytest.fixture(scope="module")
def written() -> Callable[[BsdfFormat], bytes]:
    kept: dict[str, bytes] = {}

    def bytes_of(form: BsdfFormat) -> bytes:
        if form.name not in kept:
            kept[form.name] = READ_ONLY[form.name]() if form.write is None else as_bytes(form, tabled(form))
        return kept[form.name]

    return bytes_of


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
def test_round_trip(form: BsdfFormat, written: Callable[[BsdfFormat], bytes], tmp_path: Path) -> None:
    """The same directions and values: a wrong azimuth zero, sense, side or order of a matrix would be seen."""
    data = tabled(form)
    assert form.fits is not None
    assert form.fits(data)
    path = tmp_path / "table.any"
    path.write_bytes(written(form))
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
def test_recognised_by_content_and_by_no_other_format(form: BsdfFormat, written: Callable[[BsdfFormat], bytes]) -> None:
    head = written(form)[:4096]
    assert [other.name for other in FORMATS if other.recognise(head)] == [form.name]


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_cut_anywhere(form: BsdfFormat, written: Callable[[BsdfFormat], bytes], tmp_path: Path) -> None:
    """At bytes all over the file, and each of the first and last: an error that says so."""
    whole = written(form)
    rng = np.random.default_rng(4)
    cuts = {*range(40), *range(len(whole) - 12, len(whole) - 1), *rng.integers(0, len(whole) - 12, 12).tolist()}
    if len(whole) > 1 << 24:
        cuts = {0, 7, 100, len(whole) // 2, len(whole) - 1}
    path = tmp_path / "cut"
    for cut in sorted(cuts):
        path.write_bytes(whole[:cut])
        with pytest.raises(FormatError):
            read_bsdf_data(path)


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_damaged_bytes(form: BsdfFormat, written: Callable[[BsdfFormat], bytes], tmp_path: Path) -> None:
    """A table or an error of ours, whatever stands there."""
    damage(written(form), tmp_path)


def damage(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "damaged"

    @settings(max_examples=12 if len(whole) < 1 << 24 else 2, deadline=None, suppress_health_check=list(HealthCheck))
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
def test_tables_in_scenes_are_those_that_were_written(form: BsdfFormat, tmp_path: Path) -> None:
    bsdf = et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.3}, {"kind": "gaussian", "peak": 2, "sigma": 0.2}]
    )
    path = tmp_path / f"film{form.extensions[0]}"
    assert isinstance(et.write_bsdf(path, bsdf), tuple)
    again = et.read_bsdf(path)
    for theta in (0.0, 27.0, 55.0):
        assert float(again.reflectance(theta)) == pytest.approx(float(bsdf.reflectance(theta)), rel=0.015), theta


COLOURED = ("astm", "bird", "etendue", "lighttools", "speos-brdf")
"""Formats that hold wavelengths."""


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
def test_wavelengths_are_in_the_file_or_it_is_told_which_one_is(
    form: BsdfFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a surface whose reflectance is 0.2 at 450 nm, 0.8 at 650 nm and linear in between; as a model, and as a table."""
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 40.0))
    rising = et.bsdf.Lambertian(reflectance={"wavelength": [450, 650], "values": [0.2, 0.8]})
    grid = PolarGrid("cosines", np.array([0.0, 2.0]), np.array([0.0]))
    slices = [
        BsdfSlice(direction(theta, 0.0), [[share / math.pi] * 2], grid=grid, wavelength=wavelength)
        for theta in (10.0, 50.0)
        for wavelength, share in ((450.0, 0.2), (650.0, 0.8))
    ]
    # Large files: the model will do.
    asked = [rising] if form.name in ("klems", "tensor-tree") else [rising, et.BsdfTable(BsdfData(slices))]
    for k, bsdf in enumerate(asked):
        path = tmp_path / f"rising{k}{form.extensions[0]}"
        lost = et.write_bsdf(path, bsdf)
        again = et.read_bsdf(path)
        told = "no wavelength is in the file: its values are those at 555 nm"
        assert (told in lost) is (form.name not in COLOURED)
        waves = np.array([450.0, 500.0, 650.0])
        expected = 0.2 + 0.6 * (waves - 450.0) / 200.0 if form.name in COLOURED else np.full(3, 0.515)
        # 5e-4: shares are integrals over grids, whose cells the rim of the hemisphere cuts.
        assert [float(again.reflectance(20, wavelength=wave)) for wave in waves] == pytest.approx(expected, rel=5e-4)


def test_a_single_wavelength_is_in_the_file_or_told(tmp_path: Path) -> None:
    grid = PolarGrid("specular", np.array([0.0, 90.0]), np.array([0.0, 180.0]))
    one = BsdfSlice(direction(10, 180), np.full((2, 2), 0.1), grid=grid, wavelength=633.0)
    red = et.BsdfTable(BsdfData([one], name="red"))
    told = "no wavelength is in the file: its values are those at 633 nm"
    assert told in et.write_bsdf(tmp_path / "as_it_is.bsdf", red)
    assert told in et.write_bsdf(tmp_path / "tabled.ssdd", red)
    assert told not in et.write_bsdf(tmp_path / "red.astm", red)
    again = et.read_bsdf(tmp_path / "red.astm")
    assert again.wavelengths == (633.0,)
    # What is in that layout already is written as it is.
    assert et.write_bsdf(tmp_path / "again.astm", again) == ()
    assert (tmp_path / "again.astm").read_bytes() == (tmp_path / "red.astm").read_bytes()


def test_spectra_at_each_nanometre_are_thinned_and_that_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (40.0,))
    waves = np.arange(400.0, 701.0)
    rising = et.bsdf.Lambertian(reflectance={"wavelength": waves.tolist(), "values": (waves / 1000.0).tolist()})
    lost = et.write_bsdf(tmp_path / "rising.json", rising)
    assert "260 wavelengths between those of the file are left out" in lost
    kept = read_bsdf_data(tmp_path / "rising.json").wavelengths
    assert (len(kept), kept[0], kept[-1]) == (41, 400.0, 700.0)


def test_ways_of_different_wavelengths_in_one_file(tmp_path: Path) -> None:
    """Reflected light in two colours, and transmitted light in none: tabled, for a `.brdf` has both at the same ones."""
    grid = PolarGrid("normal", np.array([0.0, 90.0]), np.arange(0.0, 360.0, 90.0))
    slices = [
        BsdfSlice(direction(10, 180), np.full((4, 2), f), transmitted, grid=grid, wavelength=wavelength)
        for f, transmitted, wavelength in ((0.1, False, 450.0), (0.2, False, 650.0), (0.05, True, None))
    ]
    bsdf = et.BsdfTable(BsdfData(slices))
    et.write_bsdf(tmp_path / "x.brdf", bsdf)
    again = et.read_bsdf(tmp_path / "x.brdf")
    assert again.wavelengths == (450.0, 650.0)
    for wave in again.wavelengths:
        for share in ("reflectance", "transmittance"):
            found, expected = (float(getattr(one, share)(10, wavelength=wave)) for one in (again, bsdf))
            assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
def test_a_lambertian_surface_is_the_same_everywhere_in_its_file(form: BsdfFormat, tmp_path: Path) -> None:
    """f is ρ/π, or τ/π, up to the rim of the hemisphere: rounding puts directions along the surface on either side of it."""
    path = tmp_path / f"opal{form.extensions[0]}"
    write_bsdf_data(path, form.tabulate(Opal()), form.name)  # type: ignore[misc] # what is written can be made
    slices = read_bsdf_data(path).slices
    assert {one.transmitted for one in slices} == ({False} if form.name in ("bird", "zemax") else {False, True})
    for one in slices:
        there = ~np.isnan(one.directions[..., 0])
        assert one.values[there] == pytest.approx((0.1 if one.transmitted else 0.2) / math.pi, rel=1e-8)


@pytest.mark.parametrize(
    ("bsdf", "isotropic"),
    [
        (et.bsdf.Gaussian(peak=2, sigma=0.1), True),
        (et.bsdf.Gaussian(peak=2, sigma=0.1, aspect=3), False),
        (et.bsdf.RoughMetal(roughness=0.1, reflectance=0.8), True),
        (et.bsdf.RoughMetal(roughness=0.1, roughness_across=0.2, reflectance=0.8), False),
        (et.bsdf.Mixture(parts=[{"kind": "mirror"}, {"kind": "lambertian", "reflectance": 0.5}], weights=[0.5, 0.5]), True),
        (et.bsdf.Mixture(parts=[{"kind": "mirror"}, {"kind": "gaussian", "peak": 2, "sigma": 0.1, "aspect": 0.5}],
                         weights=[0.5, 0.5]), False),
    ],
)  # fmt: skip
def test_a_model_in_a_file_is_as_isotropic_as_it_is(tmp_path: Path, bsdf: et.Bsdf, isotropic: bool) -> None:
    et.write_bsdf(tmp_path / "model.h5", bsdf)
    assert et.read_bsdf(tmp_path / "model.h5").isotropic is isotropic


@pytest.mark.parametrize(
    "form", [form for form in WRITTEN if form.name not in ("klems", "tensor-tree")], ids=lambda form: form.name
)
def test_a_file_of_models_alone_is_tabled_as_the_models_are(
    form: BsdfFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its bytes are those of the same formula that never was in a file; but for the name."""
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 40.0))
    model = et.bsdf.ABg(a=0.02, b=0.05, g=2)
    et.write_bsdf(tmp_path / "model.h5", model)
    paths = [tmp_path / f"{name}{form.extensions[0]}" for name in ("model", "again")]
    lost = [
        et.write_bsdf(path, bsdf)
        for path, bsdf in zip(paths, (model, et.read_bsdf(tmp_path / "model.h5")), strict=True)
    ]
    assert lost[0] == lost[1]
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    "form", [form for form in WRITTEN if form.name not in ("klems", "tensor-tree")], ids=lambda form: form.name
)
def test_a_lobe_that_is_wider_across_than_along_stays_so(
    form: BsdfFormat, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file read back has the values of the model, light coming from several azimuths; at one incidence, which suffices.

    They are linear between nodes: by no more than h²/8 · f'' off, which is 2/σ² · e^(−3/2) of the peak at most, with steps h
    of direction cosines of 0.07 (5° of azimuth, near the rim), and of 0.14 for `bird`. Klems' patches and the cells of
    tensor trees hold means.
    """
    bsdf = et.bsdf.Gaussian(peak=2, sigma=0.15, aspect=2)
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (30.0,))
    path = tmp_path / f"brushed{form.extensions[0]}"
    lost = et.write_bsdf(path, bsdf)
    again = et.read_bsdf(path)
    single = form.name == "speos-brdf"
    assert again.isotropic is single
    assert ("only light from azimuth 180° of an anisotropic sample is in the file" in lost) is single
    azimuths = np.array([180.0] if single else [180.0, 270.0, 45.0, 0.0])
    incident = direction(30.0, azimuths)[:, None]
    off = 0.3 * np.array([[1.0, 0.0], [0.0, 1.0], [math.sqrt(0.5), math.sqrt(0.5)]])
    beta = off - incident[..., :2]
    scattered = np.concatenate([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=-1))[..., None]], axis=-1)
    found, expected = again.evaluate(incident, scattered), bsdf.evaluate(incident, scattered)
    step = 0.14 if form.name == "bird" else 0.07
    assert np.abs(found - expected).max() < step**2 / 8.0 * 2.0 * math.exp(-1.5) / 0.15**2 * 2.0


def test_directional_hemispherical_values_of_klems_are_exact(
    written: Callable[[BsdfFormat], bytes], tmp_path: Path
) -> None:
    """Σ M Λ by hand over the text of the file."""
    path = tmp_path / "x.xml"
    path.write_bytes(written(BSDF_FORMATS["klems"]))
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
