"""Light images: what an observer sees of diffuse surfaces, found forwards."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Self

from etendue.description.files import Files
from etendue.errors import UnknownNameError
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.measured import measured_pixel
from etendue.quantities.observer import Observer, Screen, observer_from_dict
from etendue.scene.detectors.detector import Detection, Detector, Record, Recorded, Setting, brightest_of
from etendue.scene.observers import ObserverKeys
from etendue.units import MM2_PER_M2


@dataclasses.dataclass(frozen=True)
class DiffuseLuminance(Detection[LuminanceMap]):
    """The luminance of diffuse surfaces as an observer sees them: every scatter is connected to the eye.

    Parameters
    ----------
    observer : Observer
    screen : Screen
    """

    KIND = "image"
    observer: Observer
    screen: Screen

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return self.screen.columns * self.screen.rows

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of `to_dict`."""
        return cls(data["name"], observer_from_dict(data["observer"]), Screen(**data["screen"]))

    def read(self, recorded: Recorded) -> LuminanceMap:
        """What the core sums is luminance in flux unit/(mm² sr)."""
        counted, origin = recorded.counted, recorded.origin
        shape = self.screen.shape
        notes = ["light that reaches the eye from a diffuse surface directly; sources and mirrors are not seen in it"]
        dark = int((counted.rays == 0).sum())
        if dark:
            notes.append(
                f"{dark:,} of {counted.rays.size:,} pixels saw no scatter: their luminance is 0, its error unknown"
            )
        return LuminanceMap(
            counted.flux.reshape(shape) * MM2_PER_M2,
            counted.error.reshape(shape) * MM2_PER_M2,
            counted.rays.reshape(shape),
            self.observer,
            self.screen,
            origin.flux_unit,
            origin.provenance.then(f"light image {self.name!r}"),
            (*notes, *origin.notes),
        )

    def summary(self, quantity: LuminanceMap) -> str:
        """The brightest pixel, without what chance lifts it by."""
        found = brightest_of(quantity)
        largest, error, apart = (found[key] for key in ("maximum", "maximum_error", "maximum_apart"))
        return f"maximum {measured_pixel(largest, error, apart, quantity.unit)}"

    def figures(self, quantity: LuminanceMap) -> dict[str, Any]:
        """The brightest pixel, and how many there are."""
        return brightest_of(quantity)


class LightImage(Detector):
    """A luminance image made forwards: every diffuse scatter is connected to an observer's eye.

    Parameters
    ----------
    observer : str
        Name of one of the scene's observers.

    Examples
    --------
    >>> LightImage(observer="front").kind
    'image'
    """

    DETECTION = DiffuseLuminance

    kind: Literal["image"] = "image"
    observer: str

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The observer's view of its screen."""
        if self.observer not in observers:
            raise UnknownNameError("observer", self.observer, observers)
        keys = observers[self.observer]
        return {"kind": "image", "view": keys.screen.screen().core_view(keys.observer())}

    def detection(self, name: str, setting: Setting) -> DiffuseLuminance:
        """The observer with his screen."""
        seen = setting.observers[self.observer]
        return DiffuseLuminance(name, seen.observer(), seen.screen.screen())
