"""A tilted parallelogram of four quarters with four luminances: no symmetry that could hide a swapped axis."""

from __future__ import annotations

import dataclasses

import etendue as et
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quadrilateral:
    """Lambertian on its upper side; lengths in mm, luminances in cd/m² by quarter (−a −b, +a −b, −a +b, +a +b)."""

    centre: tuple[float, float, float] = (1.5, -2.0, 0.8)
    edge_a: tuple[float, float, float] = (9.0, 1.0, 1.2)
    edge_b: tuple[float, float, float] = (-2.0, 6.0, -0.7)
    quarters: tuple[float, float, float, float] = (1000.0, 5000.0, 2500.0, 9000.0)

    @property
    def normal(self) -> Array:
        n = np.cross(self.edge_a, self.edge_b)
        return n / np.linalg.norm(n)

    @property
    def area(self) -> float:
        return float(np.linalg.norm(np.cross(self.edge_a, self.edge_b)))

    @property
    def flux(self) -> float:
        return np.pi * float(np.mean(self.quarters)) * self.area * 1e-6

    def rays(self, n: int, *, seed: int) -> et.RaySet:
        """Rays of equal flux."""
        rng = np.random.default_rng(seed)
        quarter = rng.choice(4, n, p=np.array(self.quarters) / sum(self.quarters))
        a = (rng.random(n) - 1.0 + (quarter % 2)) / 2
        b = (rng.random(n) - 1.0 + (quarter // 2)) / 2
        position = np.array(self.centre) + a[:, None] * np.array(self.edge_a) + b[:, None] * np.array(self.edge_b)
        u, v = rng.random(n), rng.random(n) * 2 * np.pi
        t = np.array(self.edge_a) / np.linalg.norm(self.edge_a)
        s = np.cross(self.normal, t)
        sin = np.sqrt(u)[:, None]
        direction = sin * (np.cos(v)[:, None] * t + np.sin(v)[:, None] * s) + np.sqrt(1 - u)[:, None] * self.normal
        return et.RaySet(position, direction, np.full(n, self.flux / n))

    def luminance(self, *, points: Array, directions: Array) -> Array:
        """Luminance [cd/m²] on the lines through `points` (…, 3) towards `directions` (…, 3)."""
        slope = directions @ self.normal
        t = ((np.array(self.centre) - points) @ self.normal) / slope
        offset = points + t[..., None] * directions - np.array(self.centre)
        basis = np.stack([self.edge_a, self.edge_b, self.normal], axis=1)
        a, b, _ = np.moveaxis(offset @ np.linalg.inv(basis).T, -1, 0)
        inside = (np.abs(a) < 0.5) & (np.abs(b) < 0.5) & (slope > 0)
        return np.where(inside, np.array(self.quarters)[(a > 0).astype(int) + 2 * (b > 0).astype(int)], 0.0)

    def cone_expectation(
        self, observer: et.Observer, screen: et.Screen, *, acceptance: float, fineness: int = 12
    ) -> Array:
        """Expected value of eq. 2.4 by quadrature over each pixel and its cone, written from vectors alone."""
        theta, phi = np.radians([observer.theta, observer.phi])
        toward = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        eye = np.array(observer.target) + observer.distance * toward
        if screen.plane == "view":
            pole = np.array([-np.sin(phi), np.cos(phi), 0.0])
            right, up = (
                e * np.cos(theta) + np.cross(pole, e) * np.sin(theta) + pole * (pole @ e) * (1 - np.cos(theta))
                for e in (np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
            )
        else:
            right, up = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
        normal = np.cross(right, up)
        step = (np.arange(fineness) + 0.5) / fineness
        # Directions with equal projected solid angle about the pole: sin² of the polar angle is uniform.
        sin = np.sqrt(step) * np.sin(np.radians(acceptance))
        azimuth = 2 * np.pi * step
        result = np.zeros(screen.shape)
        for row in range(screen.rows):
            for column in range(screen.columns):
                x = ((column + 0.5) / screen.columns - 0.5) * screen.width
                y = (0.5 - (row + 0.5) / screen.rows) * screen.height
                axis = eye - np.array(observer.target) - x * right - y * up
                axis /= np.linalg.norm(axis)
                e1 = np.cross(axis, right)
                e1 /= np.linalg.norm(e1)
                e2 = np.cross(axis, e1)
                ring = np.cos(azimuth)[:, None] * e1 + np.sin(azimuth)[:, None] * e2
                k = (sin[:, None, None] * ring + np.sqrt(1 - sin**2)[:, None, None] * axis).reshape(-1, 3)
                dx = (x + (step - 0.5) * screen.width / screen.columns)[:, None, None] * right
                dy = (y + (step - 0.5) * screen.height / screen.rows)[None, :, None] * up
                points = (np.array(observer.target) + dx + dy).reshape(-1, 1, 3)
                seen = self.luminance(points=points, directions=k[None])
                # dω = dω_⊥ / cos; the flux through the pixel carries |k·n|, its apparent area |axis·n|.
                weight = np.abs(k @ normal) / (k @ axis) / abs(axis @ normal)
                result[row, column] = (seen * weight).mean()
        projected = np.pi * np.sin(np.radians(acceptance)) ** 2
        return result * projected / (2 * np.pi * (1 - np.cos(np.radians(acceptance))))
