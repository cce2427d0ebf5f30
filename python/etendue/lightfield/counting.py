"""Étendue counts: what a pass over the rays leaves of them on a carrier surface."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Surface
from etendue.lightfield.pilot_sample import LOOKED_AT, even_density, pilot_sample
from etendue.quantities.ray_stream import Progress, RayStream, Tally, checked_threads

FloatArray = npt.NDArray[np.float64]
Depths = tuple[int, int, int, int]
Fold = Literal["fitted", "held out", "all"]

DEEPEST = 16
"""Halvings of a coordinate that the core finds cells by."""

MOST_CELLS = 1 << 26
"""Cells of all parts together: a gigabyte for the weighted sums of both folds."""


@dataclasses.dataclass(frozen=True)
class Sums:
    """Σ w and Σ w² over the rays of each cell of one part.

    Parameters
    ----------
    weight : array
        Number of rays if all rays are equal, else Σ w.
    squared : array or None
        Σ w²; None if all rays are equal.
    """

    weight: FloatArray
    squared: FloatArray | None

    @property
    def rays(self) -> float:
        """Number of equal rays that would tell as much: (Σ w)²/Σ w²."""
        total = float(self.weight.sum())
        if self.squared is None or total == 0.0:
            return total
        return total**2 / float(self.squared.sum())

    def plus(self, other: Sums) -> Sums:
        """Those of both."""
        if self.squared is None or other.squared is None:
            return Sums(self.weight + other.weight, None)
        return Sums(self.weight + other.weight, self.squared + other.squared)

    def map(self, change: Callable[..., FloatArray], *arguments: object) -> Sums:
        """Both sums, changed alike by a function of an array and further arguments."""
        return Sums(change(self.weight, *arguments), None if self.squared is None else change(self.squared, *arguments))


@dataclasses.dataclass(frozen=True)
class PartCounts:
    """The counts of one part and fold: over (s₁, s₂, a, b), over (s₁, s₂) and over (a, b) alone."""

    grid: Sums
    space: Sums
    direction: Sums


@dataclasses.dataclass(frozen=True)
class PartGrids:
    """How fine the grids of one part are.

    Parameters
    ----------
    depths : tuple of 4 ints
        2^depth cells along each of s₁, s₂, a, b; all have the same étendue π A / cells.
    fine : tuple of 2 ints
        2^depth cells along s₁ and s₂, and along a and b, of the finer grids over place and direction alone.
    """

    depths: Depths = (5, 5, 5, 5)
    fine: tuple[int, int] = (8, 6)

    @property
    def cells(self) -> int:
        """Of the grid over all four."""
        return 1 << sum(self.depths)


@dataclasses.dataclass(frozen=True)
class HeldOutRays:
    """Held-out rays with their exact coordinates.

    Parameters
    ----------
    part : array of int, shape (n,)
    coordinates : array, shape (n, 4)
        (s₁, s₂, a, b), each from 0 to 1.
    weight : array, shape (n,)
        Relative flux.
    """

    part: npt.NDArray[np.int64]
    coordinates: FloatArray
    weight: FloatArray


@dataclasses.dataclass(frozen=True)
class EtendueCounts:
    """Counts of a ray set on a carrier surface; see `count_rays`.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    grids : tuple of PartGrids
        Those of each part.
    folds : dict
        Per fold the counts of each part.
    some_held_out : HeldOutRays
        Some of the held-out rays.
    flux_per_weight : float
        [flux unit] per unit of the sums.
    rays, unmet_rays : int
        Rays with flux, and those of them that no part meets.
    unmet_flux : float
        Flux of the latter [flux unit].
    tally : Tally
        The flux account of all rays.
    even : float
        The even density over all lines through the source [1/(mm² sr)]; see `even_density`.
    symmetry : str
        What the counts are folded by, so that each ray is counted once for each of its images; ``"none"``: they are not.
    """

    surface: Surface
    grids: tuple[PartGrids, ...]
    folds: dict[Fold, tuple[PartCounts, ...]]
    some_held_out: HeldOutRays
    flux_per_weight: float
    rays: int
    unmet_rays: int
    unmet_flux: float
    tally: Tally
    even: float
    symmetry: str = "none"

    def __getitem__(self, fold: Fold) -> tuple[PartCounts, ...]:
        return self.folds[fold]

    @property
    def part_flux(self) -> tuple[float, ...]:
        """Flux that was counted on each part [flux unit]."""
        return tuple(float(c.grid.weight.sum()) * self.flux_per_weight for c in self["all"])


def count_rays(
    rays: RayStream,
    surface: Surface,
    grids: PartGrids | Sequence[PartGrids] = PartGrids(),
    *,
    held_out: float = 0.1,
    keep: int = 1 << 18,
    seed: int = 1,
    threads: int | None = None,
    progress: Progress | None = None,
) -> EtendueCounts:
    """Count every ray in the cell of étendue that it crosses: one pass, whatever the size of the set.

    Parameters
    ----------
    rays : RayStream
        Any number of rays.
    surface : Surface
        Open dimensions are taken from the rays.
    grids : PartGrids or sequence of them
        For all parts, or for each.
    held_out : float
        Share of the rays, 0 to ½, that is counted apart; which, hangs on the number of the ray and the seed.
    keep : int
        About as many of the held-out rays are kept with their coordinates.
    seed : int
        Of the choice.
    threads : int, optional
        All cores if None. The result has the same bits for any number.
    progress : callable, optional
        Called with the number of rays done.

    Raises
    ------
    ArgumentError
        If the rays have no position, the grids are too large, or no ray meets the surface.

    Examples
    --------
    >>> import etendue as et
    >>> counts = count_rays(et.RingSource(rays=100_000), et.Disk(radius=30), PartGrids((3, 3, 3, 3)))
    >>> [round(flux, 9) for flux in counts.part_flux], counts.unmet_rays
    ([600.0], 0)
    """
    surface = surface.sized_for(rays)
    parts = surface.parts()
    if not rays.has_position:
        raise ArgumentError("these rays have no positions (a far-field set), so no surface can carry them.")
    grids = (grids,) * len(parts) if isinstance(grids, PartGrids) else tuple(grids)
    if len(grids) != len(parts):
        raise ArgumentError(f"{len(grids)} grids for the {len(parts)} parts of {surface.told}; give one for each.")
    deepest = [d for g in grids for d in (*g.depths, *g.fine)]
    if not all(0 <= d <= DEEPEST for d in deepest) or sum(g.cells for g in grids) > MOST_CELLS:
        told = ", ".join(f"{g.depths} and {g.fine}" for g in dict.fromkeys(grids))
        raise ArgumentError(
            f"grids of depths {told} on {len(parts)} parts; give depths from 0 to {DEEPEST} that make at most "
            f"{MOST_CELLS:,} cells."
        )
    share = min(1.0, keep / max(len(rays), 1))
    raw = _core.count_rays(
        rays.core_source(),
        [p.core() for p in parts],
        [(g.depths, g.fine) for g in grids],
        held_out,
        share,
        seed,
        checked_threads(threads),
        progress,
    )
    tally = Tally.from_core(raw["tally"])
    scale = rays.accept_tally(tally)
    folds = _folds(raw, grids)
    counted = sum(float(c.grid.weight.sum()) for c in folds["all"])
    if counted == 0.0:
        raise ArgumentError(
            f"none of {tally.rays:,} rays meets the surface {surface.told}; move the surface, or give it more room."
        )
    return EtendueCounts(
        surface=surface,
        grids=grids,
        folds=folds,
        some_held_out=HeldOutRays(raw["kept_part"], raw["kept"], raw["kept_weight"]),
        flux_per_weight=scale * (1.0 if raw["weight"] is None else raw["weight"]),
        rays=tally.lit,
        unmet_rays=raw["unmet_rays"],
        unmet_flux=raw["unmet_flux"] * scale,
        tally=tally,
        even=even_density(pilot_sample(rays, LOOKED_AT)),
    )


def _folds(raw: _core._Counts, grids: tuple[PartGrids, ...]) -> dict[Fold, tuple[PartCounts, ...]]:
    """The core's flat arrays as sums per fold and part, each with the shape of its grid."""

    def cut(values: npt.NDArray[np.generic], of_parts: list[tuple[int, ...]]) -> list[list[FloatArray]]:
        """Per fold and part."""
        ends = np.cumsum([math.prod(shape) for shape in of_parts])[:-1]
        return [
            [
                piece.reshape(shape).astype(np.float64)
                for piece, shape in zip(np.split(fold, ends), of_parts, strict=True)
            ]
            for fold in np.split(values, 2)
        ]

    def sums(name: Literal["grid", "space", "direction"], of_parts: list[tuple[int, ...]]) -> list[list[Sums]]:
        weight, squared = raw[name]
        weights = cut(weight, of_parts)
        if squared is None:
            return [[Sums(w, None) for w in fold] for fold in weights]
        both = zip(weights, cut(squared, of_parts), strict=True)
        return [[Sums(w, s) for w, s in zip(*fold, strict=True)] for fold in both]

    counted = (
        sums("grid", [tuple(1 << d for d in g.depths) for g in grids]),
        sums("space", [(1 << g.fine[0],) * 2 for g in grids]),
        sums("direction", [(1 << g.fine[1],) * 2 for g in grids]),
    )
    fitted, held_out = (
        tuple(PartCounts(*three) for three in zip(*(kind[fold] for kind in counted), strict=True)) for fold in (0, 1)
    )
    together = tuple(
        PartCounts(*(a.plus(b) for a, b in ((f.grid, h.grid), (f.space, h.space), (f.direction, h.direction))))
        for f, h in zip(fitted, held_out, strict=True)
    )
    return {"fitted": fitted, "held out": held_out, "all": together}
