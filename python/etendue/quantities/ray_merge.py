"""Several ray sets as one: a white LED from its blue and its yellow file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_operations import with_total_flux
from etendue.quantities.ray_records import RayRecords
from etendue.quantities.ray_rewriting import Rays
from etendue.quantities.ray_stream import BATCH, RayBatch
from etendue.quantities.ray_units import in_unit
from etendue.quantities.repeated_rays import SharedRays
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import Spectrum
from etendue.quantities.spool import spool
from etendue.units import FluxUnit

MOST_LINES = 4096
"""Different wavelengths of the rays of a set that become spectra of a line each beside sets that have spectra, at most."""


def merged(sets: Sequence[Rays], flux: Sequence[float] | None, unit: FluxUnit | None) -> Rays:
    """One set of all usable rays; see `etendue.RaySet.merge`."""
    require(sets, Sequence, "merge: sets", "ray sets in a list, of files et.read_rays(path)")
    for one in sets:
        require(one, RayRecords, "merge: one of the sets", "rays, of a file et.read_rays(path)")
    if not sets:
        raise ArgumentError("merge: no ray sets.")
    if unit is None and len({rays.flux_unit for rays in sets}) > 1:
        units = ", ".join(f"{rays.provenance.source} in {rays.flux_unit}" for rays in sets)
        raise ArgumentError(
            f"merge: the sets differ in unit ({units}); say which the whole is to have: unit='lm' or 'W'."
        )
    if not all(rays.has_position for rays in sets):
        raise ArgumentError("merge: a far-field set has no positions.")
    if flux is not None:
        flux = as_numbers(flux, "merge: flux", "one flux for each set").ravel().tolist()
        if len(flux) != len(sets):
            raise ArgumentError(f"merge: {len(flux)} fluxes for {len(sets)} sets.")
        sets = [with_total_flux(rays, value, unit) for rays, value in zip(sets, flux, strict=True)]
    if unit is not None:
        sets = [in_unit(rays, unit) for rays in sets]

    single, by_ray = _wavelengths(sets)
    spectra = [_spectra(rays, or_lines=single is None and not by_ray) for rays in sets]
    indexed = all(spectra)
    shared = [
        name
        for name in sets[0].columns
        if name not in ("wavelength", "spectrum_index")
        # Additional columns mean what their labels say.
        and (name != "additional" or len({_labels(rays) for rays in sets}) == 1)
        and all(name in rays.columns for rays in sets)
        and len({rays.records.dtype[name].shape for rays in sets}) == 1
    ]
    fields: list[Any] = [("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8")]
    fields += [(name, "<f8", sets[0].records.dtype[name].shape) for name in shared]
    fields += [("wavelength", "<f8")] if by_ray else []
    fields += [("spectrum_index", "<i4")] if indexed else []
    dtype = np.dtype(fields)

    same = SharedRays([len(rays) for rays in sets])

    def parts() -> Iterator[npt.NDArray[Any]]:
        before = 0
        for number, rays in enumerate(sets):
            for batch in rays.batches():
                same.add(number, batch.position, batch.direction)
                part = np.zeros(len(batch.flux), dtype)
                part["position"], part["direction"], part["flux"] = batch.position, batch.direction, batch.flux
                for name in shared:
                    part[name] = _column(rays, name, batch)
                if by_ray:
                    part["wavelength"] = _column(rays, "wavelength", batch, rays.meaning.single_wavelength)
                if indexed:
                    own = _numbers(rays, spectra[number], batch)
                    # 0 is no spectrum: an index that was wrong in its file must not point into another's spectra.
                    part["spectrum_index"] = np.where((own >= 1) & (own <= len(spectra[number])), before + own, 0)
                yield part
            before += len(spectra[number])

    records = spool(parts(), dtype)
    meaning = dataclasses.replace(
        sets[0].meaning,
        declared_flux=None,
        stored_flux_scale=1.0,
        length_scale=1.0,
        wavelength_scale=1.0,
        spectra=tuple(s for own in spectra for s in own) if indexed else (),
        single_wavelength=single,
        header=_header(sets),
        copies=max(rays.meaning.copies for rays in sets),
        complaints=(
            *(
                _placed(told, rays)
                for rays, own in zip(sets, spectra, strict=True)
                for told in (*rays.complaints, *_losses(rays, dtype, single, own))
            ),
            *same.complaints([rays.provenance.source for rays in sets]),
        ),
        provenance=_provenance([rays.provenance for rays in sets]),
    )
    return type(sets[0]).from_records(records, meaning)


def _wavelengths(sets: Sequence[RayRecords]) -> tuple[float | None, bool]:
    """The wavelength that all sets share [nm], or whether each ray has one of its own."""
    singles = {None if "wavelength" in rays.columns else rays.meaning.single_wavelength for rays in sets}
    if len(singles) == 1 and None not in singles:
        return singles.pop(), False
    return None, all("wavelength" in rays.columns or rays.meaning.single_wavelength is not None for rays in sets)


def _spectra(rays: RayRecords, *, or_lines: bool) -> tuple[Spectrum, ...]:
    """The spectra that the rays of a set have, in the order of their numbers; nothing if they are not known.

    With `or_lines`, wavelengths go before them, as in `RaySet.in_unit`, each as a spectrum of one line.
    """
    if or_lines and "wavelength" in rays.columns:
        found = np.zeros(0)
        for batch in rays.batches():
            wavelength = _column(rays, "wavelength", batch)
            found = np.union1d(found, wavelength[(wavelength > 0.0) & np.isfinite(wavelength)])
            if found.size > MOST_LINES:
                break
        if 0 < found.size <= MOST_LINES:
            return tuple(_line(wavelength) for wavelength in found)
    elif or_lines and rays.meaning.single_wavelength is not None:
        return (_line(rays.meaning.single_wavelength),)
    known = len(rays.spectra) == 1 or "spectrum_index" in rays.columns
    return rays.spectra if known else ()


def _line(wavelength: float) -> Spectrum:
    return Spectrum(np.array([wavelength]), np.ones(1))


def _are_lines(rays: RayRecords, spectra: tuple[Spectrum, ...]) -> bool:
    """Whether these are not the set's spectra but its wavelengths."""
    return bool(spectra) and spectra is not rays.spectra


def _numbers(rays: RayRecords, spectra: tuple[Spectrum, ...], batch: RayBatch) -> npt.NDArray[Any]:
    """The number of the spectrum of each ray of a batch, from 1; 0 if its wavelength is not known."""
    if not _are_lines(rays, spectra):
        return _column(rays, "spectrum_index", batch, 1)
    lines = np.array([spectrum.wavelength[0] for spectrum in spectra])
    wavelength = _column(rays, "wavelength", batch, rays.meaning.single_wavelength)
    number: npt.NDArray[Any] = np.searchsorted(lines, wavelength)
    return np.where(lines[np.minimum(number, lines.size - 1)] == wavelength, number + 1, 0)


def _column(rays: RayRecords, name: str, batch: RayBatch, otherwise: float | None = None) -> npt.NDArray[Any]:
    """Values of a column for a batch's rays, or one value for all if the set does not have it."""
    if name not in rays.columns:
        return np.full(len(batch.flux), otherwise)
    return rays.column(name, slice(batch.start, batch.start + BATCH))[batch.usable]


def _labels(rays: RayRecords) -> tuple[str, ...]:
    return tuple(map(str, rays.header.get("additional_labels", ())))


def _header(sets: Sequence[RayRecords]) -> dict[str, Any]:
    """What all headers say alike in words: who made the set and how, not what a file of it would be like."""
    first, *others = (rays.header for rays in sets)

    def words(value: object) -> bool:
        return isinstance(value, str) or (isinstance(value, tuple) and all(isinstance(part, str) for part in value))

    return {
        name: value
        for name, value in first.items()
        if words(value) and all(other.get(name) == value for other in others)
    }


def _losses(
    rays: RayRecords, dtype: np.dtype[Any], single: float | None, spectra: tuple[Spectrum, ...]
) -> list[Complaint]:
    """What a set knows that records of `dtype` do not hold, because another set does not know it."""
    kept = [*(dtype.names or ())]
    if "spectrum_index" in kept and _are_lines(rays, spectra):
        kept.append("wavelength")
    lost = [name for name in rays.columns if name not in kept]
    if rays.meaning.single_wavelength not in (None, single) and "wavelength" not in (*kept, *lost):
        lost.append("wavelength")
    if rays.spectra and "spectrum_index" not in (*kept, *lost):
        lost.append("spectrum")
    found = f"left out, because not every merged set has it alike: {', '.join(lost)}"
    return [Complaint("note", "columns", found)] if lost else []


def _placed(complaint: Complaint, rays: RayRecords) -> Complaint:
    """The complaint with the name of the set that it is about."""
    return dataclasses.replace(complaint, place=f"{rays.provenance.source}, {complaint.place}")


def _provenance(origins: list[Provenance]) -> Provenance:
    return Provenance(
        source=" + ".join(origin.source for origin in origins),
        format=" + ".join(dict.fromkeys(origin.format for origin in origins)),
        fingerprint=" + ".join(origin.fingerprint for origin in origins if origin.fingerprint),
        steps=(*(f"{origin.source}: {step}" for origin in origins for step in origin.steps), "merged"),
    )
