"""IES there and back: rays become an IES file, the file becomes a source, and its rays the same distribution.

    python examples/ies_round_trip.py

The intensity of a lopsided lamp is written as IES and as EULUMDAT, read again, and handed to the tracer as the light of a
point. What the tracer measures in the far field must be what the file says, within the error of the rays.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree, table_error
from experiments.panels import LINES, new_figure, save
from numpy.typing import NDArray

RAYS, FLUX, LEAN = 150_000, 500.0, 20.0
PLANES, GAMMA_STEP = 36, 5.0

Array = NDArray[np.float64]


def lamp() -> et.RaySet:
    """A cos⁴ lobe that leans to +X."""
    rng = np.random.default_rng(1)
    c, turn = rng.random(RAYS) ** 0.2, rng.uniform(0.0, 2.0 * math.pi, RAYS)
    s, lean = np.sqrt(1.0 - c**2), math.radians(LEAN)
    x, y = s * np.cos(turn), s * np.sin(turn)
    direction = [x * math.cos(lean) + c * math.sin(lean), y, c * math.cos(lean) - x * math.sin(lean)]
    return et.RaySet(np.zeros((RAYS, 3)), np.column_stack(direction), np.full(RAYS, FLUX / RAYS))


def true_intensity(c: Array, gamma: Array) -> Array:
    """Of the lamp [cd], in the direction (C, γ) [°]."""
    c, gamma, lean = np.radians(c), np.radians(gamma), math.radians(LEAN)
    along = np.cos(gamma) * math.cos(lean) + np.sin(gamma) * np.cos(c) * math.sin(lean)
    return np.asarray(FLUX * 5.0 / (2.0 * math.pi) * np.maximum(along, 0.0) ** 4)


def mean_around_node(intensity: Callable[[Array, Array], Array], c: float, gamma: float) -> float:
    """What a node of a table from rays stands for: the mean over its hat function, which falls to 0 at the next nodes."""
    t = (np.arange(-100, 100) + 0.5) / 100
    u, v = np.meshgrid(t, t, indexing="ij")
    weight = (1 - abs(u)) * (1 - abs(v)) * np.sin(np.radians(gamma + GAMMA_STEP * v))
    return float(np.sum(weight * intensity((c + 360 / PLANES * u) % 360, gamma + GAMMA_STEP * v)) / weight.sum())


def main() -> None:
    first = et.intensity_distribution(lamp(), PLANES, GAMMA_STEP)
    tables = {"rays": first}
    for name in ("lamp.ies", "lamp.ldt"):
        for note in et.write_intensity(name, first):
            print(f"note: {note}")
        tables[name] = et.read_intensity(name)
        agree(f"flux of {name} [lm]", tables[name].flux, FLUX, 1e-5 * FLUX)
    scene = et.Scene(
        sources=[{"kind": "point", "intensity": tables["lamp.ies"], "flux": FLUX}],
        detectors=[{"name": "far", "kind": "intensity", "c_planes": PLANES, "gamma_step": GAMMA_STEP}],
    )
    tables["traced again"] = et.trace(scene, rays=RAYS, seed=2).intensity["far"]
    of_lamp, of_file = mean_around_node(true_intensity, 0, LEAN), mean_around_node(tables["lamp.ies"].at, 0, LEAN)
    for name, table in tables.items():
        # A file has the errors of the rays that it was made from, though it does not state them.
        truth, source = (of_file, table) if name == "traced again" else (of_lamp, first)
        error = table_error(source, 0, LEAN)
        agree(f"on the lobe's axis, {name} [cd]", float(table.at(c=0, gamma=LEAN)), truth, error)
    made = new_figure(6.4, 3.9, "A leaning lamp, to IES and EULUMDAT and back: C180 and C0 [cd]", layout=None)
    # A half circle is laid out as a whole one: what is above and below the picture is empty.
    axes = made.add_axes((0.14, -0.12, 0.72, 1.18), projection="polar")
    gamma = np.arange(0.0, 90.5, 1.0)
    for (name, table), colour, dashes in zip(tables.items(), LINES, ("-", "--", ":", "-."), strict=False):
        both = np.concatenate([table.at(c=180, gamma=gamma)[::-1], table.at(c=0, gamma=gamma)])
        angle = np.radians(np.concatenate([-gamma[::-1], gamma]))
        axes.plot(angle, both, dashes, color=colour, label=name, linewidth=1.6)
    axes.set_theta_zero_location("S")
    axes.set_thetalim(-math.pi / 2, math.pi / 2)
    axes.set_rticks([100, 200, 300, 400])
    axes.set_thetagrids(np.arange(-90, 91, 30), [f"{abs(g)}°" for g in range(-90, 91, 30)])
    made.legend(loc="lower center", ncols=len(tables), frameon=False, fontsize=9)
    save(made, Path("ies-round-trip.png"))
    print("picture: ies-round-trip.png")


if __name__ == "__main__":
    main()
