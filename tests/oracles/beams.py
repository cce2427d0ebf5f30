"""Beams of known intensity, as rays and as a scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def direction(*, c: npt.ArrayLike, gamma: npt.ArrayLike) -> Array:
    """Unit vectors of (C, γ) [°]."""
    a, b = np.broadcast_arrays(np.radians(c), np.radians(gamma))
    return np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1)


def beam(n: int, *, exponent: float, c: float, gamma: float, seed: int) -> Array:
    """Directions of I ∝ cosⁿ about an axis, by inversion."""
    rng = np.random.default_rng(seed)
    cos = rng.random(n) ** (1.0 / (exponent + 1.0))
    sin, phi = np.sqrt(1.0 - cos**2), rng.uniform(0, 2 * np.pi, n)
    frame = [direction(c=c, gamma=gamma + 90.0), direction(c=c + 90.0, gamma=90.0), direction(c=c, gamma=gamma)]
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1) @ np.stack(frame)


def lobe(*, exponent: float, c: float, gamma: float) -> Callable[[Array, Array], Array]:
    """Intensity of a beam I ∝ cosⁿ of unit flux over (C, γ) [°]."""
    axis = direction(c=c, gamma=gamma)
    return lambda a, b: (exponent + 1) / (2 * np.pi) * np.maximum(direction(c=a, gamma=b) @ axis, 0.0) ** exponent


def rays_of(*beams: tuple[Array, float]) -> et.RaySet:
    """Rays of several beams, each with its flux [lm]."""
    directions = np.concatenate([d for d, _ in beams])
    flux = np.concatenate([np.full(len(d), lm / len(d)) for d, lm in beams])
    return et.RaySet(np.zeros_like(directions), directions, flux)


def searchlight(**far: Any) -> et.Scene:
    """A ball of radius r in the focus of a paraboloid: seen from afar on the axis, all of the mirror has its luminance.

    I₀ = ρ L π R², L = Φ/(4π² r²).
    """
    return et.Scene(
        name="searchlight",
        sources=[{"kind": "surface", "shape": {"kind": "sphere", "radius": 0.4}, "flux": 60}],
        surfaces=[
            {"shape": {"kind": "paraboloid", "focal_length": 9, "radius": 30, "origin": "focus"},
             "finish": {"kind": "mirror", "reflectance": 0.8}},
            {"shape": {"kind": "disk", "radius": 30}, "at": [0, 0, -10], "finish": "absorber"},
        ],
        detectors=[{"name": "far", "kind": "intensity", **far}],
    )  # fmt: skip


PEAK = 0.8 * 60 / (4 * np.pi**2 * 0.4**2) * np.pi * 30**2
