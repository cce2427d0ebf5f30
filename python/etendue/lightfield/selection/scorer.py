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
from etendue.lightfield.candidate import MIXED_IN, Score
from etendue.lightfield.counting import FloatArray, Sums
from etendue.lightfield.etendue_density import PartField, core_part
from etendue.lightfield.selection.settings import DEFAULT, Grid, SelectionSettings
from etendue.lightfield.surfaces import Part
from etendue.lightfield.trees import Base, grow
from etendue.quantities.ray_set import RaySet


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

    def score_all(self, surfaces: Sequence[tuple[Sequence[Part], Grid]]) -> list[HeldOutScore]:
        """The score of each of several surfaces, each on its grid; see `score`."""
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda both: self.score(*both), surfaces))

    def score(self, parts: Sequence[Part], grid: Grid) -> HeldOutScore:
        """The score of a surface of these parts.

        Parameters
        ----------
        parts : sequence of Part
            In the order in which a ray is offered to them.
        grid : tuple of int
            Halvings of each coordinate of the place, and of each of the direction.
        """
        owner, coordinates = _core.cross_parts([part.core() for part in parts], self.position, self.direction)
        shape = (1 << grid[0],) * 2 + (1 << grid[1],) * 2
        cell = np.zeros(len(owner), np.intp)
        for axis, n in enumerate(shape):
            cell = cell * n + np.minimum((coordinates[:, axis] * n).astype(np.intp), n - 1)
        folds = range(1 if len(owner) >= self.one_fold_from else self.settings.folds)
        values = [self._held_out(parts, owner, cell, shape, self.fold == fold) for fold in folds]
        weights = [self.flux[self.fold == fold] for fold in folds]
        unmet = float(self.flux[owner < 0].sum() / self.flux.sum())
        return HeldOutScore(Score(np.concatenate(values), np.concatenate(weights)), unmet)

    def _held_out(
        self,
        parts: Sequence[Part],
        owner: npt.NDArray[np.int64],
        cell: npt.NDArray[np.intp],
        shape: tuple[int, ...],
        out: npt.NDArray[np.bool_],
    ) -> FloatArray:
        """Ln of the density at the rays that are held out, by a field of the others."""
        fields = []
        for index, part in enumerate(parts):
            mine = (owner == index) & ~out
            if mine.any():
                fields.append(self._field(part, cell[mine], self.flux[mine], shape))
        met = float(self.flux[(owner >= 0) & ~out].sum())
        unmet = max(1.0 - met / float(self.flux[~out].sum()), MIXED_IN)
        density = np.zeros(int(out.sum()))
        if fields:
            # Where a line leaves two parts, the light of both counts.
            light = _core.LightField(fields).luminance(self.position[out], self.direction[out], 1)[0]
            density = light / met
        values: FloatArray = np.log((1.0 - unmet) * density + unmet * self.even)
        return values

    def _field(
        self, part: Part, cell: npt.NDArray[np.intp], flux: FloatArray, shape: tuple[int, ...]
    ) -> _core._FieldPart:
        """The light of one part, with the flux of its rays."""
        n = math.prod(shape)
        if flux.min() == flux.max():
            sums = Sums(np.bincount(cell, minlength=n).reshape(shape).astype(np.float64), None)
        else:
            first, second = (np.bincount(cell, w, n).reshape(shape).astype(np.float64) for w in (flux, flux**2))
            sums = Sums(first, second)
        ratio = grow(sums, Base(), self.settings.concentration, 1).ratio.astype(np.float32)
        unit = PartField(ratio, np.zeros_like(ratio), None, None, 1.0)
        integral = _core.LightField([core_part(part.core(), unit)]).flux()[0]
        return core_part(part.core(), dataclasses.replace(unit, level=float(flux.sum()) / integral))
