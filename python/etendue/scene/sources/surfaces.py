"""Sources that are described: luminous surfaces, rings and beams."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import InstanceOf, model_validator
from pydantic.json_schema import SkipJsonSchema

from etendue.description.families import Family
from etendue.description.files import Files
from etendue.description.values import AsNumber, AsRow, Finite, Length, Positive
from etendue.errors import ArgumentError
from etendue.quantities.intensity import Intensity
from etendue.quantities.powers_of_ten import counted
from etendue.scene.shapes import SHAPES
from etendue.scene.shapes.flat import FLAT, Plane
from etendue.scene.shapes.shape import WHOLE, Shape, Trim, is_bounded
from etendue.scene.sources.intensity_tables import (
    check_origin,
    front_of,
    has_table,
    read_table,
    spectrum_is_mean,
    table_record,
)
from etendue.scene.sources.source import Emitter, Source
from etendue.units import FluxUnit

STATED = 1e-3
"""Share by which a stated flux may differ from that of a distribution before it is told: as of ray files."""

ROUNDING = 1e-9
"""Share of the flux that is not worth a word: sums of rounded numbers."""


class Surface(Source):
    """A surface whose elements send out equal flux, by cosⁿ of the angle to the normal or by an intensity distribution.

    The flux is spread evenly over the surface. With a distribution the luminance of all its points is
    L = I(γ, C) / (A cos γ), section 2.2 of [Audenaert2014]_: γ counts from the normal on the side that the light leaves
    on, C from the local +X, towards +Y on the front and −Y on the back, which is right-handed about either normal.

    Parameters
    ----------
    shape : Shape
        Of finite size; flat for a distribution, whose angles count from one normal.
    trim : Trim
    side : {"front", "back"}
        Light leaves on the side of the shape's normal, or on the other.
    exponent : number, optional
        n ≥ 0; 1 is a Lambertian surface, as it is without exponent and distribution.
    file : path, optional
        Any intensity file that `etendue.read_intensity` reads. What it sends beyond γ = 90° is left out, and told.
    photometry : str, optional
        Which distribution, of a file that holds several.
    intensity : Intensity
        In Python, instead of a file.
    flux : number, optional
        [`flux_unit`], > 0, overrides that of the distribution up to γ = 90°; needed without one.
    flux_unit : {"lm", "W"}, optional
        Of `flux`, "lm" if left out; a distribution has its own.

    Examples
    --------
    >>> Surface(shape={"kind": "disk", "radius": 1}, flux=100).emitters(Files())[0].record["exponent"]
    1.0
    >>> lamp = Intensity(c=[0, 180], gamma=[0, 90], values=[[3.0, 0], [1.0, 0]])
    >>> shaped = Surface(shape={"kind": "rectangle", "width": 2, "height": 1}, intensity=lamp)
    >>> round(shaped.emitters(Files())[0].record["flux"], 4) == round(lamp.flux, 4)
    True
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("intensity",)

    kind: Literal["surface"] = "surface"
    shape: Annotated[Shape, Family(SHAPES)]
    trim: Trim = WHOLE
    side: Literal["front", "back"] = "front"
    exponent: Annotated[float, Finite, Ge(0.0), Le(1e6), AsNumber] | None = None
    file: Path | None = None
    photometry: str | None = None
    intensity: SkipJsonSchema[InstanceOf[Intensity] | None] = None
    flux: Positive | None = None
    flux_unit: FluxUnit | None = None

    @model_validator(mode="after")
    def _one_pattern(self) -> Self:
        check_origin(self)
        if has_table(self) and self.exponent is not None:
            raise ValueError("'exponent' and an intensity distribution are both given; use one")
        return self

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The trimmed shape."""
        sheet = self.shape.sheet(self.trim, files)
        if not is_bounded(sheet.shape):
            raise ArgumentError(
                "shape: this surface has no end, so its luminance would be 0; give a radius, or trim it"
            )
        if sheet.trims:
            kind = getattr(self.shape, "kind", "shape")
            raise ArgumentError(
                f"trim: a luminous {kind} cannot be cut; give the part that is left as a mesh"
                if not self.trim.half_spaces
                else f"trim.half_spaces: a luminous {kind} cannot be cut by them; give the part that is left as a mesh"
            )
        record = {"kind": "surface", "shape": sheet.shape, "flip": self.side == "back"}
        if not has_table(self):
            exponent = 1.0 if self.exponent is None else self.exponent
            record.update(exponent=exponent, flux=self.flux)
            return (Emitter(record, self.flux_unit or "lm", flux_notes=sheet.notes),)
        if sheet.shape["kind"] != "flat":
            kind = getattr(self.shape, "kind", "shape")
            raise ArgumentError(
                f"shape: a {kind} is not flat, and the angles of an intensity distribution count from one normal; "
                f"give one of {', '.join(sorted(FINITE_FLAT))}, or 'exponent' in place of the distribution"
            )
        whole = read_table(self, files)
        table = front_of(whole)
        flux = table.flux if self.flux is None else self.flux
        notes, behind = [], 1.0 - table.flux / whole.flux
        if table is not whole and behind > ROUNDING:
            notes.append(
                f"{behind:.3%} of the distribution's flux goes beyond γ = 90°, behind the surface, and is left out"
            )
        if not math.isclose(flux, table.flux, rel_tol=STATED):
            unit = table.flux_unit
            notes.append(
                f"the distribution has {counted(table.flux, unit)} up to γ = 90°; it is multiplied by "
                f"{flux / table.flux:.4g}, to {counted(flux, unit)} as stated"
            )
        return (
            Emitter(
                {**record, **table_record(table), "flux": flux},
                table.flux_unit,
                table.luminaire.get("spectrum"),
                flux_notes=tuple(notes),
                mean=spectrum_is_mean(table) and not self.states_colours,
            ),
        )


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
