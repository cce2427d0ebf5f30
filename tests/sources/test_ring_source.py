"""The three-ring source against the numbers of the thesis, the law it draws from, and areas worked out by quadrature."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.sources.ring_source import RingSource, allocate_rays
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

SIGNIFICANCE = 1e-4
"""Of every verdict on random numbers here; seeds are fixed, so that a verdict does not change from run to run."""


# --- how rays are shared ---------------------------------------------------------------------------------------------


def test_the_shares_and_luminances_of_the_thesis() -> None:
    """Table 2.1 and eq. 2.9 of [Audenaert2014]_: 50 million rays a run, 28 runs, 300, 200 and 100 lm."""
    source = RingSource(rays=50_000_000, runs=28)
    assert source.allocation == (10_714_286, 21_428_571, 17_857_143)
    assert len(source) == 1_400_000_000
    assert [round(v) for v in source.zone_luminance] == [303_964, 67_547, 20_264]
    assert source.ring_area == pytest.approx([math.pi * a for a in (100, 300, 500)], rel=1e-15)
    assert source.total_flux == 600.0


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.integers(1, 2**63 - 1), st.lists(st.floats(0.0, 1e300, exclude_min=True), min_size=1, max_size=12))
@example(10**17, [1 / 3, 1 / 7, 0.9])  # floats would share three rays too many
@example(2**62 - 1, [0.1] * 7 + [3.3])  # and 151 too few
@example(3, [5e-324, 1e300])
def test_shares_are_to_the_nearest_ray_and_add_up(rays: int, weights: list[float]) -> None:
    shares = allocate_rays(rays, weights)
    assert sum(shares) == rays
    total = sum(map(Fraction, weights))
    for share, weight in zip(shares, weights, strict=True):
        assert abs(share - rays * Fraction(weight) / total) < 1


def test_left_over_rays_go_to_the_largest_remainders() -> None:
    assert allocate_rays(10, [1, 1, 1]) == (4, 3, 3)  # a tie goes to the first
    assert allocate_rays(10, [14, 15, 71]) == (1, 2, 7)  # 1.4, 1.5, 7.1


# --- what is drawn ---------------------------------------------------------------------------------------------------

EDGES = (0.0, 2.0, 5.0, 6.0)
FLUX = (7.0, 1.0, 3.0)
RUNS = 2


@pytest.fixture(scope="module")
def drawn() -> tuple[RingSource, dict[str, np.ndarray]]:
    """400 000 rays of an uneven source, as the four numbers in (0, 1) that each should be made of."""
    source = RingSource(EDGES[1:], FLUX, rays=200_000, runs=RUNS, seed=20)
    position, direction, flux = _core.read_rays(source.core_source(), 0, len(source))
    ring = np.tile(np.repeat(np.arange(3), source.allocation), RUNS)
    inner2, outer2 = np.square(EDGES[:-1])[ring], np.square(EDGES[1:])[ring]
    turns = lambda v: (np.arctan2(v[:, 1], v[:, 0]) / math.tau) % 1.0  # noqa: E731
    return source, {
        "position": position,
        "direction": direction,
        "flux": flux,
        "ring": ring,
        "radial": (position[:, 0] ** 2 + position[:, 1] ** 2 - inner2) / (outer2 - inner2),
        "azimuth": turns(position),
        "sine": direction[:, 0] ** 2 + direction[:, 1] ** 2,
        "turn": turns(direction),
    }


COORDINATES = ("radial", "azimuth", "sine", "turn")


@pytest.mark.parametrize("ring", range(3))
@pytest.mark.parametrize("coordinate", COORDINATES)
def test_r_squared_sine_squared_and_both_azimuths_are_uniform(drawn: Any, ring: int, coordinate: str) -> None:
    _, rays = drawn
    sample = rays[coordinate][rays["ring"] == ring]
    assert len(sample) > 5000
    assert stats.kstest(sample, "uniform").pvalue > SIGNIFICANCE


@pytest.mark.parametrize("ring", range(3))
def test_place_and_direction_are_independent(drawn: Any, ring: int) -> None:
    """All four at once, 4 × 4 × 4 × 4 cells: χ² with 255 degrees of freedom, against too good a fit as well."""
    _, rays = drawn
    cell = np.zeros((rays["ring"] == ring).sum(), int)
    for coordinate in COORDINATES:
        cell = 4 * cell + np.minimum((4 * rays[coordinate][rays["ring"] == ring]).astype(int), 3)
    p = stats.chisquare(np.bincount(cell, minlength=256)).pvalue
    assert SIGNIFICANCE < p < 1 - SIGNIFICANCE


def test_a_ray_tells_nothing_of_the_next() -> None:
    position, direction, _ = _core.read_rays(RingSource((1.0,), (1.0,), rays=100_000, seed=4).core_source(), 0, 100_000)
    for values in (np.hypot(position[:, 0], position[:, 1]) ** 2, 1 - direction[:, 2] ** 2):
        table = np.histogram2d(values[1:], values[:-1], bins=10, range=[[0, 1], [0, 1]])[0]
        assert stats.chisquare(table.ravel()).pvalue > SIGNIFICANCE


def test_rays_are_unit_vectors_up_from_their_ring_with_its_share_of_flux(drawn: Any) -> None:
    source, rays = drawn
    np.testing.assert_allclose(np.linalg.norm(rays["direction"], axis=1), 1.0, rtol=1e-15)
    assert (rays["direction"][:, 2] > 0).all()
    assert (rays["position"][:, 2] == 0).all()
    assert (rays["radial"] >= -1e-15).all()
    assert (rays["radial"] <= 1 + 1e-15).all()
    for ring, (flux, count) in enumerate(zip(FLUX, source.allocation, strict=True)):
        own = rays["flux"][rays["ring"] == ring]
        assert (own == flux / (RUNS * count)).all()
        assert math.fsum(own) == pytest.approx(flux, rel=1e-12)
    assert source.pass_over().flux == pytest.approx(sum(FLUX), rel=1e-12)


# --- seeds and runs --------------------------------------------------------------------------------------------------


def read(source: RingSource, start: int = 0, stop: int | None = None) -> np.ndarray:
    position, direction, flux = _core.read_rays(source.core_source(), start, len(source) if stop is None else stop)
    return np.column_stack([position, direction, flux])


def test_a_seed_draws_the_same_rays_wherever_reading_starts() -> None:
    source = RingSource(EDGES[1:], FLUX, rays=5000, runs=3, seed=7)
    whole = read(source)
    np.testing.assert_array_equal(read(RingSource(EDGES[1:], FLUX, rays=5000, runs=3, seed=7)), whole)
    for start, stop in ((0, 1), (1, 4097), (4998, 5003), (9_999, 15_000)):
        np.testing.assert_array_equal(read(source, start, stop), whole[start:stop])


def test_run_r_is_a_source_with_seed_plus_r_and_its_share_of_the_flux() -> None:
    seed = 2**64 - 2  # the third run begins anew at seed 0
    together = read(RingSource(EDGES[1:], FLUX, rays=5000, runs=3, seed=seed)).reshape(3, 5000, 7)
    for run in range(3):
        alone = read(RingSource(EDGES[1:], FLUX, rays=5000, seed=(seed + run) % 2**64))
        np.testing.assert_array_equal(together[run, :, :6], alone[:, :6])
        np.testing.assert_allclose(together[run, :, 6], alone[:, 6] / 3, rtol=1e-15)


@pytest.mark.parametrize("other", [2, 2**63 + 1])
def test_different_seeds_are_independent(other: int) -> None:
    one, two = (read(RingSource((1.0,), (1.0,), rays=100_000, seed=seed)) for seed in (1, other))
    assert not (one[:, 0] == two[:, 0]).any()
    for a, b in ((0, 0), (3, 3), (0, 3)):
        ranks = [np.argsort(np.argsort(v)) * 10 // 100_000 for v in (one[:, a], two[:, b])]
        table = np.bincount(10 * ranks[0] + ranks[1], minlength=100).reshape(10, 10)
        assert stats.chi2_contingency(table).pvalue > SIGNIFICANCE


def test_a_ray_set_holds_the_same_rays() -> None:
    source = RingSource(EDGES[1:], FLUX, rays=1000, runs=2, seed=5)
    rays, expected = source.ray_set(), read(source)
    np.testing.assert_array_equal(rays.position, expected[:, :3])
    np.testing.assert_allclose(rays.direction, expected[:, 3:6], rtol=1e-15)
    np.testing.assert_array_equal(rays.flux, expected[:, 6])
    assert rays.provenance == source.provenance
    assert rays.complaints == ()


def test_the_provenance_holds_all_that_draws_the_rays_again() -> None:
    origin = RingSource((1.5, 4.0), (300.0, 0.25), rays=1000, runs=2, seed=5).provenance
    assert origin.source == "ring source (300 lm to r = 1.5 mm, 0.25 lm to r = 4 mm)"
    assert (origin.format, origin.steps) == ("synthetic", ("1000 rays x 2 runs, seed 5",))


# --- what an observer truly sees -------------------------------------------------------------------------------------


def test_luminance_steps_at_the_edges_of_the_rings() -> None:
    source = RingSource(EDGES[1:], FLUX, rays=1000)
    first, second, third = source.zone_luminance
    assert first == pytest.approx(7.0 / (math.pi * math.pi * 4e-6), rel=1e-14)
    x = [0.0, -2.0, 2.0000001, 3.0, 0.0, -5.9, 6.1, math.nan]
    y = [0.0, 0.0, 0.0, -4.0, 5.5, 0.0, 0.0, 0.0]
    assert source.luminance(x, y).tolist() == [first, first, second, second, third, third, 0.0, 0.0]
    assert source.luminance(np.zeros((2, 1)), np.zeros((1, 3))).shape == (2, 3)


def chord(radius: float, y: float, matrix: np.ndarray, low: float, high: float) -> float:
    """Length of {x in [low, high]: the point (x, y) of the screen is seen on the disk}, by the disk's conic there.

    `matrix` takes (x, y, 1) of the screen to homogeneous coordinates of the plane z = 0.
    """
    conic = matrix.T @ np.diag([1.0, 1.0, -(radius**2)]) @ matrix
    a, b, c = conic[0, 0], conic[0, 1] * y + conic[0, 2], conic[1, 1] * y * y + 2 * conic[1, 2] * y + conic[2, 2]
    if b * b - a * c <= 0:
        return 0.0
    root = math.sqrt(b * b - a * c)
    left, right = sorted([(-b - root) / a, (-b + root) / a])
    return max(0.0, min(high, right) - max(low, left))


def mean_luminance(source: RingSource, observer: Observer, screen: Screen, row: int, column: int) -> float:
    """Quadrature over the height of a pixel of the exact lengths inside each ring's image."""
    right, up, _ = screen.axes(observer)
    eye, target = observer.position, np.array(observer.target)
    # The line from the eye through s = target + x right + y up meets z = 0 at (eye × s_z - s × eye_z)/(s_z - eye_z).
    frame = np.column_stack([right, up, target])
    z = frame[2] - [0, 0, eye[2]]
    matrix = np.array([eye[0] * frame[2] - eye[2] * frame[0], eye[1] * frame[2] - eye[2] * frame[1], z])
    low, high = (column + np.array([0, 1])) * screen.width / screen.columns - screen.width / 2
    top, bottom = screen.height / 2 - (row + np.array([0, 1])) * screen.height / screen.rows

    def disk(radius: float) -> float:
        ys = np.linspace(bottom, top, 65)
        return math.fsum(
            integrate.quad(lambda y: chord(radius, y, matrix, low, high), a, b, epsabs=1e-9, limit=200)[0]
            for a, b in itertools.pairwise(ys)
        )

    inside = [0.0, *(disk(radius) for radius in source.edges[1:])]
    seen = sum(l * (b - a) for l, a, b in zip(source.zone_luminance, inside, inside[1:], strict=False))  # noqa: E741
    return seen / (screen.width / screen.columns * screen.height / screen.rows)


VIEWS = {
    "face on": (Observer(0, 0, 100), Screen(13, 12, 6, 4)),
    "face on, target beside": (Observer(0, 0, 40, (1, -2, 0)), Screen(9, 12, 4, 5)),
    "oblique": (Observer(50, 35, 60, (0.5, 0, 0)), Screen(13, 9, 5, 4)),
    "oblique, target above": (Observer(65, -120, 40, (0, 1, 3)), Screen(14, 11, 4, 5)),
    "oblique onto the plane": (Observer(50, 200, 60), Screen(13, 11, 4, 6, "xy")),
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
@pytest.mark.parametrize("view", VIEWS.values(), ids=VIEWS)
def test_pixels_are_the_mean_over_the_area_that_each_ring_takes(view: tuple[Observer, Screen]) -> None:
    source = RingSource(EDGES[1:], FLUX, rays=1000)
    observer, screen = view
    subdivision = 64
    seen = source.pixel_luminance(observer, screen, subdivision)
    assert seen.shape == screen.shape
    pixels = [mean_luminance(source, observer, screen, row, column) for row, column in np.ndindex(screen.shape)]
    expected = np.reshape(pixels, screen.shape)
    assert (expected > 0).any()
    steps = np.abs(np.diff([*source.zone_luminance, 0.0])).max()
    assert np.abs(seen - expected).max() < steps / subdivision
    # Errors of single pixels do not add up: the sum over the screen is far better than any of them.
    assert seen.sum() == pytest.approx(expected.sum(), rel=1e-3)


def test_intensity_follows_the_cosine_law() -> None:
    """I(θ) = Σ Φ_i cos θ / π for a far observer, whatever the screen."""
    source = RingSource(rays=1000)
    for theta in (0, 30, 75):
        observer, screen = Observer(theta, 77, 1e6), Screen(62, 61, 31, 40)
        values = source.pixel_luminance(observer, screen)
        lmap = LuminanceMap(values, np.zeros_like(values), np.ones(screen.shape, int), observer, screen)
        assert lmap.intensity == pytest.approx(600 / math.pi * math.cos(math.radians(theta)), rel=5e-4)


def test_a_screen_of_many_columns_is_seen_in_full() -> None:
    source = RingSource(rays=1000)
    observer = Observer(0, 0, 1000)
    wide = source.pixel_luminance(observer, Screen(70, 0.01, 2100, 1), subdivision=32)
    assert wide.shape == (1, 2100)
    assert wide.max() == pytest.approx(source.zone_luminance[0], rel=1e-14)


def test_lines_of_sight_that_miss_the_plane_see_nothing() -> None:
    source = RingSource(rays=1000)
    # The eye is 2.5 mm above the rings. Left on this screen is up: lines through its left 12 mm rise from the eye to the
    # screen, and it is behind the eye that they meet the rings.
    seen = source.pixel_luminance(Observer(60, 0, 5), Screen(30, 4, 30, 2))
    assert (seen[:, :12] == 0).all()
    assert (seen[:, 13:] > 0).all()


@pytest.mark.parametrize("observer", [Observer(90, 0, 100), Observer(120, 0, 100), Observer(0, 0, 5, (0, 0, -5))])
def test_an_observer_who_is_not_above_the_plane_is_refused(observer: Observer) -> None:
    with pytest.raises(ArgumentError, match="not above the plane"):
        RingSource(rays=1000).pixel_luminance(observer, Screen(1, 1, 1, 1))


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"radii": ()}, "radii"),
        ({"radii": (0.0, 1.0, 2.0)}, "rising radii > 0"),
        ({"radii": (1.0, 1.0, 2.0)}, "rising radii"),
        ({"radii": (3.0, 2.0, 1.0)}, "rising radii"),
        ({"radii": (1.0, 2.0, math.nan)}, "rising radii"),
        ({"radii": (1.0, 2.0, math.inf)}, "rising radii"),
        ({"flux": (1.0, 2.0)}, "for each of 3 rings"),
        ({"flux": (1.0, 2.0, 0.0)}, "finite flux > 0"),
        ({"flux": (1.0, 2.0, math.nan)}, "finite flux > 0"),
        ({"rays": 0}, "rays is 0"),
        ({"runs": 0}, "runs is 0"),
        ({"rays": 2**62, "runs": 2}, "fewer than 2^63"),
        ({"rays": 2}, "leave a ring without any"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": 2**64}, "seed"),
    ],
)
def test_refuses_a_source_outside_the_domain(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message.replace("^", r"\^")):
        RingSource(**arguments)


@pytest.mark.parametrize("name", ["rays", "runs", "seed"])
@pytest.mark.parametrize("number", [np.uint16(500), 5e2, np.float32(500)], ids=lambda n: type(n).__name__)
def test_counts_are_whole_numbers_of_any_type(name: str, number: Any) -> None:
    with pytest.raises(ArgumentError, match=f"RingSource: {name} is 500.5; give a whole number"):
        RingSource(**{name: 500.5})  # type: ignore[arg-type]
    source = RingSource(**({"rays": 500} | {name: number}))
    assert len(source) == (250_000 if name == "runs" else 500)
    assert source.ray_set().flux.tolist() == RingSource(**({"rays": 500} | {name: 500})).ray_set().flux.tolist()


def test_the_longest_source_is_read_at_its_end() -> None:
    source = RingSource(rays=2**62, runs=1)
    assert len(source) == 2**62
    position, direction, flux = _core.read_rays(source.core_source(), 2**62 - 3, 2**62)
    assert (np.hypot(position[:, 0], position[:, 1]) >= 20).all()
    assert (direction[:, 2] > 0).all()
    assert (flux > 0).all()
