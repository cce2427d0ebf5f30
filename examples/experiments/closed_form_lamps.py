"""Three lamps whose luminance is known in closed form: what a virtual instrument measures can be held against them."""

from __future__ import annotations

import math
from collections.abc import Callable

import etendue as et
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Luminance = Callable[[Array, Array], Array]

DIE, RIM = 2e7, 2e5  # [cd/m²]
LED_SIZE = 6.4
"""Diameter of a ball that holds the LED [mm]."""

DOME = 1.25
"""Radius of the dome [mm]."""

CHIP, GLOW = 2e7, 200.0  # [cd/m²]
REFLECTOR = 250.0
"""Radius of the reflector that glows [mm]."""

CHIP_RADIUS = 3.0
REFLECTOR_SIZE = 505.0


def _crossing(points: Array, k: Array, z: float) -> tuple[Array, Array]:
    """Where lines that rise cross a height; NaN for others."""
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(k[:, 2] > 0.0, (z - points[:, 2]) / k[:, 2], np.nan)
    return points[:, 0] + along * k[:, 0], points[:, 1] + along * k[:, 1]


def led(points: Array, k: Array) -> Array:
    """A die of 2 mm × 1.6 mm with a bond pad and two fingers, brighter to the left, and a rim 0.6 mm above it.

    The rim has a hundredth of the die's luminance, more towards the side and more towards +x.
    """
    x, y = _crossing(points, k, 0.0)
    die = (np.abs(x - 0.2) < 1.0) & (np.abs(y) < 0.8)
    dark = ((x > 0.8) & (y > 0.4)) | ((np.abs(np.abs(y) - 0.35) < 0.05) & (x < 0.8))
    value = np.where(die, np.where(dark, 0.05, 1.0 - 0.2 * x) * DIE * (0.8 + 0.2 * k[:, 2]), 0.0)
    u, v = _crossing(points, k, 0.6)
    radius = np.hypot(u, v)
    rim = (radius > 2.5) & (radius < 3.0)
    return np.nan_to_num(value + np.where(rim, RIM * (1.2 - 0.6 * k[:, 2]) * (1.0 + 0.4 * k[:, 0]), 0.0))


def reflector(points: Array, k: Array) -> Array:
    """A chip whose luminance falls as cos² to its rim, in a reflector with a hundred thousandth of it.

    The reflector shines more towards +x. The chip has 1 195 lm, the reflector 123 lm.
    """
    x, y = _crossing(points, k, 0.0)
    radius = np.hypot(x - 20.0, y + 10.0)
    chip = np.where(radius < CHIP_RADIUS, CHIP * np.cos(0.5 * math.pi * radius / CHIP_RADIUS) ** 2, 0.0)
    glow = np.where(np.hypot(x, y) < REFLECTOR, GLOW * (1.0 + 0.5 * k[:, 0]), 0.0)
    return np.nan_to_num(chip + glow)


def dome(points: Array, k: Array) -> Array:
    """A die of 1.4 mm × 1 mm, and a dome of 1.25 mm about it that glows with a fourteenth of it at its foot, less above.

    From the side only the dome is seen, as in table 3.3 of the thesis. It is brighter on the side of +y.
    """
    x, y = _crossing(points, k, 0.0)
    die = np.where((np.abs(x - 0.1) < 0.7) & (np.abs(y) < 0.5), DIE, 0.0)
    middle = -np.einsum("ij,ij->i", points, k)
    near = points + middle[:, None] * k
    half = np.sqrt(np.maximum(DOME**2 - np.einsum("ij,ij->i", near, near), 0.0))
    leaves = near + half[:, None] * k
    out = (half > 0.0) & (leaves[:, 2] > 0.0)
    glow = DIE / 14.0 * np.exp(-4.0 * leaves[:, 2] / DOME) * (1.0 + 0.6 * leaves[:, 1] / DOME) / 1.6
    return np.nan_to_num(die) + np.where(out, glow, 0.0)


CHIP_FLUX = math.pi * CHIP * math.pi * CHIP_RADIUS**2 * (0.5 - 2.0 / math.pi**2) / 1e6
"""π L ∫ cos² over the chip [lm]."""

GLOW_FLUX = math.pi * GLOW * math.pi * REFLECTOR**2 / 1e6
"""The term in x vanishes over the hemisphere [lm]."""


def luminance_map(luminance: Luminance, observer: et.Observer, screen: et.Screen, lines: int = 8) -> et.LuminanceMap:
    """The lamp's own map: the mean over lines² lines of sight in each pixel, at the middles of a lattice."""
    right, up, _ = screen.axes(observer)
    total = np.zeros(screen.shape)
    offsets = (np.arange(lines) + 0.5) / lines - 0.5
    for i in offsets:
        for j in offsets:
            x = screen.x[None, :, None] + i * screen.width / screen.columns
            y = screen.y[:, None, None] + j * screen.height / screen.rows
            points = (np.asarray(observer.target) + x * right + y * up).reshape(-1, 3)
            k = observer.position - points
            total += luminance(points, k / np.linalg.norm(k, axis=1, keepdims=True)).reshape(screen.shape)
    zero = np.zeros(screen.shape)
    return et.LuminanceMap(total / lines**2, zero, np.full(screen.shape, -1), observer, screen)
