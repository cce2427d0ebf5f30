"""The light field against the gridded algorithm of thesis chapter 3, on four sources whose luminance is known.

Score: excess KL in mnat per ray, the mean of ln(L/Φ) - ln(L^/Φ^) over fresh rays of the truth, every estimate mixed with
1e-4 of a uniform field. Beside it stands that score less the one of the best field that is constant on 32⁴ equal cells,
which knows the truth. The grid has pixels of a 32nd of the source, and its threshold is the best of eleven, *chosen
knowing the truth*: with the first seed among all, with the others downhill from where the one before had it. Coverage:
share of cells, drawn from the lit ones, whose true mean lies within one and two standard errors of the field's. What the
sources look like is the matter of `light_field_maps.py`. With `--auto` fields on the surface that is found where none is
stated stand beside.

python benchmarks/light_field.py [--rays 1e5,1e6] [--seeds 5] [--families limb,film,die,dome] [--auto]
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue import _core
from etendue.lightfield.carrier import Hemisphere, Plane, Surface
from etendue.lightfield.light_field import LightField

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from oracles.sources import DieUnderDome, LimbDarkenedDisk, PrismaticFilm

Array = Any
THRESHOLDS = (20.0, 10.0, 5.0, 2.1, 1.0, 0.5, 0.2, 0.1, 0.05, 0.021, 0.01)
TESTS = 400_000
DIE = DieUnderDome()


@dataclasses.dataclass(frozen=True)
class Family:
    """A source, what carries its light, and the pixels of the grid: their size [mm], or the hemisphere's parallels."""

    source: Any
    surface: Surface
    pixel: float
    parallels: int | None = None

    def ray_set(self, rays: int, seed: int) -> et.RaySet:
        """Rays of equal flux, in memory."""
        x, d = self.source.rays(rays, seed=seed)
        return et.RaySet(x, d, np.full(rays, self.source.total_flux / rays))


def families() -> dict[str, Family]:
    """The four of the tests, by name."""

    def flat(source: LimbDarkenedDisk | PrismaticFilm) -> Family:
        side = 2 * source.radius
        return Family(source, Plane(z=0, width=side, height=side, centre=source.centre), side / 32)

    return {
        "limb": flat(LimbDarkenedDisk()),
        "film": flat(PrismaticFilm()),
        "die": Family(DIE, Plane(z=0, width=2.53, height=2.53, centre=(0, 0)), 2.53 / 32),
        "dome": Family(DIE, Hemisphere(radius=DIE.radius * 1.00001), 0.1, 16),
    }


class Judge:
    """Fresh rays of the truth, and the score of any estimate on them."""

    def __init__(self, source: Any, surface: Surface) -> None:
        self.source, self.surface = source, surface
        self.points, self.directions = source.rays(TESTS, seed=99)
        self.truth = np.log(source.luminance(points=self.points, directions=self.directions) / source.total_flux)
        self.even = 1e6 / (np.pi * surface.area)

    def excess(self, luminance: Array, flux: float) -> float:
        """Excess KL [mnat per ray]."""
        mixed = (1 - 1e-4) * luminance / flux + 1e-4 * self.even
        return float(1e3 * np.mean(self.truth - np.log(mixed)))

    def cells(self, n: int = 32, points: int = 64) -> float:
        """The excess of the best constants on n⁴ cells."""
        part = self.surface.parts()[0].core()
        indices = np.stack(np.unravel_index(np.arange(n**4), (n,) * 4), axis=1)
        steps = np.array([0.856675, 0.733892, 0.628707, 0.538597])
        means = np.zeros(n**4)
        for k in range(points):
            at = (indices + (0.5 / points + k * steps) % 1.0) / n
            x, d = _core.rays_of_part(part, np.ascontiguousarray(at))
            means += self.source.luminance(points=x + 1e-9 * d, directions=d) / points
        met, at = _core.cross_parts([part], np.ascontiguousarray(self.points), np.ascontiguousarray(self.directions))
        cell = np.minimum((at * n).astype(int), n - 1)
        seen = np.where(met >= 0, means.reshape((n,) * 4)[tuple(cell.T)], 0.0)
        return self.excess(seen, means.mean() * np.pi * self.surface.area / 1e6)


def coverage(field: LightField, source: Any, cells: int = 20_000, points: int = 32) -> tuple[float, float]:
    """Share of lit cells whose mean lies within one and two standard errors."""
    chart, part = field.surface.parts()[0].core(), field.parts[0]
    shape = np.array(part.ratio.shape)
    rng = np.random.default_rng(3)
    index = rng.integers(0, shape, (cells, 4))
    steps = np.array([0.856675, 0.733892, 0.628707, 0.538597])
    errors = np.reshape(field.core.cell_means(0)[1], part.ratio.shape)[tuple(index.T)] * 1e6
    sums = np.zeros((2, cells))
    for k in range(points):
        at = np.ascontiguousarray((index + (0.5 / points + k * steps) % 1.0) / shape)
        x, d = _core.rays_of_part(chart, at)
        sums[0] += source.luminance(points=x + 1e-9 * d, directions=d) / points
        sums[1] += field.core.at(0, at)[0] * (1e6 / points)
    lit = sums[0] > 0
    deviation = np.abs(sums[1] - sums[0])[lit] / errors[lit]
    return float((deviation < 1).mean()), float((deviation < 2).mean())


def best_grid(family: Family, rays: et.RaySet, judge: Judge, start: int | None) -> tuple[dict[int, float], int]:
    """Excess of the grid by number of the threshold, and the best one: of all, or downhill from where others had it."""
    known: dict[int, float] = {}

    def excess(index: int) -> float:
        if index not in known:
            grid = et.GriddedSource.fit(
                rays, family.surface, pixel=family.pixel, threshold=THRESHOLDS[index], parallels=family.parallels
            )
            known[index] = judge.excess(grid.luminance(judge.points, judge.directions), grid.total_flux)
        return known[index]

    if start is None:
        return known, min(range(len(THRESHOLDS)), key=excess)
    best = start
    while (better := min((i for i in (best - 1, best, best + 1) if 0 <= i < len(THRESHOLDS)), key=excess)) != best:
        best = better
    return known, best


def with_automatic_surface(rays: et.RaySet, judge: Judge) -> tuple[float, str]:
    """Excess of the field on the surface that is found, and that surface."""
    field = LightField.fit(rays, "auto")
    return judge.excess(field.luminance(judge.points, judge.directions)[0], field.total_flux), field.surface.told


def compare(name: str, rays: int, seeds: int, auto: bool) -> list[tuple[float, float, float, float]]:
    """Print, for each seed, both excesses, the coverage and the times; return them."""
    family = families()[name]
    source, surface = family.source, family.surface
    judge = Judge(source, surface)
    floor = judge.cells()
    print(f"{name} {rays:.0e}: best constants on 32⁴ cells {floor:.1f}")
    rows: list[tuple[float, float, float, float]] = []
    found: list[tuple[float, str]] = []
    best = None
    for seed in range(1, seeds + 1):
        ray_set = family.ray_set(rays, seed)
        start = time.perf_counter()
        field = LightField.fit(ray_set, surface)
        seconds = time.perf_counter() - start
        ours = judge.excess(field.luminance(judge.points, judge.directions)[0], field.total_flux)
        grids, best = best_grid(family, ray_set, judge, best)
        one, two = coverage(field, source)
        print(
            f"  seed {seed}: field {ours:7.2f} ({ours - floor:+7.2f})  {field.parts[0].ratio.shape} "
            f"{field.report.bases[0]} in {seconds:.1f} s   grid {grids[best]:7.2f} ({grids[best] - floor:+7.2f}) at "
            f"E = {THRESHOLDS[best]:g} %   ratio {ours / grids[best]:.3f}   within 1σ {one:.3f}, 2σ {two:.3f}",
            flush=True,
        )
        rows.append((ours, grids[best], one, two))
        if auto:
            found.append(with_automatic_surface(ray_set, judge))
            print(f"    on {found[-1][1]}: {found[-1][0]:.2f}", flush=True)
    mean = np.mean(rows, axis=0)
    print(
        f"  mean: field {mean[0]:.2f}, grid {mean[1]:.2f}, ratio {mean[0] / mean[1]:.3f}; less the constants "
        f"{mean[0] - floor:+.2f}, {mean[1] - floor:+.2f}; within 1σ {mean[2]:.3f}, 2σ {mean[3]:.3f}"
        + (f"; surface found: field {np.mean([excess for excess, _ in found]):.2f}" if found else ""),
        flush=True,
    )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", default="1e5,1e6")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--families", default="limb,film,die,dome")
    parser.add_argument("--auto", action="store_true", help="fields on the surface that is found beside them")
    options = parser.parse_args()
    for name in options.families.split(","):
        for rays in options.rays.split(","):
            compare(name, int(float(rays)), options.seeds, options.auto)


if __name__ == "__main__":
    main()
