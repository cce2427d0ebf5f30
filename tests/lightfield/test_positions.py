"""Positions of the grids on which trees are averaged: whatever edges their boxes have, none are preferred."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.lightfield.candidate import FINE_POSITIONS, images_of
from etendue.lightfield.counting import PartCounts, Sums
from etendue.lightfield.trees import POSITIONS, Position
from oracles.verdicts import SIGNIFICANCE
from scipy.stats import t


@pytest.mark.parametrize(("positions", "most"), [(FINE_POSITIONS, 0.13), (FINE_POSITIONS[:4], 0.41), (POSITIONS, 0.41)])
def test_boxes_of_every_size_have_their_middles_everywhere(positions: tuple[Position, ...], most: float) -> None:
    """How far the middle of the box about a place lies from it, on average over positions: for one alone h/√12, of a size h;
    at best for n positions that divided by n."""
    places = np.linspace(0.0, 1.0, 4096, endpoint=False)
    for axis in np.array(positions).T:
        for size in 2.0 ** -np.arange(6):
            off = np.mean([0.5 - (places + shift) / size % 1.0 for shift in axis], axis=0)
            assert np.sqrt(np.mean(off**2)) * np.sqrt(12.0) < most


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1])
def test_an_image_of_a_slope_is_not_moved(axis: int) -> None:
    """In its middle, where the largest boxes end, a slope comes back as it is: trees level out as much on either side."""
    n, images = 128, 24
    slope = 1.0 + 0.6 * ((np.arange(n) + 0.5) * 2.0 / n - 1.0)
    truth = np.outer(slope, np.ones(n)) if axis == 0 else np.outer(np.ones(n), slope)
    chart = et.Plane(z=0, width=2, height=2, centre=(0, 0)).parts()[0]
    rng = np.random.default_rng(1)
    nothing = Sums(np.ones((2, 2)), None)
    middle = []
    for _ in range(images):
        counts = Sums(rng.poisson(2000 * truth / truth.sum()).astype(np.float64), None)
        image = images_of(PartCounts(counts, counts, nothing), chart, 1).densities()[0]
        middle.append(image.mean(1 - axis)[n // 2 - 1 : n // 2 + 1].mean() / image.mean())
    error = np.std(middle, ddof=1) / np.sqrt(images)
    assert error < 0.02
    assert abs(np.mean(middle) - 1.0) < t.isf(SIGNIFICANCE / 2, images - 1) * error
