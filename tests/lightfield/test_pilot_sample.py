"""The rays that stand for all of a set: of each part of a file what is due to it, none of them twice."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.pilot_sample import STRETCH, pilot_sample
from oracles.verdicts import LARGEST_Z


def numbered(n: int) -> et.RaySet:
    """Rays that start at x = 0, 1, 2 … mm."""
    number = np.arange(n, dtype=np.float64)
    zero = np.zeros(n)
    return et.RaySet(np.stack([number, zero, zero], 1), np.stack([zero, zero, zero + 1], 1), zero + 1.0)


def numbers_of(rays: et.RaySet) -> np.ndarray:
    found: np.ndarray = rays.position[:, 0].astype(np.int64)
    return found


@pytest.mark.parametrize("n", [131_073, 400_001, 1_000_000])
def test_each_equal_part_of_a_set_gives_one_piece(n: int) -> None:
    sample = numbers_of(pilot_sample(numbered(n), 1 << 17))
    pieces = (1 << 17) // STRETCH
    assert len(sample) == pieces * STRETCH
    assert (np.diff(sample) > 0).all()
    begins = np.arange(pieces + 1) * n // pieces
    assert (np.histogram(sample, begins)[0] == STRETCH).all()


def test_what_lies_at_the_end_of_a_file_has_its_share() -> None:
    """3000 strays behind a million rays, as in a file that is written source by source."""
    sample = numbers_of(pilot_sample(numbered(1_000_000), 1 << 17))
    strays = int((sample >= 997_000).sum())
    # 131 of a thousand rays are taken; in the part in which strays begin it is up to chance, by a piece of 256 at most.
    assert abs(strays - 3000 * 0.131072) <= 256


def test_a_file_with_a_period_is_not_read_at_one_phase_of_it() -> None:
    """The phases at which pieces begin are spread evenly over a period as long as a part of the set: χ² over ten classes."""
    sample = numbers_of(pilot_sample(numbered(512 * 1000), 1 << 17))
    phases = (sample[::STRETCH] % 1000) * 10 // (1000 - STRETCH + 1)
    counts = np.bincount(phases, minlength=10)
    expected = len(phases) / 10
    chi_squared = float(((counts - expected) ** 2 / expected).sum())
    assert abs(chi_squared - 9) / np.sqrt(2 * 9) < LARGEST_Z


def test_small_sets_are_taken_whole_and_empty_ones_refused() -> None:
    assert numbers_of(pilot_sample(numbered(5000), 1 << 17)).tolist() == list(range(5000))
    with pytest.raises(ArgumentError, match="carry no flux"):
        pilot_sample(et.RaySet(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)), 1 << 17)
