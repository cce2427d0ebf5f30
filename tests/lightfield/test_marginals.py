"""Factors of a field scaled to its images."""

from __future__ import annotations

import numpy as np
import pytest
from etendue.lightfield.etendue_density import PartField
from etendue.lightfield.marginals import marginals, scaled
from etendue.lightfield.trees import Base


@pytest.mark.parametrize("width", [0.2, 0.013])
def test_the_marginals_of_a_scaled_field_are_the_images_of_a_narrow_beam_too(width: float) -> None:
    """A beam that fills a hundredth of the directions, off the middle and aslant, of which the tree knows its coarse cells
    and a tenth of their brightness all around. Its image is hundreds of times as bright as the mean: no step may cut it."""
    x = (np.arange(256) + 0.5) / 256
    beam = np.exp(
        -0.5 * (((x[:, None] - 0.33) / width) ** 2 + ((x[None, :] - 0.386 + 0.3 * x[:, None] - 0.1) / width) ** 2)
    )
    direction = beam / beam.mean() * 0.999 + 0.001
    place = 1.0 + 0.5 * np.sin(7.0 * x)[:, None] * np.cos(3.0 * x)[None, :]
    coarse = direction.reshape(16, 16, 16, 16).mean(axis=(1, 3))
    ratio = np.minimum(coarse / np.quantile(coarse, 0.99), 1.0) + 0.1
    rng = np.random.default_rng(5)
    lumpy = (ratio[None, None] * rng.uniform(0.8, 1.25, (4, 4, 16, 16))).astype(np.float32)
    part = scaled(PartField(lumpy, 0.1 * lumpy, None, None, 1.0), Base(place / place.mean(), direction), False)
    over_place, over_direction = marginals(part, (256, 256), False)
    bright = direction > 0.05 * direction.max()
    assert direction.max() > (700 if width < 0.1 else 2)
    # Factors hold for the values at nodes, between which they are linear: those of a beam of three nodes rise at its peak.
    nodes = 2.0 * direction - _mean_of_tents(direction)
    np.testing.assert_allclose(over_direction[bright], nodes[bright], rtol=1e-6)
    np.testing.assert_allclose(over_place.mean(axis=1), (place / place.mean()).mean(axis=1), rtol=2e-4)


def _mean_of_tents(values: np.ndarray) -> np.ndarray:
    """The mean over each cell of what is linear between values at the centres: ¾ and twice ⅛ along each axis."""
    for axis in (0, 1):
        padded = np.concatenate([np.take(values, [0], axis), values, np.take(values, [-1], axis)], axis)
        n = values.shape[axis]
        before, after = np.take(padded, range(n), axis), np.take(padded, range(2, n + 2), axis)
        values = 0.75 * values + 0.125 * (before + after)
    return values
