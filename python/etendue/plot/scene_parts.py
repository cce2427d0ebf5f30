"""What sections of a scene show, part by part."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.quantities.bsdf_directions import direction
from etendue.tracing.section import Section
from etendue.tracing.sections import Window

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

FINISH_KINDS = ("interface", "mirror", "diffuse", "transparent", "absorber")
"""What a finish mostly does; later ones are drawn over earlier ones."""


@dataclasses.dataclass(frozen=True, eq=False)
class Part:
    """A solid, a surface, a source or a detector as a section shows it.

    Parameters
    ----------
    name : str
    kind : str
        Of a face its finish: one of `FINISH_KINDS`; else ``source``, ``detector``.
    curves : list of arrays, shape (k, 2)
        [mm]
    rings : list of arrays, shape (k, 2)
        Of a solid: the borders of what it fills.
    medium : int or None
        Of a solid: its number.
    """

    name: str
    kind: str
    curves: list[Array]
    rings: list[Array] = dataclasses.field(default_factory=list)
    medium: int | None = None


@dataclasses.dataclass(frozen=True, eq=False)
class Glow:
    """A source: where its light starts and where it goes [mm], projected onto a section.

    Parameters
    ----------
    name : str
    curves : list of arrays, shape (k, 2)
        Where the section cuts a luminous surface.
    start, direction : arrays, shape (n, 2)
        Of rays; directions are shorter where they point out of the section.
    near : bool
        Whether the section passes through it.
    """

    name: str
    curves: list[Array]
    start: Array
    direction: Array
    near: bool


@dataclasses.dataclass(frozen=True, eq=False)
class View:
    """One section with everything in it; lengths in mm.

    Parameters
    ----------
    section : Section
    window : left, right, bottom, top
    faces : list of Part
        One for each face that is cut.
    solids : list of Part
        One for each solid that is cut.
    sources : list of Glow
    detectors : list of Part
    trails : list of arrays, shape (k, 3)
    """

    section: Section
    window: Window
    faces: list[Part]
    solids: list[Part]
    sources: list[Glow]
    detectors: list[Part]
    trails: list[Array]


def finish_kind(finish: Record) -> str:
    """What a finish mostly does, as one of `FINISH_KINDS`: by the largest of the shares that its record names.

    Examples
    --------
    >>> from etendue.scene.finishes import Lambertian
    >>> from etendue.description.files import Files
    >>> finish_kind(Lambertian(reflectance=0.9).record(Files()))
    'diffuse'
    """
    if finish["kind"] == "fresnel":
        return "interface"
    if finish["kind"] != "scatter":
        return _kind_of_lobes(finish)
    does = {
        "specular_reflectance": "mirror",
        "specular_transmittance": "transparent",
        "diffuse_reflectance": "diffuse",
        "diffuse_transmittance": "diffuse",
    }
    most = {part: float(np.max(finish[part]["values"])) for part in does if part in finish}
    part = max(most, key=lambda p: most[p])
    return does[part] if most[part] > 0.0 else "absorber"


def _kind_of_lobes(finish: Record) -> str:
    """The same for finishes that are no tables of shares: by what becomes of light at some angles."""
    incident = np.concatenate([direction([0.0, 60.0], 0.0), direction([0.0, 60.0], 0.0, behind=True)])
    shares = _core.Bsdf(finish).shares(incident, (555.0, 1.0, 1.0)).max(axis=0)
    kinds = ("mirror", "transparent", "diffuse", "diffuse")
    return kinds[int(shares.argmax())] if shares.max() > 0.0 else "absorber"


def within(parts: list[Part], window: Window) -> list[Part]:
    """The parts that reach into a window.

    Examples
    --------
    >>> line = Part("line", "mirror", [np.array([[5.0, 0.0], [6.0, 0.0]])])
    >>> within([line], (0.0, 4.0, -1.0, 1.0))
    []
    """
    left, right, bottom, top = window
    inside = []
    for part in parts:
        for curve in part.curves:
            (low_u, low_v), (high_u, high_v) = curve.min(axis=0), curve.max(axis=0)
            if low_u <= right and high_u >= left and low_v <= top and high_v >= bottom:
                inside.append(part)
                break
    return inside
