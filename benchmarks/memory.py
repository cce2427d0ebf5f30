"""Peak memory of a pass over rays, beyond the map of their file, for a small set and for one as large as asked.

    python benchmarks/memory.py [--rays 1000000000]     # a 28 GB file; it is written to --folder and removed
    python benchmarks/memory.py --method count          # étendue counts in a grid of 32⁴ cells instead of a cone map
    python benchmarks/memory.py --method fit            # a whole light field on a stated plane, 32⁴ cells
    python benchmarks/memory.py --generated             # rays drawn on demand, without a file

Counts anonymous memory (RssAnon): pages of the mapped file belong to the page cache and are given back when needed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import etendue as et

SMALL = 5_000_000
"""Rays of the small set: from there on as many held-out rays are kept in memory as from any larger one."""

JOBS = {
    "cone": 'et.luminance_map(rays, et.Observer(30, 40, 1000), et.Screen(70, 70, 128, 128), method="cone").rays.sum()',
    "count": "count_rays(rays, plane, PartGrids((5, 5, 5, 5), (8, 8))).rays",
    "fit": "et.LightField.fit(rays, plane, depths=(5, 5, 5, 5)).report.rays",
}
"""What is done, by --method; each gives the number of rays that the result rests on."""

JOB = """
import sys, threading, time, warnings
import etendue as et
from etendue.lightfield.counting import PartGrids, count_rays
warnings.simplefilter("ignore")
def anonymous():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("RssAnon")) / 1024
peak, running = [0.0], [True]
def watch():
    while running[0]:
        peak[0] = max(peak[0], anonymous())
        time.sleep(0.005)
plane = et.Plane(z=0, width=60, height=60, centre=(0, 0))
base = anonymous()
thread = threading.Thread(target=watch); thread.start()
start = time.perf_counter()
rays = RAYS
seen = JOB
seconds = time.perf_counter() - start
running[0] = False; thread.join()
print(base, peak[0], seconds, int(seen))
"""


def measure(rays: str, job: str) -> tuple[float, float, float, int]:
    """(memory before [MiB], peak [MiB], seconds, rays seen) of a job on rays, in a process of its own."""
    script = JOB.replace("RAYS", rays).replace("JOB", job)
    result = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    base, peak, seconds, seen = result.stdout.split()
    return float(base), float(peak), float(seconds), int(seen)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=100_000_000)
    parser.add_argument("--method", choices=JOBS, default="cone")
    parser.add_argument("--generated", action="store_true", help="no file")
    parser.add_argument("--folder", type=Path, default=None, help="where the files are written")
    options = parser.parse_args()
    peaks = []
    for rays in (SMALL, options.rays):
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            path = Path(folder) / "rings.tm25ray"
            origin, text = "drawn on demand", f"et.RingSource(rays={rays})"
            if not options.generated:
                start = time.perf_counter()
                et.write_rays(path, et.RingSource(rays=rays))
                written = time.perf_counter() - start
                origin, text = (
                    f"{path.stat().st_size / 1e9:7.3f} GB: written in {written:6.1f} s",
                    f"et.read_rays({str(path)!r})",
                )
            base, peak, seconds, seen = measure(text, JOBS[options.method])
            peaks.append(peak)
            print(
                f"{rays:>13,} rays, {origin}, {options.method} in {seconds:6.2f} s ({rays / seconds / 1e6:6.1f} M rays/s), "
                f"peak {peak:6.1f} MiB ({peak - base:.1f} MiB above the import), {seen:,} rays seen",
                flush=True,
            )
    print(f"ratio of the peaks: {peaks[1] / peaks[0]:.2f}")


if __name__ == "__main__":
    main()
