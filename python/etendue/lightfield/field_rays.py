"""Rays drawn from a light field, as a stream: any number of them, none of which has to be in memory."""

from __future__ import annotations

from typing import Any

from etendue import _core
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.quantities.arguments import as_whole
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import DrawnRays, FloatArray, Progress, RayBatch, checked_seed
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import FluxUnit


class FieldRays(DrawnRays):
    """Rays of equal flux with the density of a light field's luminance in étendue, drawn exactly.

    Each ray starts on the carrier surface. If the field's spectrum is one of lines, each ray has the wavelength of one of
    them, by their shares of the flux and whatever its place and direction. A ray depends on the seed and its number alone:
    any stretch of the stream, read in any order, has the same bits.

    Parameters
    ----------
    field : EtendueDensity
        What is drawn from.
    rays : int
        Number of rays, which together carry the field's flux.
    seed : int
        0 to 2⁶⁴ - 1.

    Raises
    ------
    ArgumentError
        If the number of rays or the seed is no whole number, or out of its domain.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> field = et.LightField.fit(et.RingSource(rays=100_000), Disk(radius=30), depths=(3, 3, 3, 3))
    >>> rays = FieldRays(field, 10**9, seed=4)
    >>> len(rays), round(rays.total_flux, 6), len(next(rays.batches()).flux)
    (1000000000, 600.0, 262144)
    """

    def __init__(self, field: EtendueDensity, rays: int, seed: int = 1) -> None:
        rays, seed = as_whole(rays, "FieldRays: the number of rays", 1, (1 << 63) - 1), checked_seed(seed)
        self.field = field
        self.seed = seed
        self._core = _core.FieldRays(field.core, rays, seed)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the compiled part is made anew."""
        return FieldRays, (self.field, len(self), self.seed)

    def __repr__(self) -> str:
        """Rays and field."""
        return f"<FieldRays, {len(self):,}, seed {self.seed}, of {self.field!r}>"

    @property
    def flux_unit(self) -> FluxUnit:
        """The field's."""
        return self.field.flux_unit

    @property
    def total_flux(self) -> float:
        """The field's [`flux_unit`]."""
        return self.field.total_flux

    @property
    def provenance(self) -> Provenance:
        """The field's, and how many rays were drawn with which seed."""
        return self.field.provenance.then(f"{len(self)} rays drawn from the light field, seed {self.seed}")

    def total_spectrum(
        self,
        progress: Progress | None = None,  # noqa: ARG002 - nothing has to be read
        threads: int | None = None,  # noqa: ARG002
    ) -> Spectrum | SpectralLines | None:
        """The field's."""
        return self.field.spectrum

    def wavelength_of(self, batch: RayBatch) -> FloatArray | None:
        """Wavelength of each ray of a batch [nm], shape (k,), drawn from the lines of the field's spectrum, if there are."""
        spectrum = self.field.spectrum
        if spectrum is None or (isinstance(spectrum, Spectrum) and spectrum.wavelength.size > 1):
            return None
        return self._wavelengths(spectrum, batch.start, batch.start + len(batch.usable))[batch.usable]

    def _wavelengths(self, spectrum: Spectrum | SpectralLines, start: int, stop: int) -> FloatArray:
        wavelength, shares = spectrum.lines(self.flux_unit)
        drawn: FloatArray = _core.draw_wavelengths(wavelength.tolist(), shares.tolist(), self.seed, start, stop)
        return drawn

    def ray_set(self) -> RaySet:
        """All rays as a ray set, for sets that fit into memory; with the field's spectrum, or a wavelength each."""
        position, direction, flux = _core.read_rays(self._core, 0, len(self))
        spectrum = self.field.spectrum
        return RaySet(
            position,
            direction,
            flux,
            flux_unit=self.flux_unit,
            wavelength=self._wavelengths(spectrum, 0, len(self)) if isinstance(spectrum, SpectralLines) else None,
            spectra=(spectrum,) if isinstance(spectrum, Spectrum) else (),
            provenance=self.provenance,
        )
