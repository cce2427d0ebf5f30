"""Pixels of curved parts: spherical cells between parallels, and the side of a cylinder unrolled."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from etendue.lightfield.gridded.pixels import Array, Bools, Cells, Indices, Pixelation

VANISHING = 1e-9
"""Sine of the angle to the Z axis below which a normal has no projection on the XY plane."""

ARC = 4
"""Straight pieces for each side of a spherical cell in its flat outline."""


@dataclasses.dataclass(frozen=True)
class SphericalPixels(Pixelation):
    """A hemisphere cut into (2N - 1)² cells of equal area by N parallels.

    The cap is one cell, ring k has 8k, and the parallels lie at 1 - cos θ_k = ((2k + 1)/(2N - 1))². A cell is a piece of
    the sphere; its normal is the mean of the normals on it, so that |∫ normal dA| is what it shows along its z axis.

    Parameters
    ----------
    part : Part
        A hemisphere.
    parallels : int
        N.

    Examples
    --------
    >>> from etendue.lightfield.carrier import Hemisphere
    >>> [SphericalPixels(Hemisphere(radius=1.264).parts()[0], n).count for n in (4, 7, 16)]
    [49, 169, 961]
    """

    SHAPE = "spherical cell"
    parallels: int

    @property
    def count(self) -> int:
        """Pixels, lit or not."""
        return (2 * self.parallels - 1) ** 2

    def crossing(self, position: Array, direction: Array) -> tuple[Array, Bools]:
        """See `Pixelation`."""
        radius = self.part.size[0]
        nearest = position - np.einsum("ij,ij->i", position, direction)[:, None] * direction
        square = radius * radius - np.einsum("ij,ij->i", nearest, nearest)
        point = nearest + np.sqrt(np.maximum(square, 0.0))[:, None] * direction
        within = (square >= 0.0) & (point[:, 2] >= 0.0)
        return np.where(within[:, None], point, np.nan), within

    def index(self, point: Array) -> Indices:
        """See `Pixelation`."""
        x, y, z = point.T
        reached = np.isfinite(z)
        x, y, z = (np.where(reached, v, 0.0) for v in (x, y, z))
        radius, rings = self.part.size[0], 2 * self.parallels - 1
        # 1 - cos θ without cancellation at the pole.
        height = (x * x + y * y) / (radius * (radius + z))
        k = np.minimum((np.sqrt(height) * rings + 1.0) / 2.0, self.parallels - 0.5).astype(np.intp)
        turn = np.arctan2(y, x) / (2 * np.pi)
        cell = ((turn + (turn < 0.0)) * (8 * k)).astype(np.intp)
        index = np.where(k == 0, 0, (2 * k - 1) ** 2 + np.minimum(cell, 8 * k - 1))
        return np.where(reached, index, -1)

    def _bounds(self, pixel: Indices) -> tuple[Array, Array, Array, Array]:
        """Cosines of the upper and the lower parallel, azimuth of the middle [rad], and half the width [rad]."""
        k = ((np.sqrt(pixel) + 1.0) / 2.0).astype(np.intp)
        rings = 2 * self.parallels - 1
        upper, lower = (1.0 - np.maximum((2 * k + side) / rings, 0.0) ** 2 for side in (-1, 1))
        half = np.pi / np.maximum(8 * k, 1)
        middle = np.where(k == 0, 0.0, (2 * (pixel - (2 * k - 1) ** 2) + 1) * half)
        return np.where(k == 0, 1.0, upper), lower, middle, half

    def _mean_normal(self, pixel: Indices) -> Array:
        """∫ normal dA over each pixel, in units of the squared radius."""
        upper, lower, middle, half = self._bounds(pixel)
        thetas = np.arccos(np.stack([upper, lower], axis=1))
        # Across the pole's axis with ∫ sin²θ dθ between the parallels, along it with ∫ sin θ cos θ dθ.
        across = 2 * np.sin(half) * np.diff(thetas / 2 - np.sin(2 * thetas) / 4, axis=1)[:, 0]
        across[pixel == 0] = 0.0
        mean = np.stack([across * np.cos(middle), across * np.sin(middle), half * (upper**2 - lower**2)], axis=1)
        return self.vectors_to_world(mean)

    def axes(self, pixel: Indices) -> Array:
        """See `Pixelation`."""
        mean = self._mean_normal(pixel)
        return local_axes(mean / np.linalg.norm(mean, axis=1)[:, None])

    def cells(self, pixel: Indices) -> Cells:
        """See `Pixelation`."""
        radius, axes = self.part.size[0], self.axes(pixel)
        projected = radius**2 * np.linalg.norm(self._mean_normal(pixel), axis=1)
        area = np.full(len(pixel), 2 * np.pi * radius**2 / self.count)
        centre = np.array(self.part.centre) + axes[:, 2] * (radius * projected / area)[:, None]
        outlines = tuple(self._outline(*values) for values in zip(pixel, centre, axes, projected, strict=True))
        extent = np.array([np.ptp((o - c) @ a[:2].T, axis=0) for o, c, a in zip(outlines, centre, axes, strict=True)])
        return Cells(centre, axes, outlines, extent.reshape(-1, 2), area, projected)

    def _outline(self, pixel: int, centre: Array, axes: Array, area: float) -> Array:
        """A cell's edge, seen along its normal, with the cell's projected area."""
        upper, lower, middle, half = (float(bound[0]) for bound in self._bounds(np.array([pixel])))
        top, bottom = math.acos(upper), math.acos(lower)
        way, still = np.arange(ARC) / ARC, np.ones(ARC)
        if pixel == 0:
            phi = np.arange(8 * ARC) * (2 * np.pi / (8 * ARC))
            theta = np.full(8 * ARC, bottom)
        else:
            to_left, down = middle + half * (1 - 2 * way), top + way * (bottom - top)
            phi = np.concatenate([to_left, (middle - half) * still, 2 * middle - to_left, (middle + half) * still])
            theta = np.concatenate([top * still, down, bottom * still, top + bottom - down])
        edge = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
        x, y = axes[:2] @ (self.to_world(edge * self.part.size[0]) - centre).T
        found = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0
        # The chords of the arcs cut a little off.
        scale = math.sqrt(area / found)
        outline: Array = centre + (scale * np.stack([x, y], axis=1)) @ axes[:2]
        return outline

    def on_pixels(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """See `Pixelation`."""
        upper, lower, middle, half = self._bounds(pixel)
        # No normal of the cell is further from its middle than this.
        reach = np.hypot(half, np.arccos(lower) - np.arccos(upper))
        away = np.arccos(np.clip(np.einsum("ij,ij->i", normal, direction), -1.0, 1.0))

        def normals(chosen: Indices) -> Array:
            u, v = rng.random((2, len(chosen)))
            cosine = lower[chosen] + u * (upper[chosen] - lower[chosen])
            sine, phi = np.sqrt((1 - cosine) * (1 + cosine)), middle[chosen] + (2 * v - 1) * half[chosen]
            return self.vectors_to_world(np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=1))

        found = _cosine_weighted(normals, direction, np.cos(np.maximum(away - reach, 0.0)), rng)
        world: Array = np.array(self.part.centre) + self.part.size[0] * found
        return world


@dataclasses.dataclass(frozen=True)
class CylindricalPixels(Pixelation):
    """The side of a cylinder, unrolled and cut into equal-area cells whose sides are as near to Δd as whole numbers allow.

    At least four columns, so that no pixel sees more than a quarter of the circle. The local z axis is the outward normal
    through the middle; its projection on the XY plane is itself, so that eq. 3.7 leaves x and y open. They continue the
    hemisphere's to its rim: x points down along the axis, y along the circle.

    Parameters
    ----------
    part : Part
        A tube.
    side : float
        Δd [mm].

    Examples
    --------
    >>> from etendue.lightfield.carrier import Cylinder
    >>> pixels = CylindricalPixels(Cylinder(radius=2, bottom=0, top=5).parts()[0], 1.0)
    >>> pixels.columns, pixels.rows, pixels.cells(np.array([0])).axes[0, 0].tolist()
    (13, 5, [0.0, 0.0, -1.0])
    """

    SHAPE = "cylindrical cell"
    side: float

    @property
    def columns(self) -> int:
        """Cells around the circle."""
        return max(4, round(2 * math.pi * self.part.size[0] / self.side))

    @property
    def rows(self) -> int:
        """Cells along the axis."""
        return max(1, round(self.part.size[1] / self.side))

    @property
    def count(self) -> int:
        """Pixels, lit or not."""
        return self.columns * self.rows

    def crossing(self, position: Array, direction: Array) -> tuple[Array, Bools]:
        """See `Pixelation`."""
        radius, height = self.part.size
        across = np.hypot(direction[:, 0], direction[:, 1])
        leaves = across > 0.0
        unit = direction / np.where(leaves, across, 1.0)[:, None]
        along = -(position[:, 0] * unit[:, 0] + position[:, 1] * unit[:, 1])
        with np.errstate(over="ignore", invalid="ignore"):
            nearest = position + along[:, None] * unit
            square = radius * radius - nearest[:, 0] ** 2 - nearest[:, 1] ** 2
            point = nearest + np.sqrt(np.maximum(square, 0.0))[:, None] * unit
            within = leaves & (square >= 0.0) & (np.abs(point[:, 2]) <= height / 2)
        return np.where(within[:, None], point, np.nan), within

    def index(self, point: Array) -> Indices:
        """See `Pixelation`."""
        x, y, z = point.T
        reached = np.isfinite(z)
        x, y, z = (np.where(reached, v, 0.0) for v in (x, y, z))
        turn = np.arctan2(y, x) / (2 * np.pi)
        column = np.minimum((turn + (turn < 0.0)) * self.columns, self.columns - 0.5).astype(np.intp)
        row = np.clip((z / self.part.size[1] + 0.5) * self.rows, 0.0, self.rows - 0.5).astype(np.intp)
        return np.where(reached, column * self.rows + row, -1)

    def _middles(self, pixel: Indices) -> tuple[Array, Array]:
        """Azimuth [rad] and height [mm] of the middle of each pixel."""
        column, row = np.divmod(pixel, self.rows)
        return (column + 0.5) * (2 * np.pi / self.columns), ((row + 0.5) / self.rows - 0.5) * self.part.size[1]

    def axes(self, pixel: Indices) -> Array:
        """See `Pixelation`."""
        phi, _ = self._middles(pixel)
        zero, one = np.zeros(len(pixel)), np.ones(len(pixel))
        down, around = np.stack([zero, zero, -one], axis=1), np.stack([-np.sin(phi), np.cos(phi), zero], axis=1)
        outward = np.stack([np.cos(phi), np.sin(phi), zero], axis=1)
        return self.vectors_to_world(np.stack([down, around, outward], axis=1))

    def cells(self, pixel: Indices) -> Cells:
        """See `Pixelation`."""
        (radius, height), axes = self.part.size, self.axes(pixel)
        half, step = math.pi / self.columns, height / self.rows
        width = 2 * radius * math.sin(half)
        # x points down, so that heights are negative ones.
        offset = radius * math.sin(half) / half * axes[:, 2] - self._middles(pixel)[1][:, None] * axes[:, 0]
        centre = np.array(self.part.centre) + offset
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([step / 2, width / 2])
        outlines = centre[:, None, :] + corners @ axes[:, :2]
        full = np.ones(len(pixel))
        extent = np.stack([step * full, width * full], axis=1)
        return Cells(centre, axes, tuple(outlines), extent, 2 * half * radius * step * full, width * step * full)

    def on_pixels(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """See `Pixelation`."""
        del normal  # the columns know it
        phi, z = self._middles(pixel)
        half = math.pi / self.columns
        x, y, _ = self.vectors_to_local(direction).T
        away = np.abs((np.arctan2(y, x) - phi + np.pi) % (2 * np.pi) - np.pi)

        def normals(chosen: Indices) -> Array:
            around = phi[chosen] + (2 * rng.random(len(chosen)) - 1) * half
            return self.vectors_to_world(np.stack([np.cos(around), np.sin(around), np.zeros(len(chosen))], axis=1))

        found = _cosine_weighted(normals, direction, np.hypot(x, y) * np.cos(np.maximum(away - half, 0.0)), rng)
        height = z + (rng.random(len(pixel)) - 0.5) * (self.part.size[1] / self.rows)
        world: Array = (
            np.array(self.part.centre) + self.part.size[0] * found + height[:, None] * np.array(self.part.axes[2])
        )
        return world


def local_axes(normal: Array) -> Array:
    """Local axes of pixels on a hemisphere from their normals, section 3.3.2 of [Audenaert2014]_, shape (m, 3, 3).

    y = z × zproj with zproj the projection of z on the XY plane, and x = y × z: x points down the meridian. At the poles,
    where the projection vanishes, the global X axis takes its place.

    Examples
    --------
    >>> local_axes(np.array([[0.0, 0.6, 0.8], [0, 0, 1]])).round(9).tolist()
    [[[0.0, 0.8, -0.6], [-1.0, 0.0, 0.0], [0.0, 0.6, 0.8]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]]
    """
    projection = normal * np.array([1.0, 1.0, 0.0])
    projection[np.linalg.norm(projection, axis=1) < VANISHING] = (1.0, 0.0, 0.0)
    y = np.cross(normal, projection)
    y /= np.linalg.norm(y, axis=1)[:, None]
    return np.stack([np.cross(y, normal), y, normal], axis=1)


def _cosine_weighted(
    draw: Callable[[Indices], Array], direction: Array, most: Array, rng: np.random.Generator
) -> Array:
    """Normals (m, 3) drawn with a density proportional to their cosine with `direction`, none of which is above `most`."""
    result = np.zeros_like(direction)
    open_ = np.arange(len(direction))
    while open_.size:
        normal = draw(open_)
        taken = rng.random(open_.size) * most[open_] < np.einsum("ij,ij->i", normal, direction[open_])
        result[open_[taken]] = normal[taken]
        open_ = open_[~taken]
    return result
