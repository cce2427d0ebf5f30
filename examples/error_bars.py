"""Error bars that hold: how often the truth lies within one and two standard errors.

    python examples/error_bars.py

Twenty sets of rays of a source whose luminance is known are mapped. Of all pixels within a ring, the truth must lie within
one standard error in 68.3 % and within two in 95.4 %. The sets are independent, so how far those shares may be off is known
too.
"""

from __future__ import annotations

import math
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot import style
from experiments.checks import agree
from experiments.panels import LINES, new_figure, save

SETS, RAYS = 20, 1_000_000


def main() -> None:
    eye, screen = et.Observer(0, 0, 500), et.Screen(60, 60, 20, 20)
    r = np.hypot(screen.x[None, :], screen.y[:, None])
    inside = r < 6.0  # the innermost ring ends at 10 mm
    scores = []
    for seed in range(1, SETS + 1):
        source = et.RingSource(radii=(10.0, 20.0, 30.0), flux=(300.0, 200.0, 100.0), rays=RAYS, seed=seed)
        lmap = et.luminance_map(source, eye, screen, method=et.Cone(acceptance=4))
        scores.append((lmap.values[inside] - source.zone_luminance[0]) / lmap.standard_error[inside])
    score = np.concatenate(scores)
    print(f"{score.size} pixels of {SETS} maps")
    # A pixel that is low by chance has a small error bar as well, which shifts the mean down by half of one ray.
    agree("mean deviation [standard errors]", float(score.mean()), 0.0, 1.0 / math.sqrt(score.size))
    for reach in (1.0, 2.0):
        share = math.erf(reach / math.sqrt(2.0))
        found, error = float(np.mean(np.abs(score) < reach)), math.sqrt(share * (1.0 - share) / score.size)
        agree(f"share within {reach:g} standard errors", found, share, error)
    made = new_figure(6.0, 3.4, f"Three Lambertian rings: the error bars of {SETS} maps")
    axes = made.subplots()
    axes.hist(score, bins=np.arange(-4, 4.1, 0.25), density=True, color=LINES[0], alpha=0.5, label="pixels")
    x = np.linspace(-4, 4, 200)
    axes.plot(x, np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi), color=LINES[1], label="normal distribution")
    axes.set_xlabel("(estimate − truth) / standard error")
    axes.set_ylabel("density")
    style.put_legend(axes)
    save(made, Path("error-bars.png"))
    print("picture: error-bars.png")


if __name__ == "__main__":
    main()
