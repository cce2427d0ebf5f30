"""Lumens and watts of a ray set: each becomes the other only through a known spectrum."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from etendue.errors import UnitError
from etendue.quantities.arguments import require, require_known
from etendue.quantities.ray_records import RayRecords
from etendue.quantities.ray_rewriting import Rays, column_of, with_flux, without
from etendue.quantities.ray_stream import FloatArray, RayBatch
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.units import FLUX_UNITS, LUMINOUS_EFFICACY_MAX, FluxUnit

TOTALS_APART = 0.01
"""Share by which lumens per watt of the rays may differ from those of the header's totals without a word: spectra that are
sampled in other steps differ by some thousandths."""


def in_unit(rays: Rays, unit: FluxUnit) -> Rays:
    """The set with its flux in lumens or watts, through its spectrum: Φ_v = K_m ∫ Φ_e,λ V(λ) dλ.

    A complaint tells if the totals of its header say something else.
    """
    require_known(unit, FLUX_UNITS, "flux unit")
    return rays if unit == rays.flux_unit else _with_contradiction(rays, _converted(rays, unit))


def _with_contradiction(rays: Rays, converted: Rays) -> Rays:
    """The converted set, with a complaint if the totals of the file's header say another ratio of lumens to watts."""
    header = rays.header
    total = header.get("total_flux", header.get("overruled_total_flux"))
    other = header.get("luminous_flux" if converted.flux_unit == "lm" else "radiant_flux")
    known = all(isinstance(value, float) and 0.0 < value < math.inf for value in (total, other))
    if not known or not rays.total_flux > 0.0:
        return converted
    found = total * converted.total_flux / rays.total_flux
    if abs(found / other - 1.0) <= TOTALS_APART:
        return converted
    said = f"the header says {other:.4g} {converted.flux_unit} beside {total:.4g} {rays.flux_unit}"
    told = f"{said}, and the rays give {found:.4g} {converted.flux_unit} for it; that of the rays is used"
    return converted.replace(complaints=(*converted.complaints, Complaint("warning", "total flux", told)))


def _converted(rays: Rays, unit: FluxUnit) -> Rays:
    """The set in the other unit."""
    # A radiant-flux column beside a luminous one is the better truth: it is used before any spectrum.
    if unit == "W" and "radiant_flux" in rays.columns:
        return with_flux(
            rays, lambda batch: column_of(rays, batch, "radiant_flux"), unit, "the file's radiant flux column"
        )
    how, efficacy = _efficacy(rays)
    if unit == "lm":
        return with_flux(rays, lambda batch: batch.flux * efficacy(batch), unit, how)
    dark = any(not (efficacy(batch) > 0).all() for batch in rays.batches())
    if dark:
        raise UnitError(
            f"{rays.provenance.source}: lumens cannot become watts: some rays have a wavelength at which V(λ) is 0, "
            "so their radiant flux is not determined. State the total in W (--flux 0.7W, or flux= in Python)."
        )
    return with_flux(rays, lambda batch: batch.flux / efficacy(batch), unit, how)


def knows_spectrum(rays: RayRecords) -> bool:
    """Whether every ray has a wavelength or a spectrum, so that watts and lumens can be converted."""
    indexed = "spectrum_index" in rays.columns and bool(rays.spectra)
    return (
        "wavelength" in rays.columns or rays.meaning.single_wavelength is not None or indexed or len(rays.spectra) == 1
    )


def _efficacy(rays: RayRecords) -> tuple[str, Callable[[RayBatch], FloatArray]]:
    """Where the luminous efficacy of radiation is known from, and that of the rays of a batch [lm/W]."""
    if "wavelength" in rays.columns:

        def monochromatic(batch: RayBatch) -> FloatArray:
            wavelength = column_of(rays, batch, "wavelength")
            unknown = ~(wavelength > 0)
            if unknown.any():
                first = int(np.argmax(unknown))
                at = batch.start + int(np.flatnonzero(batch.usable)[first])
                raise UnitError(
                    f"{rays.provenance.source}: ray {at + 1:,} has the wavelength {wavelength[first]:g} nm, "
                    "so its lumens are not determined. Ask for a file with a wavelength for every ray, or state the "
                    "total in lm (--flux 54.6lm, or flux= in Python)."
                )
            return LUMINOUS_EFFICACY_MAX * photopic_efficiency(wavelength)

        return "the wavelength of each ray", monochromatic
    single = rays.meaning.single_wavelength
    if single is not None:
        constant = LUMINOUS_EFFICACY_MAX * float(photopic_efficiency([single])[0])
        return f"its wavelength of {single:g} nm", lambda batch: np.full(len(batch.flux), constant)
    if "spectrum_index" in rays.columns and rays.spectra:
        table = np.array([spectrum.luminous_efficacy for spectrum in rays.spectra])

        def indexed(batch: RayBatch) -> FloatArray:
            index = column_of(rays, batch, "spectrum_index")
            if ((index < 1) | (index > len(table))).any():
                raise UnitError(
                    f"{rays.provenance.source}: a ray points to a spectrum outside 1..{len(table)}; "
                    "its lumens are not determined."
                )
            chosen: FloatArray = table[index - 1]
            return chosen

        return "the spectrum of each ray", indexed
    if len(rays.spectra) == 1:
        k = rays.spectra[0].luminous_efficacy
        return "its spectrum", lambda batch: np.full(len(batch.flux), k)
    lumens, watts = (rays.header.get(name) for name in ("luminous_flux", "radiant_flux"))
    # Only as long as the rays are those of the file.
    of_file = bool({"total_flux", "overruled_total_flux"} & set(rays.header))
    if of_file and isinstance(lumens, float) and isinstance(watts, float) and lumens > 0 and watts > 0:
        ratio = lumens / watts
        how = f"the totals of its header, {lumens:.4g} lm and {watts:.4g} W, as if all rays had one spectrum"
        return how, lambda batch: np.full(len(batch.flux), ratio)
    other = "lumens" if rays.flux_unit == "W" else "watts"
    raise UnitError(
        f"{rays.provenance.source}: {rays.flux_unit} cannot become {other}: the rays carry no wavelength and the file "
        "no spectrum, nor does it state both totals. Ask for a file with wavelengths, or, if all rays share one "
        f"spectrum, state the total (--flux {'54.6lm' if rays.flux_unit == 'W' else '0.7W'}, or flux= in Python) or, in "
        "Python, the spectrum (RaySet.with_spectrum)."
    )


def without_spectrum(rays: Rays) -> Rays:
    """The same rays with nothing known of their spectra, wavelengths and polarisation."""
    return without(rays, "wavelength", "spectrum_index", "stokes", "polarisation_axis").replace(
        spectra=(), single_wavelength=None, provenance=rays.provenance.then("wavelengths and spectra left out")
    )


def with_spectrum(rays: Rays, spectrum: Spectrum) -> Rays:
    """The same rays with one spectrum for all, in place of whatever was known of their spectra and wavelengths."""
    require(spectrum, Spectrum, "with_spectrum: spectrum", "a Spectrum, as et.Spectrum(wavelength, weight)")
    step = "spectrum given by the user"
    # The ratio of the two totals in the header was that of another spectrum.
    other = "luminous_flux" if rays.flux_unit == "W" else "radiant_flux"
    header = {name: value for name, value in rays.header.items() if name != other}
    return without(rays, "wavelength", "spectrum_index").replace(
        spectra=(spectrum,), single_wavelength=None, header=header, provenance=rays.provenance.then(step)
    )
