"""Which source gives out which ray of a run, and which rays are copies of one another: what errors rest on."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.uint64]
CellSums = tuple[Array, Array, Counts, Array]
"""Σ w, Σ w², number of units, and Σ w v with v their flux, of each cell, shape (strata, cells)."""

Units = tuple[npt.NDArray[np.uint32], Counts, Array, Array]
"""Rays with copies: cell, unit, Σ w and flux in the whole run, in the order of cells and units."""

Tally = tuple[CellSums, Units]
"""Of a work unit: sums of the rays without copies, shape (plain strata · cells,), and what those with copies add."""

ROUNDED = 12.0 * 2.0**-53
"""Sums of n terms are off by up to n/2⁵³ of themselves [Higham2002]_, and variances are made of up to twelve such."""


@dataclasses.dataclass(frozen=True)
class Dealing:
    """The rays of a run, dealt to its sources in proportion to their flux.

    A source of n rays that gives out more than n gives out each several times, and sources may share a set. Copies of one
    ray are not independent of each other. What is independent is called a *unit*: a ray of its own, or a ray of a set with
    all its copies. Units of one *stratum* are alike: stratum 0 has what sources draw; each set of rays beside other sources
    is a stratum, and each of which copies are given out, at the end.

    Parameters
    ----------
    flux : tuple of float
        Of each source [flux unit].
    sets : tuple of (int, int) or None
        Number and length of the set whose rays a source gives out; None: it draws its own.
    rays : int
        Of the whole run.

    Examples
    --------
    >>> dealing = Dealing((30.0, 70.0), ((0, 2000), None), 100_000)
    >>> dealing.strata, dealing.done(100_000).tolist()         # 15 copies of each ray of the set, and the rays of the other
    (2, [70000, 2000])
    """

    flux: tuple[float, ...]
    sets: tuple[tuple[int, int] | None, ...]
    rays: int

    @classmethod
    def of(cls, sources: list[Mapping[str, Any]], rays: int) -> Dealing:
        """Of the sources of a compiled scene."""
        known: list[Any] = []
        sets: list[tuple[int, int] | None] = []
        for source in sources:
            if source["kind"] != "rays":
                sets.append(None)
                continue
            number = next((i for i, held in enumerate(known) if held is source["rays"]), len(known))
            known += [source["rays"]] if number == len(known) else []
            sets.append((number, len(source["rays"])))
        return cls(tuple(float(source["flux"]) for source in sources), tuple(sets), rays)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the compiled part is made anew."""
        return Dealing, (self.flux, self.sets, self.rays)

    @cached_property
    def core(self) -> _core.Dealing:
        """As the core knows it."""
        return _core.Dealing(list(self.flux), list(self.sets), self.rays)

    @property
    def given(self) -> tuple[int, ...]:
        """Rays of each source in the whole run.

        Examples
        --------
        >>> Dealing((1e6, 1e-6, 1e6), (None, None, None), 101).given
        (50, 0, 51)
        """
        return tuple(count for _, count in self.core.sources())

    @property
    def strata(self) -> int:
        """Number of strata."""
        return self.core.strata()

    @property
    def plain(self) -> int:
        """Number of strata without copies, which are the first ones."""
        return self.core.plain()

    def done(self, rays: int) -> npt.NDArray[np.int64]:
        """Units of each stratum among the first `rays` rays, shape (strata,)."""
        return np.array(self.core.done(rays), dtype=np.int64)

    def nothing(self, tally: Tally) -> tuple[CellSums, Units]:
        """Sums of as many cells as a tally has, before anything is added, and no open units."""
        shape = self.strata, len(tally[0][0]) // self.plain
        none = np.zeros(0, np.uint32), np.zeros(0, np.uint64), np.zeros(0), np.zeros(0)
        return (np.zeros(shape), np.zeros(shape), np.zeros(shape, np.uint64), np.zeros(shape)), none

    def added(self, sums: CellSums, begun: Units, tally: Tally, rays: int) -> tuple[CellSums, Units]:
        """Sums with those of the next work unit.

        Parameters
        ----------
        sums : CellSums
            So far, shape (strata, cells).
        begun : Units
            Those of which more copies may come.
        tally : Tally
            Of the work unit.
        rays : int
            Given out in all, the work unit included.

        Returns
        -------
        sums, begun
            New arrays.

        Examples
        --------
        Three rays, each given out twice, which contribute 1 each time: two of them are done, of the third more may come.

        >>> dealing = Dealing((1.0,), ((0, 3),), 6)
        >>> own = np.zeros(1), np.zeros(1), np.zeros(1, np.uint64), np.zeros(1)
        >>> copies = np.zeros(3, np.uint32), np.arange(6, 9, dtype=np.uint64), np.array([2.0, 2.0, 1.0]), np.full(3, 2.0)
        >>> sums, begun = dealing.added(*dealing.nothing((own, copies)), (own, copies), rays=5)
        >>> [part[1].tolist() for part in sums], begun[2].tolist()
        ([[5.0], [9.0], [3], [10.0]], [1.0])
        """
        own, copies = tally
        added = sums[0].copy(), sums[1].copy(), sums[2].copy(), sums[3].copy()
        for total, part in zip(added, own, strict=True):
            np.add(total[: self.plain], part.reshape(self.plain, -1), out=total[: self.plain])
        if self.strata > self.plain:
            cell, stratum, grown, begun = self.core.join(begun, copies, rays)
            for total, part in zip(added, grown, strict=True):
                # Each cell of a stratum comes once.
                total[stratum, cell] = total[stratum, cell] + part
        return added, begun

    def variance(self, cells: CellSums, rays: int, sources: CellSums) -> Array:
        """Variance of Σ w of each cell over the first `rays` rays, shape (cells,).

        A unit adds w to a cell, mostly 0. The n units of a stratum are independent of each other and alike, so that the
        variance of their sum is n times that of w: n/(n − 1) (Σ w² − (Σ w)²/n). NaN where light is that of one ray of a set:
        what another one would have done is unknown.

        Of units of unequal flux v, another sample would have another Σ v; but the flux of a set is stated. With p = Σ w/Σ v,
        what differs is Σ (w − p v), of the variance Σ w² − 2p Σ w v + p² Σ v² (that of a ratio, [Cochran1977]_), as far as a
        set was given out. Of units of equal flux that is the same.

        Parameters
        ----------
        cells : CellSums
            What each cell got.
        rays : int
            Given out.
        sources : CellSums
            What the sources, and all of them, emitted.

        Examples
        --------
        Of five rays, two of flux 3 go to the left, three of flux 1 to the right: what is known is the difference.

        >>> def sums(w, v):
        ...     return w.sum(0)[None], (w * w).sum(0)[None], (w > 0).sum(0)[None].astype(np.uint64), (w * v).sum(0)[None]
        >>> v = np.array([[3.0], [3.0], [1.0], [1.0], [1.0]])
        >>> cells, emitted = sums(v * [[1, 0], [1, 0], [0, 1], [0, 1], [0, 1]], v), sums(v * [1, 1], v)
        >>> Dealing((9.0,), ((0, 5),), 5).variance(cells, 5, emitted).round(9).tolist()
        [3.333333333, 3.333333333]
        """
        sum_, squares, count, products = cells
        units = self.done(rays).astype(np.float64)[:, None]
        variance = _cleared(squares - sum_ * sum_ / np.maximum(units, 1.0), squares, units)
        emitted, square = (row[:, -1:] for row in sources[:2])
        share = np.divide(sum_, emitted, out=np.zeros_like(sum_), where=emitted > 0.0)
        # What the parts are rounded by is a share of the largest of them.
        parts = np.maximum(squares, share * share * square)
        restated = _cleared(squares - 2.0 * share * products + share * share * square, parts, units)
        stated = self._stated(sources)[:, None]
        variance = stated * restated + (1.0 - stated) * variance
        # What sources draw are many rays; of a set of few the last factor matters.
        factor = np.divide(units, units - 1.0, out=np.full_like(units, np.nan), where=units > 1.0)
        factor[0] = 1.0
        total: Array = np.where(count > 0, variance * factor, 0.0).sum(axis=0)
        return total

    def emitted_variance(self, sources: CellSums) -> Array:
        """Variance of what each source has emitted, and of what all of them have, shape (strata, sources + 1).

        What a source emits is stated. But the flux of m of the n rays of a set differs by chance from m/n of it, by the
        variance (1 − m/n) (Σ v² − (Σ v)²/m) of a sample that is drawn without putting back [Cochran1977]_.

        Parameters
        ----------
        sources : CellSums
            What the sources, and all of them, emitted, shape (strata, sources + 1).

        Examples
        --------
        Two of four rays that bring 1 and 3:

        >>> sums = np.array([[4.0, 4.0]]), np.array([[10.0, 10.0]]), np.array([[2, 2]], np.uint64), np.array([[10.0, 10.0]])
        >>> Dealing((8.0,), ((0, 4),), 4).emitted_variance(sums).tolist()
        [[1.0, 1.0]]
        """
        _, squares, count, _ = sources
        given = count.astype(np.float64)
        length = np.array([held[1] if held is not None else 0 for held in self.sets], dtype=np.float64)
        left = np.zeros_like(squares)
        left[:, :-1] = np.maximum(1.0 - given[:, :-1] / np.maximum(length, 1.0), 0.0)
        left[:, :-1][:, length == 0.0] = 0.0
        for stratum, members in self._sets(1):
            left[stratum, -1] = max(1.0 - given[stratum, -1] / length[members[0]], 0.0)
        variance = left * _spread(sources)
        # Sources that draw their rays are independent of each other.
        variance[0, -1] = variance[0, :-1].sum()
        return variance

    def _stated(self, sources: CellSums) -> Array:
        """For each stratum the share of the variance of its flux which a total that is stated leaves none of, 0 to 1."""
        spread, left = _spread(sources)[:, -1], self.emitted_variance(sources)[:, -1]
        share = np.divide(left, spread, out=np.zeros_like(left), where=spread > 0.0)
        return np.asarray(1.0 - share.clip(0.0, 1.0))

    def copied(self) -> Iterator[tuple[int, list[int]]]:
        """Each stratum of copies, with the numbers of its sources."""
        return self._sets(self.plain)

    def _sets(self, first: int) -> Iterator[tuple[int, list[int]]]:
        """Each stratum from the first one on, with the numbers of its sources."""
        of_source = [stratum for stratum, _ in self.core.sources()]
        for stratum in range(first, self.strata):
            yield stratum, [i for i, held in enumerate(of_source) if held == stratum]

    def most_copies(self) -> float:
        """Largest number of copies of a ray, on average over its set; 1 if there are none."""
        units, counts = self.core.done(self.rays), self.given
        return max([1.0, *(sum(counts[i] for i in sources) / units[j] for j, sources in self.copied() if units[j])])


def _cleared(variance: Array, squares: Array, units: Array) -> Array:
    """Variances of sums over so many units, 0 where they could be nothing but rounding."""
    return np.asarray(np.where(variance > ROUNDED * units * squares, variance, 0.0))


def _spread(sources: CellSums) -> Array:
    """Σ v² − (Σ v)²/m of what sources emitted in m units."""
    sum_, squares, count, _ = sources
    units = np.maximum(count.astype(np.float64), 1.0)
    return _cleared(squares - sum_ * sum_ / units, squares, units)
