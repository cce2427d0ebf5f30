"""An endless prismatic film, followed backwards through one period: a second route to what it transmits."""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

GROOVE, PRISM, SLAB, ABOVE, BELOW = range(5)
"""Where a ray is: in the air between two prisms, in a prism, in the slab below them; or gone, upwards or downwards."""

FLANKS = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]]) / np.sqrt(2.0)
"""Outward normals of the left and the right flank of a prism of 90°."""

MOST_EVENTS = 20_000


def seen_through(directions: npt.ArrayLike, *, index: float, thickness: float, rng: np.random.Generator) -> Flags:
    """Whether lines of sight against these directions of the light, shape (n, 3), end below the film.

    The prisms are 1 wide and 1/2 high, and run along y. Lines come in anywhere over a period; they are refracted or
    reflected by chance with Fresnel's shares for unpolarised light. Nothing is absorbed, and the factors n² cancel
    (radiance theorem), so that the share of lines that end below is what the film transmits in their direction of light
    that is the same from everywhere below. The grooves and prisms are triangles and the slab has two planes: after each
    event a line is in one convex cell, of which it meets the nearest wall.
    """
    d = -np.asarray(directions, dtype=np.float64)
    d = d / np.linalg.norm(d, axis=1)[:, None]
    n = len(d)
    # Stratified over the period; u is counted from the middle of the groove or the prism, z from the valleys.
    u = (rng.permutation(n) + rng.random(n)) / n - 0.5
    z = np.full(n, 0.5)
    zone = np.full(n, GROOVE)
    for _ in range(MOST_EVENTS):
        if (zone >= ABOVE).all():
            return np.asarray(zone == BELOW)
        for here, step in ((GROOVE, _groove), (PRISM, _prism), (SLAB, partial(_slab, thickness=thickness))):
            some = np.flatnonzero(zone == here)
            if some.size:
                u[some], z[some], d[some], zone[some] = step(u[some], z[some], d[some], index, rng)
    raise AssertionError("a line does not find out of the film")


def _first(distances: list[Array]) -> tuple[Array, npt.NDArray[np.intp]]:
    """The nearest wall ahead, of those that a ray moves towards."""
    all_ = np.stack(distances)
    wall = all_.argmin(axis=0)
    return all_[wall, np.arange(all_.shape[1])], wall


def _ahead(gap: Array, speed: Array) -> Array:
    """Distance to a wall of which a ray is `gap` away and which it nears at `speed`; never, if it recedes."""
    return np.where(speed > 0.0, np.maximum(gap, 0.0) / np.where(speed > 0.0, speed, 1.0), np.inf)


def _groove(u, z, d, index, rng):  # type: ignore[no-untyped-def]
    """z = |u| are its walls, z = 1/2 its open top."""
    t, wall = _first([_ahead(z + u, -d[:, 2] - d[:, 0]), _ahead(z - u, -d[:, 2] + d[:, 0]), _ahead(0.5 - z, d[:, 2])])
    u, z = u + t * d[:, 0], z + t * d[:, 2]
    # The left wall of a groove is the right flank of a prism.
    d, through = _refract(d, FLANKS[np.where(wall == 0, 1, 0)], 1.0, index, rng)
    gone = wall == 2
    zone = np.where(gone, ABOVE, np.where(through, PRISM, GROOVE))
    return np.where(through & ~gone, u + np.where(wall == 0, 0.5, -0.5), u), z, d, zone


def _prism(u, z, d, index, rng):  # type: ignore[no-untyped-def]
    """z = 1/2 - |u| are its flanks, z = 0 is where the slab begins."""
    left, right = 0.5 - z + u, 0.5 - z - u
    t, wall = _first([_ahead(left, d[:, 2] - d[:, 0]), _ahead(right, d[:, 2] + d[:, 0]), _ahead(z, -d[:, 2])])
    u, z = u + t * d[:, 0], z + t * d[:, 2]
    bent, through = _refract(d, FLANKS[np.minimum(wall, 1)], index, 1.0, rng)
    down = wall == 2
    zone = np.where(down, SLAB, np.where(through, GROOVE, PRISM))
    u = np.where(through & ~down, u + np.where(wall == 0, 0.5, -0.5), u)
    return u, z, np.where(down[:, None], d, bent), zone


def _slab(u, z, d, index, rng, thickness):  # type: ignore[no-untyped-def]
    """From the valleys down to the lower face, and back up if that reflects."""
    up = d[:, 2] > 0.0
    t = np.where(up, -z, z + thickness) / np.abs(d[:, 2])
    u = u + t * d[:, 0]
    u, z = u - np.round(u), np.where(up, 0.0, -thickness)
    bent, through = _refract(d, np.array([0.0, 0.0, -1.0]), index, 1.0, rng)
    zone = np.where(up, PRISM, np.where(through, BELOW, SLAB))
    return u, z, np.where(up[:, None], d, bent), zone


def _refract(d, normal, inside, outside, rng):  # type: ignore[no-untyped-def]
    """Snell and Fresnel, unpolarised: the new directions, and which rays went through; the others are reflected."""
    cos = (d * normal).sum(axis=-1)
    facing = normal * np.sign(cos)[:, None]
    cos = np.abs(cos)
    ratio = inside / outside
    inner = 1.0 - ratio**2 * (1.0 - cos**2)
    cos_t = np.sqrt(np.maximum(inner, 0.0))
    s = (inside * cos - outside * cos_t) / (inside * cos + outside * cos_t)
    p = (outside * cos - inside * cos_t) / (outside * cos + inside * cos_t)
    reflectance = np.where(inner <= 0.0, 1.0, (s**2 + p**2) / 2.0)
    through = rng.random(len(d)) >= reflectance
    refracted = ratio * d + (cos_t - ratio * cos)[:, None] * facing
    return np.where(through[:, None], refracted, d - 2.0 * cos[:, None] * facing), through
