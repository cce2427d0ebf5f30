"""How rays are put into the order of an index: two passes over them, then one over the cells."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, Tally, checked_threads

Records = npt.NDArray[Any]
Point = tuple[float, float, float]

SIDES = (8, 16, 32, 64, 128, 256)
"""Numbers of cells of direction along a side of a hemisphere's square."""

RAYS_PER_CELL = 2048
"""Of a source that fills a hemisphere evenly: some 4 × 4 leaves, so that boxes are narrow in direction and in place."""

DRAWN = np.dtype([("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8")])
"""Records of rays that have none because they are drawn on demand."""

PIECES = 64
"""Places along a stream at which rays are looked at to find where they come from."""

PILOT_RAYS = 1024
"""Rays looked at there."""

SINGULAR = 1e-6
"""Smallest eigenvalue, as a fraction of the largest, below which the rays have no point that they come from."""

PASSES = 3


@dataclasses.dataclass(frozen=True)
class IndexTables:
    """What an index holds beside its rays; docs/formats/ray-index.md describes it.

    Parameters
    ----------
    side : int
        Cells of direction along a side, one of `SIDES`.
    centre : tuple of 3 floats
        Origin of the cells' planes [mm].
    starts : array of uint64, shape (2·side² + 1,)
        First ray of each cell, and the number of rays.
    bounds : array of float32, shape (leaves, 8)
        The least and greatest u, v [mm], p, q of each leaf's rays.
    """

    side: int
    centre: Point
    starts: npt.NDArray[np.uint64]
    bounds: npt.NDArray[np.float32]


@dataclasses.dataclass(frozen=True)
class Counted:
    """What the first pass leaves.

    Parameters
    ----------
    tally : Tally
        Of all rays of the source.
    side : int
    starts : array of uint64, shape (2·side² + 1,)
    dtype : structured dtype
        Of the records.
    centre : tuple of 3 floats
        Where the rays come from [mm].
    """

    tally: Tally
    side: int
    starts: npt.NDArray[np.uint64]
    dtype: np.dtype[Any]
    centre: Point

    @property
    def rays(self) -> int:
        """Usable rays."""
        return int(self.starts[-1])

    @property
    def leaves(self) -> int:
        """Leaves of all cells."""
        return leaf_count(self.starts)


def leaf_count(starts: npt.NDArray[np.uint64]) -> int:
    """Leaves of all cells: each cell's rays, by so many at a time."""
    leaf = np.uint64(_core.index_leaf())
    return int(((np.diff(starts) + leaf - np.uint64(1)) // leaf).sum())


def grid_side(rays: int) -> int:
    """The number of cells along a side that suits a number of rays."""
    wanted = math.sqrt(rays / (2 * RAYS_PER_CELL))
    return min(SIDES, key=lambda side: abs(math.log2(side / max(wanted, 1.0))))


def count_rays(rays: RayStream, threads: int | None, progress: Progress | None) -> Counted:
    """The first pass.

    Raises
    ------
    ArgumentError
        If the rays have no position, or not one can be used.
    """
    if not rays.has_position:
        raise ArgumentError(
            f"{rays.provenance.source}: the rays have no position (far-field data), so they have no luminance to index. "
            "Ask for a near-field ray file."
        )
    side = grid_side(len(rays))
    source = rays.core_source()
    counts, data = _core.index_count(source, side, checked_threads(threads), _share(progress, 0, len(rays)))
    tally = Tally.from_core(data)
    rays.accept_tally(tally)
    if not counts.any():
        raise ArgumentError(
            f"{rays.provenance.source}: not one of {len(rays):,} rays is usable; there is nothing to write."
        )
    starts = np.zeros(len(counts) + 1, np.uint64)
    np.cumsum(counts, out=starts[1:])
    dtype = rays.records.dtype if isinstance(rays, RaySet) else DRAWN
    return Counted(tally, side, starts, dtype, where_from(rays))


def fill_index(
    rays: RayStream, counted: Counted, records: Records, threads: int | None, progress: Progress | None
) -> IndexTables:
    """The other passes: the records into their places, which are `records`, of shape (counted.rays,), mapped or not.

    Raises
    ------
    ArgumentError
        If the rays are not those that were counted: somebody writes to their file.
    """
    threads, side, starts, total = checked_threads(threads), counted.side, counted.starts, len(rays)
    source = rays.core_source()
    out = records.view(np.uint8).reshape(-1)
    if not _core.index_place(source, side, starts, out, threads, _share(progress, 1, total)):
        raise ArgumentError(
            f"{rays.provenance.source}: the rays changed while they were indexed; is somebody writing to their file?"
        )
    fields: Any = counted.dtype.fields
    table = _core.RayTable(
        out,
        counted.dtype.itemsize,
        fields["position"][1],
        fields["direction"][1],
        fields["flux"][1],
        fields["flux"][0] == np.dtype("<f8"),
        rays.meaning.length_scale if isinstance(rays, RaySet) else 1.0,
    )
    bounds = _core.index_arrange(table, side, starts, counted.centre, threads, _share(progress, 2, total))
    return IndexTables(side, counted.centre, starts, bounds)


def where_from(rays: RayStream) -> Point:
    """About where the rays come from [mm]: the point that the lines of some of them come closest to.

    If there is none, because they are parallel, where they start. Planes through that point cut the rays where they are
    closest together; another point makes an index slower and no less right.
    """
    source, total = rays.core_source(), len(rays)
    count = min(PIECES, -(-total // PILOT_RAYS))
    places = [round(i * max(total - PILOT_RAYS, 0) / max(count - 1, 1)) for i in range(count)]
    position, direction, flux = _core.read_pieces(source, [(at, min(at + PILOT_RAYS, total)) for at in places])
    weight = flux if flux.any() else np.any(direction != 0.0, axis=1).astype(np.float64)
    if not weight.any():
        return (0.0, 0.0, 0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        a = weight.sum() * np.eye(3) - np.einsum("i,ij,ik->jk", weight, direction, direction)
        across = position - np.einsum("ij,ij->i", position, direction)[:, None] * direction
        values = np.linalg.eigvalsh(a)
        point = weight @ position / weight.sum()
        if values[0] > SINGULAR * values[-1]:
            point = np.linalg.solve(a, weight @ across)
    x, y, z = point.tolist() if np.isfinite(point).all() else (0.0, 0.0, 0.0)
    return (x, y, z)


def _share(progress: Progress | None, number: int, rays: int) -> Callable[[int], None] | None:
    """The progress of one of the passes as that of all of them, in rays."""
    if progress is None:
        return None
    return lambda done: progress((number * rays + done) // PASSES)
