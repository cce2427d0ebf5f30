"""What a trace recorded for one of its detectors, as the detector asks for it."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Any

import numpy.typing as npt

from etendue.scene.dealing import Dealing
from etendue.scene.detectors.detector import Counted, Origin
from etendue.scene.scatter_events import ScatterEvents
from etendue.tracing.plan import Plan
from etendue.tracing.sums import Sums


@dataclasses.dataclass(frozen=True, eq=False)
class DetectorSums:
    """The part of the sums of a trace that belongs to a detector.

    Parameters
    ----------
    plan : Plan
    sums : Sums
    number : int
        Of the detector.
    origin : Origin
        What all quantities of the trace have in common.
    """

    plan: Plan
    sums: Sums
    number: int
    origin: Origin

    @property
    def dealing(self) -> Dealing:
        """Which source gave out which ray."""
        return self.plan.dealing

    @property
    def scale(self) -> float:
        """Rays asked for over rays done."""
        return self.plan.rays / self.sums.rays

    @cached_property
    def counted(self) -> Counted:
        """The cells."""
        sums, detection = self.sums, self.plan.detections[self.number]
        return detection.counted(sums.cells[self.number], sums.sources, self.dealing, sums.rays)

    @property
    def rays(self) -> npt.NDArray[Any]:
        """The rays that were kept, with the flux that they were traced with, shape (n,)."""
        return self.sums.collected[self.number].array()

    def scatter_events(self, name: str, most: int, surfaces: tuple[str, ...], geometry: str) -> ScatterEvents:
        """The events of the rays done, which stand for all of them."""
        held = self.sums.scattered[self.number]
        share = 0.5**held.level
        notes = [] if share == 1.0 else [f"the scatters of 1 ray in {2**held.level:,} were kept, {most:,} at most"]
        if surfaces:
            notes.append(f"scatters on {', '.join(surfaces)} only")
        return ScatterEvents(
            name,
            held.array(),
            self.scale / share,
            share,
            self.sums.rays,
            self.dealing,
            self.sums.sources,
            self.plan.face_names,
            surfaces,
            geometry,
            self.plan.scene,
            self.origin.flux_unit,
            self.origin.provenance.then(f"scatter events of {name!r}"),
            (*notes, *self.origin.notes),
        )
