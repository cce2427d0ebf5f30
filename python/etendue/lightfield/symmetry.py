"""Symmetry of a source: each ray stands for all its images, and every cell of étendue holds the rays of all of them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.counting import EtendueCounts, FloatArray, PartCounts, Sums
from etendue.quantities.arguments import require_known

Image = Callable[[FloatArray], FloatArray]

FLAT = ("rectangle", "disk", "hemisphere")
"""Shapes whose charts are turned and mirrored with what they carry."""

SIGNIFICANCE_Z = 3.09
"""One in a thousand symmetric sources is taken for an asymmetric one."""

FEWEST = 10
"""Rays that a pair of cells needs to be compared."""


def _mirror_x(cells: FloatArray) -> FloatArray:
    return np.flip(cells, tuple(range(0, cells.ndim, 2)))


def _mirror_y(cells: FloatArray) -> FloatArray:
    return np.flip(cells, tuple(range(1, cells.ndim, 2)))


def _half_turn(cells: FloatArray) -> FloatArray:
    return np.flip(cells)


def _quarter_turn(cells: FloatArray) -> FloatArray:
    for first in range(0, cells.ndim, 2):
        cells = np.rot90(cells, axes=(first, first + 1))
    return cells


def _three_quarter_turn(cells: FloatArray) -> FloatArray:
    return _half_turn(_quarter_turn(cells))


SYMMETRIES: dict[str, tuple[Image, ...]] = {
    "mirror-x": (_mirror_x,),
    "mirror-y": (_mirror_y,),
    "c2": (_half_turn,),
    "mirror-xy": (_mirror_x, _mirror_y, _half_turn),
    "c4": (_quarter_turn, _half_turn, _three_quarter_turn),
}
"""By name the images of a cell, besides itself: x → -x, y → -y, the half-turn, both mirrors, the quarter-turn."""


def fold(counts: EtendueCounts, symmetry: str) -> EtendueCounts:
    """Counts in which every cell holds the rays of all its images; flux, and flux per étendue, are unchanged.

    In the charts of flat parts, disks and hemispheres a mirror x → -x is s₁ → 1 - s₁ and a → 1 - a, exactly; a turn is
    a turn of both squares. The symmetry is about the middle of the surface.

    Raises
    ------
    UnknownNameError
        If there is no such symmetry.
    ArgumentError
        If a part cannot carry it: tubes and boxes, or a quarter-turn on a grid that is not square.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.counting import PartGrids, count_rays
    >>> counts = count_rays(et.RingSource(rays=10_000), et.Disk(radius=30), PartGrids((3, 3, 2, 2)))
    >>> folded = fold(counts, "mirror-x")
    >>> bool(folded["all"][0].grid.rays == 2 * counts["all"][0].grid.rays), round(folded.part_flux[0], 6)
    (True, 600.0)
    """
    _images(counts, symmetry)  # refuses what the surface cannot carry

    def together(cells: FloatArray) -> FloatArray:
        return sum_of_images(cells, symmetry)

    folds = {
        name: tuple(PartCounts(*(s.map(together) for s in (p.grid, p.space, p.direction))) for p in parts)
        for name, parts in counts.folds.items()
    }
    return dataclasses.replace(
        counts, folds=folds, flux_per_weight=counts.flux_per_weight / order(symmetry), symmetry=symmetry
    )


def order(symmetry: str) -> int:
    """How many images a ray has under a symmetry, itself included.

    Examples
    --------
    >>> order("none"), order("mirror-x"), order("c4")
    (1, 2, 4)
    """
    return 1 + len(SYMMETRIES.get(symmetry, ()))


def sum_of_images(cells: FloatArray, symmetry: str) -> FloatArray:
    """The sum of an array over cells, of place and direction or of either, and of its images.

    Examples
    --------
    >>> sum_of_images(np.array([[1.0, 2.0], [3.0, 4.0]]), "mirror-x").tolist()
    [[4.0, 6.0], [4.0, 6.0]]
    """
    total = cells.copy()
    for image in SYMMETRIES.get(symmetry, ()):
        total += image(cells)
    return total


def proven_symmetry(counts: EtendueCounts) -> str:
    """The largest symmetry that the counts do not speak against, or ``"none"``.

    Coarse cells are compared with their images by χ², at a significance of 1e-3 (Wilson and Hilferty's approximation).
    """
    for name in sorted(SYMMETRIES, key=lambda n: -len(SYMMETRIES[n])):
        try:
            images = _images(counts, name)
        except ArgumentError:
            continue
        found = _disagreements(counts, images)
        if found and not _refuted(found):
            return name
    return "none"


def refutation(counts: EtendueCounts, symmetry: str) -> str | None:
    """What is to be said of a symmetry that was stated, if the counts speak against it; None if they do not.

    Parameters
    ----------
    counts : EtendueCounts
        Not folded.
    symmetry : str
        A name in `SYMMETRIES`.

    Raises
    ------
    UnknownNameError, ArgumentError
        As `fold`.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.counting import PartGrids, count_rays
    >>> counts = count_rays(et.RingSource(rays=10_000), et.Disk(radius=30), PartGrids((3, 3, 2, 2)))
    >>> refutation(counts, "mirror-x") is None
    True
    """
    found = _disagreements(counts, _images(counts, symmetry))
    if not _refuted(found):
        return None
    worst = max(found, key=lambda one: one.z)
    return (
        f"the rays refute the symmetry {symmetry} that was stated: χ² of counts and images is {worst.chi2:,.0f} over "
        f"{worst.pairs:,.0f} pairs of cells (significance 1e-3); the field has the symmetry all the same"
    )


@dataclasses.dataclass(frozen=True)
class _Disagreement:
    """χ² of cells of a part against their images under one map, and how many pairs there are."""

    chi2: float
    pairs: float

    @property
    def z(self) -> float:
        """By how many standard deviations χ² lies above its mean (Wilson and Hilferty's approximation)."""
        spread = 2.0 / (9.0 * self.pairs)
        return (math.cbrt(self.chi2 / self.pairs) - (1.0 - spread)) / math.sqrt(spread)


def _disagreements(counts: EtendueCounts, images: tuple[Image, ...]) -> list[_Disagreement]:
    """Of each part and image that has data."""
    tests = (_disagreement(part.grid, image) for part in counts["all"] for image in images)
    return [test for test in tests if test is not None]


def _refuted(found: list[_Disagreement]) -> bool:
    """Whether one of them is too large; each gets its share of the significance (Bonferroni, for a few of them)."""
    return any(one.z >= SIGNIFICANCE_Z + 0.25 * math.log(len(found)) for one in found)


def _images(counts: EtendueCounts, symmetry: str) -> tuple[Image, ...]:
    require_known(symmetry, SYMMETRIES, "symmetry")
    charts = counts.surface.parts()
    upright = all(abs(chart.axes[2][2]) == 1.0 for chart in charts)
    if not upright or any(chart.shape not in FLAT for chart in charts):
        raise ArgumentError(
            f"the surface {counts.surface.told} cannot carry the symmetry {symmetry}; planes, disks, hemispheres, spheres "
            "and domes can."
        )
    if any(chart.beam[:2] != (0.0, 0.0) or chart.taken[:2] != (0.0, 0.0) for chart in charts):
        raise ArgumentError(
            f"the surface {counts.surface.told} cannot carry the symmetry {symmetry}; state a beam about the normal, "
            "beam=0/0/<radius>, or none, beam=0/0/1."
        )
    square = all(chart.shape != "rectangle" or math.isclose(*chart.size, rel_tol=1e-9) for chart in charts)
    even = all(g.depths[0] == g.depths[1] and g.depths[2] == g.depths[3] for g in counts.grids)
    if symmetry == "c4" and not (square and even):
        raise ArgumentError(
            f"a quarter-turn needs a square surface and square grids, not {counts.surface.told} with depths "
            f"{counts.grids[0].depths}; state equal width and height, or take a disk."
        )
    return SYMMETRIES[symmetry]


def _disagreement(sums: Sums, image: Image) -> _Disagreement | None:
    """The χ² of cells against their images; None without data."""
    weight, squared = _coarse(sums.weight), _coarse(sums.weight if sums.squared is None else sums.squared)
    difference, variance = weight - image(weight), squared + image(squared)
    # Every pair appears twice, once from either side; a cell that is its own image says nothing.
    number = weight.sum() / max(squared.sum(), np.finfo(np.float64).tiny)
    told = (variance * number**2 >= FEWEST) & (difference != 0)
    pairs = told.sum() / 2
    if pairs < 1:
        return None
    return _Disagreement(float((difference[told] ** 2 / variance[told]).sum() / 2), float(pairs))


def _coarse(cells: FloatArray) -> FloatArray:
    """Sums over blocks, so that at most eight cells are left along each axis of the place and four of the direction."""
    for axis, limit in enumerate((8, 8, 4, 4)):
        n = min(cells.shape[axis], limit)
        shape = (*cells.shape[:axis], n, cells.shape[axis] // n, *cells.shape[axis + 1 :])
        cells = cells.reshape(shape).sum(axis=axis + 1)
    return cells
