"""Ray files as surface sources with intensity tables, the method of thesis chapter 3, as sources of scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from annotated_types import Ge, Le
from pydantic import InstanceOf, model_validator
from pydantic.json_schema import SkipJsonSchema

from etendue.description.files import Files
from etendue.description.values import AsCount, Index, Length, Positive
from etendue.errors import ArgumentError
from etendue.formats.patch_folder import is_patch_folder
from etendue.formats.rays import read_rays
from etendue.lightfield.carrier import parse_surface
from etendue.lightfield.gridded.core_patches import core_patches
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.quantities.ray_set import RaySet
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.scene.placement import Placement
from etendue.scene.sources.source import Emitter, Source

NO_ERRORS = "tables of patches do not know their error: what they miss of their rays is in no standard error"


class Gridded(Source):
    """The patches of a `GriddedSource`: a ray file sampled on a surface, pixel by pixel.

    A trace takes rays that are drawn from the patches. Lines of sight of a map read the table of the patch that they meet,
    L = I(θ, φ) / (A cos θ), also behind optics.

    Parameters
    ----------
    file : path
        A ray file, or a folder that `GriddedSource.save_patches` or ``etendue patches`` wrote.
    surface : str
        For a ray file: the carrier surface as on the command line, for example ``"plane:z=0"``.
    pixel : number
        For a ray file: side of the pixels [mm].
    threshold : number, optional
        For a ray file: largest error of the flux of a pixel [%]; what suits the number of rays if not given.
    gridded : GriddedSource
        In Python, instead of these four.
    draws : int
        Rays that a trace draws, all of the same flux.
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
        if self.file is None and self.surface is not None:
            raise ValueError("'surface' belongs to 'file': the carrier surface, for example \"plane:z=0\"")
        if self.surface is not None:
            parse_surface(self.surface)
        return self

    def seen(self, files: Files) -> SeenGridded:
        """The source in its place, as lines of sight meet it."""
        gridded, known = self._gridded(files)
        place = {key: getattr(self, key) for key in (*Source.model_fields, *Placement.model_fields)}
        if known is not None and not self.states_colours:
            wavelengths, shares = known.lines(gridded.flux_unit)
            place["spectrum"] = tuple(zip(wavelengths.tolist(), shares.tolist(), strict=True))
        return SeenGridded(**place, gridded=gridded)

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The rays that were drawn, with the flux of the rays on patches, which tables of coarse bins do not hold."""
        gridded, known = self._gridded(files)
        drawn, flux = gridded.sample(self.draws, self.seed), gridded.emitted_flux
        scale = drawn.flux_scale * flux / drawn.total_flux
        record = {"kind": "rays", "rays": drawn.core_source(), "scale": scale, "flux": flux}
        return (Emitter(record, gridded.flux_unit, known, flux_notes=(*drawn.notes, NO_ERRORS)),)

    def some_rays(self, files: Files, most: int) -> RaySet:
        """Rays drawn from it."""
        return self._gridded(files)[0].sample(most, self.seed)

    def _gridded(self, files: Files) -> tuple[GriddedSource, Spectrum | SpectralLines | None]:
        """The patches, and the spectrum of the rays that they were made of."""
        gridded, known = self.gridded, None
        if self.file is not None:
            path = files.find(self.file)
            if is_patch_folder(path):
                given = [key for key in ("surface", "pixel", "threshold") if key in self.model_fields_set]
                if given:
                    raise ArgumentError(
                        f"file: {self.file} is a folder of patches, whose pixels are cut already; leave out "
                        + " and ".join(map(repr, given))
                    )
                gridded = GriddedSource.load(path)
            else:
                if self.surface is None:
                    raise ArgumentError(
                        'surface: is missing; a ray file needs a carrier surface, for example "plane:z=0"'
                    )
                rays = read_rays(path)
                gridded = GriddedSource.fit(rays, parse_surface(self.surface), self.pixel, self.threshold)
                known = rays.total_spectrum()
        assert gridded is not None  # noqa: S101 - one of the two is given
        return (gridded if self.flux is None else gridded.emitting(self.flux)), known


class SeenGridded(Gridded):
    """A gridded source whose patches lines of sight meet; `Gridded.seen` makes it.

    Examples
    --------
    >>> import etendue as et
    >>> grid = et.GriddedSource.fit(et.RingSource(rays=5000), et.Plane(z=0), 20.0, 2.1)
    >>> SeenGridded(gridded=grid).emitters(Files())[0].record["kind"]
    'patches'
    """

    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The patches with the flux of the rays on them, which tables of coarse bins do not hold."""
        gridded, known = self._gridded(files)
        record = {"kind": "patches", **core_patches(gridded.surface, gridded.patches), "flux": gridded.emitted_flux}
        return (Emitter(record, gridded.flux_unit, known, flux_notes=(gridded.flux_note, NO_ERRORS)),)
