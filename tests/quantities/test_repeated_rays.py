"""Rays that a large set holds twice are found from few of them, wherever the copies stand."""

from __future__ import annotations

import itertools

import etendue as et
import numpy as np
import pytest
from etendue.quantities.repeated_rays import GLANCE, HINT, Repeats, glanced_at


@pytest.mark.parametrize("rays", [2 * GLANCE + 1, 1_234_567, 10_000_000])
def test_an_end_and_its_copy_are_both_glanced_at(rays: int) -> None:
    """For any distance between them: enough rays of the first end, or of the last, with their copies."""
    seen = np.zeros(rays, dtype=bool)
    ranges = glanced_at(rays)
    for start, stop in ranges:
        seen[start:stop] = True
    assert all(stop <= after for (_, stop), (after, _) in itertools.pairwise(ranges))
    end = ranges[0][1]
    for distance in np.random.default_rng(4).integers(end, rays - end, 200):
        first = np.count_nonzero(seen[distance : distance + end])
        last = np.count_nonzero(seen[rays - end - distance : rays - distance])
        assert min(first, last) >= HINT, distance


def lamp(rays: int, seed: int) -> et.RaySet:
    rng = np.random.default_rng(seed)
    return et.RaySet(rng.normal(size=(rays, 3)), rng.normal(size=(rays, 3)), np.ones(rays))


@pytest.mark.slow
def test_large_sets_with_copies_are_looked_at_whole() -> None:
    """Two sets, one of them twice: in a row, with the other one before or behind, shuffled.

    Σ w² of pairs is twice that of the rays apart.
    """
    one, other = lamp(300_000, 1), lamp(300_000, 2)
    few = sum(stop - start for start, stop in glanced_at(600_000))
    assert Repeats.of(et.RaySet.merge([one, other])) == Repeats(few, 0)
    order = np.random.default_rng(3).permutation(600_000)
    for sets in ([one, one], [other, one, one], [one, one, other]):
        merged = et.RaySet.merge(sets)
        found = Repeats.of(merged)
        assert (found.rays, found.repeated) == (len(merged), 300_000)
        assert found.excess == pytest.approx(1.0 + 600_000 / len(merged))
    twice = et.RaySet.merge([one, one])
    shuffled = et.RaySet(twice.position[order], twice.direction[order], twice.flux)
    assert Repeats.of(shuffled).repeated == 300_000
