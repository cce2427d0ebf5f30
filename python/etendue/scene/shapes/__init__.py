"""Shapes of surfaces, by the ``kind`` that a user writes; the registry is the list of the tests."""

from __future__ import annotations

from etendue.scene.shapes.conics import CONICS, Asphere, Conic, Ellipsoid, Hyperboloid, Paraboloid
from etendue.scene.shapes.flat import FLAT, Annulus, Disk, Plane, Polygon, Rectangle
from etendue.scene.shapes.mesh import Mesh
from etendue.scene.shapes.round import ROUND, Cone, Cylinder, Hemisphere, Sphere
from etendue.scene.shapes.shape import HalfSpace, Shape, Trim
from etendue.scene.shapes.torus import Torus

SHAPES: dict[str, type[Shape]] = {**FLAT, **ROUND, **CONICS, "torus": Torus, "mesh": Mesh}
"""Every shape of a surface by its kind."""

__all__ = [
    "SHAPES",
    "Annulus",
    "Asphere",
    "Cone",
    "Conic",
    "Cylinder",
    "Disk",
    "Ellipsoid",
    "HalfSpace",
    "Hemisphere",
    "Hyperboloid",
    "Mesh",
    "Paraboloid",
    "Plane",
    "Polygon",
    "Rectangle",
    "Shape",
    "Sphere",
    "Torus",
    "Trim",
]
