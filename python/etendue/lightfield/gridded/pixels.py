"""Pixels of a carrier surface and their local axes: step 2 of section 3.2.2 of [Audenaert2014]_, and section 3.3.2.

Every part of a surface (`etendue.lightfield.surfaces.Part`) has a pixelation of its own. A pixelation knows three things:
where a line crosses its part outwards, in which pixel that is, and what each pixel looks like.
"""

from __future__ import annotations

import abc
import dataclasses
import math
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from etendue.lightfield.surfaces import Part

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]


@dataclasses.dataclass(frozen=True)
class Cells:
    """What pixels look like; fields as of `etendue.quantities.patches.Patches`, for m of them."""

    centre: Array
    axes: Array
    outline: tuple[Array, ...]
    extent: Array
    area: Array
    projected_area: Array


@dataclasses.dataclass(frozen=True)
class Pixelation(abc.ABC):
    """The equal-area pixels of one part.

    Parameters
    ----------
    part : Part
        Of a carrier surface.
    """

    SHAPE: ClassVar[str]
    part: Part

    @property
    @abc.abstractmethod
    def count(self) -> int:
        """Pixels, lit or not."""

    @abc.abstractmethod
    def crossing(self, position: Array, direction: Array) -> tuple[Array, Bools]:
        """Where lines, given in the part's own axes, cross the part or its continuation outwards; whether within the part.

        Returns
        -------
        points : array, shape (m, 3)
            In the part's own axes; not finite where there is none.
        within : array of bool, shape (m,)
        """

    @abc.abstractmethod
    def index(self, point: Array) -> Indices:
        """Pixels of points that `crossing` gave; -1 beyond the pixels."""

    @abc.abstractmethod
    def axes(self, pixel: Indices) -> Array:
        """Their local x, y, z in world axes, shape (m, 3, 3)."""

    @abc.abstractmethod
    def cells(self, pixel: Indices) -> Cells:
        """What these pixels look like, in world axes."""

    @abc.abstractmethod
    def on_pixels(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """A random point of each pixel as seen from a direction: its density follows the cosine to the normal there.

        Parameters
        ----------
        pixel : array of int, shape (m,)
            Of this part.
        direction, normal : array, shape (m, 3)
            Direction, and normal of the pixel's middle, in world axes.
        rng : Generator
            Of random numbers.
        """

    def to_local(self, position: Array, direction: Array) -> tuple[Array, Array]:
        """World coordinates in the part's own axes."""
        return self.vectors_to_local(position - np.array(self.part.centre)), self.vectors_to_local(direction)

    def vectors_to_local(self, vector: Array) -> Array:
        """World vectors in the part's own axes."""
        # Not `@`: BLAS starts threads for it, which cost more than such narrow products.
        local: Array = np.einsum("mj,ij->mi", vector, np.array(self.part.axes))
        return local

    def to_world(self, point: Array) -> Array:
        """Points in the part's own axes, in world coordinates."""
        return np.array(self.part.centre) + self.vectors_to_world(point)

    def vectors_to_world(self, vector: Array) -> Array:
        """Vectors in the part's own axes, in world axes."""
        world: Array = np.einsum("...i,ij->...j", vector, np.array(self.part.axes))
        return world


@dataclasses.dataclass(frozen=True)
class SquarePixels(Pixelation):
    """A flat part cut into squares, with a corner of the grid at its centre.

    Squares that the edge of the part cuts stay whole, as in the thesis: the disk of section 3.3.3 touches 368 of them.

    Parameters
    ----------
    part : Part
        A rectangle or a disk.
    side : float
        Δd [mm].

    Examples
    --------
    >>> from etendue.lightfield.surfaces import Disk
    >>> pixels = SquarePixels(Disk(radius=1.264).parts()[0], 0.125)
    >>> pixels.count, pixels.cells(np.array([0])).centre.round(4).tolist()
    (484, [[-1.3125, -1.3125, 0.0]])
    """

    SHAPE = "square"
    side: float

    @property
    def half_counts(self) -> tuple[int, int]:
        """Squares from the centre to the edge, along x and y."""
        width, height = self.part.size if self.part.shape == "rectangle" else (2 * self.part.size[0],) * 2
        return math.ceil(width / 2 / self.side), math.ceil(height / 2 / self.side)

    @property
    def count(self) -> int:
        """Pixels, lit or not."""
        columns, rows = self.half_counts
        return 4 * columns * rows

    def crossing(self, position: Array, direction: Array) -> tuple[Array, Bools]:
        """See `Pixelation`."""
        rises = direction[:, 2] > 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            along = -position[:, 2] / np.where(rises, direction[:, 2], np.inf)
            point = position + along[:, None] * direction
            x, y = point[:, 0], point[:, 1]
            a, b = self.part.size
            within = (
                (np.abs(x) <= a / 2) & (np.abs(y) <= b / 2)
                if self.part.shape == "rectangle"
                else x * x + y * y <= a * a
            )
        # A line that hardly rises meets the plane far away, or beyond the largest number.
        return np.where(rises[:, None], point, np.inf), rises & within

    def index(self, point: Array) -> Indices:
        """See `Pixelation`."""
        columns, rows = self.half_counts
        with np.errstate(invalid="ignore"):
            reached = np.isfinite(point).all(axis=1)
            reached &= (np.abs(point[:, 0]) <= columns * self.side) & (np.abs(point[:, 1]) <= rows * self.side)
        i, j = (np.floor(np.where(reached, point[:, k], 0.0) / self.side).astype(np.intp) for k in (0, 1))
        # The far edge of the last square belongs to it.
        i, j = np.minimum(i + columns, 2 * columns - 1), np.minimum(j + rows, 2 * rows - 1)
        return np.where(reached, i * (2 * rows) + j, -1)

    def axes(self, pixel: Indices) -> Array:
        """See `Pixelation`."""
        return np.broadcast_to(np.array(self.part.axes), (len(pixel), 3, 3))

    def cells(self, pixel: Indices) -> Cells:
        """See `Pixelation`."""
        columns, rows = self.half_counts
        i, j = np.divmod(pixel, 2 * rows)
        middle = np.stack([i - columns + 0.5, j - rows + 0.5, np.zeros(len(pixel))], axis=1) * self.side
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * (self.side / 2)
        outlines = self.to_world(middle[:, None, :] + corners)
        area = np.full(len(pixel), self.side**2)
        extent = np.full((len(pixel), 2), self.side)
        return Cells(self.to_world(middle), self.axes(pixel), tuple(outlines), extent, area, area)

    def on_pixels(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """See `Pixelation`."""
        del direction, normal  # the cosine is the same all over a flat pixel
        columns, rows = self.half_counts
        i, j = np.divmod(pixel, 2 * rows)
        u, v = rng.random((2, len(pixel)))
        return self.to_world(np.stack([i - columns + u, j - rows + v, np.zeros(len(pixel))], axis=1) * self.side)
