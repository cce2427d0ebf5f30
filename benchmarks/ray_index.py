"""Cone maps from an index of rays, beside a pass over all of them; and what the index costs.

python benchmarks/ray_index.py [--rays 100000000] [--file led.tm25ray] [--folder /somewhere/with/room]

Without a file, rays of the ring source are indexed: 56 bytes each, or 28 if they are first written as TM-25 (--single).
"""

from __future__ import annotations

import argparse
import resource
import tempfile
from pathlib import Path

import etendue as et
import numpy as np
from etendue.quantities.ray_stream import RayStream
from timing import best, load, timed

SCREEN = et.Screen(70, 70, 128, 128)
VIEWS = (
    ("θ = 0°, 1000 mm", et.Observer(0, 0, 1000), 1.5),
    ("θ = 10°, 1000 mm", et.Observer(10, 45, 1000), 1.5),
    ("θ = 60°, 1000 mm", et.Observer(60, 120, 1000), 1.5),
    ("θ = 85°, 1000 mm", et.Observer(85, 200, 1000), 1.5),
    ("θ = 0°, 150 mm", et.Observer(0, 0, 150), 1.5),
    ("θ = 30°, 150 mm", et.Observer(30, 20, 150), 1.5),
    ("θ = 0°, 60 mm", et.Observer(0, 0, 60), 1.5),
    ("θ = 10°, 1000 mm, 0.25°", et.Observer(10, 45, 1000), 0.25),
    ("θ = 10°, 1000 mm, 5°", et.Observer(10, 45, 1000), 5.0),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=float, default=1e8)
    parser.add_argument("--file", type=Path, help="Index the rays of this file instead.")
    parser.add_argument("--single", action="store_true", help="Write the rays as TM-25 first.")
    parser.add_argument("--folder", type=Path, help="For the files made here.")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        source: RayStream = et.RingSource(rays=int(options.rays))
        if options.single:
            et.write_rays(Path(folder) / "rings.tm25ray", source)
            source = et.read_rays(Path(folder) / "rings.tm25ray")
        if options.file is not None:
            source = et.read_rays(options.file)
        path = Path(folder) / "rings.etd"
        built, _ = timed(lambda: et.RayIndex.build(source, path))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        bytes_each = path.stat().st_size / len(source)
        print(f"{len(source):,} rays, {load()}: indexed in {built:.1f} s, {path.stat().st_size / 1e6:,.0f} MB")
        print(f"  {bytes_each:.1f} bytes a ray; resident at most {peak:,.0f} MiB, mapped pages of the files among them")
        opening = best(lambda: et.RayIndex.open(path), 3)
        index = et.RayIndex.open(path)
        grid = f"{index.tables.side}² cells to a hemisphere, {len(index.tables.bounds):,} leaves"
        print(f"  {grid}; opened in {opening * 1e3:.1f} ms")
        for title, observer, acceptance in VIEWS:

            def look(
                rays: RayStream, observer: et.Observer = observer, acceptance: float = acceptance
            ) -> et.LuminanceMap:
                return et.luminance_map(rays, observer, SCREEN, method="cone", acceptance=acceptance)

            first = best(lambda: look(index), 1)
            quick, full = best(lambda: look(index), 7), best(lambda: look(source), 1)
            fast, slow = look(index), look(source)
            same = np.array_equal(fast.rays, slow.rays)
            live = slow.rays > 0
            apart = np.abs(fast.values[live] / slow.values[live] - 1).max(initial=0.0)
            looked = fast.notes[2].split(":")[1].split("rays")[0].strip()
            print(
                f"  {title:<26} {quick * 1e3:7.1f} ms (first {first * 1e3:6.1f})   full pass {full * 1e3:8.0f} ms, "
                f"{full / quick:6.0f} ×   looked at {looked:>11}, saw {int(slow.rays.sum()):>9,}; "
                f"{'same counts' if same else 'COUNTS DIFFER'}, sums within {apart:.0e}"
            )


if __name__ == "__main__":
    main()
