"""How far shapes reach: boxes in local coordinates, of shapes as the core takes them."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scene.shapes.conics import Profile

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

SAGS = 1025
"""Distances from the axis at which the height of an asphere is looked at."""


def box_of(shape: Record) -> Array:
    """The box around a shape in its local coordinates; half spaces that trim it do not count.

    Parameters
    ----------
    shape : mapping
        As `etendue.scene.compile_scene` makes it.

    Returns
    -------
    array, shape (2, 3)
        Lowest and highest x, y and z [mm]; infinite where the shape has no end. The height of an asphere is looked at at a
        thousand distances from its axis, so that its box may be too low by a millionth.

    Examples
    --------
    >>> box_of({"kind": "torus", "major": 5.0, "minor": 1.0}).tolist()
    [[-6.0, -6.0, -1.0], [6.0, 6.0, 1.0]]
    """
    match shape["kind"]:
        case "flat":
            return _flat(shape["outline"])
        case "quadric":
            radius, low, high = _quadric(shape)
        case "asphere":
            radius, low, high = _asphere(shape)
        case "torus":
            radius, low, high = shape["major"] + shape["minor"], -shape["minor"], shape["minor"]
        case _:
            corners = np.asarray(shape["vertices"], dtype=np.float64)
            return np.array([corners.min(axis=0), corners.max(axis=0)])
    return np.array([[-radius, -radius, low], [radius, radius, high]])


def _flat(outline: Record) -> Array:
    match outline["kind"]:
        case "rectangle":
            x, y = outline["width"] / 2.0, outline["height"] / 2.0
        case "annulus":
            x = y = outline["outer"]
        case "polygon":
            corners = np.asarray(outline["vertices"], dtype=np.float64)
            (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
            return np.array([[left, bottom, 0.0], [right, top, 0.0]])
        case _:
            x = y = math.inf
    return np.array([[-x, -y, 0.0], [x, y, 0.0]])


def _quadric(shape: Record) -> tuple[float, float, float]:
    """Largest r, lowest and highest z of r² = -(z2 z² + z1 z + z0)/r2 within the ranges of r and z.

    In z the surface is a row of intervals, which begin and end where the range of z does, or where r² is 0 or the
    square of a limit of r; within an interval r² is largest at an end or at its one maximum.
    """
    squared = np.array([shape["z2"], shape["z1"], shape["z0"]]) / -shape["r2"]
    (inner, outer), (low, high) = shape["r"], shape["z"]
    limits = [r for r in (0.0, inner, outer) if r < math.inf]
    marks = [z for r in limits for z in _roots(squared - np.array([0.0, 0.0, r * r]))]
    if squared[0] != 0.0:
        marks.append(-squared[1] / (2.0 * squared[0]))
    marks = sorted({z for z in (*marks, low, high) if low <= z <= high and math.isfinite(z)})
    ends = [low, *marks, high]
    reach: list[tuple[float, float, float]] = []
    for start, end in itertools.pairwise(ends):
        between = _between(start, end)
        r2 = _value(squared, between)
        if start < end and inner**2 <= r2 <= outer**2:
            radius = max(_radius(squared, start), _radius(squared, end))
            reach.append((min(radius, outer), start, end))
    if not reach:
        return 0.0, math.inf, -math.inf
    radii, starts, stops = zip(*reach, strict=True)
    return max(radii), min(starts), max(stops)


def _roots(polynomial: Array) -> list[float]:
    """Real roots; a double root counts even where rounding has made it complex."""
    a, b, c = polynomial.tolist()
    if a == 0.0:
        return [-c / b] if b != 0.0 else []
    inside = b * b - 4.0 * a * c
    root = math.sqrt(max(inside, 0.0))
    # The larger root first, so that no digits cancel.
    far = -0.5 * (b + math.copysign(root, b))
    return [far / a, c / far] if far != 0.0 else [0.0]


def _between(start: float, end: float) -> float:
    """A point inside an interval that may have no ends."""
    if math.isinf(start):
        return 0.0 if math.isinf(end) else end - 1.0 - abs(end)
    return start + 1.0 + abs(start) if math.isinf(end) else (start + end) / 2.0


def _radius(squared: Array, z: float) -> float:
    if math.isinf(z):
        leading = next((a * (1.0 if power % 2 == 0 or z > 0.0 else -1.0) for power, a in _terms(squared) if a), 0.0)
        return math.inf if leading > 0.0 and any(squared[:2]) else math.sqrt(max(float(squared[2]), 0.0))
    return math.sqrt(max(_value(squared, z), 0.0))


def _value(polynomial: Array, z: float) -> float:
    a, b, c = polynomial.tolist()
    return float((a * z + b) * z + c)


def _terms(squared: Array) -> list[tuple[int, float]]:
    return [(2, float(squared[0])), (1, float(squared[1]))]


def _asphere(shape: Record) -> tuple[float, float, float]:
    inner, outer = shape["r"]
    radius = math.inf if shape["curvature"] == 0.0 else 1.0 / shape["curvature"]
    profile = Profile(
        radius_of_curvature=None if math.isinf(radius) else radius,
        conic=shape["conic"],
        coefficients=shape["coefficients"],
    )
    sags = profile.sags(np.linspace(inner, outer, SAGS))
    return outer, float(sags.min()), float(sags.max())
