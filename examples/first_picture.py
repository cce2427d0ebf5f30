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
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

OBSERVERS = [et.Observer(0, 0, 500), et.Observer(45, 0, 500), et.Observer(65, 120, 500)]
SCREEN = et.Screen(66, 66, 128, 128)


def draw(maps: list[et.LuminanceMap], path: Path) -> None:
    made = Figure(figsize=(12.4, 3.3), dpi=110, layout="constrained")
    FigureCanvasAgg(made)
    panels = made.subplots(1, 4)
    half_width, half_height = SCREEN.width / 2, SCREEN.height / 2
    extent = (-half_width, half_width, -half_height, half_height)
    top = max(np.nanmax(m.values) for m in maps)
    for axes, lmap in zip(panels, maps, strict=False):
        norm = LogNorm(top / 60, top)
        values = np.nan_to_num(lmap.values).clip(min=top / 60)
        image = axes.imshow(values, cmap="inferno", norm=norm, extent=extent)
        axes.set_title(f"θ = {lmap.observer.theta:g}°, φ = {lmap.observer.phi:g}°", fontsize=11)
    made.colorbar(image, ax=panels[2], label="luminance [cd/m²]", fraction=0.035)
    error = maps[0].standard_error / maps[0].values * 100
    panels[3].set_facecolor("black")
    image = panels[3].imshow(error, cmap="viridis", vmin=0, vmax=np.nanpercentile(error, 98), extent=extent)
    panels[3].set_title("standard error, θ = 0°", fontsize=11)
    made.colorbar(image, ax=panels[3], label="relative [%]", fraction=0.035)
    for axes in panels:
        axes.set_xlabel("mm")
        axes.tick_params(labelsize=8)
    for axes in panels[1:]:
        axes.set_yticklabels([])
    made.savefig(path, bbox_inches="tight", pad_inches=0.08, metadata={"Software": None})


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
