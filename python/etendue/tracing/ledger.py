"""The flux ledger of a trace: every ray has one fate, and all fates together carry what was emitted."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any

from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.printable import printable
from etendue.units import FluxUnit

CLOSED = 1e-12
"""Share of the emitted flux that rounding may let the fates of a batch differ from it."""

NOTEWORTHY = 1e-9
"""Share of the emitted flux above which lost rays are told."""


LONG = 1000
"""Surfaces: what met fewer may have been on its way out."""


class TraceWarning(UserWarning):
    """A trace went through, but something in the scene is not as it should be."""


@dataclasses.dataclass(frozen=True)
class Entry:
    """Flux [flux unit of the ledger] and number of rays."""

    flux: float = 0.0
    rays: int = 0


@dataclasses.dataclass(frozen=True)
class Loss:
    """Rays that were lost for one reason.

    Parameters
    ----------
    reason : str
    place : str
        The face at which the first of them was lost; empty if it was none.
    flux : float
    rays : int
    """

    reason: str
    place: str
    flux: float
    rays: int

    def __str__(self) -> str:
        return f"{self.reason}, first at {self.place}" if self.place else self.reason


@dataclasses.dataclass(frozen=True)
class Ledger:
    """What became of all the light.

    Parameters
    ----------
    flux_unit : {"lm", "W"}
    emitted : mapping of str to Entry
        By source.
    escaped : Entry
        What left the scene.
    by_surface, by_medium : mapping of str to Entry
        What was absorbed, by the name of the face or of the medium.
    terminated : Entry
        What had met so many surfaces that it was given up.
    lost : tuple of Loss
        What could not be followed, by reason.
    imbalance : float
        Of a batch, the largest: difference of emitted flux and flux of all fates, over the emitted.

    Examples
    --------
    >>> ledger = Ledger("lm", {"led": Entry(10.0, 4)}, Entry(7.5, 3), {"wall": Entry(2.5, 1)}, {})
    >>> ledger.closes, ledger.absorbed.flux
    (True, 2.5)
    >>> print(ledger.table())
    emitted         10 lm  100.00%         4 rays
      led           10 lm  100.00%         4 rays
    escaped        7.5 lm   75.00%         3 rays
    absorbed       2.5 lm   25.00%         1 rays
      wall         2.5 lm   25.00%         1 rays
    """

    flux_unit: FluxUnit
    emitted: Mapping[str, Entry]
    escaped: Entry
    by_surface: Mapping[str, Entry]
    by_medium: Mapping[str, Entry]
    terminated: Entry = dataclasses.field(default_factory=Entry)
    lost: tuple[Loss, ...] = ()
    imbalance: float = 0.0

    @property
    def total(self) -> Entry:
        """What all sources emitted."""
        return _sum(self.emitted.values())

    @property
    def absorbed(self) -> Entry:
        """What surfaces and media absorbed."""
        return _sum([*self.by_surface.values(), *self.by_medium.values()])

    @property
    def lost_share(self) -> float:
        """Share of the emitted flux that was lost."""
        total = self.total.flux
        return math.fsum(loss.flux for loss in self.lost) / total if total > 0.0 else 0.0

    @property
    def closes(self) -> bool:
        """Whether every ray has one fate, and all fates carry the emitted flux, in every batch and in all."""
        fates = [self.escaped, self.absorbed, self.terminated, *(Entry(loss.flux, loss.rays) for loss in self.lost)]
        total, sum_ = self.total, _sum(fates)
        together = total.rays == sum_.rays and abs(total.flux - sum_.flux) <= CLOSED * total.flux
        return together and self.imbalance <= CLOSED

    def notes(self, most_events: int = LONG) -> tuple[str, ...]:
        """What the user should know of a trace in which rays were given up after so many surfaces."""
        total, notes = self.total.flux, []
        if self.lost_share > NOTEWORTHY:
            reasons = "; ".join(f"{loss.flux / total:.2g} by {loss}" for loss in self.lost)
            notes.append(f"{self.lost_share:.2g} of the flux was lost: {reasons}")
        if total > 0.0 and self.terminated.flux > NOTEWORTHY * total:
            share = self.terminated.flux / total
            notes.append(
                f"{share:.2g} of the flux met more surfaces than allowed and was given up: {self._endless(most_events)}"
            )
        if not self.closes:
            notes.append("the ledger does not close; this is a defect of étendue, please report it")
        return tuple(notes)

    def _endless(self, most_events: int) -> str:
        """Why rays meet so many surfaces, and what to do."""
        if most_events < LONG:
            return (
                f"raise most_events from {most_events:,}; what is still given up at {LONG:,} is trapped, in a clear solid "
                "without absorption or between surfaces with a reflectance of 1"
            )
        # The first medium is that of the surroundings, where no light goes to and fro by itself.
        clear = [repr(name) for name, absorbed in list(self.by_medium.items())[1:] if not absorbed.rays]
        if not clear:
            return "raise most_events, or give surfaces that reflect all light a reflectance below 1"
        return (
            f"it is probably trapped by total reflection in a clear solid, as {' and '.join(clear)} absorbed nothing; give "
            "the medium its absorption, or save time by a smaller most_events, which changes nothing for trapped light"
        )

    def rows(self) -> Iterator[tuple[int, str, Entry]]:
        """Depth, name and entry of every line of the account that carries light."""
        yield 0, "emitted", self.total
        yield from ((1, name, entry) for name, entry in self.emitted.items())
        yield 0, "escaped", self.escaped
        yield 0, "absorbed", self.absorbed
        for family in (self.by_surface, self.by_medium):
            yield from ((1, name, entry) for name, entry in family.items() if entry.rays)
        if self.terminated.rays:
            yield 0, "terminated", self.terminated
        if self.lost:
            yield 0, "lost", _sum([Entry(loss.flux, loss.rays) for loss in self.lost])
            yield from ((1, str(loss), Entry(loss.flux, loss.rays)) for loss in self.lost)

    def table(self) -> str:
        """The account for people, one line for each row."""
        total = self.total.flux or 1.0
        rows = [("  " * depth + printable(name), entry) for depth, name, entry in self.rows()]
        width = max(len(name) for name, _ in rows)
        return "\n".join(
            f"{name:<{width}}  {rounded(entry.flux):>8} {self.flux_unit}  {entry.flux / total:>7.2%}  {entry.rays:>8,} rays"
            for name, entry in rows
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "flux_unit": self.flux_unit,
            "emitted": {name: dataclasses.asdict(entry) for name, entry in self.emitted.items()},
            "escaped": dataclasses.asdict(self.escaped),
            "by_surface": {name: dataclasses.asdict(entry) for name, entry in self.by_surface.items()},
            "by_medium": {name: dataclasses.asdict(entry) for name, entry in self.by_medium.items()},
            "terminated": dataclasses.asdict(self.terminated),
            "lost": [dataclasses.asdict(loss) for loss in self.lost],
            "imbalance": self.imbalance,
            "closes": self.closes,
        }


def _sum(entries: Any) -> Entry:
    entries = list(entries)
    return Entry(math.fsum(entry.flux for entry in entries), sum(entry.rays for entry in entries))
