"""How fast a light field is counted, grown, looked at, drawn from and fitted, and how large its file is.

Beside each job stands the bar of the project where there is one, and the same in plain numpy on one core where that is
short to say: cells of étendue by `np.bincount`, and the quadrilinear read-out of a map at the same points. Both peers are
checked to give the same numbers. Rates are those of the best of some repeats, the map's time is the median of many.

python benchmarks/light_field_speed.py [--rays 20000000] [--fit-rays 1000000] [--family limb|film|die|dome]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from etendue.lightfield.candidate import all_images, grow_candidate
from etendue.lightfield.counting import EtendueCounts, count_rays
from etendue.lightfield.etendue_density import PartField
from etendue.lightfield.fitting import grids_for
from etendue.lightfield.light_field import LightField
from etendue.lightfield.trees import Base, grow, log_evidence
from etendue.units import MM2_PER_M2
from light_field import Family, families
from timing import best, timed

Array = Any
DEPTHS = (5, 5, 5, 5)
"""A grid of 32⁴ = 2²⁰ cells."""

RINGS = et.Plane(z=0, width=60, height=60, centre=(0, 0))
SAMPLES = 16
"""Points per pixel of a map."""
LATTICE = np.stack([np.arange(SAMPLES), np.arange(SAMPLES) * 9 % SAMPLES], axis=1) / SAMPLES + 0.5 / SAMPLES
"""Those points, as the core takes them: 9 is the number prime to 16 next to 16/φ."""

CORES = ((None, "all cores"), (1, "one thread"))
COUNTING_BAR, TREE_BAR, MAP_BAR = 60e6, 0.5, 10e-3
"""Rays per second; seconds; seconds."""


def row(job: str, value: str, ratio: float | None = None, peer: float | None = None) -> None:
    """Print one row: what was measured, how many times better than the bar, and than numpy."""
    bar = "" if ratio is None else f"{ratio:8.2f} × bar"
    beside = "" if peer is None else f"{peer:8.1f} × numpy"
    print(f"{job:<58} {value:>16} {bar:>14} {beside}".rstrip(), flush=True)


def to_square(p: Array, q: Array) -> Array:
    """The concentric map from the unit disk to the unit square, shape (n, 2)."""
    wide = np.abs(p) > np.abs(q)
    along, across = np.where(wide, p, q), np.where(wide, q, p)
    r = np.copysign(np.hypot(p, q), along)
    other = r * np.arctan(across / np.where(along == 0, 1, along)) * (4 / np.pi)
    return np.stack([np.where(wide, r, other), np.where(wide, other, r)], axis=1) / 2 + 0.5


def on_plane(plane: et.Plane, position: Array, direction: Array) -> Array:
    """Coordinates (n, 4) of rays on a plane; outside 0 to 1 where they do not meet it."""
    part = plane.parts()[0]
    met = position[:, :2] + ((plane.z - position[:, 2]) / direction[:, 2])[:, None] * direction[:, :2]
    place = (met - part.centre[:2]) / part.size + 0.5
    return np.concatenate([place, to_square(direction[:, 0], direction[:, 1])], axis=1)


def count_in_numpy(rays: et.RaySet, fine: tuple[int, int], equal: bool) -> list[Array]:
    """Σ w of the three grids that `count_rays` fills, for rays that all meet `RINGS`; Σ w² too if the rays are unequal."""
    shapes = ((0, 1, 2, 3), DEPTHS), ((0, 1), (fine[0],) * 2), ((2, 3), (fine[1],) * 2)
    powers = (0,) if equal else (1, 2)
    sums = [np.zeros((len(powers), 1 << sum(depths))) for _, depths in shapes]
    for batch in rays.batches(1 << 18):
        at = on_plane(RINGS, batch.position, batch.direction)
        weights = [batch.flux**power if power else None for power in powers]
        for grid, (axes, depths) in zip(sums, shapes, strict=True):
            cell = np.zeros(len(at), dtype=np.int64)
            for axis, depth in zip(axes, depths, strict=True):
                cell = (cell << depth) + np.minimum((at[:, axis] * (1 << depth)).astype(np.int64), (1 << depth) - 1)
            grid += [np.bincount(cell, weight, minlength=grid.shape[1]) for weight in weights]
    return [grid[0] for grid in sums]


def counting(radii: tuple[float, ...], flux: tuple[float, ...], rays: int, repeats: int) -> None:
    """Rays of concentric rings into 2²⁰ cells, from a file and from memory."""
    equal = len(radii) == 1
    kind, grids = "equal" if equal else "unequal", grids_for(rays, DEPTHS)
    fine = grids.fine
    some = et.RingSource(radii, flux, rays=min(rays, 2_000_000)).ray_set()
    ours = count_rays(some, RINGS, grids)["all"][0]
    for mine, theirs in zip((ours.grid, ours.space, ours.direction), count_in_numpy(some, fine, equal), strict=True):
        # A coordinate within rounding of an edge may fall to either side.
        if np.abs(theirs - mine.weight.ravel()).sum() > 1e-5 * theirs.sum():
            raise SystemExit("numpy counts differently")
    peer = len(some) / best(lambda: count_in_numpy(some, fine, equal), 2)
    row(f"numpy counts {len(some):,} {kind} rays from memory", f"{peer / 1e6:.1f} M rays/s", peer / COUNTING_BAR)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rings.tm25ray"
        et.write_rays(path, et.RingSource(radii, flux, rays=rays))
        held = et.RingSource(radii, flux, rays=rays).ray_set()
        for place, source in (("a TM-25 file", et.read_rays(path)), ("memory (f64)", held)):
            for threads, cores in CORES:
                rate = rays / best(lambda s=source, t=threads: count_rays(s, RINGS, grids, threads=t), repeats)
                title = f"{kind} rays from {place}, {cores}"
                row(title, f"{rate / 1e6:.1f} M rays/s", rate / COUNTING_BAR, rate / peer)


def growing(counts: EtendueCounts, repeats: int) -> None:
    """The tree of 32⁴ cells, from counts: posterior and evidence."""
    grid = counts["all"][0].grid
    for base in (Base(), all_images(counts, "all", None)[0]):
        for threads, cores in CORES:
            for title, job in (("posterior", grow), ("evidence alone", log_evidence)):
                seconds = best(lambda job=job, base=base, threads=threads: job(grid, base, 10.0, threads), repeats)
                row(f"tree of 32⁴ cells, {base.name} base, {title}, {cores}", f"{seconds:.3f} s", TREE_BAR / seconds)


def tents(x: Array, n: int) -> tuple[Array, Array]:
    """The cells (2, m) between whose centres coordinates lie, and their weights."""
    t = x * n - 0.5
    lower = np.floor(t)
    cells = np.clip(np.stack([lower, lower + 1]), 0, n - 1).astype(np.int64)
    return cells, np.stack([1 - (t - lower), t - lower])


def multilinear(table: Array, at: Array) -> Array:
    """A table between its cell centres."""
    axes = [tents(x, n) for x, n in zip(at.T, table.shape, strict=True)]
    total, flat = np.zeros(len(at)), table.ravel()
    for corner in np.ndindex((2,) * table.ndim):
        cell, weight = np.zeros(len(at), dtype=np.int64), np.ones(len(at))
        for bit, (cells, weights), n in zip(corner, axes, table.shape, strict=True):
            cell = cell * n + cells[bit]
            weight = weight * weights[bit]
        total += weight * flat[cell]
    return total


def map_in_numpy(field: LightField, observer: et.Observer, screen: et.Screen) -> Array:
    """The map of a field on a plane at the points of `LATTICE` [cd/m²]."""
    right, up, _ = screen.axes(observer)
    part: PartField = field.parts[0]
    columns, rows = np.meshgrid(np.arange(screen.columns), np.arange(screen.rows))
    u = ((columns[..., None] + LATTICE[:, 0]) / screen.columns - 0.5) * screen.width
    v = (0.5 - (rows[..., None] + LATTICE[:, 1]) / screen.rows) * screen.height
    points = (np.asarray(observer.target) + u[..., None] * right + v[..., None] * up).reshape(-1, 3)
    sight = observer.position - points
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    at = on_plane(field.surface, points, sight)
    met = ((at >= 0) & (at <= 1)).all(axis=1)
    seen = np.zeros(len(at))
    seen[met] = part.level * MM2_PER_M2 * multilinear(part.ratio, at[met])
    for factor, axes in ((part.space, slice(0, 2)), (part.direction, slice(2, 4))):
        if factor is not None:
            seen[met] *= multilinear(factor, at[met][:, axes])
    return seen.reshape(*screen.shape, SAMPLES).mean(axis=2)


def looking(field: LightField, extent: float, target: tuple[float, float, float], repeats: int) -> None:
    """A map of 128 × 128 pixels at 16 points each."""
    observer, screen = et.Observer(40, 30, 1000, target=target), et.Screen(extent, extent, 128, 128)
    peer = None
    if isinstance(field.surface, et.Plane):
        truth = et.luminance_map(field, observer, screen).values
        if np.abs(map_in_numpy(field, observer, screen) - truth).max() > 1e-9 * truth.max():
            raise SystemExit("numpy sees another map")
        peer = best(lambda: map_in_numpy(field, observer, screen), 3)
        row("numpy: map of 128² pixels, 16 points each", f"{peer * 1e3:.2f} ms", MAP_BAR / peer)
    for threads, cores in CORES:

        def look(threads: int | None = threads) -> et.LuminanceMap:
            return et.luminance_map(field, observer, screen, samples=SAMPLES, threads=threads)

        median = float(np.median([timed(look)[0] for _ in range(repeats)]))
        row(
            f"map of 128² pixels, 16 points each, {cores}, median of {repeats}",
            f"{median * 1e3:.2f} ms",
            MAP_BAR / median,
            peer and peer / median,
        )


def drawing(counts: EtendueCounts, fitted: LightField, rays: int, repeats: int) -> None:
    """Rays drawn from fields of either base, and the bytes of their files."""
    images = all_images(counts, "all", None)
    for recipe, concentration in (("uniform", 3.0), ("product", 30.0)):
        grown = grow_candidate(counts, "all", recipe, images, [concentration] * len(images), None)
        field = fitted.replace(surface=counts.surface, parts=grown.fields(counts))
        stream = rays / best(lambda field=field: field.rays(rays).pass_over(), repeats)
        held = rays / best(lambda field=field: field.sample(rays), repeats)
        row(f"drawing from 32⁴ cells, {recipe} recipe, as a stream", f"{stream / 1e6:.1f} M rays/s")
        row(f"drawing from 32⁴ cells, {recipe} recipe, into memory", f"{held / 1e6:.1f} M rays/s")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "field.h5"
            field.save(path)
            row(f"file of 32⁴ cells, {recipe} recipe", f"{path.stat().st_size / 1e3:,.0f} kB")


def fitting(family: Family, rays: et.RaySet) -> LightField:
    """The whole fit, from rays to field."""
    fields = []
    for title, surface in (("stated", family.surface), ("auto", "auto")):
        seconds, fitted = timed(lambda surface=surface: LightField.fit(rays, surface))
        fields.append(fitted)
        row(f"LightField.fit, {len(rays):,} rays, {title} surface", f"{seconds:.2f} s")
    field = fields[0]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "field.h5"
        field.save(path)
        shape = " × ".join(map(str, field.parts[0].ratio.shape))
        row(f"its file: {shape} cells, {field.report.bases[0]} base", f"{path.stat().st_size / 1e3:,.0f} kB")
    return field


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=20_000_000, help="that are counted")
    parser.add_argument("--drawn", type=int, default=2_000_000, help="rays that are drawn")
    parser.add_argument("--fit-rays", type=int, default=1_000_000)
    parser.add_argument("--family", default="film", help="whose rays are fitted")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--maps", type=int, default=200, help="repeats of the map")
    options = parser.parse_args()
    counting((30.0,), (600.0,), options.rays, options.repeats)
    counting((10.0, 20.0, 30.0), (300.0, 200.0, 100.0), options.rays, options.repeats)
    family = families()[options.family]
    rays = family.ray_set(options.fit_rays, 1)
    counts = count_rays(rays, family.surface, grids_for(len(rays), DEPTHS))
    growing(counts, options.repeats)
    field = fitting(family, rays)
    x0, x1, y0, y1 = family.source.extent
    looking(field, 1.04 * (x1 - x0), ((x0 + x1) / 2, (y0 + y1) / 2, 0.0), options.maps)
    drawing(counts, field, options.drawn, options.repeats)


if __name__ == "__main__":
    main()
