"""Recorders of scatter events."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le

from etendue.description.files import Files
from etendue.description.values import AsCount, AsRow
from etendue.errors import UnknownNameError
from etendue.scene.detectors.detector import Detection, Detector, Record, Recorded, Setting
from etendue.scene.observers import ObserverKeys

MOST_SCATTERS = 1 << 36
"""Scatters that can be asked for: eight terabytes of them."""


@dataclasses.dataclass(frozen=True)
class ScatteredLight(Detection[Any]):
    """Where light was scattered diffusely.

    Parameters
    ----------
    most : int
        How many scatters are kept at most.
    surfaces : tuple of str
        Whose; empty: of all.
    geometry : str
        Fingerprint of what stands in the scene.
    """

    KIND = "scatter"
    most: int
    surfaces: tuple[str, ...]
    geometry: str

    @property
    def most_events(self) -> int:
        """Number of scatter events that are kept at most."""
        return self.most

    def read(self, recorded: Recorded) -> Any:
        """The events, as `ScatterEvents`."""
        return recorded.scatter_events(self.name, self.most, self.surfaces, self.geometry)

    def summary(self, quantity: Any) -> str:
        """How many there are, of how many rays."""
        share = "" if quantity.share == 1.0 else f", of 1 ray in {round(1.0 / quantity.share):,}"
        return f"{len(quantity):,} scatter events{share}"

    def figures(self, quantity: Any) -> dict[str, Any]:
        """How many there are, of which share of the rays."""
        return {"events": len(quantity), "share_of_rays": quantity.share}


class ScatterRecorder(Detector):
    """Where light is scattered diffusely: kept, so that it can be looked at later from anywhere.

    Parameters
    ----------
    surfaces : sequence of str
        Names of surfaces and solids whose scatters are kept; those of all if empty. ``"lens.front"`` is one face of a solid.
    most : int
        How many are kept at most, 120 bytes each. Of more, those of every second ray are dropped, again if needed, and
        the others stand for all: what is estimated from them keeps its mean.

    Examples
    --------
    >>> ScatterRecorder(surfaces=["wall"], most=1000).record(Files(), {}, ["lens.front", "wall"])
    {'kind': 'scatter', 'most': 1000, 'faces': [1]}
    """

    DETECTION = ScatteredLight

    kind: Literal["scatter"] = "scatter"
    surfaces: Annotated[tuple[str, ...], AsRow] = ()
    most: Annotated[int, Ge(1), Le(MOST_SCATTERS), AsCount] = 10**7

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The numbers of the faces, if they are not all."""
        if not self.surfaces:
            return {"kind": "scatter", "most": self.most}
        chosen: set[int] = set()
        for name in self.surfaces:
            found = [i for i, face in enumerate(faces) if face == name or face.startswith(f"{name}.")]
            if not found:
                raise UnknownNameError("surface", name, {*faces, *(face.rpartition(".")[0] or face for face in faces)})
            chosen.update(found)
        return {"kind": "scatter", "most": self.most, "faces": sorted(chosen)}

    def detection(self, name: str, setting: Setting) -> ScatteredLight:
        """What is kept, of which geometry."""
        return ScatteredLight(name, self.most, self.surfaces, setting.geometry())
