"""Four sources whose luminance is known in closed form, for everything that estimates luminance from rays.

None has a mirror or rotation symmetry that could hide a swapped axis or a wrong sign. Each gives

- ``luminance(points, directions)``: of the light that leaves along the lines through `points` (n, 3) [mm] towards the
  unit `directions` (n, 3), in cd/m², (n,). It is a property of the line: the same for every point of it outside;
- ``total_flux`` [lm]: ∫ L dA dp dq in closed form, or by Gauss rules between all edges of the integrand (to 1e-9);
- ``rays(n, seed)``: position and direction (n, 3) of rays of equal flux, drawn exactly (by rejection);
- ``extent``: (x0, x1, y0, y1) [mm] of what shines, on z = 0.

``DieUnderDome`` is two families: looked at on the plane of the die, and on the hemisphere just outside its dome.
"""

from __future__ import annotations

import abc
import dataclasses
import functools
import itertools
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Extent = tuple[float, float, float, float]

MM2 = 1e-6
"""Square millimetre in square metres."""

BATCH = 1 << 16
"""Proposals of a rejection step: few enough for their arrays to stay in the cache."""


_rule = functools.cache(np.polynomial.legendre.leggauss)
"""Found once: one total flux asks for hundreds, of two sizes."""


def _gauss(nodes: int, low: float, high: float) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights between `low` and `high`."""
    x, w = _rule(nodes)
    return low + (high - low) * (x + 1) / 2, (high - low) * w / 2


def _disk_rule(nodes: int) -> tuple[Array, Array, Array]:
    """Nodes x, y and weights on the unit disk for functions that are smooth in x, y and √(1 − x² − y²); Σ w = π."""
    cosine, w = _gauss(nodes, 0.0, 1.0)
    turn = 2 * np.pi * (np.arange(2 * nodes) + 0.5) / (2 * nodes)
    sine = np.sqrt(1 - cosine**2)[:, None]
    return (
        (sine * np.cos(turn)).ravel(),
        (sine * np.sin(turn)).ravel(),
        np.repeat(w * cosine * np.pi / nodes, 2 * nodes),
    )


def _on_disk(rng: np.random.Generator) -> tuple[Array, Array]:
    """A batch of uniform points on the unit disk: positions on it, or direction cosines of a Lambertian emitter."""
    r, turn = np.sqrt(rng.random(BATCH)), rng.random(BATCH) * (2 * np.pi)
    return r * np.cos(turn), r * np.sin(turn)


def _rays(x: Array, y: Array, p: Array, q: Array) -> tuple[Array, Array]:
    """Position on z = 0 and unit direction from their coordinates."""
    return (
        np.stack([x, y, np.zeros_like(x)], axis=-1),
        np.stack([p, q, np.sqrt(np.maximum(1 - p * p - q * q, 0.0))], axis=-1),
    )


def _first(n: int, batches: Iterator[tuple[Array, Array]]) -> tuple[Array, Array]:
    """First n rays of endless batches."""
    position, direction = np.zeros((n, 3)), np.zeros((n, 3))
    have = 0
    while have < n:
        x, d = next(batches)
        some = slice(have, have + min(len(x), n - have))
        position[some], direction[some] = x[: n - have], d[: n - have]
        have = some.stop
    return position, direction


def _azimuthal(p: Array, q: Array, drop: float, tilt: tuple[float, float], cross: float) -> Array:
    """A limb-darkened Lambertian emitter, 1 − drop (1 − cos θ), tilted and stretched: its integral over p, q is
    π (1 − drop / 3) whatever the tilt and the cross term, for those are odd."""
    cosine = np.sqrt(np.maximum(1 - p * p - q * q, 0.0))
    return 1 - drop * (1 - cosine) + tilt[0] * p + tilt[1] * q + cross * p * q


class _Planar(abc.ABC):
    """A source on z = 0 that shines upwards; what it lacks is the luminance at coordinates x, y, p, q."""

    extent: Extent
    ceiling: float
    """No luminance is above it [cd/m²]."""

    @abc.abstractmethod
    def at(self, *, x: Array, y: Array, p: Array, q: Array) -> Array:
        """Luminance [cd/m²] at x, y [mm] towards the direction cosines p, q; 0 outside the source."""

    def luminance(self, *, points: Array, directions: Array) -> Array:
        """Luminance [cd/m²] along lines; see the module."""
        up = directions[:, 2] > 0
        p, q, cosine = np.where(up[:, None], directions, (0.0, 0.0, 1.0)).T
        x, y, z = points.T
        return np.where(up, self.at(x=x - z / cosine * p, y=y - z / cosine * q, p=p, q=q), 0.0)

    def positions(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """A batch of x, y [mm], uniform on an area that holds the source."""
        x0, x1, y0, y1 = self.extent
        return x0 + (x1 - x0) * rng.random(BATCH), y0 + (y1 - y0) * rng.random(BATCH)

    def rays(self, n: int, *, seed: int) -> tuple[Array, Array]:
        """Position and direction (n, 3) of rays of flux ``total_flux / n`` each; see the module."""
        rng = np.random.default_rng(seed)

        def batches() -> Iterator[tuple[Array, Array]]:
            while True:
                x, y, p, q = z = np.stack([*self.positions(rng), *_on_disk(rng)])
                yield _rays(*z[:, rng.random(BATCH) * self.ceiling < self.at(x=x, y=y, p=p, q=q)])

        return _first(n, batches())


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Disk(_Planar):
    """Lengths in mm, the luminance scale in cd/m²."""

    radius: float = 11.2
    centre: tuple[float, float] = (0.9, -0.5)
    scale: float = 5000.0

    @property
    def extent(self) -> Extent:
        (x, y), r = self.centre, self.radius
        return x - r, x + r, y - r, y + r

    def normalised(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Coordinates in which the disk is the unit disk."""
        return (x - self.centre[0]) / self.radius, (y - self.centre[1]) / self.radius

    def positions(self, rng: np.random.Generator) -> tuple[Array, Array]:
        x, y = _on_disk(rng)
        return self.centre[0] + self.radius * x, self.centre[1] + self.radius * y


@dataclasses.dataclass(frozen=True, kw_only=True)
class LimbDarkenedDisk(_Disk):
    """Family 1: smooth and separable. The luminance falls by a third towards the limb, about a point beside the centre,
    along a tilted gradient; the deviation from the cosine law depends on the azimuth."""

    drop: ClassVar[float] = 0.25

    @property
    def ceiling(self) -> float:
        return 1.4 * self.scale

    @staticmethod
    def _surface(x: Array, y: Array) -> Array:
        return (1 - 0.3 * ((x - 0.25) ** 2 + (y + 0.15) ** 2)) * (1 + 0.18 * x - 0.11 * y)

    def at(self, *, x: Array, y: Array, p: Array, q: Array) -> Array:
        x, y = self.normalised(x, y)
        inside = x * x + y * y <= 1
        return self.scale * inside * self._surface(x, y) * _azimuthal(p, q, self.drop, (0.09, -0.06), 0.08)

    @functools.cached_property
    def total_flux(self) -> float:
        x, y, w = _disk_rule(6)  # the surface is a cubic
        area = self.radius**2 * MM2
        return float(self.scale * area * (w @ self._surface(x, y)) * np.pi * (1 - self.drop / 3))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cut:
    """What a prism film lets through against u, the direction cosine along its pitch: a lobe 1 − dim u² between `low` and
    `high`, a side lobe beyond `side`, which has its sign, and a leak elsewhere."""

    azimuth: float
    low: float
    high: float
    dim: float
    side: float
    side_level: float
    leak: float

    @property
    def axis(self) -> tuple[float, float]:
        return float(np.cos(np.radians(self.azimuth))), float(np.sin(np.radians(self.azimuth)))

    @property
    def edges(self) -> Array:
        return np.array([self.low, self.high, self.side])

    def through(self, u: Array) -> Array:
        beyond = u * np.sign(self.side) > abs(self.side)
        lobe = (u > self.low) & (u < self.high)
        return np.where(lobe, 1 - self.dim * u * u, np.where(beyond, self.side_level, self.leak))


@dataclasses.dataclass(frozen=True, kw_only=True)
class PrismaticFilm(_Disk):
    """Family 2: two crossed prism films with different, oblique directions and sharp cut-offs on a smooth disk. The
    cut-offs of the first move with x, so that position and direction are not quite separable."""

    first: ClassVar[Cut] = Cut(azimuth=20.0, low=-0.52, high=0.63, dim=0.25, side=0.83, side_level=0.35, leak=0.03)
    second: ClassVar[Cut] = Cut(azimuth=118.0, low=-0.45, high=0.71, dim=0.15, side=-0.88, side_level=0.25, leak=0.05)
    walk: ClassVar[float] = 0.04
    """Shift of the first film's cut-offs from the centre of the disk to its rim."""

    @property
    def ceiling(self) -> float:
        return 1.1 * self.scale

    @staticmethod
    def _surface(x: Array, y: Array) -> Array:
        return 1 + 0.2 * x - 0.14 * y - 0.3 * (x * x + y * y)

    def at(self, *, x: Array, y: Array, p: Array, q: Array) -> Array:
        x, y = self.normalised(x, y)
        (a, b), (c, d) = self.first.axis, self.second.axis
        films = self.first.through(a * p + b * q - self.walk * x) * self.second.through(c * p + d * q)
        return self.scale * (x * x + y * y <= 1) * self._surface(x, y) * films

    @functools.cached_property
    def total_flux(self) -> float:
        turns, w = _gauss(48, -np.pi / 2, np.pi / 2)
        total = 0.0
        for x, half, weight in zip(np.sin(turns), np.cos(turns), w, strict=True):
            y, chord = _gauss(3, -half, half)
            total += weight * half * (chord @ self._surface(np.array(x), y)) * self._projected(x)
        return float(self.scale * self.radius**2 * MM2 * total)

    def _projected(self, x: float) -> float:
        """∫ of both films over p, q at one x: along u, the cosine of the first film, and the chord across it.

        The chord is cut where the second film has its edges, so that what is left there is a parabola; u is cut where the
        first film has its edges and where those of the second meet the rim.
        """
        turn = np.radians(self.second.azimuth - self.first.azimuth)
        meets = [np.cos(np.arccos(self.second.edges) + sign * turn) for sign in (-1, 1)]
        knots = np.arcsin(np.sort(np.concatenate([[-1, 1], self.first.edges + self.walk * x, *meets])))
        total = 0.0
        for low, high in itertools.pairwise(knots):
            tau, w = _gauss(20, low, high)
            u, half = np.sin(tau), np.cos(tau)
            edges = np.clip((self.second.edges[:, None] - u * np.cos(turn)) / np.sin(turn), -half, half)
            edges = np.sort(np.concatenate([[-half], edges, [half]]), axis=0)
            nodes, weights = _gauss(2, 0.0, 1.0)
            widths = np.diff(edges, axis=0)
            v = edges[:-1, :, None] + widths[..., None] * nodes
            films = self.second.through(u[:, None] * np.cos(turn) + v * np.sin(turn)) @ weights
            total += float((w * half * self.first.through(u - self.walk * x)) @ (films * widths).sum(axis=0))
        return total


@dataclasses.dataclass(frozen=True, kw_only=True)
class StructuredLed(_Planar):
    """Fine structure: a slanted die beside the origin with rounded corners, contact fingers at uneven distances, a bus bar
    and two bond wires across. Its own axes u, v have their origin in the middle of the die."""

    centre: tuple[float, float] = (0.11, -0.07)
    azimuth: float = 17.0
    half: tuple[float, float] = (0.5, 0.42)
    corner: float = 0.12
    scale: float = 4e6
    fingers: ClassVar[tuple[float, ...]] = (-0.36, -0.235, -0.08, 0.03, 0.19, 0.27, 0.4)
    finger_width: ClassVar[float] = 0.018
    bar: ClassVar[tuple[float, float]] = (0.13, 0.165)
    wires: ClassVar[tuple[tuple[float, ...], ...]] = ((-0.33, 0.24, -0.21, 0.42), (0.3, 0.42, -0.42, -0.05))
    """Each the u of its middle at both ends, then the v of both ends."""
    wire_width: ClassVar[float] = 0.03
    drop: ClassVar[float] = 0.12

    @property
    def ceiling(self) -> float:
        return 1.4 * self.scale

    @property
    def axes(self) -> tuple[float, float]:
        return float(np.cos(np.radians(self.azimuth))), float(np.sin(np.radians(self.azimuth)))

    @property
    def extent(self) -> Extent:
        (a, b), (c, s), r = self.half, self.axes, self.corner
        x, y = r + (a - r) * c + (b - r) * s, r + (a - r) * s + (b - r) * c
        return self.centre[0] - x, self.centre[0] + x, self.centre[1] - y, self.centre[1] + y

    def _breadth(self, v: Array) -> Array:
        """Half the breadth of the die along u at v; 0 where there is none."""
        into = np.maximum(np.abs(v) - (self.half[1] - self.corner), 0.0)
        round_off = self.corner - np.sqrt(np.maximum(self.corner**2 - into**2, 0.0))
        return np.where(into < self.corner, self.half[0] - round_off, 0.0)

    @staticmethod
    def _wire_middle(wire: tuple[float, ...], v: Array) -> Array:
        """u of a wire's middle at v; far away beyond its ends."""
        u0, u1, v0, v1 = wire
        return np.where((v - v0) * (v1 - v) >= 0, u0 + (u1 - u0) * (v - v0) / (v1 - v0), np.inf)

    def _surface(self, u: Array, v: Array) -> Array:
        """Luminance at the normal over the scale; linear in u between edges."""
        level = np.where(np.abs(u) < self._breadth(v), 1 + 0.3 * u - 0.25 * v, 0.0)
        nearest = np.min([np.abs(u - finger) for finger in self.fingers], axis=0)
        level *= np.where((nearest < self.finger_width / 2) | ((v > self.bar[0]) & (v < self.bar[1])), 0.25, 1.0)
        for wire in self.wires:
            level *= np.where(np.abs(u - self._wire_middle(wire, v)) < self.wire_width / 2, 0.1, 1.0)
        return level

    def at(self, *, x: Array, y: Array, p: Array, q: Array) -> Array:
        (c, s), x, y = self.axes, x - self.centre[0], y - self.centre[1]
        return (
            self.scale * self._surface(c * x + s * y, c * y - s * x) * _azimuthal(p, q, self.drop, (0.05, 0.08), -0.1)
        )

    @functools.cached_property
    def total_flux(self) -> float:
        """The surface is linear along u between edges; along v it is smooth between the knots where edges meet."""
        (a, b), r, width = self.half, self.corner, self.wire_width
        fingers = np.add.outer([-self.finger_width / 2, self.finger_width / 2], self.fingers).ravel()
        into = np.maximum(np.abs(fingers) - (a - r), 0.0)
        ends = b - r + np.sqrt(r * r - into * into)
        knots = [-b, r - b, *self.bar, b - r, b, *ends, *-ends]
        for u0, u1, v0, v1 in self.wires:
            meets = np.add.outer([-width / 2, width / 2], [*fingers, a]).ravel()
            knots += [v0, v1, *(v0 + (meets - u0) / (u1 - u0) * (v1 - v0))]
        edges = np.unique(np.clip(knots, -b, b))
        t, w = _gauss(16, 0.0, 1.0)
        total = 0.0
        for low, high in itertools.pairwise(edges):
            v = low + (high - low) * (3 - 2 * t) * t * t  # at the round corners square roots in v are smooth in t
            breadth = self._breadth(v)
            wires = [self._wire_middle(wire, v) + side * width / 2 for wire in self.wires for side in (-1, 1)]
            cuts = np.stack([-breadth, *(np.full_like(v, u) for u in fingers), *wires, breadth])
            cuts = np.sort(np.clip(cuts, -breadth, breadth), axis=0)
            along = (np.diff(cuts, axis=0) * self._surface((cuts[1:] + cuts[:-1]) / 2, v)).sum(axis=0)
            total += float((w * (high - low) * 6 * t * (1 - t)) @ along)
        return float(self.scale * MM2 * total * np.pi * (1 - self.drop / 3))


@dataclasses.dataclass(frozen=True, kw_only=True)
class DieUnderDome:
    """Families 3 and 4: an L-shaped die with a dark contact finger on z = 0, in a hemisphere of index n about the origin.

    The die is uneven, and not Lambertian, inside the medium. A line is traced back to the point where it leaves the dome,
    refracted into it and met with the plane of the die: L = T L_die / n², with the Fresnel transmittance T of unpolarised
    light; what is reflected there is lost. A Lambertian floor on the outside of the dome carries the share `floor` of the
    flux: its light leaves in every direction, some of it downwards past the rim.
    """

    index: float = 1.5
    radius: float = 1.264
    floor: float = 2e-3
    scale: float = 2e7
    """Luminance inside the medium [cd/m²]."""
    die: ClassVar[Extent] = (-0.42, 0.58, -0.5, 0.4)
    notch: ClassVar[tuple[float, float]] = (0.28, 0.1)
    """The corner beyond these x and y is missing."""
    finger: ClassVar[tuple[float, float]] = (0.02, 0.09)
    drop: ClassVar[float] = 0.2

    @property
    def extent(self) -> Extent:
        return -self.radius, self.radius, -self.radius, self.radius

    def die_luminance(self, *, x: Array, y: Array, p: Array, q: Array) -> Array:
        """Luminance [cd/m²] of the die inside the medium at x, y [mm] towards the direction cosines p, q there."""
        x0, x1, y0, y1 = self.die
        die = (x > x0) & (x < x1) & (y > y0) & (y < y1) & ~((x > self.notch[0]) & (y > self.notch[1]))
        contact = np.where((x > self.finger[0]) & (x < self.finger[1]), 0.3, 1.0)
        angular = _azimuthal(p, q, self.drop, (0.12, -0.08), 0.1)
        return self.scale * die * contact * (1 + 0.35 * x - 0.25 * y) * angular

    def transmittance(self, *, cos_inside: Array, cos_outside: Array) -> Array:
        """Of the dome's surface, for unpolarised light, from the cosines on both sides."""
        n = self.index
        s = (n * cos_inside - cos_outside) / (n * cos_inside + cos_outside)
        p = (n * cos_outside - cos_inside) / (n * cos_outside + cos_inside)
        return 1 - (s * s + p * p) / 2

    def luminance(self, *, points: Array, directions: Array) -> Array:
        """Luminance [cd/m²] along lines; see the module."""
        nearest = points - np.sum(points * directions, axis=1)[:, None] * directions
        square = self.radius**2 - np.sum(nearest**2, axis=1)
        root = np.sqrt(np.maximum(square, 0.0))
        leaves = nearest + root[:, None] * directions
        cos_outside = root / self.radius
        cos_inside = np.sqrt(1 - (1 - cos_outside**2) / self.index**2)
        inside = directions / self.index + (cos_inside - cos_outside / self.index)[:, None] * leaves / self.radius
        rises = inside[:, 2] > 0
        p, q, cosine = np.where(rises[:, None], inside, (0.0, 0.0, 1.0)).T
        x, y = leaves[:, 0] - leaves[:, 2] / cosine * p, leaves[:, 1] - leaves[:, 2] / cosine * q
        die = self.die_luminance(x=x, y=y, p=p, q=q) / self.index**2
        die *= self.transmittance(cos_inside=cos_inside, cos_outside=cos_outside)
        return np.where((square > 0) & (leaves[:, 2] > 0), die * rises + self.floor_luminance, 0.0)

    def _exits(self, x: Array, y: Array, p: Array, q: Array) -> tuple[Array, Array, Array]:
        """Where light from the die leaves the dome, the direction it leaves in, and the share that does."""
        start, inside = _rays(x, y, p, q)
        along = np.sum(start * inside, axis=1)
        way = np.sqrt(along**2 + self.radius**2 - np.sum(start**2, axis=1)) - along
        leaves = start + way[:, None] * inside
        normal = leaves / self.radius
        cos_inside = np.sum(normal * inside, axis=1)
        cos_outside = np.sqrt(1 - self.index**2 * (1 - cos_inside**2))  # no corner of the die is beyond R / n
        outside = self.index * inside + (cos_outside - self.index * cos_inside)[:, None] * normal
        return leaves, outside, self.transmittance(cos_inside=cos_inside, cos_outside=cos_outside)

    @property
    def die_flux(self) -> float:
        """Of the die through the dome [lm], whatever the floor."""
        return _die_flux(dataclasses.replace(self, floor=0.0))

    @functools.cached_property
    def total_flux(self) -> float:
        return self.die_flux / (1 - self.floor)

    @functools.cached_property
    def floor_luminance(self) -> float:
        """Of the scatter floor [cd/m²]."""
        return self.floor * self.total_flux / (2 * np.pi**2 * self.radius**2 * MM2)

    def rays(self, n: int, *, seed: int) -> tuple[Array, Array]:
        """Position on the dome and direction (n, 3) of rays of flux ``total_flux / n`` each; see the module."""
        rng = np.random.default_rng(seed)
        x0, x1, y0, y1 = self.die
        scattered = rng.random(n) < self.floor

        def from_die() -> Iterator[tuple[Array, Array]]:
            while True:
                x, y = x0 + (x1 - x0) * rng.random(BATCH), y0 + (y1 - y0) * rng.random(BATCH)
                p, q = _on_disk(rng)
                level = rng.random(BATCH) * (1.6 * self.scale)
                x, y, p, q, level = np.stack([x, y, p, q, level])[:, level < self.die_luminance(x=x, y=y, p=p, q=q)]
                leaves, outside, share = self._exits(x, y, p, q)
                keep = level < self.die_luminance(x=x, y=y, p=p, q=q) * share
                yield leaves[keep], outside[keep]

        def from_floor() -> Iterator[tuple[Array, Array]]:
            while True:
                up, turn = rng.random(BATCH), rng.random(BATCH) * (2 * np.pi)
                normal = np.stack(
                    [np.sqrt(1 - up * up) * np.cos(turn), np.sqrt(1 - up * up) * np.sin(turn), up], axis=-1
                )
                sphere = rng.normal(size=(BATCH, 3))
                direction = normal + sphere / np.linalg.norm(sphere, axis=1)[:, None]  # cosine-distributed about it
                yield self.radius * normal, direction / np.linalg.norm(direction, axis=1)[:, None]

        position, direction = _first(n, from_die())
        position[scattered], direction[scattered] = _first(int(scattered.sum()), from_floor())
        return position, direction


@functools.cache
def _die_flux(source: DieUnderDome) -> float:
    """Of the die through the dome [lm]: Gauss rules on the six rectangles of the die, and on the disk of p, q."""
    x0, x1, y0, y1 = source.die
    p, q, w = _disk_rule(24)
    total = 0.0
    xs, ys = (x0, *source.finger, source.notch[0], x1), (y0, source.notch[1], y1)
    for (a, b), (c, d) in itertools.product(itertools.pairwise(xs), itertools.pairwise(ys)):
        (gx, wx), (gy, wy) = _gauss(8, a, b), _gauss(8, c, d)
        x, y = (g.ravel() for g in np.meshgrid(gx, gy, indexing="ij"))
        at = {
            "x": np.repeat(x, len(p)),
            "y": np.repeat(y, len(p)),
            "p": np.tile(p, len(x)),
            "q": np.tile(q, len(x)),
        }
        leaving = (source.die_luminance(**at) * source._exits(**at)[2]).reshape(len(x), len(p)) @ w
        total += float(np.outer(wx, wy).ravel() @ leaving)
    return total * MM2
