"""Convex lamps that shine all round, with known luminance and no symmetry: for surfaces that are not flat.

Each gives ``luminance``, ``total_flux`` and ``rays`` as the sources in `oracles.sources` do. Where a line leaves the body,
at x from its middle and in the direction k, L = scale · (1 + a·x/size) · (1 + b·k), with a and b in general position.
"""

from __future__ import annotations

import abc
import dataclasses
from typing import ClassVar

import numpy as np

from oracles.sources import MM2, Array

A, B = np.array([0.3, -0.2, 0.15]), np.array([0.2, 0.35, -0.15])

SIGMA = 2 * np.pi / 3
"""∫ (b·k)(k·n) dΩ over the half-space about n, in units of b·n; without b it is π."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Body(abc.ABC):
    """Lengths in mm, luminance in cd/m²."""

    middle: tuple[float, float, float] = (0.4, -0.7, 1.9)
    scale: float = 1e4
    size: ClassVar[float] = 5.0

    @abc.abstractmethod
    def on_surface(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Uniform points on the surface, from the middle, and normals there."""

    @abc.abstractmethod
    def exits(self, *, points: Array, directions: Array) -> tuple[Array, Array]:
        """Where lines leave the body, from its middle; and whether they meet it."""

    def _level(self, x: Array, k: Array) -> Array:
        return self.scale * (1 + x @ A / self.size) * (1 + k @ B)

    def luminance(self, *, points: Array, directions: Array) -> Array:
        """Luminance [cd/m²] along lines."""
        x, met = self.exits(points=points - self.middle, directions=directions)
        return np.where(met, self._level(x, directions), 0.0)

    def rays(self, n: int, *, seed: int) -> tuple[Array, Array]:
        """Position on the surface and direction (n, 3) of rays of equal flux."""
        rng = np.random.default_rng(seed)
        position, direction = np.zeros((0, 3)), np.zeros((0, 3))
        while len(position) < n:
            x, normal = self.on_surface(n, rng)
            k = normal + (v := rng.normal(size=(n, 3))) / np.linalg.norm(v, axis=1)[:, None]  # Lambertian
            k /= np.linalg.norm(k, axis=1)[:, None]
            keep = rng.random(n) * 3 * self.scale < self._level(x, k)
            position, direction = np.concatenate([position, x[keep]]), np.concatenate([direction, k[keep]])
        return position[:n] + self.middle, direction[:n]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Globe(Body):
    """A sphere."""

    radius: float = 2.5

    @property
    def total_flux(self) -> float:
        """[lm]"""
        return float(
            self.scale * MM2 * 4 * np.pi * self.radius**2 * (np.pi + SIGMA * self.radius / self.size * A @ B / 3)
        )

    def on_surface(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        v = rng.normal(size=(n, 3))
        v /= np.linalg.norm(v, axis=1)[:, None]
        return self.radius * v, v

    def exits(self, *, points: Array, directions: Array) -> tuple[Array, Array]:
        near = points - np.sum(points * directions, axis=1)[:, None] * directions
        square = self.radius**2 - np.sum(near**2, axis=1)
        return near + np.sqrt(np.maximum(square, 0.0))[:, None] * directions, square > 0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Block(Body):
    """A box with faces along the axes."""

    half: tuple[float, float, float] = (1.5, 0.6, 2.2)

    @property
    def _areas(self) -> Array:
        a, b, c = self.half
        return 4 * np.array([b * c, c * a, a * b])

    @property
    def total_flux(self) -> float:
        """[lm]"""
        odd = SIGMA * A * B * np.array(self.half) / self.size
        return float(self.scale * MM2 * 2 * self._areas @ (np.pi + odd))

    def on_surface(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        axis = rng.choice(3, n, p=self._areas / self._areas.sum())
        sign = np.where(rng.random(n) < 0.5, -1.0, 1.0)
        x = rng.uniform(-1, 1, (n, 3))
        x[np.arange(n), axis] = sign
        normal = np.zeros((n, 3))
        normal[np.arange(n), axis] = sign
        return x * self.half, normal

    def exits(self, *, points: Array, directions: Array) -> tuple[Array, Array]:
        with np.errstate(divide="ignore"):
            ways = np.stack([(s * np.array(self.half) - points) / directions for s in (-1, 1)])
        enters, leaves = ways.min(axis=0).max(axis=1), ways.max(axis=0).min(axis=1)
        return points + leaves[:, None] * directions, leaves > enters


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rod(Body):
    """A cylinder about Z, closed by its ends, which shine too."""

    radius: float = 1.1
    height: float = 4.6

    @property
    def total_flux(self) -> float:
        """[lm]"""
        side = 2 * np.pi * self.radius * self.height * (np.pi + SIGMA * self.radius / self.size * A[:2] @ B[:2] / 2)
        ends = 2 * np.pi * self.radius**2 * (np.pi + SIGMA * self.height / 2 / self.size * A[2] * B[2])
        return float(self.scale * MM2 * (side + ends))

    def on_surface(self, n: int, rng: np.random.Generator) -> tuple[Array, Array]:
        turn, side = rng.random(n) * 2 * np.pi, rng.random(n) < self.height / (self.height + self.radius)
        round_about = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=-1)
        sign, reach = np.where(rng.random(n) < 0.5, -1.0, 1.0), np.sqrt(rng.random(n))
        up = np.array([0.0, 0.0, 1.0])
        height = np.where(side, rng.uniform(-0.5, 0.5, n), sign / 2) * self.height
        x = np.where(side, 1.0, reach)[:, None] * self.radius * round_about + height[:, None] * up
        return x, np.where(side[:, None], round_about, sign[:, None] * up)

    def exits(self, *, points: Array, directions: Array) -> tuple[Array, Array]:
        across = np.sum(directions[:, :2] ** 2, axis=1)
        middle = -np.sum(points[:, :2] * directions[:, :2], axis=1) / across
        near = points[:, :2] + middle[:, None] * directions[:, :2]
        half = np.sqrt(np.maximum(self.radius**2 - np.sum(near**2, axis=1), 0.0) / across)
        caps = np.stack([(s * self.height / 2 - points[:, 2]) / directions[:, 2] for s in (-1, 1)])
        enters, leaves = np.maximum(middle - half, caps.min(axis=0)), np.minimum(middle + half, caps.max(axis=0))
        return points + leaves[:, None] * directions, leaves > enters
