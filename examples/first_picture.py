"""The picture of the README: one source, three observers, one error bar per pixel.

    python examples/first_picture.py                       # 1.4e9 rays, a quarter of a minute on two cores
    python examples/first_picture.py --rays 20000000       # the same in a second, with eight times the noise

The source is that of thesis 2.3: three Lambertian rings of 300, 200 and 100 lm. All observers are served in one pass; the
rays are never stored. The last panel is the relative standard error of the first.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import etendue as et
import numpy as np
from experiments.panels import map_grid, put_bar_at
from matplotlib.colors import LogNorm, Normalize

OBSERVERS = [et.Observer(0, 0, 500), et.Observer(45, 0, 500), et.Observer(65, 120, 500)]
SCREEN = et.Screen(66, 66, 128, 128)


def draw(maps: list[et.LuminanceMap], path: Path) -> None:
    """The maps on one logarithmic scale, and the relative error of the first [%]."""
    seen = [f"θ = {lmap.observer.theta:g}°, φ = {lmap.observer.phi:g}°" for lmap in maps]
    grid = map_grid(
        (2.55, 2.55), [*seen, f"standard error, {seen[0]}"], [""], {2: "each", 3: "each"},
        heading="Three Lambertian rings of 300, 200 and 100 lm",
    )  # fmt: skip
    top = max(np.nanmax(m.values) for m in maps)
    for column, lmap in enumerate(maps):
        image = grid.show(0, column, lmap, LogNorm(top / 60, top))
    first = maps[0]
    put_bar_at(grid.bars[2][0], image, first.values, first.quantity, first.unit)
    error = 100.0 * first.standard_error / first.values
    most = float(np.nanpercentile(error, 98))
    image = grid.show(0, 3, (error, first.screen), Normalize(0, most), colours="error")
    put_bar_at(grid.bars[3][0], image, error, "relative error", "%")
    grid.save(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=1_400_000_000)
    parser.add_argument("--output", type=Path, default=Path("first-picture.png"))
    options = parser.parse_args()
    source = et.RingSource(rays=options.rays)
    maps = et.luminance_map(source, OBSERVERS, SCREEN, method=et.Cone(acceptance=1.5))
    for lmap in maps:
        print(f"θ = {lmap.observer.theta:g}°, φ = {lmap.observer.phi:g}°: maximum {np.nanmax(lmap.values):,.0f} cd/m²")
        for note in lmap.notes:
            print(f"    {note}")
    draw(maps, options.output)
    print(f"picture: {options.output}")


if __name__ == "__main__":
    main()
