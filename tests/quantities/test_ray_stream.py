"""Rays in batches, and the sums of one pass: against plain loops, for any size of batch and any number of threads."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from etendue import _core
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream, Tally
from etendue.quantities.report import RayFileWarning
from etendue.sources.ring_source import RingSource
from hypothesis import given, settings
from hypothesis import strategies as st

fixed = settings(derandomize=True, deadline=None, max_examples=40)


def uneven(n: int, seed: int = 3) -> RaySet:
    """Rays without any symmetry: off-centre, tilted, of unequal flux and unequal direction lengths."""
    rng = np.random.default_rng(seed)
    position = rng.normal([3.0, -1.0, 0.5], [1.0, 2.0, 0.3], (n, 3))
    direction = rng.normal([0.3, -0.2, 1.0], 0.4, (n, 3))
    return RaySet(position, direction, rng.gamma(0.7, 2.0, n))


DAMAGE: dict[str, Callable[[np.ndarray, int], None]] = {
    "nan position": lambda r, i: r["position"].__setitem__((i, 1), math.nan),
    "infinite position": lambda r, i: r["position"].__setitem__((i, 2), -math.inf),
    "nan direction": lambda r, i: r["direction"].__setitem__((i, 0), math.nan),
    "infinite direction": lambda r, i: r["direction"].__setitem__((i, 2), math.inf),
    "nan flux": lambda r, i: r["flux"].__setitem__(i, math.nan),
    "infinite flux": lambda r, i: r["flux"].__setitem__(i, math.inf),
    "zero direction": lambda r, i: r["direction"].__setitem__(i, 0.0),
    "short direction": lambda r, i: r["direction"].__setitem__(i, (0.0, 9e-7, 0.0)),
    "negative flux": lambda r, i: r["flux"].__setitem__(i, -1e-30),
}
"""Every way in which a ray cannot be used."""


def damaged(n: int = 1000) -> tuple[RaySet, np.ndarray]:
    """A set with each damage at a place of its own, and which of its rays are whole."""
    records = uneven(n).records.copy()
    whole = np.ones(n, bool)
    for number, damage in enumerate(DAMAGE.values()):
        damage(records, 101 * number + 7)
        whole[101 * number + 7] = False
    return RaySet.from_records(records, RaySetMeaning()), whole


# --- batches ---------------------------------------------------------------------------------------------------------


@fixed
@given(st.integers(0, 300), st.integers(1, 350))
def test_batches_are_the_rays_in_order_whatever_their_size(n: int, size: int) -> None:
    rays = uneven(n)
    batches = list(rays.batches(size))
    assert [b.start for b in batches] == list(range(0, n, size))
    assert sum(len(b.usable) for b in batches) == n
    for name in ("position", "direction", "flux"):
        got = np.concatenate([getattr(b, name) for b in batches]) if batches else np.zeros((0, 3))
        np.testing.assert_allclose(got.reshape(getattr(rays, name).shape), getattr(rays, name), rtol=1e-15)


def test_batches_leave_out_rays_that_cannot_be_used_and_say_which() -> None:
    rays, whole = damaged()
    with pytest.warns(RayFileWarning):
        assert rays.tally.rays == 1000
    batches = list(rays.batches(77))
    np.testing.assert_array_equal(np.concatenate([b.usable for b in batches]), whole)
    np.testing.assert_array_equal(np.concatenate([b.position for b in batches]), rays.position[whole])
    np.testing.assert_allclose(np.concatenate([b.direction for b in batches]), rays.direction[whole], rtol=1e-15)
    np.testing.assert_array_equal(np.concatenate([b.flux for b in batches]), rays.flux[whole])


def test_batches_are_on_the_scale_of_the_total() -> None:
    rays = uneven(1000).with_total_flux(337.0)
    assert math.fsum(f for b in rays.batches(99) for f in b.flux) == pytest.approx(337.0, rel=1e-14)


def test_a_range_outside_the_rays_is_refused() -> None:
    source = uneven(10).core_source()
    for start, stop in ((0, 11), (5, 4), (11, 11)):
        with pytest.raises(ValueError, match=f"rays {start}..{stop} of 10"):
            _core.read_rays(source, start, stop)
    assert [a.shape for a in _core.read_rays(source, 10, 10)] == [(0, 3), (0, 3), (0,)]


# --- sums ------------------------------------------------------------------------------------------------------------

MANY = 3 * (1 << 16) + 12_345
"""Rays of four batches of the core, the last one not full."""


def sources() -> list[RayStream]:
    return [uneven(MANY), RingSource(radii=(1, 3), flux=(5, 2), rays=MANY, seed=9)]


@pytest.mark.parametrize("source", sources(), ids=["records", "rings"])
def test_every_number_of_threads_gives_the_same_bits(source: RayStream) -> None:
    one, two, seven, cores = (_core.scan(source.core_source(), threads, None) for threads in (1, 2, 7, None))
    # repr tells apart what == does not: -0.0 and 0.0; and it shows all bits of a float.
    assert repr(one) == repr(two) == repr(seven) == repr(cores)


def test_the_tally_is_the_exact_sum_to_rounding() -> None:
    rays = uneven(MANY)
    tally = rays.tally
    assert tally.rays == MANY
    assert tally.unusable == 0
    assert tally.flux == pytest.approx(math.fsum(rays.flux), rel=1e-13)
    assert tally.flux_squared == pytest.approx(math.fsum(rays.flux**2), rel=1e-13)
    lengths = np.linalg.norm(rays.records["direction"], axis=1)
    assert tally.norm_error == pytest.approx(np.abs(lengths - 1).max(), rel=1e-14)


def test_moments_are_the_sums_of_a_plain_loop() -> None:
    rays = uneven(MANY)
    moments = rays.moments(threads=2)
    x, k, w = rays.position, rays.direction, rays.flux
    np.testing.assert_allclose(moments.bounds, np.stack([x.min(axis=0), x.max(axis=0)], axis=1), rtol=0)
    assert moments.flux_range == (w.min(), w.max())
    np.testing.assert_allclose(moments.weighted_position, w @ x, rtol=1e-11)
    np.testing.assert_allclose(moments.weighted_direction, w @ k, rtol=1e-11)
    outer = np.einsum("i,ij,ik->jk", w, k, k)
    np.testing.assert_allclose(moments.weighted_outer, outer[np.triu_indices(3)], rtol=1e-11)
    rhs = np.einsum("i,ijk,ik->j", w, np.eye(3) - k[:, :, None] * k[:, None, :], x)
    np.testing.assert_allclose(moments.focus_rhs, rhs, rtol=1e-10)


def test_the_sums_leave_out_rays_that_cannot_be_used_and_count_them_by_reason() -> None:
    rays, whole = damaged()
    with pytest.warns(RayFileWarning) as caught:
        moments = rays.moments()
    tally = rays.tally
    assert (tally.not_finite, tally.no_direction, tally.negative_flux, tally.unusable) == (6, 2, 1, 9)
    assert [str(w.message).split(": ", 1)[1] for w in caught] == [
        "error: rays: 6 of 1,000 rays have a coordinate, direction or flux that is not finite; they are left out",
        "error: rays: 2 of 1,000 rays have no direction; they are left out",
        "error: rays: 1 of 1,000 rays have negative flux; they are left out",
    ]
    assert tally.flux == pytest.approx(math.fsum(rays.flux[whole]), rel=1e-14)
    np.testing.assert_allclose(moments.weighted_position, rays.flux[whole] @ rays.position[whole], rtol=1e-12)
    low_high = [rays.position[whole].min(axis=0), rays.position[whole].max(axis=0)]
    np.testing.assert_array_equal(moments.bounds, np.transpose(low_high))


def test_rays_without_flux_are_counted_apart() -> None:
    rays = RaySet(np.zeros((5, 3)), np.ones((5, 3)), [0.0, 2.0, 0.0, 3.0, 0.0])
    assert rays.moments().flux_range == (0.0, 3.0)
    tally = rays.tally
    assert (tally.dark, tally.unusable, tally.usable, tally.lit) == (3, 0, 5, 2)
    # Rays that cannot be used are not counted as dark ones, too: the third has no direction, the last a negative flux.
    direction = np.ones((5, 3))
    direction[2] = 0.0
    with pytest.warns(RayFileWarning, match="are left out"):
        tally = RaySet(np.zeros((5, 3)), direction, [0.0, 2.0, 0.0, 3.0, -1.0]).tally
    assert (tally.dark, tally.unusable, tally.usable, tally.lit) == (1, 2, 3, 2)


def test_no_rays_sum_to_nothing() -> None:
    rays = uneven(0)
    assert (rays.total_flux, rays.tally.rays, rays.tally.effective_rays) == (0.0, 0, 0.0)
    assert rays.moments().flux_range == (math.inf, -math.inf)
    assert list(rays.batches()) == []


@fixed
@given(st.lists(st.floats(1e-100, 1e6) | st.just(0.0), min_size=1, max_size=50))
def test_effective_rays_count_equal_rays_in_full(weights: list[float]) -> None:
    w = np.array(weights)
    tally = Tally(len(w), 0, 0, 0, float(w.sum()), float((w * w).sum()), 0.0)
    assert 0 <= tally.effective_rays <= len(w) * (1 + 1e-12)
    equal = Tally(4, 0, 0, 0, 4 * 2.5, 4 * 2.5**2, 0.0)
    assert equal.effective_rays == pytest.approx(4.0, rel=1e-15)


@pytest.mark.parametrize(("flux", "rays"), [(1e-170, None), (1e-150, 7), (1e153, 7), (1e300, None)])
def test_effective_rays_are_known_as_far_as_squares_are(flux: float, rays: int | None) -> None:
    """Seven equal rays are seven, also where the square of their sum is no number; where those of each are none, NaN."""
    found = RaySet(np.zeros((7, 3)), np.ones((7, 3)), np.full(7, flux)).tally.effective_rays
    assert math.isnan(found) if rays is None else found == pytest.approx(rays, rel=1e-12)


# --- progress --------------------------------------------------------------------------------------------------------


def test_progress_rises_to_the_number_of_rays() -> None:
    source = RingSource(rays=(32 << 16) * 2 + 5)  # two rounds of the core and a little
    seen: list[int] = []
    source.pass_over(seen.append)
    assert seen == sorted(set(seen))
    assert len(seen) == 3
    assert seen[-1] == len(source)


def test_a_failing_progress_function_ends_the_pass_and_its_sums_are_not_used() -> None:
    rays = uneven(100)

    def fail(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rays.moments(fail)
    assert rays._tally is None
    assert rays._moments is None
    assert rays.tally.rays == 100
