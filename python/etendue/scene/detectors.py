"""What a trace records. Detectors are transparent: light goes on as if they were not there."""

from __future__ import annotations

import abc
import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from annotated_types import Ge, Gt, Le
from pydantic import model_validator

from etendue.errors import UnknownNameError
from etendue.scene.description import Description
from etendue.scene.families import Family
from etendue.scene.files import Files
from etendue.scene.observers import ObserverKeys
from etendue.scene.placement import Placement
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.shape import WHOLE, Shape, Trim
from etendue.scene.values import AsCount, AsNumber, AsRow, Finite, Length, Pixels

Record = dict[str, Any]
MOST_STEPS = 18_000
"""Steps of γ over 180°: a hundredth of a degree."""

MOST_SCATTERS = 1 << 36
"""Scatters that can be asked for: eight terabytes of them."""


class Detector(Description, abc.ABC):
    """Something that records light.

    Parameters
    ----------
    name : str
        For results and messages.
    """

    name: str = ""

    @abc.abstractmethod
    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:
        """The detector as the core takes it; `observers` are those of the scene by name, `faces` the names of its faces.

        Raises
        ------
        ArgumentError, UnknownNameError, FormatError, OSError
            If it does not fit.
        """


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

    kind: Literal["rays"] = "rays"
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The trimmed shape and its place."""
        sheet = self.shape.sheet(self.trim, files)
        return {"kind": "rays", "shape": sheet.shape, "frame": self.frame().record(), "trims": sheet.trims}


class Illuminance(Detector, Placement):
    """An illuminance meter: a grid on a rectangle, for light that arrives on the side of its +z.

    Parameters
    ----------
    width, height : number
        Along its x and y [mm], > 0.
    columns, rows : int
        Cells along x and y.
    at, toward, axis, angle, rotation, spin
        Where it stands.

    Examples
    --------
    >>> floor = Illuminance(width=1000, height=500, columns=20, rows=10)
    >>> floor.record(Files(), {})["columns"]
    20
    """

    kind: Literal["illuminance"] = "illuminance"
    width: Length
    height: Length
    columns: Pixels
    rows: Pixels

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The grid and its place."""
        return {
            "kind": "illuminance",
            "frame": self.frame().record(),
            "width": self.width,
            "height": self.height,
            "columns": self.columns,
            "rows": self.rows,
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

    kind: Literal["image"] = "image"
    observer: str

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The observer's view of its screen."""
        if self.observer not in observers:
            raise UnknownNameError("observer", self.observer, observers)
        keys = observers[self.observer]
        return {"kind": "image", "view": keys.screen.screen().core_view(keys.observer())}


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


DETECTORS: dict[str, type[Detector]] = {
    cls.model_fields["kind"].default: cls for cls in (RayCollector, Illuminance, FarField, LightImage, ScatterRecorder)
}
"""Every detector by its kind."""

AnyDetector = Annotated[Detector, Family(DETECTORS)]
