"""Étendue counts against a plain statement in numpy, with the coordinates worked out anew."""

from __future__ import annotations

import warnings

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.counting import PartGrids, count_rays


def concentric(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The square's coordinates of points of the unit disk, by polar angles: sector by sector of the concentric map."""
    r, phi = np.hypot(p, q), np.arctan2(q, p)
    phi = np.where(phi < -np.pi / 4, phi + 2 * np.pi, phi)
    sector = np.clip((phi + np.pi / 4) // (np.pi / 2), 0, 3)
    within = (phi - sector * np.pi / 2) * 4 / np.pi
    a = np.select([sector == 0, sector == 1, sector == 2], [r, -r * within, -r], r * within)
    b = np.select([sector == 0, sector == 1, sector == 2], [r * within, r, -r * within], -r)
    return np.column_stack([a, b]) / 2 + 0.5


def rays_of(n: int, weights: np.ndarray | None = None) -> et.RaySet:
    rng = np.random.default_rng(5)
    x = np.column_stack([rng.normal(0.3, 0.6, n), rng.normal(-0.1, 0.4, n), rng.uniform(-1, 2, n)])
    k = rng.normal(size=(n, 3)) * [0.5, 0.7, 1.0]
    k[:, 2] = np.where(rng.random(n) < 0.05, -1, 1) * np.abs(k[:, 2])
    return et.RaySet(x, k, np.ones(n) if weights is None else weights)


@pytest.mark.parametrize("weighted", [False, True])
def test_a_plane_holds_what_numpy_counts(weighted: bool) -> None:
    n = 60_000
    w = np.random.default_rng(6).uniform(0.5, 2, n) if weighted else np.full(n, 0.25)
    rays = rays_of(n, w)
    plane = et.Plane(z=0.2, width=3, height=2, centre=(0.3, 0.1))
    counts = count_rays(rays, plane, PartGrids((2, 3, 2, 1), (4, 3)), held_out=0.2)
    x, k = rays.position, rays.direction
    hit = x + ((0.2 - x[:, 2]) / k[:, 2])[:, None] * k
    s = (hit[:, :2] - [0.3, 0.1]) / [3, 2] + 0.5
    met = (k[:, 2] > 0) & ((s >= 0) & (s <= 1)).all(axis=1)
    z = np.column_stack([s, concentric(k[:, 0], k[:, 1])])[met]
    expected, _ = np.histogramdd(z, bins=(4, 8, 4, 2), range=[(0, 1)] * 4, weights=w[met])
    fine, _ = np.histogramdd(z[:, 2:], bins=(8, 8), range=[(0, 1)] * 2, weights=w[met])
    scale = counts.flux_per_weight
    np.testing.assert_allclose(counts["all"][0].grid.weight * scale, expected, atol=1e-9)
    np.testing.assert_allclose(counts["all"][0].direction.weight * scale, fine, atol=1e-9)
    assert counts.unmet_rays == (~met).sum() > 0
    assert counts.unmet_flux == pytest.approx(w[~met].sum(), rel=1e-12)
    assert (counts["all"][0].grid.squared is None) is not weighted
    if weighted:
        squares, _ = np.histogramdd(z, bins=(4, 8, 4, 2), range=[(0, 1)] * 4, weights=w[met] ** 2)
        np.testing.assert_allclose(counts["all"][0].grid.squared, squares, atol=1e-9)
    share = counts["held out"][0].grid.weight.sum() / counts["all"][0].grid.weight.sum()
    assert abs(share - 0.2) < 4 * np.sqrt(0.16 / met.sum()) * 1.5
    np.testing.assert_allclose(
        counts["fitted"][0].grid.weight + counts["held out"][0].grid.weight, counts["all"][0].grid.weight
    )


def test_parts_share_the_rays_and_nothing_is_lost() -> None:
    rays = rays_of(30_000)
    counts = count_rays(rays, et.Dome(radius=1.5, window=0.8), PartGrids((2, 2, 2, 2)))
    assert sum(counts.part_flux) + counts.unmet_flux == pytest.approx(rays.total_flux, rel=1e-12)
    assert all(flux > 0 for flux in counts.part_flux)
    assert counts.some_held_out.coordinates.shape == (len(counts.some_held_out.part), 4)


def test_kept_rays_are_held_out_rays() -> None:
    rays = rays_of(50_000)
    counts = count_rays(rays, et.Disk(radius=2), PartGrids((2, 2, 2, 2)), held_out=0.1)
    kept, _ = np.histogramdd(counts.some_held_out.coordinates, bins=(4,) * 4, range=[(0, 1)] * 4)
    np.testing.assert_array_equal(kept, counts["held out"][0].grid.weight)


def test_the_scale_of_relative_fluxes_is_that_of_the_set() -> None:
    rays = rays_of(1000)
    half = rays.thin(2, seed=1)[0] if hasattr(rays, "thin") else rays
    counts = count_rays(half, et.Sphere(radius=30), PartGrids((1, 1, 1, 1)))
    assert sum(counts.part_flux) == pytest.approx(half.total_flux, rel=1e-12)


def test_bits_do_not_depend_on_threads() -> None:
    rays = rays_of(200_000, np.random.default_rng(7).uniform(1, 2, 200_000))
    one, seven = (count_rays(rays, et.Dome(radius=1.5), PartGrids((3, 3, 3, 3)), threads=t) for t in (1, 7))
    for a, b in zip(one["all"], seven["all"], strict=True):
        assert a.grid.weight.tobytes() == b.grid.weight.tobytes()
    assert one.unmet_flux == seven.unmet_flux


def test_what_cannot_be_counted_is_refused() -> None:
    rays = rays_of(100)
    with pytest.raises(ArgumentError, match="depths"):
        count_rays(rays, et.Disk(radius=1), PartGrids((9, 9, 9, 9)))
    with pytest.raises(ArgumentError, match="none of 100 rays meets"):
        count_rays(rays, et.Plane(z=1e6, width=1e-3, height=1e-3, centre=(0, 0)), PartGrids((2, 2, 2, 2)))
    broken = et.RaySet([[0, 0, 0], [np.nan, 0, 0]], [[0, 0, 1], [0, 0, 1.0]], [1.0, 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert count_rays(broken, et.Disk(radius=1), PartGrids((1, 1, 1, 1))).rays == 1


@pytest.mark.slow
def test_rays_without_flux_change_nothing() -> None:
    """As many dark rays behind the others: the same field with the same errors, and the same number of rays."""
    lit = rays_of(6000)
    position, direction = np.tile(lit.position, (2, 1)), np.concatenate([lit.direction, -lit.direction])
    both = et.RaySet(position, direction, np.append(lit.flux, np.zeros(6000)))
    fields = [
        et.LightField.fit(rays, et.Plane(z=0, width=9, height=9, centre=(0, 0)), depths=(3, 3, 2, 2))
        for rays in (lit, both)
    ]
    assert [field.report.rays for field in fields] == [6000, 6000]
    for one, other in zip(fields[0].parts, fields[1].parts, strict=True):
        assert one.ratio.tobytes() == other.ratio.tobytes()
        assert one.deviation.tobytes() == other.deviation.tobytes()
