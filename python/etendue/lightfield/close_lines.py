"""Whether the lines of a light field pass each other as closely as those of the rays that it was fitted to.

A field is as sharp as its cells where the light crosses its surface. Further back cells of direction blur it, and where
light comes from several depths no surface is near to all of it. Rays and fields that agree have as many other lines within a
small distance of any line; where the source is blurred, the rays have more of them, whatever its depth and its shape.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from etendue.concurrency import on_one_blas_thread
from etendue.lightfield.carrier import Surface
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

ASKED, AMONG = 256, 8192
"""Lines of the rays that are looked at, and how many others may pass them."""

NEAREST = 40.0
"""Rays, of equal ones, that lie within the distance at which lines are counted. Their ratio errs by some √(2/NEAREST)."""

FEWEST_LINES = 400.0
"""Equal rays below which there are not enough of them nearby."""

BLURRED = 2.0
"""Times as many lines of the rays as of the field from which on the place is blurred: three to four standard errors, and
three or four times the luminance."""

TOLD = 0.1
"""Share of the light that must come from such places. Of sharp fields of known sources chance finds 0.02 at most."""

LEAST_SINE = 1e-6
"""Of the angle between two lines: below it they are taken to be parallel."""

SEED = 0x434C_4F53
"""Of which lines are looked at, and of the lines of the field."""


@on_one_blas_thread
def crowding(rays: RayStream, field: EtendueDensity) -> FloatArray:
    """How many more lines of the rays than of the field pass close to some lines of the rays: one ratio for each of these.

    The lines are drawn from the rays by their flux. Close is what about `NEAREST` of the rays are.

    Returns
    -------
    array, shape (lines,)
        Up to `ASKED` ratios; none of fewer rays than `FEWEST_LINES` equal ones and those lines.

    Raises
    ------
    ArgumentError
        If the rays have no position or carry no flux.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=20_000)
    >>> surfaces = et.Disk(radius=30), et.Sphere(radius=3000)
    >>> sharp, blurred = (et.LightField.fit(rays, surface, depths=(2, 2, 2, 2)) for surface in surfaces)
    >>> [round(float(np.median(crowding(rays, field)))) for field in (sharp, blurred)]
    [1, 3]
    """
    some = pilot_sample(rays, ASKED + AMONG)
    rng = np.random.default_rng(SEED)
    order = rng.permutation(len(some))
    asked, among = order[:ASKED], order[ASKED:]
    flux = some.flux[among]
    equal = float(flux.sum() ** 2 / np.square(flux).sum()) if len(among) else 0.0
    if equal < FEWEST_LINES:
        return np.zeros(0)
    # Bright rays stand for more of the light.
    asked = rng.choice(asked, len(asked), p=some.flux[asked] / some.flux[asked].sum())
    centre = np.average(some.position, axis=0, weights=some.flux)
    lines = some.position[asked] - centre, some.direction[asked]
    to_rays = _distances(*lines, some.position[among] - centre, some.direction[among])
    # The distance within which rays have the share of the flux that NEAREST of as many equal ones would have: three times as
    # many as it takes on average are put in order.
    many = min(math.ceil(3.0 * NEAREST * len(among) / equal), len(among) - 1)
    rows = np.arange(len(asked))
    nearest = np.argpartition(to_rays, many, axis=1)[:, : many + 1]
    nearest = nearest[rows[:, None], np.argsort(to_rays[rows[:, None], nearest], axis=1)]
    within = np.cumsum(flux[nearest], axis=1) / flux.sum()
    last = np.minimum((within < NEAREST / equal).sum(axis=1), many)
    distance, share = to_rays[rows, nearest[rows, last]], within[rows, last]
    drawn: RaySet = FieldRays(field, AMONG, SEED).ray_set()
    to_field = _distances(*lines, drawn.position - centre, drawn.direction)
    found = (to_field < distance[:, None]).mean(axis=1)
    ratio: FloatArray = share / np.maximum(found, 0.5 / AMONG)
    return ratio


def blurred_share(ratio: FloatArray) -> float:
    """Share of the light that comes from where a field blurs it, of the ratios that `crowding` finds; 0 of none.

    Examples
    --------
    >>> blurred_share(np.array([0.9, 1.1, 3.0, 1.0])), blurred_share(np.zeros(0))
    (0.25, 0.0)
    """
    return float((ratio > BLURRED).mean()) if len(ratio) else 0.0


def told_of_blur(surface: Surface, ratio: FloatArray) -> Iterator[str]:
    """What is to be said of a field on a surface that blurs where some of the light comes from.

    Examples
    --------
    >>> from etendue.lightfield.carrier import Disk
    >>> list(told_of_blur(Disk(radius=30), np.array([0.9, 1.1, 3.0, 1.0])))  # doctest: +ELLIPSIS
    ['lines that carry some 25% of the light pass each other 3 times as closely as this light field has them: ...']
    """
    share = blurred_share(ratio)
    if share < TOLD:
        return
    times = float(np.median(ratio[ratio > BLURRED]))
    yield (
        f"lines that carry some {share:.0%} of the light pass each other {times:.2g} times as closely as this light field "
        f"has them: it blurs what lies behind {surface.told}, or at several depths, and luminances there are too low, by "
        "more than their errors; a cone shows them from the rays themselves, and light fields of the single sources are "
        "sharper"
    )


def _distances(origin: FloatArray, along: FloatArray, origins: FloatArray, directions: FloatArray) -> FloatArray:
    """Of each of some lines from each of others [mm], shape (lines, others).

    |(q - p)·(k × m)|/|k × m|; of parallel lines |(q - p) × k|.

    Parameters
    ----------
    origin, along : array, shape (lines, 3)
        A point of each line [mm] and its unit vector, p and k.
    origins, directions : array, shape (others, 3)
        Of the others, q and m.
    """
    # In place: tables of millions of pairs, for which new memory takes longer than what is worked out.
    apart: FloatArray = along @ np.cross(directions, origins).T
    apart += np.cross(along, origin) @ directions.T
    sine = along @ directions.T
    sine *= sine
    np.subtract(1.0, sine, out=sine)
    parallel = np.nonzero(sine <= LEAST_SINE**2)
    np.sqrt(np.maximum(sine, LEAST_SINE**2, out=sine), out=sine)
    np.abs(apart, out=apart)
    apart /= sine
    between = origins[parallel[1]] - origin[parallel[0]]
    apart[parallel] = np.linalg.norm(np.cross(between, along[parallel[0]]), axis=1)
    return apart
