"""Lumens and watts of a ray set: each becomes the other only through a known spectrum."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from etendue.errors import UnitError, UnknownNameError
from etendue.quantities.ray_stream import RayBatch
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.units import FLUX_UNITS, LUMINOUS_EFFICACY_MAX, FluxUnit

if TYPE_CHECKING:
    from etendue.quantities.ray_set import RaySet

FloatArray = npt.NDArray[np.float64]


class RayUnits:
    """What `etendue.RaySet` knows of the units of its flux.

    Examples
    --------
    >>> import etendue as et
    >>> et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], wavelength=[610.0]).knows_spectrum
    True
    """

    def in_unit(self: RaySet, unit: FluxUnit) -> RaySet:  # type: ignore[misc]
        """The set with its flux in lumens or watts, through its spectrum: Φ_v = K_m ∫ Φ_e,λ V(λ) dλ.

        Raises
        ------
        UnitError
            If the set does not know the spectrum of its rays; the message says what would help.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], flux_unit="W", wavelength=[555.0])
        >>> round(rays.in_unit("lm").total_flux, 6)
        683.0
        """
        if unit not in FLUX_UNITS:
            raise UnknownNameError("flux unit", unit, FLUX_UNITS)
        if unit == self.flux_unit:
            return self
        # A radiant-flux column beside a luminous one is the better truth: it is used before any spectrum.
        if unit == "W" and "radiant_flux" in self.columns:
            return self._with_flux(
                lambda batch: self._column_of(batch, "radiant_flux"), unit, "the file's radiant flux column"
            )
        efficacy = self._efficacy()
        if unit == "lm":
            return self._with_flux(lambda batch: batch.flux * efficacy(batch), unit, "its spectrum")
        dark = any(not (efficacy(batch) > 0).all() for batch in self.batches())
        if dark:
            raise UnitError(
                f"{self.provenance.source}: lumens cannot become watts: some rays have a wavelength at which V(λ) is 0, "
                "so their radiant flux is not determined. State it: with_total_flux(value, 'W')."
            )
        return self._with_flux(lambda batch: batch.flux / efficacy(batch), unit, "its spectrum")

    @property
    def knows_spectrum(self: RaySet) -> bool:  # type: ignore[misc]
        """Whether every ray has a wavelength or a spectrum, so that watts and lumens can be converted."""
        indexed = "spectrum_index" in self.columns and bool(self.spectra)
        return (
            "wavelength" in self.columns
            or self.meaning.single_wavelength is not None
            or indexed
            or len(self.spectra) == 1
        )

    def _efficacy(self: RaySet) -> Callable[[RayBatch], FloatArray]:  # type: ignore[misc]
        """Luminous efficacy of radiation [lm/W] of the rays of a batch."""
        if "wavelength" in self.columns:

            def monochromatic(batch: RayBatch) -> FloatArray:
                wavelength = self._column_of(batch, "wavelength")
                unknown = ~(wavelength > 0)
                if unknown.any():
                    first = int(np.argmax(unknown))
                    at = batch.start + int(np.flatnonzero(batch.usable)[first])
                    raise UnitError(
                        f"{self.provenance.source}: ray {at + 1:,} has the wavelength {wavelength[first]:g} nm, "
                        "so its lumens are not determined. Ask for a file with a wavelength for every ray, or state the "
                        "total: with_total_flux(value, unit)."
                    )
                return LUMINOUS_EFFICACY_MAX * photopic_efficiency(wavelength)

            return monochromatic
        single = self.meaning.single_wavelength
        if single is not None:
            constant = LUMINOUS_EFFICACY_MAX * float(photopic_efficiency([single])[0])
            return lambda batch: np.full(len(batch.flux), constant)
        if "spectrum_index" in self.columns and self.spectra:
            table = np.array([spectrum.luminous_efficacy for spectrum in self.spectra])

            def indexed(batch: RayBatch) -> FloatArray:
                index = self._column_of(batch, "spectrum_index")
                if ((index < 1) | (index > len(table))).any():
                    raise UnitError(
                        f"{self.provenance.source}: a ray points to a spectrum outside 1..{len(table)}; "
                        "its lumens are not determined."
                    )
                chosen: FloatArray = table[index - 1]
                return chosen

            return indexed
        if len(self.spectra) == 1:
            k = self.spectra[0].luminous_efficacy
            return lambda batch: np.full(len(batch.flux), k)
        other = "lumens" if self.flux_unit == "W" else "watts"
        raise UnitError(
            f"{self.provenance.source}: {self.flux_unit} cannot become {other}: the rays carry no wavelength and the file "
            "no spectrum. Ask for a set with wavelengths, give the spectrum (RaySet.with_spectrum), or state the total "
            f"(with_total_flux(value, {'lm' if self.flux_unit == 'W' else 'W'!r})) if all rays share one spectrum."
        )

    def with_spectrum(self: RaySet, spectrum: Spectrum) -> RaySet:  # type: ignore[misc]
        """The same rays with one spectrum for all, in place of whatever was known of their spectra and wavelengths.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], flux_unit="W", wavelength=[450.0])
        >>> round(rays.with_spectrum(et.Spectrum([555.0], [1.0])).in_unit("lm").total_flux)
        683
        """
        step = "spectrum given by the user"
        return self._without("wavelength", "spectrum_index").replace(
            spectra=(spectrum,), single_wavelength=None, provenance=self.provenance.then(step)
        )
