"""How many rays does a light field need? The learning curve of an LED whose maps are known.

    python examples/how_many_rays.py           # up to 20 000 rays, seconds
    python examples/how_many_rays.py --full    # up to ten million: the table of docs/how-many-rays.md

A die in a silicone dome is traced with more and more rays. From each ray file alone a field is fitted, and its maps are
compared with those of the LED itself, by lines of sight through dome and base; beside it stands the cone of chapter 2 at
the acceptance of least estimated error. Each field says how sure it is of itself, what it resolves, and what four times
its rays would bring: the next field but one says what they did bring.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import time
from pathlib import Path

import etendue as et
import numpy as np
from etendue.plot import style
from experiments import led
from experiments.panels import FAINT, INK, LINES, QUICK, new_figure, save

OBSERVERS = [et.Observer(theta=theta, phi=20, distance=1000) for theta in (0, 40, 70)]


@dataclasses.dataclass(frozen=True)
class Row:
    """What a number of rays gives: true NRMSE of field and cone over all observers, and what the field says of itself."""

    rays: int
    field: float
    cone: float
    found: et.Diagnostics
    seconds: float


def error(maps: list[et.LuminanceMap], truth: list[et.LuminanceMap]) -> float:
    """Root of the mean square of the true NRMSE over all observers [%]."""
    agreements = [et.compare(ours, true) for ours, true in zip(maps, truth, strict=True)]
    return 100.0 * float(np.sqrt(np.mean([a.nrmse**2 for a in agreements])))


def learnt(rays: et.RaySet, truth: list[et.LuminanceMap], screen: et.Screen, *, full: bool) -> Row:
    """The row of a ray file; in a hurry on the plane of the die and a coarse grid."""
    start = time.perf_counter()
    field = et.LightField.fit(rays) if full else et.LightField.fit(rays, et.Disk(z=led.DIE_TOP), depths=QUICK)
    seconds = time.perf_counter() - start
    cone = et.luminance_map(rays, OBSERVERS, screen, method=et.Cone(acceptance="auto"))
    seen = et.luminance_map(field, OBSERVERS, screen)
    return Row(len(rays), error(seen, truth), error(cone, truth), et.diagnose(field, rays), seconds)


def print_rows(rows: list[Row]) -> None:
    """The table, and the forecasts beside what came of them."""
    print("     rays    field     cone   error bars say     resolves at half contrast      fit")
    for row in rows:
        fine = row.found.resolution
        print(
            f"{row.rays:9,d}  {row.field:5.1f} %  {row.cone:5.1f} %  {100 * row.found.expected_error:13.1f} %   "
            f"{fine.place:8.3f} mm, {fine.direction:5.1f}°     {row.seconds:6.1f} s"
        )
    print("\ngain of the held-out score [nat per ray]       forecast (68 %)        measured")
    for before, after in itertools.pairwise(rows):
        if before.found.forecast is None:
            continue
        told = before.found.forecast.gain(after.rays / before.rays)
        gain = after.found.report.score - before.found.report.score
        sure = np.hypot(after.found.report.score_error, before.found.report.score_error)
        print(
            f"{before.rays:9,d} to {after.rays:10,d}          {told.value:.4f} ({told.low:.4f} to {told.high:.4f})"
            f"     {gain:.4f} ± {sure:.4f}"
        )


def draw(rows: list[Row], noise: float, path: Path) -> None:
    """Errors, and what is resolved, against the number of rays."""
    made = new_figure(9.6, 3.9, "An LED with a silicone dome: what more rays bring")
    left, right = made.subplots(1, 2)
    rays = [row.rays for row in rows]
    left.loglog(rays, [row.cone for row in rows], "s-", color=FAINT, label="cone, best acceptance")
    left.loglog(rays, [row.field for row in rows], "o-", color=LINES[1], label="light field")
    left.axhline(noise, color=INK, linewidth=0.8, linestyle=":", label="noise of the true maps")
    left.set_ylabel("true NRMSE of maps [%]")
    right.loglog(rays, [row.found.resolution.place for row in rows], "o-", color=LINES[1])
    right.axhline(0.05, color=INK, linewidth=0.8, linestyle=":", label="pixel of the maps")
    right.set_ylabel("pitch at half contrast [mm]")
    for axes in (left, right):
        axes.set_xlabel("rays")
        axes.grid(visible=True, which="major", linewidth=0.4, alpha=0.5)
        style.put_legend(axes)
    save(made, path)


def main() -> None:
    """The table and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="up to ten million rays")
    parser.add_argument("--output", type=Path, default=Path("how-many-rays.png"))
    options = parser.parse_args()
    numbers = (10**4, 10**5, 10**6, 10**7) if options.full else (5000, 20_000)
    side, lines = (50, 256) if options.full else (25, 16)
    screen, scene = et.Screen(2.5, 2.5, side, side), et.Scene(name="dome LED", **led.PARTS)
    truth = et.luminance_map(scene, OBSERVERS, screen, method=et.PathTracing(rays_per_pixel=lines))
    noise = 100.0 * float(
        np.sqrt(np.mean([np.mean(lmap.standard_error**2) / np.max(lmap.values) ** 2 for lmap in truth]))
    )
    rows = [learnt(led.ray_file(n), truth, screen, full=options.full) for n in numbers]
    print_rows(rows)
    draw(rows, noise, options.output)
    print(f"\nnoise of the true maps {noise:.2f} %; picture: {options.output}")


if __name__ == "__main__":
    main()
