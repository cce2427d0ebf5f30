"""A packaged LED whose luminance is known in closed form: a die with structure under a flat window, and what surrounds it.

Three emitters, none with a symmetry that could hide a swapped axis:

- the die, an image of small pixels in a medium of index n below a flat window: seen from outside it lies at the depth
  top - depth c/√(n² - s²), c and s being cosine and sine of the angle to the normal, so that no plane is sharp for all;
- a wide glow on the window itself, with a direction distribution of its own;
- strays over a field ten times as wide as the die.

Light that leaves the window is weakened by Fresnel's transmittance of unpolarised light and keeps L/n².
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Distribution = Callable[[Array, Array], Array]

MM2 = 1e-6
"""Square millimetre in square metres."""


def fresnel_transmittance(*, cosine_outside: Array, index: float) -> Array:
    """Of unpolarised light that leaves a medium of this index, by its angle outside."""
    c = cosine_outside
    inside = np.sqrt(1 - (1 - c * c) / index**2)
    across = (c - index * inside) / (c + index * inside)
    along = (index * c - inside) / (index * c + inside)
    return 1 - (across**2 + along**2) / 2


def die_image(*, columns: int, rows: int) -> Array:
    """A turned die with a gradient, dark contact fingers, a bond pad and grains of phosphor: luminance, at most 1."""
    y, x = np.mgrid[0:rows, 0:columns]
    x, y = (x + 0.5) / columns - 0.5, (y + 0.5) / rows - 0.5
    turn = np.radians(7.0)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    die = (np.abs(u + 0.01) < 0.39) & (np.abs(v - 0.02) < 0.36)
    level = 0.72 + 0.25 * u - 0.18 * v
    fingers = (np.abs(u - 0.13) < 0.012) | (np.abs(u + 0.17) < 0.012)
    level = np.where(fingers & (v < 0.3), 0.35 * level, level)
    level = np.where((u > 0.24) & (v > 0.21), 0.12, level)
    grains = np.random.default_rng(8)
    for a, b, size, gain in zip(
        grains.uniform(-0.4, 0.4, 60),
        grains.uniform(-0.4, 0.4, 60),
        grains.uniform(0.008, 0.03, 60),
        grains.uniform(-0.25, 0.25, 60),
        strict=True,
    ):
        level = level * (1 + gain * np.exp(-((x - a) ** 2 + (y - b) ** 2) / (2 * size**2)))
    return np.where(die, level, 0.004)


@dataclasses.dataclass(frozen=True, kw_only=True)
class PackagedLed:
    """Lengths in mm; `scale` [cd/m²] is the luminance of the die's image at 1, seen along the normal but for Fresnel."""

    side: float = 2.4
    centre: tuple[float, float] = (0.21, -0.13)
    top: float = -0.2
    depth: float = 0.45
    index: float = 1.5
    pixels: int = 400
    scale: float = 4e6
    glow_radius: float = 2.6
    glow_share: float = 0.06
    stray_side: float = 20.0
    stray_height: float = 0.6
    stray_share: float = 0.003

    @functools.cached_property
    def image(self) -> Array:
        """Row along y from below, column along x."""
        return die_image(columns=self.pixels, rows=self.pixels)

    # --- directions: p and q to luminance, at most 1.31 -------------------------------------------------------------

    def _of_die(self, p: Array, q: Array) -> Array:
        cosine = np.sqrt(np.maximum(1 - p * p - q * q, 0.0))
        within = 1 + 0.24 * p / self.index - 0.15 * q / self.index + 0.3 * p * q / self.index**2
        return within * fresnel_transmittance(cosine_outside=cosine, index=self.index)

    @staticmethod
    def _of_glow(p: Array, q: Array) -> Array:
        cosine = np.sqrt(np.maximum(1 - p * p - q * q, 0.0))
        return (0.4 + 0.6 * cosine) * (1 + 0.2 * q)

    @staticmethod
    def _of_strays(p: Array, q: Array) -> Array:
        return 1.0 + 0.0 * (p + q)

    @staticmethod
    def _projected(of: Distribution) -> float:
        """∫ of a direction distribution over p, q: Gauss in the cosine, equal steps in azimuth."""
        x, w = np.polynomial.legendre.leggauss(64)
        cosine, w = (x + 1) / 2, w / 2
        turn = 2 * np.pi * (np.arange(64) + 0.5) / 64
        sine = np.sqrt(1 - cosine**2)[:, None]
        values = of(sine * np.cos(turn), sine * np.sin(turn))
        return float((w * cosine) @ values.mean(axis=1) * 2 * np.pi)

    # --- places ---------------------------------------------------------------------------------------------------------

    def _apparent(self, k: Array) -> Array:
        """Depth at which the die is seen along the unit directions k."""
        s2 = 1 - k[:, 2] ** 2
        return self.top - self.depth * k[:, 2] / np.sqrt(self.index**2 - s2)

    def _die_at(self, x: Array, y: Array) -> Array:
        n = self.pixels
        i = np.floor(((y - self.centre[1]) / self.side + 0.5) * n).astype(int)
        j = np.floor(((x - self.centre[0]) / self.side + 0.5) * n).astype(int)
        inside = (i >= 0) & (i < n) & (j >= 0) & (j < n)
        return np.where(inside, self.image[np.clip(i, 0, n - 1), np.clip(j, 0, n - 1)], 0.0)

    def _glow_at(self, x: Array, y: Array) -> Array:
        u, v = (x - 0.1) / self.glow_radius, (y + 0.2) / self.glow_radius
        return np.where(u * u + v * v <= 1, 1 + 0.5 * u - 0.3 * v, 0.0)

    @functools.cached_property
    def fluxes(self) -> tuple[float, float, float]:
        """Of die, glow and strays [lm]."""
        die = self.scale * MM2 * self.side**2 * float(self.image.mean()) * self._projected(self._of_die)
        rest = 1 - self.glow_share - self.stray_share
        return die, die * self.glow_share / rest, die * self.stray_share / rest

    @property
    def total_flux(self) -> float:
        """Of all three [lm]."""
        return sum(self.fluxes)

    @functools.cached_property
    def _levels(self) -> tuple[float, float, float]:
        """What place times direction is multiplied by [cd/m²]."""
        _, glow, strays = self.fluxes
        glow_area, stray_area = np.pi * self.glow_radius**2 * MM2, self.stray_side**2 * MM2
        return (
            self.scale,
            glow / (glow_area * self._projected(self._of_glow)),
            strays / (stray_area * self._projected(self._of_strays)),
        )

    def luminance(self, *, points: Array, directions: Array) -> Array:
        """Luminance [cd/m²] of the light that leaves along lines."""
        up = directions[:, 2] > 1e-9
        k = np.where(up[:, None], directions, (0.0, 0.0, 1.0))
        p, q = k[:, 0], k[:, 1]

        def at(z: Array | float) -> tuple[Array, Array]:
            t = (z - points[:, 2]) / k[:, 2]
            return points[:, 0] + t * p, points[:, 1] + t * q

        die, glow, strays = self._levels
        x, y = at(self.stray_height)
        within = (np.abs(x) <= self.stray_side / 2) & (np.abs(y) <= self.stray_side / 2)
        total = (
            die * self._die_at(*at(self._apparent(k))) * self._of_die(p, q)
            + glow * self._glow_at(*at(self.top)) * self._of_glow(p, q)
            + strays * within
        )
        return np.where(up, total, 0.0)

    def rays(self, n: int, *, seed: int) -> tuple[Array, Array]:
        """Position and direction (n, 3) of rays of flux ``total_flux / n`` each, from the plane z = 1."""
        rng = np.random.default_rng(seed)
        of = rng.choice(3, n, p=np.array(self.fluxes) / self.total_flux)
        directions = (self._of_die, self._of_glow, self._of_strays)
        x, k = np.zeros((n, 3)), np.zeros((n, 3))
        for kind, distribution in enumerate(directions):
            mine = np.flatnonzero(of == kind)
            k[mine] = self._directions(rng, len(mine), distribution)
            x[mine] = (self._from_die, self._from_glow, self._from_strays)[kind](rng, k[mine])
        along = (1.0 - x[:, 2]) / k[:, 2]
        return x + along[:, None] * k, k

    @staticmethod
    def _directions(rng: np.random.Generator, n: int, distribution: Distribution) -> Array:
        found = np.zeros((0, 3))
        while len(found) < n:
            r, turn = np.sqrt(rng.random(2 * n + 64)), 2 * np.pi * rng.random(2 * n + 64)
            p, q = r * np.cos(turn), r * np.sin(turn)
            keep = rng.random(len(p)) * 1.5 < distribution(p, q)
            p, q = p[keep], q[keep]
            found = np.concatenate([found, np.stack([p, q, np.sqrt(np.maximum(1 - p * p - q * q, 1e-12))], axis=1)])
        return found[:n]

    def _from_die(self, rng: np.random.Generator, k: Array) -> Array:
        share = self.image.ravel() / self.image.sum()
        pixel = rng.choice(share.size, len(k), p=share)
        i, j = np.divmod(pixel, self.pixels)
        x = self.centre[0] + ((j + rng.random(len(k))) / self.pixels - 0.5) * self.side
        y = self.centre[1] + ((i + rng.random(len(k))) / self.pixels - 0.5) * self.side
        return np.stack([x, y, self._apparent(k)], axis=1)

    def _from_glow(self, rng: np.random.Generator, k: Array) -> Array:
        found = np.zeros((0, 3))
        while len(found) < len(k):
            x, y = (rng.uniform(-1, 1, (2, 4 * len(k) + 64)) * self.glow_radius) + np.array([[0.1], [-0.2]])
            keep = rng.random(len(x)) * 1.6 < self._glow_at(x, y)
            found = np.concatenate([found, np.stack([x[keep], y[keep], np.full(keep.sum(), self.top)], axis=1)])
        return found[: len(k)]

    def _from_strays(self, rng: np.random.Generator, k: Array) -> Array:
        x, y = rng.uniform(-0.5, 0.5, (2, len(k))) * self.stray_side
        return np.stack([x, y, np.full(len(k), self.stray_height)], axis=1)

    def exitance(self, *, z: float, side: float, cells: int, directions: int = 24) -> Array:
        """Flux [lm] of the die through each cell of a square about its centre on the plane z, (cells, cells), row along y.

        By Gauss's rule over directions; for each of them the shares of pixels in cells are exact. Glow and strays are added
        as the mean of each over the points of a 3 × 3 grid in each cell.
        """
        x, w = np.polynomial.legendre.leggauss(directions)
        cosines, w = (x + 1) / 2, w / 2
        turns = 2 * np.pi * (np.arange(2 * directions) + 0.5) / (2 * directions)
        edges = np.linspace(-side / 2, side / 2, cells + 1)
        pixel_edges = np.linspace(-self.side / 2, self.side / 2, self.pixels + 1)

        def shares(shift: float) -> Array:
            low = np.maximum(edges[:-1, None], pixel_edges[:-1] + shift)
            high = np.minimum(edges[1:, None], pixel_edges[1:] + shift)
            return np.maximum(high - low, 0.0)

        total = np.zeros((cells, cells))
        for cosine, weight in zip(cosines, w, strict=True):
            sine = np.sqrt(1 - cosine**2)
            depth = self.top - self.depth * cosine / np.sqrt(self.index**2 - sine**2)
            for turn in turns:
                p, q = sine * np.cos(turn), sine * np.sin(turn)
                value = float(self._of_die(np.array([p]), np.array([q]))[0])
                slope = (z - depth) / cosine
                along_x, along_y = shares(slope * p), shares(slope * q)
                solid = weight * cosine * 2 * np.pi / len(turns)
                total += solid * value * (along_y @ self.image @ along_x.T)
        total *= self._levels[0] * MM2
        fine = (np.arange(3 * cells) + 0.5) / (3 * cells) * side - side / 2
        area = (side / cells) ** 2 * MM2
        gx, gy = np.meshgrid(self.centre[0] + fine, self.centre[1] + fine)
        rest = np.zeros((3 * cells, 3 * cells))
        for cosine, weight in zip(cosines[::3], w[::3] * 3, strict=True):
            sine = np.sqrt(1 - cosine**2)
            for turn in turns[::3]:
                k = np.array([sine * np.cos(turn), sine * np.sin(turn), cosine])
                pq = (np.array([k[0]]), np.array([k[1]]))
                solid = weight * cosine * 2 * np.pi / len(turns[::3])
                t = (self.top - z) / cosine
                rest += solid * self._levels[1] * self._glow_at(gx + t * k[0], gy + t * k[1]) * self._of_glow(*pq)
        total += area * rest.reshape(cells, 3, cells, 3).mean(axis=(1, 3))
        strays = self._levels[2] * self._projected(self._of_strays)
        return total + area * strays
