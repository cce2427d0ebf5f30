"""Maps from an index are those of a pass over all rays: the same rays in every pixel, the same sums to rounding."""

from __future__ import annotations

import hashlib
import warnings
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.report import RayFileWarning
from oracles.cone import plain_statement


@pytest.fixture(scope="module")
def cloud() -> et.RaySet:
    """Rays of unequal flux from a lopsided cloud: most head upwards, one in five anywhere, some start far away."""
    rng = np.random.default_rng(8)
    n = 100_000
    position = rng.normal((1.0, -2.0, 0.5), (3.0, 2.0, 0.7), (n, 3))
    direction = rng.normal((0.3, 0.2, 1.0), (0.4, 0.3, 0.3), (n, 3))
    direction[::5] = rng.normal(size=(n // 5, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    position[::101] -= direction[::101] * rng.uniform(0, 1e5, (len(position[::101]), 1))
    return et.RaySet(position, direction, rng.exponential(1.0, n))


@pytest.fixture(scope="module")
def index(cloud: et.RaySet) -> et.RayIndex:
    return et.RayIndex.build(cloud)


def assert_same_map(found: et.LuminanceMap, expected: et.LuminanceMap) -> None:
    np.testing.assert_array_equal(found.rays, expected.rays)
    for name in ("values", "standard_error"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12, atol=0)


OBSERVERS = [
    (theta, phi, distance)
    for theta, phi in ((0, 0), (17, 40), (60, 250), (88, 10), (120, 100), (180, 0))
    for distance in (3.0, 40.0, 3000.0)
]


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["view", "xy"])
@pytest.mark.parametrize(("acceptance", "lit"), [(0.2, 4), (1.5, 10), (30.0, 16)])
def test_counts_the_same_rays_for_every_observer(
    cloud: et.RaySet, index: et.RayIndex, acceptance: float, lit: int, plane: str
) -> None:
    observers = [et.Observer(*where, target=(0.5, -1.0, 0.25)) for where in OBSERVERS]
    screens = [et.Screen(9.0, 7.0, 6, 5, plane) if i % 2 else et.Screen(3.0, 30.0, 4, 40, plane) for i in range(18)]
    full = et.luminance_map(cloud, observers, screens, method="cone", acceptance=acceptance)
    fast = et.luminance_map(index, observers, screens, acceptance=acceptance)
    for found, expected in zip(fast, full, strict=True):
        assert_same_map(found, expected)
    assert sum(lmap.rays.sum() > 0 for lmap in full) >= lit


def test_equals_the_equations_ray_by_ray(cloud: et.RaySet, index: et.RayIndex) -> None:
    observer, screen = et.Observer(20, 300, 30.0, target=(0.5, -1.0, 0.25)), et.Screen(8.0, 6.0, 4, 3)
    lmap = et.luminance_map(index, observer, screen, acceptance=6)
    luminance, error, count = plain_statement(cloud, observer, screen, 6.0)
    np.testing.assert_array_equal(lmap.rays, count)
    assert count.min() > 0
    np.testing.assert_allclose(lmap.values, luminance, rtol=1e-11)
    np.testing.assert_allclose(lmap.standard_error, error, rtol=1e-11)


def test_automatic_acceptance_is_that_of_the_full_pass(cloud: et.RaySet, index: et.RayIndex) -> None:
    where = et.Observer(10, 45, 200), et.Screen(12, 12, 300, 300)
    found = et.luminance_map(index, *where, acceptance="auto")
    expected = et.luminance_map(cloud, *where, method="cone", acceptance="auto")
    assert_same_map(found, expected)
    assert found.provenance.steps[-1] == expected.provenance.steps[-1]


@pytest.mark.slow
def test_drawn_rays_and_rays_of_a_field_are_indexed_too() -> None:
    rings = et.RingSource((2.0, 5.0), (30.0, 20.0), rays=200_000, seed=3)
    field = et.LightField.fit(rings.ray_set().subset(20_000, seed=1), et.Disk(radius=5), depths=(3, 3, 2, 2))
    where = et.Observer(25, 10, 60), et.Screen(14, 14, 8, 8)
    for source in (rings, field.rays(50_000, seed=2)):
        index = et.RayIndex.build(source)
        assert (len(index), index.flux_unit) == (len(source), "lm")
        assert index.total_flux == pytest.approx(source.total_flux, rel=1e-12)
        found, full = (et.luminance_map(rays, *where, method="cone", acceptance=5) for rays in (index, source))
        assert_same_map(found, full)
        assert (found.rays > 0).sum() >= 30


def test_the_index_is_what_auto_means_and_the_notes_say_how_much_was_looked_at(index: et.RayIndex) -> None:
    observer, screen = et.Observer(15, 30, 2000), et.Screen(12, 12, 8, 8)
    lmap = et.luminance_map(index, observer, screen)
    assert_same_map(lmap, et.luminance_map(index, observer, screen, method="cone", acceptance=1.5))
    (note,) = [note for note in lmap.notes if note.startswith("by the index")]
    looked = int(note.split()[3].replace(",", ""))
    assert lmap.rays.sum() <= looked < 0.2 * len(index)
    assert f"of {len(index):,} rays head for the observer within 1.5°" in lmap.notes[0]


def test_relative_flux_is_scaled_as_in_the_source(cloud: et.RaySet, tmp_path: Path) -> None:
    """The total over the rays is in the index, so that its scale is that of the source to the last bit."""
    et.write_rays(tmp_path / "led.tm25ray", cloud)
    rays = et.read_rays(tmp_path / "led.tm25ray", flux=337.0)
    where = et.Observer(10, 20, 300), et.Screen(12, 12, 4, 4)
    expected = et.luminance_map(rays, *where, method="cone", acceptance=10)
    for index in (et.RayIndex.build(rays), et.RayIndex.build(rays, tmp_path / "led.etd")):
        assert (index.total_flux, index.flux_scale) == (337.0, rays.flux_scale)
        assert_same_map(et.luminance_map(index, *where, acceptance=10), expected)
        driven = index.with_total_flux(2 * 337.0)
        assert isinstance(driven, et.RayIndex)
        np.testing.assert_allclose(
            et.luminance_map(driven, *where, acceptance=10).values, 2 * expected.values, rtol=1e-12
        )


def test_what_makes_other_rays_makes_a_plain_ray_set(cloud: et.RaySet, index: et.RayIndex) -> None:
    observer, screen = et.Observer(0, 0, 100), et.Screen(12, 12, 3, 3)
    for change in (
        lambda rays: rays.scaled(2.0),
        lambda rays: rays.moved((1, 2, 3)),
        lambda rays: rays.rotated((1, 1, 0), 30),
        lambda rays: rays.subset(len(rays), seed=1),
    ):
        changed = change(index)
        assert isinstance(changed, et.RaySet)
        assert not isinstance(changed, et.RayIndex)
        found = et.luminance_map(changed, observer, screen, method="cone", acceptance=8)
        expected = et.luminance_map(change(cloud), observer, screen, method="cone", acceptance=8)
        np.testing.assert_array_equal(found.rays, expected.rays)
    assert isinstance(index.replace(declared_flux=1.0), et.RayIndex)


def test_rays_that_cannot_be_used_are_left_out_and_complained_about(cloud: et.RaySet) -> None:
    records = cloud.records[:5000].copy()
    records["flux"][7] = -1.0
    records["position"][8] = np.nan
    records["direction"][9] = 0.0
    rays = et.RaySet.from_records(records, cloud.meaning)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RayFileWarning)
        index = et.RayIndex.build(rays)
    assert len(caught) == 3
    assert len(index) == 4997
    assert any("3 of 5,000 rays could not be used" in complaint.found for complaint in index.complaints)
    assert index.tally.rays == 4997
    assert index.pass_over().unusable == 0
    usable = np.delete(records, [7, 8, 9])
    assert sorted(map(bytes, index.records)) == sorted(map(bytes, usable))


def test_errors_of_an_index_of_copies_are_those_of_its_distinct_rays() -> None:
    """A set with itself has twice the flux and half of the rays: errors are twice those of the set, not √2 times."""
    once = et.RingSource(rays=100_000, seed=3).ray_set()
    place = et.Observer(20, 30, 200), et.Screen(60, 60, 5, 5)
    expected = et.luminance_map(once, *place, method=et.Cone(acceptance=6))
    found = et.luminance_map(et.RayIndex.build(et.RaySet.merge([once, once])), *place, method=et.Cone(acceptance=6))
    # Some copies are in another stretch than their ray.
    assert found.standard_error == pytest.approx(2.0 * expected.standard_error, rel=1e-3, nan_ok=True)
    assert any("all standard errors are 1.41 times as large for it" in note for note in found.notes)


def test_no_ray_for_the_observer_is_a_dead_map() -> None:
    index = et.RayIndex.build(et.RaySet([[0, 0, 0]], [[0, 0, -1]], [1.0]))
    for acceptance in (1.5, "auto"):
        lmap = et.luminance_map(index, et.Observer(0, 0, 1000), et.Screen(2, 2, 4, 4), acceptance=acceptance)
        assert lmap.dead_pixels == 16


def test_refusals() -> None:
    far = np.ones(3, dtype=[("direction", "<f4", 3), ("flux", "<f4")])
    with pytest.raises(ArgumentError, match="far-field"):
        et.RayIndex.build(et.RaySet.from_records(far, RaySetMeaning()))
    nowhere = et.RaySet([[0, 0, 0]] * 2, [[0, 0, 0]] * 2, [1.0, 1.0])
    with pytest.warns(RayFileWarning), pytest.raises(ArgumentError, match="not one of 2 rays is usable"):
        et.RayIndex.build(nowhere)
    with pytest.raises(ArgumentError, match="threads"):
        et.RayIndex.build(et.RingSource(rays=1000), threads=0)


def test_same_bytes_for_any_number_of_threads(tmp_path: Path) -> None:
    """Of the file, and of the map made from it."""
    source = et.RingSource(rays=300_000, seed=5)

    def run(threads: int) -> tuple[str, bytes]:
        path = tmp_path / "a.etd"
        index = et.RayIndex.build(source, path, threads=threads)
        lmap = et.luminance_map(index, et.Observer(10, 45, 150), et.Screen(70, 70, 16, 16), threads=threads)
        return hashlib.sha256(path.read_bytes()).hexdigest(), lmap.values.tobytes() + lmap.standard_error.tobytes()

    assert run(1) == run(2) == run(7)


def test_progress_rises_to_all_rays_over_the_three_passes() -> None:
    seen: list[int] = []
    et.RayIndex.build(et.RingSource(rays=300_000), progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 300_000
    assert len(seen) >= 3


@pytest.mark.parametrize("stop_at", [1, 2, 3])
def test_stopping_leaves_what_was_there(tmp_path: Path, stop_at: int) -> None:
    """Ctrl-C in any of the passes; the exception of a progress function comes the same way."""
    path = tmp_path / "a.etd"
    path.write_bytes(b"old")
    calls = iter(range(1, 10))

    def stop(_done: int) -> None:
        if next(calls) == stop_at:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        et.RayIndex.build(et.RingSource(rays=1000), path, progress=stop)
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [b"old"]


def test_grids_suit_the_number_of_rays() -> None:
    from etendue.formats.rays.index_building import grid_side

    assert [grid_side(n) for n in (1, 10**5, 10**6, 10**7, 10**8, 10**9, 10**10)] == [8, 8, 16, 64, 128, 256, 256]
