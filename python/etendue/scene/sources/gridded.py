"""Ray files as surface sources with intensity tables, the method of thesis chapter 3, as sources of scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from annotated_types import Ge, Le
from pydantic import InstanceOf, model_validator
from pydantic.json_schema import SkipJsonSchema

from etendue.description.files import Files
from etendue.description.values import AsCount, Index, Length, Positive
from etendue.formats.rays import read_rays
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.surfaces import parse_surface
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.scene.placement import Placement
from etendue.scene.sources.from_files import Rays
from etendue.scene.sources.source import Emitter, Source


class Gridded(Source):
    """Rays drawn from the patches of a `GriddedSource`: a ray file sampled on a surface, pixel by pixel.

    Parameters
    ----------
    file : path
        A ray file.
    surface : str
        The carrier surface as on the command line, for example ``"plane:z=0"``.
    pixel : number
        Side of the pixels [mm].
    threshold : number, optional
        Largest error of the flux of a pixel [%]; what suits the number of rays if not given.
    gridded : GriddedSource
        In Python, instead of these four.
    draws : int
        Rays that are drawn, all of the same flux.
    seed : int
        Of the draws.
    flux : number, optional
        Total flux that overrides that of the rays on patches [the file's own unit].

    Examples
    --------
    >>> Gridded(file="led.tm25ray", surface="plane:z=0", pixel=0.5).draws
    1000000
    """

    IN_MEMORY: ClassVar[tuple[str, ...]] = ("gridded",)

    kind: Literal["gridded"] = "gridded"
    file: Path | None = None
    surface: str | None = None
    pixel: Length = 1.0
    threshold: Positive | None = None
    gridded: SkipJsonSchema[InstanceOf[GriddedSource] | None] = None
    draws: Annotated[int, Ge(1), Le(1 << 31), AsCount] = 1_000_000
    seed: Index = 1
    flux: Positive | None = None

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if (self.file is None) == (self.gridded is None):
            raise ValueError(
                "'file' is missing" if self.file is None else "'file' and 'gridded' are both given; use one"
            )
        if (self.file is None) != (self.surface is None):
            raise ValueError("'surface' belongs to 'file': the carrier surface, for example \"plane:z=0\"")
        if self.surface is not None:
            parse_surface(self.surface)
        return self

    def as_rays(self, files: Files) -> Rays:
        """The source as one of the rays that are drawn, in its place: what can be fitted and then seen."""
        gridded, known = self._gridded(files)
        place = {key: getattr(self, key) for key in (*Source.model_fields, *Placement.model_fields)}
        if known is not None and not self.states_colours:
            wavelengths, shares = known.lines(gridded.flux_unit)
            place["spectrum"] = tuple(zip(wavelengths.tolist(), shares.tolist(), strict=True))
        drawn = gridded.sample(self.draws, self.seed)
        return Rays(**place, rays=drawn, flux=gridded.emitted_flux, flux_unit=gridded.flux_unit)

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The rays that were drawn, with the flux of the rays on patches, which tables of coarse bins do not hold."""
        gridded, known = self._gridded(files)
        drawn, flux = gridded.sample(self.draws, self.seed), gridded.emitted_flux
        scale = drawn.flux_scale * flux / drawn.total_flux
        record = {"kind": "rays", "rays": drawn.core_source(), "scale": scale, "flux": flux}
        return (Emitter(record, gridded.flux_unit, known, flux_notes=drawn.notes),)

    def _gridded(self, files: Files) -> tuple[GriddedSource, Spectrum | SpectralLines | None]:
        """The patches, and the spectrum of the rays that they were made of."""
        gridded, known = self.gridded, None
        if self.file is not None and self.surface is not None:
            rays = read_rays(files.find(self.file))
            gridded = GriddedSource.fit(rays, parse_surface(self.surface), self.pixel, self.threshold)
            known = rays.total_spectrum()
        assert gridded is not None  # noqa: S101 - one of the two is given
        return (gridded if self.flux is None else gridded.emitting(self.flux)), known
