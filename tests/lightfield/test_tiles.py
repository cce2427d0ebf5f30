"""Grids of more cells than one tree takes, of images as of fields: tiles of places against the Dirichlet trial of eq. 40."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield import trees
from etendue.lightfield.counting import Sums
from etendue.lightfield.trees import Base, grow, grow_averaged, log_evidence
from scipy import special

CONCENTRATION = 3.0
SIDE = 8
"""Of a tile, in cells."""


@pytest.mark.parametrize("shape", [(16, 16), (16, 16, 2, 2), (32, 8)])
def test_tiles_share_the_light_out_by_a_dirichlet_trial(
    shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """E θ = (c π + n_t)/(c + n) of every tile, its own tree within, and the evidence of both; an image has two axes."""
    counts = Sums(np.random.default_rng(5).poisson(2.0, shape).astype(np.float64), None)
    cells = counts.weight.size
    monkeypatch.setattr(trees, "TILE_BITS", cells.bit_length() - 3)  # four tiles
    found = grow(counts, Base(), CONCENTRATION, 1)
    averaged = grow_averaged(counts, Base(), CONCENTRATION, 1, [(0.0, 0.0, 0.0, 0.0)[: len(shape)]])
    np.testing.assert_allclose(averaged.ratio, found.ratio, rtol=1e-12)
    assert log_evidence(counts, Base(), CONCENTRATION, 1) == found.log_evidence
    held, evidence = [], special.gammaln(CONCENTRATION) - special.gammaln(CONCENTRATION + counts.weight.sum())
    for i in range(0, shape[0], SIDE):
        for j in range(0, shape[1], SIDE):
            window = (slice(i, i + SIDE), slice(j, j + SIDE))
            tile = Sums(np.ascontiguousarray(counts.weight[window]), None)
            own, prior, rays = grow(tile, Base(), CONCENTRATION, 1), tile.weight.size / cells, tile.weight.sum()
            held.append(rays)
            share = (CONCENTRATION * prior + rays) / (CONCENTRATION + counts.weight.sum())
            np.testing.assert_allclose(found.ratio[window], own.ratio * share / prior, rtol=1e-12)
            evidence += own.log_evidence - rays * np.log(prior)
            evidence += special.gammaln(CONCENTRATION * prior + rays) - special.gammaln(CONCENTRATION * prior)
    assert len(held) == 4
    assert sum(held) == counts.weight.sum()
    assert found.log_evidence == pytest.approx(evidence, rel=1e-12)


def test_a_fit_with_images_of_several_tiles_shows_the_source(monkeypatch: pytest.MonkeyPatch) -> None:
    """64 × 64 cells of the images, cut as 4096 × 4096 are: the flux of rings, and the luminance of the inmost one."""
    monkeypatch.setattr(trees, "TILE_BITS", 10)
    rays = et.RingSource(rays=6000)
    field = et.LightField.fit(rays, et.Disk(radius=30), depths=(2, 2, 2, 2))
    assert field.parts[0].space is not None
    assert len(field.parts[0].space) == 64
    assert field.total_flux == pytest.approx(rays.total_flux, rel=1e-12)
    (luminance,), (error,) = field.luminance([[3.0, 2.0, 0.0]], [[0, 0, 1]])
    assert abs(luminance - rays.luminance(0, 0)) < 5 * error


def test_depths_that_no_image_can_have_are_refused() -> None:
    with pytest.raises(ArgumentError, match="depths: one of them is 13; give a whole number from 0 to 12"):
        et.LightField.fit(et.RingSource(rays=1000), et.Disk(radius=30), depths=(13, 0, 0, 0))
