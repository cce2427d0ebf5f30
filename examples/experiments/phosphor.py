"""A remote phosphor, bare or under a film of prisms: what section 3.2.3 of the thesis measured, here all known."""

from __future__ import annotations

from typing import Any

import etendue as et
import numpy as np

RADIUS, RIM, FLUX = 11.2, 0.7, 800.0
"""Of the plate [mm]; luminance at its rim over that in the middle; flux that it sends out itself [lm]."""

RINGS = 28
EXPONENT = 1.05
"""Intensity of the plate is as cosⁿ: 8 % below Lambert's law at 80°."""

TOP = {"bare": 0.0, "film": 1.05}
"""Height of the topmost surface [mm]: the plate, or the ridges of a film 1 mm thick."""

CARRIER = {"bare": (23, 23), "film": (27, 27)}
"""Width and height of the plane that is cut into pixels [mm]: that of the thesis, and room for what the edges of the film
emit. Where an odd number of squares fits, the middle of one lies on the axis: 23 × 23 mm are 529 squares of 1 mm."""

BOX = et.Box(24.02, 24.02, TOP["film"], centre=(0, 0, TOP["film"] / 2))
"""A carrier that holds plate and film, whose sides shine too."""


def lamp(kind: str) -> et.Scene:
    """The plate in its housing, bare or under the film, and the hemisphere that collects its rays."""
    edges = np.linspace(0.0, RADIUS, RINGS + 1)
    inner, outer = edges[:-1], edges[1:]
    # The mean of 1 - (1 - rim) (r/R)² over a ring, times its area.
    weight = (outer**2 - inner**2) * (1.0 - (1.0 - RIM) * (outer**2 + inner**2) / (2.0 * RADIUS**2))
    flux = FLUX * weight / weight.sum()
    rings: list[dict[str, Any]] = [
        {
            "name": f"ring {i + 1}",
            "kind": "surface",
            "shape": {"kind": "annulus", "inner_radius": inner[i], "outer_radius": outer[i]}
            if i
            else {"kind": "disk", "radius": outer[i]},
            "exponent": EXPONENT,
            "flux": flux[i],
        }
        for i in range(RINGS)
    ]
    rough = {"kind": "lambertian", "reflectance": 0.5, "transmittance": 0.5}
    prisms = {
        "name": "film",
        "shape": {"kind": "prismatic-film", "width": 24, "height": 24, "thickness": 0.95, "pitch": 0.1},
        "medium": {"index": 1.59},
        # Cut edges are rough: light that the film guides to them comes out there.
        "finishes": dict.fromkeys(("left", "right", "front", "back"), rough),
        "at": [0, 0, 0.05],
    }
    phosphor = {
        "name": "phosphor",
        "shape": {"kind": "disk", "radius": RADIUS},
        "finish": {"kind": "lambertian", "reflectance": 0.7},
    }
    housing = {
        "name": "housing",
        "shape": {"kind": "annulus", "inner_radius": RADIUS, "outer_radius": 50},
        "finish": "absorber",
    }
    return et.Scene(
        name=f"remote phosphor, {kind}",
        sources=rings,
        solids=[prisms] if kind == "film" else [],
        surfaces=[phosphor, housing],
        detectors=[{"name": "near field", "kind": "rays", "shape": {"kind": "hemisphere", "radius": 40}}],
    )
