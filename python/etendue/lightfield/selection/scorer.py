"""Scores of carrier surfaces: how well the light field on each predicts the same held-out rays."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.lightfield.candidate import FINE_POSITIONS, MIXED_IN, Images, PartEstimate, Score, grow_part, images_of
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import core_part
from etendue.lightfield.selection.settings import DEFAULT, Grid, SelectionSettings
from etendue.lightfield.surfaces import Part
from etendue.lightfield.trees import POSITIONS
from etendue.quantities.ray_set import RaySet

Cells = npt.NDArray[np.intp]

TREES_ALONE = ("uniform",)
WITH_IMAGES = ("uniform", "scaled")
"""Recipes that a score may use, with the same tree."""

IMAGE_SHAPE = (128, 128, 32, 32)
"""Cells of the images over place and over direction."""

IMAGE_POSITIONS = FINE_POSITIONS[:2]
"""Positions over which they are averaged."""


FEW = 1.0 / 16.0
"""Share of the rays of the part that has the most below which a part is scored on coarser grids."""

COARSER = 4
"""By how much along each coordinate."""


@dataclasses.dataclass(frozen=True)
class _Shapes:
    """Cells along the coordinates of a part: of the tree, of the image over place and of that over direction."""

    grid: tuple[int, ...]
    space: tuple[int, ...]
    direction: tuple[int, ...]

    @classmethod
    def of(cls, grid: Grid, *, few: bool) -> _Shapes:
        place, turn = grid
        step = COARSER if few else 1
        tree = tuple(max(n // step, 2) for n in (1 << place, 1 << place, 1 << turn, 1 << turn))
        images = tuple(n // step for n in IMAGE_SHAPE)
        return cls(tree, images[:2], images[2:])

    def cells(self, coordinates: FloatArray) -> tuple[Cells, Cells, Cells]:
        """The cell of each ray in each of the three."""

        def numbered(axes: slice, shape: tuple[int, ...]) -> Cells:
            index = np.minimum((coordinates[:, axes] * shape).astype(np.intp), np.array(shape) - 1)
            numbers: Cells = np.ravel_multi_index(tuple(index.T), shape)
            return numbers

        return (
            numbered(slice(0, 4), self.grid),
            numbered(slice(0, 2), self.space),
            numbered(slice(2, 4), self.direction),
        )


@dataclasses.dataclass(frozen=True, eq=False)
class HeldOutScore:
    """How well a surface predicts held-out rays.

    Parameters
    ----------
    score : Score
        ln of the density in étendue [1/(mm² sr)] at each ray.
    unmet : float
        Share of the flux of all rays that does not meet the surface.
    """

    score: Score
    unmet: float

    def leads(self, other: HeldOutScore, settings: SelectionSettings = DEFAULT) -> bool:
        """Whether the score lies above another with certainty, and by enough to matter."""
        lead, error = self.score.lead(other.score)
        return lead > max(settings.lead * error, settings.least_lead)


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceScorer:
    """Rays that are dealt into fitted and held-out ones in the same way for all surfaces.

    The density that a surface gives a ray is (1 - u) L/Φ + u e: L/Φ is the field of the fitted rays on that surface, u the
    share of their flux that does not meet it, and e an even density over all lines through a ball that holds the source.
    It adds up to one over all lines, whatever the surface, and is constant along each: so any two surfaces are compared by
    it, and a surface pays for what it leaves out.

    Parameters
    ----------
    position, direction : array, shape (n, 3)
        [mm], unit vectors.
    flux : array, shape (n,)
        Of any unit.
    even : float
        e [1/(mm² sr)]
    seed : int
        Of the dealing.
    threads : int or None
    one_fold_from : int
        Rays from which on one fold is enough.
    settings : SelectionSettings
    """

    position: FloatArray
    direction: FloatArray
    flux: FloatArray
    even: float
    seed: int
    threads: int | None
    one_fold_from: int
    settings: SelectionSettings = DEFAULT

    @classmethod
    def of(
        cls,
        rays: RaySet,
        even: float,
        seed: int,
        threads: int | None,
        one_fold_from: int = DEFAULT.one_fold_from,
        settings: SelectionSettings = DEFAULT,
    ) -> SurfaceScorer:
        """A scorer with all rays of a set."""
        # Against the largest, so that no square of a flux overflows.
        flux = rays.flux / rays.flux.max()
        return cls(rays.position, rays.direction, flux, even, seed, threads, one_fold_from, settings)

    @functools.cached_property
    def fold(self) -> npt.NDArray[np.int64]:
        """In which fold each ray is held out."""
        return np.random.default_rng(self.seed).permutation(len(self.flux)) % self.settings.folds

    def score_all(
        self, surfaces: Sequence[tuple[Sequence[Part], Grid]], recipes: Sequence[str] = TREES_ALONE
    ) -> list[HeldOutScore]:
        """The score of each of several surfaces, each on its grid; see `score`."""
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda both: self.score(both[0], both[1], recipes), surfaces))

    def score(self, parts: Sequence[Part], grid: Grid, recipes: Sequence[str] = TREES_ALONE) -> HeldOutScore:
        """The score of a surface of these parts.

        Parameters
        ----------
        parts : sequence of Part
            In the order in which a ray is offered to them.
        grid : tuple of int
            Halvings of each coordinate of the place, and of each of the direction.
        recipes : sequence of str
            `TREES_ALONE`, or `WITH_IMAGES`: of those the one that predicts better counts.
        """
        owner, coordinates = _core.cross_parts([part.core() for part in parts], self.position, self.direction)
        met = np.bincount(owner[owner >= 0], minlength=len(parts))
        shapes = [_Shapes.of(grid, few=bool(n < FEW * met.max())) for n in met]
        cells = [shape.cells(coordinates[owner == index]) for index, shape in enumerate(shapes)]
        folds = range(1 if len(owner) >= self.one_fold_from else self.settings.folds)
        values = [self._held_out(parts, owner, cells, shapes, self.fold == fold, recipes) for fold in folds]
        weights = np.concatenate([self.flux[self.fold == fold] for fold in folds])
        unmet = float(self.flux[owner < 0].sum() / self.flux.sum())
        scores = [Score(np.concatenate(of_recipe), weights) for of_recipe in zip(*values, strict=True)]
        return HeldOutScore(max(scores, key=lambda score: score.mean), unmet)

    def _held_out(
        self,
        parts: Sequence[Part],
        owner: npt.NDArray[np.int64],
        cells: Sequence[tuple[Cells, Cells, Cells]],
        shapes: Sequence[_Shapes],
        out: npt.NDArray[np.bool_],
        recipes: Sequence[str],
    ) -> list[FloatArray]:
        """Ln of the density at the rays that are held out, by the fields of the others that each recipe makes."""
        estimates = []
        for index, part in enumerate(parts):
            mine = (owner == index) & ~out
            if mine.any():
                own = mine[owner == index]
                picked = tuple(c[own] for c in cells[index])
                estimates.append((self._estimate(part, picked, self.flux[mine], shapes[index], recipes), mine))
        met = float(self.flux[(owner >= 0) & ~out].sum())
        unmet = max(1.0 - met / float(self.flux[~out].sum()), MIXED_IN)
        values = []
        for recipe in recipes:
            density = np.zeros(int(out.sum()))
            fields = [
                core_part(e.chart.core(), dataclasses.replace(e, recipe=recipe).field(float(self.flux[mine].sum())))
                for e, mine in estimates
            ]
            if fields:
                # Where a line leaves two parts, the light of both counts.
                light = _core.LightField(fields).luminance(self.position[out], self.direction[out], 1)[0]
                density = light / met
            values.append(np.log((1.0 - unmet) * density + unmet * self.even))
        return values

    def _estimate(
        self,
        part: Part,
        cells: Sequence[Cells],
        flux: FloatArray,
        shapes: _Shapes,
        recipes: Sequence[str],
    ) -> PartEstimate:
        """What the rays of one part tell of its light: a tree that does not know of the images, and the images."""
        counts = PartCounts(*(_sums(c, flux, s) for c, s in zip(cells, dataclasses.astuple(shapes), strict=True)))
        needed = part.hole > 0.0 or recipes != TREES_ALONE
        images = images_of(counts, part, 1, positions=IMAGE_POSITIONS) if needed else Images()
        return grow_part(
            counts, part, "uniform", images, self.settings.concentration, 1, "none", positions=POSITIONS[:1]
        )


def _sums(cell: Cells, flux: FloatArray, shape: tuple[int, ...]) -> Sums:
    n = math.prod(shape)
    if flux.min() == flux.max():
        return Sums(np.bincount(cell, minlength=n).reshape(shape).astype(np.float64), None)
    first, second = (np.bincount(cell, w, n).reshape(shape).astype(np.float64) for w in (flux, flux**2))
    return Sums(first, second)
