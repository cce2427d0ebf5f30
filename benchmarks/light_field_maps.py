"""Luminance maps from few rays, by every estimator there is, beside what four sources of known luminance really look like.

Seven observers look at each source of `light_field.py` from 1 m through 128 × 128 pixels that frame it. Estimators: the
light field; the cone with its automatic acceptance, by itself, denoised (`denoise_map`), and under the best digital
filter (`filter_map`: kind, size and γ); the thesis' gridded source at the best of eleven thresholds. The best filter and
the best threshold are *chosen knowing the truth*, for each map and for NCC and NRMSE apart, which flatters them.

NCC is eq. 3.5 of the thesis, NRMSE the root mean square of map − truth over the greatest true luminance, in percent; eq.
3.6 is a mean of |map − truth| over the greatest of both. Dead pixels count as 0. Printed are means over observers and
seeds, and the median NRMSE beside the mean, which an observer beyond a sharp cut-off, to whom all is dark, can rule.

python benchmarks/light_field_maps.py [--rays 1e5,1e6] [--seeds 5] [--families limb,film,die,dome] [--verbose]
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Iterator
from typing import Any

import etendue as et
import numpy as np
from etendue.luminance.filters import FILTERS
from etendue.luminance.gridded_map import gridded_luminance_map
from light_field import DIE, THRESHOLDS, Family, families

Array = Any
OBSERVERS = ((0, 0), (30, 0), (60, 0), (80, 0), (30, 90), (60, 90), (80, 90))
DISTANCE = 1000.0
PIXELS = 128
MARGIN = 1.04
"""Extent of the screen over that of the source."""

SIZES = (3, 5, 7, 9, 13, 17, 25)
GAMMAS = (0.1, 0.2, 0.4, 0.8, 1.6)

ESTIMATORS = ("light field", "cone", "cone, denoised", "cone, best filter", "grid, best E")


@dataclasses.dataclass(frozen=True)
class Look:
    """One observer's view of a source, and what there is to be seen."""

    observer: et.Observer
    screen: et.Screen
    truth: et.LuminanceMap

    @classmethod
    def at(cls, family: Family, theta: float, phi: float, fine: int) -> Look:
        """The view from θ, φ [°]; the truth is the mean of fine × fine points per pixel."""
        outline = outline_of(family)
        target = (outline.max(axis=0) + outline.min(axis=0)) / 2
        observer = et.Observer(theta, phi, DISTANCE, target=tuple(target.tolist()))
        right, up, toward = et.Screen(1, 1, 1, 1).axes(observer)
        away = outline - observer.position
        seen = away * (-DISTANCE / (away @ toward))[:, None]
        width, height = (2 * MARGIN * float(np.abs(seen @ axis).max()) for axis in (right, up))
        screen = et.Screen(width, height, PIXELS, PIXELS)
        values = true_pixels(family.source, observer, screen, fine)
        unknown = np.full(screen.shape, np.nan)
        return cls(observer, screen, et.LuminanceMap(values, unknown, np.full(screen.shape, -1), observer, screen))

    def quality(self, lmap: et.LuminanceMap) -> tuple[float, float]:
        """NCC and NRMSE of a map."""
        result = et.compare(lmap, self.truth)
        return result.ncc, result.nrmse


def outline_of(family: Family) -> Array:
    """Points (n, 3) [mm] around everything that shines: a disk's rim, or parallels of the dome above the die."""
    x0, x1, y0, y1 = family.source.extent
    turn = np.linspace(0, 2 * np.pi, 361)
    circle = np.stack([(x0 + x1 + (x1 - x0) * np.cos(turn)) / 2, (y0 + y1 + (y1 - y0) * np.sin(turn)) / 2], axis=1)
    radius = DIE.radius if family.source is DIE else 0.0
    heights = np.radians(np.linspace(0, 90, 31)) if radius else np.zeros(1)
    return np.concatenate(
        [np.column_stack([np.cos(t) * circle, np.full(len(turn), np.sin(t) * radius)]) for t in heights]
    )


def true_pixels(source: Any, observer: et.Observer, screen: et.Screen, fine: int) -> Array:
    """Mean luminance of each pixel, by the midpoint rule on fine × fine points."""
    right, up, _ = screen.axes(observer)
    within = (np.arange(fine) + 0.5) / fine - 0.5
    x = (screen.x[:, None] + within * (screen.width / screen.columns)).ravel()
    values = np.zeros(screen.shape)
    for row, middle in enumerate(screen.y):
        y = middle + within * (screen.height / screen.rows)
        points = np.asarray(observer.target) + (y[:, None, None] * up + x[:, None] * right).reshape(-1, 3)
        sight = observer.position - points
        seen = source.luminance(points=points, directions=sight / np.linalg.norm(sight, axis=1)[:, None])
        values[row] = seen.reshape(fine, screen.columns, fine).mean(axis=(0, 2))
    return values


def filtered(cone: et.LuminanceMap) -> Iterator[tuple[str, et.LuminanceMap]]:
    """The map under every filter tried, each with its name."""
    for kind, size in itertools.product(FILTERS.values(), SIZES):
        for gamma in GAMMAS if kind.selective else GAMMAS[:1]:
            name = f"{kind.name} {size}" + (f" γ {gamma:g}" if kind.selective else "")
            yield name, et.filter_map(cone, kind.name, size, gamma)


def best(maps: Iterator[tuple[str, et.LuminanceMap]], look: Look) -> tuple[tuple[float, float], str]:
    """The greatest NCC and the least NRMSE of some maps, and the name of the latter."""
    rows = [(*look.quality(lmap), name) for name, lmap in maps]
    return (max(ncc for ncc, *_ in rows), min(nrmse for _, nrmse, _ in rows)), min(rows, key=lambda row: row[1])[2]


def compare(family: Family, looks: list[Look], rays: int, seed: int, *, verbose: bool) -> Array:
    """NCC and NRMSE by observer and estimator, shape (observers, estimators, 2)."""
    ray_set = family.ray_set(rays, seed)
    observers, screens = [look.observer for look in looks], [look.screen for look in looks]
    field = et.LightField.fit(ray_set, family.surface)
    seen = et.luminance_map(field, observers, screens)
    cones = et.luminance_map(ray_set, observers, screens, method="cone", acceptance="auto")
    grids = [
        et.GriddedSource.fit(ray_set, family.surface, pixel=family.pixel, threshold=t, parallels=family.parallels)
        for t in THRESHOLDS
    ]
    rows = []
    for look, ours, cone in zip(looks, seen, cones, strict=True):
        from_filter, filter_name = best(filtered(cone), look)
        patches = (
            (f"E = {t:g} %", gridded_luminance_map(grid, look.observer, look.screen))
            for t, grid in zip(THRESHOLDS, grids, strict=True)
        )
        from_grid, threshold = best(patches, look)
        smooth = et.denoise_map(cone) if np.nanmax(cone.values, initial=0.0) > 0 else cone
        row = [*(look.quality(lmap) for lmap in (ours, cone, smooth)), from_filter, from_grid]
        rows.append(row)
        if verbose:
            print(
                line(f"  θ {look.observer.theta:g}° φ {look.observer.phi:g}°", f"seed {seed}", np.array([row]))
                + f"   {filter_name}; {threshold}; {int(cone.rays.sum()):,} rays in the cone",
                flush=True,
            )
    return np.array(rows)


def line(name: str, rays: str, maps: Array) -> str:
    """One row of the table, from NCC and NRMSE by map and estimator."""
    columns = zip(maps[..., 0].mean(axis=0), maps[..., 1].mean(axis=0), np.median(maps[..., 1], axis=0), strict=True)
    return f"{name:<14} {rays:>7}" + "".join(
        f"   {ncc:8.5f} {100 * mean:7.2f} {100 * median:7.2f}" for ncc, mean, median in columns
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", default="1e5,1e6")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--families", default="limb,film,die,dome")
    parser.add_argument(
        "--fine", type=int, default=16, help="the truth is a mean of so many points, squared, per pixel"
    )
    parser.add_argument("--verbose", action="store_true", help="also print each map, and what was best for it")
    options = parser.parse_args()
    print(" " * 22 + "".join(f"   {name:^24}" for name in ESTIMATORS))
    print(f"{'family':<14} {'rays':>7}" + "      NCC   NRMSE%  median" * len(ESTIMATORS))
    for name in options.families.split(","):
        family = families()[name]
        looks = [Look.at(family, theta, phi, options.fine) for theta, phi in OBSERVERS]
        for rays in options.rays.split(","):
            found = [
                compare(family, looks, int(float(rays)), seed, verbose=options.verbose)
                for seed in range(1, options.seeds + 1)
            ]
            print(line(name, rays, np.concatenate(found)), flush=True)


if __name__ == "__main__":
    main()
