"""Light fields without symmetry, made by hand, for everything that reads, keeps or draws from one."""

from __future__ import annotations

import math

import numpy as np
from etendue.lightfield.carrier import Box, Cylinder, Disk, Dome, Hemisphere, Plane, Sphere, Surface
from etendue.lightfield.etendue_density import FineErrors, FitReport, PartField
from etendue.lightfield.light_field import LightField
from etendue.quantities.provenance import Provenance
from etendue.units import FluxUnit

SURFACES: dict[str, Surface] = {
    "plane": Plane(z=0.7, width=2.5, height=1 / 3, centre=(0.1, -0.4)),
    "disk": Disk(radius=1.3, z=-0.2, centre=(0.5, 1 / 7)),
    "plane with a beam": Plane(0.7, 2.5, 1 / 3, (0.1, -0.4), beam=(0.2, -0.35, 0.4)),
    "plane aslant": Plane(0.4, 2.5, 1.5, (0.1, -0.4), (0.2, -0.1, 0.3, 0.0), towards=(-0.3, 0.3, 0.7)),
    "disk aslant with a beam": Disk(1.3, -0.2, (0.5, 1 / 7), beam=(-0.3, 0.1, 0.6), towards=(-0.5, 0.1, 0.6)),
    "hemisphere": Hemisphere(radius=1.264, centre=(0.1, 0.2, -0.3)),
    "sphere": Sphere(radius=0.9, centre=(-0.3, 0.0, 0.2)),
    "cylinder": Cylinder(radius=0.8, bottom=-0.1, top=1.7, centre=(0.2, -0.1)),
    "open cylinder": Cylinder(radius=0.8, bottom=-0.1, top=1.7, ends=False),
    "cylinder along x": Cylinder(radius=0.8, bottom=-0.1, top=1.7, centre=(0.2, -0.1), axis="x"),
    "open cylinder along y": Cylinder(radius=0.8, bottom=-0.1, top=1.7, centre=(0.2, -0.1), ends=False, axis="y"),
    "box": Box(1.1, 0.7, 1 / 3, centre=(0.2, 0.3, 0.4)),
    "dome": Dome(radius=1.264, z=0.3, centre=(0.1, -0.2)),
    "dome with a window": Dome(radius=1.264, window=0.9),
}
"""One of each kind, none in a special position; every surface of the registry is here."""

Cells = tuple[int, int, int, int]


def make_field(
    surface: Surface, seed: int = 1, cells: Cells = (4, 2, 2, 4), factors: tuple[int, int] | None = (8, 4),
    flux_unit: FluxUnit = "lm",
) -> LightField:  # fmt: skip
    """A rough field: ratio and factors drawn from a gamma distribution, some cells dark, no two parts alike."""
    rng = np.random.default_rng(seed)
    parts = []
    for index in range(len(surface.parts())):
        ratio = rng.gamma(0.8, 1.2, cells).astype(np.float32)
        ratio[rng.random(cells) < 0.1] = 0.0
        deviation = (ratio * rng.uniform(0.02, 1.5, cells)).astype(np.float32)
        sides = (None, None) if factors is None else factors
        space, direction = (None if n is None else rng.gamma(2.0, 0.5, (n, n)) for n in sides)
        within = [None if n is None else rng.uniform(0.0, 0.3, (max(n // 2, 1),) * 2) for n in sides]
        errors = FineErrors(*within, (1.0, 0.9, 0.75), (1.0, 0.5))
        parts.append(PartField(ratio, deviation, space, direction, 3.7 / (1 + index), errors))
    count = len(parts)
    report = FitReport(
        rays=2**40 + 1,
        unmet_rays=3,
        unmet_flux=0.1,
        bases=("product", "uniform", *["uniform"] * count)[:count],
        concentrations=tuple(float(10 * n + 1) for n in range(count)),
        log_evidence=-math.pi,
        score=math.nan,
        score_error=math.inf,
        histogram_score=-2.5,
        effective_cells=33.3,
        symmetry="c2",
    )
    provenance = Provenance("LED »x«, ü.ray", "tm25", "ab12", ("subset of 10 rays", "light field"), "étendue 0.1")
    return LightField(surface, tuple(parts), flux_unit, report, provenance, ("first\nin two lines", "zweite: µ"))
