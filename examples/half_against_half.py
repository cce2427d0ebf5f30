"""A real ray file against itself: a light field of one half of the rays, judged by the other half.

    python examples/half_against_half.py led.tm25ray      # any ray file
    python examples/half_against_half.py                  # a small one that is traced first, seconds

Nobody knows the truth behind a vendor's file, but its rays can be dealt into two halves that know nothing of each other.
Printed are

- how well the field of the first half predicts how many rays of the second fall into cells of place and direction: the sum
  of squared errors over that of the first half's own counts. A field that knew the truth would have 0.5, since the second
  half's noise remains; one that only keeps its rays has 1;
- for some observers how the maps of both fields agree, and how often they differ by less than one and two standard errors
  of the difference, for which 68 and 95 % would be right;
- what the field of all rays resolves.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue.plot import style
from experiments import led
from experiments.panels import QUICK, ROOT, map_grid, put_bar_at, scale
from matplotlib.colors import Normalize

PLACES, HEIGHTS, TURNS = 12, 6, 8
"""Cells across the lines through the source along either axis, and of the cosine and the azimuth of their directions."""

DRAWN = 20
"""Rays that are drawn from a field, for each ray that it rests on, to know its shares of the cells."""

LIT = 0.02
"""Share of the largest luminance from which on a pixel counts."""

Array = Any


def cells(rays: et.RaySet, middle: Array, reach: float) -> Array:
    """How many rays fall into each cell: where their lines pass the middle of the source, and where they head."""
    k = rays.direction
    right = np.cross([0.0, 0.0, 1.0], k)
    length = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(length > 1e-9, right / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    up = np.cross(k, right)
    away = rays.position - middle
    coordinates = np.column_stack(
        [
            np.sum(away * right, axis=1) / reach,
            np.sum(away * up, axis=1) / reach,
            k[:, 2],
            np.arctan2(k[:, 1], k[:, 0]) / np.pi,
        ]
    )
    shape = (PLACES, PLACES, HEIGHTS, TURNS)
    counts, _ = np.histogramdd(coordinates, bins=shape, range=[(-1.0, 1.0)] * 4, weights=rays.flux)
    return counts


def predicted(field: et.LightField, halves: tuple[et.RaySet, et.RaySet]) -> float:
    """Sum of squared errors of the field's shares over that of the first half's own, against the second half."""
    middle = np.array(halves[0].virtual_focus.point)
    away = np.linalg.norm(np.cross(halves[0].position - middle, halves[0].direction), axis=1)
    reach = float(np.quantile(away, 0.98))
    drawn = field.sample(DRAWN * len(halves[0]), seed=1)
    own, other, smooth = (counts / counts.sum() for counts in (cells(rays, middle, reach) for rays in (*halves, drawn)))
    return float(np.sum((other - smooth) ** 2) / np.sum((other - own) ** 2))


def draw(rows: list[tuple[str, list[et.LuminanceMap], Array]], heading: str, path: Path) -> None:
    """For each observer both maps, and their difference in standard errors."""
    titles = ("first half", "second half", "difference, where lit")
    names = [name for name, _, _ in rows]
    each = {1: "each", 2: "each"}
    grid = map_grid((1.9, 1.9), titles, names, each, heading=heading, facts=[ROOT], apart=(0.5, 0.55))
    for row, (_, maps, deviation) in enumerate(rows):
        norm = scale(maps[0], "root")
        image = [grid.show(row, column, lmap, norm, own=True) for column, lmap in enumerate(maps)][-1]
        both = np.stack([lmap.values for lmap in maps])
        put_bar_at(grid.bars[1][row], image, both, maps[0].quantity, maps[0].unit)
        off = (deviation, maps[0].screen)
        image = grid.show(row, 2, off, Normalize(-3.0, 3.0), colours="difference", own=True)
        put_bar_at(grid.bars[2][row], image, deviation, "difference", "standard errors")
        for axes in grid.panels[row, 1:]:
            axes.set_ylabel("")
    grid.save(path)


def main() -> None:
    """The figures and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", help="a ray file of any format")
    parser.add_argument("--observers", default="0,0 45,30 75,120", help="θ,φ of each [°]")
    parser.add_argument("--output", type=Path, default=Path("half-against-half.png"))
    options = parser.parse_args()
    rays = led.ray_file(20_000) if options.file is None else et.read_rays(options.file)
    print(f"{len(rays):,} rays, {rays.total_flux:.5g} {rays.flux_unit}")
    halves = rays.thin(2, seed=1)
    if options.file is None:
        fields = [et.LightField.fit(half, et.Disk(z=led.DIE_TOP), depths=QUICK) for half in halves]
    else:
        whole = et.LightField.fit(rays)
        for note in whole.notes:
            print(f"note: {note}")
        print(f"resolves {whole.resolution().summary()}")
        fields = [et.LightField.fit(half) for half in halves]
    print(
        f"squared error of the other half's cells: {predicted(fields[0], halves):.3f} of that of plain counts (0.5: perfect)"
    )
    rows = []
    for theta, phi in (map(float, pair.split(",")) for pair in options.observers.split()):
        observer = et.Observer(theta, phi, 1000, target=rays.virtual_focus.point)
        screen = et.luminance_map(rays, observer, method="cone").screen
        screen = et.Screen(screen.width, screen.height, 48, 48)
        maps = [et.luminance_map(field, observer, screen) for field in fields]
        lit = maps[0].values + maps[1].values > 2.0 * LIT * max(np.nanmax(lmap.values) for lmap in maps)
        sure = np.hypot(maps[0].standard_error, maps[1].standard_error)
        deviation = np.where(
            lit & (sure > 0), (maps[0].values - maps[1].values) / np.where(sure > 0, sure, 1.0), np.nan
        )
        agreement = et.compare(maps[0], maps[1])
        seen = np.abs(deviation[lit & (sure > 0)])
        print(
            f"from ({theta:g}°, {phi:g}°): NCC {100 * agreement.ncc:.2f} %, NRMSE {100 * agreement.nrmse:.2f} %; "
            f"{np.mean(seen < 1):.0%} and {np.mean(seen < 2):.0%} of {len(seen):,} lit pixels within 1 and 2 standard errors"
        )
        rows.append((f"({theta:g}°, {phi:g}°)", maps, deviation))
    heading = style.headed("Two halves of the rays", options.file or "an LED with a silicone dome", 8.0)
    draw(rows, heading, options.output)
    print(f"picture: {options.output}")


if __name__ == "__main__":
    main()
