"""The brightest of many noisy cells of a detector is brighter than any is: what a trace tells of it."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
from etendue.scene.detectors.detector import brightest_of
from oracles.verdicts import SIGNIFICANCE
from scipy.stats import chi2

FLUX, SIDE = 40.0, 30.0


def test_the_brightest_cell_is_told_without_what_chance_lifts_it_by() -> None:
    """An even beam lights 64 cells alike, by E = Φ/A; the sheet behind them has the luminance ρ E/π.

    Squares of deviations over 32 seeds, each over its own error, are at most χ², at 10⁻⁴; those of the brightest cells
    themselves are beyond it.
    """
    cells = {"width": 20, "height": 20, "columns": 8, "rows": 8}
    square = {"kind": "rectangle", "width": SIDE, "height": SIDE}
    scene = et.Scene(
        sources=[{"kind": "beam", "shape": square, "flux": FLUX, "at": [0, 0, 100], "toward": [0, 0, -1]}],
        surfaces=[
            {
                "name": "sheet",
                "shape": square,
                "finish": {"kind": "lambertian", "reflectance": 0.7},
            }
        ],
        observers=[{"name": "eye", "theta": 0, "distance": 200, "screen": cells}],
        detectors=[
            {"name": "seen", "kind": "image", "observer": "eye"},
            {"name": "lit", "kind": "illuminance", **cells, "at": [0, 0, 0.001]},
        ],
    )
    results = [et.trace(scene, rays=10_000, seed=seed) for seed in range(1, 33)]
    illuminance = FLUX / (SIDE / 1000.0) ** 2
    for name, truth in (("seen", 0.7 * illuminance / math.pi), ("lit", illuminance)):
        found = [brightest_of(result.quantity_of(name)) for result in results]
        for key, holds in (("maximum_apart", True), ("maximum", False)):
            z = np.array([(one[key] - truth) / one["maximum_error"] for one in found])
            assert (chi2.sf((z**2).sum(), z.size) > SIGNIFICANCE) == holds, (name, key, (z**2).mean())
    told = results[0].plan.detections[0].summary(results[0].quantity_of("seen"))
    assert "chance" in told
