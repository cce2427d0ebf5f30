"""Filters of thesis 2.2.3 against loops written straight from eqs 2.5 and 2.6."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.comparison import compare
from etendue.luminance.filters import FILTERS, filter_map, kernel
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from oracles.light_fields import SURFACES, make_field
from scipy import ndimage, stats

Array = npt.NDArray[np.float64]
FIG_2_3_RIGHT = [[1, 2, 4, 2, 1], [2, 4, 8, 4, 2], [4, 8, 16, 8, 4], [2, 4, 8, 4, 2], [1, 2, 4, 2, 1]]
SIZES = [1, 3, 5, 7, (3, 5), (7, 1), (1, 3), (21, 31)]


def make_map(values: Any, error: Any = None, rays: Any = None, **fields: Any) -> LuminanceMap:
    values = np.asarray(values, dtype=float)
    error = 0.1 * values if error is None else error
    rays = np.where(np.isnan(values), 0, 10) if rays is None else rays
    height, width = values.shape
    screen = Screen(2.0 * width, 3.0 * height, width, height)
    return LuminanceMap(values, error, rays, Observer(20, 30, 500), screen, provenance=Provenance(), **fields)


def random_map(shape: tuple[int, int], seed: int, dead: float = 0.15) -> LuminanceMap:
    """Steps and noise without any symmetry, with dead pixels and rays that differ everywhere."""
    rng = np.random.default_rng(seed)
    base = np.where(np.add.outer(np.arange(shape[0]), 2 * np.arange(shape[1])) % 7 < 3, 100.0, 300.0)
    values = base * rng.gamma(20.0, 1 / 20.0, shape)
    values[rng.random(shape) < dead] = np.nan
    error = values * rng.uniform(0.05, 0.2, shape)
    return make_map(values, error, np.where(np.isnan(values), 0, rng.integers(1, 1000, shape)))


def weight(name: str, s: int, t: int) -> float:
    return 2.0 ** (-abs(s) - abs(t)) if "weighted" in name else 1.0


def smoothed_before(lmap: LuminanceMap) -> LuminanceMap:
    """The map as one whose pixels err together."""
    return lmap.replace(provenance=lmap.provenance.then("filter before"))


def by_hand(
    lmap: LuminanceMap, name: str, size: Any, gamma: float, power: int = 2
) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Eqs 2.5 and 2.6, pixel by pixel and neighbour by neighbour; errors add up to their `power`."""
    rows, columns = lmap.values.shape
    high, wide = (size, size) if isinstance(size, int) else size
    values, error, rays = (np.full(lmap.values.shape, np.nan) for _ in range(3))
    for x in range(rows):
        for y in range(columns):
            f = 0.0 if math.isnan(lmap.values[x, y]) else lmap.values[x, y]
            used = []
            for s in range(-(high // 2), high // 2 + 1):
                for t in range(-(wide // 2), wide // 2 + 1):
                    if not (0 <= x + s < rows and 0 <= y + t < columns):
                        continue
                    dead = math.isnan(lmap.values[x + s, y + t])
                    neighbour = 0.0 if dead else lmap.values[x + s, y + t]
                    if "selective" in name and not abs(neighbour - f) < gamma * f:
                        continue
                    sigma = 0.0 if dead else lmap.standard_error[x + s, y + t]
                    used.append((weight(name, s, t), neighbour, sigma, lmap.rays[x + s, y + t]))
            rays[x, y] = sum(u[3] for u in used)
            if rays[x, y] > 0:
                total = math.fsum(u[0] for u in used)
                values[x, y] = math.fsum(u[0] * u[1] for u in used) / total
                error[x, y] = math.fsum((u[0] * u[2]) ** power for u in used) ** (1 / power) / total
    return values, error, rays.astype(np.int64)


def test_the_registry_holds_the_four_filters_of_the_thesis() -> None:
    assert set(FILTERS) == {"average", "weighted", "selective", "selective-weighted"}
    assert all(name == kind.name for name, kind in FILTERS.items())


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", FILTERS)
def test_equals_the_loops(name: str, size: Any) -> None:
    lmap = random_map((7, 10), seed=3)
    for power, seen in ((2, lmap), (1, smoothed_before(lmap))):
        values, error, rays = by_hand(lmap, name, size, 0.35, power)
        filtered = filter_map(seen, name, size, gamma=0.35)
        np.testing.assert_allclose(filtered.values, values, rtol=1e-13)
        np.testing.assert_array_equal(filtered.rays, rays)
        # Errors of independent pixels that noise selects have no such formula.
        if power == 1 or "selective" not in name:
            np.testing.assert_allclose(filtered.standard_error, error, rtol=1e-13)


@pytest.mark.parametrize("name", FILTERS)
def test_equals_the_loops_across_bands(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bands that the selective filters work in leave no seam."""
    monkeypatch.setattr("etendue.luminance.filters.PIXELS_AT_ONCE", 20)
    lmap = smoothed_before(random_map((23, 9), seed=4))
    values, error, rays = by_hand(lmap, name, 7, 0.5, power=1)
    filtered = filter_map(lmap, name, 7, gamma=0.5)
    np.testing.assert_allclose(filtered.values, values, rtol=1e-13)
    np.testing.assert_allclose(filtered.standard_error, error, rtol=1e-13)
    np.testing.assert_array_equal(filtered.rays, rays)


@pytest.mark.parametrize("name", ["average", "weighted"])
def test_interior_equals_scipy(name: str) -> None:
    """Away from the border and without dead pixels a linear filter is a plain correlation."""
    lmap = random_map((40, 31), seed=5, dead=0.0)
    weights = np.array(FIG_2_3_RIGHT) / 100.0 if name == "weighted" else np.full((5, 5), 1 / 25)
    expected = ndimage.correlate(lmap.values, weights)[2:-2, 2:-2]
    np.testing.assert_allclose(filter_map(lmap, name).values[2:-2, 2:-2], expected, rtol=1e-13)


def test_kernels_are_the_printed_ones() -> None:
    """Fig. 2.3."""
    np.testing.assert_array_equal(kernel("average", 3), np.full((3, 3), 1 / 9))
    np.testing.assert_array_equal(kernel("weighted", 5), np.array(FIG_2_3_RIGHT) / 100.0)
    np.testing.assert_array_equal(kernel("selective-weighted", 5), kernel("weighted", 5))


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("size", [*SIZES, (2001, 2001)])
def test_a_constant_map_stays_constant(name: str, size: Any) -> None:
    filtered = filter_map(make_map(np.full((6, 4), 7.5)), name, size)
    np.testing.assert_allclose(filtered.values, 7.5, rtol=1e-14)


@pytest.mark.parametrize("name", ["selective", "selective-weighted"])
def test_the_selection_is_strict(name: str) -> None:
    """Eq. 2.6: a neighbour that differs by exactly γ f is left out. All the numbers here are exact in binary."""
    filtered = filter_map(make_map([[64.0, 80.0]]), name, 3, gamma=0.25)
    assert filtered.values[0, 0] == 64.0
    assert 64.0 < filtered.values[0, 1] < 80.0


@pytest.mark.parametrize("name", FILTERS)
def test_dead_pixels(name: str) -> None:
    """A dead pixel counts as 0; it revives in a linear filter only, and only if a ray came near it."""
    nan = np.nan
    lmap = make_map([[10.0, nan, nan, nan, nan]])
    filtered = filter_map(lmap, name, (1, 3))
    if name == "average":
        np.testing.assert_array_equal(filtered.values, [[5.0, 10.0 / 3, nan, nan, nan]])
    elif name == "weighted":
        np.testing.assert_array_equal(filtered.values, [[10.0 / 1.5, 2.5, nan, nan, nan]])
    else:
        np.testing.assert_array_equal(filtered.values, lmap.values)
    np.testing.assert_array_equal(np.isnan(filtered.standard_error), np.isnan(filtered.values))
    assert (filtered.rays[np.isnan(filtered.values)] == 0).all()


@pytest.mark.parametrize("name", FILTERS)
def test_a_map_without_any_ray_stays_dead(name: str) -> None:
    filtered = filter_map(make_map(np.full((3, 4), np.nan)), name)
    assert filtered.dead_pixels == 12
    assert filtered.notes[0].endswith("intensity 0 → 0 cd; dead pixels 12 → 12")


@pytest.mark.parametrize("name", ["selective", "selective-weighted"])
@pytest.mark.parametrize("gamma", [0.2, 3.0])
def test_a_dark_pixel_keeps_its_value(name: str, gamma: float) -> None:
    """Eq. 2.6 selects nothing around a pixel of 0 cd/m², not even itself."""
    filtered = filter_map(make_map([[0.0, 5.0, 0.0]]), name, 3, gamma=gamma)
    assert filtered.values[0, 0] == 0.0
    assert filtered.rays[0, 0] == 10
    # Also its error: what is known of a dark pixel to 3 is not known exactly.
    noisy = make_map([[0.0, 5.0, -1.0]], np.array([[3.0, 0.5, 2.0]]))
    assert filter_map(noisy, name, 3, gamma=gamma).standard_error[0, ::2].tolist() == [3.0, 2.0]


def test_unknown_errors_and_counts_spread_to_those_who_use_them() -> None:
    values = np.array([[100.0, 100.0, 100.0, 900.0, 900.0]])
    error = np.array([[np.nan, 1.0, 1.0, 1.0, np.nan]])
    rays = np.array([[-1, 5, 6, 7, -1]])
    linear = filter_map(make_map(values, error, rays), "average", (1, 3))
    np.testing.assert_array_equal(np.isnan(linear.standard_error), [[True, True, False, True, True]])
    np.testing.assert_array_equal(linear.rays, [[-1, -1, 18, -1, -1]])
    selective = filter_map(make_map(values, error, rays), "selective", (1, 3))
    np.testing.assert_array_equal(np.isnan(selective.standard_error), [[True, True, False, True, True]])
    np.testing.assert_array_equal(selective.rays, [[-1, -1, 11, -1, -1]])
    # Of two pixels that each contribute an error of 1: √½, seen in 24 draws, at 1e-6 of χ²(23).
    low, high = np.sqrt(0.5 * stats.chi2.ppf([0.5e-6, 1 - 0.5e-6], 23) / 23)
    assert low < selective.standard_error[0, 2] < high


@pytest.mark.parametrize("name", ["average", "weighted"])
def test_propagated_errors_are_right(name: str) -> None:
    """4000 noisy tiles: variance of g over variance claimed, each pixel χ²(3999), Bonferroni over pixels at 1e-6.

    The tiles lie one below the other in one map, twice as high as the kernel, so that no two pixels in the same place of two
    tiles have a neighbour in common. What errors are at the top and the bottom of a map, loops tell elsewhere.
    """
    rng = np.random.default_rng(11)
    truth = rng.uniform(50.0, 400.0, (6, 5))
    sigma = truth * rng.uniform(0.02, 0.1, truth.shape)
    n = 4000
    values, errors = (np.tile(tile, (n + 2, 1)) for tile in (truth, sigma))
    found = filter_map(make_map(values + errors * rng.normal(size=errors.shape), errors), name, (3, 5))
    seen, stated = (table.reshape(n + 2, 6, 5)[1:-1] for table in (found.values, found.standard_error))
    claimed = stated[0]
    np.testing.assert_allclose(stated, np.broadcast_to(claimed, stated.shape), rtol=1e-12)
    statistic = (n - 1) * seen.var(axis=0, ddof=1) / claimed**2
    tail = 0.5e-6 / truth.size
    low, high = stats.chi2.ppf([tail, 1 - tail], n - 1)
    assert high / (n - 1) < 1.13
    assert ((statistic > low) & (statistic < high)).all()


@pytest.mark.parametrize("name", ["average", "weighted"])
def test_errors_that_pixels_share_stay_as_they_are(name: str) -> None:
    """If all pixels of a map are off by the same, a mean of them is off by as much, however often it is filtered."""
    shared = make_map(np.full((7, 9), 110.0), np.full((7, 9), 10.0), np.full((7, 9), -1))
    once = filter_map(shared, name)
    np.testing.assert_allclose(once.standard_error, 10.0, rtol=1e-13)
    assert "err together" in once.notes[-1]
    apart = filter_map(shared.replace(rays=np.full((7, 9), 9)), name)
    assert (apart.standard_error < 7.0).all()
    twice = filter_map(apart, name)
    np.testing.assert_allclose(twice.standard_error, filter_map(apart.replace(rays=shared.rays), name).standard_error)


@pytest.mark.parametrize("name", ["weighted", "selective"])
def test_what_all_pixels_err_by_stays(name: str) -> None:
    """Maps that are 4 % too bright or too dark as a whole, each beside 1 % noise of its pixels: z values of the mean.

    The sum of z² over 60 maps is χ²(60), at 1e-6 on both sides; errors that a mean makes less would be a third of it.
    """
    rng = np.random.default_rng(21)
    truth, common, own = np.full((7, 8), 300.0), 0.04, 0.01
    z = []
    for _ in range(60):
        values = truth * (1.0 + common * rng.normal()) * (1.0 + own * rng.normal(size=truth.shape))
        noisy = make_map(values, math.hypot(common, own) * values, common_error=common)
        filtered = filter_map(noisy, name, 3)
        z.append((filtered.values[3, 4] - 300.0) / filtered.standard_error[3, 4])
        assert filtered.common_error == common
    low, high = stats.chi2.ppf([0.5e-6, 1 - 0.5e-6], 60)
    assert low < (np.array(z) ** 2).sum() < high


def test_pixels_of_a_light_field_err_together() -> None:
    field = make_field(SURFACES["plane"], seed=8, cells=(4, 4, 4, 4))
    seen = et.luminance_map(field, Observer(25, 0, 1000), Screen(1, 1, 3, 3))
    assert "err together" in filter_map(seen, "average").notes[-1]


def test_what_a_light_field_in_a_scene_does_not_know_stays() -> None:
    """The same pixels by lines of sight through a scene and from the field in it: one error, which no mean makes less.

    Where a line of sight meets the surface is drawn, so that the two differ by a hundredth.
    """
    field = make_field(SURFACES["plane"], seed=8, cells=(4, 4, 4, 4))
    eye, screen = Observer(25, 0, 1000), Screen(1, 1, 6, 6)
    direct = et.luminance_map(field, eye, screen)
    scene = et.Scene(sources=[{"kind": "light-field", "field": field}])
    seen = et.luminance_map(scene, eye, screen, rays_per_pixel=256, seed=1)
    assert seen.common_error == pytest.approx(direct.relative_error.flux_weighted, rel=0.02)  # type: ignore[union-attr]
    for smooth in (filter_map(seen, "average"), et.denoise_map(seen)):
        assert smooth.relative_error.flux_weighted > 0.9 * seen.common_error  # type: ignore[union-attr]
    assert "in common, of which means take nothing" in filter_map(seen, "average").notes[-1]


SLOPE = np.add.outer(np.arange(40), 2 * np.arange(36))


@pytest.mark.parametrize(("name", "rays"), [("selective", 5), ("selective-weighted", 30), ("selective", 200)])
def test_selective_errors_hold_what_selection_does(name: str, rays: int) -> None:
    """Maps of counts, drawn 12 times: the scatter of g from map to map against the errors that each map claims.

    γ = 0.2 beside 45 %, 18 % and 7 % noise, on a slope with a step. The mean square of the claims over all pixels is that of
    the scatter, between it and 1.3 times it: a t value for each bound, of the 12 differences, at 1e-6. The errors of eq.
    18, of pixels once selected, are four times too small in the square.
    """
    rng = np.random.default_rng(12)
    truth = rays * np.where(SLOPE % 31 < 15, 0.6, 1.4) * (1.0 + 0.002 * SLOPE)
    drawn = [rng.poisson(truth) for _ in range(12)]
    maps = [make_map(np.where(k > 0, k, np.nan), np.where(k > 0, np.sqrt(k), np.nan), k) for k in drawn]
    filtered = [filter_map(lmap, name) for lmap in maps]
    values = np.array([np.nan_to_num(one.values) for one in filtered])
    scatter = ((values - values.mean(axis=0)) ** 2).mean(axis=(1, 2)) * 12 / 11
    claimed = np.array([np.mean(np.nan_to_num(one.standard_error) ** 2) for one in filtered])
    limit = stats.t.ppf(1 - 1e-6, 11)
    for low, high in ((scatter, claimed), (claimed, 1.3 * scatter)):
        difference = high - low
        assert difference.mean() > -limit * difference.std(ddof=1) / math.sqrt(12)
    assert "by selecting the pixels that are averaged, found on 24 maps" in filtered[0].notes[1]
    assert "optimistic" in filter_map(smoothed_before(maps[0]), name).notes[-1]


def test_the_noise_of_pixels_that_are_dark_reaches_those_who_use_them() -> None:
    """(8 ± 0) beside (0 ± 4) in a window that takes both: 2 for each mean of two; at 1e-6 of χ²(23)."""
    filtered = filter_map(make_map([[8.0, 0.0]], np.array([[1e-9, 4.0]])), "selective", (1, 3), gamma=3.0)
    low, high = 2.0 * np.sqrt(stats.chi2.ppf([0.5e-6, 1 - 0.5e-6], 23) / 23)
    assert low < filtered.standard_error[0, 0] < high
    assert filtered.standard_error[0, 1] == 4.0


def test_a_map_that_is_exact_stays_exact() -> None:
    """Where there is no noise none is drawn, whatever a filter blurs."""
    exact = make_map(1.0 + SLOPE, np.zeros(SLOPE.shape))
    assert (filter_map(exact, "selective", gamma=0.5).standard_error == 0.0).all()


@pytest.mark.parametrize("name", FILTERS)
def test_flux_before_and_after_is_told(name: str) -> None:
    lmap = make_map([[100.0, 119.0, 90.0]], notes=("first",))
    filtered = filter_map(lmap, name, 3)
    label = f"{name} 3×3" + (", γ = 0.2" if "selective" in name else "")
    change = f"{100 * (filtered.intensity / lmap.intensity - 1):+.2f} %".replace("-", "−")
    assert filtered.notes[0] == "first"
    assert filtered.notes[1] == f"{label}: intensity {lmap.intensity:.4g} → {filtered.intensity:.4g} cd ({change})"
    assert filtered.provenance.steps == (*lmap.provenance.steps, f"filter {label}")


def test_radiance_maps_say_watts() -> None:
    assert "W/sr" in filter_map(make_map([[1.0, 2.0]], flux_unit="W"), "average").notes[0]


def test_the_map_itself_is_not_changed() -> None:
    lmap = random_map((5, 6), seed=6)
    before = lmap.values.copy()
    filter_map(lmap, "selective")
    np.testing.assert_array_equal(lmap.values, before)


@pytest.mark.parametrize("size", [0, -3, 2, 4.0, "5", (3,), (3, 4), (3, 3, 3), None])
def test_sizes_that_are_not_odd_numbers_are_refused(size: Any) -> None:
    with pytest.raises(ArgumentError, match="odd number"):
        filter_map(make_map([[1.0]]), "average", size)


@pytest.mark.parametrize("name", FILTERS)
def test_a_kernel_beyond_the_map_costs_nothing(name: str) -> None:
    """Of a size that no memory holds, the map has what the smallest kernel that reaches everywhere gives."""
    lmap = random_map((4, 6), seed=9)
    whole, beyond = filter_map(lmap, name, (7, 11)), filter_map(lmap, name, 10**14 + 1)
    np.testing.assert_array_equal(beyond.values, whole.values)
    np.testing.assert_array_equal(beyond.standard_error, whole.standard_error)
    assert f"{10**14 + 1}×" in beyond.notes[0]


@pytest.mark.parametrize("gamma", [0.0, -0.1, math.nan, math.inf, "0.2", None])
def test_gamma_outside_its_domain_is_refused(gamma: Any) -> None:
    with pytest.raises(ArgumentError, match="gamma"):
        filter_map(make_map([[1.0]]), "selective", gamma=gamma)


@pytest.mark.parametrize("function", [lambda name: filter_map(make_map([[1.0]]), name), kernel])
def test_unknown_names_get_a_suggestion(function: Any) -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'selective-weighted'"):
        function("selective-weigthed")


ZONES = (303964.0, 67547.0, 20264.0)
"""Luminance of the three rings of thesis 2.3 [cd/m²], out to radii of 10, 20 and 30 mm."""


def ring_truth(screen: Screen, finer: int = 16) -> Array:
    """Mean luminance of every pixel over the rings, by a finer grid."""
    x, y = (
        np.repeat(centres, finer) + np.tile((np.arange(finer) + 0.5) / finer - 0.5, len(centres)) * pitch
        for centres, pitch in ((screen.x, screen.width / screen.columns), (screen.y, screen.height / screen.rows))
    )
    squared_radius = np.add.outer(y**2, x**2)
    fine = np.select([squared_radius < edge**2 for edge in (10.0, 20.0, 30.0)], ZONES, 0.0)
    return fine.reshape(screen.rows, finer, screen.columns, finer).mean(axis=(1, 3))


@pytest.mark.parametrize(
    ("name", "ncc", "nrmse_thesis", "zone_errors"),
    [
        (None, 99.75, 0.786, (4.7, 10.1, 18.1)),
        ("average", 99.01, 0.983, (7.5, 19.7, 16.2)),
        ("weighted", 99.46, 0.751, (5.0, 13.5, 11.6)),
        ("selective", 99.93, 0.451, (1.0, 4.8, 13.9)),
        ("selective-weighted", 99.92, 0.499, (1.3, 5.9, 15.1)),
    ],
)
def test_the_rings_of_the_thesis(name: str | None, ncc: float, nrmse_thesis: float, zone_errors: Any) -> None:
    """Filters and measures together, against the numbers of another program for the same experiment [%].

    1.4e9 rays of equal flux, a cone of 1.5°, 128 x 128 pixels: 453 rays in a pixel of zone 1. Its numbers come from
    one random map; ours are the mean of four, whose spread is 2 % of the NRMSE and 4 % of the zone errors.
    """
    screen = Screen(70, 70, 128, 128, "xy")
    truth = ring_truth(screen)
    reference = make_map(truth).replace(screen=screen, observer=Observer(0, 0, 150))
    flux_per_ray = ZONES[0] / 453.0
    found = []
    for seed in range(4):
        rays = np.random.default_rng(seed).poisson(truth / flux_per_ray)
        values = np.where(rays > 0, rays * flux_per_ray, np.nan)
        noisy = reference.replace(values=values, standard_error=np.full(rays.shape, np.nan), rays=rays)
        test = filter_map(noisy, name) if name else noisy
        result = compare(test, reference)
        errors = [np.sqrt(np.mean((np.nan_to_num(test.values[truth == zone]) / zone - 1) ** 2)) for zone in ZONES]
        found.append([result.ncc, result.nrmse_thesis, *errors])
    mean = 100 * np.mean(found, axis=0)
    assert mean[0] == pytest.approx(ncc, abs=0.011)
    assert mean[1] == pytest.approx(nrmse_thesis, rel=0.04)
    assert mean[2:] == pytest.approx(zone_errors, rel=0.06, abs=0.06)


def test_a_smoothed_map_does_not_count_the_pixels_that_were_dead_before() -> None:
    """The cone's note is true of its own map; what a filter leaves dead, the filter's note says."""
    observer, screen = Observer(0, 0, 150), Screen(70, 70, 16, 16)
    noisy = et.luminance_map(et.RingSource(rays=200_000), observer, screen, method="cone")
    dead = int(np.isnan(noisy.values).sum())
    assert f"{dead} of 256 pixels are dead (no ray): NaN" in noisy.notes
    assert dead > 0
    for smooth in (filter_map(noisy, "average", 5), et.denoise_map(noisy)):
        assert not any("(no ray): NaN" in note for note in smooth.notes)
        assert set(smooth.notes) >= {note for note in noisy.notes if "dead" not in note}
