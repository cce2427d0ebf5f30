"""Where a source is and how large, from its rays alone: strays, and the smallest bodies that the others meet."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.lightfield.carrier import Box, Cylinder
from etendue.lightfield.carrier.cylinder import AXES
from etendue.lightfield.carrier.sizing import SLACK, STRAY
from etendue.lightfield.counting import FloatArray

LINES = 1 << 12
"""Lines that one search for the smallest ball looks at."""

STEPS = 200
"""Steps of that search: the centre is then found to some thousandths of the radius."""

ROUNDS = 20
"""Times that the faces of a box are moved, all six in turn, at most: most stand still after five."""

FLAT = 1e-3
"""Least side of a box, against the radius of the ball that the lines meet, below which a rectangle does as well."""

MISSED = 100.0
"""What lines cost that miss a box, against ln of its area: it may leave a hundredth of them out for being smaller by 1/e."""

STRAYS = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
"""Shares of the rays at which a gap is looked for; those beyond it are strays, at most the last share but one."""

GAP = 1.5
"""Ratio of the distances of successive shares that makes a gap."""

ON_SPHERE = 0.01
"""Largest relative deviation of the distances of start points from a centre if they are to lie on a sphere about it."""


def near_rays(position: FloatArray, direction: FloatArray, centre: FloatArray) -> npt.NDArray[np.bool_]:
    """Which rays are no strays: their lines pass a point not much farther off than almost all others.

    Parameters
    ----------
    position, direction : array, shape (n, 3)
        [mm], unit vectors.
    centre : array, shape (3,)
        [mm]
    """
    distance = np.linalg.norm(np.cross(position - centre, direction), axis=1)
    reach = np.quantile(distance, [1.0 - share for share in STRAYS])
    gaps = np.flatnonzero(reach[:-1] > GAP * reach[1:])
    near: npt.NDArray[np.bool_] = distance <= (GAP * reach[gaps[-1] + 1] if len(gaps) else np.inf)
    return near


def ball_centre(position: FloatArray, direction: FloatArray, start: FloatArray, seed: int) -> FloatArray:
    """Centre of the smallest ball that all lines pass, in any number of dimensions.

    From `start` it steps towards the farthest line, each time a smaller share of the way: the algorithm of
    [BadoiuClarkson2003]_ for points, with the foot of the perpendicular on the line as the point. It looks at some of the
    lines first, then at those that lie farthest out.

    Parameters
    ----------
    position, direction : array, shape (n, d)
        Points of the lines [mm] and unit vectors along them.
    start : array, shape (d,)
        [mm]
    seed : int
        Of the choice of lines.

    Examples
    --------
    >>> turn = np.linspace(0, 2 * np.pi, 1000)
    >>> rim = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> along = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=1)
    >>> bool(np.abs(ball_centre(rim + [5, 0, 1], along, np.zeros(3), 1) - [5, 0, 1]).max() < 0.02)
    True
    """
    centre = start
    everyone = np.arange(len(position))
    few = np.random.default_rng(seed).permutation(everyone)[:LINES]
    for _ in range(2):
        lines = _Lines(position[few], direction[few])
        for step in range(2, STEPS + 2):
            farthest = int(np.argmax(lines.squared_distances(centre)))
            centre = centre + lines.foot(farthest, centre) / step
        few = np.argsort(_Lines(position, direction).squared_distances(centre))[-LINES:]
    return centre


class _Lines:
    """Lines that are asked many times how far from a point they pass: coordinate by coordinate, in memory of their own.

    Parameters
    ----------
    position, direction : array, shape (n, d)
        Points of the lines [mm] and unit vectors along them.
    """

    def __init__(self, position: FloatArray, direction: FloatArray) -> None:
        self.position, self.direction = (np.ascontiguousarray(values.T) for values in (position, direction))
        self.offset = np.zeros_like(self.position)
        self.along, self.product = np.zeros((2, len(position)))

    def squared_distances(self, point: FloatArray) -> FloatArray:
        """Of the feet of the perpendiculars from a point [mm²], shape (n,)."""
        np.subtract(self.position, point[:, None], out=self.offset)
        self.along[:] = 0.0
        for offset, direction in zip(self.offset, self.direction, strict=True):
            self.along += np.multiply(offset, direction, out=self.product)
        squared = np.zeros_like(self.along)
        for offset, direction in zip(self.offset, self.direction, strict=True):
            across = np.subtract(offset, np.multiply(self.along, direction, out=self.product), out=self.product)
            squared += np.multiply(across, across, out=self.product)
        return squared

    def foot(self, line: int, point: FloatArray) -> FloatArray:
        """From a point to the foot of the perpendicular on a line [mm], shape (d,)."""
        x, k = self.position[:, line] - point, self.direction[:, line]
        foot: FloatArray = x - (x @ k) * k
        return foot


def start_centre(position: FloatArray) -> FloatArray | None:
    """Centre of the sphere on which rays start, by linear least squares; None if they do not start on one.

    Parameters
    ----------
    position : array, shape (n, 3)
        Start points [mm].
    """
    middle = position.mean(axis=0)
    offset = position - middle
    unknowns = np.column_stack([2.0 * offset, np.ones(len(offset))])
    centre = np.linalg.lstsq(unknowns, np.sum(offset**2, axis=1), rcond=None)[0][:3]
    distance = np.linalg.norm(offset - centre, axis=1)
    if np.std(distance) > ON_SPHERE * distance.mean():
        return None
    found: FloatArray = middle + centre
    return found


def cylinder_of_lines(
    position: FloatArray, direction: FloatArray, start: FloatArray, seed: int, axis: str = "z"
) -> Cylinder | None:
    """The smallest closed cylinder along X, Y or Z that all lines meet, but for the share `STRAY` on each side.

    None if they all pass one height within the tube, as those of a flat source do. A line meets the cylinder if the lower
    of the heights at which it meets the tube is not above the top, and the higher not below the bottom.

    Parameters
    ----------
    position, direction : array, shape (n, 3)
        [mm], unit vectors.
    start : array, shape (3,)
        Where the search for the axis begins [mm].
    seed : int
        Of the choice of lines.
    axis : str
        ``"x"``, ``"y"`` or ``"z"``.
    """
    along = AXES.index(axis)
    if axis != "z":
        position, direction, start = (np.roll(v, 2 - along, axis=-1) for v in (position, direction, start))
    across = np.hypot(*direction[:, :2].T)
    oblique = across > 0.0
    if not oblique.any():
        return None
    x, k, across = position[oblique], direction[oblique], across[oblique]
    flat = k[:, :2] / across[:, None]
    centre = ball_centre(x[:, :2], flat, start[:2], seed)
    offset = x[:, :2] - centre
    middle = -np.sum(offset * flat, axis=1)
    near = offset + middle[:, None] * flat
    radius = float(np.quantile(np.hypot(*near.T), 1.0 - STRAY)) * (1.0 + SLACK)
    half = np.sqrt(np.maximum(radius**2 - np.sum(near**2, axis=1), 0.0))
    height, climb = x[:, 2] + middle * k[:, 2] / across, half * np.abs(k[:, 2]) / across
    bottom, top = float(np.quantile(height + climb, STRAY)), float(np.quantile(height - climb, 1.0 - STRAY))
    if not (top > bottom and radius > 0):
        return None
    x, y = map(float, centre)
    return Cylinder(radius, bottom, top, (y, x) if axis == "y" else (x, y), axis=axis)


def box_of_lines(position: FloatArray, direction: FloatArray, centre: FloatArray, radius: float) -> Box | None:
    """The box with faces along the axes that is small and that nearly all lines meet.

    It minimises ln A + `MISSED` · m, where A is the area of the box and m the share of the lines that miss it. From the cube
    about a ball on, each face in turn goes where that is least while the other five stand still, until none moves: first
    with some of the lines, then with all. None if it is as good as flat (`FLAT`), as that of parallel lines is.

    Parameters
    ----------
    position, direction : array, shape (n, 3)
        [mm], unit vectors.
    centre : array, shape (3,)
        Of a ball that the lines meet [mm].
    radius : float
        Of that ball [mm].

    Examples
    --------
    Lines through a box of 2 mm × 2 mm × 1 mm in all directions:

    >>> rng = np.random.default_rng(1)
    >>> aim, k = rng.uniform(-3, 3, (200_000, 3)), rng.normal(size=(200_000, 3))
    >>> ways = np.sort(((np.array([[[-1, -1, 0]], [[1, 1, 1]]]) - aim) / k), axis=0)
    >>> met = ways[0].max(axis=1) < ways[1].min(axis=1)
    >>> k /= np.linalg.norm(k, axis=1)[:, None]
    >>> box = box_of_lines(aim[met], k[met], np.zeros(3), 5.0)
    >>> [round(size, 1) for size in (box.width, box.height, box.depth, box.centre[2])]
    [2.0, 2.0, 1.0, 0.5]
    """
    faces = np.stack([centre - radius, centre + radius])
    for some in (slice(None, None, max(1, len(position) // LINES)), slice(None)):
        cost = np.inf
        for _ in range(ROUNDS):
            before = cost
            for axis in range(3):
                ends = _within(faces, position[some], direction[some], axis)
                for side in range(2):
                    faces[side, axis], cost = _best_face(faces, ends, len(position[some]), axis, side)
                if not faces[1, axis] - faces[0, axis] > FLAT * radius:
                    return None
            if not cost < before:
                break
    size, middle = (faces[1] - faces[0]) * (1.0 + SLACK), (faces[0] + faces[1]) / 2.0
    (width, height, depth), (x, y, z) = map(float, size), map(float, middle)
    return Box(width, height, depth, (x, y, z))


def _within(faces: FloatArray, position: FloatArray, direction: FloatArray, axis: int) -> FloatArray:
    """Between which two coordinates along an axis lines pass the other two pairs of faces, shape (2, m)."""
    enters, leaves = np.full((2, len(position)), [[-np.inf], [np.inf]])
    for other in range(3):
        if other != axis:
            with np.errstate(divide="ignore", invalid="ignore"):
                # + 0: no −0, which would swap the ends for lines along a face; 0/0 is such a line in the plane of the face.
                ways = (faces[:, other, None] - position[:, other]) / (direction[:, other] + 0.0)
            enters, leaves = np.fmax(enters, np.fmin(*ways)), np.fmin(leaves, np.fmax(*ways))
    passes = enters <= leaves
    x, k = position[passes, axis], direction[passes, axis]
    ends = x + enters[passes] * k, x + leaves[passes] * k
    return np.stack([np.minimum(*ends), np.maximum(*ends)])


def _best_face(faces: FloatArray, ends: FloatArray, count: int, axis: int, side: int) -> tuple[float, float]:
    """Where one face of a box costs least while the others stand still, and what the box costs then.

    A line meets the box if its interval along the axis and the box overlap, so the best place is the near end of one of the
    intervals.
    """
    outwards = (-1.0, 1.0)[side]
    opposite = outwards * float(faces[1 - side, axis])
    near, far = ends if side else -ends[::-1]
    places = np.sort(np.maximum(near[far >= opposite], opposite))
    if not len(places):  # none is left: the box is one of nothing
        return outwards * opposite, -np.inf
    width, height = np.delete(faces[1] - faces[0], axis)
    missed = 1.0 - np.arange(1, len(places) + 1) / count
    cost = np.log(2.0 * (width * height + (width + height) * (places - opposite))) + MISSED * missed
    best = int(np.argmin(cost))
    return outwards * float(places[best]), float(cost[best])
