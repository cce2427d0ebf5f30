"""The cone estimator against closed forms, quadrature, and a plain statement of eqs. 2.2 to 2.4."""

from __future__ import annotations

import warnings

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.cone import cone_solid_angle
from etendue.quantities.ray_records import RaySetMeaning
from oracles.cone import plain_statement
from oracles.quadrilateral import Quadrilateral
from scipy import stats

OBSERVERS = [(60.0, 0.0), (60.0, 90.0), (35.0, 210.0)]


@pytest.fixture(scope="module")
def unequal_rays() -> et.RaySet:
    """Rays of unequal flux from an asymmetric cloud, heading mostly upwards."""
    rng = np.random.default_rng(5)
    n = 200_000
    position = rng.normal((1.0, -2.0, 0.5), (3.0, 2.0, 0.7), (n, 3))
    direction = rng.normal((0.3, 0.2, 1.0), (0.6, 0.5, 0.4), (n, 3))
    return et.RaySet(position, direction, rng.exponential(1.0, n))


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["view", "xy"])
@pytest.mark.parametrize(("theta", "phi"), [*OBSERVERS, (0.0, 0.0), (5.0, 300.0), (120.0, 45.0)])
def test_equals_the_equations_ray_by_ray(unequal_rays: et.RaySet, theta: float, phi: float, plane: str) -> None:
    observer = et.Observer(theta, phi, 40.0, target=(0.5, -1.0, 0.25))
    screen = et.Screen(9.0, 7.0, 6, 5, plane)
    lmap = et.luminance_map(unequal_rays, observer, screen, method="cone", acceptance=11.0)
    luminance, error, count = plain_statement(unequal_rays, observer, screen, 11.0)
    np.testing.assert_array_equal(lmap.rays, count)
    assert theta > 90 or count.min() > 0
    live = count > 0
    np.testing.assert_allclose(lmap.values[live], luminance[live], rtol=1e-11)
    np.testing.assert_allclose(lmap.standard_error[live], error[live], rtol=1e-11)
    assert np.isnan(lmap.values[~live]).all()
    assert lmap.dead_pixels == (~live).sum()


@pytest.fixture(scope="module")
def quadrilateral_rays() -> et.RaySet:
    return Quadrilateral().rays(2_000_000, seed=20)


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["view", "xy"])
@pytest.mark.parametrize(("theta", "phi"), OBSERVERS)
def test_every_pixel_of_a_tilted_quadrilateral_is_in_its_place(
    quadrilateral_rays: et.RaySet, theta: float, phi: float, plane: str
) -> None:
    """Luminance against the exact expectation by quadrature: χ² at 1e-4, and no ray where none can be."""
    source, acceptance = Quadrilateral(), 2.0
    observer, screen = et.Observer(theta, phi, 200.0, target=(1.0, -1.0, 0.0)), et.Screen(16.0, 14.0, 16, 14, plane)
    lmap = et.luminance_map(quadrilateral_rays, observer, screen, method="cone", acceptance=acceptance)
    expected = source.cone_expectation(observer, screen, acceptance=acceptance)
    apparent = screen.pixel_area * 1e-6 * screen.cosine(observer)
    # What one ray adds to a pixel: with it, luminance is a Poisson count.
    one = source.flux / len(quadrilateral_rays) / (apparent * cone_solid_angle(acceptance))
    counts = expected / one
    enough = counts > 5
    assert enough.sum() > 25
    np.testing.assert_allclose(lmap.values[lmap.rays > 0], (lmap.rays * one)[lmap.rays > 0], rtol=1e-9)
    chi2 = float(((lmap.values / one - counts)[enough] ** 2 / counts[enough]).sum())
    p = stats.chi2.sf(chi2, int(enough.sum()))
    assert p > 1e-4, f"chi2 = {chi2:.1f} with {enough.sum()} pixels, p = {p:.2g}"
    assert lmap.rays[counts == 0].sum() == 0
    assert (counts == 0).sum() > 25


@pytest.fixture(scope="module")
def ring_map() -> et.LuminanceMap:
    source = et.RingSource(rays=28_000_000, seed=7)
    return et.luminance_map(source, et.Observer(0, 0, 150), et.Screen(70, 70, 32, 32), method="cone")


def inside(lmap: et.LuminanceMap, inner: float, outer: float) -> npt.NDArray[np.bool_]:
    """Pixels that lie wholly in a ring."""
    screen = lmap.screen
    half = np.hypot(screen.width / screen.columns, screen.height / screen.rows) / 2
    r = np.hypot(screen.x[None, :], screen.y[:, None])
    return (r + half < outer) & ((r - half > inner) | (inner == 0))


@pytest.mark.slow
def test_each_ring_has_its_luminance(ring_map: et.LuminanceMap) -> None:
    """303 964, 67 547 and 20 264 cd/m² (eq. 2.9), times (1 + cos α)/2; three standard errors."""
    for inner, outer, truth in ((0, 10, 303_963.55), (10, 20, 67_547.46), (20, 30, 20_264.24)):
        ring = inside(ring_map, inner, outer)
        mean = ring_map.values[ring].mean()
        error = np.sqrt((ring_map.standard_error[ring] ** 2).sum()) / ring.sum()
        assert abs(mean - truth * (1 + np.cos(np.radians(1.5))) / 2) < 3 * error
        assert error < 0.02 * truth


@pytest.mark.slow
def test_the_error_bars_cover(ring_map: et.LuminanceMap) -> None:
    """Share of pixels within one standard error against its exact value for Poisson counts; binomial, two-sided 1e-3."""
    hits, expected, variance = 0, 0.0, 0.0
    solid_angle, area = cone_solid_angle(1.5), ring_map.screen.pixel_area * 1e-6
    fluxes = [300 / 6_000_000, 200 / 12_000_000, 100 / 10_000_000]
    cosine = ring_map.screen.cosine(ring_map.observer)
    truths = (303_963.55, 67_547.46, 20_264.24)
    for (inner, outer), truth, flux in zip(((0, 10), (10, 20), (20, 30)), truths, fluxes, strict=True):
        ring = inside(ring_map, inner, outer)
        mean = truth * (1 + np.cos(np.radians(1.5))) / 2
        hits += int((np.abs(ring_map.values - mean) <= ring_map.standard_error)[ring].sum())
        for mu in (mean * solid_angle * area * cosine[ring] / flux).ravel():
            n = np.arange(int(mu + 12 * np.sqrt(mu) + 20))
            p = stats.poisson.pmf(n, mu)[np.abs(n - mu) <= np.sqrt(n)].sum()
            expected += p
            variance += p * (1 - p)
    assert abs(hits - expected) < stats.norm.isf(5e-4) * np.sqrt(variance), (hits, expected)
    assert 0.6 < expected / sum(inside(ring_map, a, b).sum() for a, b in ((0, 10), (10, 20), (20, 30))) < 0.72


def test_moving_origins_along_the_rays_changes_nothing(unequal_rays: et.RaySet) -> None:
    """V13: the same rays are seen, bit for bit the same sums, wherever on their lines the rays start."""
    shift = np.random.default_rng(8).uniform(-300, 300, len(unequal_rays))
    moved = et.RaySet(
        unequal_rays.position + shift[:, None] * unequal_rays.direction, unequal_rays.direction, unequal_rays.flux
    )
    for plane in ("view", "xy"):
        args = et.Observer(35, 210, 60), et.Screen(20, 20, 40, 40, plane)
        a = et.luminance_map(unequal_rays, *args, method="cone", acceptance=4)
        b = et.luminance_map(moved, *args, method="cone", acceptance=4)
        assert a.rays.sum() > 100
        np.testing.assert_array_equal(a.rays, b.rays)
        np.testing.assert_allclose(a.values, b.values, rtol=1e-12)


def test_one_two_and_seven_threads_give_the_same_bits(unequal_rays: et.RaySet) -> None:
    def run(threads: int) -> bytes:
        args = [et.Observer(20, 100, 60), et.Observer(0, 0, 60)], et.Screen(20, 20, 40, 40)
        maps = et.luminance_map(unequal_rays, *args, acceptance="auto", threads=threads)
        return b"".join(m.values.tobytes() + m.standard_error.tobytes() for m in maps)

    assert run(1) == run(2) == run(7)


def test_many_observers_in_one_pass_equal_one_at_a_time(unequal_rays: et.RaySet) -> None:
    observers = [et.Observer(t, p, 80) for t, p in OBSERVERS]
    screens = [et.Screen(9, 7, 6, 5), et.Screen(12, 7, 3, 9, "xy"), et.Screen(20, 20, 10, 10)]
    together = et.luminance_map(unequal_rays, observers, screens, method="cone", acceptance=6)
    for observer, screen, lmap in zip(observers, screens, together, strict=True):
        alone = et.luminance_map(unequal_rays, observer, screen, method="cone", acceptance=6)
        np.testing.assert_array_equal(alone.values, lmap.values)
        assert lmap.observer == observer
        assert lmap.screen == screen


def test_a_hemisphere_of_acceptance_collects_the_flux() -> None:
    """α = 90° around the normal of a screen larger than the source sees every ray: Σ w = Φ, by eq. 2.4 read backwards."""
    rays = Quadrilateral().rays(100_000, seed=3).propagated_to_plane((0, 0, 0))
    screen = et.Screen(1e6, 1e6, 1, 1)
    lmap = et.luminance_map(rays, et.Observer(0, 0, 1e9), screen, method="cone", acceptance=90)
    upward = rays.direction[:, 2] > 1e-6
    on_screen = upward & (np.abs(rays.position[:, :2]).max(axis=1) < 5e5)
    flux = lmap.values[0, 0] * 2 * np.pi * screen.pixel_area * 1e-6
    assert flux == pytest.approx(rays.flux[on_screen].sum(), rel=1e-9)


def test_rays_in_watts_make_a_radiance_map() -> None:
    rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [2.0], flux_unit="W")
    lmap = et.luminance_map(rays, et.Observer(0, 0, 100), et.Screen(2, 2, 1, 1), method="cone")
    assert (lmap.unit, lmap.quantity) == ("W/(m² sr)", "radiance")
    assert lmap.values[0, 0] == pytest.approx(2.0 / (cone_solid_angle(1.5) * 4e-6), rel=1e-12)
    assert lmap.standard_error[0, 0] == lmap.values[0, 0]


def test_relative_fluxes_are_scaled_to_the_declared_total() -> None:
    """The scale is found in the same pass as the map; a disagreement is a warning with both numbers."""
    base = Quadrilateral().rays(20_000, seed=4)
    relative = base.replace(declared_flux=337.0, header={"total_flux": 337.0})
    args = et.Observer(10, 20, 300), et.Screen(16, 14, 4, 4)
    with pytest.warns(UserWarning, match=r"337 lm, the rays sum to 0\.77915"):
        scaled = et.luminance_map(relative, *args, method="cone", acceptance=10)
    absolute = et.luminance_map(base, *args, method="cone", acceptance=10)
    np.testing.assert_allclose(scaled.values, absolute.values * 337.0 / base.total_flux, rtol=1e-12)
    assert relative.total_flux == 337.0


def test_rays_without_flux_are_no_evidence() -> None:
    rays = et.RaySet([[0, 0, 0], [0.5, 0, 0]], [[0, 0, 1], [0, 0, 1]], [0.0, 1.0])
    lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(2, 2, 2, 1), method="cone")
    assert lmap.rays.tolist() == [[0, 1]]
    assert lmap.dead_pixels == 1


def test_copies_of_a_ray_are_one_ray() -> None:
    """Rays that a set holds 0 to 9 times, in another order, are the same light as each of them once with all the flux."""
    rng = np.random.default_rng(8)
    once = et.RingSource(rays=20_000, seed=3).ray_set()
    order = rng.permutation(np.repeat(np.arange(20_000), rng.poisson(3.0, 20_000)))
    times = np.bincount(order, minlength=20_000)
    same = et.RaySet(once.position, once.direction, once.flux * times)
    again = et.RaySet(once.position[order], once.direction[order], once.flux[order])
    place = et.Observer(20, 30, 200), et.Screen(60, 60, 5, 5)
    for method in ("cone", et.Cone(acceptance=6), et.Cone(observer_radius=20)):
        expected, found = (et.luminance_map(rays, *place, method=method) for rays in (same, again))
        assert found.values == pytest.approx(expected.values, rel=1e-9, nan_ok=True)
        assert found.standard_error == pytest.approx(expected.standard_error, rel=1e-9, nan_ok=True)
        assert (found.rays == expected.rays).all()
        assert sum("repeat another one" in note for note in found.notes) == 1
    assert not any("repeat" in note for note in expected.notes)


def test_rays_that_cannot_be_used_are_counted_in_the_notes() -> None:
    rays = et.RaySet([[0, 0, 0]] * 3, [[0, 0, 1], [0, 0, 0], [0, 0, 1]], [1.0, 1.0, np.nan])
    with pytest.warns(UserWarning, match="1 of 3 rays"):
        lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(2, 2, 1, 1), method="cone")
    assert lmap.rays.sum() == 1
    assert any("2 rays cannot be used" in note for note in lmap.notes)


def test_refusals_say_what_to_do() -> None:
    rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0])
    front, screen = et.Observer(0, 0, 1000), et.Screen(2, 2, 1, 1)
    with pytest.raises(UnknownNameError, match="Did you mean 'cone'"):
        et.luminance_map(rays, front, screen, method="cones")  # type: ignore[call-overload]
    for bad in (0.0, -1.0, 90.1, float("nan")):
        with pytest.raises(ArgumentError, match="acceptance"):
            et.luminance_map(rays, front, screen, method="cone", acceptance=bad)
    with pytest.raises(ArgumentError, match="no apparent area"):
        et.luminance_map(rays, et.Observer(90, 0, 1000), et.Screen(2, 2, 1, 1, "xy"), method="cone")
    for bad_threads in (0, -1, 1.5, 10**9):
        with pytest.raises(ArgumentError, match="threads"):
            et.luminance_map(rays, front, screen, threads=bad_threads)  # type: ignore[call-overload]
    with pytest.raises(ArgumentError, match="2 observers and 3 screens"):
        et.luminance_map(rays, [front] * 2, [screen] * 3)
    far = np.zeros(1, dtype=[("direction", "<f4", 3), ("flux", "<f4")])
    with pytest.raises(ArgumentError, match="far-field"):
        et.luminance_map(et.RaySet.from_records(far, RaySetMeaning()), front, screen)


def test_a_map_without_any_ray_is_all_dead_and_says_so() -> None:
    rays = et.RaySet([[0, 0, 0]], [[0, 0, -1]], [1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for acceptance in (1.5, "auto"):
            lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(2, 2, 4, 4), acceptance=acceptance)
            assert lmap.dead_pixels == 16
            assert any("16 of 16 pixels are dead" in note for note in lmap.notes)
