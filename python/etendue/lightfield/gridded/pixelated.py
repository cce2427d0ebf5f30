"""A whole carrier surface in pixels: which pixel a ray belongs to, and which pixels a line passes."""

from __future__ import annotations

import dataclasses
import math
import numbers
from collections.abc import Iterator
from typing import Literal

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Part, Surface
from etendue.lightfield.carrier.part import ALL, FLAT
from etendue.lightfield.gridded.curved_pixels import CylindricalPixels, SphericalPixels
from etendue.lightfield.gridded.pixels import SLACK, Array, Cells, Indices, Pixelation, SquarePixels, flat_size
from etendue.quantities.arguments import require, require_known, require_number

CentreOn = Literal["auto", "corner", "pixel"]
CENTRES: tuple[CentreOn, ...] = ("auto", "corner", "pixel")

MOST_PIXELS = 1 << 26
"""Pixels of a surface, lit or not: a quarter of a gigabyte for their numbers."""


@dataclasses.dataclass(frozen=True)
class PixelatedSurface:
    """The pixels of all parts of a surface, numbered part after part.

    Parameters
    ----------
    surface : Surface
        Without open dimensions.
    pixels : tuple of Pixelation
        One for each part.
    centre_on, origin
        As of `cut`.

    Examples
    --------
    >>> from etendue.lightfield.carrier import Dome
    >>> dome = PixelatedSurface.cut(Dome(radius=1.264), pixel=0.125, parallels=16)
    >>> [p.count for p in dome.pixels], dome.offsets.tolist()
    ([484, 961], [0, 484, 1445])
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> dome.owner(np.array([[0.01, 0.01, 5.0]]), up).tolist()
    [253]
    """

    surface: Surface
    pixels: tuple[Pixelation, ...]
    centre_on: CentreOn = "auto"
    origin: tuple[float, float, float] | None = None

    @classmethod
    def cut(
        cls,
        surface: Surface,
        pixel: float,
        parallels: int | None,
        *,
        centre_on: CentreOn = "auto",
        origin: tuple[float, float, float] | None = None,
    ) -> PixelatedSurface:
        """Cut every part.

        Parameters
        ----------
        surface : Surface
            Without open dimensions.
        pixel : float
            Δd [mm]: side of the squares on flat parts; cells on the side of a cylinder come as near as whole numbers
            allow.
        parallels : int, optional
            N, of each hemisphere. None: the number whose cells have the area nearest to Δd².
        centre_on : {"auto", "corner", "pixel"}
            What of the squares on flat parts lies at the origin of their lattice. ``"auto"``: along a side of a whole
            number of squares what makes them fit, else a corner.
        origin : tuple of float, optional
            Any point above or below that origin [mm]; the centre of each part if None.

        Raises
        ------
        UnknownNameError
            If `centre_on` is something else.
        ArgumentError
            If a size is out of its domain, or there would be too many pixels.
        """
        require_number(pixel, "pixel", "the side of a pixel in mm, above 0")
        if not (math.isfinite(pixel) and pixel > 0.0):
            raise ArgumentError(f"pixel is {pixel!r}; give the side of a pixel in mm, above 0.")
        require_known(centre_on, CENTRES, "place of the lattice")
        parts = surface.parts()
        if any(part.focus != FLAT or part.is_shared or part.beam != ALL for part in parts):
            raise ArgumentError(
                f"pixels lie on surfaces without focus, frames and beam, and {surface.told} has them; state it without."
            )
        if parallels is not None:
            require(parallels, numbers.Integral, "parallels", "a whole number, 1 or more, or None")
            parallels = int(parallels)
            if parallels < 1:
                raise ArgumentError(f"parallels is {parallels}; give 1 or more.")
            if not any(part.shape == "hemisphere" for part in parts):
                raise ArgumentError(f"parallels are those of a hemisphere, and the surface {surface.told} has none.")
        # Looked at first: of an absurdly small pixel not even the number can be counted.
        longest = max((max(p.size) for p in parts if parallels is None or p.shape != "hemisphere"), default=0.0)
        if longest / pixel < MOST_PIXELS:
            pixels = tuple(_cut(part, pixel, parallels, centre_on, origin) for part in parts)
            if sum(p.count for p in pixels) <= MOST_PIXELS:
                return cls(surface, pixels, centre_on, origin)
        raise ArgumentError(
            f"more than {MOST_PIXELS:,} pixels on {surface.told}; give a larger pixel than {pixel:g} mm, or a "
            "surface that ends where the light does, such as disk:radius=20."
        )

    @property
    def count(self) -> int:
        """Pixels of all parts, lit or not."""
        return int(self.offsets[-1])

    @property
    def offsets(self) -> Indices:
        """Number of the first pixel of each part, and the number of all pixels."""
        return np.concatenate([[0], np.cumsum([p.count for p in self.pixels])])

    @property
    def parallels(self) -> int | None:
        """N of the hemispheres, if there are any."""
        return next((p.parallels for p in self.pixels if isinstance(p, SphericalPixels)), None)

    @property
    def etendue(self) -> float:
        """Of all parts [mm² sr]."""
        return sum(p.part.etendue for p in self.pixels)

    def owner(self, position: Array, direction: Array) -> Indices:
        """The pixel each ray belongs to: that on the first part which its line crosses outwards; -1 if none.

        Parameters
        ----------
        position : array, shape (m, 3)
            Any point of each line [mm].
        direction : array, shape (m, 3)
            Unit vectors.
        """
        result = np.full(len(position), -1, dtype=np.intp)
        open_: Indices = np.arange(len(position))
        for offset, pixels in zip(self.offsets, self.pixels, strict=False):
            point, within = pixels.crossing(*pixels.to_local(position[open_], direction[open_]))
            result[open_[within]] = offset + pixels.index(point[within])
            open_ = open_[~within]
        return result

    def passed(self, position: Array, direction: Array) -> Iterator[Indices]:
        """For each part the pixel that each line leaves through, -1 if none: squares count beyond the part's edge."""
        for offset, pixels in zip(self.offsets, self.pixels, strict=False):
            point, _ = pixels.crossing(*pixels.to_local(position, direction))
            index = pixels.index(point)
            yield np.where(index >= 0, offset + index, -1)

    def local_directions(self, pixel: Indices, direction: Array) -> Array:
        """World directions (m, 3) in the axes of pixels (eqs. 3.7 and 3.8); as they are where the pixel is -1."""
        result = direction.copy()
        for offset, pixels in zip(self.offsets, self.pixels, strict=False):
            here = np.flatnonzero((pixel >= offset) & (pixel < offset + pixels.count))
            if isinstance(pixels, SquarePixels):
                result[here] = pixels.vectors_to_local(direction[here])
            else:
                lit, which = np.unique(pixel[here] - offset, return_inverse=True)
                result[here] = np.einsum("mij,mj->mi", pixels.axes(lit)[which], direction[here])
        return result

    def part_of(self, pixel: Indices) -> Indices:
        """Number of the part of each pixel."""
        return np.searchsorted(self.offsets, pixel, side="right") - 1

    def cells(self, pixel: Indices) -> Cells:
        """What these pixels look like; `pixel` rises."""
        parts = self.part_of(pixel)
        found = [
            pixels.cells(pixel[parts == i] - offset)
            for i, (offset, pixels) in enumerate(zip(self.offsets, self.pixels, strict=False))
        ]
        arrays = {
            name: np.concatenate([getattr(cells, name) for cells in found])
            for name in ("centre", "axes", "extent", "area", "projected_area")
        }
        return Cells(outline=tuple(outline for cells in found for outline in cells.outline), **arrays)

    def points_on(self, pixel: Indices, direction: Array, normal: Array, rng: np.random.Generator) -> Array:
        """A random point of each pixel as seen from each direction; see `Pixelation.on_pixels`."""
        parts, result = self.part_of(pixel), np.zeros_like(direction)
        for i, (offset, pixels) in enumerate(zip(self.offsets, self.pixels, strict=False)):
            here = parts == i
            result[here] = pixels.on_pixels(pixel[here] - offset, direction[here], normal[here], rng)
        return result


def _cut(
    part: Part, pixel: float, parallels: int | None, centre_on: CentreOn, origin: tuple[float, float, float] | None
) -> Pixelation:
    match part.shape:
        case "rectangle" | "disk":
            return SquarePixels(part, pixel, _corner(part, pixel, centre_on, origin))
        case "hemisphere":
            return SphericalPixels(part, _nearest_parallels(part.area, pixel) if parallels is None else parallels)
        case "tube":
            return CylindricalPixels(part, pixel)


def _corner(
    part: Part, pixel: float, centre_on: CentreOn, origin: tuple[float, float, float] | None
) -> tuple[float, float]:
    """A corner of the lattice in the axes of a flat part [mm]."""
    at = np.zeros(2) if origin is None else np.array(part.axes)[:2] @ (np.array(origin) - part.centre)
    if centre_on == "auto":
        squares = np.array(flat_size(part)) / pixel
        whole = np.abs(squares - np.round(squares)) <= SLACK * squares
        about_pixel = whole & (np.round(squares) % 2 == 1) if origin is None else np.zeros(2, dtype=bool)
    else:
        about_pixel = np.full(2, centre_on == "pixel")
    x, y = (at + np.where(about_pixel, 0.5 * pixel, 0.0)) % pixel
    return float(x), float(y)


def _nearest_parallels(area: float, pixel: float) -> int:
    """The number of parallels whose cells have the area nearest to a square's."""
    below = max(1, math.floor((math.sqrt(area) / pixel + 1.0) / 2.0))
    return min((below, below + 1), key=lambda n: abs(area / (2 * n - 1) ** 2 - pixel**2))
