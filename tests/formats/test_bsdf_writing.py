"""What writers make of a BSDF that no format holds as it is: values at the rim, azimuths, wavelengths, and what is told."""

from __future__ import annotations

import dataclasses
import importlib
import math
import re
from pathlib import Path

import etendue as et
import h5py
import numpy as np
import numpy.typing as npt
import pytest
from etendue.formats.bsdf import BSDF_FORMATS, read_bsdf_data, write_bsdf_data
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.errors import with_standard_errors
from etendue.scatter.models.finish import Finish
from formats.slanted import coarsen

Array = npt.NDArray[np.float64]

WRITTEN = [form for form in BSDF_FORMATS.values() if form.write is not None]

COLOURED = ("astm", "bird", "etendue", "lighttools", "speos-brdf")
"""Formats that hold wavelengths."""

LARGE = ("klems", "tensor-tree")
"""Formats of light from all directions."""


class Opal:
    """A Lambertian surface; light that is neither reflected nor transmitted has no f."""

    name, isotropic, reflects, transmits, both_sides = "opal", True, True, True, True
    wavelengths: tuple[float, ...] = ()
    incidences = (0.0, 45.0, 65.0, 80.0)
    turns = (0.0,)

    def evaluate(self, incident: npt.ArrayLike, scattered: npt.ArrayLike, *, wavelength: float | None = None) -> Array:
        assert wavelength is None
        i, s = np.broadcast_arrays(np.asarray(incident, float), np.asarray(scattered, float))
        sides = np.sign(i[..., 2]) * np.sign(s[..., 2])
        return np.select([sides > 0.0, sides < 0.0], [0.2 / math.pi, 0.1 / math.pi], 0.0)


def test_formats_of_reflected_light_say_that_they_lose_a_film(tmp_path: Path) -> None:
    """Of a film that transmits alone nothing is left."""
    film = et.bsdf.Gaussian(peak=5.0, sigma=0.15, way="transmitted")
    assert "the file holds reflected light only" in et.write_bsdf(tmp_path / "film.json", film)


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
    told = "no wavelength is in the file: its values are those at 555 nm"
    if form.name in LARGE:
        # The model will do, and what each slice says: to make a table for scenes of hundreds of them takes seconds.
        path = tmp_path / f"rising{form.extensions[0]}"
        assert told in et.write_bsdf(path, rising)
        read = read_bsdf_data(path)
        assert read.wavelengths == ()
        assert [one.integral() for one in read.slices] == pytest.approx([0.515] * len(read.slices), rel=5e-4)
        return
    for k, bsdf in enumerate([rising, et.BsdfTable(BsdfData(slices))]):
        path = tmp_path / f"rising{k}{form.extensions[0]}"
        lost = et.write_bsdf(path, bsdf)
        again = et.read_bsdf(path)
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


@pytest.mark.parametrize("peak", [50.0, 0.2])
def test_a_lobe_between_the_directions_of_a_table_is_told(
    peak: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a Gaussian at normal incidence 2π σ² peak (1 − exp(−1/(2 σ²))) is scattered, and so much is in the file.

    Its nodes are 10° apart, and f bilinear between them, so that a lobe much narrower than that would be a tent of ten times
    the light; of a sample that is nearly black that is told as well.
    """
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0,))
    sigma = 0.03
    said = re.compile(
        r"too far apart .* at 0° of incidence they add up to (\S+) of the light, in truth (\S+); values are scaled"
    )
    lost = et.write_bsdf(tmp_path / "narrow.json", et.bsdf.Gaussian(peak=peak, sigma=sigma))
    (told,) = filter(None, map(said.search, lost))
    (one,) = read_bsdf_data(tmp_path / "narrow.json").slices
    true = 2.0 * math.pi * sigma**2 * peak * (1.0 - math.exp(-0.5 / sigma**2))
    assert float(told[1]) > 1.02 * true
    assert told[2] == f"{true:.3g}"
    assert abs(one.integral() - true) < 1e-6 * true
    assert not any(
        "apart" in note for note in et.write_bsdf(tmp_path / "wide.json", et.bsdf.Lambertian(reflectance=0.9))
    )


@pytest.mark.slow
def test_no_file_holds_more_light_than_is_received(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lobe of 0.6° between nodes that are far apart: its table would have scattered three times the light."""
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (0.0, 30.0))
    narrow = et.bsdf.Gaussian(peak=400.0, sigma=0.01)
    for name in ("narrow.json", "narrow.xml"):
        et.write_bsdf(tmp_path / name, narrow)
        again = et.read_bsdf(tmp_path / name)
        assert np.allclose(again.reflectance([0, 30]), narrow.reflectance([0, 30]), rtol=1e-3), name


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
        np.testing.assert_allclose(one.values[there], (0.1 if one.transmitted else 0.2) / math.pi, rtol=1e-8)


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
    # Files that were written before say of all models that they are isotropic.
    assert isinstance(bsdf, Finish)
    et.write_bsdf(tmp_path / "old.h5", et.BsdfTable(BsdfData(components=(bsdf.to_dict(),), isotropic=True)))
    assert et.read_bsdf(tmp_path / "old.h5").isotropic is isotropic


@pytest.mark.parametrize("form", ["astm", "bird", "fred", "ssdd", "zemax"])
def test_another_back_is_in_the_file_or_told(tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    coarsen(monkeypatch)
    grid = PolarGrid("cosines", np.array([0.0, 2.0]), np.array([0.0]))
    slices = [
        BsdfSlice(direction(30.0, 180.0, behind=behind), np.full(grid.shape, share / math.pi), grid=grid)
        for behind, share in ((False, 0.2), (True, 0.6))
    ]
    lost = et.write_bsdf(tmp_path / "two", et.BsdfTable(BsdfData(slices, both_sides=False)), form)
    back = float(et.read_bsdf(tmp_path / "two").reflectance(30.0, side="back"))
    assert back == pytest.approx(0.6 if form == "astm" else 0.2, rel=0.01)
    assert any("only light that meets the front" in one for one in lost) is (form != "astm")


@pytest.mark.parametrize("interpolated", [False, True])
def test_whether_neighbours_err_together_is_kept(tmp_path: Path, interpolated: bool) -> None:
    grid = PolarGrid("cosines", np.array([0.0, 2.0]), np.array([0.0]))
    f = np.full(grid.shape, 0.1)
    one = BsdfSlice(direction(30.0, 180.0), f, grid=grid, standard_error=0.1 * f, interpolated=interpolated)
    et.write_bsdf(tmp_path / "scans.h5", et.BsdfTable(BsdfData([one])))
    assert read_bsdf_data(tmp_path / "scans.h5").slices[0].interpolated is interpolated
    with h5py.File(tmp_path / "scans.h5", "r+") as file:
        del file["slice000000"].attrs["interpolated"]
    assert read_bsdf_data(tmp_path / "scans.h5").slices[0].interpolated is False


@pytest.mark.parametrize("form", [form for form in WRITTEN if form.name not in LARGE], ids=lambda form: form.name)
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
@pytest.mark.parametrize("form", [form for form in WRITTEN if form.name not in LARGE], ids=lambda form: form.name)
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
    for name in ("astm", "fred", "lighttools", "speos"):  # steps of 4°: what azimuths have
        module = f"etendue.formats.bsdf.{name}"
        monkeypatch.setattr(f"{module}.THETA", importlib.import_module(module).THETA[::2])
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


def _measured(incident: Array, error: npt.ArrayLike, *, frame: str = "cosines") -> BsdfSlice:
    """f of 0.1 with an error of so much at the specular direction, and from the far end of the grid on."""
    grid = PolarGrid(frame, np.array([0.0, 0.4 if frame == "cosines" else 50.0]), np.array([0.0, 180.0]))  # type: ignore[arg-type]
    return BsdfSlice(incident, np.full((2, 2), 0.1), grid=grid, standard_error=np.broadcast_to(error, (2, 2)))


@pytest.mark.slow
@pytest.mark.parametrize("form", WRITTEN, ids=lambda form: form.name)
@pytest.mark.parametrize("frame", ["cosines", "specular"])
def test_standard_errors_are_in_the_file_or_it_is_told_once(form: BsdfFormat, tmp_path: Path, frame: str) -> None:
    """In the layout of some formats, and in that of others, for which a table is made."""
    bsdf = et.BsdfTable(BsdfData([_measured(direction(30.0, 180.0), 0.01, frame=frame)]))
    lost = et.write_bsdf(tmp_path / f"x{form.extensions[0]}", bsdf)
    kept = form.name in ("etendue", "bird")
    assert [note for note in lost if "place for standard errors" in note] == (
        [] if kept else ["the format has no place for standard errors"]
    )
    (one,) = read_bsdf_data(tmp_path / f"x{form.extensions[0]}").slices if kept else (None,)
    assert one is None or np.asarray(one.standard_error) == pytest.approx(0.01)
    assert ("neighbouring values go together" in " ".join(lost)) is (form.name == "bird")


def test_standard_errors_of_a_table_that_is_made_for_a_format(tmp_path: Path) -> None:
    """Linear in |β − β₀| to 0.4, so that interpolating between two nodes is exact: 0.01 + 0.025 |β − β₀| there."""
    bsdf = et.BsdfTable(BsdfData([_measured(direction(30.0, 90.0), [0.01, 0.02])]))
    assert "the values are a table made for this format" in et.write_bsdf(tmp_path / "x.json", bsdf)
    (one,) = read_bsdf_data(tmp_path / "x.json").slices
    off = np.linalg.norm(one.directions[..., :2] + one.incident[:2], axis=-1)
    assert off.max() > 1.4
    assert np.asarray(one.standard_error) == pytest.approx(0.01 + 0.025 * np.minimum(off, 0.4), rel=1e-6)


def test_standard_errors_between_azimuths_and_wavelengths() -> None:
    """Linear in both, as f is: known at azimuths 180 and 270°, and at 450 and 650 nm."""
    measured = [
        dataclasses.replace(_measured(direction(30.0, 180.0 + turn), 0.01 + turn / 9e3 + red), wavelength=wave)
        for turn in (0.0, 90.0)
        for wave, red in ((450.0, 0.0), (650.0, 0.1))
    ]
    data = BsdfData(measured, isotropic=False)
    grid = PolarGrid("normal", np.array([0.0, 80.0]), np.arange(0.0, 360.0, 60.0))
    for turn, expected in ((0.0, 0.01), (45.0, 0.015), (90.0, 0.02), (225.0, 0.015)):
        for wave, red in ((400.0, 0.0), (450.0, 0.0), (500.0, 0.025), (650.0, 0.1)):
            one = BsdfSlice(direction(30.0, 180.0 + turn), np.full(grid.shape, 0.1), grid=grid, wavelength=wave)
            (made,) = with_standard_errors(BsdfData([one], isotropic=False), data).slices
            assert np.asarray(made.standard_error) == pytest.approx(expected + red, rel=1e-9)


def test_standard_errors_of_points_turn_with_the_plane_of_incidence() -> None:
    """Those of the nearest point; of a sample that may be turned, at the same place beside the plane of incidence.

    Where errors are not known for all of the light, there are none.
    """
    points = direction(40.0, np.array([0.0, 90.0, 180.0, 270.0]))
    errors = np.array([0.01, 0.02, 0.03, 0.04])
    measured = BsdfSlice(direction(30.0, 180.0), np.full(4, 0.1), points=points, standard_error=errors)
    grid = PolarGrid("normal", np.array([0.0, 38.0]), np.array([90.0, 180.0, 270.0, 360.0]) - 3.0)
    one = BsdfSlice(direction(30.0, 270.0), np.full(grid.shape, 0.1), grid=grid)
    (made,) = with_standard_errors(BsdfData([one]), BsdfData([measured])).slices
    # Turned by 90°: what lay at azimuth 0, where the light goes, lies at 90° now.
    assert np.asarray(made.standard_error)[:, 1] == pytest.approx(errors)
    unknown = dataclasses.replace(measured, incident=direction(60.0, 180.0), standard_error=None)
    both = BsdfData([one])
    assert with_standard_errors(both, BsdfData([measured, unknown])) is both
