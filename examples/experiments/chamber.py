"""The mixing chamber of chapter 4 of the thesis, and the stand-ins for the materials that it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import etendue as et

DIAMETER, HEIGHT = 43.0, 21.4
SHEET = 1.0
"""Thickness of the sheet that the holes were drilled into [mm]."""

HOLE, FLUX = 5.0, 0.96
"""Diameter [mm], and luminous flux of each lamp [lm]."""

PLACE = 4.5
"""x and y of the holes [mm], ±: not stated; so 40 % of the light meets the walls, and the highlights lie where they do."""

Finish = Mapping[str, Any]


def chamber(wall: Finish, edge: Finish | str = "absorber", **more: Any) -> et.Scene:
    """Four Lambertian lamps under a sheet with holes, in a cylinder that is open above; z = 0 is the top of the sheet."""
    places = [(x, y) for y in (-PLACE, PLACE) for x in (-PLACE, PLACE)]
    air = {"index": 1.0}
    return et.Scene(
        name="mixing chamber",
        sources=[
            {
                "name": f"lamp {k + 1}",
                "kind": "surface",
                "shape": {"kind": "disk", "radius": HOLE / 2},
                "at": [x, y, -SHEET],
                "flux": FLUX,
            }
            for k, (x, y) in enumerate(places)
        ],
        surfaces=[
            {
                "name": "wall",
                "shape": {"kind": "cylinder", "radius": DIAMETER / 2, "height": HEIGHT},
                "finish": wall,
            }
        ],
        solids=[
            {
                "name": "sheet",
                "shape": {"kind": "rod", "radius": DIAMETER / 2, "height": SHEET},
                "at": [0, 0, -SHEET],
                "finish": wall,
            },
            *(
                {
                    "name": f"hole {k + 1}",
                    "shape": {"kind": "rod", "radius": HOLE / 2, "height": SHEET},
                    "at": [x, y, -SHEET],
                    "medium": air,
                    "finishes": {"side": edge},
                }
                for k, (x, y) in enumerate(places)
            ),
        ],
        **more,
    )
