"""What more cores, more rays and a graphics processor would give, from what is measured here: work and memory for each ray.

    python benchmarks/limits.py [--rays 10000000] [--cores 64] [--bandwidth 300]

For each job: the time of a ray on one thread; the share of the work that was not shared here (Amdahl's law, from one thread
and all of them); the bytes that a ray moves between memory and processor. The last columns are what `--cores` such cores
with so much memory bandwidth [GB/s] would give at most: cores over time, serial share or bandwidth, whichever is least.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import etendue as et
import numpy as np
from etendue import _core
from etendue.lightfield.counting import count_rays
from etendue.lightfield.fitting import grids_for
from etendue.scene import compile_scene
from light_field_speed import DEPTHS, RINGS
from scenes import analytic
from timing import best, cores, load

CORES = cores()


class Job(NamedTuple):
    """Work that is done ray by ray, or line by line."""

    title: str
    count: int
    run: Callable[[int | None], object]
    """With so many threads; None: all."""
    traffic: float
    """Bytes of memory that each moves, beyond what caches hold."""


def jobs(path: Path, rays: int) -> Iterator[Job]:
    """What is measured."""
    et.write_rays(path, et.RingSource(rays=rays))
    observer, screen, how = et.Observer(30, 40, 1000), et.Screen(70, 70, 128, 128), et.Cone(acceptance=1.5)
    # A record is read once, and written once to a buffer that stays in the cache.
    record = 28.0
    yield Job("decode, check and sum a ray", rays, lambda n: _core.scan(et.read_rays(path).core_source(), n), record)
    yield Job(
        "cone map",
        rays,
        lambda n: et.luminance_map(et.read_rays(path), observer, screen, method=how, threads=n),
        record,
    )
    grids = grids_for(rays, DEPTHS)
    # Beside the record: a line of 64 bytes of each grid, read and written, where the grid is larger than the caches.
    finest = sum(4.0**depth for depth in grids.fine) * 4.0
    yield Job(
        "étendue counts",
        rays,
        lambda n: count_rays(et.read_rays(path), RINGS, grids, threads=n),
        record + 128.0 * (finest > 32e6),
    )
    core, traced = _core.Scene(compile_scene(analytic()).record), max(rays // 20, 1 << 18)
    batches = -(-traced // _core.batch_size())
    segments = _core.work_unit(core, traced, 1, 1_000_000, 0, batches)["ledger"]["segments"]
    yield Job(
        "a segment in a cavity of two walls",
        segments,
        lambda n: _core.work_unit(core, traced, 1, 1_000_000, 0, batches, n),
        0.0,
    )
    field = et.LightField.fit(et.RingSource(rays=1_000_000), et.Disk(radius=30), depths=(5, 5, 5, 5))
    drawn = field.rays(rays // 10)
    yield Job("a ray drawn from a light field", rays // 10, lambda n: _core.scan(drawn.core_source(), n), 0.0)
    view = et.Screen(70, 70, 256, 256)
    yield Job(
        "a point of a map from a light field",
        256 * 256 * 16,
        lambda n: et.luminance_map(field, observer, view, samples=16, threads=n),
        0.0,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=10_000_000)
    parser.add_argument("--cores", type=int, default=64)
    parser.add_argument("--bandwidth", type=float, default=300.0)
    options = parser.parse_args()
    values: Any = np.ones(1 << 26)
    copied = np.empty_like(values)
    moved = 2 * values.nbytes / best(lambda: np.copyto(copied, values), 5) / 1e9
    print(f"{load()}; one thread copies {moved:.1f} GB/s")
    print(f"{'':<38} {'one thread':>11} {'all':>11} {'serial':>7} {'bytes':>6}   {options.cores} cores, at most")
    with tempfile.TemporaryDirectory() as folder:
        for job in jobs(Path(folder) / "rings.tm25ray", options.rays):
            one, all_ = best(lambda job=job: job.run(1), 3), best(lambda job=job: job.run(None), 3)
            serial = min(max((CORES * all_ / one - 1) / (CORES - 1), 0.0), 1.0) if CORES > 1 else 0.0
            ideal = job.count / (one * (serial + (1 - serial) / options.cores))
            bound = options.bandwidth * 1e9 / job.traffic if job.traffic else float("inf")
            limit = "memory" if bound < ideal else "serial share" if serial * options.cores > 1 else "cores"
            rate = min(ideal, bound)
            print(
                f"{job.title:<38} {one / job.count * 1e9:8.1f} ns {all_ / job.count * 1e9:8.1f} ns {serial:7.1%} "
                f"{job.traffic:6.0f}   {rate / 1e6:7.3g} M/s by {limit}; 10¹² in {1e12 / rate / 3600:.2g} h",
                flush=True,
            )


if __name__ == "__main__":
    main()
