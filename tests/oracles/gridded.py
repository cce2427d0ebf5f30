"""The gridded algorithm of thesis 3.2.2 and 3.3.2 read aloud: one ray, one pixel and one bin at a time."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
DIVISORS = [(30, 90), (18, 72), (15, 60), (10, 45), (9, 40), (6, 36), (5, 30), (3, 24), (2, 20), (1, 18), (1, 15)]
DIVISORS += [(1, step) for step in (12, 10, 9, 8, 6, 5, 4, 3, 2, 1)]
"""Step 4h, written out by hand."""


@dataclasses.dataclass
class Pixel:
    """Axes (rows x, y, z) and the rays that belong to it: θ and φ [°], flux."""

    axes: Array
    rays: list[tuple[float, float, float]] = dataclasses.field(default_factory=list)

    def add(self, direction: Array, flux: float) -> None:
        """Step 4a, with eqs. 3.7 and 3.8."""
        cosines = [float(np.dot(axis, direction)) for axis in self.axes]
        theta = math.degrees(math.acos(max(-1.0, min(1.0, cosines[2]))))
        self.rays.append((theta, math.degrees(math.atan2(cosines[1], cosines[0])) % 360.0, flux))


def bin_ranges(*, theta_step: float, phi_step: float) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Step 4b: R_θ and R_φ; those of φ may begin below 0."""
    thetas = [(0.0, theta_step / 2)]
    while thetas[-1][1] < 90 - 1e-9:
        thetas.append((thetas[-1][1], min(90.0, thetas[-1][1] + theta_step)))
    return thetas, [((k - 0.5) * phi_step, (k + 0.5) * phi_step) for k in range(round(360 / phi_step))]


def table(pixel: Pixel, *, theta_step: float, phi_step: float) -> tuple[list[float], Array]:
    """Steps 4b to 4e: central directions θ and intensities, the row at 90° included."""
    thetas, phis = bin_ranges(theta_step=theta_step, phi_step=phi_step)
    intensity = np.zeros((len(thetas) + 1, len(phis)))
    for k, (low, high) in enumerate(thetas):
        for m, (left, right) in enumerate(phis):
            flux = sum(
                f for t, p, f in pixel.rays if low <= t < high and (left <= p < right or left <= p - 360 < right)
            )
            omega = math.radians(right - left) * (math.cos(math.radians(low)) - math.cos(math.radians(high)))
            intensity[k, m] = flux / omega
    centres = [0.0] + [(low + high) / 2 for low, high in thetas[1:]] + [90.0]
    return centres, intensity


def flux_error(pixel: Pixel, *, theta_step: float, phi_step: float) -> float:
    """Steps 4f and 4g: E [%]."""
    centres, intensity = table(pixel, theta_step=theta_step, phi_step=phi_step)
    integral = 0.0
    for k in range(len(centres) - 1):
        for m in range(intensity.shape[1]):
            cosines = math.cos(math.radians(centres[k])) - math.cos(math.radians(centres[k + 1]))
            integral += (intensity[k, m] + intensity[k + 1, m]) / 2 * cosines * math.radians(phi_step)
    flux = sum(f for *_, f in pixel.rays)
    return abs(integral - flux) / flux * 100


def chosen_step(pixel: Pixel, threshold: float) -> tuple[int, int]:
    """Step 4h."""
    return next((s for s in DIVISORS if flux_error(pixel, theta_step=s[0], phi_step=s[1]) <= threshold), DIVISORS[-1])


def square_pixels(*, position: Array, direction: Array, flux: Array, side: float) -> dict[tuple[int, int], Pixel]:
    """Steps 1 to 3 on the XY plane."""
    found: dict[tuple[int, int], Pixel] = {}
    for x, d, f in zip(position, direction, flux, strict=True):
        start = x - x[2] / d[2] * d
        key = math.floor(start[0] / side), math.floor(start[1] / side)
        found.setdefault(key, Pixel(np.eye(3))).add(d, f)
    return found


def sphere_pixel(normal: Array) -> Array:
    """Axes of a spherical pixel from its z axis: section 3.3.2, away from the pole."""
    projection = np.array([normal[0], normal[1], 0.0])
    y = np.cross(normal, projection / np.linalg.norm(projection))
    y /= np.linalg.norm(y)
    return np.array([np.cross(y, normal), y, normal])


def spherical_cells(parallels: int) -> list[tuple[float, float, float, float]]:
    """Bounds θ0, θ1, φ0, φ1 [rad] of the equal-area cells of a hemisphere, ring after ring."""
    cells, rings, done = [], 2 * parallels - 1, 0
    for ring in range(parallels):
        count = 1 if ring == 0 else 8 * ring
        top, bottom = (math.acos(1 - n / rings**2) for n in (done, done + count))
        done += count
        cells += [(top, bottom, 2 * math.pi * m / count, 2 * math.pi * (m + 1) / count) for m in range(count)]
    return cells
