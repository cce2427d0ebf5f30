"""A smooth image from few rays: the bar of the oracle's Gaussian, flux, error bars, weights; and each part by itself."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
import pytest
from etendue.denoising.directional_filters import DirectionalFrame, shrunk_rings
from etendue.denoising.error_calibration import fitted_factors
from etendue.denoising.estimates import ray_quantum
from etendue.denoising.fourier_plane import FourierPlane, blurred
from etendue.denoising.mixture import halves, least_squares_shares
from etendue.denoising.smoothing import Smoothed, smooth_counts
from etendue.errors import ArgumentError
from oracles.images import IMAGES, ncc, nrmse, oracle_gaussian
from oracles.verdicts import SIGNIFICANCE, WITHIN_ONE, WITHIN_TWO, Share, assert_covers
from scipy.ndimage import gaussian_filter
from scipy.optimize import minimize
from scipy.stats import t

Array = npt.NDArray[np.float64]


def counts_of(name: str, rays: float, seed: int, n: int = 96) -> tuple[Array, Array]:
    """Counts and their expectation."""
    image = IMAGES[name](n)
    truth = image * (rays / image.sum())
    return np.random.default_rng(seed).poisson(truth).astype(np.float64), truth


def smoothed(counts: Array, **options: int) -> Smoothed:
    return smooth_counts(counts, counts, np.ones_like(counts), **options)


def deviations(found: Smoothed, truth: Array) -> Array:
    """From the truth, each over its own error."""
    return (found.mass - truth) / found.standard_error


# How many independent cells the cells of one image are worth, by the spread of their coverage over images of other seeds;
# and the coverage within one and two errors, where those images showed that it is not that of normal deviates.
HUNDRED_THOUSAND: dict[str, tuple[float, Share, Share]] = {
    "turned die": (1113, (0.66, WITHIN_ONE), (0.93, WITHIN_TWO)),
    "stripes": (1042, (0.63, 0.66), (0.92, 0.94)),
    "blobs": (621, (WITHIN_ONE, 0.72), (WITHIN_TWO, 0.97)),
}
# Rays, cells along a side, seeds.
FEW_AND_MANY: dict[str, tuple[float, int, int, float, Share, Share]] = {
    "disk": (2.5e3, 64, 3, 40, (WITHIN_ONE, 0.76), (0.945, 0.975)),
    "halo": (2.5e5, 64, 2, 68, WITHIN_ONE, (0.92, WITHIN_TWO)),
}


# --- the bar ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", HUNDRED_THOUSAND)
def test_a_hundred_thousand_rays_beat_the_gaussian_that_knew_the_truth(name: str) -> None:
    """By both measures; and the error bars hold."""
    counts, truth = counts_of(name, 1e5, 1)
    found = smoothed(counts)
    best, best_ncc = oracle_gaussian(counts, truth=truth)
    assert nrmse(found.mass, truth=truth) < 0.85 * best
    assert 1 - ncc(found.mass, truth=truth) < 0.75 * (1 - best_ncc)
    assert found.mass.sum() == pytest.approx(counts.sum(), rel=1e-12)
    effective, one, two = HUNDRED_THOUSAND[name]
    assert_covers(deviations=deviations(found, truth), effective=effective, one=one, two=two)


@pytest.mark.slow
@pytest.mark.parametrize("name", FEW_AND_MANY)
def test_error_bars_hold_for_few_rays_and_many(name: str) -> None:
    rays, n, seeds, effective, one, two = FEW_AND_MANY[name]
    images = [counts_of(name, rays, seed, n) for seed in range(2, 2 + seeds)]
    found = np.array([deviations(smoothed(counts), truth) for counts, truth in images])
    assert_covers(deviations=found, effective=seeds * effective, one=one, two=two)


@pytest.mark.slow
def test_a_uniform_image_stays_uniform() -> None:
    """Neither trees nor filters find structure in noise: only the total is uncertain."""
    for seed in (1, 2):
        counts = np.random.default_rng(seed).poisson(1.0, (64, 64)).astype(np.float64)
        found = smoothed(counts, shifts=4)
        assert found.mass.std() < 0.01 * found.mass.mean()
        assert found.standard_error.min() > 0.99 * found.mass.mean() / np.sqrt(counts.sum())


# --- sums of weights --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_unit_of_weight_does_not_matter() -> None:
    counts, _ = counts_of("halo", 2e4, 4, 48)
    plain = smoothed(counts, shifts=4)
    scaled = smooth_counts(2.5e-7 * counts, 2.5e-7**2 * counts, np.full_like(counts, 3e5), shifts=4)
    np.testing.assert_allclose(scaled.mass, 2.5e-7 * plain.mass, rtol=1e-6)
    np.testing.assert_allclose(scaled.standard_error, 2.5e-7 * plain.standard_error, rtol=1e-5)


@pytest.mark.slow
def test_unequal_weights_are_worth_fewer_rays_and_their_errors_hold() -> None:
    """Exponential weights: E w² = 2 (E w)², so the rays are worth half their number. From seed to seed the coverage spreads
    as that of 213 independent cells."""
    counts, truth = counts_of("blobs", 1e5, 5, 96)
    generator = np.random.default_rng(6)
    weight = generator.gamma(np.maximum(counts, 1e-300)) * (counts > 0)
    # Given Σ w of n exponential weights, their squares make 2 (Σ w)²/(n + 1) on average.
    squared = 2 * weight**2 / (counts + 1)
    found = smooth_counts(weight, squared, np.ones_like(weight))
    assert found.mass.sum() == pytest.approx(weight.sum(), rel=1e-12)
    assert_covers(deviations=deviations(found, truth), effective=213)
    equal = nrmse(smoothed(counts).mass, truth=truth)
    assert equal < nrmse(found.mass, truth=truth) < 2.2 * equal


@pytest.mark.slow
def test_base_measure_sets_the_level_and_nothing_lies_where_it_is_zero() -> None:
    """A round image on a slope of étendue, of constant density: no rim darkens, no mass leaks out."""
    rows, columns = np.mgrid[0:80, 0:90]
    base = np.where(np.hypot(rows - 37, columns - 46) < 34, 0.3 + columns / 60, 0.0)
    counts = np.random.default_rng(7).poisson(4.0 * base).astype(np.float64)
    found = smooth_counts(counts, counts, base)
    assert (found.mass[base == 0] == 0).all()
    assert (found.mass[base > 0] > 0).all()
    density = found.mass[base > 0] / base[base > 0]
    assert abs(density / 4.0 - 1).max() < 0.12
    assert found.mass.sum() == pytest.approx(counts.sum(), rel=1e-12)


def test_halves_of_equal_rays_are_binomial_and_those_of_unequal_ones_have_the_same_variance() -> None:
    shape = (300, 300)
    for rays, effective in ((5.0, 5.0), (7.0, 3.7), (2.0, 1.2)):
        weight = np.full(shape, rays)
        squared = weight**2 / effective
        (a, a2), (b, b2) = halves(weight, squared)
        np.testing.assert_allclose(a + b, weight)
        np.testing.assert_allclose(a2 + b2, squared)
        expected = rays**2 / effective / 4
        # Four standard errors of a variance, of 90 000 values; a binomial's kurtosis is below 3.
        assert a.var() == pytest.approx(expected, rel=4 * np.sqrt(2 / a.size))
        assert a.mean() == pytest.approx(rays / 2, abs=4 * np.sqrt(expected / a.size))
    assert set(np.unique(halves(np.full(shape, 5.0), np.full(shape, 5.0))[0][0])) == set(range(6))


# --- every input ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_same_bits_for_any_number_of_threads() -> None:
    counts, _ = counts_of("die", 2e4, 8, 48)
    results = [smoothed(counts[:, :37], shifts=3, threads=n) for n in (1, 7)]
    assert len({r.mass.tobytes() + r.standard_error.tobytes() for r in results}) == 1


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (37, 1), (5, 9), (16, 16), (17, 200)])
def test_any_shape(shape: tuple[int, int]) -> None:
    counts = np.random.default_rng(9).poisson(20.0, shape).astype(np.float64)
    found = smoothed(counts, shifts=3)
    assert found.mass.sum() == pytest.approx(counts.sum(), rel=1e-12)
    assert (found.mass > 0).all()
    assert (np.isfinite(found.standard_error) & (found.standard_error > 0)).all()
    assert ("alone" in found.notes[0]) == (min(shape) < 16)


@pytest.mark.slow
@pytest.mark.parametrize("rays", [1.0, 150.0, 1e15])
def test_one_hit_cell(rays: float) -> None:
    counts = np.zeros((40, 50))
    counts[13, 31] = rays
    found = smoothed(counts, shifts=4)
    assert found.mass.sum() == pytest.approx(rays, rel=1e-12)
    assert (found.mass > 0).all()
    assert np.isfinite(found.standard_error).all()
    assert np.unravel_index(found.mass.argmax(), counts.shape) == (13, 31) or rays == 1
    if rays > 1:
        assert found.mass[13, 31] > 0.9 * rays


def test_refusals() -> None:
    ones = np.ones((20, 20))
    with pytest.raises(ArgumentError, match="no cell has weight"):
        smooth_counts(0 * ones, 0 * ones, ones)
    with pytest.raises(ArgumentError, match="shapes"):
        smooth_counts(ones, ones, np.ones((20, 21)))
    with pytest.raises(ArgumentError, match="shapes"):
        smooth_counts([1.0], [1.0], [1.0])
    with pytest.raises(ArgumentError, match="weight_squared has a value that is negative or not finite"):
        smooth_counts(ones, np.nan * ones, ones)
    with pytest.raises(ArgumentError, match="without Σ w²"):
        smooth_counts(ones, 0 * ones, ones)
    with pytest.raises(ArgumentError, match="where base is 0"):
        smooth_counts(ones, ones, np.eye(20))
    for shifts in (0, 1025, 2.5):
        with pytest.raises(ArgumentError, match="shifts"):
            smooth_counts(ones, ones, ones, shifts=shifts)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="threads"):
        smooth_counts(ones, ones, ones, threads=0)


# --- the parts --------------------------------------------------------------------------------------------------------


def test_blur_is_a_gaussian() -> None:
    image = np.random.default_rng(10).random((45, 61))
    expected = gaussian_filter(image, 2.5, mode="constant", truncate=8)
    np.testing.assert_allclose(blurred(image, 2.5), expected, atol=1e-6)


@pytest.mark.parametrize("shape", [(16, 16), (50, 33), (7, 90)])
def test_the_margin_joins_the_edges_without_a_seam(shape: tuple[int, int]) -> None:
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]]
    image = 3.0 + rows / shape[0] - 2 * columns / shape[1]
    whole = FourierPlane(shape).extended(image)
    assert np.array_equal(whole[: shape[0], : shape[1]], image)
    steepest = max(1 / shape[0], 2 / shape[1])
    for axis in (0, 1):
        jumps = np.abs(np.diff(np.concatenate([whole, whole.take([0], axis)], axis), axis=axis))
        assert jumps.max() < 1.01 * (steepest + 1.5 * np.ptp(image) / 64)


def test_the_frame_is_tight_and_its_gains_are_those_of_wiener() -> None:
    """Without noise everything passes; of pure noise next to nothing; what is clearly there keeps its noise."""
    shape = (70, 90)
    frame = DirectionalFrame(FourierPlane(shape))
    image = np.random.default_rng(11).random(shape) + np.eye(*shape)
    with ThreadPoolExecutor(2) as pool:
        kept, left = frame.filtered(image, np.full(shape, 1e-12), image, pool, image)
        np.testing.assert_allclose(kept, image, atol=1e-3)  # windows narrower than a cell ring a little
        assert left.max() < 1e-9
        noise = np.random.default_rng(12).normal(size=shape)
        level = np.ones(shape)
        nothing, _ = frame.filtered(noise, level, 0 * noise, pool)
        assert nothing.var() < 0.05
        _, left = frame.filtered(noise, level, 0 * noise, pool, 30 * noise)
        inside = left[20:-20, 20:-20]
        assert 0.85 < inside.mean() < 1.01


def test_rings_keep_what_stands_out_and_drop_noise() -> None:
    shape = (96, 80)
    plane = FourierPlane(shape)
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    wave = 5 * np.sin(0.35 * x + 0.2 * y)
    noise = np.random.default_rng(13).normal(size=shape)
    level = np.ones(shape)
    assert shrunk_rings(plane, noise, level, 0 * noise).var() < 0.01
    error = shrunk_rings(plane, wave + noise, level, wave) - wave
    assert error.var() < 0.08


def test_shares_are_the_least_squares_of_the_triangle() -> None:
    generator = np.random.default_rng(14)
    roots = generator.normal(size=(40, 2, 2))
    products = np.einsum("nij,nkj->ikn", roots, roots)
    moments = 0.4 * generator.normal(size=(2, 40))
    found = least_squares_shares(products, moments)
    inside = 0
    for k in range(40):
        p, m = products[..., k], moments[:, k]

        def objective(x: Array, p: Array = p, m: Array = m) -> float:
            return float(0.5 * x @ p @ x - m @ x)

        best = minimize(
            objective,
            np.array([0.3, 0.3]),
            method="SLSQP",
            bounds=[(0, 1), (0, 1)],
            constraints={"type": "ineq", "fun": lambda x: 1 - x.sum()},
            options={"ftol": 1e-12},
        )
        assert objective(found[:, k]) <= best.fun + 1e-7
        assert (found[:, k] >= 0).all()
        assert found[:, k].sum() <= 1 + 1e-12
        inside += bool((found[:, k] > 0).all() and found[:, k].sum() < 1)
    assert inside >= 3
    assert np.array_equal(least_squares_shares(np.zeros((2, 2)), np.zeros(2)), np.zeros(2))


@pytest.mark.slow
def test_factors_of_errors_are_found() -> None:
    """On average over 30 draws, of which the spread tells the error of the mean: less than 1 %."""
    generator, found = np.random.default_rng(15), []
    true = np.array([0.7, 0.02, 0.0])
    for _ in range(30):
        gammas = generator.gamma(1.0, size=60_000), generator.gamma(0.5, size=60_000) * 30
        indicators = np.array([*gammas, np.zeros(60_000)])
        errors = generator.normal(size=60_000) * np.sqrt(true @ indicators)
        found.append(fitted_factors(indicators, errors**2)[:2])
    error = np.std(found, axis=0, ddof=1) / np.sqrt(30)
    assert (error < 0.01 * true[:2]).all()
    assert (np.abs(np.mean(found, axis=0) - true[:2]) < t.isf(SIGNIFICANCE / 4, 29) * error).all()


def test_the_quantum_is_local() -> None:
    """Left, rays of weight 1; right, of weight 5; far from all, the average."""
    weight, squared = np.zeros((60, 400)), np.zeros((60, 400))
    weight[:, :60], squared[:, :60] = 10.0, 10.0
    weight[:, -60:], squared[:, -60:] = 10.0, 50.0
    quantum = ray_quantum(weight, squared)
    np.testing.assert_allclose(quantum[30, [5, 200, 395]], [1.0, 3.0, 5.0], rtol=0.01)
