"""An LED with a hemispherical dome, from its parts: what chapter 3 of the thesis measured, here with nothing unknown."""

from __future__ import annotations

from typing import Any

import etendue as et

FLUX = 100.0  # [lm], of the die, into the silicone
DOME = 1.25
"""Radius of the dome [mm]."""

CARRIER = 1.264
"""Radius of the hemisphere around it, outside and as close as possible (section 3.3.3) [mm]."""

DIE_TOP = 0.05
"""Height of the luminous plane over the base [mm]."""

LOW_BOX = et.Box(1.8, 1.8, 0.12, centre=(0, 0, 0.06))
"""A carrier just larger than the die as one sees it through the dome: 1.4 mm wide from above, 1.75 mm from the side, where
it is 0.1 mm high."""

DIE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.3), (0.3, 0.3), (0.3, 0.5), (-0.5, 0.5)]
"""A square of 1 mm without the corner that the bond wire takes, so that left and right cannot be mixed up."""

PARTS: dict[str, Any] = {
    "sources": [
        {
            "name": "die",
            "kind": "surface",
            "shape": {"kind": "polygon", "vertices": DIE},
            "flux": FLUX,
            "at": [0, 0, DIE_TOP],
        }
    ],
    # White silicone around the die, and a die that is itself half a mirror to the light that comes back.
    "solids": [
        {
            "name": "dome",
            "shape": {"kind": "dome", "radius": DOME},
            "medium": "silicone",
            "finishes": {"base": {"kind": "lambertian", "reflectance": 0.85}},
        },
        {
            "name": "chip",
            "shape": {"kind": "block", "width": 1, "height": 1, "depth": DIE_TOP},
            "finish": {"kind": "lambertian", "reflectance": 0.6},
        },
    ],
    "surfaces": [
        {
            "name": "board",
            "shape": {"kind": "annulus", "inner_radius": DOME, "outer_radius": 2.5},
            "finish": "absorber",
        }
    ],
}
"""Keys of a scene."""


def recorded() -> et.Scene:
    """The LED, and a hemisphere close around it that records rays."""
    detector = {"kind": "rays", "name": "near field", "shape": {"kind": "hemisphere", "radius": CARRIER}}
    return et.Scene(name="dome LED", **PARTS, detectors=[detector])


def ray_file(rays: int, seed: int = 1) -> et.RaySet:
    """The rays that leave the LED, where they cross the hemisphere around it."""
    return et.trace(recorded(), rays=rays, seed=seed).rays.only
