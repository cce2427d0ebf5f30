"""Tubes that shine all around."""

from __future__ import annotations

from typing import Literal

from etendue.description.files import Files
from etendue.description.values import Length, Positive
from etendue.scene.shapes.round import Cylinder
from etendue.scene.shapes.shape import WHOLE
from etendue.scene.sources.source import Emitter, Source
from etendue.units import FluxUnit


class Tube(Source):
    """The side of a fluorescent lamp: Lambertian, about the z axis, from z = 0 up.

    Parameters
    ----------
    diameter, length : number
        [mm], > 0.
    flux : number
        [`flux_unit`], > 0.
    flux_unit : {"lm", "W"}

    Examples
    --------
    >>> Tube(diameter=26, length=590, flux=1350).emitters(Files())[0].record["shape"]["z"]
    (0.0, 590.0)
    """

    kind: Literal["tube"] = "tube"
    diameter: Length
    length: Length
    flux: Positive
    flux_unit: FluxUnit = "lm"

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The side of a cylinder."""
        shape = Cylinder(radius=self.diameter / 2.0, height=self.length).sheet(WHOLE, files).shape
        record = {"kind": "surface", "shape": shape, "trims": [], "flip": False, "exponent": 1.0, "flux": self.flux}
        return (Emitter(record, self.flux_unit),)
