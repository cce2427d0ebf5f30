"""The beam of a flat surface: the directions of most of the light, where these are few of all directions.

Cells of direction that cover all directions blur a beam that fills a few of them. A disk of direction cosines about the beam
with cells of its own shows it as sharply as the rays tell. Theory section 14.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TypeVar

import numpy as np

from etendue.lightfield.carrier import Disk, Plane
from etendue.lightfield.carrier.part import Beam
from etendue.lightfield.carrier.towards import upright
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.pilot_sample import even_density, pilot_sample
from etendue.lightfield.selection.scorer import WITH_IMAGES, SurfaceScorer
from etendue.quantities.ray_stream import RayStream
from etendue.quantities.weighted_quantile import weighted_quantile

Flat = TypeVar("Flat", bound=Plane | Disk)

RAYS = 1 << 16
"""Rays by which a beam is found, and compared with what is without it."""

FEWEST = 2000
"""Rays below which a surface stays as it is."""

CORE = 0.25
"""Share of the light about the middle of the beam by whose radius the disks that are tried are chosen."""

RADII = (2.1, 3.0, 4.2, 6.0, 8.4)
"""Radii of these disks against that: an even disk needs 2, a Gauss function 5 to hold 999 rays of 1000."""

LARGEST = 0.5
"""Radius from which on a disk has hardly finer cells than all directions have."""

ROUNDS = 8
"""Times that the middle is sought among the nearer half of the light."""

NOISE = 2.0
"""Standard errors by which a field without a beam may lead the one with it by chance."""

GRIDS, GRID = ((2, 6), (3, 5), (4, 4), (5, 3)), (4, 4)
"""Grids of which the best counts for the field without a beam, and that of fields with one: halvings of each coordinate of
place and direction. Without a beam, fine cells of direction are wanted the more the narrower it is."""


def with_beam(
    surface: Flat, rays: RayStream, seed: int = 1, threads: int | None = None, *, is_centred: bool = False
) -> Flat:
    """The surface with the beam that it leaves open, if the field predicts held-out rays about as well with it.

    Its finer cells are then wanted: what they show is not blurred, though the few rays held out here may not tell.

    Parameters
    ----------
    surface : Plane or Disk
        With all its dimensions; a beam that it states stays.
    rays : RayStream
        With positions; few are read.
    seed : int
        Of which rays are held out.
    threads : int, optional
        All cores if None.
    is_centred : bool
        Whether the middle of the beam has to be the normal, as where the field shall be symmetric.

    Returns
    -------
    Plane or Disk
        The beam stays None where the light is not narrow, or fields with a beam predict worse for sure.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> random = np.random.default_rng(1)
    >>> place, slope = random.uniform(-1, 1, (4000, 2)), 0.05 * random.normal(size=(4000, 2)) + (0.2, 0)
    >>> rays = et.RaySet(np.c_[place, np.zeros(4000)], np.c_[slope, np.ones(4000)], np.ones(4000))
    >>> plane = et.Plane(z=0, width=2, height=2, centre=(0, 0))
    >>> [round(x, 1) for x in with_beam(plane, rays).beam]
    [0.2, 0.0, 0.3]
    >>> with_beam(plane, et.RingSource(rays=4000)).beam is None
    True
    """
    if surface.beam is not None:
        return surface
    some = pilot_sample(rays, RAYS)
    direction = some.direction if surface.towards is None else upright(some, surface.towards).direction
    up = direction[:, 2] > 0.0
    if np.count_nonzero(up) < FEWEST:
        return surface
    beams = _beams(direction[up, :2], np.asarray(some.flux, float)[up], is_centred=is_centred)
    if not beams:
        return surface
    beamed = [dataclasses.replace(surface, beam=beam) for beam in beams]
    scorer = SurfaceScorer.of(some, even_density(some), seed, threads)
    without = scorer.score_all([(surface.parts(), grid) for grid in GRIDS], WITH_IMAGES)
    within = scorer.score_all([(other.parts(), GRID) for other in beamed], WITH_IMAGES)
    own = max((one.score for one in without), key=lambda score: score.mean)
    best = max(range(len(within)), key=lambda k: within[k].score.mean)
    lead, error = within[best].score.lead(own)
    return beamed[best] if lead > -NOISE * error else surface


def _beams(cosines: FloatArray, flux: FloatArray, *, is_centred: bool) -> list[Beam]:
    """The disks to be tried, from small to large."""
    middle = np.zeros(2) if is_centred else _middle(cosines, flux)
    distance = np.hypot(*(cosines - middle).T)
    core = weighted_quantile(distance, flux, CORE)
    beams = []
    for factor in RADII:
        radius = factor * core
        if not 0.0 < radius < LARGEST:
            break
        unit = 10.0 ** (math.floor(math.log10(radius)) - 2)
        u, v, radius = (round(x / unit) * unit for x in (*middle.tolist(), radius))
        if math.hypot(u, v) + radius <= 1.0:
            beams.append((float(f"{u:.12g}"), float(f"{v:.12g}"), float(f"{radius:.12g}")))
    return beams


def _middle(cosines: FloatArray, flux: FloatArray) -> FloatArray:
    """Where the light is densest: the median, again and again of the half of the light that is nearest to it."""
    for _ in range(ROUNDS):
        middle = np.array([weighted_quantile(x, flux, 0.5) for x in cosines.T])
        distance = np.hypot(*(cosines - middle).T)
        near = distance <= weighted_quantile(distance, flux, 0.5)
        if np.count_nonzero(near) < FEWEST:
            break
        cosines, flux = cosines[near], flux[near]
    return middle
