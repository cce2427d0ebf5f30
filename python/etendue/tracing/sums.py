"""What the rounds of a trace add up to."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.quantities.spool import Spool
from etendue.scene.dealing import Array, CellSums, Counts, added
from etendue.tracing.scattered import Scattered

Open = tuple[npt.NDArray[np.uint32], Counts, Array]

RECORD = np.dtype([("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8"), ("wavelength", "<f8")])
"""A ray as a ray collecting surface keeps it."""

ENTRIES = ("emitted", "escaped", "on_face", "in_medium", "terminated", "lost")
"""Rows of the ledger, each of flux and numbers of rays."""


@dataclasses.dataclass(frozen=True, eq=False)
class Collected:
    """The first `count` rays of a spool to which later rounds append.

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
        """With the rays of the next round, shape (m, 8)."""
        records = np.ascontiguousarray(rows).view(RECORD).reshape(-1)
        # Else this trace went on from here before, and the same rays follow already.
        if len(self.spool) == self.count:
            self.spool.append(records)
        return Collected(self.spool, self.count + len(records))


@dataclasses.dataclass(frozen=True, eq=False)
class Sums:
    """Sums over the rounds done, in order. They never change: `then` makes new ones.

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
    cells : tuple of (Σ w, Σ w², units)
        Of each detector, shape (strata, cells) (`Dealing`); empty for those that have none.
    births : (Σ w, Σ w², units)
        Of the flux of each source, and of all of them at the end, shape (strata, sources + 1).
    open_units : tuple of (cell, unit, Σ w)
        Of units of which more copies may come, by detector and, at the end, by source.
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
    births: CellSums
    open_units: tuple[Open, ...]
    collected: tuple[Collected, ...]
    scattered: tuple[Scattered, ...]

    @classmethod
    def first(cls, tallies: _core._Tallies, batches: int, most: tuple[int, ...]) -> Sums:
        """Those of the first round; each detector keeps so many scatter events at most."""
        return cls(
            batches,
            tallies["rays"],
            tallies["ledger"]["segments"],
            tallies["imbalance"],
            _entries(tallies),
            tuple(tallies["ledger"]["lost_at"]),
            tuple(tallies["cells"]),
            tallies["births"],
            tuple(tallies["open_units"]),
            tuple(Collected(Spool(RECORD), 0).then(rows) for rows in tallies["records"]),
            tuple(Scattered.nothing(n).then(*events) for n, events in zip(most, tallies["events"], strict=True)),
        )

    def then(self, tallies: _core._Tallies, batches: int) -> Sums:
        """With those of the next round, after which so many batches are done."""
        entries = _entries(tallies)
        return Sums(
            batches,
            self.rays + tallies["rays"],
            self.segments + tallies["ledger"]["segments"],
            max(self.imbalance, tallies["imbalance"]),
            {name: (flux + entries[name][0], rays + entries[name][1]) for name, (flux, rays) in self.ledger.items()},
            tuple(a if a is not None else b for a, b in zip(self.lost_at, tallies["ledger"]["lost_at"], strict=True)),
            tuple(added(a, b) for a, b in zip(self.cells, tallies["cells"], strict=True)),
            added(self.births, tallies["births"]),
            tuple(tallies["open_units"]),
            tuple(held.then(rows) for held, rows in zip(self.collected, tallies["records"], strict=True)),
            tuple(held.then(*events) for held, events in zip(self.scattered, tallies["events"], strict=True)),
        )


def _entries(tallies: _core._Tallies) -> dict[str, tuple[Array, Counts]]:
    ledger: Mapping[str, Any] = tallies["ledger"]
    return {name: ledger[name] for name in ENTRIES}
