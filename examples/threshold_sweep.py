"""How fine should the angular bins of a patch be? Section 3.2.4 of the thesis, and what its criterion does not see.

    python examples/threshold_sweep.py                     # a million rays, a few seconds
    python examples/threshold_sweep.py --rays 10000000     # finer bins pay with more rays, by one criterion only

The source is a disk of 23 mm under a prism film: most light leaves within sharp limits along one direction, and a little
leaks beyond them. Its rays are sampled into patches of 1 mm with one threshold after the other. The thesis compares the far
field of all patches with that of the rays (NCC); beside it stands the mean ln likelihood of rays that were kept back.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import etendue as et
import numpy as np
from etendue.goniophotometry.threshold_sweep import threshold_sweep
from etendue.lightfield.carrier import Disk
from etendue.plot.threshold_picture import plot_threshold_sweep

RADIUS, FLUX = 11.5, 1000.0
LIMITS, LEAK = (-0.45, 0.6), 0.06
"""Of the direction cosine along the prisms' pitch, and the share of light that leaves beyond them."""


def film(rays: int, seed: int) -> et.RaySet:
    """Rays of equal flux, from a Lambertian disk through the film, by rejection."""
    rng = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    while sum(map(len, found)) < rays:
        radius, turn = np.sqrt(rng.random((2, rays))), rng.random((2, rays)) * 2 * np.pi
        (x, p), (y, q) = radius * np.cos(turn), radius * np.sin(turn)
        along = 0.94 * p + 0.34 * q
        passes = (along > LIMITS[0]) & (along < LIMITS[1]) | (rng.random(rays) < LEAK)
        found.append(np.stack([RADIUS * x, RADIUS * y, p, q], axis=1)[passes])
    x, y, p, q = np.concatenate(found)[:rays].T
    position = np.stack([x, y, np.zeros(rays)], axis=1)
    direction = np.stack([p, q, np.sqrt(1 - p * p - q * q)], axis=1)
    return et.RaySet(position, direction, np.full(rays, FLUX / rays))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("threshold-sweep.png"))
    options = parser.parse_args()
    sweep = threshold_sweep(film(options.rays, options.seed), Disk(radius=RADIUS), pixel=1.0)
    print("threshold   bins per patch      NCC   score [nat per ray]")
    for threshold, bins, ncc, score, error in zip(
        *(sweep[name] for name in ("threshold", "bins", "ncc", "score", "score_error")), strict=True
    ):
        print(f"{threshold:8.3f} % {bins:15,.0f} {100 * ncc:7.2f} % {score:13.4f} ± {error:.4f}")
    plot_threshold_sweep(sweep, options.output, title="Patches of a disk under a prism film")
    print(f"picture: {options.output}")


if __name__ == "__main__":
    main()
