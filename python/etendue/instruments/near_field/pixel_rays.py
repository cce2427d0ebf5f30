"""Rays from the images of a near-field measurement: each pixel is a ray of known direction and flux."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.positions import ArmPositions
from etendue.instruments.near_field.starting_points import on_surface
from etendue.lightfield.carrier import Surface
from etendue.quantities.observer import Observer, Screen

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.intp]

GOLDEN = 0.6180339887498949
"""Step from each ray to the next along the summed flux, as a share of all of it: any stretch of rays is spread evenly."""

BLOCK = 1 << 18
"""Rays that are drawn together."""


@dataclasses.dataclass(frozen=True, eq=False)
class PixelRays:
    """What is needed to draw rays.

    Parameters
    ----------
    stops : ArmPositions
    screen : Screen
        The image.
    centre : tuple of 3 floats
        About which the arm turns [mm].
    distance : number
        Of the camera [mm].
    start : array, shape (positions + 1,)
        First lit pixel of each position in `pixel`.
    pixel : array, shape (n,)
        Row by row.
    flux : array, shape (n,)
        Of the light that each pixel stands for [flux unit].

    Examples
    --------
    >>> from etendue.instruments.near_field.positions import ArmPositions
    >>> screen, start = Screen(2, 2, 2, 2), np.append(0, np.ones(22, dtype=np.intp))
    >>> rays = PixelRays(ArmPositions(30, 90), screen, (0.0, 0.0, 0.0), 50.0, start, np.array([1], "u4"), np.ones(1, "f4"))
    >>> points, camera = rays.lines(np.array([0]), np.random.default_rng(1))       # the upper right quarter, seen from above
    >>> bool(0 < points[0, 0] < 1 and 0 < points[0, 1] < 1), camera.tolist()
    (True, [[0.0, 0.0, 50.0]])
    """

    stops: ArmPositions
    screen: Screen
    centre: tuple[float, float, float]
    distance: float
    start: Integers
    pixel: npt.NDArray[np.uint32]
    flux: npt.NDArray[np.float32]

    def stop_of(self, lit: Integers) -> Integers:
        """The position at which each of some lit pixels was seen."""
        return np.searchsorted(self.start, lit, side="right") - 1

    def lines(self, lit: Integers, rng: np.random.Generator) -> tuple[Array, Array]:
        """A point of the plane of the image, at random within each of some lit pixels, and the camera there, (n, 3) each."""
        stops = self.stop_of(lit)
        frames = self._frames
        row, column = np.divmod(self.pixel[lit].astype(np.intp), self.screen.columns)
        width, height = self.screen.width / self.screen.columns, self.screen.height / self.screen.rows
        x = self.screen.x[column] + width * (rng.random(len(lit)) - 0.5)
        y = self.screen.y[row] + height * (rng.random(len(lit)) - 0.5)
        right, up, towards = (frames[stops, i] for i in range(3))
        middle = np.asarray(self.centre)
        return middle + x[:, None] * right + y[:, None] * up, middle + self.distance * towards

    def rays(
        self, lit: Integers, surface: Surface | None, rng: np.random.Generator, *, between: bool
    ) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Start points, directions, and which rays do not cross the surface.

        Parameters
        ----------
        lit : array of int, shape (n,)
            Lit pixels.
        surface : Surface or None
            Where the rays start; None: in the plane of the image.
        rng : Generator
            Of places within pixels and of directions.
        between : bool
            Whether directions fill the space between positions. The point of the surface that a pixel sees is then taken
            to send the same light there, by the weight that the position has there.
        """
        points, camera = self.lines(lit, rng)
        along = camera - points
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        missed = np.zeros(len(lit), dtype=bool)
        if surface is not None:
            points, missed = on_surface(surface, points, along)
        if between:
            camera = np.asarray(self.centre) + self.distance * self.stops.drawn(self.stop_of(lit), rng)
            along = camera - points
            along /= np.linalg.norm(along, axis=1, keepdims=True)
        return points, along, missed

    def chosen(self, summed: Array, first: int, count: int, offset: float) -> Integers:
        """Lit pixels of rays `first` to `first + count`, each pixel as often as its flux asks for."""
        turn = np.mod(offset + np.mod((first + np.arange(count)) * GOLDEN, 1.0), 1.0)
        found = np.searchsorted(summed, turn * summed[-1], side="right")
        return np.asarray(np.minimum(found, len(self.flux) - 1), dtype=np.intp)

    @cached_property
    def _frames(self) -> Array:
        """Axes of the camera at each position, shape (positions, 3, 3): right, up, towards it."""
        stops = zip(self.stops.gamma, self.stops.c, strict=True)
        return np.array([self.screen.axes(Observer(float(g), float(a), self.distance, self.centre)) for g, a in stops])


def in_blocks(
    count: int, seed: int, make: Callable[[int, int, np.random.Generator], None], progress: Callable[[int], None] | None
) -> None:
    """Call `make` for each block of rays with random numbers of its own: the same rays whatever was drawn before.

    Examples
    --------
    >>> in_blocks(300_000, 1, lambda first, count, rng: print(first, count), None)
    0 262144
    262144 37856
    """
    for block, first in enumerate(range(0, count, BLOCK)):
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 4, block))))
        make(first, min(BLOCK, count - first), rng)
        if progress is not None:
            progress(min(first + BLOCK, count))
