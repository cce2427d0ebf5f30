"""Where the light of a plane is sharp: the depth for each inclination, and the window about the brightest place.

A die under a window or a lens is seen at a depth that changes with the angle. One image of it serves all directions once
each ray's place is taken at the depth of its own inclination. Theory section 14.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.denoising.fourier_plane import blur_matrix
from etendue.lightfield.carrier import Plane, Sphere
from etendue.lightfield.carrier.part import FLAT, Focus
from etendue.lightfield.carrier.plane import MOST_FRAMES
from etendue.lightfield.carrier.sizing import STRAY, hits_upwards, sizing_rays
from etendue.lightfield.carrier.towards import upright
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.pilot_sample import even_density, pilot_sample, selected_rays
from etendue.lightfield.selection.scorer import WITH_IMAGES, SurfaceScorer
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

Bools = npt.NDArray[np.bool_]

RAYS = 1 << 16
"""Rays by which the depths are found. Their errors are far below a cell of the finest image that as many rays can fill."""

WAIST_RAYS = 1 << 13
"""Rays by whose spread the depth is sought where the bundle is narrowest; the rings then start from there."""

FEWEST = 2000
"""Rays below which a plane stays as it is: a ring of them would show no image."""

RINGS = 10
"""Rings of inclination with as many rays each, whose depths are found one by one."""

SIDE = 128
"""Cells along a side of the images that are compared."""

BLUR = 1.2
"""Width of the Gaussian that smooths them [cells]."""

FLOOR = 0.02
"""Share of an even image in each of them, so that a stray cannot decide."""

COARSE, FINE = 12, 6
"""Steps to either side in which a depth is first sought, in units of one 80th of the window; then about it, of a third of
that."""

ROUNDS = 3
"""Times that all rings are registered to the image of all of them."""

PROOF = 16.0
"""Gain of the logarithm of the likelihood of the rays that a focus must bring to be taken: two for each ring, or more."""

GRAZING = 0.02
"""Least direction cosine of the rays that are asked: the depth of others moves their places without end."""

MIDDLE = (0.1, 0.9)
"""Quantiles of the places along an axis that hold what is bright, whatever lies beside it."""

ROOM = 1.8
"""Sides of the window, against the distance of these quantiles: an even square or disk needs 1.25 to 1.5."""

GRIDS = ((4, 4), (5, 3), (6, 2))
"""Grids on which fields in a focus and in a flat one are compared: halvings of each coordinate of place and direction."""

ENOUGH = 0.9995
"""Share of the rays within the outermost frame."""


@dataclasses.dataclass(frozen=True, eq=False)
class _Rays:
    """Rays that head upwards: where they cross the plane [mm], their slopes, what they lean, and which of the set they are.

    They lie by groups, one half of a ring after the other. Either half of a ring is looked up in the image of the other.
    """

    place: FloatArray
    slope: FloatArray
    lean: FloatArray
    number: npt.NDArray[np.intp]
    group: npt.NDArray[np.intp]

    @classmethod
    def of(cls, position: FloatArray, direction: FloatArray, z: float) -> _Rays:
        """Those of some positions and directions, where they cross a height [mm]."""
        lean = 1.0 - direction[:, 2]
        # By rank, so that rays of one inclination are dealt to rings as well.
        ring = np.zeros(len(lean), dtype=np.intp)
        ring[np.argsort(lean, kind="stable")] = np.arange(len(lean)) * RINGS // len(lean)
        group = 2 * ring + (np.random.default_rng(1).random(len(lean)) < 0.5)
        order = np.argsort(group, kind="stable")
        x, k = position[order], direction[order]
        slope = k[:, :2] / k[:, 2:]
        return cls(x[:, :2] + (z - x[:, 2:]) * slope, slope, lean[order], order, group[order])

    def at(self, depth: FloatArray | float) -> FloatArray:
        """Their places at heights above the plane [mm]."""
        moved: FloatArray = self.place + np.multiply(depth, self.slope.T).T
        return moved

    def by_ring(self, values: FloatArray) -> FloatArray:
        """Sums over the rays of each ring."""
        return np.bincount(self.group >> 1, values, RINGS).astype(np.float64)

    @functools.cached_property
    def mean_lean(self) -> FloatArray:
        """What the rays of each ring lean on average."""
        return self.by_ring(self.lean) / self.by_ring(np.ones_like(self.lean))


def focused(plane: Plane, rays: RayStream, seed: int = 1, threads: int | None = None) -> Plane:
    """The plane with what it leaves open: its focus, and if its size is open too, a window and frames about it.

    The focus that makes the image of the source sharpest is taken if held-out rays bear out that the field, too, is better
    in it; images alone do not tell how well place and direction go apart.

    Parameters
    ----------
    plane : Plane
        What it states stays. A focus is stated by its four coefficients, all 0 for a flat one.
    rays : RayStream
        With positions; few are read.
    seed : int
        Of which rays are held out.
    threads : int, optional
        All cores if None.

    Returns
    -------
    Plane
        With all its dimensions. The focus stays None where none is proven to be better than a flat one.

    Raises
    ------
    ArgumentError
        If no ray heads towards +Z.

    Examples
    --------
    >>> import etendue as et
    >>> plane = focused(et.Plane(z=0), et.RingSource(rays=20_000))
    >>> plane.focus is None, plane.frames, round(plane.width)
    (True, 0, 60)
    """
    if plane.towards is not None:
        turned = upright(sizing_rays(rays), plane.towards)
        found = focused(dataclasses.replace(plane, towards=None), turned, seed, threads)
        return dataclasses.replace(found, towards=plane.towards)
    some = pilot_sample(rays, RAYS)
    up = some.direction[:, 2] > GRAZING
    enough = np.count_nonzero(up) >= FEWEST
    open_size = plane.width is None and plane.height is None and plane.centre is None

    def sized(focus: Focus | None) -> Plane:
        own = dataclasses.replace(plane, focus=focus)
        return _windowed(own, rays) if open_size and enough else own.sized_for(rays)

    if plane.focus is not None or not enough:
        return sized(plane.focus)
    focus = _focus(_Rays.of(some.position[up], some.direction[up], plane.z))
    flat = sized(None)
    if focus is None:
        return flat
    bent = sized(focus)
    scorer = SurfaceScorer.of(some, even_density(some), seed, threads)
    scores = scorer.score_all([(p.parts(), grid) for p in (flat, bent) for grid in GRIDS], WITH_IMAGES)
    own, other = (max(s, key=lambda score: score.score.mean) for s in (scores[: len(GRIDS)], scores[len(GRIDS) :]))
    return bent if other.leads(own) else flat


def focused_about(z: float, rays: RaySet, seed: int = 1, threads: int | None = None) -> Plane | None:
    """A focused plane near a depth that takes up all rays; None if no window is smaller than what all rays need.

    It lies where light along the horizon is sharp, so that rays start near their places.

    Examples
    --------
    >>> import etendue as et
    >>> focused_about(0.0, et.RingSource(rays=20_000).ray_set()) is None        # a disk on a plane is sharp as it is
    True
    """
    plane = focused(Plane(z=z), rays, seed, threads)
    if plane.focus is None and plane.frames == 0:
        return None
    if plane.focus is not None:
        unit = _unit(plane.closed("width"))
        shift = round(sum(plane.focus) / unit) * unit
        a, b, c, d = plane.focus
        plane = dataclasses.replace(plane, z=plane.z + shift, focus=(round((a - shift) / unit) * unit, b, c, d))
    parts = [part.core() for part in plane.parts()]
    unmet = _core.cross_parts(parts, rays.position, rays.direction)[0] < 0
    if float(rays.flux[unmet].sum()) <= STRAY * rays.total_flux or plane.centre is None:
        return plane
    around = Sphere(centre=(*plane.centre, plane.z)).sized_for(selected_rays(rays, unmet))
    return dataclasses.replace(plane, rest=around.radius)


@dataclasses.dataclass(frozen=True)
class _View:
    """The square in which images are compared."""

    centre: FloatArray
    side: float

    def cells(self, place: FloatArray) -> npt.NDArray[np.intp]:
        """The cell of each place; what lies beside the square has one that comes after all others."""
        x, y = (np.floor(((place - self.centre) / self.side + 0.5) * SIDE).astype(np.intp)).T
        # A bit that a number from 0 to SIDE - 1 does not have is set if either lies beyond.
        return np.where((x | y) & -SIDE, SIDE**2, x * SIDE + y)

    def densities(self, cell: npt.NDArray[np.intp], group: npt.NDArray[np.intp], groups: int) -> FloatArray:
        """A smooth image of each group of rays, of mean 1 and 0 beside the square, shape (groups, cells and one)."""
        size = SIDE**2 + 1
        counts = np.bincount(group * size + cell, minlength=groups * size).reshape(groups, size)
        rays = np.maximum(counts.sum(axis=1), 1)
        blur = blur_matrix(SIDE, BLUR)
        images = np.zeros(counts.shape)
        smooth = blur @ counts[:, :-1].reshape(groups, SIDE, SIDE).astype(np.float64) @ blur
        images[:, :-1] = np.maximum(smooth, 0.0).reshape(groups, -1) * (SIDE**2 / rays)[:, None]
        return images

    def log_likelihoods(
        self, cell: npt.NDArray[np.intp], group: npt.NDArray[np.intp], images: FloatArray
    ) -> FloatArray:
        """Ln of the density of each ray in the image of the other half of its ring or of all rings."""
        seen = images[group ^ 1, cell]
        values: FloatArray = np.log((1.0 - FLOOR) * seen + FLOOR)
        return values


def _focus(rays: _Rays) -> Focus | None:
    """The focus by powers of the lean, or None for a flat one."""
    view, about = _waist(rays)
    step = view.side / 80.0
    depths = about + step * np.arange(-COARSE, COARSE + 1.0)
    whole, own = np.zeros(len(depths)), np.zeros((len(depths), RINGS))
    for i, depth in enumerate(depths):
        cell = view.cells(rays.at(depth))
        half, group = rays.group & 1, rays.group
        whole[i] = view.log_likelihoods(cell, half, view.densities(cell, half, 2)).sum()
        own[i] = rays.by_ring(view.log_likelihoods(cell, group, view.densities(cell, group, 2 * RINGS)))
    one = float(_peaks(depths, whole[:, None])[0][0])
    constant: Focus = (one, 0.0, 0.0, 0.0)
    curved = _fitted(rays, *_peaks(depths, own))
    for _ in range(ROUNDS):
        curved = _registered(rays, view, curved, step / 3.0)
    scores = {focus: _score(rays, view, focus) for focus in (FLAT, constant, curved)}
    best = FLAT
    for focus in (constant, curved):
        if scores[focus] > scores[best] + PROOF:
            best = focus
    unit = _unit(view.side)
    a, b, c, d = (round(f / unit) * unit for f in best)
    return None if best == FLAT else (a, b, c, d)


def _waist(rays: _Rays) -> tuple[_View, float]:
    """Where the bundle is narrowest: the square about it, and its height above the plane [mm]."""
    # Rays near the normal tell the height best; of a beam that leans there may be none within 60°.
    narrow = np.flatnonzero(rays.lean <= max(0.5, float(np.median(rays.lean))))
    narrow = narrow[np.argsort(rays.number[narrow])]
    narrow = narrow[:: max(len(narrow) // WAIST_RAYS, 1)]
    own_place, own_slope = rays.place[narrow], rays.slope[narrow]

    def spans(depth: float) -> FloatArray:
        low, high = np.quantile(own_place + depth * own_slope, MIDDLE, axis=0)
        widths: FloatArray = high - low
        return widths

    extent = float(spans(0.0).max())
    # Between the depths at which the spread has grown for sure; each round looks closer.
    low, high = -2.0 * extent, 2.0 * extent
    about = 0.0
    for _ in range(4):
        grid = np.linspace(low, high, 33)
        about = float(grid[np.argmin([np.log(np.maximum(spans(z), 1e-300)).sum() for z in grid])])
        reach = (high - low) / 16.0
        low, high = about - reach, about + reach
    place = rays.at(about)
    low_corner, high_corner = np.quantile(place, MIDDLE, axis=0)
    side = 2.0 * float((high_corner - low_corner).max())
    return _View((low_corner + high_corner) / 2.0, max(side, 1e-9)), about


def _peaks(depths: FloatArray, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The depth of the maximum of each column by the parabola through three points, and how sharp it is [1/mm²]."""
    at, columns = np.clip(scores.argmax(axis=0), 1, len(depths) - 2), np.arange(scores.shape[1])
    before, here, after = scores[at - 1, columns], scores[at, columns], scores[at + 1, columns]
    bend = np.maximum(2.0 * here - before - after, 1e-9)
    step = depths[1] - depths[0]
    return depths[at] + step * np.clip(0.5 * (after - before) / bend, -1.0, 1.0), bend / step**2


def _fitted(rays: _Rays, depth: FloatArray, weight: FloatArray) -> Focus:
    """The cubic in the lean through the depths of the rings, each believed as much as its maximum is sharp."""
    scale = np.sqrt(weight / weight.max())
    matrix = np.polynomial.polynomial.polyvander(rays.mean_lean, 3) * scale[:, None]
    # Held to the straight line by a little, where few rings say anything.
    mean = float(np.average(depth, weights=weight))
    ridge = 1e-3 * np.diag([0.0, 0.0, 1.0, 1.0])
    wanted = np.append((depth - mean) * scale, np.zeros(4))
    a, b, c, d = (float(v) for v in np.linalg.lstsq(np.vstack([matrix, ridge]), wanted, rcond=None)[0])
    return (mean + a, b, c, d)


def _heights(rays: _Rays, focus: Focus) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyval(rays.lean, focus), dtype=np.float64)


def _registered(rays: _Rays, view: _View, focus: Focus, step: float) -> Focus:
    """Each ring moved to where the image of all rays predicts it best."""
    heights = _heights(rays, focus)
    half = rays.group & 1
    images = view.densities(view.cells(rays.at(heights)), half, 2)
    steps = step * np.arange(-FINE, FINE + 1.0)
    cells = (view.cells(rays.at(heights + dz)) for dz in steps)
    scores = np.array([rays.by_ring(view.log_likelihoods(cell, half, images)) for cell in cells])
    moved, weight = _peaks(steps, scores)
    return _fitted(rays, np.polynomial.polynomial.polyval(rays.mean_lean, focus) + moved, weight)


def _score(rays: _Rays, view: _View, focus: Focus) -> float:
    """Sum of the logarithms of the likelihood."""
    cell, half = view.cells(rays.at(_heights(rays, focus))), rays.group & 1
    return float(view.log_likelihoods(cell, half, view.densities(cell, half, 2)).sum())


def _windowed(plane: Plane, rays: RayStream) -> Plane:
    """The rectangle about what is bright, and frames until almost all rays are in."""
    whole = plane.sized_for(rays)
    place, _ = hits_upwards(rays, plane.z, "Plane", plane.focus or FLAT)
    low, high = np.asarray(np.quantile(place, MIDDLE, axis=0), dtype=np.float64)
    middle, sides = (low + high) / 2.0, ROOM * (high - low)
    everything = np.array([whole.closed("width"), whole.closed("height")])
    if not (sides > 0.0).all() or (sides >= everything / 2.0**0.5).all():
        return whole
    sides = np.maximum(sides, sides.max() / 16.0)
    frames = 0
    while frames < MOST_FRAMES // 2:
        if np.mean((np.abs(place - middle) <= sides * 2.0**frames / 2.0).all(axis=1)) >= ENOUGH:
            break
        frames += 1
    unit = _unit(float(sides.max()))
    width, height = (math.ceil(side / unit) * unit for side in sides)
    centre = (round(middle[0] / unit) * unit, round(middle[1] / unit) * unit)
    return dataclasses.replace(plane, width=width, height=height, centre=centre, frames=frames)


def _unit(length: float) -> float:
    """A power of ten that is a few ten-thousandths of a length: what is found is not known to less."""
    return 10.0 ** (math.floor(math.log10(length)) - 4)
