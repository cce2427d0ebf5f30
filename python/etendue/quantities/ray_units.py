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

        If no spectrum is known, but the header of the rays' file states the total in both units, their ratio is taken for
        all rays. The last step of the provenance says how it was done.

        Raises
        ------
        UnitError
            If the set knows neither the spectrum of its rays nor both totals; the message says what would help.

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
        how, efficacy = self._efficacy()
        if unit == "lm":
            return self._with_flux(lambda batch: batch.flux * efficacy(batch), unit, how)
        dark = any(not (efficacy(batch) > 0).all() for batch in self.batches())
        if dark:
            raise UnitError(
                f"{self.provenance.source}: lumens cannot become watts: some rays have a wavelength at which V(λ) is 0, "
                "so their radiant flux is not determined. State the total in W (flux=, --flux 0.7W)."
            )
        return self._with_flux(lambda batch: batch.flux / efficacy(batch), unit, how)

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

    def _efficacy(self: RaySet) -> tuple[str, Callable[[RayBatch], FloatArray]]:  # type: ignore[misc]
        """Where the luminous efficacy of radiation is known from, and that of the rays of a batch [lm/W]."""
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
                        "total in lm (flux=, --flux 54.6lm)."
                    )
                return LUMINOUS_EFFICACY_MAX * photopic_efficiency(wavelength)

            return "the wavelength of each ray", monochromatic
        single = self.meaning.single_wavelength
        if single is not None:
            constant = LUMINOUS_EFFICACY_MAX * float(photopic_efficiency([single])[0])
            return f"its wavelength of {single:g} nm", lambda batch: np.full(len(batch.flux), constant)
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

            return "the spectrum of each ray", indexed
        if len(self.spectra) == 1:
            k = self.spectra[0].luminous_efficacy
            return "its spectrum", lambda batch: np.full(len(batch.flux), k)
        lumens, watts = (self.header.get(name) for name in ("luminous_flux", "radiant_flux"))
        # Only as long as the rays are those of the file.
        of_file = bool({"total_flux", "overruled_total_flux"} & set(self.header))
        if of_file and isinstance(lumens, float) and isinstance(watts, float) and lumens > 0 and watts > 0:
            ratio = lumens / watts
            how = f"the totals of its header, {lumens:.6g} lm and {watts:.6g} W, as if all rays had one spectrum"
            return how, lambda batch: np.full(len(batch.flux), ratio)
        other = "lumens" if self.flux_unit == "W" else "watts"
        raise UnitError(
            f"{self.provenance.source}: {self.flux_unit} cannot become {other}: the rays carry no wavelength and the file "
            "no spectrum, nor does it state both totals. Ask for a file with wavelengths, or, if all rays share one "
            f"spectrum, state the total (flux=, --flux {'54.6lm' if self.flux_unit == 'W' else '0.7W'}) or the spectrum "
            "(RaySet.with_spectrum)."
        )

    def without_spectrum(self: RaySet) -> RaySet:  # type: ignore[misc]
        """The same rays with nothing known of their spectra, wavelengths and polarisation.

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], wavelength=[450.0]).without_spectrum().knows_spectrum
        False
        """
        return self._without("wavelength", "spectrum_index", "stokes", "polarisation_axis").replace(
            spectra=(), single_wavelength=None, provenance=self.provenance.then("wavelengths and spectra left out")
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
