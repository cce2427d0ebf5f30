"""The colours of a ray set's rays: the wavelength of each, and the spectrum of all of them together."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.ray_stream import FloatArray, Progress, RayBatch, checked_threads
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum

if TYPE_CHECKING:
    from etendue.quantities.ray_set import RaySet

STORED_AS = {"wavelength": ("<f4", "<f8"), "spectrum_index": ("<i4",)}
"""Types that a column which tells colours may be stored in."""


@dataclasses.dataclass(frozen=True)
class Colours:
    """What a pass over a set whose rays have a colour each tells of them.

    Parameters
    ----------
    lines : SpectralLines or None
        Flux at the wavelengths of the rays; rays whose wavelengths differ by less than 0.2 % share one, their mean by flux.
        None if no ray with flux has one.
    range : tuple of float or None
        Shortest and longest wavelength of a usable ray [nm].
    unknown_rays : int
        Usable rays whose wavelength is not above 0, or whose spectrum is not there.
    unknown_share : float
        Of the flux: that of the latter.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RaySet(np.zeros((3, 3)), [[0, 0, 1]] * 3, [1.0, 1.0, 2.0], wavelength=[450.0, 633.0, 0.0])
    >>> colours = rays.colours()
    >>> colours.range, colours.unknown_rays, colours.unknown_share
    ((450.0, 633.0), 1, 0.5)
    """

    lines: SpectralLines | None
    range: tuple[float, float] | None
    unknown_rays: int
    unknown_share: float


class RayColours:
    """What `etendue.RaySet` knows of the colours of its rays.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RaySet(np.zeros((3, 3)), [[0, 0, 1]] * 3, [1.0, 1.0, 2.0], wavelength=[450.0, 633.0, 450.0])
    >>> spectrum = rays.total_spectrum()
    >>> spectrum.wavelength.tolist(), spectrum.weight.tolist()
    ([450.0, 633.0], [3.0, 1.0])
    """

    _colours: Colours | None = None

    @property
    def colour_column(self: RaySet) -> str | None:  # type: ignore[misc]
        """The column that tells the colour of each ray, if there is one: ``wavelength`` or ``spectrum_index``."""
        if "wavelength" in self.columns:
            return "wavelength"
        # One wavelength for all goes before spectra, as in `RaySet.in_unit`.
        indexed = "spectrum_index" in self.columns and self.spectra and self.meaning.single_wavelength is None
        return "spectrum_index" if indexed else None

    def coloured_source(self: RaySet) -> Any:  # type: ignore[misc]
        """The records as the compiled core takes them, with the column that tells the colours of the rays, if any.

        Raises
        ------
        ArgumentError
            If that column is of a type that no ray file has.
        """
        name = self.colour_column
        if name is None:
            return self.core_source()
        field, offset = self.records.dtype.fields[name][:2]  # type: ignore[index]
        if field.str not in STORED_AS[name]:
            raise ArgumentError(
                f"RaySet: the field {name!r} is {field.str!r}; the wavelengths of rays are read from "
                f"{' or '.join(map(repr, STORED_AS[name]))}."
            )
        scale = self.meaning.wavelength_scale if name == "wavelength" else 1.0
        return self._table((offset, field.str, scale))

    def wavelength_of(self: RaySet, batch: RayBatch) -> FloatArray | None:  # type: ignore[misc]
        """Wavelength of each ray of a batch [nm], shape (k,); None if the set does not know it."""
        if "wavelength" in self.columns:
            wavelength: FloatArray = self._column_of(batch, "wavelength")
            return wavelength
        single = self.meaning.single_wavelength
        return None if single is None else np.full(len(batch.flux), single)

    def colours(self: RaySet, progress: Progress | None = None, threads: int | None = None) -> Colours | None:  # type: ignore[misc]
        """What the rays' own colours amount to, by one pass the first time; None if they have none of their own."""
        if self.colour_column is None:
            return None
        if self._colours is None:
            found = _core.scan_colours(self.coloured_source(), checked_threads(threads), progress)
            self._colours = self._by_number(found) if self.colour_column == "spectrum_index" else self._by_line(found)
        return self._colours

    def total_spectrum(  # type: ignore[misc]
        self: RaySet, progress: Progress | None = None, threads: int | None = None
    ) -> Spectrum | SpectralLines | None:
        """The spectrum of all rays together, whatever their places and directions; None if it is not known.

        Rays with a wavelength or a spectrum each take one pass the first time. Flux of rays that state none is left out.
        """
        if self.colour_column is not None:
            colours = self.colours(progress, threads)
            return None if colours is None else colours.lines
        if self.meaning.single_wavelength is not None:
            return Spectrum(np.array([self.meaning.single_wavelength]), np.array([1.0]))
        return self.spectra[0] if len(self.spectra) == 1 else None

    def _by_line(self: RaySet, found: _core._Colours) -> Colours:  # type: ignore[misc]
        """Colours that are wavelengths."""
        flux = np.asarray(found["flux"])
        unknown, rays = found["unknown"]
        total = float(flux.sum()) + unknown
        lit = flux > 0.0
        lines = SpectralLines(np.asarray(found["mean"])[lit], flux[lit], self.flux_unit) if lit.any() else None
        ends = (float(np.min(found["low"])), float(np.max(found["high"]))) if flux.size else None
        return Colours(lines, ends, rays, unknown / total if total > 0.0 else 0.0)

    def _by_number(self: RaySet, found: _core._Colours) -> Colours:  # type: ignore[misc]
        """Colours that are numbers of spectra."""
        number, flux = np.asarray(found["mean"]).astype(np.int64), np.asarray(found["flux"])
        unknown, rays = found["unknown"]
        there = number <= len(self.spectra)
        total = float(flux.sum()) + unknown
        unknown += float(flux[~there].sum())
        if not there.all():
            # The pass counts flux, not rays, by number; numbers that point nowhere are rare enough to count once more.
            rays = sum(
                int(((part < 1) | (part > len(self.spectra))).sum())
                for part in (self._column_of(batch, "spectrum_index") for batch in self.batches())
            )
        parts = [
            (*self.spectra[k - 1].lines(self.flux_unit), float(f))
            for k, f in zip(number[there], flux[there], strict=True)
            if f > 0.0
        ]
        lines = SpectralLines.mixed(parts, self.flux_unit) if parts else None
        ends = None if lines is None else (float(lines.wavelength[0]), float(lines.wavelength[-1]))
        return Colours(lines, ends, rays, unknown / total if total > 0.0 else 0.0)
