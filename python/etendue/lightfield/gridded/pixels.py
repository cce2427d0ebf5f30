"""Pixels of a carrier surface and their local axes: step 2 of section 3.2.2 of [Audenaert2014]_, and section 3.3.2.

Every part of a surface (`etendue.lightfield.carrier.part.Part`) has a pixelation of its own. A pixelation knows three
things: where a line crosses its part outwards, in which pixel that is, and what each pixel looks like.
"""

from __future__ import annotations

import abc
import dataclasses
import functools
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from etendue.lightfield.carrier import Part

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

SLACK = 1e-9
"""Share of a square by which a part may exceed the lattice: sums and quotients of sizes in mm are off by less than 1e-12 of
the number of squares, of which there are at most 1e4 or so along a side."""


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


def flat_size(part: Part) -> tuple[float, float]:
    """Width and height of a rectangle or disk [mm].

    Examples
    --------
    >>> from etendue.lightfield.carrier import Disk
    >>> flat_size(Disk(radius=2).parts()[0])
    (4.0, 4.0)
    """
    return part.size if part.shape == "rectangle" else (2 * part.size[0], 2 * part.size[0])


@dataclasses.dataclass(frozen=True)
class SquarePixels(Pixelation):
    """A flat part cut into squares of one lattice.

    Squares that the edge of the part cuts stay whole, as in the thesis: the disk of section 3.3.3 touches 368 of them.

    Parameters
    ----------
    part : Part
        A rectangle or a disk.
    side : float
        Δd [mm].
    corner : tuple of float
        Where a corner of the lattice lies, x and y in the part's own axes [mm].

    Examples
    --------
    >>> from etendue.lightfield.carrier import Disk, Plane
    >>> pixels = SquarePixels(Disk(radius=1.264).parts()[0], 0.125)
    >>> pixels.count, pixels.cells(np.array([0])).centre.round(4).tolist()
    (484, [[-1.3125, -1.3125, 0.0]])
    >>> plane = Plane(z=0, width=23, height=23, centre=(0, 0)).parts()[0]
    >>> SquarePixels(plane, 1.0).count, SquarePixels(plane, 1.0, (0.5, 0.5)).count
    (576, 529)
    """

    SHAPE = "square"
    side: float
    corner: tuple[float, float] = (0.0, 0.0)

    @functools.cached_property
    def lattice(self) -> tuple[Indices, Indices]:
        """Number of the first square along x and y, counted from `corner`, and how many there are."""
        half, corner = np.array(flat_size(self.part)) / 2, np.array(self.corner)
        first = np.floor((-half - corner) / self.side + SLACK)
        last = np.ceil((half - corner) / self.side - SLACK)
        return first.astype(np.intp), np.maximum(last - first, 1).astype(np.intp)

    @property
    def count(self) -> int:
        """Pixels, lit or not."""
        columns, rows = self.lattice[1]
        return int(columns) * int(rows)

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
        first, count = self.lattice
        with np.errstate(invalid="ignore"):
            steps = (point[:, :2] - self.corner) / self.side - first
            reached = np.all((steps >= -SLACK) & (steps <= count + SLACK), axis=1)
        # The far edge of the last square belongs to it.
        i, j = np.clip(np.floor(np.where(reached[:, None], steps, 0.0)).astype(np.intp), 0, count - 1).T
        return np.where(reached, i * count[1] + j, -1)

    def axes(self, pixel: Indices) -> Array:
        """See `Pixelation`."""
        return np.broadcast_to(np.array(self.part.axes), (len(pixel), 3, 3))

    def cells(self, pixel: Indices) -> Cells:
        """See `Pixelation`."""
        middle = self._points(pixel, np.full((len(pixel), 2), 0.5))
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * (self.side / 2)
        outlines = self.to_world(middle[:, None, :] + corners)
        area = np.full(len(pixel), self.side**2)
        extent = np.full((len(pixel), 2), self.side)
        return Cells(self.to_world(middle), self.axes(pixel), tuple(outlines), extent, area, area)

    def on_pixels(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """See `Pixelation`."""
        del direction, normal  # the cosine is the same all over a flat pixel
        return self.to_world(self._points(pixel, rng.random((2, len(pixel))).T))

    def _points(self, pixel: Indices, within: Array) -> Array:
        """Points of squares, 0 to 1 along either side, in the part's own axes."""
        first, count = self.lattice
        number = np.stack(np.divmod(pixel, count[1]), axis=1)
        flat = (first + number + within) * self.side + self.corner
        return np.column_stack([flat, np.zeros(len(pixel))])
