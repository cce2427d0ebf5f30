"""Time of a virtual near-field measurement of some 10⁷ lit pixels, and of the rays drawn from it.

    python benchmarks/near_field.py

The lamp is the light field of the ring source; images of 160 × 160 pixels from 2 522 positions, four exposures. Times are
wall clock on all cores, the least of three; the bar for the measurement is 30 s.
"""

from __future__ import annotations

import etendue as et
from timing import best, load

BAR = 30.0  # [s]


def main() -> None:
    field = et.LightField.fit(et.RingSource(rays=200_000).ray_set(), et.Disk(radius=30), depths=(5, 5, 3, 3))
    gonio = et.NearFieldGoniophotometer(5, camera_pixels=160, exposures=4)
    run = gonio.measure(field)
    print(f"{load()}; {run.lit_pixels:,} lit pixels, flux {run.total_flux / field.total_flux - 1:+.1e} of the field's")
    seconds = best(lambda: gonio.measure(field), 3)
    print(
        f"measurement {seconds:.1f} s, {run.lit_pixels / seconds / 1e6:.2f} M pixels/s, {seconds / BAR:.2f} of the bar"
    )
    print(f"exposures merged, three of four: {best(lambda: run.using(3).scale, 3):.1f} s")
    seconds = best(lambda: run.ray_set(10**7), 3)
    print(f"10⁷ rays {seconds:.1f} s, {10 / seconds:.2f} M rays/s")


if __name__ == "__main__":
    main()
