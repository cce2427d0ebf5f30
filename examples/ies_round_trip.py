"""IES there and back: rays become an IES file, the file becomes a source, and its rays the same distribution.

    python examples/ies_round_trip.py

The intensity of a lopsided lamp is written as IES and as EULUMDAT, read again, and handed to the tracer as the light of a
point. What the tracer measures in the far field must be what the file says, within the error of the rays.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import INK, LINES, new_figure, save

RAYS, FLUX, LEAN = 150_000, 500.0, 20.0


def lamp() -> et.RaySet:
    """A cos⁴ lobe that leans to +X."""
    rng = np.random.default_rng(1)
    c, turn = rng.random(RAYS) ** 0.2, rng.uniform(0.0, 2.0 * math.pi, RAYS)
    s, lean = np.sqrt(1.0 - c**2), math.radians(LEAN)
    x, y = s * np.cos(turn), s * np.sin(turn)
    direction = [x * math.cos(lean) + c * math.sin(lean), y, c * math.cos(lean) - x * math.sin(lean)]
    return et.RaySet(np.zeros((RAYS, 3)), np.column_stack(direction), np.full(RAYS, FLUX / RAYS))


def main() -> None:
    first = et.intensity_distribution(lamp(), 36, 5)
    tables = {"rays": first}
    for name in ("lamp.ies", "lamp.ldt"):
        for note in et.write_intensity(name, first):
            print(f"note: {note}")
        tables[name] = et.read_intensity(name)
        agree(f"flux of {name} [lm]", tables[name].flux, FLUX, 0.001 * FLUX)
    scene = et.Scene(
        sources=[{"kind": "point", "intensity": tables["lamp.ies"], "flux": FLUX}],
        detectors=[{"name": "far", "kind": "intensity", "c_planes": 36, "gamma_step": 5}],
    )
    tables["traced again"] = et.trace(scene, rays=RAYS, seed=2).intensity["far"]
    top = FLUX * 5.0 / (2.0 * math.pi)  # of a cos⁴ lobe
    for name, table in tables.items():
        # Nodes of 5 by 10° average the top of the lobe, by 1.5 % each time, and hold the rays of a known number.
        rays = RAYS * top * 0.0052 / FLUX
        agree(f"on the lobe's axis, {name} [cd]", table.at(c=0, gamma=LEAN), top, top * math.hypot(0.015, rays**-0.5))
    made = new_figure(6.4, 4.0)
    axes = made.subplots(subplot_kw={"projection": "polar"})
    gamma = np.arange(0.0, 90.5, 1.0)
    for (name, table), colour, style in zip(tables.items(), LINES, ("-", "--", ":", "-."), strict=False):
        both = np.concatenate([table.at(c=180, gamma=gamma)[::-1], table.at(c=0, gamma=gamma)])
        angle = np.radians(np.concatenate([-gamma[::-1], gamma]))
        axes.plot(angle, both, style, color=colour, label=name, linewidth=1.6)
    axes.set_theta_zero_location("S")
    axes.set_thetalim(-math.pi / 2, math.pi / 2)
    axes.set_title("C180 – C0 [cd]", fontsize=9, color=INK)
    made.legend(loc="outside right upper", fontsize=8, frameon=False)
    save(made, Path("ies-round-trip.png"))
    print("picture: ies-round-trip.png")


if __name__ == "__main__":
    main()
