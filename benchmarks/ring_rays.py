"""Rays of the ring source of thesis 2.3 drawn and put through the cone estimator, beside the same in numpy.

python benchmarks/ring_rays.py [--rays 1400000000]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import etendue as et
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.cone import plain_statement

OBSERVER, SCREEN = et.Observer(0, 0, 150), et.Screen(70, 70, 128, 128)


def numpy_rings(source: et.RingSource, rays: int, chunk: int = 1 << 20) -> float:
    """Wall time [s] of drawing `rays` rays with numpy and mapping them with the plain statement of the equations."""
    rng = np.random.Generator(np.random.Philox(1))
    share = np.array(source.allocation) / sum(source.allocation)
    edges, flux = np.array(source.edges), np.array(source.ring_flux)
    total = np.zeros(SCREEN.shape)
    start = time.perf_counter()
    for first in range(0, rays, chunk):
        n = min(chunk, rays - first)
        zone = rng.choice(len(flux), n, p=share)
        a, b, c, d = rng.random((4, n))
        r = np.sqrt(edges[zone] ** 2 + a * (edges[zone + 1] ** 2 - edges[zone] ** 2))
        sin, cos = np.sqrt(c), np.sqrt(1 - c)
        position = np.stack([r * np.cos(2 * np.pi * b), r * np.sin(2 * np.pi * b), np.zeros(n)], axis=1)
        direction = np.stack([sin * np.cos(2 * np.pi * d), sin * np.sin(2 * np.pi * d), cos], axis=1)
        batch = et.RaySet(position, direction, (flux / share)[zone] / rays)
        total += plain_statement(batch, OBSERVER, SCREEN, 1.5)[0]
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=1_400_000_000, help="in 28 runs")
    options = parser.parse_args()
    source = et.RingSource(rays=options.rays // 28, runs=28)
    peer_rays = min(options.rays, 10_000_000)
    peer = numpy_rings(source, peer_rays) / peer_rays
    start = time.perf_counter()
    et.luminance_map(source, OBSERVER, SCREEN, method="cone")
    seconds = time.perf_counter() - start
    rate = len(source) / seconds
    print(f"numpy    {peer_rays:>14,} rays          {1e-6 / peer:8.2f} M rays/s")
    print(f"étendue  {len(source):>14,} rays {seconds:6.1f} s {rate / 1e6:8.2f} M rays/s   {rate * peer:.0f} × numpy")


if __name__ == "__main__":
    main()
