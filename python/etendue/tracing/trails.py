"""A few rays as the points where they start, turn and end."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.scatter.building import core_scene
from etendue.scene import Compiled
from etendue.scene.face_rows import FaceRows
from etendue.tracing.section import Section

Array = npt.NDArray[np.float64]

MOST_EVENTS = 200
"""Surfaces that a ray may meet before it is given up; long before that its trail is a tangle."""

CANDIDATES = 50
"""Rays that are traced for each one that is chosen, as far as `MOST_TRACED` allows."""

MOST_TRACED = 20_000
MOST_TRAILS = 1000


def trace_trails(compiled: Compiled, rays: int, seed: int, far: float) -> list[Array]:
    """The trails of a number of rays, dealt to the sources by their flux.

    Parameters
    ----------
    compiled : Compiled
        With any number of sources.
    rays : int
        0 to `MOST_TRACED`.
    seed : int
        0 to 2⁶⁴ − 1.
    far : float
        How far behind its last turn the trail of a ray ends that leaves the scene [mm]; more than the scene is wide.

    Returns
    -------
    list of arrays, each of shape (k, 3), k ≥ 2
        Where each ray starts, turns, passes a detector, and ends [mm].

    Examples
    --------
    >>> from etendue.scene import Scene, compile_scene
    >>> beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1}
    >>> mirror = {"shape": {"kind": "disk", "radius": 2}, "finish": "mirror", "at": [0, 0, 5]}
    >>> (trail,) = trace_trails(compile_scene(Scene(sources=[beam], surfaces=[mirror])), 1, 1, 100.0)
    >>> trail[:, 2].round(9).tolist()
    [0.0, 5.0, -95.0]
    """
    if not (rays and compiled.record["sources"]):
        return []
    found = _core.trace_trails(core_scene(compiled.record), rays, seed, MOST_EVENTS, far)
    return [points for points in found if len(points) > 1]


def near_section(trails: list[Array], section: Section, count: int, size: float) -> list[Array]:
    """The trails that begin nearest to a section and most nearly along it.

    Only beginnings count, so that what becomes of the rays has no say in which of them are shown.

    Parameters
    ----------
    trails : list of arrays, each of shape (k, 3)
        [mm]
    section : Section
        The plane.
    count : int
        How many at most.
    size : float
        A distance from the section that weighs as much as a direction at right angles to it [mm].

    Examples
    --------
    >>> straight = [np.array([[0.0, y, 0.0], [0.0, y, 1.0]]) for y in (3.0, 1.0, 2.0)]
    >>> [float(trail[0, 1]) for trail in near_section(straight, Section("y", 0.0), 2, 1.0)]
    [1.0, 2.0]
    """
    if not trails:
        return []
    starts = np.array([trail[0] for trail in trails])
    along = np.array([trail[1] for trail in trails]) - starts
    lean = along / np.maximum(np.linalg.norm(along, axis=1), np.finfo(np.float64).tiny)[:, None]
    aside = np.abs(lean[:, section.index]) + np.abs(section.depth(starts)) / size
    nearest = np.sort(np.argsort(aside, kind="stable")[:count])
    return [trails[i] for i in nearest]


def sample_source(compiled: Compiled, source: dict[str, Any], rays: int, seed: int) -> tuple[Array, Array]:
    """Where rays of one source start and which way they go, with nothing in their way.

    Parameters
    ----------
    compiled : Compiled
        For its surroundings.
    source : mapping
        One of its sources.
    rays : int
        How many.
    seed : int
        0 to 2⁶⁴ − 1.

    Returns
    -------
    start, direction : arrays, shape (n, 3)
        [mm], and unit vectors.

    Examples
    --------
    >>> from etendue.scene import Scene, compile_scene
    >>> beam = {"kind": "beam", "shape": {"kind": "disk", "radius": 1}, "flux": 1, "at": [0, 0, 7]}
    >>> compiled = compile_scene(Scene(sources=[beam]))
    >>> start, direction = sample_source(compiled, compiled.record["sources"][0], 5, 1)
    >>> start[:, 2].tolist(), direction[0].tolist()
    ([7.0, 7.0, 7.0, 7.0, 7.0], [0.0, 0.0, 1.0])
    """
    medium = compiled.record["media"][:1]
    nothing = {"finishes": [], "solids": [], "faces": FaceRows.of([]), "detectors": []}
    bare = {**nothing, "media": medium, "sources": [source]}
    found = _core.trace_trails(_core.Scene(bare), rays, seed, 1, 1.0)
    ends = np.array([points[[0, -1]] for points in found if len(points) > 1]).reshape(-1, 2, 3)
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    real = length > 0.0
    return ends[real, 0], along[real] / length[real, None]
