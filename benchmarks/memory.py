"""Peak memory of a luminance map, beyond the map of the file, for a small ray file and for one as large as asked.

    python benchmarks/memory.py [--rays 1000000000]     # a 28 GB file; it is written to --folder and removed

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

JOB = """
import sys, threading, time, warnings
import etendue as et
warnings.simplefilter("ignore")
def anonymous():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("RssAnon")) / 1024
peak, running = [0.0], [True]
def watch():
    while running[0]:
        peak[0] = max(peak[0], anonymous())
        time.sleep(0.005)
base = anonymous()
thread = threading.Thread(target=watch); thread.start()
start = time.perf_counter()
lmap = et.luminance_map(et.read_rays(sys.argv[1]), et.Observer(30, 40, 1000), et.Screen(70, 70, 128, 128), method="cone")
seconds = time.perf_counter() - start
running[0] = False; thread.join()
print(base, peak[0], seconds, int(lmap.rays.sum()))
"""


def measure(path: Path) -> tuple[float, float, float, int]:
    """(memory before [MiB], peak [MiB], seconds, rays seen) of a map of the file, in a process of its own."""
    result = subprocess.run([sys.executable, "-c", JOB, str(path)], check=True, capture_output=True, text=True)
    base, peak, seconds, seen = result.stdout.split()
    return float(base), float(peak), float(seconds), int(seen)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=100_000_000)
    parser.add_argument("--folder", type=Path, default=None, help="where the files are written")
    options = parser.parse_args()
    peaks = []
    for rays in (100_000, options.rays):
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            path = Path(folder) / "rings.tm25ray"
            start = time.perf_counter()
            et.write_rays(path, et.RingSource(rays=rays))
            written = time.perf_counter() - start
            size = path.stat().st_size
            base, peak, seconds, seen = measure(path)
            peaks.append(peak)
            print(
                f"{rays:>13,} rays, {size / 1e9:7.3f} GB: written in {written:6.1f} s, mapped in {seconds:6.2f} s "
                f"({rays / seconds / 1e6:6.1f} M rays/s), peak {peak:6.1f} MiB ({peak - base:.1f} MiB above the import), "
                f"{seen:,} rays seen"
            )
    print(f"ratio of the peaks: {peaks[1] / peaks[0]:.2f}")


if __name__ == "__main__":
    main()
