"""Scatter events that the work units of a trace add up to, thinned to a number of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.quantities.spool import Spool
from etendue.scene.scatter_events import EVENT

Rows = npt.NDArray[Any]

STRETCH = 1 << 17
"""Events that are gone through at a time: 16 MB."""

DEPTH = np.uint64(56)
"""The bits of `ray` above which the depth stands."""


@dataclasses.dataclass(frozen=True, eq=False)
class Scattered:
    """The first `count` events of a spool to which later work units append.

    Parameters
    ----------
    spool : Spool
        Of `EVENT`.
    count : int
    level : int
        How often they were thinned: only rays of this depth or more are left, one of 2ᵏ.
    most : int
        How many are kept at most.
    """

    spool: Spool
    count: int
    level: int
    most: int

    @classmethod
    def nothing(cls, most: int) -> Scattered:
        """Before the first work unit."""
        return cls(Spool(EVENT), 0, 0, most)

    def array(self) -> Rows:
        """The events, shape (count,)."""
        return self.spool.array(self.count)

    def then(self, words: npt.NDArray[np.uint64], level: int) -> Scattered:
        """With the events of the next work unit, shape (m, 15), which were thinned to `level` already."""
        new = np.ascontiguousarray(words).view(EVENT).reshape(-1)
        level = max(level, self.level)
        if level > self.level or self.count + len(new) > self.most:
            depths = _depths(new)
            for old in self.stretches():
                depths += _depths(old)
            left = depths[::-1].cumsum()[::-1]
            while left[level] > self.most and level < _core.deepest():
                level += 1
        new = _deep(new, level)
        if level > self.level:
            # In a spool of its own: results of earlier work units keep theirs.
            thinned = Scattered(Spool(EVENT), 0, level, self.most)
            for old in self.stretches():
                thinned.spool.append(_deep(old, level))
            thinned.spool.append(new)
            return dataclasses.replace(thinned, count=len(thinned.spool))
        # Else this trace went on from here before, and the same events follow already.
        if len(self.spool) == self.count:
            self.spool.append(new)
        return dataclasses.replace(self, count=self.count + len(new))

    def stretches(self) -> Iterator[Rows]:
        """The events, some at a time."""
        rows = self.array()
        for start in range(0, len(rows), STRETCH):
            yield rows[start : start + STRETCH]


def _depths(rows: Rows) -> npt.NDArray[np.int64]:
    """How many events have which depth."""
    return np.bincount((rows["ray"] >> DEPTH).astype(np.int64), minlength=_core.deepest() + 1)


def _deep(rows: Rows, level: int) -> Rows:
    """The events of rays of this depth or more."""
    return rows if level == 0 else rows[rows["ray"] >> DEPTH >= level]
