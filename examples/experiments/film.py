"""A film of 90° prisms by itself: how much of an even surface's luminance it lets through, by direction."""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.plot import style
from experiments.panels import LINES, new_figure, save

SIDE = 300.0
"""Of the film and of the surface below it [mm]: what the observer sees knows nothing of the edges."""

KNOWN = {
    0: {0: 0.951, 10: 0.930, 20: 0.899, 30: 0.809, 35: 0.441, 40: 0.032, 50: 0.029, 60: 0.292, 70: 0.649, 80: 0.892},
    90: {0: 0.951, 10: 0.949, 20: 0.946, 30: 0.935, 40: 0.907, 50: 0.701, 60: 0.0, 70: 0.0, 80: 0.0},
}
"""Transmission by azimuth (0: across the prisms) and polar angle: another program's, for an endless film, to ± 0.001."""

SCENE = et.Scene(
    name="film",
    sources=[
        {
            "kind": "surface",
            "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE},
            "flux": math.pi * SIDE**2 * 1e-6,  # 1 cd/m²
            "at": [0, 0, -0.001],
        }
    ],
    solids=[
        {
            "shape": {"kind": "prismatic-film", "width": SIDE, "height": SIDE, "thickness": 1, "pitch": 1},
            "medium": {"index": 1.59},
        }
    ],
)


def transmission(
    theta: npt.ArrayLike, phi: float, lines: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Mean luminance of one prism for each polar angle, with its standard error."""
    observers = [et.Observer(float(t), phi, 1e6, target=(0, 0, 1.5)) for t in np.asarray(theta)]
    maps = et.luminance_map(SCENE, observers, et.Screen(1, 1, 1, 1, "xy"), method=et.PathTracing(rays_per_pixel=lines))
    return np.array([m.values[0, 0] for m in maps]), np.array([m.standard_error[0, 0] for m in maps])


def print_and_draw(path: Path, lines: int) -> None:
    """How far the film is from the table, and both as a picture."""
    made = new_figure(6.4, 3.4, "The film of prisms alone: transmission of luminance")
    axes = made.subplots()
    for (phi, table), colour in zip(KNOWN.items(), LINES, strict=False):
        name = "across" if phi == 0 else "along"
        found, error = transmission(list(table), phi, lines)
        off = np.abs(found - list(table.values()))
        print(
            f"film alone, {name} the prisms: at most {off.max():.4f} from the table (standard error {error.max():.4f})"
        )
        theta = np.arange(0.0, 89.0, 1.0 if lines > 1000 else 8.0)
        axes.plot(theta, transmission(theta, phi, lines)[0], color=colour, linewidth=1.2, label=f"{name} the prisms")
        axes.plot(list(table), list(table.values()), "o", color=colour, markersize=4)
    axes.set_xlabel("θ [°]")
    axes.set_ylabel("share of luminance")
    axes.set_ylim(-0.02, 1.02)
    style.put_legend(axes, loc="lower left")
    save(made, path)
