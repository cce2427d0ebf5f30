"""Fields of other rays of the same light."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from etendue.lightfield.redrawn import rays_worth, redrawn_parts
from oracles.light_fields import SURFACES, make_field
from oracles.verdicts import SIGNIFICANCE
from scipy.stats import chi2

RAYS = 3000


@pytest.mark.parametrize("name", ["cylinder", "box"])
def test_flux_is_shared_out_among_parts_as_rays_are(name: str) -> None:
    """The flux of each part is binomial over fields: (k - n p)²/(n p (1 - p)) is χ²; all parts have the whole together."""
    field = make_field(SURFACES[name], cells=(4, 4, 4, 4))
    report = dataclasses.replace(
        field.report, rays=RAYS, unmet_flux=0.0, symmetry="none", effective_rays=2.0 * RAYS / 3.0
    )
    field = field.replace(report=report)
    assert rays_worth(field) == pytest.approx(2000.0, rel=1e-12)
    flux = np.array([field.replace(parts=parts).part_flux for parts in redrawn_parts(field, 25, 5)])
    assert flux.sum(axis=1) == pytest.approx(np.full(25, field.total_flux), rel=1e-9)
    share = np.array(field.part_flux) / field.total_flux
    assert share.min() > 0.01
    shares = flux / field.total_flux
    squares = ((shares - share) ** 2 / (share * (1.0 - share) / 2000.0)).sum(axis=0)
    # Each part by itself, as all of them have the whole together.
    for found in squares:
        assert SIGNIFICANCE < chi2.sf(found, 25) < 1.0 - SIGNIFICANCE


def test_fields_have_the_symmetry_of_theirs() -> None:
    """Folded by a half-turn as the field was; other seeds, and other numbers, are other rays."""
    field = make_field(SURFACES["disk"], cells=(4, 4, 4, 4))
    field = field.replace(report=dataclasses.replace(field.report, rays=RAYS, symmetry="c2"))
    one, other = (parts[0] for parts in redrawn_parts(field, 2, 1))
    again = next(redrawn_parts(field, 1, 1))[0]
    assert np.array_equal(one.ratio, again.ratio)
    assert not np.array_equal(one.ratio, other.ratio)
    assert one.ratio == pytest.approx(np.flip(one.ratio), rel=1e-5)
