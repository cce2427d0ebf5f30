"""Luminance of an LED in a parabola under a diffuser, by sums over directions, without any of étendue.

Backwards from a point of the diffuser along a direction: straight into the LED, or off the parabola z = r²/(4f) and on. The
crossing is a root of a quadratic equation, the mirrored direction by its normal. The diffuser weighs the directions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def luminance(
    *,
    x: float,
    y: float,
    lobe: Callable[[Array], Array],
    reach: float,
    side: float,
    focus: float,
    radius: float,
    reflectance: float,
    flux: float,
    distance: float,
    nodes: int = 81,
) -> float:
    """In cd/m² at a point of the opening [mm], for an observer on the axis.

    `lobe` is f [1/sr] of the angle [rad] from the direction that goes straight on, 0 beyond `reach` [rad]; the LED is a
    square in the focus that looks out of the opening.
    """
    height = radius**2 / (4 * focus)
    steps = (np.arange(nodes) + 0.5) / nodes * 2 * reach - reach
    dx, dy = np.meshgrid(steps, steps)
    weight = lobe(np.hypot(dx, dy)) * (steps[1] - steps[0]) ** 2
    # From the observer's side on downwards.
    ux, uy = x / distance + dx, y / distance + dy
    uz = -np.sqrt(1 - ux**2 - uy**2)
    p, q, z = np.full(ux.shape, x), np.full(ux.shape, y), np.full(ux.shape, height)
    own = flux / (np.pi * side**2) * 1e6
    seen, on_its_way, left = np.zeros(ux.shape), np.ones(ux.shape, bool), 1.0
    for _ in range(4):
        with np.errstate(divide="ignore", invalid="ignore"):
            to_led = (focus - z) / uz
            a = ux**2 + uy**2
            b = 2 * (p * ux + q * uy) - 4 * focus * uz
            c = p**2 + q**2 - 4 * focus * z
            half = -0.5 * (b + np.copysign(np.sqrt(b * b - 4 * a * c), b))
            roots = np.stack([half / a, c / half])
            roots[~(roots > 1e-6)] = np.inf
            t = roots.min(axis=0)
            met = on_its_way & (uz < 0) & (to_led > 0) & (to_led < t)
            met &= (np.abs(p + to_led * ux) < side / 2) & (np.abs(q + to_led * uy) < side / 2)
            on_its_way &= ~met & np.isfinite(t) & (z + t * uz <= height)
        seen[met] = own * left
        t = np.where(on_its_way, t, 0.0)
        p, q, z = p + t * ux, q + t * uy, z + t * uz
        normal = np.stack([-2 * p, -2 * q, np.full(p.shape, 4 * focus)])
        normal /= np.linalg.norm(normal, axis=0)
        along = 2 * (ux * normal[0] + uy * normal[1] + uz * normal[2])
        ux, uy, uz = ux - along * normal[0], uy - along * normal[1], uz - along * normal[2]
        left *= reflectance
    return float((seen * weight).sum())
