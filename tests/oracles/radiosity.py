"""A cylindrical cavity, open at the top, with a luminous disk in its base: the radiosity equation, by Nyström's method.

Wall and base are Lambertian; by symmetry their exitance depends on the height z and on the distance r from the axis only:
B = ρ (E₀ + ∫ K B). The kernels are cos θ cos θ'/(π d²), integrated over the azimuth in closed form.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt
from numpy.polynomial.legendre import leggauss

Array = npt.NDArray[np.float64]


def wall_from_wall(distance: Array, radius: float) -> Array:
    """Share of the light of an element of the wall that a ring of the wall gets, per length of the ring."""
    x = np.abs(distance) / (2 * radius)
    return (1 - x * (2 * x * x + 3) / (2 * (x * x + 1) ** 1.5)) / (2 * radius)


def _pair(z: Array, r: Array, radius: float) -> Array:
    """∫ cos θ cos θ'/(π d²) dφ between a ring of the base and an element of the wall, per area.

    With d² = A − B cos φ, A = R² + r² + z², B = 2Rr: ∫ dφ/d⁴ = 2πA/(A² − B²)^1.5 and ∫ cos φ dφ/d⁴ = 2πB/(A² − B²)^1.5.
    """
    apart = ((radius - r) ** 2 + z * z) * ((radius + r) ** 2 + z * z)
    return 2 * z * radius * (radius**2 + z * z - r * r) / apart**1.5


def wall_to_disk(z: Array, radius: float) -> Array:
    """Share of the light of an element of the wall that reaches a whole end of the cylinder at a distance z along it."""
    x = z / (2 * radius)
    return (x * x + 0.5) / np.sqrt(x * x + 1) - x


def _graded(start: float, end: float, levels: int, at_start: bool, at_end: bool) -> Array:
    """Ends of panels that halve towards ends where the solution is not smooth."""
    steps = 2.0 ** -np.arange(levels, 0, -1)
    rising = np.concatenate([[0.0], steps]) if at_start else np.array([0.0, 0.5])
    falling = np.concatenate([1 - steps[::-1][1:], [1.0]]) if at_end else np.array([1.0])
    return start + (end - start) * np.concatenate([rising, falling])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cavity:
    """Lengths in mm; the disk sends out `exitance` (flux per area) and reflects nothing."""

    radius: float = 21.5
    height: float = 21.4
    reflectance: float = 0.984
    disk: float = 5.0
    exitance: float = 1.0
    nodes: int = 8
    levels: int = 20

    @functools.cached_property
    def _wall(self) -> tuple[Array, Array, Array]:
        """Ends of the panels, nodes, weights."""
        return self._rule(_graded(0.0, self.height, self.levels, at_start=True, at_end=True))

    @functools.cached_property
    def _base(self) -> tuple[Array, Array, Array]:
        return self._rule(_graded(self.disk, self.radius, self.levels, at_start=False, at_end=True))

    def _rule(self, ends: Array) -> tuple[Array, Array, Array]:
        x, w = leggauss(self.nodes)
        half = np.diff(ends)[:, None] / 2
        return ends, ((ends[:-1, None] + half) + half * x).ravel(), (half * w).ravel()

    def _wall_matrix(self, z: Array) -> Array:
        """From exitances at the nodes of the wall to irradiances by the wall; the kernel has a kink where z' = z."""
        ends, nodes, weights = self._wall
        matrix = weights * wall_from_wall(z[:, None] - nodes, self.radius)
        x, w = leggauss(16)
        n = self.nodes
        panel = np.clip(np.searchsorted(ends, z, side="right") - 1, 0, len(ends) - 2)
        for i, k in enumerate(panel):
            own = nodes[k * n : k * n + n]
            matrix[i, k * n : k * n + n] = 0.0
            for low, high in ((ends[k], z[i]), (z[i], ends[k + 1])):
                at = (low + high) / 2 + (high - low) / 2 * x
                part = (high - low) / 2 * w * wall_from_wall(z[i] - at, self.radius)
                matrix[i, k * n : k * n + n] += part @ _lagrange(own, at)
        return matrix

    def _direct(self, z: Array) -> Array:
        """Irradiance of the wall by the luminous disk."""
        x, w = leggauss(40)
        r = self.disk / 2 * (1 + x)
        return self.exitance * (_pair(z[:, None], r, self.radius) * r) @ (self.disk / 2 * w)

    @functools.cached_property
    def _solution(self) -> tuple[Array, Array]:
        """Exitance at the nodes of wall and base."""
        (_, z, wz), (_, r, wr) = self._wall, self._base
        between = _pair(z[:, None], r, self.radius)
        matrix = np.block([
            [self._wall_matrix(z), between * (r * wr)],
            [between.T * (self.radius * wz), np.zeros((len(r), len(r)))],
        ])  # fmt: skip
        start = np.concatenate([self._direct(z), np.zeros(len(r))])
        solved = np.linalg.solve(np.eye(len(start)) - self.reflectance * matrix, self.reflectance * start)
        return solved[: len(z)], solved[len(z) :]

    def on_wall(self, z: Array) -> Array:
        """Irradiance of the wall at heights, in the units of the exitance."""
        flat = np.ravel(z)
        (_, r, wr), (wall, base) = self._base, self._solution
        from_base = (_pair(flat[:, None], r, self.radius) * (r * wr)) @ base
        return (self._direct(flat) + self._wall_matrix(flat) @ wall + from_base).reshape(np.shape(z))

    def on_base(self, r: Array) -> Array:
        """Irradiance of the plane of the base at distances from the axis, the disk included."""
        flat = np.ravel(r)
        (_, z, wz), (wall, _) = self._wall, self._solution
        return ((_pair(z, flat[:, None], self.radius) * (self.radius * wz)) @ wall).reshape(np.shape(r))

    @property
    def absorbed(self) -> tuple[float, float]:
        """Flux that wall and base absorb."""
        (_, _, wz), (_, r, wr), (wall, base) = self._wall, self._base, self._solution
        share = (1 - self.reflectance) / self.reflectance
        return share * 2 * np.pi * self.radius * float(wall @ wz), share * 2 * np.pi * float(base @ (r * wr))

    @property
    def left(self) -> tuple[float, float]:
        """Flux that leaves through the opening, and that falls back onto the disk.

        The opening gets from the base what a disk gets from another at the height: by reciprocity from the wall's shares.
        """
        (_, z, wz), (_, r, wr), (wall, base) = self._wall, self._base, self._solution
        area = 2 * np.pi * self.radius
        by_wall = area * float((wall * wz) @ wall_to_disk(self.height - z, self.radius))
        x, w = leggauss(40)
        inner = self.disk / 2 * (1 + x)
        exits = 2 * np.pi * float((base * r * wr) @ self._through(r))
        exits += 2 * np.pi * self.exitance * float((inner * self.disk / 2 * w) @ self._through(inner))
        back = 2 * np.pi * float((self.on_base(inner) * inner) @ (self.disk / 2 * w))
        return by_wall + exits, back

    def _through(self, r: Array) -> Array:
        """Share of the light of an element of the base that leaves through the opening: a disk seen from beside its axis."""
        h, rho = self.height / r, self.radius / r
        z = 1 + h * h + rho * rho
        return 0.5 * (1 - (1 + h * h - rho * rho) / np.sqrt(z * z - 4 * rho * rho))


def _lagrange(nodes: Array, at: Array) -> Array:
    """Values at points of the polynomials that are 1 at one node and 0 at the others, shape (points, nodes)."""
    n = len(nodes)
    scaled, there = (np.asarray(v) - nodes[0] for v in (nodes, at))
    found = np.ones((len(at), n))
    for j in range(n):
        for m in range(n):
            if m != j:
                found[:, j] *= (there - scaled[m]) / (scaled[j] - scaled[m])
    return found
