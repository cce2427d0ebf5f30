"""The optional Pólya tree against an independent statement of its recursion, closed forms and the truth."""

from __future__ import annotations

import itertools

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.errors import ArgumentError
from oracles.verdicts import assert_covers
from scipy.special import betaln, logsumexp

Array = npt.NDArray[np.float64]


def every_partition(counts: Array, base: Array, c: float, rho: float = 0.5) -> tuple[float, Array, Array]:
    """(ln evidence, mean, mean square of the ratio) by recursion over boxes as Python dictionaries: the definition."""
    known: dict[tuple[tuple[int, int], ...], tuple[float, Array, Array]] = {}

    def visit(box: tuple[tuple[int, int], ...]) -> tuple[float, Array, Array]:
        if box in known:
            return known[box]
        window = tuple(slice(*span) for span in box)
        n, shape = counts[window], counts[window].shape
        axes = [k for k, (a, b) in enumerate(box) if b - a > 1]
        if not axes:
            return 0.0, np.ones(shape), np.ones(shape)
        terms, means, squares = [np.log(1 - rho)], [np.ones(shape)], [np.ones(shape)]
        for k in axes:
            a, b = box[k]
            spans = ((a, (a + b) // 2), ((a + b) // 2, b))
            halves = [(*box[:k], span, *box[k + 1 :]) for span in spans]
            masses = [base[tuple(slice(*s) for s in half)].sum() for half in halves]
            p = np.array(masses) / sum(masses)
            n_half = np.array([counts[tuple(slice(*s) for s in half)].sum() for half in halves])
            below = [visit(half) for half in halves]
            bayes = betaln(*(c * p + n_half)) - betaln(*(c * p)) - n_half @ np.log(p)
            terms.append(np.log(rho / len(axes)) + bayes + below[0][0] + below[1][0])
            share = (c * p + n_half) / (c + n.sum())
            second = share * (c * p + n_half + 1) / (c + n.sum() + 1)
            means.append(np.concatenate([share[i] / p[i] * below[i][1] for i in (0, 1)], axis=k))
            squares.append(np.concatenate([second[i] / p[i] ** 2 * below[i][2] for i in (0, 1)], axis=k))
        total = float(logsumexp(terms))
        q = np.exp(np.array(terms) - total)
        known[box] = (
            total,
            sum((w * m for w, m in zip(q, means, strict=True)), np.zeros(shape)),
            sum((w * s for w, s in zip(q, squares, strict=True)), np.zeros(shape)),
        )
        return known[box]

    return visit(tuple((0, n) for n in counts.shape))


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(16,), (8, 16), (4, 2, 8), (4, 4, 2, 4), (1, 8)])
@pytest.mark.parametrize("c", [1.0, 3.0, 30.0])
def test_the_core_equals_the_definition_in_any_number_of_dimensions(shape: tuple[int, ...], c: float) -> None:
    rng = np.random.default_rng(len(shape))
    counts = rng.poisson(rng.gamma(0.4, 6.0, shape)).astype(float)
    base = rng.gamma(2.0, 1.0, shape)
    base /= base.sum()
    evidence, mean, square = every_partition(counts, base, c)
    depths = [int(np.log2(n)) for n in shape]
    got = _core.polya_posterior(depths, counts.ravel(), counts.ravel(), base.ravel(), c)
    assert got[2] == pytest.approx(evidence, abs=1e-9)
    # The core keeps the probabilities of splits in single precision; no flux is lost by that.
    np.testing.assert_allclose(got[0], mean.ravel(), rtol=1e-4)
    np.testing.assert_allclose(got[1], square.ravel(), rtol=3e-4)
    assert got[0] @ base.ravel() == pytest.approx(1.0, abs=1e-12)


def poisson_map(truth: Array, rays_per_unit: float, seed: int, screen: et.Screen) -> et.LuminanceMap:
    counts = np.random.default_rng(seed).poisson(truth * rays_per_unit)
    live = counts > 0
    return et.LuminanceMap(
        np.where(live, counts / rays_per_unit, np.nan),
        np.where(live, np.sqrt(counts) / rays_per_unit, np.nan),
        counts,
        et.Observer(0, 0, 1e7),
        screen,
    )


def scene(rows: int, columns: int) -> Array:
    """Luminance of an asymmetric scene: a ramp, a bright tilted bar, a dark corner, a smooth bump."""
    y, x = np.mgrid[0:rows, 0:columns] / max(rows, columns)
    bar = np.abs(0.8 * x - y + 0.1) < 0.06
    bump = 3.0 * np.exp(-((x - 0.7) ** 2 + (y - 0.2) ** 2) / 0.02)
    return np.where((x < 0.2) & (y > 0.5), 0.05, 0.5 + x + bump + 6.0 * bar)


@pytest.mark.slow
def test_flux_is_kept_and_the_error_falls() -> None:
    screen = et.Screen(9.0, 6.0, 90, 60)
    truth = scene(60, 90)
    noisy = poisson_map(truth, 4.0, 1, screen)
    smooth = et.denoise_map(noisy)
    assert smooth.intensity == pytest.approx(noisy.intensity, rel=1e-12)
    assert smooth.dead_pixels == 0
    assert noisy.dead_pixels > 20

    def error(lmap: et.LuminanceMap) -> float:
        return float(np.sqrt(((np.nan_to_num(lmap.values) - truth) ** 2).mean()))

    best = min(error(et.filter_map(noisy, k, s)) for k, s in itertools.product(("average", "weighted"), (3, 5, 7)))
    assert error(smooth) < best
    assert error(smooth) < 0.5 * error(noisy)


@pytest.mark.slow
def test_error_bars_cover() -> None:
    """68 ± 5 % within one standard error, 95 ± 3 % within two (theory section 12), from few rays to many.

    From seed to seed the share of a map spreads by 0.023, 0.046 and 0.035 at the three levels, as those of 369, 99 and 177
    independent pixels (16 other seeds); the mean over all six maps as that of 6²/(2/369 + 2/99 + 2/177) = 974.
    """
    truth = scene(48, 64)
    deviations = []
    for seed, level in itertools.product(range(2), (3.0, 10.0, 30.0)):
        smooth = et.denoise_map(poisson_map(truth, level, seed, et.Screen(8, 6, 64, 48)))
        deviations.append((smooth.values - truth) / smooth.standard_error)
    assert_covers(deviations=np.array(deviations), effective=974, one=(0.63, 0.73), two=(0.92, 0.98))


@pytest.mark.slow
def test_a_uniform_map_becomes_uniform() -> None:
    """One ray per pixel and no structure: the relative spread falls from 100 % to that of the total and little more."""
    noisy = poisson_map(np.ones((64, 64)), 1.0, 3, et.Screen(6, 6, 64, 64))
    smooth = et.denoise_map(noisy)
    assert smooth.values.std() / smooth.values.mean() < 0.01
    # The total is that of the rays.
    assert smooth.intensity == pytest.approx(noisy.intensity, rel=1e-12)
    assert np.median(smooth.standard_error) > 1 / 64 * 0.9


@pytest.mark.slow
def test_unequal_weights_count_as_fewer_rays() -> None:
    """The same map with errors three times as large rests on a ninth of the rays, and is smoothed more."""
    truth = scene(32, 32)
    noisy = poisson_map(truth, 20.0, 5, et.Screen(6, 6, 32, 32))
    fewer = noisy.replace(standard_error=noisy.standard_error * 3)

    def roughness(lmap: et.LuminanceMap) -> float:
        return float(np.abs(np.diff(lmap.values, axis=1)).mean())

    smoother, smooth = et.denoise_map(fewer), et.denoise_map(noisy)
    assert smoother.intensity == pytest.approx(smooth.intensity, rel=1e-12) == noisy.intensity
    assert roughness(smoother) < 0.97 * roughness(smooth)


@pytest.mark.slow
def test_same_bits_for_any_number_of_threads_and_any_odd_shape() -> None:
    for rows, columns in ((7, 33), (1, 5), (3, 1), (64, 64)):
        noisy = poisson_map(scene(rows, columns), 5.0, 2, et.Screen(2, 2, columns, rows))
        results = [et.denoise_map(noisy, shifts=5, threads=n) for n in (1, 2, 7)]
        assert len({r.values.tobytes() + r.standard_error.tobytes() for r in results}) == 1
        assert np.isfinite(results[0].standard_error).all()


def test_errors_that_pixels_share_do_not_go_out() -> None:
    """A light field's pixels, which count no rays, may all be off by the same: a smooth map is off by as much."""
    noisy = poisson_map(np.ones((8, 8)), 5.0, 1, et.Screen(1, 1, 8, 8))
    shared = noisy.replace(rays=np.full((8, 8), -1))
    apart, together = (et.denoise_map(lmap, shifts=2) for lmap in (noisy, shared))
    np.testing.assert_array_equal(apart.values, together.values)
    assert (together.standard_error >= np.nan_to_num(noisy.standard_error)).all()
    assert (apart.standard_error < 0.8 * np.nan_to_num(noisy.standard_error)).any()
    assert "err together" in together.notes[-1]


def test_what_all_pixels_err_by_is_no_noise_of_counts() -> None:
    """The map is smoothed as one whose pixels err by their own noise alone; what they have in common is added again."""
    noisy = poisson_map(scene(14, 12), 8.0, 6, et.Screen(1.2, 1.4, 12, 14))
    whole = np.hypot(noisy.standard_error, 0.2 * noisy.values)
    shared = noisy.replace(standard_error=whole, common_error=0.2)
    plain, common = (et.denoise_map(lmap, shifts=2) for lmap in (noisy, shared))
    np.testing.assert_allclose(common.values, plain.values, rtol=1e-9)
    np.testing.assert_allclose(common.standard_error, np.hypot(plain.standard_error, 0.2 * plain.values), rtol=1e-6)


def test_refusals() -> None:
    noisy = poisson_map(np.ones((4, 4)), 5.0, 1, et.Screen(1, 1, 4, 4))
    with pytest.raises(ArgumentError, match="shifts"):
        et.denoise_map(noisy, shifts=0)
    with pytest.raises(ArgumentError, match="without a standard error"):
        et.denoise_map(noisy.replace(standard_error=np.full((4, 4), np.nan)))
    with pytest.raises(ArgumentError, match="no pixel of the map has flux"):
        et.denoise_map(noisy.replace(values=np.full((4, 4), np.nan)))
    with pytest.raises(ArgumentError, match="negative"):
        et.denoise_map(noisy.replace(values=-noisy.values))
