"""A smooth image from few rays, beside the Gaussian whose width was chosen knowing the truth.

python benchmarks/smooth_image.py [--seeds 2] [--threads 2]

Per image and number of rays: NRMSE (root mean square error over the greatest true value) and NCC of the raw counts, of
the oracle's Gaussian and of `smooth_counts`, and the share of lit pixels whose error is within one and two standard errors.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from etendue.denoising.smoothing import smooth_counts

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.images import IMAGES, Array, ncc, nrmse, oracle_gaussian


def measured(truth: Array, seed: int, threads: int | None) -> list[float]:
    """NRMSE and NCC of raw, oracle and automatic image; coverage of one and two standard errors; seconds."""
    counts = np.random.default_rng(seed).poisson(truth).astype(np.float64)
    start = time.perf_counter()
    smooth = smooth_counts(counts, counts, np.ones_like(counts), threads=threads)
    seconds = time.perf_counter() - start
    off = (np.abs(smooth.mass - truth) / smooth.standard_error)[truth > 0]
    return [
        nrmse(counts, truth),
        ncc(counts, truth),
        *oracle_gaussian(counts, truth),
        nrmse(smooth.mass, truth),
        ncc(smooth.mass, truth),
        float((off < 1).mean()),
        float((off < 2).mean()),
        seconds,
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--threads", type=int, default=None)
    options = parser.parse_args()
    print("                          raw           oracle's Gaussian      automatic             within")
    print("image       rays     NRMSE    NCC      NRMSE    NCC        NRMSE    NCC        1 σ   2 σ   seconds")
    for name, image in IMAGES.items():
        shape = image()
        for rays in (10_000, 100_000, 1_000_000):
            truth = shape * (rays / shape.sum())
            rows = [measured(truth, seed, options.threads) for seed in range(options.seeds)]
            raw, raw_ncc, best, best_ncc, found, found_ncc, one, two, seconds = np.mean(rows, axis=0)
            print(
                f"{name:<10} {rays:>9,} {raw:7.4f} {raw_ncc:8.5f}  {best:7.4f} {best_ncc:8.5f}"
                f"   {found:7.4f} {found_ncc:8.5f}   {one:5.1%} {two:5.1%} {seconds:6.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
