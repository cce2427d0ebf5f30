"""What the work units of a trace add up to."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.spool import Spool
from etendue.scene.dealing import Array, CellSums, Counts, Dealing, Units
from etendue.tracing.scattered import Scattered

RECORD = np.dtype([("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8"), ("wavelength", "<f8")])
"""A ray as a ray collecting surface keeps it."""

ENTRIES = ("emitted", "escaped", "on_face", "in_medium", "terminated", "lost")
"""Rows of the ledger, each of flux and numbers of rays."""


@dataclasses.dataclass(frozen=True, eq=False)
class Collected:
    """The first `count` rays of a spool to which later work units append.

    Parameters
    ----------
    spool : Spool
        Of `RECORD`.
    count : int
    """

    spool: Spool
    count: int

    def array(self) -> npt.NDArray[Any]:
        """The rays, shape (count,)."""
        return self.spool.array(self.count)

    def then(self, rows: Array) -> Collected:
        """With the rays of the next work unit, shape (m, 8)."""
        records = np.ascontiguousarray(rows).view(RECORD).reshape(-1)
        # Else this trace went on from here before, and the same rays follow already.
        if len(self.spool) == self.count:
            self.spool.append(records)
        return Collected(self.spool, self.count + len(records))


@dataclasses.dataclass(frozen=True, eq=False)
class Sums:
    """Sums over the work units done, in order. They never change: `then` makes new ones.

    Parameters
    ----------
    batches, rays, segments : int
        Done.
    imbalance : float
        Largest of a batch.
    ledger : mapping
        (flux, rays) of each of `ENTRIES`.
    lost_at : tuple of int or None
        The face at which the first ray of each reason was lost.
    cells : tuple of CellSums
        Of each detector, shape (strata, cells) (`Dealing`); empty for those that have none.
    sources : CellSums
        Of the flux of each source, and of all of them at the end, shape (strata, sources + 1).
    open_units : tuple of Units
        Of which more copies may come, by detector and, at the end, by source.
    collected : tuple of Collected
        Of each detector; empty for those that collect no rays.
    scattered : tuple of Scattered
        Of each detector; empty for those that keep no scatter events.
    """

    batches: int
    rays: int
    segments: int
    imbalance: float
    ledger: Mapping[str, tuple[Array, Counts]]
    lost_at: tuple[int | None, ...]
    cells: tuple[CellSums, ...]
    sources: CellSums
    open_units: tuple[Units, ...]
    collected: tuple[Collected, ...]
    scattered: tuple[Scattered, ...]

    @classmethod
    def nothing(cls, unit: _core._WorkSums, dealing: Dealing, most: Sequence[int]) -> Sums:
        """Before the first work unit; each detector keeps so many scatter events at most."""
        empty = [dealing.nothing(tally) for tally in (*unit["tallies"], unit["emitted"])]
        cells, begun = [sums for sums, _ in empty], [units for _, units in empty]
        return cls(
            0,
            0,
            0,
            0.0,
            {name: (np.zeros_like(flux), np.zeros_like(rays)) for name, (flux, rays) in _entries(unit).items()},
            (None,) * len(unit["ledger"]["lost_at"]),
            tuple(cells[:-1]),
            cells[-1],
            tuple(begun),
            tuple(Collected(Spool(RECORD), 0) for _ in most),
            tuple(Scattered.nothing(n) for n in most),
        )

    def then(self, unit: _core._WorkSums, dealing: Dealing) -> Sums:
        """With those of the next work unit.

        Raises
        ------
        ArgumentError
            If it is not the next one.
        """
        first, last = unit["batches"]
        if first != self.batches:
            raise ArgumentError(
                f"batches {first} to {last} cannot follow the first {self.batches}: join work units in their order."
            )
        rays, entries = self.rays + unit["rays"], _entries(unit)
        before = zip((*self.cells, self.sources), self.open_units, (*unit["tallies"], unit["emitted"]), strict=True)
        joined = [dealing.added(sums, begun, tally, rays) for sums, begun, tally in before]
        cells = [sums for sums, _ in joined]
        return Sums(
            last,
            rays,
            self.segments + unit["ledger"]["segments"],
            max(self.imbalance, unit["imbalance"]),
            {name: (flux + entries[name][0], count + entries[name][1]) for name, (flux, count) in self.ledger.items()},
            tuple(a if a is not None else b for a, b in zip(self.lost_at, unit["ledger"]["lost_at"], strict=True)),
            tuple(cells[:-1]),
            cells[-1],
            tuple(begun for _, begun in joined),
            tuple(held.then(rows) for held, rows in zip(self.collected, unit["records"], strict=True)),
            tuple(held.then(*events) for held, events in zip(self.scattered, unit["events"], strict=True)),
        )


def _entries(unit: _core._WorkSums) -> dict[str, tuple[Array, Counts]]:
    ledger: Mapping[str, Any] = unit["ledger"]
    return {name: ledger[name] for name in ENTRIES}
