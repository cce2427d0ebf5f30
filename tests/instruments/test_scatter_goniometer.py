"""The virtual goniometer: its instrument function in closed form, its rays against its integrals, its noise, its files."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.instruments.goniometer_scan import GoniometerScan, read_goniometer_scan, total_scatter
from etendue.quantities.bsdf_directions import direction
from oracles.verdicts import LARGEST_Z, SIGNIFICANCE, assert_agree, assert_differ
from scipy.optimize import brentq
from scipy.stats import chi2

Array = npt.NDArray[np.float64]
LOPSIDED = et.bsdf.Gaussian(peak=6.0, sigma=0.08, aspect=2.0, axis=(1, 1, 0))


def lens(*, beam: float, aperture: float, shift: float) -> float:
    """Share of an even disk in another one, from the areas of two segments."""
    r, s, d = 0.5 * beam, 0.5 * aperture, abs(shift)
    if d <= abs(r - s):
        return min(1.0, (s / r) ** 2)
    if d >= r + s:
        return 0.0
    a, b = math.acos((d * d + r * r - s * s) / (2 * d * r)), math.acos((d * d + s * s - r * r) / (2 * d * s))
    return float((r * r * (a - math.sin(2 * a) / 2) + s * s * (b - math.sin(2 * b) / 2)) / (math.pi * r * r))


@pytest.mark.parametrize(("aperture", "fwhm"), [(25.0, 1.53), (22.0, 1.32), (19.0, 1.11), (16.0, 0.89)])
def test_the_instrument_function_is_the_overlap_of_two_disks(aperture: float, fwhm: float) -> None:
    """Flat top, flanks and width, apart from the foreshortening of the aperture (cos 1.5° = 0.9997)."""
    found = et.ScatterGoniometer(14, aperture, 886).instrument_function(step=0.02)
    exact = [lens(beam=14, aperture=aperture, shift=886 * math.sin(math.radians(a))) for a in found.angle]
    assert found.flux == pytest.approx(exact, abs=6e-4)
    assert found.flux[found.angle.size // 2] == pytest.approx(1.0, abs=1e-4)
    half = brentq(lambda a: lens(beam=14, aperture=aperture, shift=886 * math.sin(math.radians(a))) - 0.5, 0.1, 1.2)
    assert found.fwhm == pytest.approx(2 * half, abs=2e-3)
    assert round(2 * half, 2) == fwhm


def test_the_printed_width_takes_a_beam_that_spreads() -> None:
    """1.8° (thesis, 5.5): outermost rays at 0.56° to the axis make it, a source of light of 1.98° likewise."""
    for settings, expected in (({"divergence": 0.564}, 1.8), ({"source_angle": 1.98}, 1.8)):
        assert et.ScatterGoniometer(**settings).instrument_function(0.05).fwhm == pytest.approx(expected, abs=0.02)


def test_solid_angles_of_both_apertures_of_the_thesis() -> None:
    assert et.ScatterGoniometer(14, 25.0, 886).solid_angle == pytest.approx(6.25e-4, rel=1e-3)
    assert et.ScatterGoniometer(14, 25.4, 886).solid_angle == pytest.approx(6.455e-4, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        {"aperture": "square", "profile": "gaussian", "divergence": 0.2},
        {"aperture": "ring", "inner_diameter": 12.0, "source_angle": 0.6, "profile": (1.0, 0.2, 0.8)},
        {"divergence": -0.3},
    ],
    ids=["square", "ring", "convergent"],
)
def test_the_bare_beam_traced_and_computed(settings: dict[str, object]) -> None:
    """Rays of one seed are shared by all positions, so that each is judged by itself (Bonferroni)."""
    goniometer = et.ScatterGoniometer(14, 22, 500, **settings)
    computed = goniometer.instrument_function(0.15)
    traced = goniometer.instrument_function(0.15, rays=100_000, seed=5)
    n = 100_000
    inside = (computed.flux * n > 25) & (computed.flux * n < n - 25)
    error = np.sqrt(computed.flux * (1 - computed.flux) / n)[inside]
    z = (traced.flux - computed.flux)[inside] / error
    assert inside.sum() > 10
    assert np.abs(z).max() < LARGEST_Z + 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("theta", "plane", "settings"),
    [
        (0.0, "in-plane", {}),
        (60.0, "in-plane", {"aperture": "square", "profile": "gaussian"}),
        (60.0, "cross-plane", {"divergence": 0.5, "aperture": "ring", "inner_diameter": 10.0}),
        (40.0, "cross-plane", {"source_angle": 2.0}),
    ],
)
def test_rays_and_integrals_agree(theta: float, plane: str, settings: dict[str, object]) -> None:
    """A lobe that is no mirror image of itself; fresh rays at each position, so that errors are independent (χ²)."""
    goniometer = et.ScatterGoniometer(20, 40, 400, **settings)
    options = {"theta": theta, "step": 2.5, "span": 12.5, "plane": plane}
    exact = goniometer.measure(LOPSIDED, method="quadrature", **options)
    traced = goniometer.measure(LOPSIDED, rays=60_000, seed=3, fresh=True, **options)
    assert (exact.standard_error < 1e-4 * exact.peak).all()
    error = np.sqrt(exact.flux * (1 - exact.flux) / 60_000)
    assert_agree(values=traced.flux, expected=exact.flux, standard_error=error)
    if plane == "in-plane" and theta:
        assert_differ(values=traced.flux, other=exact.flux[::-1], standard_error=error)


@pytest.mark.slow
@pytest.mark.slow
def test_the_quadrature_resolves_a_lobe_that_is_narrow_beside_the_instrument() -> None:
    """A lobe of 0.5° behind a beam and an aperture of 1.4°, where few nodes are off by 2 % of the flux and more."""
    goniometer = et.ScatterGoniometer(30, 30, 1200, divergence=0.3)
    sigma = math.sin(math.radians(0.25)) / math.sqrt(2.0 * math.log(2.0))
    sample = et.bsdf.Gaussian(peak=0.92 / (2.0 * math.pi * sigma**2), sigma=sigma, way="transmitted")
    exact = goniometer.measure(sample, step=0.4, span=2, method="quadrature")
    traced = goniometer.measure(sample, step=0.4, span=2, rays=250_000, seed=3, fresh=True)
    assert (exact.flux > 1e-4).all()
    error = np.sqrt(exact.flux * (1 - exact.flux) / 250_000)
    assert_agree(values=traced.flux, expected=exact.flux, standard_error=error)


def test_light_that_is_mirrored_arrives_too() -> None:
    """A share of 0.3 in a single direction on a floor: the floor in closed form (ρ cosθ Ω/π), the rest of the bare beam."""
    sample = et.bsdf.DiffuseSpecular(total_reflectance=0.8, specular_reflectance=0.3)
    goniometer = et.ScatterGoniometer(10, 20, 900)
    options = {"theta": 30.0, "step": 0.5, "span": 2.0}
    exact = goniometer.measure(sample, method="quadrature", **options)
    floor = 0.5 / math.pi * np.cos(np.radians(exact.angle)) * goniometer.solid_angle
    bare = goniometer.instrument_function(0.5, 2.0).flux
    assert exact.flux == pytest.approx(floor + 0.3 * bare, rel=1e-3)
    traced = goniometer.measure(sample, rays=40_000, seed=2, fresh=True, **options)
    assert (np.abs(traced.flux - exact.flux) < LARGEST_Z * np.sqrt(exact.flux / 4e4) + 2e-5).all()


@pytest.mark.parametrize("way", ["reflected", "transmitted"])
def test_light_in_one_direction_has_the_share_of_its_wavelength(way: str) -> None:
    """The whole beam falls into the aperture: shares by wavelength, those at 450 and 650 nm exactly."""
    shares = {"wavelength": [450.0, 650.0], "values": [0.2, 0.8]}
    mirror = (
        et.bsdf.Mixed(specular_reflectance=shares)
        if way == "reflected"
        else et.bsdf.Mixed(specular_transmittance=shares)
    )
    for wavelength, share in ((450.0, 0.2), (600.0, 0.65), (650.0, 0.8)):
        goniometer = et.ScatterGoniometer(14, 25, 886, wavelength=wavelength)
        scan = goniometer.measure(mirror, 30.0, step=1.0, span=1.0, method="quadrature")
        assert scan.way == way
        assert float(scan.flux[1]) == pytest.approx(share, abs=1e-6)


def test_detectors_beyond_the_sample_measure_nothing() -> None:
    """Across the plane of incidence too: at 120° the detector would see what is transmitted."""
    film = et.bsdf.Mixed(diffuse_reflectance=0.3, diffuse_transmittance=0.6)
    for way, share in (("reflected", 0.3), ("transmitted", 0.6)):
        scan = et.ScatterGoniometer(14, 25, 886).measure(
            film, 30.0, step=30.0, span=160.0, plane="cross-plane", method="quadrature", way=way
        )
        assert scan.angle.tolist() == [-60.0, -30.0, 0.0, 30.0, 60.0]
        assert scan.bsdf * math.pi == pytest.approx(np.full(5, share), rel=1e-2)


def test_noise_below_zero_stays_in_scans() -> None:
    scan = GoniometerScan([-10.0, 0.0, 10.0], [0.1, -0.02, 0.1], solid_angle=1e-3)
    assert scan.scans().values[1] == pytest.approx(-20.0)
    assert repr(scan.scans()).endswith("1 below 0)")
    with pytest.raises(ArgumentError, match="incidence is 120°"):
        GoniometerScan([0.0], [1.0], incidence=120.0)


HEAD = "theta_i,phi_i,theta_s,phi_s,bsdf\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (HEAD + "0,180,10,0,1\n0,180,30,0,.5\n0,180,160,0,.2\n", "reflected and transmitted light"),
        (HEAD + "0,180,10,0,1\n0,180,20,45,.5\n", "outside the plane of incidence"),
        ("# way = transmitted\n" + HEAD + "20,180,10,0,1\n20,180,30,0,.5\n", "directions are of reflected light"),
        ("# incidence = nan\nangle,flux\n0,1\n", "0 to below 90°"),
    ],
)
def test_scans_of_several_things_are_refused(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=told):
        read_goniometer_scan(path)


def test_a_plane_of_light_along_the_normal_may_have_any_azimuth(tmp_path: Path) -> None:
    path = tmp_path / "scan.csv"
    path.write_text(HEAD + "0,0,20,30,.5\n0,0,0,30,1\n0,0,10,210,.7\n", encoding="utf-8")
    scan = read_goniometer_scan(path)
    assert sorted(np.abs(scan.angle).tolist()) == [0.0, 10.0, 20.0]
    assert scan.angle[0] * scan.angle[-1] < 0.0


def test_a_lambertian_hemisphere() -> None:
    """F is ρ/π wherever the detector stands; a transmitting sample is seen from behind alone."""
    goniometer = et.ScatterGoniometer(14, 100, 500)
    paint = et.bsdf.Lambertian(reflectance=0.9)
    exact = goniometer.measure_hemisphere(paint, 20.0, step=30.0, method="quadrature")
    # The spot is not a point, so that cos θ differs over it.
    assert exact.values == pytest.approx(np.full(exact.values.shape, 0.9 / math.pi), rel=0.03)
    traced = goniometer.measure_hemisphere(paint, 20.0, step=30.0, rays=200_000, seed=4)
    z = (traced.values - exact.values) / traced.standard_error
    assert chi2.sf((z**2).sum(), z.size) > SIGNIFICANCE
    with pytest.raises(ArgumentError, match="over a hemisphere"):
        goniometer.measure_hemisphere(paint, step=0.01)


def test_noise_has_the_variance_it_states() -> None:
    """Poisson counts over a floor, the beam growing by 10 %: mean and χ² over 41 positions."""
    noisy = et.ScatterGoniometer(photons=1e6, dark=400.0, drift=0.1)
    sample = et.bsdf.Gaussian(peak=50.0, sigma=0.05, way="transmitted")
    clean = et.ScatterGoniometer().measure(sample, step=0.3, span=6, method="quadrature")
    found = noisy.measure(sample, step=0.3, span=6, method="quadrature", seed=8)
    grown = clean.flux * (1 + 0.1 * np.linspace(0, 1, clean.flux.size))
    expected = np.sqrt(grown * 1e6 + 400.0) / 1e6
    assert_agree(values=found.flux, expected=grown, standard_error=expected)
    assert found.standard_error == pytest.approx(expected, rel=0.3)
    assert found.background == pytest.approx(4e-4)
    assert_differ(values=found.flux, other=clean.flux, standard_error=expected)


def test_the_same_seed_gives_the_same_scan_and_rays_are_shared_or_fresh() -> None:
    goniometer = et.ScatterGoniometer()
    sample = et.bsdf.CosinePower(peak=598.0, exponent=3761, way="transmitted")

    def scan(**more: object) -> Array:
        return goniometer.measure(sample, step=1.0, span=3, rays=5000, **more).flux

    assert np.array_equal(scan(seed=2), scan(seed=2))
    assert not np.array_equal(scan(seed=2), scan(seed=3))
    assert not np.array_equal(scan(seed=2), scan(seed=2, fresh=True))


def test_rays_from_many_directions_are_those_from_each() -> None:
    """The one draw of the core for all incident directions against one call for each."""
    incident = direction([0.0, 40.0, 70.0], [0.0, 100.0, 200.0])
    together = LOPSIDED.sample(incident, 3, seed=5)
    for k, one in enumerate(incident):
        assert np.array_equal(together[k], LOPSIDED.sample(one, 3, seed=5)[k], equal_nan=True)
    with pytest.raises(ArgumentError, match="one direction, or from 4"):
        LOPSIDED.sample(incident, 4)


def test_total_scatter_of_a_lobe() -> None:
    """Eq. 5.2 of Phong's lobe, which scatters all light, though the lobe has only eleven positions."""
    angle = np.arange(-1.0, 1.01, 0.1)
    lobe = 11589.19 * np.cos(np.radians(angle)) ** 72816
    assert total_scatter(angle, lobe) == pytest.approx(1.0, abs=1e-3)


def test_scans_become_tables() -> None:
    """Of reflected and of transmitted light, whose detector stands behind the sample."""
    scan = et.ScatterGoniometer().measure(LOPSIDED, 30.0, step=5, span=15, method="quadrature")
    values = scan.scans()
    assert values.values == pytest.approx(scan.bsdf)
    assert values.scattered[0] == pytest.approx(direction(15.0, 0.0))
    sample = et.bsdf.Gaussian(peak=6.0, sigma=0.08, way="transmitted")
    through = et.ScatterGoniometer().measure(sample, 30.0, step=5, span=15, method="quadrature")
    values = through.scans()
    assert values.values == pytest.approx(through.bsdf)
    assert values.scattered[0] == pytest.approx(direction(15.0, 0.0, behind=True))
    with pytest.raises(ArgumentError, match="of the beam alone"):
        et.ScatterGoniometer().instrument_function().scans()


def test_files_go_there_and_back(tmp_path: Path) -> None:
    goniometer = et.ScatterGoniometer(photons=1e5, dark=10)
    scan = goniometer.measure(LOPSIDED, 30.0, step=2, span=8, plane="cross-plane", method="quadrature")
    scan.save(tmp_path / "scan.csv")
    back = read_goniometer_scan(tmp_path / "scan.csv")
    assert np.array_equal(back.flux, scan.flux)
    assert np.array_equal(back.standard_error, scan.standard_error)
    facts = ("incidence", "way", "plane", "solid_angle", "background", "sample")
    assert [getattr(back, key) for key in facts] == [getattr(scan, key) for key in facts]
    # Directions with f, as other scans are written: f is the same.
    (tmp_path / "f.csv").write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,40,0,2\n30,180,20,0,3\n30,180,10,180,1\n")
    other = read_goniometer_scan(tmp_path / "f.csv")
    assert other.angle.tolist() == [-10.0, 20.0, 40.0]
    assert other.bsdf == pytest.approx([1.0, 3.0, 2.0])
    assert (other.way, other.incidence) == ("reflected", 30.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("angle,flux\n0,1\n0,2\n", "0° twice"),
        ("angle,flux\n0,1\n1,nan\n", "line 3"),
        ("angle,counts\n0,1\n", "angle,flux"),
        ("# incidence = steep\nangle,flux\n0,1\n1,1\n", "no number"),
        ("# plane = inplane\nangle,flux\n0,1\n1,1\n", "cross-plane"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,0,10,90,1\n", "plane of incidence"),
        ("theta_i,phi_i,theta_s,phi_s,bsdf\n30,0,10,0,1\n40,0,10,0,1\n", "several incidences"),
    ],
)
def test_files_that_are_no_scan(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "scan.csv").write_text(text)
    with pytest.raises(FormatError, match=told):
        read_goniometer_scan(tmp_path / "scan.csv")


def test_what_is_refused() -> None:
    for settings in ({"distance": 10}, {"photons": 0}, {"dark": 5}, {"aperture": "ring"}, {"profile": (0.0, 0.0)}):
        with pytest.raises(ArgumentError):
            et.ScatterGoniometer(**settings)
    with pytest.raises(UnknownNameError, match="disk"):
        et.ScatterGoniometer(aperture="disc")
    goniometer = et.ScatterGoniometer()
    through = et.bsdf.Gaussian(peak=2, sigma=0.1, way="transmitted")
    both = et.bsdf.Mixture(parts=[et.bsdf.Lambertian(reflectance=0.2), through])
    with pytest.raises(ArgumentError, match="say which"):
        goniometer.measure(both)
    with pytest.raises(ArgumentError, match="incidence"):
        goniometer.measure(LOPSIDED, theta=90)
    for wrong in ({"rays": 0}, {"step": 0.0}, {"seed": -1}):
        with pytest.raises(ArgumentError):
            goniometer.measure(LOPSIDED, **wrong)
    with pytest.raises(ArgumentError, match="increase"):
        GoniometerScan([1.0, 0.0], [1.0, 1.0])
    with pytest.raises(ArgumentError, match="value 2"):
        GoniometerScan([0.0, 1.0], [1.0, np.nan])
