"""Two linear filters fitted to noisy counts: one that follows edges and lines, and one for the image as a whole."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from etendue.denoising.fourier_plane import Array, FourierPlane, Transform

SCALES = 6
"""Octaves of wavelength in which structure is sought, from 2 cells on."""

DIRECTIONS = 12
"""Directions told apart in each octave."""

SIGNIFICANCE = 2.5
"""Energy around a coefficient, in units of that of noise, at which the first pass begins to let it through."""

FIRST_WINDOW, SECOND_WINDOW = 2.0, 0.7
"""Widths over which either pass averages that energy, in units of the scale."""

ELONGATION = 1.5
"""The windows are longer along an edge, and narrower across it, by this factor."""

KEPT = 1 << 16
"""Cells of the largest plane whose factors are kept for the next image: of larger ones they take much memory."""

RING_RATIO = 1.4
"""Outer over inner radius of a ring of frequencies."""

SECTORS = 8
"""Directions told apart in each ring."""


class DirectionalFrame:
    """Octaves and directions of an image's spatial frequencies: a tight frame, whose coefficients lie at every place.

    Parameters
    ----------
    plane : FourierPlane
        Shape and margin of the images.
    """

    def __init__(self, plane: FourierPlane) -> None:
        self.plane = plane
        self.scales = [_Scale(plane, j) for j in range(SCALES)]

    def filtered(
        self, image: Array, variance: Array, beyond: Array, pool: Executor, pilot: Array | None = None
    ) -> tuple[Array, Array]:
        """The image without the coefficients that its noise explains, and the variance of those that remain.

        Parameters
        ----------
        image, variance : array, shape (rows, columns)
            Noisy values, and the variances of their independent errors.
        beyond : array, shape (rows, columns)
            A smooth image, continued into the margin in place of the noisy one.
        pool : Executor
            Its threads share the directions.
        pilot : array, shape (rows, columns), optional
            An estimate, whose coefficients tell how strong those of the truth are: Wiener's filter. Without one, the
            energy of the noisy coefficients themselves must stand out from that of the noise.
        """
        plane = self.plane
        noisy, noise = plane.transform(image, beyond), plane.transform(variance)
        guide = None if pilot is None else plane.transform(pilot, pilot)
        filtered, left = noisy * self.scales[-1].below(plane) ** 2, np.zeros_like(noisy)
        for scale in self.scales:
            coarse = plane.coarsened(noisy, scale.step)
            guiding = None if guide is None else plane.coarsened(guide, scale.step)
            level = np.maximum(scale.cells(plane.coarsened(noise, scale.step) * scale.blur), 1e-12 * variance.mean())

            def one(
                direction: int,
                scale: _Scale = scale,
                coarse: Transform = coarse,
                guiding: Transform | None = guiding,
                level: Array = level,
            ) -> tuple[Transform, Array]:
                return scale.shrunk(direction, coarse, guiding, level)

            uncertain = np.zeros(scale.shape)
            for part, variances in pool.map(one, range(DIRECTIONS)):
                plane.add_refined(filtered, part, scale.step)
                uncertain += variances
            plane.add_refined(left, np.fft.rfft2(uncertain) * scale.blur, scale.step)
        return plane.image(filtered), np.maximum(plane.image(left), 0.0)


class _Scale:
    """One octave, on a plane coarse enough for it."""

    def __init__(self, plane: FourierPlane, index: int) -> None:
        self.index = index
        self.step = 2 ** max(0, index - 1)
        self.shape = (plane.size[0] // self.step, plane.size[1] // self.step)
        self.fx, self.fy = plane.frequencies(self.step)
        radius = np.hypot(self.fx, self.fy)
        self.angle = np.arctan2(self.fy, self.fx)
        above = np.ones_like(radius) if index == 0 else _low_pass(radius, index - 1)
        self.radial = np.sqrt(np.maximum(above**2 - _low_pass(radius, index) ** 2, 0.0))
        self.across = np.sqrt(sum(self._lobe(q) ** 2 for q in range(DIRECTIONS)))
        self.blur = np.exp(-2 * (np.pi * radius * 2**index) ** 2)
        self.multiplicity = plane.multiplicity()[:, : radius.shape[1]]
        self.plane_cells = plane.size[0] * plane.size[1]
        self._kept: dict[tuple[int, float | None], Array] = {}

    def _factors(self, direction: int, width: float | None = None) -> Array:
        """A direction's part of each coefficient, or its window of this width."""
        found = self._kept.get((direction, width))
        if found is None:
            found = self._response(direction) if width is None else self._window(direction, width)
            if self.plane_cells <= KEPT:
                self._kept[direction, width] = found
        return found

    def _response(self, direction: int) -> Array:
        response: Array = self.radial * self._lobe(direction) / self.across
        return response

    def _lobe(self, direction: int) -> Array:
        turn = np.pi * direction / DIRECTIONS
        power = np.cos(self.angle - turn) ** (2 * DIRECTIONS - 2)
        if self.fx[0, -1] == 0.5:
            # At the highest frequency along a row both directions fall on one coefficient.
            mirrored = np.cos(-self.angle[:, -1] - turn) ** (2 * DIRECTIONS - 2)
            power[:, -1] = (power[:, -1] + mirrored) / 2
        lobe: Array = np.sqrt(power)
        return lobe

    def below(self, plane: FourierPlane) -> Array:
        """What passes to coarser scales, as factors of the whole plane's transform."""
        return _low_pass(np.hypot(*plane.frequencies()), self.index)

    def cells(self, transform: Transform) -> Array:
        """Values on this scale's plane."""
        return np.fft.irfft2(transform, self.shape)

    def shrunk(
        self, direction: int, noisy: Transform, guide: Transform | None, level: Array
    ) -> tuple[Transform, Array]:
        """One direction's coefficients, shrunk and transformed back; and the variance of what remains."""
        response = self._factors(direction)
        noise = level * (self.multiplicity * response**2).sum() / self.plane_cells
        coefficients = self.cells(noisy * response)
        reference = coefficients if guide is None else self.cells(guide * response)
        window = self._factors(direction, FIRST_WINDOW if guide is None else SECOND_WINDOW)
        energy = np.maximum(self.cells(np.fft.rfft2(reference**2) * window), 0.0)
        threshold = SIGNIFICANCE * noise
        gain = 1 - threshold / np.maximum(energy, threshold) if guide is None else energy / (energy + noise)
        return np.fft.rfft2(gain * coefficients) * response, gain * noise

    def _window(self, direction: int, width: float) -> Array:
        turn = np.pi * direction / DIRECTIONS
        across = self.fx * np.cos(turn) + self.fy * np.sin(turn)
        along = self.fy * np.cos(turn) - self.fx * np.sin(turn)
        sigma = width * 2**self.index
        window: Array = np.exp(-2 * np.pi**2 * ((across * sigma / ELONGATION) ** 2 + (along * sigma * ELONGATION) ** 2))
        return window


def _low_pass(radius: Array, index: int) -> Array:
    """1 for frequencies below scale `index`, 0 for those above, a cosine over one octave in between."""
    octave = np.log2(np.maximum(radius, 1e-12) / 0.5)
    response: Array = np.cos(np.pi / 2 * np.clip(octave + index + 1, 0.0, 1.0))
    return response


def shrunk_rings(plane: FourierPlane, image: Array, variance: Array, beyond: Array) -> Array:
    """The image with each sector of each ring of its spatial frequencies shrunk as a whole, after Stein.

    The gain of a block is 1 − (T + 2 √(2T) + 4) v/E, never below 0: T coefficients with energy E in all, of which noise has
    v each. The bracket is what the energy of pure noise hardly exceeds [LaurentMassart2000]_ (lemma 1 with x = 2). No
    smooth filter of fixed shape does much better than such blocks [CavalierTsybakov2001]_. Parameters as those of
    `DirectionalFrame.filtered`.
    """
    transform = plane.transform(image, beyond)
    fx, fy = plane.frequencies()
    cycles = np.maximum(np.hypot(fx, fy) * max(plane.size), 1.0)
    ring = np.floor(np.log(cycles) / np.log(RING_RATIO)).astype(np.intp) + 1
    sector = np.floor(np.mod(np.arctan2(fy, fx), np.pi) / np.pi * SECTORS + 0.5).astype(np.intp) % SECTORS
    block = ring * SECTORS + sector
    block[0, 0] = 0  # the mean, which stays
    each = np.broadcast_to(plane.multiplicity(), transform.shape).ravel()
    number = np.maximum(np.bincount(block.ravel(), each), 1.0)
    energy = np.bincount(block.ravel(), each * np.abs(transform.ravel()) ** 2)
    noise = variance.sum() * (number + 2 * np.sqrt(2 * number) + 4)
    gain = 1 - noise / np.maximum(energy, noise)
    gain[0] = 1.0
    return plane.image(transform * gain[block])
