"""An image with a margin around it, and its Fourier transform: what directional filters work on."""

from __future__ import annotations

import functools
import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Transform = npt.NDArray[np.complex128]

MARGIN = 32
"""Least number of cells between the image and its own periodic copy, on either side."""

GRAIN = 32
"""The plane's sides are multiples of this, so that every 16th cell, the coarsest scale's, still make an even number."""


class FourierPlane:
    """A periodic plane that holds an image of one shape.

    Beyond its edges the image goes on as its own reflection, which is blended into the reflection that comes from the
    opposite edge: there is no seam that a filter could take for structure.

    Parameters
    ----------
    shape : tuple of int
        Rows and columns of the image.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.shape = shape
        self.size = (_round_number(shape[0] + 2 * MARGIN), _round_number(shape[1] + 2 * MARGIN))

    def extended(self, image: Array) -> Array:
        """The image and its continuation over the whole plane."""
        for axis in (0, 1):
            n, gap = self.shape[axis], self.size[axis] - self.shape[axis]
            steps = np.arange(gap)
            onwards, back = (np.take(image, _reflected(at, n), axis) for at in (n + steps, steps - gap))
            share = np.reshape(_ramp((steps + 0.5) / gap), (-1, 1) if axis == 0 else (1, -1))
            image = np.concatenate([image, (1 - share) * onwards + share * back], axis)
        return image

    def transform(self, image: Array, beyond: Array | None = None) -> Transform:
        """Transform of an image; the margin continues `beyond`, or is zero."""
        plane = np.zeros(self.size) if beyond is None else self.extended(beyond)
        plane[: self.shape[0], : self.shape[1]] = image
        return np.fft.rfft2(plane)

    def image(self, transform: Transform) -> Array:
        """The image that has this transform."""
        return np.fft.irfft2(transform, self.size)[: self.shape[0], : self.shape[1]]

    def frequencies(self, step: int = 1) -> tuple[Array, Array]:
        """Cycles per cell, along a row and along a column, of the coefficients of a plane of every `step`-th cell."""
        rows, columns = (n // step for n in self.size)
        return np.fft.rfftfreq(columns)[None, :] / step, np.fft.fftfreq(rows)[:, None] / step

    def coarsened(self, transform: Transform, step: int) -> Transform:
        """The transform of a plane of every `step`-th cell; frequencies too high for it are left out."""
        if step == 1:
            return transform
        half, columns = self.size[0] // step // 2, self.size[1] // step // 2 + 1
        coarse = np.zeros((2 * half, columns), dtype=np.complex128)
        coarse[:half], coarse[half:] = transform[:half, :columns], transform[-half:, :columns]
        coarse /= step**2
        return coarse

    def add_refined(self, total: Transform, coarse: Transform, step: int) -> None:
        """Add the transform of a coarsened plane to that of the whole one."""
        half, columns = coarse.shape[0] // 2, coarse.shape[1]
        total[:half, :columns] += coarse[:half] * step**2
        total[-half:, :columns] += coarse[-half:] * step**2

    def multiplicity(self) -> Array:
        """How many coefficients of the full transform each one of the half that is stored stands for."""
        counts = np.full((1, self.size[1] // 2 + 1), 2.0)
        counts[0, 0] = counts[0, -1] = 1.0  # the sides are even
        return counts


def blurred(values: Array, width: float) -> Array:
    """Convolution with a Gaussian of this standard deviation [cells] and sum 1; nothing lies beyond the edges."""
    rows, columns = (_round_number(n + math.ceil(6 * width)) for n in values.shape)
    fx, fy = np.fft.rfftfreq(columns)[None, :], np.fft.fftfreq(rows)[:, None]
    transform = np.fft.rfft2(values, (rows, columns)) * np.exp(-2 * (np.pi * width) ** 2 * (fx**2 + fy**2))
    smooth: Array = np.fft.irfft2(transform, (rows, columns))[: values.shape[0], : values.shape[1]]
    return smooth


@functools.cache
def blur_matrix(n: int, width: float) -> Array:
    """The matrix that `blurred` applies to rows and columns of n cells: as fast as transforms where images are small.

    Examples
    --------
    >>> image, matrix = np.eye(40)[:24], {n: blur_matrix(n, 1.5) for n in (24, 40)}
    >>> bool(np.allclose(matrix[24] @ image @ matrix[40], blurred(image, 1.5), atol=1e-12))
    True
    """
    size = _round_number(n + math.ceil(6 * width))
    kernel = np.fft.irfft(np.exp(-2 * (np.pi * width * np.fft.rfftfreq(size)) ** 2), size)
    matrix: Array = kernel[np.subtract.outer(np.arange(n), np.arange(n)) % size]
    return matrix


def _reflected(at: npt.NDArray[np.int64], n: int) -> npt.NDArray[np.int64]:
    """The cell of 0 … n − 1 that reflections at both ends show at a place beyond them."""
    at = at % (2 * n)
    return np.where(at < n, at, 2 * n - 1 - at)


def _ramp(t: Array) -> Array:
    """From 0 to 1, level at both ends."""
    return t * t * (3 - 2 * t)


def _round_number(n: int) -> int:
    """The least multiple of `GRAIN` from n on with no prime factor above 5: its transform is fast."""
    n = -(-n // GRAIN) * GRAIN
    while True:
        rest = n
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return n
        n += GRAIN
