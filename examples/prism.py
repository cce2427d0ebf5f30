"""A prism: white light comes out as a fan of colours, each at the angle of Snell's law.

    python examples/prism.py

A narrow white beam passes an equilateral prism of BK7 at the angle of least deviation of green light. Each ray carries its
wavelength, and its direction behind the prism must be that of Snell's law at both faces, with the index of that wavelength.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from etendue.description.files import Files
from etendue.scene.media_library import MEDIA
from experiments.checks import agree
from experiments.panels import FAINT, new_figure, save

GLASS, SIDE, RAYS = "BK7", 30.0, 40_000
HEIGHT = SIDE * math.sqrt(3.0) / 2.0


def index(nm: np.ndarray) -> np.ndarray:
    return MEDIA[GLASS].medium.index_at(nm, Files())


def deviation(incident: float, nm: np.ndarray) -> np.ndarray:
    """Snell's law at both faces of an equilateral prism [rad]."""
    n = index(nm)
    inside = math.pi / 3.0 - np.arcsin(math.sin(incident) / n)
    return incident + np.arcsin(n * np.sin(inside)) - math.pi / 3.0


def main() -> None:
    incident = math.asin(float(index(np.array([546.0]))[0]) / 2.0)
    rng = np.random.default_rng(1)
    nm = rng.uniform(420.0, 680.0, RAYS)
    # The left face's inward normal points 30° below the x axis.
    heading = incident - math.radians(30.0)
    direction = np.tile([math.cos(heading), math.sin(heading), 0.0], (RAYS, 1))
    start = np.array([-SIDE / 4.0, 0.0, 0.0]) - 20.0 * direction[0]
    position = start + np.column_stack([np.zeros(RAYS), rng.uniform(-0.5, 0.5, RAYS), rng.uniform(-2, 2, RAYS)])
    beam = et.RaySet(position, direction, np.full(RAYS, 1.0 / RAYS), wavelength=nm)
    corners = [(-SIDE / 2, -HEIGHT / 2), (SIDE / 2, -HEIGHT / 2), (0.0, HEIGHT / 2)]
    scene = et.Scene(
        sources=[{"kind": "rays", "rays": beam}],
        solids=[{"medium": GLASS, "shape": {"kind": "prism", "vertices": corners, "height": 10}, "at": [0, 0, -5]}],
        detectors=[{"name": "out", "kind": "rays", "shape": {"kind": "sphere", "radius": 80}}],
    )
    out = et.trace(scene, rays=RAYS, seed=1).rays["out"]
    turned = heading - np.arctan2(out.direction[:, 1], out.direction[:, 0])
    assert out.wavelength is not None  # noqa: S101 - every ray of a trace has one
    expected = deviation(incident, out.wavelength)
    direct = np.abs(turned - expected) < math.radians(0.05)  # others were reflected inside
    print(f"{direct.mean():.1%} of the rays that left went straight through")
    for low in (430, 540, 650):
        there = direct & (np.abs(out.wavelength - low) < 10)
        agree(f"deviation at {low} ± 10 nm [°]", *np.degrees([turned[there].mean(), expected[there].mean()]), 1e-5)
    made = new_figure(6.4, 3.4, "A prism of BK7: deviation by wavelength")
    axes = made.subplots()
    axes.scatter(np.degrees(turned[direct]), out.wavelength[direct], c=out.wavelength[direct], s=3, cmap="turbo")
    axes.set_xlabel("deviation [°]")
    axes.set_ylabel("wavelength [nm]")
    axes.grid(color=FAINT, alpha=0.25)
    save(made, Path("prism.png"))
    print("picture: prism.png")


if __name__ == "__main__":
    main()
