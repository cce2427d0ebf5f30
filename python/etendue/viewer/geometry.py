"""A scene as lines in space: the curves in which even planes cut its faces, and a few rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scene import Scene
from etendue.scene.compiling import Compiled, compile_scene
from etendue.scene.framing import corners_of
from etendue.tracing.section import Section
from etendue.tracing.sections import cut_faces
from etendue.tracing.trails import trace_trails

Array = npt.NDArray[np.float64]

PLANES = 15
"""Across each axis; odd, so that the one through the middle is among them."""

MOST_FACES = 1500
"""Of more, only the planes through the middle are cut."""

MOST_POINTS = 400_000
"""Of all curves together: what a page holds of it takes some 3 MB. Curves beyond that are left out, and it is said."""

RAYS = 120
FAR = 1.5
"""How far a ray that leaves is shown, in sizes of the scene."""

FINENESS = 1e-3
"""Of the size of the scene: how far a point may lie from the chord that takes its place."""


def scene_geometry(scene: Scene, *, seed: int = 1) -> dict[str, Any] | None:
    """Curves and rays of a scene for the page; None if nothing in it has an end.

    Parameters
    ----------
    scene : Scene
        Whose faces and rays.
    seed : int
        Of the rays.

    Examples
    --------
    >>> import etendue as et
    >>> wall = {"shape": {"kind": "rectangle", "width": 2, "height": 4}, "finish": "absorber"}
    >>> geometry = scene_geometry(et.Scene(surfaces=[wall]))
    >>> [plane["axis"] for plane in geometry["planes"]].count("x"), geometry["rays"]
    (15, [])
    >>> next(plane["lines"] for plane in geometry["planes"] if plane["axis"] == "x" and abs(plane["at"]) < 1e-9)
    [[0.0, -2.0, 0.0, 0.0, 2.0, 0.0]]
    """
    compiled = compile_scene(scene)
    corners = corners_of(compiled)
    if len(corners) == 0:
        return None
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float(np.linalg.norm(high - low))
    planes, left_out = _planes(compiled, low, high, size)
    trails = trace_trails(compiled, RAYS, seed, FAR * size)
    rays = [_plain(_simplified(_cut_off(trail, low, high, size), FINENESS * size), size) for trail in trails]
    return {"planes": planes, "rays": rays, "low": low.tolist(), "high": high.tolist(), "left_out": left_out}


def _planes(compiled: Compiled, low: Array, high: Array, size: float) -> tuple[list[dict[str, Any]], bool]:
    """What even planes cut, and whether something had to be left out."""
    faces = compiled.record["faces"]
    few = len(faces) <= MOST_FACES
    count = PLANES if few else 1
    planes, points = [], 0
    for axis, letter in enumerate("xyz"):
        for place in (np.arange(count) + 0.5) / count:
            section = Section(letter, float(low[axis] + place * (high[axis] - low[axis])))
            lines = []
            for curves in cut_faces(faces, section):
                for curve in curves:
                    line = _simplified(section.points(curve), FINENESS * size)
                    points += len(line)
                    if points <= MOST_POINTS:
                        lines.append(_plain(line, size))
            planes.append({"axis": letter, "at": section.at, "lines": lines})
    return planes, points > MOST_POINTS or not few


def _cut_off(trail: Array, low: Array, high: Array, size: float) -> Array:
    """A trail without what lies far from the scene."""
    middle = (low + high) / 2
    near = np.linalg.norm(trail - middle, axis=1) <= 2 * FAR * size
    last = int(np.flatnonzero(near).max(initial=0))
    return trail[: last + 2]


def _simplified(points: Array, tolerance: float) -> Array:
    """The points that a line needs to stay within a distance of what it was (Douglas and Peucker)."""
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        between = points[first + 1 : last] - points[first]
        length = float(chord @ chord)
        along = np.clip(between @ chord / length, 0.0, 1.0) if length > 0 else np.zeros(len(between))
        off = np.linalg.norm(between - along[:, None] * chord, axis=1)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points[keep]


def _plain(points: Array, size: float) -> list[float]:
    """Coordinates one after the other, rounded to a thousandth of the fineness."""
    digits = max(0, int(np.ceil(-np.log10(FINENESS * size / 100.0))))
    return [round(float(x), digits) for x in points.ravel()]
