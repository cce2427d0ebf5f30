"""Time of a virtual near-field measurement of some 10⁷ lit pixels, and of the rays drawn from it.

    python benchmarks/near_field.py

The lamp is the light field of the ring source; images of 160 × 160 pixels from 2 522 positions, four exposures. Times are wall
clock on all cores; the bar for the measurement is 30 s.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import etendue as et

Found = TypeVar("Found")
REPEATS = 3


def timed(name: str, work: Callable[[], Found]) -> tuple[float, Found]:
    """Least and largest time of some repeats [s], and what was made."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        found = work()
        times.append(time.perf_counter() - start)
    print(f"{name}: {min(times):.1f} to {max(times):.1f} s")
    return min(times), found


def main() -> None:
    field = et.LightField.fit(et.RingSource(rays=200_000).ray_set(), et.Disk(radius=30), depths=(5, 5, 3, 3))
    gonio = et.NearFieldGoniophotometer(5, camera_pixels=160, exposures=4)
    seconds, run = timed("measurement", lambda: gonio.measure(field))
    print(
        f"  {run.lit_pixels:,} lit pixels, {run.lit_pixels / seconds / 1e6:.2f} M/s; {seconds / 30:.2f} of the bar of 30 s"
    )
    print(f"  flux {run.total_flux / field.total_flux - 1:+.2e} of the field's")
    seconds, _ = timed("exposures merged", lambda: run.using(3).scale)
    seconds, rays = timed("10⁷ rays", lambda: run.ray_set(10**7))
    print(f"  {len(rays) / seconds / 1e6:.2f} M rays/s")


if __name__ == "__main__":
    main()
