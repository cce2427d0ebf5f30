"""Every verdict catches an error of 5 % in the values, errors that are too small or too large, and swapped arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binomtest, t

from oracles import verdicts
from oracles.verdicts import WITHIN_ONE, WITHIN_TWO, assert_agree, assert_covers, assert_differ, assert_drawn_with

Array = npt.NDArray[np.float64]
CELLS = 400
DEGREES = 15.0


def case(error: float = 0.01) -> tuple[Array, Array, Array]:
    """Expected values without symmetry, their errors, and values that err by them."""
    rng = np.random.default_rng(5)
    expected = rng.gamma(2.0, 30.0, CELLS) + 5.0
    standard_error = error * expected * rng.uniform(0.5, 1.5, CELLS)
    return expected, standard_error, expected + standard_error * rng.normal(size=CELLS)


def refused(call: Callable[[], None]) -> None:
    with pytest.raises(AssertionError):
        call()


def test_no_verdict_takes_an_argument_by_its_place() -> None:
    found = [value for name, value in vars(verdicts).items() if name.startswith("assert_")]
    assert len(found) == 4
    for verdict in found:
        assert {p.kind for p in inspect.signature(verdict).parameters.values()} == {inspect.Parameter.KEYWORD_ONLY}


# --- values ------------------------------------------------------------------------------------------------------------


def test_agreement_is_found() -> None:
    expected, error, values = case()
    assert_agree(values=values, expected=expected, standard_error=error)


@pytest.mark.parametrize("factor", [1.05, 0.95, 1.3])
def test_values_that_are_wrong_do_not_agree(factor: float) -> None:
    expected, error, values = case()
    refused(lambda: assert_agree(values=factor * values, expected=expected, standard_error=error))


def test_one_cell_that_is_wrong_is_found() -> None:
    expected, error, values = case(0.002)
    values[17] *= 1.05
    refused(lambda: assert_agree(values=values, expected=expected, standard_error=error))


@pytest.mark.parametrize("factor", [1.5, 0.7])
def test_errors_that_are_too_large_or_too_small_do_not_agree(factor: float) -> None:
    expected, error, values = case()
    refused(lambda: assert_agree(values=values, expected=expected, standard_error=factor * error))


def test_values_over_errors_as_large_as_they_are_tell_nothing() -> None:
    """What expected values and errors in each other's place look like: why no verdict takes them by their place."""
    expected, error, values = case()
    assert_agree(values=1.05 * values, expected=error, standard_error=expected)
    with pytest.raises(TypeError, match="positional"):
        assert_agree(values, error, expected)  # type: ignore[misc]


def test_errors_of_a_spread_have_degrees_of_freedom() -> None:
    """As many as they were made with: fewer take errors for too large, more find deviations too large."""
    expected, error, _ = case()
    rng = np.random.default_rng(9)
    passes = expected + error * rng.normal(size=(int(DEGREES) + 1, CELLS)) * np.sqrt(DEGREES + 1)
    values, spread = passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(DEGREES + 1)
    assert_agree(values=values, expected=expected, standard_error=spread, degrees=DEGREES)
    refused(lambda: assert_agree(values=1.05 * values, expected=expected, standard_error=spread, degrees=DEGREES))
    refused(lambda: assert_agree(values=values, expected=expected, standard_error=1.5 * spread, degrees=DEGREES))
    refused(lambda: assert_agree(values=values, expected=expected, standard_error=0.7 * spread, degrees=DEGREES))
    few = t.rvs(3.0, size=CELLS, random_state=1)
    assert_agree(values=few, expected=0.0, standard_error=np.ones(CELLS), degrees=3.0)
    refused(lambda: assert_agree(values=few, expected=0.0, standard_error=np.ones(CELLS)))


def test_cells_without_an_error_are_counted() -> None:
    expected, error, values = case()
    error[: CELLS // 4] = np.nan
    refused(lambda: assert_agree(values=values, expected=expected, standard_error=error))
    assert_agree(values=values, expected=expected, standard_error=error, least=0.7)
    few = slice(CELLS - 7, None)
    refused(lambda: assert_agree(values=values[few], expected=expected[few], standard_error=error[few]))


def test_values_differ_or_do_not() -> None:
    expected, error, values = case()
    assert_differ(values=1.05 * values, other=expected, standard_error=error)
    refused(lambda: assert_differ(values=values, other=expected, standard_error=error))


# --- shares ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [1.05, 0.95])
def test_a_share_that_is_wrong_is_found(factor: float) -> None:
    """An error of 1 % of the share is p (1 - p)/n = 1e-4 p²: n = 14 167 rays for p = 0.4137."""
    share, rays = 0.4137, 14_167
    hits = int(np.random.default_rng(2).binomial(rays, share))
    assert_drawn_with(share=share, hits=hits, rays=rays)
    refused(lambda: assert_drawn_with(share=share, hits=round(factor * hits), rays=rays))
    refused(lambda: assert_drawn_with(share=factor * share, hits=hits, rays=rays))
    refused(lambda: assert_drawn_with(share=share, hits=rays, rays=hits))


@pytest.mark.parametrize("rays", [9, 240, 5000])
def test_the_limits_are_those_of_the_binomial(rays: int) -> None:
    """Each side for itself, by scipy's own test."""
    for share in (0.02, 0.4137, 0.9545):
        for hits in range(0, rays + 1, max(1, rays // 200)):
            sides = (binomtest(hits, rays, share, alternative=side).pvalue for side in ("less", "greater"))
            if min(sides) > verdicts.SIGNIFICANCE / 2:
                assert_drawn_with(share=share, hits=hits, rays=rays)
            else:
                with pytest.raises(AssertionError):
                    assert_drawn_with(share=share, hits=hits, rays=rays)


def test_a_share_between_two_is_judged_by_the_nearer_one() -> None:
    assert_drawn_with(share=(0.64, 0.72), hits=660, rays=1000)
    assert_drawn_with(share=(0.64, 0.72), hits=592, rays=1000)
    refused(lambda: assert_drawn_with(share=(0.64, 0.72), hits=570, rays=1000))
    refused(lambda: assert_drawn_with(share=(0.64, 0.72), hits=790, rays=1000))
    refused(lambda: assert_drawn_with(share=(0.72, 0.64), hits=660, rays=1000))


# --- coverage ----------------------------------------------------------------------------------------------------------


def deviations(seed: int = 3) -> Array:
    return np.random.default_rng(seed).normal(size=1000)


def test_normal_deviations_are_covered() -> None:
    assert_covers(deviations=deviations())
    assert_covers(deviations=deviations(), effective=500.5)


@pytest.mark.parametrize("factor", [0.7, 1.5])
def test_errors_that_are_too_small_or_too_large_do_not_cover(factor: float) -> None:
    refused(lambda: assert_covers(deviations=deviations() / factor))
    refused(lambda: assert_covers(deviations=deviations() / factor, effective=500.5))


def test_five_per_cent_of_the_value_are_found_by_errors_of_one() -> None:
    refused(lambda: assert_covers(deviations=deviations() + 5.0))


def test_deviations_that_go_together_are_worth_fewer() -> None:
    """100 patches of 10 equal cells: with their number, one map in a few is refused; with the effective one, none."""
    rng = np.random.default_rng(4)
    shares, judged = [], {None: 0, 100.0: 0}
    for _ in range(200):
        together = np.repeat(rng.normal(size=100), 10)
        shares.append((np.abs(together) < 1.0).mean())
        for effective in judged:
            try:
                assert_covers(deviations=together, effective=effective)
            except AssertionError:
                judged[effective] += 1
    mean = float(np.mean(shares))
    assert mean * (1.0 - mean) / np.var(shares, ddof=1) == pytest.approx(100.0, rel=0.35)
    assert judged[100.0] == 0
    assert judged[None] > 20


def test_what_is_promised_may_be_an_interval() -> None:
    wide = deviations() * 1.08
    assert_covers(deviations=wide, one=(0.62, 0.72), two=(0.92, 0.97))
    refused(lambda: assert_covers(deviations=wide / 0.7, one=(0.62, 0.72), two=(0.92, 0.97)))
    refused(lambda: assert_covers(deviations=np.append(wide, np.nan)))
    assert (round(WITHIN_ONE, 4), round(WITHIN_TWO, 4)) == (0.6827, 0.9545)
