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
from etendue.lightfield.candidate import FINE_POSITIONS, MIXED_IN, Images, Score, grow_part, images_of
from etendue.lightfield.carrier import Part
from etendue.lightfield.counting import FloatArray, PartCounts, Sums
from etendue.lightfield.etendue_density import core_part
from etendue.lightfield.selection.settings import DEFAULT, Grid, SelectionSettings
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


def _tree_shape(grid: Grid, *, few: bool) -> tuple[int, ...]:
    """Cells of a tree along the coordinates of a part."""
    place, turn = grid
    step = COARSER if few else 1
    return tuple(max(n // step, 2) for n in (1 << place, 1 << place, 1 << turn, 1 << turn))


def _numbered(coordinates: FloatArray, axes: slice, shape: tuple[int, ...]) -> Cells:
    """The cell of each ray along some of its coordinates."""
    numbers: Cells = np.zeros(len(coordinates), dtype=np.intp)
    for values, n in zip(coordinates[:, axes].T, shape, strict=True):
        numbers *= n
        numbers += np.minimum((values * n).astype(np.intp), n - 1)
    return numbers


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
class _Met:
    """The rays that meet a part of a surface: where, with how much flux, and in which fold each is held out."""

    coordinates: FloatArray
    flux: FloatArray
    fold: npt.NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class _HeldOut:
    """The rays of one fold, and the flux of all others."""

    position: FloatArray
    direction: FloatArray
    flux: FloatArray
    others: float


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
        Rays from which on one fold is enough; of fewer, as many folds are held out in turn as hold out as many rays.
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

    @functools.cached_property
    def held_out(self) -> list[_HeldOut]:
        """The folds that are held out in turn."""
        folds = range(min(math.ceil(self.one_fold_from / len(self.flux)), self.settings.folds))
        masks = (self.fold == fold for fold in folds)
        return [_HeldOut(self.position[m], self.direction[m], self.flux[m], float(self.flux[~m].sum())) for m in masks]

    def score_all(
        self, surfaces: Sequence[tuple[Sequence[Part], Grid]], recipes: Sequence[str] = TREES_ALONE
    ) -> list[HeldOutScore]:
        """The score of each of several surfaces, each on its grid; see `score`."""
        # What the grids of a surface share is made once.
        by_parts: dict[tuple[Part, ...], list[int]] = {}
        for number, (parts, _) in enumerate(surfaces):
            by_parts.setdefault(tuple(parts), []).append(number)
        with ThreadPoolExecutor(self.threads) as pool:
            found = pool.map(
                lambda one: self._score(one[0], [surfaces[number][1] for number in one[1]], recipes), by_parts.items()
            )
            scores = {
                n: s
                for numbers, own in zip(by_parts.values(), found, strict=True)
                for n, s in zip(numbers, own, strict=True)
            }
        return [scores[number] for number in range(len(surfaces))]

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
        return self._score(parts, [grid], recipes)[0]

    def _score(self, parts: Sequence[Part], grids: Sequence[Grid], recipes: Sequence[str]) -> list[HeldOutScore]:
        """The scores of a surface on several grids."""
        owner, coordinates = _core.cross_parts([part.core() for part in parts], self.position, self.direction)
        rays = [
            _Met(coordinates[mine], self.flux[mine], self.fold[mine])
            for mine in (np.flatnonzero(owner == index) for index in range(len(parts)))
        ]
        weights = np.concatenate([held_out.flux for held_out in self.held_out])
        unmet = float(self.flux[owner < 0].sum() / self.flux.sum())
        most = max(len(own.flux) for own in rays)
        few = [len(own.flux) < FEW * most for own in rays]
        images = self._images(parts, rays, few, recipes)
        found = []
        for grid in grids:
            shapes = [_tree_shape(grid, few=is_few) for is_few in few]
            cells = [_numbered(own.coordinates, slice(0, 4), shape) for own, shape in zip(rays, shapes, strict=True)]
            values = [self._held_out(fold, parts, rays, cells, shapes, own, recipes) for fold, own in enumerate(images)]
            scores = [Score(np.concatenate(of_recipe), weights) for of_recipe in zip(*values, strict=True)]
            found.append(HeldOutScore(max(scores, key=lambda score: score.mean), unmet))
        return found

    def _images(
        self, parts: Sequence[Part], rays: Sequence[_Met], few: Sequence[bool], recipes: Sequence[str]
    ) -> list[list[Images]]:
        """For each fold the images of each part, by the rays that are not held out.

        Their concentrations are those of greatest evidence in the first fold.
        """
        found: list[list[Images]] = [[Images() for _ in parts] for _ in self.held_out]
        for index, (part, own) in enumerate(zip(parts, rays, strict=True)):
            if not part.is_shared and recipes == TREES_ALONE:
                continue
            shape = tuple(n // (COARSER if few[index] else 1) for n in IMAGE_SHAPE)
            cells = [_numbered(own.coordinates, axes, shape[axes]) for axes in (slice(0, 2), slice(2, 4))]
            first: Images | None = None
            for fold, images in enumerate(found):
                fitted = own.fold != fold
                if not fitted.any():
                    continue
                space, direction = (
                    _sums(c[fitted], own.flux[fitted], shape[axes])
                    for c, axes in zip(cells, (slice(0, 2), slice(2, 4)), strict=True)
                )
                counts = PartCounts(space, space, direction)
                images[index] = images_of(counts, part, 1, positions=IMAGE_POSITIONS, like=first, unflattened=False)
                first = first or images[index]
        return found

    def _held_out(
        self,
        fold: int,
        parts: Sequence[Part],
        rays: Sequence[_Met],
        cells: Sequence[Cells],
        shapes: Sequence[tuple[int, ...]],
        images: Sequence[Images],
        recipes: Sequence[str],
    ) -> list[FloatArray]:
        """Ln of the density at the rays of a fold, by the fields of the others that each recipe makes."""
        estimates = []
        met = 0.0
        for index, (part, own) in enumerate(zip(parts, rays, strict=True)):
            fitted = own.fold != fold
            flux = own.flux[fitted]
            if len(flux):
                counts = _sums(cells[index][fitted], flux, shapes[index])
                # A tree that does not know of the images.
                c, alone = self.settings.concentration, PartCounts(counts, counts, counts)
                estimate = grow_part(alone, part, "uniform", images[index], c, 1, "none", positions=POSITIONS[:1])
                estimates.append((estimate, float(flux.sum())))
                met += estimates[-1][1]
        out = self.held_out[fold]
        unmet = max(1.0 - met / out.others, MIXED_IN)
        values = []
        for recipe in recipes:
            density = np.zeros(len(out.flux))
            fields = [
                core_part(e.chart.core(), dataclasses.replace(e, recipe=recipe).field(flux)) for e, flux in estimates
            ]
            if fields:
                # Where a line leaves two parts, the light of both counts.
                light = _core.LightField(fields).luminance(out.position, out.direction, 1)[0]
                density = light / met
            values.append(np.log((1.0 - unmet) * density + unmet * self.even))
        return values


def _sums(cell: Cells, flux: FloatArray, shape: tuple[int, ...]) -> Sums:
    n = math.prod(shape)
    if flux.min() == flux.max():
        return Sums(np.bincount(cell, minlength=n).reshape(shape).astype(np.float64), None)
    first, second = (np.bincount(cell, w, n).reshape(shape).astype(np.float64) for w in (flux, flux**2))
    return Sums(first, second)
