"""Sums over rays in the hats of even steps, against hats written out ray by ray."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from etendue.quantities.angle_table import hat_integrals
from etendue.quantities.hat_sums import FEWEST_CELLS, Hats

Array = npt.NDArray[np.float64]

ROWS, WIDEST, DEPTH = 3, {180.0: 6, 360.0: 1}, {180.0: 9, 360.0: 12}


def hats(*, angle: Array, nodes: Array, step: float, span: float) -> Array:
    """Of each node for each ray, shape (n, nodes)."""
    apart = np.abs(angle[:, None] - nodes)
    if span == 360.0:
        apart = np.minimum(apart, 360.0 - apart)
    return np.maximum(1.0 - apart / step, 0.0)


def integrals(*, nodes: Array, step: float, span: float) -> Array:
    if span == 360.0:
        return np.full(nodes.size, step)
    return hat_integrals(np.linspace(0.0, 180.0, round(180.0 / step) + 1))[:: round(180.0 / step) // (nodes.size - 1)]


@pytest.mark.parametrize("span", [180.0, 360.0])
def test_sums_are_those_of_the_hats(span: float) -> None:
    """For every width, those that few moments tell and those for which each ray is looked at; to 1e-9 of the largest."""
    rng = np.random.default_rng(3)
    angle = np.concatenate([span * rng.random(700) ** 2, [0.0, span, span / 3.0], rng.normal(0.3 * span, 1e-3, 100)])
    weight, row = rng.exponential(size=angle.size), rng.integers(0, ROWS, angle.size)
    rays = Hats.of(angle, weight, row, ROWS, span, WIDEST[span], DEPTH[span])
    known = rays.moments[0].shape[2] // 2
    assert FEWEST_CELLS / 4 < 2 * known * ROWS <= FEWEST_CELLS
    assert known < WIDEST[span] << (DEPTH[span] - 1)
    for level in range(span == 360.0, DEPTH[span]):
        size = WIDEST[span] << level
        step = span / size
        nodes = np.linspace(0.0, span, size + 1)[: None if span == 180.0 else -1]
        h, half = (hats(angle=angle % 360.0, nodes=nodes, step=s, span=span) for s in (step, step / 2.0))
        wide, narrow = (integrals(nodes=nodes, step=s, span=span) for s in (step, step / 2.0))
        terms = half / narrow - h / wide
        found = rays.sums(size)
        for values, of_each in (
            (found.change, weight[:, None] * terms), (found.variance, (weight[:, None] * terms) ** 2),
            (found.held, weight[:, None] * h), (found.squares, (weight[:, None] * h) ** 2),
        ):  # fmt: skip
            expected = np.stack([of_each[row == k].sum(axis=0) for k in range(ROWS)])
            np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(found.wide, wide if span == 180.0 else step, rtol=1e-12)
