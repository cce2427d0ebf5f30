"""A plano-convex lens whose curved face is a hyperboloid: light from its focus leaves it parallel, whatever the aperture."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

INDEX = 1.49
"""Of PMMA in the visible."""

APERTURE, THICKNESS = 8.0, 4.0
"""Radius and thickness on the axis [mm]."""


def shape(curvature: float) -> dict[str, Any]:
    """The lens of a scene; its curved face has this radius of curvature [mm] at the vertex, and faces down."""
    face = {"radius_of_curvature": curvature, "conic": -(INDEX**2)}
    return {"kind": "lens", "radius": APERTURE, "thickness": THICKNESS, "front": face}


def focal_length(curvature: float) -> float:
    """Of the curved face, from its vertex [mm]."""
    return curvature / (INDEX - 1.0)


def transmittance(radius: ArrayLike, curvature: float) -> NDArray[np.float64]:
    """Share of unpolarised light, parallel to the axis at this distance from it [mm], that both faces let through.

    Fresnel's equations: the flat face stands upright to the light; the hyperboloid is met inside the lens at the angle i by
    which its slope dz/dr = c r / √(1 − (1 + K) c² r²) leans, and left at t with sin t = n sin i.
    """
    r, c = np.asarray(radius, dtype=np.float64), 1.0 / curvature
    inside = np.arctan(c * r / np.sqrt(1.0 - (1.0 - INDEX**2) * c**2 * r**2))
    outside = np.arcsin(INDEX * np.sin(inside))
    a, b = np.cos(inside), np.cos(outside)
    across = ((INDEX * a - b) / (INDEX * a + b)) ** 2
    along = ((INDEX * b - a) / (INDEX * b + a)) ** 2
    flat = ((INDEX - 1.0) / (INDEX + 1.0)) ** 2
    return (1.0 - flat) * (1.0 - 0.5 * (across + along))


def apparent_area(curvature: float) -> float:
    """∫ transmittance 2π r dr over the lens [mm²]: on the axis, the intensity of what fills it over its luminance."""
    edges = np.linspace(0.0, APERTURE, 4001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return float(np.sum(transmittance(middle, curvature) * math.pi * np.diff(edges**2)))
