"""The far field."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from annotated_types import Gt, Le
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import AsNumber, Finite, Pixels
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import Nodes
from etendue.quantities.measured import peak_line
from etendue.scene.detectors.detector import Detection, Detector, Record, Recorded, Setting
from etendue.scene.observers import ObserverKeys

MOST_STEPS = 18_000
"""Steps of γ over 180°: a hundredth of a degree."""


@dataclasses.dataclass(frozen=True)
class FarFieldIntensity(Detection[Intensity]):
    """The intensity of what leaves the scene.

    Parameters
    ----------
    nodes : Nodes
        What rays are shared by.
    told : tuple of str
        What there is to say about them.
    """

    KIND = "intensity"
    HAS_WHOLE = True
    nodes: Nodes
    told: tuple[str, ...] = ()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of `to_dict`."""
        return cls(data["name"], Nodes.from_dict(data["nodes"]), tuple(data["told"]))

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in: one for each node, and the last one for all rays together."""
        return len(self.nodes)

    def read(self, recorded: Recorded) -> Intensity:
        """Shares of each node over the solid angle of its hat."""
        counted, origin = recorded.counted, recorded.origin
        notes = (*self.told, self.nodes.describe(), *origin.notes)
        provenance = origin.provenance.then(f"far-field intensity by {self.name!r}")
        return self.nodes.intensity(counted.flux, counted.error, origin.flux_unit, provenance, notes)

    def summary(self, quantity: Intensity) -> str:
        """The peak."""
        return peak_line(quantity)

    def figures(self, quantity: Intensity) -> dict[str, Any]:
        """The peak, and how fine the table is."""
        c, gamma = quantity.peak
        return {
            "maximum": quantity.maximum,
            "maximum_error": quantity.maximum_error,
            "peak_intensity": quantity.peak_intensity,
            "peak_error": quantity.peak_error,
            "maximum_at": {"c": c, "gamma": gamma},
            "unit": quantity.unit,
            "planes": quantity.c.size,
            "gammas": quantity.gamma.size,
        }


class FarField(Detector):
    """A goniophotometer infinitely far away: the intensity of the light that leaves the scene.

    Parameters
    ----------
    c_planes : int, optional
        C planes over 360°. None: chosen from the light, for each γ.
    gamma_step : number, optional
        [°] Between the angles γ, from 0° to 180°, which it divides. None: chosen from the light.

    Examples
    --------
    >>> FarField(c_planes=24, gamma_step=5).record(Files(), {})
    {'kind': 'intensity', 'c_planes': 24, 'gamma_step': 5.0}
    """

    DETECTION = FarFieldIntensity

    kind: Literal["intensity"] = "intensity"
    c_planes: Pixels | None = None
    gamma_step: Annotated[float, Finite, Gt(0.0), Le(90.0), AsNumber] | None = None

    @model_validator(mode="after")
    def _divides(self) -> Self:
        if self.gamma_step is None:
            return self
        steps = round(180.0 / max(self.gamma_step, 1e-9))
        if steps > MOST_STEPS or not math.isclose(steps * self.gamma_step, 180.0, rel_tol=1e-9):
            raise ValueError(
                f"'gamma_step' is {self.gamma_step:g}°, which does not divide 180° in up to {MOST_STEPS} steps"
            )
        return self

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The steps that are asked for; the nodes are chosen when light is traced."""
        return {"kind": "intensity", "c_planes": self.c_planes, "gamma_step": self.gamma_step}

    def detection(self, name: str, setting: Setting) -> FarFieldIntensity:
        """The nodes that were chosen."""
        return FarFieldIntensity(name, *next(setting.choices))
