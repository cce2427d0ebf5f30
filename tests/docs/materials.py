"""The files that the pages of the documentation speak of, drawn."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np

from docs.pages import ROOT

PUBLIC = "Cyl10k.1.tm25ray"
"""The file of the tutorial."""


def lobe(rng: np.random.Generator, n: int, exponent: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Points and directions of a small LED whose lobe leans to +X: no symmetry."""
    position = np.stack([rng.uniform(-0.6, 0.6, n), rng.uniform(-0.4, 0.5, n), np.full(n, 0.3)], axis=1)
    cos = rng.random(n) ** (1 / (exponent + 1))
    sin, phi, lean = np.sqrt(1 - cos**2), rng.uniform(0, 2 * np.pi, n), np.radians(8)
    p, q, r = sin * np.cos(phi), sin * np.sin(phi), cos
    direction = np.stack([p * np.cos(lean) + r * np.sin(lean), q, r * np.cos(lean) - p * np.sin(lean)], axis=1)
    return position, direction


def cylinder(rng: np.random.Generator, n: int) -> et.RaySet:
    """Rays of a Lambertian side of a cylinder, which stands in for the public file of the tutorial."""
    phi, lean = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 2 * np.pi, n)
    cos = np.sqrt(rng.random(n))
    sin = np.sqrt(1 - cos**2)
    out, around = np.stack([np.cos(phi), np.sin(phi), 0 * phi], 1), np.stack([-np.sin(phi), np.cos(phi), 0 * phi], 1)
    up = np.array([0.0, 0.0, 1.0])
    direction = cos[:, None] * out + sin[:, None] * (np.cos(lean)[:, None] * around + np.sin(lean)[:, None] * up)
    position = 0.65 * out + rng.uniform(9, 13, n)[:, None] * up
    return et.RaySet(position, direction, np.full(n, 1.0 / n))


def write_materials(folder: Path, led: et.RaySet | None = None) -> None:
    """One LED in lumens, one in watts with wavelengths, a white one in two files; scatter, and a lens.

    Another LED can take the place of the first. The file of the tutorial is a stand-in.
    """
    rng = np.random.default_rng(20)
    position, direction = lobe(rng, 20_000, 1.2)
    small = et.RaySet(position, direction, np.full(20_000, 250.0 / 20_000))
    et.write_rays(folder / "led.tm25ray", led or small)
    for file, kind, n, watts, low, high in (
        ("watts.tm25ray", "tm25", 10_000, 0.6, 500, 660),
        ("blue.ray", "lighttools", 20_000, 0.4, 440, 470),
        ("yellow.ray", "lighttools", 30_000, 0.5, 510, 680),
    ):
        position, direction = lobe(rng, n, 1.0)
        nm = rng.uniform(low, high, n)
        rays = et.RaySet(position, direction, np.full(n, watts / n), flux_unit="W", wavelength=nm)
        et.write_rays(folder / file, rays, format=kind)
    vinyl = et.bsdf.Mixture(
        parts=[{"kind": "lambertian", "reflectance": 0.1}, {"kind": "gaussian", "peak": 0.3, "sigma": 0.2}]
    )
    et.write_bsdf(folder / "vinyl.bsdf", vinyl)
    lobe_of = 'kind = "cosine-power"\npeak = 2897.5\nexponent = 18204\nway = "transmitted"\n'
    (folder / "diffuser.toml").write_text(lobe_of, encoding="utf-8")
    brushed = 'kind = "gaussian"\npeak = 9.0\nsigma = 0.06\naspect = 3.0\naxis = [1, 0, 0]\n'
    (folder / "brushed.toml").write_text(brushed, encoding="utf-8")
    shutil.copy(ROOT / "examples" / "half-ball.step", folder)
    et.write_rays(folder / PUBLIC, cylinder(rng, 10_000))
