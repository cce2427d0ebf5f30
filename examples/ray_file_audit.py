"""A ray-file audit: what is wrong with a file, said with place and numbers, before it is used.

    python examples/ray_file_audit.py

The header of a good file is spoilt: it claims 20 % more light than its rays carry, as real files do. Reading it says so,
with both numbers; `etendue info` prints the same. The flux of the data sheet, stated by hand, restores the map of the good
file.
"""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import etendue as et
import numpy as np
from experiments.checks import agree
from experiments.panels import draw_maps

RAYS, FLUX = 40_000, 90.0


def spoilt(whole: bytes) -> bytes:
    """The header's luminous flux 20 % up (TM-25-13: a float32 at byte 12)."""
    return whole[:12] + struct.pack("<f", 1.2 * struct.unpack_from("<f", whole, 12)[0]) + whole[16:]


def main() -> None:
    lamp = et.RingSource(radii=(0.6, 1.0), flux=(60.0, FLUX - 60.0), rays=RAYS, seed=1)
    et.write_rays("lamp.tm25ray", lamp)
    good = et.read_rays("lamp.tm25ray")
    Path("spoilt.tm25ray").write_bytes(spoilt(Path("lamp.tm25ray").read_bytes()))
    warnings.simplefilter("ignore", et.RayFileWarning)  # printed below
    bad = et.read_rays("spoilt.tm25ray")
    for complaint in bad.complaints:
        print(f"found: {complaint}")
    if not bad.complaints or good.complaints:
        raise SystemExit("the spoilt file must have complaints, and the good one none")
    agree("total flux that the header claims [lm]", bad.total_flux, 1.2 * good.total_flux, 1e-5 * FLUX)
    restated = bad.with_total_flux(FLUX, "lm")
    agree("total flux as stated by hand [lm]", restated.total_flux, FLUX, 1e-9 * FLUX)
    eye, screen = et.Observer(0, 0, 1000), et.Screen(2.4, 2.4, 24, 24)
    maps = [et.luminance_map(rays, eye, screen, method=et.Cone(acceptance=10)) for rays in (bad, restated, good)]
    if not np.allclose(maps[1].values, maps[2].values, rtol=1e-5, equal_nan=True):
        raise SystemExit("the map of the file with its flux restated is that of the good file")
    titles = ["header 20 % too high", "flux restated", "the good file"]
    draw_maps(
        Path("ray-file-audit.png"), "Two Lambertian rings from ray files, face on", titles, [("", maps)], size=2.3
    )
    print("picture: ray-file-audit.png")


if __name__ == "__main__":
    main()
