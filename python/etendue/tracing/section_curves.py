"""The curves in which a plane cuts a face, found by crossing the face with lines within the plane."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.scene.face_rows import FaceRows
from etendue.tracing.section import Section
from etendue.tracing.section_chains import chains

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

LINES = 384
"""Lines of the grid in either direction. A gap is found for certain if it is wider than half a cell: two pixels."""

MARGINS = (0.0137, 0.0211)
"""Of the grid beyond the face, as shares of its larger side: more than a cell on both sides, and different, so that no line
of the grid falls on an axis or an edge of a face that has symmetry."""

SPLIT = 0.4731
"""Where cells are split: off the middle, for the same reason."""

DEEPEST = 18
"""Splits of a cell in which more than one curve passes: a five hundredth of a cell in either direction."""

FLAT_ENOUGH = 1.5e-5
"""Largest distance between a curve and the middle of a chord, as a share of the face's size; elsewhere along the chord it is
not much more. A pixel is some 5e-4."""

FINEST = 12
"""Halvings of a chord."""

STEPS_OF_A_CELL, STEPS, HALVINGS = 8, 12, 48
"""From its last point a curve is followed in steps of an eighth of a cell, over one and a half cells; the step in which it
ends is halved down to a rounding."""

WIDE = 0.7
"""How far aside a curve is looked for where it may end, as a share of the way on from its last point."""

ENOUGH, FINER, ZOOMS = 8, 8, 4
"""A curve with fewer points is looked at more closely; one with none on a grid so much finer; so many times."""

NOWHERE = (0.0, 0.0, 0.0, 0.0)
"""The cell of a link that needs no second look."""


class _Hits(NamedTuple):
    """Crossings: number of the line, and the points on the section, shape (k, 2)."""

    line: Indices
    points: Array


class _Face:
    """A face by itself, and the lines of one plane that are crossed with it."""

    def __init__(self, shape: dict[str, Any], frame: list[float], trims: list[Any], section: Section) -> None:
        nothing = {"wavelength": np.array([555.0]), "per_mm": np.zeros(1)}
        part = {"shape": shape, "frame": frame, "trims": trims, "solid": None, "flip": False, "finish": 0, "axis": None}
        self.section = section
        self.core = _core.Scene(
            {
                "media": [{"index": {"kind": "constant", "n": 1.0}, "absorption": nothing}],
                "finishes": [{"kind": "fresnel"}],
                "solids": [],
                "faces": FaceRows.of([part]),
                "sources": [],
                "detectors": [],
            }
        )

    def cross(self, starts: Array, ends: Array) -> _Hits:
        """Where segments, given by their ends of shape (n, 2), cross the face."""
        along = ends - starts
        length = np.hypot(*along.T)
        real = np.flatnonzero(length > 0.0)
        unit = along[real] / length[real, None]
        lines, _, t = _core.scene_crossings(self.core, self.section.points(starts[real]), self.section.directions(unit))
        number = real[lines.astype(np.int64)]
        kept = t <= length[number]
        number, t = number[kept], t[kept]
        return _Hits(number, starts[number] + (t / length[number])[:, None] * along[number])

    def nearest(self, middles: Array, normals: Array, low: Array, high: Array) -> tuple[npt.NDArray[np.bool_], Array]:
        """Whether lines through points cross the face between two distances from these, and where nearest to them."""
        hits = self.cross(middles + low[:, None] * normals, middles + high[:, None] * normals)
        gap = np.hypot(*(hits.points - middles[hits.line]).T)
        order = np.lexsort((gap, hits.line))
        line, first = np.unique(hits.line[order], return_index=True)
        found = np.zeros(len(middles), dtype=bool)
        found[line] = True
        points = middles.copy()
        points[line] = hits.points[order][first]
        return found, points


class _Link(NamedTuple):
    """Two points that a curve joins within a cell (left, bottom, right, top)."""

    a: int
    b: int
    cell: tuple[float, float, float, float]


class _Curves:
    """Points found so far, and the links between them."""

    def __init__(self, face: _Face, region: Array) -> None:
        self.face = face
        self.size = float(np.ptp(region, axis=0).max())
        low = region[0] - MARGINS[0] * self.size
        high = region[1] + MARGINS[1] * self.size
        self.u = np.linspace(low[0], high[0], LINES)
        self.v = np.linspace(low[1], high[1], LINES)
        self.points: list[Array] = []
        self.links: list[_Link] = []

    def add(self, points: Array) -> list[int]:
        """Numbers of new points."""
        first = len(self.points)
        self.points.extend(points)
        return list(range(first, len(self.points)))

    def grid(self) -> None:
        """Points on the lines of the grid; in a cell with two of them at its sides, a curve joins these."""
        u, v = self.u, self.v
        lying = self.face.cross(_rows(u[0], v), _rows(u[-1], v))
        upright = self.face.cross(_columns(u, v[0]), _columns(u, v[-1]))
        self.points = [*lying.points, *upright.points]
        if not self.points:
            return
        i = np.clip(np.searchsorted(u, lying.points[:, 0]) - 1, 0, LINES - 2)
        j = np.clip(np.searchsorted(v, upright.points[:, 1]) - 1, 0, LINES - 2)
        columns = np.concatenate([i, i, upright.line - 1, upright.line])
        rows = np.concatenate([lying.line - 1, lying.line, j, j])
        first, second = np.arange(len(i)), len(i) + np.arange(len(j))
        number = np.concatenate([first, first, second, second])
        inside = (columns >= 0) & (columns < LINES - 1) & (rows >= 0) & (rows < LINES - 1)
        keys, number = (columns * LINES + rows)[inside], number[inside]
        order = np.argsort(keys, kind="stable")
        cells, starts = np.unique(keys[order], return_index=True)
        for key, members in zip(cells.tolist(), np.split(number[order], starts[1:]), strict=True):
            column, row = divmod(key, LINES)
            cell = (float(u[column]), float(v[row]), float(u[column + 1]), float(v[row + 1]))
            self.join(cell, members.tolist(), 0)

    def closer(self) -> Array | None:
        """The region around the few points of the grid, or of a finer one; none if there is nothing, or nothing smaller."""
        points = np.array(self.points).reshape(-1, 2)
        if not len(points):
            u, v = (np.linspace(axis[0], axis[-1], FINER * LINES) for axis in (self.u, self.v))
            lying = self.face.cross(_rows(u[0], v), _rows(u[-1], v)).points
            points = np.concatenate([lying, self.face.cross(_columns(u, v[0]), _columns(u, v[-1])).points])
        if not len(points):
            return None
        cell = np.array([self.u[1] - self.u[0], self.v[1] - self.v[0]])
        return np.array([points.min(axis=0) - 1.5 * cell, points.max(axis=0) + 1.5 * cell])

    def join(self, cell: tuple[float, float, float, float], at_sides: list[int], depth: int) -> None:
        """Join the points at the sides of a cell; where there are more than two, its halves are looked at."""
        if len(at_sides) == 2:
            self.links.append(_Link(at_sides[0], at_sides[1], cell))
        if len(at_sides) <= 2 or depth == DEEPEST:
            return
        left, bottom, right, top = cell
        axis = 0 if right - left >= top - bottom else 1
        at = cell[axis] + SPLIT * (cell[axis + 2] - cell[axis])
        start, end = ((at, bottom), (at, top)) if axis == 0 else ((left, at), (right, at))
        new = self.add(self.face.cross(np.array([start]), np.array([end])).points)
        below = [k for k in at_sides if self.points[k][axis] < at]
        above = [k for k in at_sides if self.points[k][axis] >= at]
        lower, upper = list(cell), list(cell)
        lower[axis + 2] = upper[axis] = at
        self.join((lower[0], lower[1], lower[2], lower[3]), below + new, depth + 1)
        self.join((upper[0], upper[1], upper[2], upper[3]), above + new, depth + 1)

    def refine(self) -> None:
        """Look at the middle of every link: a curve that bends gets a point there, a link over a gap is taken away."""
        waiting, self.links = self.links, []
        for round_ in range(FINEST + 1):
            if not waiting:
                return
            a = np.array([self.points[link.a] for link in waiting])
            b = np.array([self.points[link.b] for link in waiting])
            cells = np.array([link.cell for link in waiting])
            middle, normal = (a + b) / 2.0, _normals(b - a)
            found, points = self.face.nearest(middle, normal, *_within(middle, normal, cells))
            flat = np.hypot(*(points - middle).T) <= FLAT_ENOUGH * self.size
            following = []
            for k, link in enumerate(waiting):
                if found[k] and (flat[k] or round_ == FINEST):
                    self.links.append(link)
                elif found[k]:
                    (new,) = self.add(points[k : k + 1])
                    following += [_Link(link.a, new, link.cell), _Link(new, link.b, link.cell)]
            waiting = following

    def end(self) -> None:
        """Go on from the last point of every open curve to where it ends, by halving."""
        degree = np.bincount([k for link in self.links for k in link[:2]], minlength=len(self.points))
        open_ = [pair for link in self.links for pair in (link[:2], link[1::-1]) if degree[pair[0]] == 1]
        if not open_:
            return
        points = np.array(self.points)
        last, before = points[[a for a, _ in open_]], points[[b for _, b in open_]]
        away = last - before
        away /= np.hypot(*away.T)[:, None]
        normal = _normals(away)
        cell = float(np.hypot(self.u[1] - self.u[0], self.v[1] - self.v[0]))
        low, high, best = np.zeros(len(last)), np.zeros(len(last)), last.copy()
        going = np.ones(len(last), dtype=bool)
        for step in cell * np.arange(1, STEPS + 1) / STEPS_OF_A_CELL:
            reach = np.full(len(last), step)
            found, there = self.face.nearest(last + step * away, normal, -WIDE * reach, WIDE * reach)
            low, high = np.where(going & found, step, low), np.where(going, step, high)
            going &= found
            best[going] = there[going]
        # A curve that is still there a cell farther on has no end here that could be found.
        best[going] = last[going]
        for _ in range(HALVINGS):
            step = (low + high) / 2.0
            found, there = self.face.nearest(last + step[:, None] * away, normal, -WIDE * step, WIDE * step)
            found &= ~going
            low, high = np.where(found, step, low), np.where(found, high, step)
            best[found] = there[found]
        for k, (a, _) in enumerate(open_):
            if (best[k] != last[k]).any():
                (new,) = self.add(best[k : k + 1])
                self.links.append(_Link(a, new, NOWHERE))

    def curves(self) -> list[Array]:
        """Points in order along each curve."""
        points = np.array(self.points)
        links = np.array([link[:2] for link in self.links], dtype=np.int64).reshape(-1, 2)
        return [points[chain] for chain in chains(len(points), links)]


def crossed_curves(
    shape: dict[str, Any], frame: list[float], trims: list[Any], section: Section, region: Array
) -> list[Array]:
    """The curves in which a section cuts a face of any shape, within a region.

    The face is crossed with a grid of lines. Within a cell of the grid, the points at its sides are joined; cells with more
    than one curve are split. Every join is then looked at in its middle.

    Parameters
    ----------
    shape, frame, trims
        The face as the tracer takes it.
    section : Section
        The plane.
    region : array, shape (2, 2)
        Left and bottom, right and top of what is looked at [mm].

    Returns
    -------
    list of arrays, each of shape (k, 2)
        See `etendue.tracing.sections.cut_face`.

    Examples
    --------
    >>> from etendue.tracing.section import Section
    >>> disk = {"kind": "flat", "outline": {"kind": "annulus", "inner": 1.0, "outer": 2.0}}
    >>> here = [0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
    >>> curves = crossed_curves(disk, here, [], Section("y", 0.0), np.array([[-2.0, 0.0], [2.0, 0.0]]))
    >>> sorted(sorted(curve[[0, -1], 0].round(9).tolist()) for curve in curves)
    [[-2.0, -1.0], [1.0, 2.0]]
    """
    face = _Face(shape, frame, trims, section)
    for _ in range(ZOOMS):
        found = _Curves(face, region)
        if not found.size > 0.0:
            return []
        found.grid()
        if len(found.points) >= ENOUGH:
            break
        closer = found.closer()
        if closer is None:
            return []
        region = closer
    found.refine()
    found.end()
    return found.curves()


def _rows(u: float, v: Array) -> Array:
    return np.stack([np.full(len(v), u), v], axis=1)


def _columns(u: Array, v: float) -> Array:
    return np.stack([u, np.full(len(u), v)], axis=1)


def _normals(along: Array) -> Array:
    """Unit vectors across."""
    length = np.maximum(np.hypot(*along.T), np.finfo(np.float64).tiny)
    normals: Array = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
    return normals


def _within(points: Array, directions: Array, cells: Array) -> tuple[Array, Array]:
    """Between which distances from points within cells the lines through them stay in the cells."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (cells.reshape(-1, 2, 2) - points[:, None]) / directions[:, None]
    low, high = np.sort(np.where(np.isnan(t), 0.0, t), axis=1).swapaxes(0, 1)
    # Along a side of the cell the other axis sets the limits.
    low = np.where(directions == 0.0, -np.inf, low).max(axis=1)
    high = np.where(directions == 0.0, np.inf, high).min(axis=1)
    return low, high
