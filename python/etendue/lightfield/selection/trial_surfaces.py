"""The surfaces that are tried for a ray set: of each kind the smallest that take up its light, for a depth or a centre."""

from __future__ import annotations

import dataclasses

import numpy as np

from etendue.lightfield.carrier import Box, Cylinder, Disk, Dome, Hemisphere, Part, Plane, Sphere, Surface
from etendue.lightfield.carrier.cylinder import AXES
from etendue.lightfield.carrier.sizing import SLACK
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.pilot_sample import pilot_sample, selected_rays
from etendue.lightfield.selection.bounding import ball_centre, box_of_lines, cylinder_of_lines, near_rays, start_centre
from etendue.lightfield.selection.line_search import golden_section
from etendue.lightfield.selection.settings import SelectionSettings
from etendue.quantities.ray_set import RaySet

FLATS: tuple[tuple[type[Plane | Disk], bool], ...] = ((Plane, False), (Disk, False), (Plane, True), (Disk, True))
"""Flat surfaces that are tried: kind, and whether only for rays that cross the depth within the ball about the source."""


class TrialSurfaces:
    """The rays of a source without strays, where it is and how large; and the surfaces that suit it.

    Parameters
    ----------
    rays : RaySet
        All that are compared, strays among them.
    seed : int
        Of the search for the smallest ball.
    settings : SelectionSettings

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.selection.settings import DEFAULT
    >>> trials = TrialSurfaces(et.RingSource(rays=5000).ray_set(), 1, DEFAULT)
    >>> round(trials.flat(Disk, False, 0.0, trials.rays).radius)             # the ring reaches to 30 mm
    30
    """

    def __init__(self, rays: RaySet, seed: int, settings: SelectionSettings) -> None:
        focus = np.array(rays.virtual_focus.point)
        near = near_rays(rays.position, rays.direction, focus)
        self.rays, self.seed, self.settings = selected_rays(rays, near), seed, settings
        self.few = pilot_sample(self.rays, settings.search_rays)
        self.position, self.direction = self.rays.position, self.rays.direction
        self.up = self.direction[:, 2] > 0
        self.centre = ball_centre(self.position, self.direction, focus, seed)
        self.start_centre = start_centre(self.position)
        self.least = settings.least_size * float(np.abs(self.position).max())
        self.radius = self.sphere(self.centre).closed("radius")

    def flats(self, z: float) -> list[Plane | Disk]:
        """Rectangles and disks at a depth, for all rays and for those that cross it within the ball."""
        return list(dict.fromkeys(self.flat(kind, within, z, self.rays) for kind, within in FLATS))

    def flat(self, kind: type[Plane | Disk], within: bool, z: float, rays: RaySet) -> Plane | Disk:
        """The smallest rectangle or disk at a depth for some rays, or for those of them that cross it within the ball."""
        if within:
            up = rays.direction[:, 2] > 0
            near = np.hypot(*(crossings(rays, z) - self.centre[:2]).T) <= self.radius * (1 + SLACK)
            if near.any():
                up[up] = near
                rays = selected_rays(rays, up)
        part = Plane(z=z).sized_for(rays).parts()[0]
        (x, y, _), (width, height) = part.centre, (max(length, self.least) for length in part.size)
        if kind is Plane:
            return Plane(z, width, height, (x, y))
        return Disk(max(Disk(z=z, centre=(x, y)).sized_for(rays).closed("radius"), self.least), z, (x, y))

    def nested(self, z: float) -> tuple[Part, ...]:
        """Rectangles at a depth, each within the next, the smallest first; by some of the rays."""
        trims = self.settings.nested_trims
        # Of all rectangles at once: the crossings are put in order once.
        bounds = np.quantile(crossings(self.few, z), [q for trim in trims for q in (trim, 1 - trim)], axis=0)
        return tuple(_rectangle(z, low, high).parts()[0] for low, high in zip(bounds[::2], bounds[1::2], strict=True))

    def centres(self) -> list[FloatArray]:
        """Of the ball, and of the sphere on which the rays start, if they do."""
        return [self.centre, *([] if self.start_centre is None else [self.start_centre])]

    def sphere(self, centre: FloatArray) -> Sphere:
        """The smallest about a centre that the rays allow."""
        sphere = Sphere(centre=_triple(centre)).sized_for(self.rays)
        return dataclasses.replace(sphere, radius=max(sphere.closed("radius"), self.least))

    def spheres(self) -> list[Surface]:
        """As small as the rays allow."""
        return [self.sphere(c) for c in self.centres()]

    def hemispheres(self, z: float) -> list[Surface]:
        """As small as the rays allow, also with the rim at a depth, and where few lines leave below it."""
        centres = [*self.centres(), *(np.array([*self.centre[:2], rim]) for rim in (z, self.rim()))]
        spheres = [self.sphere(c) for c in centres]
        return [Hemisphere(sphere.radius, sphere.centre) for sphere in spheres]

    def rim(self) -> float:
        """The height near the ball's centre at which the least flux leaves a hemisphere through its floor [mm].

        Of a hemisphere the height of the smallest ball is ill-defined: only lines that graze the rim hold it.
        """
        offset, k, flux = self.few.position - self.centre, self.few.direction, self.few.flux

        def flux_above_floor(height: float) -> float:
            x = offset - (0.0, 0.0, height)
            middle = -np.sum(x * k, axis=1)
            near = np.sum(x**2, axis=1) - middle**2
            leaves = x[:, 2] + (middle + np.sqrt(near.max() - near)) * k[:, 2]
            return float(flux[leaves >= 0.0].sum())

        step, tolerance = self.settings.depth_step, self.settings.depth_tolerance
        reach = step * self.radius
        return float(self.centre[2]) + golden_section(flux_above_floor, -reach, reach, tolerance * step * self.radius)

    def domes(self, z: float) -> list[Surface]:
        """With a window as wide as the dome, and with one about what is brightest."""
        domes: list[Surface] = []
        for x, y, _ in self.centres():
            radius = self.sphere(np.array([x, y, z])).closed("radius")
            window = _window(np.hypot(*(crossings(self.rays, z) - (x, y)).T), radius)
            windows = (None,) if window is None or window < self.least else (None, window)
            domes += [Dome(radius, z, width, (float(x), float(y))) for width in windows]
        return domes

    def cylinders(self) -> list[Surface]:
        """Along each axis one about the start points, unless they are flat, and the smallest that all lines meet."""
        low, high = self.position.min(axis=0), self.position.max(axis=0)
        found: list[Cylinder | None] = []
        for along, axis in enumerate(AXES):
            if high[along] - low[along] > self.settings.depth_tolerance * self.radius:
                x, y = (float(v) for v in np.delete((low + high) / 2.0, along))
                found.append(Cylinder(centre=(x, y), axis=axis).sized_for(self.rays))
            found.append(cylinder_of_lines(self.position, self.direction, self.centre, self.seed, axis))
        return [dataclasses.replace(c, radius=max(c.closed("radius"), self.least)) for c in found if c is not None]

    def boxes(self) -> list[Surface]:
        """About the start points, and a small one that nearly all lines meet."""
        lines = box_of_lines(self.position, self.direction, self.centre, self.radius)
        return [Box().sized_for(self.rays), *([] if lines is None else [lines])]


def crossings(rays: RaySet, z: float) -> FloatArray:
    """x, y where the rays that head upwards cross a depth [mm], shape (n, 2).

    Examples
    --------
    >>> import etendue as et
    >>> crossings(et.RaySet([[0, 0, 1], [0, 0, 1]], [[0.6, 0, 0.8], [0, 0, -1]], [1, 1]), 5.0).tolist()
    [[3.0, 0.0]]
    """
    x, k = rays.position, rays.direction
    up = np.flatnonzero(k[:, 2] > 0)
    x, k = x[up], k[up]
    hit: FloatArray = x[:, :2] + ((z - x[:, 2]) / k[:, 2])[:, None] * k[:, :2]
    return hit


def _window(reach: FloatArray, radius: float) -> float | None:
    """Radius of the window of a dome, from how far from its axis the rays cross it; None if as wide as the dome.

    Of two levels of luminance, one on the window and one on the hemisphere, these radii are the most likely.
    """
    shares = np.linspace(0.05, 0.995, 190)
    edges = np.quantile(reach, shares)
    shares, edges = shares[(edges > 0.0) & (edges < radius)], edges[(edges > 0.0) & (edges < radius)]
    if not len(edges):
        return None
    likelihood = shares * np.log(shares / edges**2) + (1.0 - shares) * np.log((1.0 - shares) / (2.0 * radius**2))
    return float(edges[np.argmax(likelihood)])


def _rectangle(z: float, low: FloatArray, high: FloatArray) -> Plane:
    """The rectangle at a depth between two corners, and a little more; of some size, wherever they lie."""
    room = np.where(high > low, (high - low) * (1 + SLACK), 1e-3)
    middle = (low + high) / 2
    return Plane(z, float(room[0]), float(room[1]), (float(middle[0]), float(middle[1])))


def _triple(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return (x, y, z)
