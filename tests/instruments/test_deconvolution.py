"""Deconvolution: the forward model against two other routes, the rules, the diffusers of the thesis, what is refused."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.instruments import penalised_lobe as penalised
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.operators import middle_of, operator_of
from etendue.instruments.stopping import Course, discrepancy, held_out, plateau, thesis

Array = npt.NDArray[np.float64]
DIFFUSERS = {"SD1": 3761, "SD2": 18204, "SD3": 72815}
"""Exponents of table 5.1."""


def top(*, exponent: int) -> float:
    """B of eq. 5.5."""
    return (1 + exponent / 2) / math.pi


def truth(*, name: str, angle: Array) -> Array:
    """Eqs. 5.4 and 5.6 [1/sr]."""
    if name == "SD4":
        lobes = np.exp(-2 * angle**2) + sum(0.5 * np.exp(-8 * (angle - s) ** 2) for s in (2, -2))
        return np.asarray(596.08 / np.cos(np.radians(angle)) * lobes)
    return np.asarray(top(exponent=DIFFUSERS[name]) * np.cos(np.radians(angle)) ** DIFFUSERS[name])


pytestmark = pytest.mark.xdist_group(__name__)
"""One worker makes the scans that the tests share."""


@functools.cache
def exact_scan(name: str) -> GoniometerScan:
    """Without noise, by quadrature; of SD4, which is no model, by its own two-dimensional integral."""
    goniometer = et.ScatterGoniometer()
    if name != "SD4":
        # Told to be a hair less than all light, which rounding might exceed.
        sample = et.bsdf.CosinePower(
            peak=0.9999 * top(exponent=DIFFUSERS[name]), exponent=DIFFUSERS[name], way="transmitted"
        )
        return goniometer.measure(sample, span=5, method="quadrature")
    return plane_scan(angle=np.round(np.arange(-5.0, 5.01, 0.1), 10))


def plane_scan(*, angle: Array) -> GoniometerScan:
    """SD4 behind beam and aperture, as images on a plane convolved by FFT: a third route, right to θ²/2 = 0.1 %."""
    side, half = 0.4, 886 * math.tan(math.radians(7))
    axis = np.arange(-half, half, side)
    radius = np.hypot(*np.meshgrid(axis, axis))
    lobe = truth(name="SD4", angle=np.degrees(np.arctan(radius / 886)))
    blurs = [np.clip((0.5 * d - radius) / side + 0.5, 0, 1) for d in (14.0, 25.0)]
    spectrum = np.fft.rfft2(lobe)
    for blur in blurs:
        spectrum = spectrum * np.fft.rfft2(np.fft.ifftshift(blur) / blur.sum())
    image = np.fft.irfft2(spectrum, lobe.shape)
    middle = int(np.argmin(np.abs(axis)))
    flux = np.interp(886 * np.tan(np.radians(angle)), axis, image[middle]) * et.ScatterGoniometer().solid_angle
    return GoniometerScan(angle, flux, solid_angle=et.ScatterGoniometer().solid_angle)


def counted(*, scan: GoniometerScan, photons: float, seed: int, shift: float = 0.0) -> GoniometerScan:
    """The same with Poisson noise, the middle moved."""
    rng = np.random.default_rng(seed)
    counts = rng.poisson(scan.flux * photons)
    error = np.sqrt(np.maximum(counts, 1)) / photons
    return dataclasses.replace(scan, angle=scan.angle + shift, flux=counts / photons, standard_error=error)


def loss(*, found: et.Deconvolution, name: str) -> float:
    """Relative L2 error against the truth."""
    exact = truth(name=name, angle=found.angle - found.middle)
    return float(np.linalg.norm(found.values - exact) / np.linalg.norm(exact))


SIGNATURE = et.ScatterGoniometer().instrument_function()


# --- the forward model -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SD1", "SD2", "SD3", "SD4"])
def test_rings_give_what_the_instrument_measures(name: str) -> None:
    """The matrix against the four-dimensional integral over beam and aperture, or the convolution of two images."""
    scan = exact_scan(name)
    model = operator_of(scan, SIGNATURE, "rings", 0.0)
    m = model.nodes.size
    # Weights of splines that take the values of the truth at the nodes.
    splines = np.zeros((m, m))
    for shift, part in ((-1, 1 / 6), (0, 4 / 6), (1, 1 / 6)):
        np.add.at(splines, (np.arange(m), np.minimum(np.abs(np.arange(m) + shift), m - 1)), part)
    lobe = truth(name=name, angle=model.nodes) * np.cos(np.radians(model.nodes)) * scan.solid_angle
    seen = model.matrix @ np.linalg.solve(splines, lobe)
    assert seen == pytest.approx(scan.flux, abs=1.5e-3 * scan.peak)
    slice_of = operator_of(scan, SIGNATURE, "slice", 0.0)
    flat = slice_of.matrix @ (truth(name=name, angle=scan.angle) * np.cos(np.radians(scan.angle)) * scan.solid_angle)
    # The slice's convolution is another thing: two of the thesis' lobes are off by more than 5 %.
    assert np.abs(flat - scan.flux).max() > 0.02 * scan.peak


def test_a_flat_field_stays_flat_and_gaussians_add_their_variances() -> None:
    """Rows add up to 1; a Gaussian of 0.5° behind one of 0.4° has √(0.5² + 0.4²)."""
    angle = np.round(np.arange(-6, 6.01, 0.1), 10)
    blur = GoniometerScan(angle, np.exp(-0.5 * (angle / 0.4) ** 2))
    scan = GoniometerScan(angle, np.ones(angle.size))
    model = operator_of(scan, blur, "rings", 0.0)
    assert model.matrix.sum(axis=1) == pytest.approx(np.ones(angle.size), abs=2e-4)
    lobe = np.exp(-0.5 * (model.nodes / 0.5) ** 2 * 0.25 / (0.25 - 0.1**2 / 3))  # a B-spline adds a third of a step²
    seen = model.matrix @ lobe
    expected = np.exp(-0.5 * angle**2 / (0.25 + 0.16))
    assert seen / seen.max() == pytest.approx(expected, abs=3e-4)


def test_the_middle_of_a_lobe_is_found_between_positions() -> None:
    angle = np.arange(-4.0, 4.01, 0.1)
    assert middle_of(angle, np.exp(-2 * (angle + 0.437) ** 2)) == pytest.approx(-0.437, abs=2e-3)


# --- the rules ---------------------------------------------------------------------------------------------------------


def test_rules_on_courses_that_are_known() -> None:
    """Two minima and a disturbance; noise reached; a plateau; scores of which the second is within its error of the best."""
    error = np.array([5.0, 4.0, 3.0, 3.002, 2.5, 2.502, 2.9, 1.0])
    assert thesis(Course(error))[0] == 5
    assert thesis(Course(np.array([1.0, 2.0, 0.5])))[0] == 1
    assert thesis(Course(np.array([3.0, 2.0, 1.0])))[0] == 3
    assert discrepancy(Course(error, np.array([3.0, 1.5, 0.99, 0.8])))[0] == 3
    assert discrepancy(Course(error, np.array([3.0, 1.5, 1.2, 1.4])))[0] == 3
    assert plateau(Course(np.array([2.0, 1.0, 0.9995])))[0] == 3
    scores = np.array([[9.0, 9.0, 9.0], [1.1, 0.9, 1.2], [1.0, 1.0, 1.0], [1.5, 1.6, 1.4]])
    assert held_out(Course(error, None, scores))[0] == 4


# --- the diffusers of the thesis ---------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SD1", "SD2", "SD3", "SD4"])
def test_the_lobe_comes_back_better_than_by_the_rule_of_the_thesis(name: str) -> None:
    """A million photons: relative L2 error, total scatter, no negative values."""
    scan = counted(scan=exact_scan(name), photons=1e6, seed=4)
    ours = et.deconvolve(scan, SIGNATURE)
    theirs = et.deconvolve(scan, SIGNATURE, operator="slice", stop="thesis", replicates=0)
    inverse = et.deconvolve(scan, SIGNATURE, operator="slice", method="matrix", replicates=0)
    raw = np.linalg.norm(scan.bsdf - truth(name=name, angle=scan.angle)) / np.linalg.norm(
        truth(name=name, angle=scan.angle)
    )
    assert loss(found=ours, name=name) < min(0.06 if name == "SD4" else 0.03, loss(found=theirs, name=name))
    assert loss(found=theirs, name=name) < raw
    for found in (ours, theirs, inverse):
        assert found.total_scatter[1] == pytest.approx(found.total_scatter[0], rel=1e-6)
    assert (ours.values >= 0.0).all()
    assert inverse.values.min() < -0.01 * inverse.peak
    assert any("below 0" in note for note in inverse.notes)


LOBES: dict[str, et.Bsdf] = {
    "ABg": et.bsdf.ABg(a=0.006, b=1e-4, g=2.0, way="transmitted"),
    "Harvey and Shack": et.bsdf.HarveyShack(b0=200, l=0.012, s=-2.2, way="transmitted"),
    "a peak on a foot": et.bsdf.Mixture(
        parts=[
            et.bsdf.Gaussian(peak=800.0, sigma=0.008, way="transmitted"),
            et.bsdf.Gaussian(peak=80.0, sigma=0.025, way="transmitted"),
        ]
    ),
}
"""Lobes that are no Gaussians, beside those of the thesis."""


@functools.cache
def known(name: str) -> tuple[GoniometerScan, Array]:
    """An exact scan, and the truth at its positions [1/sr]."""
    if name not in LOBES:
        scan = exact_scan(name)
        return scan, truth(name=name, angle=scan.angle)
    scan = et.ScatterGoniometer().measure(LOBES[name], span=5, method="quadrature")
    a = np.radians(scan.angle)
    to = np.column_stack([np.sin(a), np.zeros(a.size), -np.cos(a)])
    return scan, LOBES[name].evaluate([0.0, 0.0, 1.0], to)


def inside(*, name: str, photons: float, seeds: int, **options: object) -> list[float]:
    """For each seed the share of the bright positions at which the truth is within a standard error."""
    scan, exact = known(name)
    lit = exact > 0.05 * exact.max()
    found = []
    for seed in range(seeds):
        noisy = counted(scan=scan, photons=photons, seed=seed)
        one = et.deconvolve(noisy, SIGNATURE, **options)  # type: ignore[arg-type]
        assert one.standard_error is not None
        found.append(float(np.mean(np.abs(one.values - exact)[lit] < one.standard_error[lit])))
    return found


@pytest.mark.slow
def test_error_bands_hold() -> None:
    """Bands of one standard error hold the truth at 68 ± 5 % of the positions, over lobes, counts and seeds.

    Seeds are independent, positions of one scan are not: the share is known to about 2 %. No lobe falls below a half.
    """
    shares = {
        (name, photons): inside(name=name, photons=photons, seeds=12)
        for name in ("SD1", "SD2", "SD3", "SD4", *LOBES)
        for photons in (1e5, 1e6)
    }
    mean = float(np.mean(list(shares.values())))
    error = float(np.sqrt(np.sum([np.var(one, ddof=1) / len(one) for one in shares.values()])) / len(shares))
    assert error < 0.025
    assert 0.63 < mean < 0.73
    assert min(np.mean(one) for one in shares.values()) > 0.5


@pytest.mark.slow
def test_error_bands_of_the_iteration_hold_less() -> None:
    """What the stop leaves out is part of the error, estimated from a lobe that was iterated further, which falls short."""
    found = [np.mean(inside(name=name, photons=1e5, seeds=6, method="richardson-lucy")) for name in ("SD2", "SD3")]
    assert 0.45 < np.mean(found) < 0.85


@pytest.mark.slow
def test_the_width_of_a_gaussian_is_found_nearly_as_well_as_by_fitting_one() -> None:
    """The smoothest lobe is a Gaussian; that it might be another one costs a factor over the bound of Cramér and Rao for two
    parameters, which the iteration exceeds by far."""
    scan, _ = known("SD2")
    model = operator_of(scan, SIGNATURE, "rings", 0.0)
    sigma = 1.0 / (2.0 * math.sqrt(2.0 * math.log(2.0)))
    # How counts of 10⁶ photons change with the logarithms of the peak and of the variance.
    shape = np.exp(-0.5 * (model.nodes / sigma) ** 2)
    unit = scan.flux.max() / (model.matrix @ shape).max() * 1e6
    by_peak = model.matrix @ shape * unit
    by_width = model.matrix @ (shape * 0.5 * (model.nodes / sigma) ** 2) * unit
    slopes = np.stack([by_peak, by_width])
    bound = 0.5 * math.sqrt(np.linalg.inv(slopes / np.maximum(by_peak, 1e-12) @ slopes.T)[1, 1])
    off = {}
    for method in ("penalised", "richardson-lucy"):
        widths = [
            et.deconvolve(
                counted(scan=scan, photons=1e6, seed=seed), SIGNATURE, method=method, middle=0.0, replicates=0
            ).fwhm
            for seed in range(24)
        ]
        off[method] = math.sqrt(np.mean(np.square(np.array(widths) - 1.0)))
    # The root of the mean square of 24 is known to 14 %.
    assert bound < off["penalised"] < 3.5 * bound
    assert off["richardson-lucy"] > 2.0 * off["penalised"]


def test_the_penalty_is_the_integral_of_the_third_derivative() -> None:
    """Of x⁴: 24 x, whose square integrates to 192 x³; a parabola costs nothing."""
    knots = np.array([0.0, 0.1, 0.2, 0.35, 0.6, 1.0, 1.4])
    rows = penalised._third_derivatives(knots, even=False)
    at = np.linspace(0.0, knots[-1] - 1e-9, 500)
    splines = penalised._splines(at, knots, even=False)
    cube = np.linalg.lstsq(splines, at**3, rcond=None)[0]
    assert rows @ cube == pytest.approx(6.0 * np.sqrt(np.diff(knots)), rel=1e-6)
    even, folded = penalised._third_derivatives(knots, even=True), penalised._splines(at, knots, even=True)
    parabola = np.linalg.lstsq(folded, 2.0 - at**2, rcond=None)[0]
    assert folded @ parabola == pytest.approx(2.0 - at**2, abs=1e-9)
    assert even @ parabola == pytest.approx(np.zeros(len(even)), abs=1e-7)


def test_a_lobe_that_is_not_round_is_told() -> None:
    """Twice as bright on one side: no even lobe shows that."""
    scan = exact_scan("SD1")
    lopsided = dataclasses.replace(scan, flux=scan.flux * (1.0 + 0.5 * np.tanh(scan.angle)))
    told = et.deconvolve(counted(scan=lopsided, photons=1e6, seed=1), SIGNATURE).notes
    assert any("times its noise" in note for note in told)
    assert not any(
        "times its noise" in note for note in et.deconvolve(counted(scan=scan, photons=1e6, seed=1), SIGNATURE).notes
    )


def test_a_scan_that_is_not_in_line_is_put_right() -> None:
    """The middle lies between two positions; the peak is what it would be."""
    straight = et.deconvolve(counted(scan=exact_scan("SD2"), photons=1e7, seed=1), SIGNATURE, replicates=0)
    scan = dataclasses.replace(exact_scan("SD2"), angle=exact_scan("SD2").angle + 0.037)
    moved = et.deconvolve(counted(scan=scan, photons=1e7, seed=2), SIGNATURE, replicates=0)
    assert moved.middle == pytest.approx(0.037, abs=3e-3)
    # Positions are not at the middle any more: the largest value lies 0.037° beside it at most.
    assert moved.peak == pytest.approx(straight.peak, rel=0.03)
    assert moved.fwhm == pytest.approx(straight.fwhm, rel=0.02)


# --- what is not as it should be ---------------------------------------------------------------------------------------


def test_gaps_negative_fluxes_and_other_steps_are_told_and_survive() -> None:
    scan = counted(scan=exact_scan("SD2"), photons=1e6, seed=3)
    keep = np.abs(scan.angle - 1.0) > 0.15
    flux = scan.flux.copy()
    flux[:3] = -2e-6
    assert scan.standard_error is not None
    torn = GoniometerScan(scan.angle[keep], flux[keep], scan.standard_error[keep], solid_angle=scan.solid_angle)
    other = et.ScatterGoniometer().instrument_function(0.15)
    for operator in ("rings", "slice"):
        found = et.deconvolve(torn, other, operator=operator, replicates=0)
        told = " ".join(found.notes)
        assert "between 0.8° and 1.2°" in told
        assert "3 fluxes are below 0" in told
        assert "0.15° of the instrument function" in told
        assert found.values.size == torn.angle.size
        assert found.total_scatter[1] == pytest.approx(found.total_scatter[0], rel=1e-6)
    assert loss(found=et.deconvolve(torn, other, replicates=0), name="SD2") < 0.05


@pytest.mark.slow
def test_a_stated_background_keeps_what_lies_below_it() -> None:
    goniometer = et.ScatterGoniometer(photons=1e6, dark=200.0)
    sample = et.bsdf.CosinePower(peak=2897.0, exponent=18204, way="transmitted")
    scan = goniometer.measure(sample, span=5, method="quadrature", seed=5)
    assert (scan.flux < 0.0).any()
    found = et.deconvolve(scan, SIGNATURE, replicates=0)
    assert not any("below 0" in note for note in found.notes)
    assert loss(found=found, name="SD2") < 0.05


def test_what_is_refused() -> None:
    scan = exact_scan("SD1")
    wide = et.ScatterGoniometer(aperture_diameter=200).instrument_function()
    with pytest.raises(ArgumentError, match="scan to larger angles"):
        et.deconvolve(scan, wide)
    bare = dataclasses.replace(scan, standard_error=None)
    with pytest.raises(ArgumentError, match="needs the standard errors"):
        et.deconvolve(bare, SIGNATURE, stop="held-out")
    assert et.deconvolve(bare, SIGNATURE).standard_error is None
    with pytest.raises(UnknownNameError, match="held-out"):
        et.deconvolve(scan, SIGNATURE, stop="heldout")
    with pytest.raises(UnknownNameError, match="rings"):
        et.deconvolve(scan, SIGNATURE, operator="ring")
    with pytest.raises(ArgumentError, match="no light"):
        et.deconvolve(dataclasses.replace(scan, flux=np.zeros(scan.flux.size)), SIGNATURE)
    with pytest.raises(ArgumentError, match="five"):
        et.deconvolve(GoniometerScan([0.0, 1.0], [1.0, 1.0]), SIGNATURE)
    with pytest.raises(ArgumentError, match="iterations"):
        et.deconvolve(scan, SIGNATURE, stop=0)
    with pytest.raises(ArgumentError, match="seed is -1"):
        et.deconvolve(scan, SIGNATURE, seed=-1)
    with pytest.raises(ArgumentError, match="does not iterate"):
        et.deconvolve(scan, SIGNATURE, method="penalised", stop="thesis")
    with pytest.raises(ArgumentError, match="needs the standard errors"):
        et.deconvolve(bare, SIGNATURE, method="penalised")


def test_what_was_found_is_written(tmp_path: Path) -> None:
    found = et.deconvolve(counted(scan=exact_scan("SD1"), photons=1e5, seed=1), SIGNATURE, replicates=8)
    found.save(tmp_path / "true.csv")
    lines = (tmp_path / "true.csv").read_text().splitlines()
    table = np.loadtxt([line for line in lines if line[0] in "-0123456789"], delimiter=",")
    assert np.array_equal(table[:, 1], found.values)
    assert f"# iterations = {found.iterations}" in lines
