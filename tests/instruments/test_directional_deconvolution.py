"""Two dimensions: the forward matrix against integrals and rays, four ways back, what is mirrored, what is refused."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.description.files import Files
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.instruments.directional_operator import matrix_of
from etendue.instruments.directional_scan import DirectionalScan, read_directional_scan, read_scan
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.lobe_splines import splines_for
from etendue.instruments.positions import hemisphere_around, window
from etendue.instruments.regular_share import RegularShare
from etendue.instruments.round_blur import RoundBlur
from etendue.instruments.total_variation import total_variation
from etendue.instruments.turned_sample import TurnedSample, turned
from etendue.quantities.bsdf_directions import direction
from etendue.scatter.lobe_models import LOBE_MODELS
from oracles.verdicts import assert_agree, assert_differ

Array = npt.NDArray[np.float64]
THETA, TURN = 60.0, 30.0
FLOOR = et.bsdf.Lambertian(reflectance=0.3)
GAUSSIAN = et.bsdf.Mixture(parts=[et.bsdf.Gaussian(peak=60.0, sigma=0.008, aspect=2.0), FLOOR])
ABG = et.bsdf.Mixture(parts=[et.bsdf.ABg(a=0.003, b=1e-4, g=2.2, aspect=1.7), FLOOR])
METAL = et.bsdf.RoughMetal(roughness=0.03, roughness_across=0.015, reflectance=0.7)
"""Turned by 30°, none is its own mirror image in the plane of incidence."""


pytestmark = pytest.mark.xdist_group(__name__)
"""One worker makes the scans that the tests share."""


@functools.cache
def exact_scan(name: str) -> DirectionalScan:
    sample = {"gaussian": GAUSSIAN, "abg": ABG, "metal": METAL}[name]
    return et.ScatterGoniometer().measure_window(sample, THETA, 0.75, 6, turn=TURN, method="quadrature")


def truth(*, name: str) -> Array:
    sample = {"gaussian": GAUSSIAN, "abg": ABG, "metal": METAL}[name]
    scan = exact_scan(name)
    return TurnedSample(sample, TURN).evaluate(scan.incident, scan.direction)


def counted(*, scan: DirectionalScan, peak: float, seed: int) -> DirectionalScan:
    """Poisson counts, so many where the flux is largest."""
    photons = peak / scan.flux.max()
    counts = np.random.default_rng(seed).poisson(np.maximum(scan.flux, 0.0) * photons)
    return dataclasses.replace(scan, flux=counts / photons, standard_error=np.sqrt(np.maximum(counts, 1)) / photons)


def loss(*, values: Array, exact: Array) -> float:
    return float(np.linalg.norm(values - exact) / np.linalg.norm(exact))


# --- the forward model -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "theta"),
    [({}, 60.0), ({"divergence": 0.3, "aperture": "square"}, 45.0)],
    ids=["parallel", "divergent"],
)
def test_the_matrix_gives_what_the_instrument_measures(settings: dict[str, object], theta: float) -> None:
    """Splines that carry a lobe of known f, integrated over beam and aperture, against the integral of f itself (finer
    nodes) to 1e-3 of the peak, and against rays drawn from the sample (χ², fresh rays at each position)."""
    goniometer = et.ScatterGoniometer(14, 25, 886, **settings)
    sample = et.bsdf.Gaussian(peak=200.0, sigma=0.012, aspect=2.0)
    arms = window(theta, 1.25, 3.75, behind=False)
    exact = goniometer.measure_directions(sample, arms, theta, turn=TURN, method="quadrature")
    splines = splines_for(arms, exact.regular, exact.spacing, 0.25, goniometer.bench.reach, even=True)
    matrix = matrix_of(goniometer.bench, arms, theta, splines)
    c, s = np.cos(np.radians(TURN)), np.sin(np.radians(TURN))

    def f(off: Array) -> Array:
        along, across = off[:, 0] * c + off[:, 1] * s, off[:, 1] * c - off[:, 0] * s
        return np.asarray(200.0 * np.exp(-0.5 * (along**2 + (across / 2.0) ** 2) / 0.012**2))

    seen = matrix @ splines.weights_of(f)
    assert seen == pytest.approx(exact.flux, abs=1e-3 * exact.flux.max())
    if not settings:
        rays = 40_000
        traced = goniometer.measure_directions(sample, arms, theta, rays, 3, turn=TURN, fresh=True)
        lit = seen * rays > 20
        error = np.sqrt(seen * (1 - seen) / rays)[lit]
        assert_agree(values=traced.flux[lit], expected=seen[lit], standard_error=error)
        mirrored = goniometer.measure_directions(sample, arms, theta, turn=-TURN, method="quadrature")
        assert_differ(values=traced.flux[lit], other=mirrored.flux[lit], standard_error=error)


def test_splines_carry_even_and_smooth_lobes() -> None:
    """A sum of all splines is 1 within; weights of a quadratic give it back exactly."""
    arms = window(40.0, 1.0, 3.0, behind=True)
    regular = direction(40.0, 0.0, behind=True)
    splines = splines_for(arms, regular, np.ones(len(arms)), 0.5, 1.2, even=True)
    assert splines.evaluate(np.ones(splines.count), arms) == pytest.approx(np.ones(len(arms)))

    def f(off: Array) -> Array:
        return np.asarray(3.0 + 20.0 * off[..., 0] - 5.0 * off[..., 1] + 400.0 * off[..., 0] ** 2)

    assert splines.evaluate(splines.weights_of(f), arms) == pytest.approx(f(arms[:, :2] - regular[:2]), rel=1e-9)
    assert np.isnan(splines.evaluate(np.ones(splines.count), direction(10.0, 90.0, behind=True)))


def test_an_instrument_function_alone_is_enough_about_the_regular_direction() -> None:
    """The spot is seen there as the beam is: both matrices expect the same within 1 % of the peak."""
    goniometer = et.ScatterGoniometer()
    arms = window(THETA, 0.75, 2.25, behind=False)
    scan = DirectionalScan(arms, np.ones(len(arms)), incidence=THETA)
    splines = splines_for(arms, scan.regular, scan.spacing, 0.4, goniometer.bench.reach, even=True)
    blur = RoundBlur.of(goniometer.instrument_function(0.05), goniometer.solid_angle)
    lobe = splines.weights_of(lambda off: np.exp(-0.5 * np.sum(off**2, axis=-1) / 0.01**2))
    geometric, round_ = (matrix_of(one, arms, THETA, splines) @ lobe for one in (goniometer.bench, blur))
    assert round_ == pytest.approx(geometric, abs=0.01 * geometric.max())
    assert blur.bare(arms, scan.regular) == pytest.approx(goniometer.bench.bare(arms, scan.regular), abs=2e-3)


# --- four ways back ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gaussian", "abg", "metal"])
def test_the_lobe_comes_back(name: str) -> None:
    """At 60° and 10⁴ counts at the peak: less than half of the error of the table, nothing negative, the flux kept; the
    rival has negative values."""
    scan = counted(scan=exact_scan(name), peak=1e4, seed=1)
    raw = loss(values=scan.bsdf, exact=truth(name=name))
    losses = []
    for method in ("richardson-lucy", "total-variation", "parametric"):
        found = et.deconvolve_directions(scan, method=method, regular=False, replicates=0)
        losses.append(loss(values=found.values, exact=truth(name=name)))
        assert losses[-1] < 0.5 * raw, method
        assert (found.values >= 0.0).all()
        assert found.total_flux[1] == pytest.approx(found.total_flux[0], rel=1e-3 if method == "parametric" else 1e-9)
    inverse = et.deconvolve_directions(scan, method="matrix", regular=False)
    assert loss(values=inverse.values, exact=truth(name=name)) > 2.0 * max(losses)
    assert any("below 0" in note for note in inverse.notes)


@pytest.mark.slow
def test_error_bands_hold() -> None:
    """68 ± 5 % of the values that are not faint, over three lobes with four seeds each."""
    inside = []
    for name in ("gaussian", "abg", "metal"):
        exact = truth(name=name)
        lit = exact > 0.05 * exact.max()
        for seed in range(4):
            found = et.deconvolve_directions(counted(scan=exact_scan(name), peak=1e4, seed=seed), regular=False)
            assert found.standard_error is not None
            inside.append(np.mean(np.abs(found.values - exact)[lit] < found.standard_error[lit]))
    assert 0.63 < np.mean(inside) < 0.73


@pytest.mark.slow
def test_a_model_is_found_through_the_instrument_in_transmission() -> None:
    """The parameters of an asymmetric lobe behind the sample, at 30°, within four of their standard errors of f."""
    sample = et.bsdf.Gaussian(peak=150.0, sigma=0.012, aspect=2.0, way="transmitted")
    clean = et.ScatterGoniometer().measure_window(sample, 30, 0.75, 5, turn=TURN, method="quadrature")
    scan = counted(scan=clean, peak=1e4, seed=2)
    found = et.deconvolve_directions(scan, method="parametric", regular=False)
    assert scan.way == "transmitted"
    assert found.model is not None
    lobe = found.model.bsdf.parts[0]
    assert lobe.kind == "gaussian"
    assert lobe.way == "transmitted"
    # The axis is that of the smaller or of the larger width.
    aspect, turn = (lobe.aspect, found.model.turn) if lobe.aspect > 1 else (1 / lobe.aspect, found.model.turn - 90.0)
    assert aspect == pytest.approx(2.0, rel=0.02)
    assert turn % 180.0 == pytest.approx(TURN, abs=0.5)
    exact = TurnedSample(sample, TURN).evaluate(scan.incident, scan.direction)
    assert found.standard_error is not None
    lit = exact > 0.05 * exact.max()
    assert np.abs((found.values - exact)[lit] / found.standard_error[lit]).max() < 4.0
    # What it is as a finish is what was fitted.
    made = TurnedSample(found.model.bsdf, found.model.turn).evaluate(scan.incident, scan.direction)
    assert made[lit] == pytest.approx(found.values[lit], rel=1e-9)


@pytest.mark.parametrize("name", sorted(LOBE_MODELS))
def test_models_are_those_of_the_scatter_package(name: str) -> None:
    model = LOBE_MODELS[name]
    parameters = np.array([np.log(3.0), np.log(0.02), np.log(1.7), 0.4, np.log(0.05), *model.extra])
    made = model.bsdf(parameters, behind=False, regular=0.0)
    incident, to = direction(40.0, 180.0), direction([38.0, 41.0, 45.0, 10.0], [2.0, 358.0, 5.0, 90.0])
    exact = TurnedSample(made.bsdf, made.turn).evaluate(incident, to)
    assert model.f(parameters, to[:, :2] + incident[:2]) == pytest.approx(exact, rel=1e-9)
    assert made.turn == pytest.approx(np.degrees(0.4))


@pytest.mark.parametrize("name", LOBE_MODELS)
@pytest.mark.parametrize("aspect", [0.4, 3.0])
def test_a_lobe_has_one_axis_along_which_it_is_narrow(name: str, aspect: float) -> None:
    """The same f in every direction, however axis and aspect are told; only the aspect changes sides of 1."""
    model = LOBE_MODELS[name]
    told = model.start(peak=60.0, width=0.03, aspect=aspect, azimuth=0.7, floor=0.1)
    found = model.normal_form(told)
    off = np.random.default_rng(1).normal(scale=0.05, size=(100, 2))
    np.testing.assert_allclose(model.f(found, off), model.f(told, off), rtol=1e-12)
    assert np.exp(found[2]) == pytest.approx(max(aspect, 1 / aspect))


@pytest.mark.slow
def test_what_is_mirrored_is_told_apart() -> None:
    """2 % under a lobe, which Richardson and Lucy alone take for a part of it; where there is none, none is told."""
    lobe = et.bsdf.Gaussian(peak=60.0, sigma=0.02, aspect=2.0)
    sample = et.bsdf.Mixture(parts=[lobe, FLOOR, et.bsdf.Mirror(reflectance=0.02)])
    clean = et.ScatterGoniometer().measure_window(sample, THETA, 0.75, 4.5, turn=TURN, method="quadrature")
    scan = counted(scan=clean, peak=1e4, seed=1)
    exact = TurnedSample(sample, TURN).evaluate(scan.incident, scan.direction)
    alone = et.deconvolve_directions(scan, regular=False, replicates=0)
    apart = et.deconvolve_directions(scan, replicates=4)
    fitted = et.deconvolve_directions(scan, method="parametric")
    assert loss(values=apart.values, exact=exact) < 0.2 * loss(values=alone.values, exact=exact)
    for found in (apart, fitted):
        assert abs(found.regular.share - 0.02) < 4.0 * found.regular.error < 0.006
        assert any("single direction" in note for note in found.notes)
    stated = et.deconvolve_directions(scan, regular=0.02, replicates=0)
    assert loss(values=stated.values, exact=exact) < 0.05
    none = et.deconvolve_directions(counted(scan=exact_scan("gaussian"), peak=1e4, seed=1), replicates=0)
    assert none.regular.share == 0.0


def test_total_variation_by_hand() -> None:
    """One weight among zeros: its slopes to the right and above are −1/√2, those from the left and below 1."""
    arms = window(0.0, 1.0, 2.0, behind=False)
    splines = splines_for(arms, direction(0.0, 0.0), np.ones(len(arms)), 1.0, 1.0, even=True)
    (level,) = splines.levels
    x = np.zeros((splines.count, 1))
    middle = level.number[level.number.shape[0] // 2, level.number.shape[1] // 2]
    x[middle] = 5.0
    factor = total_variation(splines, 0.01)(x)
    assert factor[middle, 0] == pytest.approx(1.0 / (1.0 + 0.01 * (2.0 + np.sqrt(2.0))), rel=1e-5)


# --- tables ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_table_holds_what_was_found() -> None:
    """F in the plane of incidence as `evaluate` tells it, and the mirrored share as a component."""
    scan = counted(scan=exact_scan("abg"), peak=1e4, seed=1)
    found = et.deconvolve_directions(scan, regular=False, replicates=4)
    table = et.bsdf_table([dataclasses.replace(found, regular=RegularShare(0.01, 0.0, "stated"))])
    to = direction([57.0, 59.0, 60.0, 62.0], 0.0)
    # The core keeps f to a few thousandths between its own radial coordinates.
    assert table.evaluate(scan.incident, to) == pytest.approx(found.evaluate(to), rel=0.02)
    assert table.regular_reflectance(THETA) == pytest.approx(0.01)
    raw = et.bsdf_table([scan])
    assert raw.evaluate(scan.incident, scan.regular) == pytest.approx(scan.bsdf.max(), rel=0.05)
    with pytest.raises(ArgumentError, match="one scan or more"):
        et.bsdf_table([])


# --- scans -------------------------------------------------------------------------------------------------------------


def test_files_go_there_and_back(tmp_path: Path) -> None:
    goniometer = et.ScatterGoniometer(12, 20, 700, profile=(1.0, 0.5), photons=1e6, dark=10)
    scan = goniometer.measure_window(et.bsdf.Gaussian(peak=6.0, sigma=0.08), 30, 5, 5, method="quadrature")
    scan.save(tmp_path / "scan.csv")
    back = read_scan(tmp_path / "scan.csv")
    assert isinstance(back, DirectionalScan)
    assert back.direction == pytest.approx(scan.direction, abs=1e-12)
    assert np.array_equal(back.flux, scan.flux)
    assert np.array_equal(back.standard_error, scan.standard_error)
    facts = ("incidence", "way", "solid_angle", "background", "bench")
    assert [getattr(back, key) for key in facts] == [getattr(scan, key) for key in facts]
    # F at directions, from another azimuth.
    rows = "30,90,30,270,2\n30,90,31,275,1\n30,90,29,265,1.5\n"
    (tmp_path / "f.csv").write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n" + rows)
    other = read_scan(tmp_path / "f.csv")
    assert isinstance(other, DirectionalScan)
    assert other.direction[0] == pytest.approx(other.regular)
    assert other.bsdf == pytest.approx([2.0, 1.0, 1.5])
    (tmp_path / "plane.csv").write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n30,90,30,270,2\n30,90,31,270,1\n")
    assert isinstance(read_scan(tmp_path / "plane.csv"), GoniometerScan)
    (tmp_path / "twice.csv").write_text("theta_s,phi_s,flux\n30,0,1\n30,360,2\n")
    with pytest.raises(FormatError, match="stand twice"):
        read_directional_scan(tmp_path / "twice.csv")
    (tmp_path / "bench.csv").write_text(
        "# beam_diameter = wide\n# aperture_diameter = 25\n# distance = 886\ntheta_s,phi_s,flux\n30,0,1\n"
    )
    with pytest.raises(FormatError, match="wide"):
        read_directional_scan(tmp_path / "bench.csv")


def test_windows_and_hemispheres() -> None:
    """All positions on their side; the ones around leave a hole; the detector's head shadows the beam."""
    arms = window(80.0, 2.0, 20.0, behind=True)
    assert (arms[:, 2] < 0.0).all()
    around = hemisphere_around(30.0, 10.0, 25.0, behind=False)
    off = np.degrees(np.arccos(around @ direction(30.0, 0.0)))
    assert off.min() > 25.0
    assert off.max() > 100.0
    goniometer = et.ScatterGoniometer(head_diameter=120.0)
    scan = goniometer.measure_directions(FLOOR, around, 30.0, method="quadrature")
    apart = np.degrees(np.arccos(around @ scan.incident))
    limit = np.degrees(np.arcsin(0.5 * (120.0 + 14.0) / 886.0))
    assert scan.flux.size == (apart > limit).sum() < len(around)
    assert "stands in the beam" in scan.notes[0]
    with pytest.raises(ArgumentError, match="at all positions"):
        goniometer.measure_directions(FLOOR, scan.incident[None], 30.0)


def test_a_turned_sample() -> None:
    """f of both directions turned back, drawn rays turned along; shares are those of the azimuth."""
    sample = TurnedSample(et.bsdf.Gaussian(peak=20.0, sigma=0.05, aspect=3.0), TURN)
    incident, to = direction(40.0, 180.0), direction([38.0, 42.0], [4.0, 8.0])
    plain = sample.bsdf.evaluate(direction(40.0, 150.0), direction([38.0, 42.0], [-26.0, -22.0]))
    assert sample.evaluate(incident, to) == pytest.approx(plain)
    rays = sample.sample(incident, 100, seed=3)
    assert turned(rays, -TURN) == pytest.approx(sample.bsdf.sample(turned(incident, -TURN), 100, seed=3), nan_ok=True)
    assert sample.reflectance(40.0) == pytest.approx(sample.bsdf.reflectance(40.0, -TURN))
    with pytest.raises(ArgumentError, match="axis"):
        sample.record(Files())


# --- what is not as it should be ---------------------------------------------------------------------------------------


def test_gaps_and_negative_fluxes_are_told_and_survived() -> None:
    scan = counted(scan=exact_scan("gaussian"), peak=1e4, seed=3)
    hole = np.linalg.norm(scan.direction - direction(62.0, 0.0), axis=1) > 0.02
    flux = scan.flux.copy()
    flux[:3] = -2e-6
    assert scan.standard_error is not None
    torn = dataclasses.replace(
        scan, direction=scan.direction[hole], flux=flux[hole], standard_error=scan.standard_error[hole]
    )
    found = et.deconvolve_directions(torn, regular=False, replicates=4)
    told = " ".join(found.notes)
    assert "positions are missing in the window" in told
    assert "3 fluxes are below 0" in told
    assert found.values.size == torn.flux.size
    assert loss(values=found.values, exact=truth(name="gaussian")[hole]) < 0.05
    # In the hole, too, something is known: its surroundings see it.
    assert np.isfinite(found.evaluate(direction(62.0, 0.0)))


@pytest.mark.slow
def test_positions_over_the_hemisphere_are_kept() -> None:
    """Coarse positions around the window: f there is the floor that was measured."""
    clean = et.ScatterGoniometer().measure_window(GAUSSIAN, THETA, 1.0, 5, outside=15.0, turn=TURN, method="quadrature")
    scan = counted(scan=clean, peak=1e5, seed=1)
    found = et.deconvolve_directions(scan, regular=False, replicates=0)
    far = scan.spacing > 5.0
    assert far.sum() > 50
    assert found.values[far] == pytest.approx(np.full(far.sum(), 0.3 / np.pi), rel=0.25)
    assert any("as it was measured" in note for note in found.notes)


@pytest.mark.slow
def test_what_is_refused() -> None:
    scan = exact_scan("gaussian")
    some = {"regular": False, "replicates": 0}
    with pytest.raises(ArgumentError, match="scan to larger angles"):
        et.deconvolve_directions(scan, et.ScatterGoniometer(aperture_diameter=250))
    with pytest.raises(ArgumentError, match="instrument is not known"):
        et.deconvolve_directions(dataclasses.replace(scan, bench=None))
    with pytest.raises(UnknownNameError, match="richardson-lucy"):
        et.deconvolve_directions(scan, method="richardson")  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="no light"):
        et.deconvolve_directions(dataclasses.replace(scan, flux=np.zeros(scan.flux.size)))
    few = DirectionalScan(scan.direction[:5], scan.flux[:5], bench=scan.bench, incidence=THETA)
    with pytest.raises(ArgumentError, match="9 are needed"):
        et.deconvolve_directions(few)
    with pytest.raises(ArgumentError, match="regular share"):
        et.deconvolve_directions(scan, regular=2.0)
    with pytest.raises(ArgumentError, match="cells"):
        et.deconvolve_directions(scan, cell=0.0)
    bare = dataclasses.replace(scan, standard_error=None)
    for method in ("parametric", "total-variation"):
        with pytest.raises(ArgumentError, match="standard errors"):
            et.deconvolve_directions(bare, method=method, **some)  # type: ignore[arg-type]
    noisy = counted(scan=scan, peak=1e4, seed=1)
    with pytest.raises(UnknownNameError, match="gaussian"):
        et.deconvolve_directions(noisy, method="parametric", models=("gausian",), **some)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="no model"):
        et.deconvolve_directions(noisy, method="parametric", models=(), **some)  # type: ignore[arg-type]
    found = et.deconvolve_directions(bare, stop=5, **some)  # type: ignore[arg-type]
    assert found.standard_error is None


def test_scans_that_are_none() -> None:
    up = direction([10.0, 20.0], 0.0)
    for wrong, told in (
        ((up * 2.0, [1.0, 1.0]), "unit vectors"),
        ((up, [1.0]), "2 directions"),
        ((up, [1.0, np.nan]), "value 2"),
        ((np.concatenate([up, -up]), np.ones(4)), "split it"),
        ((up[[0, 0]], [1.0, 1.0]), "stand twice"),
    ):
        with pytest.raises(ArgumentError, match=told):
            DirectionalScan(*wrong)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="solid angle"):
        _ = DirectionalScan(up, [1.0, 1.0]).bsdf


@pytest.mark.parametrize("name", LOBE_MODELS)
def test_steep_lobes_are_0_far_outside(name: str) -> None:
    """A search for the parameters comes by such places; F is 1 in the middle and falls to 0 without a warning."""
    model = LOBE_MODELS[name]
    values = model.shape(np.array([0.0, 1e10, 1e20]), np.array([6.0 for _ in model.extra]))
    assert values.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.slow
def test_a_scan_without_noise_comes_back() -> None:
    """Quadratures have standard errors of rounding: more counts than can be parted one by one. The Gaussian has 6 /sr."""
    goniometer = et.ScatterGoniometer()
    sample = et.bsdf.Gaussian(peak=6, sigma=0.08)
    scan = goniometer.measure_window(sample, 30, step=2.5, span=20, method="quadrature")
    assert scan.standard_error is not None
    assert 0.0 < scan.standard_error.max() < 1e-12 * scan.flux.max()
    for stop in (None, "held-out"):
        assert et.deconvolve_directions(scan, stop=stop, replicates=0).peak == pytest.approx(6.0, rel=0.02)
