"""Rays become intensity: every cell where it belongs, every lumen once, every error as large as it says."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.quantities.intensity_cells import Cells
from etendue.quantities.ray_set import RaySetMeaning
from oracles.verdicts import assert_covers
from scipy.stats import chi2

Array = npt.NDArray[np.float64]


def direction(c: npt.ArrayLike, gamma: npt.ArrayLike) -> Array:
    a, b = np.radians(c), np.radians(gamma)
    a, b = np.broadcast_arrays(a, b)
    return np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1)


def rays_of(directions: Array, flux: Array, unit: str = "lm") -> et.RaySet:
    flat = directions.reshape(-1, 3)
    position = np.random.default_rng(9).normal(size=flat.shape)  # where rays start is of no consequence
    return et.RaySet(position, flat, np.ravel(flux), flux_unit=unit)  # type: ignore[arg-type]


def cell_solid_angle(planes: int, gamma: Array) -> Array:
    """From the edges of the cells, not from their centres; a pole is one cap."""
    edges = np.concatenate([[0.0], (gamma[1:] + gamma[:-1]) / 2.0, [180.0]])
    belts = 2.0 * np.pi * -np.diff(np.cos(np.radians(edges)))
    return np.where(np.arange(gamma.size) % (gamma.size - 1) == 0, belts, belts / planes)


# --- every cell where it belongs -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("planes", "step"), [(36, 2.5), (5, 45), (1, 10), (7, 7.5), (4, 90)])
@pytest.mark.parametrize(("aside", "up"), [(0, 0), (0.49, 0.49), (-0.49, 0.49), (0.49, -0.49), (-0.49, -0.49)])
def test_each_ray_counts_for_the_node_it_is_nearest_to(planes: int, step: float, aside: float, up: float) -> None:
    cells = Cells(planes, step)
    inner = cells.gamma[1:-1]
    flux = 1.0 + np.arange(planes * inner.size).reshape(planes, -1)
    belt = direction(cells.c[:, None] + aside * 360.0 / planes, inner + up * step)
    poles = direction([77.0, 200.0], np.array([0.49 * step, 180 - 0.49 * step]))
    both = np.concatenate([belt.reshape(-1, 3), poles])
    led = intensity_distribution(rays_of(both, np.append(flux, [0.25, 0.5])), planes, step)
    omega = cell_solid_angle(planes, led.gamma)
    assert np.allclose(led.values[:, 1:-1] * omega[1:-1], flux, rtol=1e-12)
    assert np.allclose(led.values[:, [0, -1]] * omega[[0, -1]], [0.25, 0.5], rtol=1e-12)
    assert np.allclose(led.standard_error[:, 1:-1], led.values[:, 1:-1], rtol=1e-12)


def test_no_turn_and_no_mirror_image() -> None:
    """One ray in each octant, all different."""
    c, gamma = np.meshgrid([40.0, 130.0, 220.0, 310.0], [50.0, 130.0], indexing="ij")
    led = intensity_distribution(rays_of(direction(c, gamma), np.arange(1.0, 9.0)), 36, 10)
    lit = np.argwhere(led.values > 0)
    assert [(led.c[i], led.gamma[j]) for i, j in lit] == list(zip(c.ravel(), gamma.ravel(), strict=True))
    found = led.in_direction(direction(c, gamma)).ravel()
    assert np.allclose(found * cell_solid_angle(36, led.gamma)[lit[:, 1]], np.arange(1.0, 9.0))


def test_the_solid_angles_are_exact_and_make_the_sphere() -> None:
    for planes, step in ((36, 2.5), (1, 90), (720, 0.25)):
        cells = Cells(planes, step)
        assert np.allclose(cells.solid_angle, cell_solid_angle(planes, cells.gamma), rtol=1e-9)
        total = planes * cells.solid_angle[1:-1].sum() + cells.solid_angle[[0, -1]].sum()
        assert total == pytest.approx(4 * np.pi, rel=1e-13)


# --- closed forms ----------------------------------------------------------------------------------------------------


def leaning_lobe(n: int, exponent: float, axis: Array, seed: int) -> Array:
    """Directions of I ∝ cos^n about an axis off every symmetry plane, by inversion."""
    rng = np.random.default_rng(seed)
    cos = rng.random(n) ** (1.0 / (exponent + 1.0))
    sin, phi = np.sqrt(1.0 - cos**2), rng.uniform(0, 2 * np.pi, n)
    first = np.cross(axis, [0.0, 0.0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return sin[:, None] * (np.cos(phi)[:, None] * first + np.sin(phi)[:, None] * second) + cos[:, None] * axis


def expected_flux(planes: int, gamma: Array, exponent: float, axis: Array) -> Array:
    """Flux of each cell of a lobe of unit flux, by a fine midpoint rule over the cell; the poles summed over all planes."""
    step, sub = gamma[1] - gamma[0], 24
    fine = (np.arange(gamma.size * sub) + 0.5) * step / sub - step / 2
    c = (np.arange(planes * sub) + 0.5) * 360.0 / planes / sub - 180.0 / planes
    inside = (fine > 0) & (fine < 180)
    cosine = np.maximum(direction(c[:, None], fine) @ axis, 0.0)
    density = (exponent + 1) / (2 * np.pi) * cosine**exponent * np.sin(np.radians(fine)) * inside
    density *= np.radians(step / sub) * np.radians(360.0 / planes / sub)
    flux = density.reshape(planes, sub, gamma.size, sub).sum(axis=(1, 3))
    flux[0, [0, -1]] = flux[:, [0, -1]].sum(axis=0)
    flux[1:, [0, -1]] = 0.0
    return flux


@pytest.mark.parametrize(("exponent", "c", "gamma"), [(1.0, 20.0, 35.0), (30.0, 250.0, 4.0), (6.0, 101.0, 170.0)])
def test_a_leaning_lobe_cell_by_cell(exponent: float, c: float, gamma: float) -> None:
    """χ² of all cells together, at a significance of 1e-3; a table turned by half a cell would not pass."""
    n, planes, step = 400_000, 24, 7.5
    axis = direction(c, gamma)
    led = intensity_distribution(rays_of(leaning_lobe(n, exponent, axis, 5), np.full(n, 3.0 / n)), planes, step)
    share = expected_flux(planes, led.gamma, exponent, axis)
    assert share.sum() == pytest.approx(1.0, abs=2e-4)
    counts = led.values * cell_solid_angle(planes, led.gamma) * n / 3.0
    counts[1:, [0, -1]] = 0.0
    fit = n * share / share.sum()
    much = fit > 10
    statistic = ((counts - fit)[much] ** 2 / fit[much]).sum()
    assert statistic < chi2.isf(1e-3, much.sum())
    turned = np.roll(fit, 1, axis=0)
    assert ((counts - turned)[much] ** 2 / fit[much]).sum() > 3 * chi2.isf(1e-3, much.sum())


def test_error_bars_cover_the_truth() -> None:
    n, planes, step = 300_000, 24, 7.5
    axis = direction(20.0, 35.0)
    rng = np.random.default_rng(8)
    weights = rng.gamma(2.0, 0.5, n)  # rays of unequal flux
    led = intensity_distribution(rays_of(leaning_lobe(n, 2.0, axis, 6), weights), planes, step)
    truth = n * expected_flux(planes, led.gamma, 2.0, axis) / cell_solid_angle(planes, led.gamma)
    sure = (truth > 0) & (led.values > 20 * led.standard_error / 4)
    sure[1:, [0, -1]] = False
    z = ((led.values - truth) / led.standard_error)[sure]
    assert z.size > 200
    assert_covers(deviations=z)


def test_a_lambertian_source_as_a_function() -> None:
    rays = et.RingSource(rays=4_000_000, seed=2)
    led = et.intensity_distribution(rays, 8, 5)
    at = led.at([10.0, 130.0, 300.0], 40.0)
    assert np.allclose(at, rays.total_flux / np.pi * np.cos(np.radians(40)), rtol=0.02)
    assert led.flux == pytest.approx(rays.total_flux, rel=2e-3)
    assert led.at(0, 100) == 0


# --- every lumen once ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("planes", "step"), [(36, 2.5), (1, 90), (13, 11.25)])
def test_flux_closes_to_rounding_over_several_batches(planes: int, step: float) -> None:
    n = 600_000
    rng = np.random.default_rng(3)
    rays = rays_of(rng.normal(size=(n, 3)), rng.random(n), "W")
    seen: list[int] = []
    led = intensity_distribution(rays, planes, step, progress=seen.append)
    cells = led.values * cell_solid_angle(planes, led.gamma)
    assert cells[:, 1:-1].sum() + cells[0, [0, -1]].sum() == pytest.approx(rays.total_flux, rel=1e-12)
    assert seen[-1] == n
    assert len(seen) > 1
    assert (led.unit, led.quantity) == ("W/sr", "radiant intensity")
    assert f"{rays.total_flux:.7g} W" in " ".join(led.notes)


def test_far_field_sets_and_unusable_rays() -> None:
    records = np.zeros(4, dtype=[("direction", "<f4", (3,)), ("flux", "<f4")])
    records["direction"] = [[0, 0, 2], [0, 1, 0], [0, 0, 0], [np.nan, 0, 1]]
    records["flux"] = [1, 2, 4, 8]
    rays = et.RaySet.from_records(records, RaySetMeaning())
    assert not rays.has_position
    led = intensity_distribution(rays, 4, 45)
    omega = cell_solid_angle(4, led.gamma)
    assert np.allclose(led.values[:, 0] * omega[0], 1.0)
    assert led.values[1, 2] * omega[2] == pytest.approx(2.0)
    assert np.count_nonzero(led.values) == 5
    assert np.isnan(led.standard_error[0, 2])
    assert "2 others cannot be used" in led.notes[0]
    assert "15 of 20 nodes saw no ray" in led.notes[-1]


def test_no_flux_at_all() -> None:
    led = intensity_distribution(rays_of(direction([0.0, 5.0], [1.0, 90.0]), np.zeros(2)), 4, 45)
    assert (led.flux, led.maximum, led.symmetry()) == (0.0, 0.0, "rotational")


@pytest.mark.parametrize(
    ("planes", "step", "message"),
    [
        (0, 5, "c_planes"),
        (2.5, 5, "whole number"),
        (4, 0, "gamma_step"),
        (4, -5, "gamma_step"),
        (4, 7, "6.92307692°"),
        (4, 120, "gamma_step"),
        (4, float("nan"), "gamma_step"),
        (10**7, 0.1, "cells"),
    ],
)
def test_cells_that_are_none(planes: int, step: float, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Cells(planes, step)
