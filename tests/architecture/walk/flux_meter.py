"""Meters of the flux that passes a surface."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.quantities.measured import measured
from etendue.scene.detectors.detector import Detection, Detector, Origin, Record, Recorded, Setting
from etendue.scene.observers import ObserverKeys
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.shape import WHOLE, Shape, Trim


@dataclasses.dataclass(frozen=True)
class PassedFlux:
    """Flux that passed a surface.

    Parameters
    ----------
    value : float
        [lm or W].
    standard_error : float
    origin : Origin

    Examples
    --------
    >>> from etendue.quantities.provenance import Provenance
    >>> PassedFlux(12.5, 0.1, Origin("lm", Provenance(), ())).notes
    ()
    """

    value: float
    standard_error: float
    origin: Origin

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know."""
        return self.origin.notes


@dataclasses.dataclass(frozen=True)
class SurfaceFlux(Detection[PassedFlux]):
    """The flux that passes a surface.

    Examples
    --------
    >>> SurfaceFlux("dome").cells
    1
    """

    KIND = "flux"
    HAS_FACE = True

    @property
    def cells(self) -> int:
        """One for all light."""
        return 1

    def read(self, recorded: Recorded) -> PassedFlux:
        """The one cell."""
        counted = recorded.counted
        return PassedFlux(float(counted.flux[0]), float(counted.error[0]), recorded.origin)

    def summary(self, quantity: PassedFlux) -> str:
        """With its error."""
        return measured(quantity.value, quantity.standard_error, quantity.origin.flux_unit)

    def figures(self, quantity: PassedFlux) -> dict[str, Any]:
        """With its error."""
        return {"flux": quantity.value, "flux_error": quantity.standard_error}


class FluxMeter(Detector, Placement):
    """The flux of all light that passes a surface, from either side.

    Parameters
    ----------
    shape : Shape
    trim : Trim
    at, toward, axis, angle, rotation, spin
        Where it stands.

    Examples
    --------
    >>> FluxMeter(shape={"kind": "sphere", "radius": 8}).record(Files(), {})["kind"]
    'flux'
    """

    DETECTION = SurfaceFlux

    kind: Literal["flux"] = "flux"
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The trimmed shape and its place."""
        sheet = self.shape.sheet(self.trim, files)
        return {"kind": "flux", "shape": sheet.shape, "frame": self.frame().record(), "trims": sheet.trims}

    def detection(self, name: str, setting: Setting) -> SurfaceFlux:  # noqa: ARG002
        """Its name says all."""
        return SurfaceFlux(name)
