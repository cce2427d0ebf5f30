"""Rays of sets that are taken in part, or some of them more often than others: no order of the file shows in the results."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import pytest
from oracles.verdicts import LARGEST_Z

RECORDS = 40_000

LEFT, RIGHT = -60.0, 60.0
"""Where the two beams arrive."""


def two_beams(period: int) -> et.RaySet:
    """Parallel rays along +z at two places in turn: half a period on the left, half on the right, twice as strong."""
    left = np.arange(RECORDS) % period < period // 2
    position = np.zeros((RECORDS, 3))
    position[:, 0] = np.where(left, LEFT, RIGHT)
    return et.RaySet(position, np.tile([0.0, 0.0, 1.0], (RECORDS, 1)), np.where(left, 1.0, 2.0))


def at_both(rays: et.RaySet, count: int, seed: int) -> tuple[float, float]:
    """Flux on the left and on the right [lm]."""
    screen = {"kind": "illuminance", "width": 10, "height": 10, "columns": 1, "rows": 1, "toward": [0, 0, -1]}
    places = [{**screen, "name": name, "at": [x, 0, 5]} for name, x in (("left", LEFT), ("right", RIGHT))]
    scene = et.Scene(sources=[{"kind": "rays", "rays": rays}], detectors=places)
    found = et.trace(scene, count, seed=seed).illuminance
    left, right = (float(found[name].values.sum()) * 1e-4 for name in ("left", "right"))
    return left, right


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.5, 0.75, 1.5, 2.5])
@pytest.mark.parametrize("period", [2, 4, 512])
def test_a_period_of_the_file_does_not_show(period: int, share: float) -> None:
    """Each kind of ray has its share of what is drawn, with the error of a draw without replacement."""
    rays, count = two_beams(period), round(share * RECORDS)
    number_left = int((rays.flux == 1.0).sum())
    p = number_left / RECORDS
    # Of copies beyond whole rounds only those that are left over are drawn.
    drawn = count % RECORDS
    deviation = math.sqrt(drawn * p * (1 - p) * (RECORDS - drawn) / (RECORDS - 1)) / count
    seeds = range(1, 4)
    for seed in seeds:
        left, right = at_both(rays, count, seed)
        assert abs(left / RECORDS - p) < LARGEST_Z * deviation
        assert abs(right / RECORDS - 2 * (1 - p)) < 2 * LARGEST_Z * deviation


def test_the_seed_decides_which_rays_are_taken() -> None:
    """Two runs of some of the rays differ; one of all of them has every ray once, whatever the seed is."""
    rays = two_beams(2)
    assert at_both(rays, RECORDS // 2, 1) != at_both(rays, RECORDS // 2, 2)
    for seed in (1, 2):
        assert at_both(rays, RECORDS, seed) == pytest.approx((RECORDS / 2, RECORDS), rel=1e-12)


def test_sources_of_one_set_in_different_shares_show_what_it_has() -> None:
    """Two lamps of one file whose colours are in turn, the one three times the other: half of the light of both is blue."""
    rng = np.random.default_rng(4)
    position = np.column_stack([rng.normal(size=(RECORDS, 2)), np.zeros(RECORDS)])
    colour = np.where(np.arange(RECORDS) % 2, 600.0, 450.0)
    lamp = et.RaySet(
        position, np.tile([0.0, 0.0, 1.0], (RECORDS, 1)), np.ones(RECORDS), wavelength=colour, flux_unit="W"
    )
    cut = {"wavelength": [449, 451, 599, 601], "values": [1, 1, 0, 0]}
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": lamp, "flux": flux, "at": [x, 0, 0]} for x, flux in ((0, 1), (40, 3))],
        surfaces=[{"name": "filter", "shape": {"kind": "rectangle", "width": 200, "height": 50}, "at": [0, 0, 5],
                   "finish": {"kind": "transmitter", "transmittance": cut}}],
    )  # fmt: skip
    result = et.trace(scene, RECORDS, seed=3)
    blue = result.ledger.escaped.flux / 4.0
    # A quarter of the file for one lamp, three quarters for the other: each a draw without replacement.
    variance = sum((flux / 4) ** 2 * 0.25 * (1 - n) / (n * RECORDS) for flux, n in ((1, 0.25), (3, 0.75)))
    assert abs(blue - 0.5) < LARGEST_Z * math.sqrt(variance)
