"""Sources that are described: luminous surfaces, rings and beams."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal, Self

from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import model_validator

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.description.values import AsNumber, AsRow, Finite, Length, Positive
from etendue.errors import ArgumentError
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.flat import FLAT, Plane
from etendue.scene.shapes.shape import WHOLE, Shape, Trim, is_bounded
from etendue.scene.sources.source import Emitter, Source
from etendue.units import FluxUnit


class Surface(Source):
    """A surface of any shape, every element of which sends out intensity in proportion to cosⁿ of the angle to its normal.

    The flux is spread evenly over the surface.

    Parameters
    ----------
    shape : Shape
        Of finite size.
    trim : Trim
    side : {"front", "back"}
        Light leaves on the side of the shape's normal, or on the other.
    exponent : number
        n ≥ 0; 1 is a Lambertian surface.
    flux : number
        [`flux_unit`], > 0.
    flux_unit : {"lm", "W"}

    Examples
    --------
    >>> Surface(shape={"kind": "disk", "radius": 1}, flux=100).emitters(Files())[0].record["exponent"]
    1.0
    """

    kind: Literal["surface"] = "surface"
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE
    side: Literal["front", "back"] = "front"
    exponent: Annotated[float, Finite, Ge(0.0), Le(1e6), AsNumber] = 1.0
    flux: Positive
    flux_unit: FluxUnit = "lm"

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The trimmed shape."""
        sheet = self.shape.sheet(self.trim, files)
        if not is_bounded(sheet.shape):
            raise ArgumentError(
                "shape: this surface has no end, so its luminance would be 0; give a radius, or trim it"
            )
        record = {
            "kind": "surface",
            "shape": sheet.shape,
            "trims": sheet.trims,
            "flip": self.side == "back",
            "exponent": self.exponent,
            "flux": self.flux,
        }
        return (Emitter(record, self.flux_unit),)


class Rings(Source):
    """Concentric Lambertian rings in the plane z = 0 that send their light to +z, as the source of thesis section 2.3.

    Parameters
    ----------
    radii : numbers
        Outer radius of each ring [mm], rising; the first ring is a disk.
    flux : numbers
        Of each ring [`flux_unit`], > 0.
    flux_unit : {"lm", "W"}

    Examples
    --------
    >>> rings = Rings(radii=[10, 20, 30], flux=[300, 200, 100])
    >>> [emitter.record["flux"] for emitter in rings.emitters(Files())]
    [300.0, 200.0, 100.0]
    """

    kind: Literal["rings"] = "rings"
    radii: Annotated[tuple[Length, ...], MinLen(1), MaxLen(10_000), AsRow]
    flux: Annotated[tuple[Positive, ...], MinLen(1), MaxLen(10_000), AsRow]
    flux_unit: FluxUnit = "lm"

    @model_validator(mode="after")
    def _rise(self) -> Self:
        if len(self.radii) != len(self.flux):
            raise ValueError(f"{len(self.radii)} 'radii' and {len(self.flux)} values of 'flux'; give one for each ring")
        if any(not a < b for a, b in itertools.pairwise(self.radii)):
            raise ValueError("'radii' must rise from ring to ring")
        return self

    def emitters(self, files: Files) -> tuple[Emitter, ...]:  # noqa: ARG002 - nothing comes from files
        """One Lambertian annulus for each ring."""
        found = []
        for i, (inner, outer) in enumerate(itertools.pairwise((0.0, *self.radii))):
            record = {
                "kind": "surface",
                "shape": {"kind": "flat", "outline": {"kind": "annulus", "inner": inner, "outer": outer}},
                "trims": [],
                "flip": False,
                "exponent": 1.0,
                "flux": self.flux[i],
            }
            found.append(Emitter(record, self.flux_unit, name=f"ring {i + 1}"))
        return tuple(found)


FINITE_FLAT = {kind: cls for kind, cls in FLAT.items() if cls is not Plane}
"""Flat shapes that have an area."""


class Beam(Source):
    """A collimated beam along +z, with the same irradiance all over a flat cross section.

    Parameters
    ----------
    shape : Shape
        The cross section: a rectangle, disk, annulus or polygon.
    flux : number
        [`flux_unit`], > 0.
    flux_unit : {"lm", "W"}

    Examples
    --------
    >>> Beam(shape={"kind": "disk", "radius": 1}, flux=100).emitters(Files())[0].record["kind"]
    'beam'
    """

    kind: Literal["beam"] = "beam"
    shape: Annotated[Shape, Family(FINITE_FLAT)]
    flux: Positive
    flux_unit: FluxUnit = "lm"

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The cross section."""
        record = {"kind": "beam", "shape": self.shape.sheet(WHOLE, files).shape, "flux": self.flux}
        return (Emitter(record, self.flux_unit),)
