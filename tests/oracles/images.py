"""Luminance images of closed form, 256 × 256 unless said: sharp, finely structured and smooth; none symmetric."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

Array = npt.NDArray[np.float64]

WIDTHS = np.geomspace(0.4, 40.0, 41)
"""Widths among which the oracle chooses its Gaussian [cells]."""


def _coordinates(n: int) -> tuple[Array, Array]:
    y, x = (np.mgrid[0:n, 0:n] + 0.5) / n
    return x, y


def die(n: int = 256) -> Array:
    """An LED die: rounded corners, a tilt, five dark grid lines, a bond wire, a warm spot; its edges 0.8 cells soft."""
    x, y = _coordinates(n)
    u, v = np.abs(x - 0.5), np.abs(y - 0.5)
    inside = (np.maximum(u, v) < 0.36) & (np.hypot(np.maximum(u - 0.28, 0), np.maximum(v - 0.28, 0)) < 0.08)
    image = np.where(inside, 1 + 0.4 * x - 0.2 * y, 0.01)
    for k in range(1, 6):
        image = np.where(inside & (np.abs(x - 0.14 - 0.12 * k) < 0.006), 0.35 * image, image)
    wire = (np.abs(y - 0.3 - 0.15 * np.sin(5 * x)) < 0.008) & (x > 0.2)
    image = np.where(wire, 0.15 * image, image)
    image *= 1 + 0.15 * np.exp(-((x - 0.3) ** 2 + (y - 0.7) ** 2) / 0.02)
    return gaussian_filter(image, 0.8)


def turned_die(n: int = 256) -> Array:
    """The die seen by an observer who stands 17° aside: no edge lies along the grid."""
    x, y = _coordinates(n)
    turn = np.deg2rad(17.0)
    x, y = (
        0.5 + np.cos(turn) * (x - 0.5) - np.sin(turn) * (y - 0.5),
        0.5 + np.sin(turn) * (x - 0.5) + np.cos(turn) * (y - 0.5),
    )
    return np.maximum(_at(die(n), x, y), 0.01)


def _at(image: Array, x: Array, y: Array) -> Array:
    """Bilinear values at coordinates in units of the image's side; the border goes on."""
    n = len(image)
    column, row = np.clip(x * n - 0.5, 0, n - 1.001), np.clip(y * n - 0.5, 0, n - 1.001)
    i, j = row.astype(int), column.astype(int)
    s, t = row - i, column - j
    return (1 - s) * ((1 - t) * image[i, j] + t * image[i, j + 1]) + s * (
        (1 - t) * image[i + 1, j] + t * image[i + 1, j + 1]
    )


def blobs(n: int = 256) -> Array:
    """Three smooth spots, one of them slanted, on a dim ground."""
    x, y = _coordinates(n)
    return (
        0.02
        + np.exp(-((x - 0.35) ** 2 / 0.02 + (y - 0.4) ** 2 / 0.01))
        + 0.7 * np.exp(-((x - 0.7 + 0.5 * (y - 0.6)) ** 2 / 0.006 + (y - 0.6) ** 2 / 0.03))
        + 0.3 * np.exp(-((x - 0.5) ** 2 + (y - 0.85) ** 2) / 0.003)
    )


def disk(n: int = 256) -> Array:
    """A uniform disk with a sharp rim."""
    x, y = _coordinates(n)
    return np.where(np.hypot(x - 0.52, y - 0.47) < 0.31, 1.0, 0.02)


def stripes(n: int = 256) -> Array:
    """Slanted, slightly bent stripes that brighten downwards."""
    x, y = _coordinates(n)
    phase = 11 * (x * np.cos(0.4) + y * np.sin(0.4)) + 0.15 * np.sin(3 * y)
    return gaussian_filter(np.where(phase % 1 < 0.4, 1 + 0.5 * y, 0.1), 0.7)


def limb(n: int = 256) -> Array:
    """A limb-darkened disk with a faint texture."""
    x, y = _coordinates(n)
    radius = np.hypot(x - 0.47, y - 0.53) / 0.38
    image = np.where(radius < 1, 0.35 + 0.65 * np.sqrt(np.maximum(1 - radius**2, 0)), 0)
    texture = 0.12 * np.sin(60 * x) * np.sin(47 * y + 8 * x) + 0.1 * np.sin(25 * np.hypot(x - 0.2, y - 0.1))
    return image * (1 + texture) + 0.003


def halo(n: int = 256) -> Array:
    """A die with a bright edge in a halo that falls over three decades."""
    x, y = _coordinates(n)
    u, v = np.abs(x - 0.45), np.abs(y - 0.55)
    reach = np.maximum(u / 0.2, v / 0.26)
    image = np.where(reach < 1, 1 + 2 * np.exp(-(1 - reach) / 0.06), 0)
    distance = np.hypot(np.maximum(u - 0.2, 0), np.maximum(v - 0.26, 0))
    return gaussian_filter(image, 0.6) + 0.003 + 0.06 * np.exp(-distance / 0.06)


IMAGES: dict[str, Callable[[], Array]] = {
    "die": die,
    "turned die": turned_die,
    "disk": disk,
    "halo": halo,
    "limb": limb,
    "stripes": stripes,
    "blobs": blobs,
}


def ncc(image: Array, *, truth: Array) -> float:
    """Normalised cross correlation."""
    return float(np.corrcoef(image.ravel(), truth.ravel())[0, 1])


def nrmse(image: Array, *, truth: Array) -> float:
    """Root mean square error over the greatest true value."""
    return float(np.sqrt(((image - truth) ** 2).mean()) / truth.max())


def oracle_gaussian(counts: Array, *, truth: Array) -> tuple[float, float]:
    """Least NRMSE and greatest NCC of Gaussians of fixed width; each may choose its own, knowing the truth."""
    smooth = [gaussian_filter(counts, width, mode="reflect", truncate=5) for width in WIDTHS]
    scaled = [image * (truth.sum() / image.sum()) for image in smooth]
    return min(nrmse(image, truth=truth) for image in scaled), max(ncc(image, truth=truth) for image in scaled)
