"""Make the pictures of the quick start, of a packaged LED whose luminance is known: two views, and a report.

usage: python docs/quick_start_pictures.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import etendue as et
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.packaged_led import PackagedLed

FIGURES = Path(__file__).with_name("figures")
RAYS = 500_000


def main() -> None:
    """Draw both."""
    source = PackagedLed()
    position, direction = source.rays(RAYS, seed=1)
    rays = et.RaySet(position, direction, np.full(RAYS, source.total_flux / RAYS))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "led.tm25ray"
        et.write_rays(file, rays)
        report = et.report_source(file)
        et.plot_report(report, FIGURES / "report.png")
        et.plot_map(report.maps[1], FIGURES / "look.png")


if __name__ == "__main__":
    main()
