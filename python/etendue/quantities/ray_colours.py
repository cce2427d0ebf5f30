"""The colours of a ray set's rays: the wavelength of each, and the spectrum of all of them together."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.ray_records import RayRecords
from etendue.quantities.ray_rewriting import column_of
from etendue.quantities.ray_stream import FloatArray, Progress, RayBatch, checked_threads
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum

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


def colour_column(rays: RayRecords) -> str | None:
    """The column that tells the colour of each ray, if there is one: ``wavelength`` or ``spectrum_index``."""
    if "wavelength" in rays.columns:
        return "wavelength"
    # One wavelength for all goes before spectra, as in `RaySet.in_unit`.
    indexed = "spectrum_index" in rays.columns and rays.spectra and rays.meaning.single_wavelength is None
    return "spectrum_index" if indexed else None


def coloured_source(rays: RayRecords) -> Any:
    """The records as the compiled core takes them, with the column that tells the colours of the rays, if any."""
    name = colour_column(rays)
    if name is None:
        return rays.core_source()
    field, offset = rays.records.dtype.fields[name][:2]  # type: ignore[index]
    if field.str not in STORED_AS[name]:
        raise ArgumentError(
            f"RaySet: the field {name!r} is {field.str!r}; the wavelengths of rays are read from "
            f"{' or '.join(map(repr, STORED_AS[name]))}."
        )
    scale = rays.meaning.wavelength_scale if name == "wavelength" else 1.0
    return rays.core_table((offset, field.str, scale))


def wavelength_of(rays: RayRecords, batch: RayBatch) -> FloatArray | None:
    """Wavelength of each ray of a batch [nm], shape (k,); None if the set does not know it."""
    if "wavelength" in rays.columns:
        wavelength: FloatArray = column_of(rays, batch, "wavelength")
        return wavelength
    single = rays.meaning.single_wavelength
    return None if single is None else np.full(len(batch.flux), single)


def scan_colours(rays: RayRecords, progress: Progress | None, threads: int | None) -> Colours | None:
    """One pass over the rays for what their own colours amount to; None if they have none of their own."""
    column = colour_column(rays)
    if column is None:
        return None
    found = _core.scan_colours(coloured_source(rays), checked_threads(threads), progress)
    return _by_number(rays, found) if column == "spectrum_index" else _by_line(rays, found)


def shared_spectrum(rays: RayRecords) -> Spectrum | None:
    """The one spectrum of rays that have no colours of their own; None if it is not known."""
    if rays.meaning.single_wavelength is not None:
        return Spectrum(np.array([rays.meaning.single_wavelength]), np.array([1.0]))
    return rays.spectra[0] if len(rays.spectra) == 1 else None


def _by_line(rays: RayRecords, found: _core._Colours) -> Colours:
    """Colours that are wavelengths."""
    flux = np.asarray(found["flux"])
    unknown, colourless = found["unknown"]
    total = float(flux.sum()) + unknown
    lit = flux > 0.0
    lines = SpectralLines(np.asarray(found["mean"])[lit], flux[lit], rays.flux_unit) if lit.any() else None
    ends = (float(np.min(found["low"])), float(np.max(found["high"]))) if flux.size else None
    return Colours(lines, ends, colourless, unknown / total if total > 0.0 else 0.0)


def _by_number(rays: RayRecords, found: _core._Colours) -> Colours:
    """Colours that are numbers of spectra."""
    number, flux = np.asarray(found["mean"]).astype(np.int64), np.asarray(found["flux"])
    unknown, colourless = found["unknown"]
    there = number <= len(rays.spectra)
    total = float(flux.sum()) + unknown
    unknown += float(flux[~there].sum())
    if not there.all():
        # The pass counts flux, not rays, by number; numbers that point nowhere are rare enough to count once more.
        colourless = sum(
            int(((part < 1) | (part > len(rays.spectra))).sum())
            for part in (column_of(rays, batch, "spectrum_index") for batch in rays.batches())
        )
    parts = [
        (*rays.spectra[k - 1].lines(rays.flux_unit), float(f))
        for k, f in zip(number[there], flux[there], strict=True)
        if f > 0.0
    ]
    lines = SpectralLines.mixed(parts, rays.flux_unit) if parts else None
    ends = None if lines is None else (float(lines.wavelength[0]), float(lines.wavelength[-1]))
    return Colours(lines, ends, colourless, unknown / total if total > 0.0 else 0.0)
