"""Diagnostics of a light field against closed forms, and forecasts against fits with more rays."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.candidate import Score
from etendue.lightfield.carrier import Cylinder, Disk, Dome, Hemisphere, Plane, Surface
from etendue.lightfield.characteristic import CharacteristicCurve, characteristic_curve
from etendue.lightfield.diagnostics import diagnose
from etendue.lightfield.etendue_density import FitReport, PartField
from etendue.lightfield.expected_loss import loss_of_gamma
from etendue.lightfield.forecast import (
    EXPONENTS,
    LAW_HOLDS,
    REFITS,
    Forecast,
    _count,
    _gains,
    _refit,
    law_of_gains,
    make_forecast,
)
from etendue.lightfield.light_field import LightField
from etendue.plot.characteristic_picture import plot_characteristic
from oracles.light_fields import SURFACES, make_field
from oracles.sources import DieUnderDome, LimbDarkenedDisk
from scipy import special, stats

Array = npt.NDArray[np.float64]

REPORT = FitReport(50_000, 0, 0.0, ("uniform",), (3.0,), 10.0, -2.0, 0.01, -2.5, 20.0)
PLANE = Plane(z=0.3, width=3.0, height=2.0, centre=(0.2, -0.1))
WHOLE = math.pi * 6.0
"""Étendue of the plane [mm² sr]."""

SIGNIFICANCE = 1e-3


def field_of(surface: Surface, *parts: PartField, report: FitReport = REPORT) -> LightField:
    report = dataclasses.replace(report, bases=("uniform",) * len(parts), concentrations=(3.0,) * len(parts))
    return LightField(surface, parts, "lm", report)


def part(ratio: Array, level: float = 1.0, deviation: Array | float = 0.0, **factors: Array) -> PartField:
    errors = np.broadcast_to(np.asarray(deviation, dtype=np.float32), ratio.shape)
    both = {"space": factors.get("space"), "direction": factors.get("direction")}
    return PartField(ratio.astype(np.float32), np.array(errors), level=level, **both)


def ramp(n: int) -> Array:
    """Values at the centres of n cells of a straight line from 0 to 1."""
    return (np.arange(n) + 0.5) / n


def middles(curve: CharacteristicCurve) -> tuple[Array, Array]:
    """Ends of the steps: the étendue before and after each."""
    return np.append(0.0, curve.etendue[:-1]), curve.etendue


# --- the characteristic curve ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1, 2, 3])
def test_a_ramp_along_any_coordinate_has_a_straight_curve(axis: int) -> None:
    """L = v along one coordinate of n cells; the read-out is flat in half a cell at either end."""
    n, level = 64, 5e-3
    shape = [1, 1, 1, 1]
    shape[axis] = n
    curve = characteristic_curve(field_of(PLANE, part(ramp(n).reshape(shape), level)), points=1 << 20)
    low, high = middles(curve)
    # ∫ of 1 - u between the steps; the flat ends differ from it by less than half a cell.
    inner = (low > WHOLE / n) & (high < WHOLE * (1 - 1 / n))
    truth = level * 1e6 * (1 - (low + high) / 2 / WHOLE)
    np.testing.assert_allclose(curve.luminance[inner], truth[inner], rtol=0, atol=3e-5 * level * 1e6)
    assert curve.total_etendue == pytest.approx(WHOLE, rel=1e-12)
    assert curve.etendue[-1] == pytest.approx(WHOLE, rel=1e-9)
    assert curve.flux[-1] == pytest.approx(level * WHOLE / 2, rel=1e-5)
    # Half of the flux lies in the brightest 1 - √½ of the étendue.
    assert curve.etendue_of(0.5) == pytest.approx(WHOLE * (1 - math.sqrt(0.5)), rel=1e-3)


def test_factors_count_between_the_centres_of_cells() -> None:
    """L = x·a with both factors finer than the grid: P(x·a > t) = 1 - t + t ln t for uniform x and a."""
    rows = np.repeat(ramp(256)[:, None], 256, axis=1)
    curve = characteristic_curve(
        field_of(PLANE, part(np.ones((2, 2, 2, 2)), 1.0, space=rows, direction=rows)), points=1 << 17
    )
    t = np.array([0.9, 0.7, 0.4, 0.2, 0.05])
    found = np.interp(-t * 1e6, -curve.luminance, (np.append(0.0, curve.etendue[:-1]) + curve.etendue) / 2)
    np.testing.assert_allclose(found / WHOLE, 1 - t + t * np.log(t), atol=1e-3)


def test_a_line_through_window_and_dome_counts_once_with_the_light_of_both() -> None:
    radius, window = 1.3, 0.7
    parts = [part(np.full((1, 1, 1, 1), 1.0), level) for level in (2.0, 0.5)]
    curve = characteristic_curve(field_of(Dome(radius=radius, window=window), *parts), points=1 << 19)
    through, all_lines = math.pi * math.pi * window**2, math.pi * 2 * math.pi * radius**2
    assert curve.total_etendue == pytest.approx(all_lines, rel=1e-3)
    low, high = middles(curve)
    np.testing.assert_allclose(curve.luminance[high < 0.999 * through], 2.5e6, rtol=1e-6)
    np.testing.assert_allclose(curve.luminance[low > 1.001 * through], 0.5e6, rtol=1e-6)
    assert curve.flux[-1] == pytest.approx(2.5 * through + 0.5 * (all_lines - through), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plane", "hemisphere", "sphere", "cylinder", "box", "dome with a window"])
def test_the_curve_holds_the_flux_of_a_rough_field(name: str) -> None:
    """A lattice sees all lines of any surface; a line that leaves one part only is met once."""
    field = make_field(SURFACES[name])
    curve = characteristic_curve(field, points=1 << 18)
    assert curve.flux[-1] == pytest.approx(field.total_flux, rel=5e-3)
    assert (np.diff(curve.luminance) <= 0).all()
    assert (np.diff(curve.etendue) > 0).all()
    assert (curve.standard_error >= 0).all()


@pytest.mark.slow
def test_the_curve_of_a_fit_is_at_least_as_close_to_the_true_one_as_the_field_to_the_source() -> None:
    """Sorting by luminance never brings two functions further apart: ∫|f* - g*| ≤ ∫|f - g|."""
    source, n = LimbDarkenedDisk(), 60_000
    x, k = source.rays(n, seed=5)
    disk = Disk(radius=source.radius * 1.02, centre=source.centre)
    field = LightField.fit(et.RaySet(x, k, np.full(n, source.total_flux / n)), disk, depths=(4, 4, 3, 3))
    curve = characteristic_curve(field)
    chart = disk.parts()[0]
    points, directions = _core.rays_of_part(chart.core(), np.random.default_rng(6).random((400_000, 4)))
    truth = source.luminance(points=points, directions=directions)
    found = field.luminance(points, directions)[0]
    of_line = chart.etendue / len(truth) * 1e-6
    apart = np.abs(truth - found).sum() * of_line / source.total_flux
    true_curve = np.interp(
        (np.append(0.0, curve.etendue[:-1]) + curve.etendue) / 2,
        (np.arange(len(truth)) + 0.5) / len(truth) * chart.etendue,
        np.sort(truth)[::-1],
    )
    widths = np.diff(curve.etendue, prepend=0.0)
    sorted_apart = np.abs(true_curve - curve.luminance) @ widths * 1e-6 / source.total_flux
    # Both integrals are sums over 4e5 random lines: their errors are below 1e-3 of the flux.
    assert sorted_apart < apart + 2e-3
    assert apart < 0.1
    assert curve.luminance[0] < 1.25 * truth.max()


@pytest.mark.slow
def test_the_luminance_of_a_lambertian_disk_is_a_step() -> None:
    """One ring: Φ/(π A) over π A, and nothing beyond."""
    source = et.RingSource((5.0,), (30.0,), rays=40_000)
    field = LightField.fit(source, Disk(radius=5.0), depths=(3, 3, 3, 3))
    curve = characteristic_curve(field, points=1 << 18)
    etendue = math.pi * math.pi * 25.0
    assert curve.total_etendue == pytest.approx(etendue, rel=1e-12)
    inner = (curve.etendue > 0.02 * etendue) & (curve.etendue < 0.98 * etendue)
    expected = 30.0 / etendue * 1e6
    assert np.abs(curve.luminance[inner] / expected - 1).max() < 4 * diagnose(field).expected_error + 1e-3


def test_a_curve_is_asked_for_what_it_holds() -> None:
    field = field_of(PLANE, part(np.ones((1, 1, 1, 1))))
    with pytest.raises(ArgumentError, match="at least one line"):
        characteristic_curve(field, 0)
    curve = characteristic_curve(field, 1000)
    assert [curve.etendue_of(share) for share in (0.0, 1.0)] == pytest.approx([0.0, WHOLE])
    with pytest.raises(ArgumentError, match=r"share is 1\.5"):
        curve.etendue_of(1.5)


# --- where the field is least certain --------------------------------------------------------------------------------


def test_expected_loss_is_that_of_a_gamma_variable() -> None:
    k = np.geomspace(1e-6, 1e9, 46)
    np.testing.assert_allclose(loss_of_gamma(k), special.digamma(k + 1) - np.log(k), rtol=1e-7, atol=1e-14)
    assert loss_of_gamma(np.array([np.inf])) == 0.0
    assert np.isfinite(loss_of_gamma(np.array([0.0]))).all()


def test_the_worst_cell_is_found_and_named_in_space() -> None:
    shape, cell = (16, 8, 32, 8), (13, 2, 21, 5)
    deviation = np.full(shape, 0.01)
    deviation[cell] = 0.4
    deviation[3, 7, 3, 1] = 0.2
    field = field_of(PLANE, part(np.full(shape, 0.25), 8e-3, 0.25 * deviation))
    found = diagnose(field, spots=3)
    first, second = found.spots[:2]
    # Where the cell is, the counter of rays says: it goes from lines to coordinates, the report from coordinates to lines.
    theta, phi = math.radians(first.theta), math.radians(first.phi)
    k = [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
    centre = _core.cross_parts([PLANE.parts()[0].core()], np.array([first.point]), np.array([k]))[1][0]
    np.testing.assert_allclose(centre, (np.array(cell) + 0.5) / shape, atol=1e-9)
    assert first.point == pytest.approx((0.2 + 3 * (13.5 / 16 - 0.5), -0.1 + 2 * (2.5 / 8 - 0.5), 0.3))
    assert first.luminance == pytest.approx(8e-3 * 0.25e6, rel=1e-6)
    assert first.standard_error == pytest.approx(0.4 * first.luminance, rel=1e-5)
    assert first.part == "plane"
    # Each cell has the same mass: its loss is that of its relative variance.
    cells = math.prod(shape)
    even = float(loss_of_gamma(np.array([1e4]))[0])
    high, middle = (float(loss_of_gamma(np.array([1 / v**2]))[0]) for v in (0.4, 0.2))
    whole = (cells - 2) * even + high + middle
    in_box = cells // 8**4
    assert first.share == pytest.approx(((in_box - 1) * even + high) / whole, rel=1e-4)
    assert second.share == pytest.approx(((in_box - 1) * even + middle) / whole, rel=1e-4)
    assert found.expected_error == pytest.approx(math.sqrt(2 * whole / cells), rel=1e-4)


@pytest.mark.slow
def test_parts_are_weighed_by_their_flux() -> None:
    """The side has three times the flux of an end and the same relative error: three times the loss."""
    surface = Cylinder(radius=1.0, bottom=0.0, top=1.5)
    ratio = np.ones((2, 2, 2, 2))
    field = field_of(surface, *(part(ratio, level, 0.1) for level in (1.0, 1.0, 2.0)))
    found = diagnose(field, spots=48)
    sums = {name: sum(s.share for s in found.spots if s.part == name) for name in ("side", "top", "bottom")}
    assert sums == pytest.approx({"side": 0.5, "top": 1 / 6, "bottom": 1 / 3}, rel=1e-6)
    assert [s.share for s in found.spots] == sorted((s.share for s in found.spots), reverse=True)
    assert found.expected_error == pytest.approx(0.1, rel=5e-3)
    downwards = [s for s in found.spots if s.part == "bottom"]
    assert all(s.theta > 90 and s.point[2] == 0.0 for s in downwards)


def test_a_field_without_errors_is_nowhere_uncertain() -> None:
    found = diagnose(field_of(PLANE, part(np.ones((2, 2, 2, 2)))))
    assert (found.spots, found.expected_error) == ((), 0.0)


# --- what more rays would bring --------------------------------------------------------------------------------------

RUNGS = np.array([1250.0, 2500.0, 5000.0])


def gains_of(loss: float, exponent: float) -> Array:
    """Exact gains of the law with `loss` at 10 000 rays."""
    return -np.diff(loss * (RUNGS / 1e4) ** -exponent)


@pytest.mark.parametrize("exponent", [0.4, 0.6, 0.85])
def test_the_law_is_found_again(exponent: float) -> None:
    curve = law_of_gains(RUNGS, gains_of(0.02, exponent), np.eye(2) * 1e-12, 10_000)
    assert curve.exponent.low < exponent < curve.exponent.high
    assert curve.loss().low < 0.02 < curve.loss().high
    assert curve.factor(0.5).low < 4 ** (1 / exponent) < curve.factor(0.5).high
    for low, value, high in [(f.low, f.value, f.high) for f in (curve.exponent, curve.error(), curve.gain(4))]:
        assert low < value < high
    # More rays: less error; by the factor: half of it, for each law, and so for their median.
    assert curve.error(1e5).value < curve.error().value < curve.error(1e3).value
    assert curve.error().value == pytest.approx(math.sqrt(2 * curve.loss().value))


@pytest.mark.slow
def test_forecasts_hold_as_often_as_they_say() -> None:
    """Gains drawn from laws that the prior thinks possible, with the scatter and the noise that are assumed."""
    rng = np.random.default_rng(8)
    trials, covariance = 1500, np.array([[4e-8, 1e-8], [1e-8, 3e-8]])
    hits = dict.fromkeys(("exponent", "factor", "error", "gain"), 0)
    for _ in range(trials):
        exponent, loss = rng.choice(EXPONENTS), 0.01 * rng.uniform(0.7, 1.4)
        exact = gains_of(loss, exponent)
        noise = covariance + np.diag((LAW_HOLDS * exact) ** 2)
        curve = law_of_gains(RUNGS, exact + np.linalg.cholesky(noise) @ rng.normal(size=2), covariance, 10_000)
        truths = {
            "exponent": (curve.exponent, exponent),
            "factor": (curve.factor(0.5), 4 ** (1 / exponent)),
            "error": (curve.error(), math.sqrt(2 * loss)),
            "gain": (curve.gain(4.0), loss * (1 - 4**-exponent)),
        }
        for name, (forecast, truth) in truths.items():
            # The exponent is one of a few: at the ends of an interval it is as much inside as outside.
            hits[name] += forecast.low * (1 - 1e-9) <= truth <= forecast.high * (1 + 1e-9)
    low, high = stats.binom.ppf([SIGNIFICANCE / 2, 1 - SIGNIFICANCE / 2], trials, 0.68)
    for name in ("error", "gain"):
        assert low <= hits[name] <= high, hits
    # With the ends inside, the interval of a number out of 31 holds more than 68 %.
    assert all(low <= hits[name] <= high + 0.06 * trials for name in ("exponent", "factor")), hits


def test_gains_that_drown_in_noise_promise_nothing() -> None:
    curve = law_of_gains(RUNGS, np.array([1e-5, -2e-5]), np.eye(2) * 1e-8, 10_000)
    assert curve.error().low == 0.0
    # All exponents remain about as likely as they were.
    assert curve.factor().low < 5
    assert curve.factor().high > 35
    none = law_of_gains(RUNGS, np.zeros(2), np.zeros((2, 2)), 10_000)
    assert none.error().value < 1e-3
    assert math.isfinite(none.factor().value)


class Trial:
    """A die under a dome at growing numbers of rays, and its scores on fresh rays."""

    N = 10_000

    def __init__(self) -> None:
        self.source = DieUnderDome()
        self.surface = Plane(z=0, width=2.6, height=2.6, centre=(0, 0), focus=(0, 0, 0, 0))
        self.x, self.k = self.source.rays(32 * self.N, seed=3)
        self.fresh = self.source.rays(60_000, seed=4)
        self.fields: dict[int, LightField] = {}

    def rays(self, n: int) -> et.RaySet:
        return et.RaySet(self.x[:n], self.k[:n], np.full(n, self.source.total_flux / n))

    def field(self, n: int) -> LightField:
        if n not in self.fields:
            self.fields[n] = LightField.fit(self.rays(n), self.surface, depths=(3, 3, 3, 3))
        return self.fields[n]

    def score(self, n: int) -> float:
        """Mean ln of the density at fresh rays, with the share of a uniform field that all scores have."""
        field = self.field(n)
        density = field.pdf(*self.fresh)
        return float(np.log((1 - 1e-4) * density + 1e-4 / self.surface.parts()[0].etendue).mean())


@pytest.fixture(scope="module")
def trial() -> Trial:
    return Trial()


@pytest.fixture(scope="module")
def curve(trial: Trial) -> Forecast:
    return make_forecast(trial.field(trial.N), trial.rays(trial.N), threads=1)


@pytest.mark.slow
def test_forecasts_come_true(trial: Trial, curve: Forecast) -> None:
    """The field really fitted to 4 and 16 times the rays; and to as many as are said to halve its error."""
    scores = {m: trial.score(m * trial.N) for m in (1, 4, 16, 32)}
    for m in (4, 16):
        forecast = curve.gain(m)
        true = scores[m] - scores[1]
        # Twice the interval of 68 % on a logarithmic scale: 95 %.
        assert forecast.value * (forecast.low / forecast.value) ** 2 < true, (m, forecast, true)
        assert true < forecast.value * (forecast.high / forecast.value) ** 2, (m, forecast, true)
    # What endless rays would reach: the score of 32 times as many, and the little that the law adds.
    end = scores[32] + curve.loss(32 * trial.N).value
    halved = trial.score(round(curve.factor(0.5).value * trial.N))
    share = math.sqrt((end - halved) / (end - scores[1]))
    low, high = (curve.factor(0.5).value / f for f in (curve.factor(0.5).high, curve.factor(0.5).low))
    assert 0.5 * low**0.5 < share < 0.5 * high**0.5, share


def chips(n: int, seed: int) -> et.RaySet:
    """Two Lambertian squares of 1 mm side by side, which are all edges."""
    rng = np.random.default_rng(seed)
    x = np.zeros((n, 3))
    x[:, :2] = rng.random((n, 2)) - 0.5 + np.where(rng.random((n, 1)) < 0.5, [-2.0, 0.0], [2.0, 0.5])
    sine, phi = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    k = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - sine**2)], axis=1)
    return et.RaySet(x, k, np.full(n, 100.0 / n))


@pytest.mark.slow
def test_forecasts_of_sharp_edges_are_for_the_cells_of_the_field() -> None:
    """The images of every rung have the cells of the field's; true gain and factor are those of fits, scored in closed form.

    As fits to more rays have finer cells, they gain at least what was forecast, and need no more rays than that.
    """
    n, plane = 20_000, Plane(z=0, width=5, height=1.5, centre=(0, 0.25))
    rays, fresh = chips(n, 1), chips(100_000, 2)
    field, more = (LightField.fit(r, plane, depths=(4, 4, 3, 3)) for r in (rays, chips(4 * n, 3)))
    few = chips(n // 8, 4)
    (again,) = _refit(field, _count(field, few, 1, None), None).parts
    assert again.space is not None
    assert field.parts[0].space is not None
    assert again.space.shape == field.parts[0].space.shape
    # The light has the density 1/(2 π) in étendue wherever there is any.
    even = 1e-4 / plane.parts()[0].etendue
    lacks = [
        -math.log(2 * math.pi) - np.log((1 - 1e-4) * f.pdf(fresh.position, fresh.direction) + even).mean()
        for f in (field, more)
    ]
    true_factor = 4.0 ** (math.log(4) / math.log(lacks[0] / lacks[1]))
    curve = make_forecast(field, rays)
    assert curve.gain(4.0).low < lacks[0] - lacks[1]
    assert curve.factor(0.5).low < true_factor


@pytest.mark.slow
def test_gains_are_differences_of_scores_on_the_other_half(trial: Trial, curve: Forecast) -> None:
    np.testing.assert_allclose(curve.rays, trial.N * np.array([1, 2, 4]) / 8)
    assert (curve.gains > 5 * curve.gain_errors).all()
    assert curve.field_rays == trial.N
    # The errors are those of means over 10 000 rays.
    assert (curve.gain_errors < 0.02).all()


def test_gains_are_weighed_by_flux() -> None:
    """Equal weights: mean and covariance of the mean; a ray without flux changes nothing."""
    rng = np.random.default_rng(2)
    values, weights = rng.normal(size=(2, 3, 50)), np.full(50, 0.7)
    gains, covariance = _gains([[Score(v, weights) for v in half] for half in values])
    steps = np.diff(np.concatenate(values, axis=1), axis=0)
    np.testing.assert_allclose(gains, steps.mean(axis=1), rtol=1e-12)
    np.testing.assert_allclose(covariance, np.cov(steps, ddof=0) / 100, rtol=1e-12)
    values[:, 1, 7], weights[7] = 1e3, 0.0
    kept = np.arange(50) != 7
    alone = _gains([[Score(v[kept], weights[kept]) for v in half] for half in values])
    for one, other in zip(_gains([[Score(v, weights) for v in half] for half in values]), alone, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def plain_field(surface: Surface, depths: tuple[int, ...], rays: int) -> LightField:
    """What a forecast needs of a field: surface, grid, base measure and concentration."""
    report = dataclasses.replace(REPORT, rays=rays)
    return field_of(surface, part(np.ones([1 << d for d in depths])), report=report)


def test_rays_of_unequal_flux_are_judged_by_their_flux() -> None:
    """The same source by equal rays, and by rays half of which carry twice the flux and are half as many."""
    source, n = LimbDarkenedDisk(), 20_000
    x, k = source.rays(n, seed=7)
    heavy = np.random.default_rng(1).random(n) < 0.5
    kept = ~heavy | (np.random.default_rng(2).random(n) < 0.5)
    plane = Plane(z=0, width=23, height=23, centre=(0.9, -0.5))
    equal, unequal = (
        make_forecast(plain_field(plane, (3, 3, 2, 2), len(rays)), rays)
        for rays in (et.RaySet(x, k, np.ones(n)), et.RaySet(x[kept], k[kept], np.where(heavy, 2.0, 1.0)[kept]))
    )
    # Σ(w)²/Σ(w²) is 2/3 of n: as many equal rays would gain more from each doubling by that to the power of -β.
    more = 1.5**equal.exponent.value
    apart = unequal.gains - more * equal.gains
    noise = np.hypot(more * equal.gain_errors, unequal.gain_errors)
    assert (np.abs(apart) < stats.norm.isf(SIGNIFICANCE / 4) * np.hypot(noise, 0.1 * equal.gains)).all()


@pytest.mark.slow
def test_a_symmetry_tells_of_twice_the_rays(trial: Trial) -> None:
    """Of a source that is even in x, half the rays folded predict fresh rays at least as well as all rays unfolded."""
    surface, depths = Hemisphere(radius=1.264), (3, 3, 2, 2)
    rays = trial.rays(48_000)
    sign = np.where(np.random.default_rng(3).random(48_000) < 0.5, -1.0, 1.0)[:, None] * [1, 0, 0] + [0, 1, 1]
    x, k = rays.position * sign, rays.direction * sign

    def even(stop: int) -> et.RaySet:
        return et.RaySet(x[:stop], k[:stop], rays.flux[:stop])

    fields = (
        LightField.fit(even(16_000), surface, depths=depths),
        LightField.fit(even(8_000), surface, depths=depths, symmetry="mirror-x"),
        LightField.fit(even(8_000), surface, depths=depths),
    )
    alone, folded, few = (np.log(field.pdf(x[16_000:], k[16_000:])) for field in fields)
    least = stats.norm.isf(SIGNIFICANCE / 2) / np.sqrt(32_000)
    assert (folded - few).mean() > least * (folded - few).std()
    assert (folded - alone).mean() > -least * (folded - alone).std()
    mirrored, plain = fields[0].replace(report=dataclasses.replace(fields[0].report, symmetry="mirror-x")), fields[0]
    curve = make_forecast(mirrored, even(16_000))
    np.testing.assert_array_equal(diagnose(mirrored, even(16_000)).forecast.gains, curve.gains)
    assert (curve.gains < make_forecast(plain, even(16_000)).gains).all()


def test_progress_threads_and_seed(trial: Trial) -> None:
    rays = trial.rays(5000)
    field = plain_field(trial.surface, (2, 2, 2, 2), 5000)
    seen: list[int] = []
    first = make_forecast(field, rays, threads=1, progress=seen.append)
    assert seen == list(range(1, REFITS + 1))
    np.testing.assert_array_equal(make_forecast(field, rays, threads=2).gains, first.gains)
    assert (make_forecast(field, rays, seed=2).gains != first.gains).all()


def test_what_cannot_be_diagnosed_is_refused(trial: Trial) -> None:
    field = field_of(PLANE, part(np.ones((2, 2, 2, 2))))
    with pytest.raises(ArgumentError, match=r"50,000 rays, and this set has 4,000"):
        diagnose(field, trial.rays(4000))
    few = dataclasses.replace(REPORT, rays=3999)
    with pytest.raises(ArgumentError, match="3,999 rays are too few"):
        diagnose(field_of(PLANE, part(np.ones((2, 2, 2, 2))), report=few), trial.rays(3999))
    watts = et.RaySet(trial.x[:10], trial.k[:10], np.ones(10), flux_unit="W")
    with pytest.raises(ArgumentError, match="the field is in lm, the rays are in W"):
        diagnose(field, watts)
    with pytest.raises(ArgumentError, match="spots is -1"):
        diagnose(field, spots=-1)
    curve = law_of_gains(RUNGS, gains_of(0.02, 0.5), np.eye(2) * 1e-10, 10_000)
    for ask in (lambda: curve.factor(0.0), lambda: curve.error(0), lambda: curve.gain(math.nan)):
        with pytest.raises(ArgumentError, match="above 0"):
            ask()


# --- reports ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_diagnostics_are_plain_data_and_a_few_lines() -> None:
    field = field_of(PLANE, part(ramp(16).reshape(2, 2, 2, 2), 1e-3, 0.02))
    without = diagnose(field)
    found = dataclasses.replace(without, forecast=law_of_gains(RUNGS, gains_of(0.02, 0.5), np.eye(2) * 1e-10, 10_000))
    data = json.loads(json.dumps(found.to_dict()))
    assert data["lead_over_histogram"] == 0.5
    assert data["characteristic_curve"]["flux"][-1] == found.curve.flux[-1]
    assert data["forecast"]["rays_factor_to_halve_error"]["value"] == found.forecast.factor(0.5).value  # type: ignore[union-attr]
    assert data["learning"] == data["forecast"]
    with pytest.warns(DeprecationWarning, match="now called forecast"):
        assert found.learning is found.forecast
    assert len(data["least_certain"]) == 12
    lines = found.summary()
    for piece in ("-2.0000 ± 0.0100", "+0.5000", "20 effective", "times the rays", "least certain: (", "θ = "):
        assert piece in lines
    assert "times the rays" not in without.summary()
    assert without.to_dict()["forecast"] is None


@pytest.mark.slow
def test_factors_of_hundreds_and_scores_of_one_ray_are_written_as_people_write_them() -> None:
    """A slow law (exponent 0.3) leaves it open whether a hundred times the rays halve the error: not 1e+02 of them."""
    field = field_of(PLANE, part(ramp(16).reshape(2, 2, 2, 2), 1e-3, 0.02))
    law = law_of_gains(RUNGS, gains_of(0.02, 0.3), np.eye(2) * 1e-10, 10_000)
    alone = dataclasses.replace(REPORT, score_error=math.inf)
    found = dataclasses.replace(diagnose(field), forecast=law, report=alone)
    lines, labels = found.summary(), [str(line.get_label()) for line in plot_characteristic(found).axes[2].lines]
    label = next(text for text in labels if "half the error" in text)
    high = law.factor(0.5).high
    assert 100.0 <= high < 1000.0
    assert f" to {high:.0f}) times the rays" in lines
    assert f" to {round(high, -1):.0f})" in label
    assert "held-out score -2.0000 nat per ray\n" in lines
    for text in (lines, label):
        assert not re.search(r"e\+|inf", text), text


@pytest.mark.slow
def test_where_fits_to_more_rays_gain_nothing_the_error_bars_are_a_bound() -> None:
    """Gains of -4 ± 2 and 1 ± 2 in 10⁵: no law, no factor, and nothing at 0 on a logarithmic axis."""
    law = law_of_gains(RUNGS, np.array([-4e-5, 1.2e-5]), np.eye(2) * 2.2e-5**2, 10_000)
    found = diagnose(field_of(PLANE, part(ramp(16).reshape(2, 2, 2, 2), 1e-3, 0.02)))
    found = dataclasses.replace(found, forecast=law)
    assert not law.measurable
    assert law_of_gains(RUNGS, gains_of(0.02, 0.5), np.eye(2) * 1e-10, 10_000).measurable
    assert found.to_dict()["forecast"]["rays_factor_to_halve_error"] is None
    lines = found.summary()
    assert f"no gain from more rays is measurable: the {found.expected_error:.1%} of the error bars" in lines
    assert "1.2e-05 ± 2.2e-05 nat per ray" in lines
    assert "times the rays" not in lines
    axes = plot_characteristic(found).axes[2]
    (legend,) = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "no gain from more rays is measurable" in legend
    shown = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines if len(line.get_xdata())]
    assert shown[0] == (10_000, 100.0 * found.expected_error)
    low, high = axes.get_ylim()
    assert all(0.0 < low < y < high for _, y in shown)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome with a window", "cylinder"])
def test_the_picture_shows_what_was_found_and_repeats_its_bytes(name: str, tmp_path: Path) -> None:
    field = make_field(SURFACES[name], flux_unit="W" if name == "cylinder" else "lm")
    law = law_of_gains(RUNGS, gains_of(0.02, 0.5), np.eye(2) * 1e-10, 10_000)
    found = dataclasses.replace(diagnose(field), forecast=law)
    figure = plot_characteristic(found, tmp_path / "a.png")
    if name == "cylinder":
        plot_characteristic(found, tmp_path / "b.png")
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    unit = ("radiance [W/(m² sr)]", "flux [W]") if name == "cylinder" else ("luminance [cd/m²]", "flux [lm]")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert [re.sub("10[⁰¹²³⁴⁵⁶⁷⁸⁹]+ ", "", label) for label in labels] == [*unit, "relative error at a ray [%]"]
    figure.canvas.draw()
    for axes in figure.axes[:2]:
        # Numbers at the ticks, times the power of ten beside the unit, are where the ticks are.
        power = re.search("10([⁰¹²³⁴⁵⁶⁷⁸⁹]+) ", axes.get_ylabel())
        factor = 10.0 ** int(power[1].translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789"))) if power else 1.0
        written = [factor * float(tick.get_text().replace("\u202f", "")) for tick in axes.get_yticklabels()]
        np.testing.assert_allclose(written, axes.get_yticks(), rtol=1e-9, atol=1e-9 * factor)
    drawn = figure.axes[1].lines[0]
    assert (drawn.get_xdata()[-1], drawn.get_ydata()[-1]) == (found.curve.etendue[-1], found.curve.flux[-1])
    texts = [text.get_text() for text in figure.texts]
    assert sum(text == found.spots[0].part for text in texts) >= 1
    # Nothing is cut off at the edge of the picture.
    figure.canvas.draw()
    width, height = figure.canvas.get_width_height()
    for text in [*figure.texts, *(t for axes in figure.axes for t in axes.texts)]:
        box = text.get_window_extent()
        assert box.x0 >= 0, text
        assert box.y0 >= 0, text
        assert box.x1 <= width, text
        assert box.y1 <= height, text
    with pytest.raises(UnknownNameError, match=r"\.exe"):
        plot_characteristic(found, tmp_path / "a.exe")


@pytest.mark.slow
def test_a_dark_or_even_field_is_drawn_too() -> None:
    for ratio in (np.ones((1, 1, 1, 1)), np.eye(16)[0].reshape(2, 2, 2, 2)):
        assert len(plot_characteristic(diagnose(field_of(PLANE, part(ratio, 1e-3)))).axes) == 2
