"""Where the rays of pixels start: on a surface about the lamp, stated or as close as their lines allow."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.lightfield.carrier import Disk, Part, Plane, Surface
from etendue.lightfield.selection.settings import DEFAULT
from etendue.lightfield.selection.trial_surfaces import TrialSurfaces
from etendue.quantities.ray_set import RaySet
from etendue.quantities.weighted_quantile import weighted_quantile

Array = npt.NDArray[np.float64]

LEFT_OUT = 1e-3
"""Share of the flux that the closest surface may leave out."""

DEPTHS = 41
"""Depths at which flat surfaces are tried, twice: over the height of the lamp, and about the best of them."""


def on_surface(surface: Surface, points: Array, directions: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Where lines leave a surface, the first of its parts that they cross from the inside; and which do not cross it.

    Parameters
    ----------
    surface : Surface
        Closed: all of its dimensions are known.
    points : array, shape (n, 3)
        Of the lines [mm].
    directions : array, shape (n, 3)
        Unit vectors, in which the light travels.

    Returns
    -------
    starts : array, shape (n, 3)
        [mm]; where a line does not cross the surface, `points` as they came.
    missed : array of bool, shape (n,)

    Examples
    --------
    >>> import etendue as et
    >>> starts, missed = on_surface(et.Sphere(radius=2, centre=(0, 0, 1)), np.array([[0.0, 0, 9], [5, 0, 0]]),
    ...                             np.array([[0.0, 0, 1], [0, 0, 1]]))
    >>> starts[0].tolist(), missed.tolist()
    ([0.0, 0.0, 3.0], [False, True])
    """
    starts, missed = points.copy(), np.ones(len(points), dtype=bool)
    for part in surface.parts():
        along = _crossing(part, points, directions)
        new = missed & np.isfinite(along)
        starts[new] = points[new] + along[new, None] * directions[new]
        missed[new] = False
    return starts, missed


def _crossing(part: Part, points: Array, directions: Array) -> Array:
    """How far along each line it leaves the part [mm]; NaN where it does not."""
    axes = np.array(part.axes)
    x, k = (points - np.array(part.centre)) @ axes.T, directions @ axes.T
    a, b = part.size
    with np.errstate(divide="ignore", invalid="ignore"):
        if part.shape in ("rectangle", "disk"):
            along = np.where(k[:, 2] > 0.0, -x[:, 2] / k[:, 2], np.nan)
            at = x + along[:, None] * k
            if part.shape == "disk":
                inside = np.hypot(at[:, 0], at[:, 1]) <= a
            else:
                inside = (np.abs(at[:, 0]) <= a / 2) & (np.abs(at[:, 1]) <= b / 2)
            return np.where(inside, along, np.nan)
        # The farther of two crossings is where a line leaves a round part.
        use = slice(0, 3) if part.shape == "hemisphere" else slice(0, 2)
        square = np.einsum("ij,ij->i", k[:, use], k[:, use])
        middle = -np.einsum("ij,ij->i", x[:, use], k[:, use]) / square
        near = x[:, use] + middle[:, None] * k[:, use]
        along = middle + np.sqrt((a * a - np.einsum("ij,ij->i", near, near)) / square)
        height = x[:, 2] + along * k[:, 2]
        inside = height >= 0.0 if part.shape == "hemisphere" else np.abs(height) <= b / 2
        return np.where(inside, along, np.nan)


def closest_surface(rays: RaySet, seed: int = 1) -> Surface:
    """The surface of least étendue that the lines of almost all light cross: disks, spheres, hemispheres, cylinders.

    The light of a die crosses a small disk at its depth, that of a dome crosses nothing smaller than the dome. Disks and
    rectangles are tried at the depth where half of the light is closest together.

    Parameters
    ----------
    rays : RaySet
        Some of the light; where rays start has no influence.
    seed : int
        Of the search.

    Examples
    --------
    >>> import etendue as et
    >>> sent = et.RingSource(rays=5000).ray_set()
    >>> surface = closest_surface(sent)
    >>> surface.NAME, round(surface.radius), abs(surface.z) < 1.0
    ('disk', 30, True)
    """
    trials = TrialSurfaces(rays, seed, DEFAULT)
    tried: list[Surface] = [*trials.spheres(), *trials.cylinders(), *trials.hemispheres(float(trials.centre[2]))]
    tried += _flats(rays, trials.centre, trials.radius)
    position, direction, flux = rays.position, rays.direction, rays.flux
    least: Surface | None = None
    for surface in sorted(tried, key=lambda s: s.area):
        _, missed = on_surface(surface, position, direction)
        if flux[~missed].sum() >= (1.0 - LEFT_OUT) * flux.sum():
            least = surface
            break
    return trials.sphere(trials.centre) if least is None else least


def _flats(rays: RaySet, centre: Array, reach: float) -> list[Surface]:
    """A disk and a rectangle at the depth where the brightest part of the light that heads upwards is narrowest."""
    up = rays.direction[:, 2] > 0.0
    flux = rays.flux[up]
    if rays.flux[~up].sum() > LEFT_OUT / 2 * rays.flux.sum():
        return []
    x, k = rays.position[up], rays.direction[up]

    def sides(z: float) -> tuple[float, float, float]:
        """Half width and half height of the rectangle, and radius of the disk."""
        at = (x + ((z - x[:, 2]) / k[:, 2])[:, None] * k)[:, :2] - centre[:2]
        # Half of what may be left out on each pair of sides, all of it around.
        width, height = (weighted_quantile(np.abs(side), flux, 1.0 - LEFT_OUT / 4) for side in at.T)
        return width, height, weighted_quantile(np.hypot(*at.T), flux, 1.0 - LEFT_OUT / 2)

    def spread(z: float) -> float:
        """How far half of the light crosses from the middle of all of it: small where the brightest part is."""
        at = (x + ((z - x[:, 2]) / k[:, 2])[:, None] * k)[:, :2]
        middle = [weighted_quantile(side, flux, 0.5) for side in at.T]
        return weighted_quantile(np.hypot(*(at - middle).T), flux, 0.5)

    best, span = float(centre[2]), reach
    for _ in range(2):
        depths = best + span * np.linspace(-1.0, 1.0, DEPTHS)
        best = float(depths[int(np.argmin([spread(float(z)) for z in depths]))])
        span *= 2.0 / (DEPTHS - 1)
    width, height, radius = sides(best)
    middle = (float(centre[0]), float(centre[1]))
    return [Disk(radius, best, middle), Plane(best, 2.0 * width, 2.0 * height, middle)]
