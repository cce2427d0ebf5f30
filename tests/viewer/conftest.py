"""Three fields without symmetry whose page is tried, one of them with a focus, frames and both halves of a sphere."""

from __future__ import annotations

import dataclasses

import etendue as et
import pytest
from oracles.light_fields import make_field

FIELDS: dict[str, et.LightField] = {
    name: made.replace(report=dataclasses.replace(made.report, rays=20_000, symmetry="none"))
    for name, made in {
        "die": make_field(
            et.Plane(
                z=0.2, width=2.4, height=1.7, centre=(0.2, -0.1), focus=(-0.3, 0.1, 0.4, -0.2), frames=2, rest=9.0
            ),
            seed=2,
            cells=(8, 4, 4, 8),
        ),
        "lamp": make_field(et.Cylinder(radius=0.8, bottom=-0.1, top=1.7, centre=(0.2, -0.1)), seed=3, factors=(16, 8)),
        "dome": make_field(et.Dome(radius=1.264, window=0.9, z=0.3, centre=(0.1, -0.2)), seed=4, flux_unit="W"),
    }.items()
}


@pytest.fixture(params=FIELDS)
def named_field(request: pytest.FixtureRequest) -> tuple[str, et.LightField]:
    """Each of them with its name."""
    return request.param, FIELDS[request.param]
