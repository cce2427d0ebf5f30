"""Sources that were measured or fitted: ray files, light fields, intensity distributions."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import InstanceOf, model_validator
from pydantic.json_schema import SkipJsonSchema

from etendue.description.files import Files
from etendue.description.values import Positive
from etendue.errors import ArgumentError, UnitError
from etendue.formats.rays import read_rays
from etendue.lightfield.light_field import LightField
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.quantities.distinct_rays import DistinctRays
from etendue.quantities.intensity import Intensity
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream
from etendue.scene.sources.intensity_tables import check_origin, has_table, read_table, spectrum_is_mean, table_record
from etendue.scene.sources.source import Emitter, Record, Source
from etendue.units import FluxUnit


class Rays(Source):
    """The rays of a ray file, each as it is: with its own wavelength where the file has one for each ray.

    Parameters
    ----------
    file : path
        Any ray file that `etendue.read_rays` reads.
    rays : RayStream
        In Python, instead of a file.
    flux : number, optional
        Total flux that overrides the file's [`flux_unit`].
    flux_unit : {"lm", "W"}, optional
        Turns the rays into this unit, through the spectrum of the file, else that which is stated here; the file's own if
        left out.

    Examples
    --------
    >>> source = Rays(rays=RaySet([[0, 0, 0]], [[0, 0, 1]], [2.0]), flux=3)
    >>> source.emitters(Files())[0].record["scale"]
    1.5
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("rays",)

    kind: Literal["rays"] = "rays"
    file: Path | None = None
    rays: SkipJsonSchema[InstanceOf[RayStream] | None] = None
    flux: Positive | None = None
    flux_unit: FluxUnit | None = None

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if (self.file is None) == (self.rays is None):
            raise ValueError("'file' is missing" if self.file is None else "'file' and 'rays' are both given; use one")
        return self

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The rays and the factor from their stored flux."""
        rays = self.ray_stream(files)
        total = rays.total_flux
        if not total > 0.0:
            raise ArgumentError("the rays carry no flux")
        factor = 1.0 if self.flux is None else self.flux / total
        if not rays.has_position:
            raise ArgumentError("the rays have directions only; use their intensity as a point source")
        # Copies of a ray are not independent; those that may differ in colour cannot be joined.
        distinct = DistinctRays.of(rays, join=self.states_colours or not _have_colours(rays))
        record = {
            "kind": "rays",
            "rays": distinct.rays.coloured_source(),
            "coloured": not self.states_colours,
            "scale": distinct.rays.flux_scale * factor,
            "flux": total * factor,
        }
        unit = self.flux_unit if self.flux_unit is not None else rays.flux_unit
        emitter = self._coloured(record, rays, unit)
        return (dataclasses.replace(emitter, notes=(*emitter.notes, *rays.notes, *_told_of_copies(distinct))),)

    def ray_stream(self, files: Files) -> RayStream:
        """The rays, in the unit that is asked for if their spectrum is known.

        Raises
        ------
        ArgumentError, UnitError, FormatError, OSError
            If they cannot be read, or their flux cannot be turned into that unit.
        """
        rays: RayStream = read_rays(files.find(self.file)) if self.file is not None else self.rays  # type: ignore[assignment]
        if self.flux_unit is None or self.flux_unit == rays.flux_unit:
            return rays
        if self.flux is not None:
            return rays.with_total_flux(self.flux, self.flux_unit) if isinstance(rays, RaySet) else rays
        if not isinstance(rays, RaySet):
            raise ArgumentError(f"flux_unit: the rays are in {rays.flux_unit}, and cannot be turned into lm or W")
        try:
            return rays.in_unit(self.flux_unit)
        except UnitError:
            if not self.states_colours:
                raise
            total = self.stated_in_unit(rays.total_flux, self.flux_unit)
            return rays.without_spectrum().with_total_flux(total, self.flux_unit)

    def some_rays(self, files: Files, most: int) -> RaySet:
        """Some of its rays."""
        return pilot_sample(self.ray_stream(files), most)

    def _coloured(self, record: Record, rays: RayStream, unit: FluxUnit) -> Emitter:
        """With what the rays know of their colours, unless the user states these."""
        by_ray = _have_colours(rays)
        if self.states_colours:
            stated = "wavelength" if self.wavelength is not None else "spectrum"
            told = f"the rays' own colours are not used, because {stated!r} is stated for all of them"
            return Emitter(record, unit, notes=(told,) if by_ray else ())
        colours = rays.colours() if isinstance(rays, RaySet) else None
        if not isinstance(rays, RaySet) or colours is None:
            return Emitter(record, unit, rays.total_spectrum())
        if rays.colour_column == "spectrum_index":
            record = {**record, "spectra": [spectrum.lines(unit) for spectrum in rays.spectra]}
        notes = []
        if colours.unknown_rays:
            others = "the scene's wavelength" if colours.lines is None else "colours at random from those of the others"
            notes.append(
                f"{colours.unknown_rays:,} rays with {colours.unknown_share:.3%} of the flux have no wavelength in the "
                f"file; they take {others}"
            )
        return Emitter(record, unit, colours.lines, notes=tuple(notes), range=colours.range)


def _have_colours(rays: RayStream) -> bool:
    """Whether each ray has a colour of its own."""
    return isinstance(rays, RaySet) and rays.colour_column is not None


def _told_of_copies(distinct: DistinctRays) -> tuple[str, ...]:
    if distinct.excess > 1.0:
        small = f"{math.sqrt(distinct.excess):.3g} times too small"
        return (f"{distinct.told}: errors take each for a ray of its own, and are up to {small}; give each ray once",)
    return distinct.notes


class Field(Source):
    """A light field, as `etendue.LightField.save` writes it.

    Parameters
    ----------
    file : path
        Of the light field.
    field : LightField
        In Python, instead of a file.
    flux : number, optional
        Total flux that overrides the field's [`flux_unit`].
    flux_unit : {"lm", "W"}, optional
        Turns the light into this unit, through the spectrum of the field, else that which is stated here; the field's own if
        left out.

    Examples
    --------
    >>> Field(file="led.h5").kind
    'light-field'
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("field",)

    kind: Literal["light-field"] = "light-field"
    file: Path | None = None
    field: SkipJsonSchema[InstanceOf[LightField] | None] = None
    flux: Positive | None = None
    flux_unit: FluxUnit | None = None

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if (self.file is None) == (self.field is None):
            raise ValueError("'file' is missing" if self.file is None else "'file' and 'field' are both given; use one")
        return self

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The field, its flux, its spectrum and its notes."""
        field = self._field(files)
        if not field.total_flux > 0.0:
            raise ArgumentError("the light field carries no flux")
        unit = field.flux_unit if self.flux_unit is None else self.flux_unit
        flux, told = self.flux, list[str]()
        if flux is not None and unit != field.flux_unit and field.spectrum_is_mean and not self.states_colours:
            told.append(
                f"the stated {unit} are spread as the field's {field.flux_unit} are; where the colour of its rays changes "
                "with place or direction, convert the rays before the fit"
            )
        if flux is None and unit != field.flux_unit and field.spectrum is None and self.states_colours:
            flux = self.stated_in_unit(field.total_flux, unit)
        elif flux is None:
            field = field.in_unit(unit)
            flux = field.total_flux
        mean = field.spectrum_is_mean and not self.states_colours
        record = {"kind": "field", "field": field.core, "flux": flux}
        # What a field says of itself, as of rays that it lacks or of beams that it blurs, is true of all that it lights.
        return (Emitter(record, unit, field.spectrum, notes=(*field.notes, *told), mean=mean),)

    def some_rays(self, files: Files, most: int) -> RaySet:
        """Rays drawn from it."""
        return self._field(files).sample(most)

    def _field(self, files: Files) -> LightField:
        if self.field is not None:
            return self.field
        assert self.file is not None  # noqa: S101 - one of the two is given
        return LightField.load(files.find(self.file))


class Point(Source):
    """A point with an intensity distribution, or the same intensity in all directions.

    γ counts from the local +Z, C from local +X towards +Y. Luminaire files count from the direction of their light,
    which is mostly down: ``toward = [0, 0, -1]`` hangs such a luminaire.

    Parameters
    ----------
    file : path, optional
        Any intensity file that `etendue.read_intensity` reads; isotropic without it.
    photometry : str, optional
        Which one, of a file that holds several.
    intensity : Intensity
        In Python, instead of a file.
    flux : number, optional
        Total flux [`flux_unit`], which overrides the file's; needed without a file.
    flux_unit : {"lm", "W"}
        Of `flux`, if there is no file.

    Examples
    --------
    >>> Point(flux=4).emitters(Files())[0].record["values"].tolist()
    [[1.0, 1.0]]
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("intensity",)

    kind: Literal["point"] = "point"
    file: Path | None = None
    photometry: str | None = None
    intensity: SkipJsonSchema[InstanceOf[Intensity] | None] = None
    flux: Positive | None = None
    flux_unit: FluxUnit | None = None

    @model_validator(mode="after")
    def _has_flux(self) -> Self:
        check_origin(self)
        return self

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The table and its flux."""
        if has_table(self):
            table = read_table(self, files)
        else:
            table = Intensity(np.zeros(1), np.array([0.0, 180.0]), np.ones((1, 2)), flux_unit=self.flux_unit or "lm")
        flux = table.flux if self.flux is None else self.flux
        record = {"kind": "point", **table_record(table), "flux": flux}
        mean = spectrum_is_mean(table) and not self.states_colours
        return (Emitter(record, table.flux_unit, table.luminaire.get("spectrum"), mean=mean),)
