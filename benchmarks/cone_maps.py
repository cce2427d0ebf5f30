"""Cone maps of a TM-25 ray file that is in the page cache, beside the same equations in numpy.

python benchmarks/cone_maps.py [--rays 20000000]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import etendue as et
import numpy as np
from timing import best

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.cone import plain_statement

ACCEPTANCE = 1.5
SCREEN = et.Screen(70, 70, 128, 128)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=20_000_000)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rings.tm25ray"
        et.write_rays(path, et.RingSource(rays=options.rays))
        size = path.stat().st_size
        read = best(np.memmap(path, np.uint64, "r", shape=(size // 8,)).sum, 3)
        print(f"{options.rays:,} rays, {size / 1e6:,.0f} MB; summing its bytes in numpy: {read:.3f} s")
        observer = et.Observer(30, 40, 1000)

        def maps(count: int, threads: int | None, acceptance: float | str) -> Callable[[], object]:
            observers = [et.Observer(5 * i, 20 * i, 1000) for i in range(count)]
            return lambda: et.luminance_map(
                et.read_rays(path),
                observers,
                SCREEN,
                method="cone",
                acceptance=acceptance,  # type: ignore[call-overload]
                threads=threads,
            )

        def numpy_map() -> None:
            total = np.zeros(SCREEN.shape)
            for batch in et.read_rays(path).batches(1 << 20):
                total += plain_statement(batch, observer, SCREEN, ACCEPTANCE)[0]

        plain = best(numpy_map, 1)
        print(f"  numpy, one observer                  {plain:8.3f} s   {options.rays / plain / 1e6:7.1f} M rays/s")
        for title, job in (
            ("étendue, one observer, 1 thread", maps(1, 1, ACCEPTANCE)),
            ("étendue, one observer, all threads", maps(1, None, ACCEPTANCE)),
            ("étendue, one observer, acceptance auto", maps(1, None, "auto")),
            ("étendue, 16 observers, all threads", maps(16, None, ACCEPTANCE)),
        ):
            seconds = best(job, 5)
            rate = options.rays / seconds / 1e6
            print(f"  {title:<36} {seconds:8.3f} s   {rate:7.1f} M rays/s   {plain / seconds:6.1f} × numpy")


if __name__ == "__main__":
    main()
