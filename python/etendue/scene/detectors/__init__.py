"""What a trace records. Detectors are transparent: light goes on as if they were not there.

Each kind is a file: how it is described, and what it measures. The registry is the list of the tests.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from etendue.description.families import Family
from etendue.scene.detectors.detector import Detection, Detector
from etendue.scene.detectors.illuminance import Illuminance
from etendue.scene.detectors.image import LightImage
from etendue.scene.detectors.intensity import FarField
from etendue.scene.detectors.rays import RayCollector
from etendue.scene.detectors.scatter import ScatterRecorder

DETECTORS: dict[str, type[Detector]] = {
    cls.model_fields["kind"].default: cls for cls in (RayCollector, Illuminance, FarField, LightImage, ScatterRecorder)
}
"""Every detector by its kind."""

AnyDetector = Annotated[Detector, Family(DETECTORS)]


def detection_from_dict(data: Mapping[str, Any]) -> Detection[Any]:
    """Rebuild a detection from `Detection.to_dict`.

    Examples
    --------
    >>> detection_from_dict({"kind": "rays", "name": "plane"})
    IncidentRays(name='plane')
    """
    rest = {key: tuple(value) if isinstance(value, list) else value for key, value in data.items() if key != "kind"}
    return DETECTORS[data["kind"]].DETECTION.from_dict(rest)


__all__ = [
    "DETECTORS",
    "AnyDetector",
    "Detector",
    "FarField",
    "Illuminance",
    "LightImage",
    "RayCollector",
    "ScatterRecorder",
    "detection_from_dict",
]
