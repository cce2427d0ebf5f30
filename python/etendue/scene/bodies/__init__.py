"""Shapes of solids, by the ``kind`` that a user writes; the registry is the list of the tests."""

from __future__ import annotations

from etendue.scene.bodies.body import Body
from etendue.scene.bodies.flat import FLAT_BODIES, Block, Prism, PrismaticFilm
from etendue.scene.bodies.lens import Lens
from etendue.scene.bodies.mesh import Mesh
from etendue.scene.bodies.round import ROUND_BODIES, Ball, Dome, Frustum, Rod
from etendue.scene.bodies.torus import Torus

BODIES: dict[str, type[Body]] = {**ROUND_BODIES, **FLAT_BODIES, "lens": Lens, "torus": Torus, "mesh": Mesh}
"""Every shape of a solid by its kind."""

__all__ = [
    "BODIES",
    "Ball",
    "Block",
    "Body",
    "Dome",
    "Frustum",
    "Lens",
    "Mesh",
    "Prism",
    "PrismaticFilm",
    "Rod",
    "Torus",
]
