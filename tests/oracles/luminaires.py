"""Scenes of mixed optics without any symmetry, with an eye that sees diffuse surfaces only, directly."""

from __future__ import annotations

from typing import Any


def corner(**more: Any) -> dict[str, Any]:
    """Two leaves of different reflectance at a slant, lit by a small lamp that faces them."""
    observers = [{"name": "eye", "theta": 40, "phi": 15, "distance": 300, "target": [3, 2, 2],
                  "screen": {"width": 26, "height": 20, "columns": 6, "rows": 5}}]  # fmt: skip
    return {
        "sources": [{"kind": "surface", "shape": {"kind": "rectangle", "width": 2, "height": 1}, "flux": 100,
                     "at": [4, 3, 11], "toward": [-0.3, -0.1, -1]}],
        "surfaces": [
            {"name": "floor", "shape": {"kind": "rectangle", "width": 30, "height": 24}, "finish": {"kind": "lambertian",
             "reflectance": 0.7}},
            {"name": "side", "shape": {"kind": "rectangle", "width": 24, "height": 20}, "at": [-9, 0, 8],
             "toward": [1, 0.2, 0.1], "finish": {"kind": "lambertian", "reflectance": 0.4}},
        ],
        "observers": observers,
        "detectors": [{"name": "image", "kind": "image", "observer": "eye"}],
        **more,
    }  # fmt: skip


def lens_and_mirror() -> dict[str, Any]:
    """A wide lamp behind a tinted lens and before a concave mirror; all of it lights a floor and a wall."""
    return {
        "media": {"tinted": {"index": 1.5, "absorption": 0.02}},
        "sources": [{"name": "lamp", "kind": "surface", "shape": {"kind": "rectangle", "width": 5, "height": 3},
                     "flux": 100, "at": [-6, 1, 14], "toward": [0.2, 0.1, -1]},
                    {"name": "strip", "kind": "surface", "shape": {"kind": "rectangle", "width": 6, "height": 2},
                     "flux": 40, "at": [9, -2, 6], "toward": [1, 0.1, 0.3]}],
        "solids": [{"name": "lens", "medium": "tinted", "at": [-5.5, 1.5, 9], "rotation": [6, 8, 0], "shape":
                    {"kind": "lens", "radius": 4, "thickness": 2.5, "front": {"radius_of_curvature": 14},
                     "back": {"radius_of_curvature": -9, "conic": -0.5}}}],
        "surfaces": [
            {"name": "floor", "shape": {"kind": "rectangle", "width": 40, "height": 30}, "finish":
             {"kind": "lambertian", "reflectance": 0.7}},
            {"name": "side", "shape": {"kind": "rectangle", "width": 20, "height": 20}, "at": [0, 11, 8],
             "toward": [0.1, -1, 0.2], "finish": {"kind": "diffuse-specular", "total_reflectance": 0.6,
                                                  "specular_reflectance": 0.15}},
            {"name": "mirror", "shape": {"kind": "conic", "radius_of_curvature": 22, "radius": 6}, "at": [17, -2, 7],
             "toward": [-1, 0, -0.3], "finish": {"kind": "mirror", "reflectance": 0.85}},
        ],
        "observers": [{"name": "eye", "theta": 48, "phi": 250, "distance": 300, "target": [4, 0, 0],
                       "screen": {"width": 16, "height": 9, "columns": 7, "rows": 5}}],
        "detectors": [{"name": "image", "kind": "image", "observer": "eye"}],
    }  # fmt: skip


def reflector_and_cover() -> dict[str, Any]:
    """An LED in a dome of gel, out of the middle of a reflector, under a scattering cover that is not quite level."""
    return {
        "media": {"gel": {"index": 1.41}},
        "sources": [{"name": "die", "kind": "surface", "shape": {"kind": "rectangle", "width": 2.4, "height": 1.6},
                     "flux": 100, "at": [1, 0.5, 0.05]}],
        "solids": [{"name": "dome", "shape": {"kind": "dome", "radius": 2.5}, "medium": "gel", "at": [1, 0.5, 0],
                    "finishes": {"base": {"kind": "lambertian", "reflectance": 0.6}}}],
        "surfaces": [
            {"name": "reflector", "shape": {"kind": "cone", "radius_bottom": 4, "radius_top": 8, "height": 7},
             "finish": {"kind": "mirror", "reflectance": 0.9}},
            {"name": "board", "shape": {"kind": "annulus", "inner_radius": 2.6, "outer_radius": 9}, "at": [1, 0.5, -1e-3],
             "finish": "absorber"},
            {"name": "cover", "shape": {"kind": "disk", "radius": 8.5}, "at": [0, 0, 8], "toward": [0.08, 0.05, 1],
             "finish": {"kind": "lambertian", "reflectance": 0.25, "transmittance": 0.6}},
        ],
        "observers": [{"name": "eye", "theta": 30, "phi": 60, "distance": 400, "target": [0, 0, 8],
                       "screen": {"width": 10, "height": 9, "columns": 6, "rows": 5}}],
        "detectors": [{"name": "image", "kind": "image", "observer": "eye"}],
    }  # fmt: skip


def pipe_and_prism() -> dict[str, Any]:
    """A light guide with a diffuse end, over which a prism bends the light; what leaves it passes a plane."""
    return {
        "sources": [{"name": "lamp", "kind": "surface", "shape": {"kind": "rectangle", "width": 3.6, "height": 2.2},
                     "flux": 100, "at": [0.1, 0.2, -0.3]}],
        "solids": [
            {"name": "guide", "shape": {"kind": "block", "width": 5, "height": 3, "depth": 9}, "medium": "PMMA",
             "finishes": {"top": {"kind": "lambertian", "reflectance": 0.3, "transmittance": 0.6}}},
            {"name": "prism", "shape": {"kind": "prism", "vertices": [[-4, 0], [4, 0], [4, 2.6]], "height": 7},
             "medium": "PC", "at": [0.3, 3.4, 9.5], "axis": [1, 0, 0], "angle": 90},
        ],
        "surfaces": [{"name": "frame", "shape": {"kind": "annulus", "inner_radius": 3.4, "outer_radius": 40},
                      "at": [0, 0, 8.9], "finish": "absorber"}],
        "detectors": [{"name": "plane", "kind": "rays", "shape": {"kind": "rectangle", "width": 60, "height": 60},
                       "at": [0, 0, 14]}],
    }  # fmt: skip
