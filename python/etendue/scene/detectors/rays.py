"""Ray collecting surfaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.scene.detectors.detector import Detection, Detector, Record, Recorded, Setting
from etendue.scene.observers import ObserverKeys
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.shape import WHOLE, Shape, Trim


@dataclasses.dataclass(frozen=True)
class IncidentRays(Detection[RaySet]):
    """The rays that cross a ray collecting surface."""

    KIND = "rays"
    HAS_FACE = True
    HAS_WHOLE = True

    @property
    def cells(self) -> int:
        """One, for all rays together."""
        return 1

    def read(self, recorded: Recorded) -> RaySet:
        """The rays, with a wavelength each unless all have the same."""
        records, origin = recorded.rays, recorded.origin
        meaning = RaySetMeaning(
            flux_unit=origin.flux_unit,
            stored_flux_scale=recorded.scale,
            provenance=origin.provenance.then(f"rays incident on {self.name!r}"),
            copies=recorded.dealing.most_copies(),
        )
        wavelength = records["wavelength"]
        if len(records) and (wavelength == wavelength[0]).all():
            names = [name for name in records.dtype.names or () if name != "wavelength"]
            # The same records, of which one field is passed over.
            records = records[names]
            meaning = dataclasses.replace(meaning, single_wavelength=float(wavelength[0]))
        return RaySet.from_records(records, meaning)

    def summary(self, quantity: RaySet) -> str:
        """How many there are."""
        return f"{len(quantity):,} rays"

    def figures(self, quantity: RaySet) -> dict[str, Any]:
        """How many there are."""
        return {"rays": len(quantity)}


class RayCollector(Detector, Placement):
    """A ray collecting surface: every ray that passes it, with place, direction and flux (thesis section 2.2.1).

    Parameters
    ----------
    shape : Shape
    trim : Trim
    at, toward, axis, angle, rotation, spin
        Where it stands.

    Examples
    --------
    >>> plane = RayCollector(shape={"kind": "rectangle", "width": 70, "height": 70}, at=[0, 0, 30])
    >>> plane.record(Files(), {})["kind"]
    'rays'
    """

    DETECTION = IncidentRays

    kind: Literal["rays"] = "rays"
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The trimmed shape and its place."""
        sheet = self.shape.sheet(self.trim, files)
        return {"kind": "rays", "shape": sheet.shape, "frame": self.frame().record(), "trims": sheet.trims}

    def detection(self, name: str, setting: Setting) -> IncidentRays:  # noqa: ARG002
        """Its name says all."""
        return IncidentRays(name)
