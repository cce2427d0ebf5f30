"""One of every body, with its volume in closed form, one of every shape of a surface, and what a docstring shows."""

from __future__ import annotations

import ast
import doctest
import math
from typing import Any

OCTAHEDRON = [(2.0, 0.0, 0.0), (-2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 2.0), (0.0, 0.0, -2.0)]
OCTANTS = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
"""Corners, and triangles that run counter-clockwise seen from outside."""

BODIES: dict[str, tuple[dict[str, Any], float]] = {
    "ball": ({"radius": 2.0}, 4 / 3 * math.pi * 8),
    "dome": ({"radius": 2.0}, 2 / 3 * math.pi * 8),
    "rod": ({"radius": 2.0, "height": 3.0}, math.pi * 4 * 3),
    "frustum": ({"radius_bottom": 2.0, "radius_top": 0.5, "height": 3.0}, math.pi * 3 / 3 * (4 + 1 + 0.25)),
    "block": ({"width": 2.0, "height": 3.0, "depth": 1.5}, 9.0),
    # An L, clockwise.
    "prism": ({"vertices": [(0, 0), (0, 3), (1, 3), (1, 1), (3, 1), (3, 0)], "height": 2.0}, 10.0),
    # Slab 4 · 3 · 0.4 and four prisms of 1 · 0.5 / 2 · 3.
    "prismatic-film": ({"width": 4.0, "height": 3.0, "thickness": 0.4, "pitch": 1.0}, 4.8 + 3.0),
    # Two caps of height 1 of spheres of radius 5, on a cylinder of height 1 and radius 3.
    "lens": (
        {
            "radius": 3.0,
            "thickness": 3.0,
            "front": {"radius_of_curvature": 5.0},
            "back": {"radius_of_curvature": -5.0},
        },
        2 * math.pi / 3 * (15 - 1) + math.pi * 9,
    ),
    "torus": ({"major_radius": 2.0, "minor_radius": 0.7}, 2 * math.pi**2 * 2 * 0.49),
    # An octahedron, 4/3 r³, whose triangles run clockwise seen from outside.
    "mesh": ({"vertices": OCTAHEDRON, "triangles": [tuple(reversed(t)) for t in OCTANTS]}, 4 / 3 * 8),
}
"""Keys of a body and its volume [mm³]."""

SHAPES: dict[str, dict[str, Any]] = {
    "plane": {},
    "rectangle": {"width": 2.0, "height": 1.0},
    "disk": {"radius": 2.0},
    "annulus": {"inner_radius": 0.5, "outer_radius": 2.0},
    "polygon": {"vertices": [(0, 0), (2, 0), (0, 1)]},
    "sphere": {"radius": 2.0},
    "hemisphere": {"radius": 2.0},
    "cylinder": {"radius": 2.0, "height": 3.0},
    "cone": {"radius_bottom": 0.5, "radius_top": 2.0, "height": 3.0},
    "conic": {"radius_of_curvature": 5.0, "conic": -0.5, "radius": 3.0},
    "asphere": {"radius_of_curvature": -5.0, "conic": -2.0, "coefficients": [1e-3, -1e-5], "radius": 3.0},
    "paraboloid": {"focal_length": 2.0, "radius": 6.0},
    "ellipsoid": {"focus": 2.0, "second_focus": 8.0, "radius": 3.0},
    "hyperboloid": {"focus": 2.0, "virtual_focus": 6.0, "radius": 5.0},
    "torus": {"major_radius": 2.0, "minor_radius": 0.7},
    "mesh": {"vertices": OCTAHEDRON, "triangles": OCTANTS[:5]},
}
"""Keys of a shape of a surface."""


def shown(part: type) -> dict[str, Any]:
    """The keys with which the docstring of a part of a scene makes one: an example of kinds that no test knows by name."""
    for example in doctest.DocTestParser().get_examples(part.__doc__ or ""):
        for node in ast.walk(ast.parse(example.source)):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == part.__name__:
                return {str(keyword.arg): ast.literal_eval(keyword.value) for keyword in node.keywords}
    raise AssertionError(f"the docstring of {part.__name__} shows none")
