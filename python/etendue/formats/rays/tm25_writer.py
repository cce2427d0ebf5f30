"""Writing TM-25 files: what the rays know decides which columns, tables and identifiers the file has."""

from __future__ import annotations

import datetime as dt
import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from etendue.errors import UnitError
from etendue.formats.rays.shared import (
    LARGEST_FLOAT,
    Colour,
    RayColour,
    Records,
    Written,
    losses,
    own_rows,
    write_records,
)
from etendue.formats.rays.tm25_layout import (
    CREATION_METHODS,
    DESCRIPTION_BYTES,
    DESCRIPTIONS,
    FLAGS,
    HEADER,
    LABEL_BYTES,
    MAGIC,
    START_POSITIONS,
    UNKNOWN,
    VERSIONS,
    Columns,
    Spectral,
    encode,
    padded,
)
from etendue.quantities.provenance import version
from etendue.quantities.ray_records import FLUX_COLUMNS
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.spectrum import Spectrum

SPECTRAL = {
    Colour.UNKNOWN: Spectral.NONE,
    Colour.SINGLE: Spectral.SINGLE,
    Colour.PER_RAY: Spectral.PER_RAY,
    Colour.ONE_SPECTRUM: Spectral.ONE_SPECTRUM,
    Colour.INDEXED: Spectral.INDEXED,
}
NEEDS_WATTS = (Colour.PER_RAY, Colour.INDEXED)
"""Knowledge that the standard allows only beside radiant flux alone (4.7.2)."""


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a TM-25 file: version 2013, or 2020 if the rays have Stokes parameters with their axis.

    The spectral identifier is the richest that the set knows. Rays with a wavelength or a spectrum each are written in
    watts, because the standard allows them only so; lumens become watts if their spectrum is known. The sum over the
    rays is the header's total; the other total is taken from the rays or the ratio in the set's own header, or computed
    from the spectrum.
    """
    rays, colour, notes = _in_writable_unit(rays)
    spectral, columns = _contents(rays, colour)
    header: Mapping[str, Any] = rays.header if isinstance(rays, RaySet) else {}
    spectra = colour.spectra if spectral in (Spectral.ONE_SPECTRUM, Spectral.INDEXED) else ()
    text = _text_block(header)
    by_spectrum = 0.0

    def fill(batch: RayBatch, records: Records) -> None:
        nonlocal by_spectrum
        _fill(rays, colour, batch, records)
        if colour.kind is not Colour.UNKNOWN:
            by_spectrum += _in_other_unit(rays, colour, batch)

    with path.open("wb") as file:
        file.write(bytes(HEADER.size))
        file.write(_flags(columns))
        file.write(_descriptions(rays, header))
        file.write(_tables(spectra))
        file.write(_labels(header, columns.additional))
        file.write(text)
        written = write_records(file, rays, columns.record, fill)
        other = _other_total(columns, header, written, by_spectrum if colour.kind is not Colour.UNKNOWN else math.nan)
        limits = _wavelength_limits(written, spectra)
        file.seek(0)
        file.write(
            HEADER.pack(
                MAGIC, VERSIONS[columns.axis], _creation_method(rays, header, notes),
                *((written.totals["flux"], other) if columns.luminous else (other, written.totals["flux"])),
                written.rays, _now(), _start_position(rays, header),
                spectral, colour.single if spectral == Spectral.SINGLE else UNKNOWN, *limits,
                len(spectra), columns.additional, len(text),
            )
        )  # fmt: skip
    kept = (*columns.widths, *(() if columns.luminous else ("radiant_flux",)))
    notes += losses(rays, written, colour, colour_kept=spectral == SPECTRAL[colour.kind], kept=kept)
    return tuple(notes)


# --- what is written -------------------------------------------------------------------------------------------------


def _in_writable_unit(rays: RayStream) -> tuple[RayStream, RayColour, list[str]]:
    """The rays in watts if only so all that is known of them can be written, and if that is possible."""
    colour = RayColour.of(rays)
    if not isinstance(rays, RaySet) or not wants_watts(rays):
        return rays, colour, []
    try:
        in_watts = rays.in_unit("W")
    except UnitError as error:
        return (
            rays,
            colour,
            [f"TM-25 has no place for wavelengths, spectra per ray and Stokes beside lumens; {error}"],
        )
    note = (
        "Lumens were turned into watts: beside lumens, TM-25 has no place for wavelengths, spectra per ray and Stokes."
    )
    return in_watts, RayColour.of(in_watts), [note]


def wants_watts(rays: RayStream) -> bool:
    """Whether only in watts all that a set in lumens knows could be written."""
    if not isinstance(rays, RaySet) or rays.flux_unit == "W" or _has_tristimulus(rays):
        return False
    lone_stokes = "stokes" in rays.columns and "radiant_flux" not in rays.columns
    return RayColour.of(rays).kind in NEEDS_WATTS or lone_stokes


def _has_tristimulus(rays: RaySet) -> bool:
    return rays.flux_unit == "lm" and {"tristimulus_x", "tristimulus_z"} <= set(rays.columns)


def _contents(rays: RayStream, colour: RayColour) -> tuple[Spectral, Columns]:
    """The spectral identifier and the columns, by the rules of 4.7.2."""
    watts = rays.flux_unit == "W"
    if not isinstance(rays, RaySet):
        drawn = SPECTRAL[colour.kind] if watts or colour.kind not in NEEDS_WATTS else Spectral.NONE
        return drawn, Columns(radiant=watts, wavelength=drawn == Spectral.PER_RAY, luminous=not watts)
    tristimulus = _has_tristimulus(rays)
    expressible = watts or (colour.kind not in NEEDS_WATTS and not tristimulus)
    spectral = SPECTRAL[colour.kind] if expressible else Spectral.NONE
    radiant = watts or "radiant_flux" in rays.columns
    stokes = radiant and "stokes" in rays.columns
    columns = Columns(
        radiant=radiant,
        wavelength=spectral == Spectral.PER_RAY,
        luminous=not watts,
        stokes=stokes,
        axis=stokes and "polarisation_axis" in rays.columns,
        tristimulus=tristimulus,
        index=spectral == Spectral.INDEXED,
        additional=math.prod(rays.records.dtype["additional"].shape) if "additional" in rays.columns else 0,
    )
    return spectral, columns


def _fill(rays: RayStream, colour: RayColour, batch: RayBatch, records: Records) -> None:
    """Set all columns but position, direction and flux."""
    for name in records.dtype.names or ():
        if name == "wavelength":
            records[name] = colour.wavelength(batch)
        elif not isinstance(rays, RaySet):
            continue
        elif name in FLUX_COLUMNS:
            records[name] = own_rows(batch, rays, name) * rays.flux_scale
        elif name in rays.columns:
            records[name] = own_rows(batch, rays, name).reshape(records[name].shape)


def _in_other_unit(rays: RayStream, colour: RayColour, batch: RayBatch) -> float:
    """Flux of a batch in lumens if the rays carry watts, else in watts; not finite if V(λ) is 0 for some."""
    efficacy = colour.efficacy(batch)
    if rays.flux_unit == "W":
        return float(batch.flux @ efficacy)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float((batch.flux / efficacy).sum())


# --- header ----------------------------------------------------------------------------------------------------------


def _other_total(columns: Columns, header: Mapping[str, Any], written: Written, by_spectrum: float) -> float:
    """The total in the unit that is not the flux column's, or NaN (4.7.1.4, 4.7.1.5)."""
    total = written.totals["flux"]
    names = ("luminous_flux", "radiant_flux") if columns.luminous else ("radiant_flux", "luminous_flux")
    own, other = (header.get(name) for name in names)
    if columns.radiant and columns.luminous:
        result = written.totals["radiant_flux"]
    elif isinstance(own, float) and isinstance(other, float) and {"total_flux", "overruled_total_flux"} & set(header):
        # The rays are still those of the file, so the ratio of its two totals still holds.
        result = total * other / own
    else:
        result = by_spectrum
    return result if 0 < result <= LARGEST_FLOAT else UNKNOWN


def _wavelength_limits(written: Written, spectra: tuple[Spectrum, ...]) -> tuple[float, float]:
    """Lowest and highest wavelength [nm] (4.7.1.11, 4.7.1.12)."""
    if "wavelength" in written.lowest:
        return written.lowest["wavelength"], written.highest["wavelength"]
    if spectra:
        return min(s.wavelength[0] for s in spectra), max(s.wavelength[-1] for s in spectra)
    return UNKNOWN, UNKNOWN


def _creation_method(rays: RayStream, header: Mapping[str, Any], notes: list[str]) -> int:
    """Simulation or measurement (4.7.1.3)."""
    for number, name in CREATION_METHODS.items():
        if header.get("creation_method") == name:
            return number
    if rays.provenance.format != "synthetic":
        notes.append("The set does not say whether it was measured; the file says that it was simulated.")
    return 0


def _start_position(rays: RayStream, header: Mapping[str, Any]) -> int:
    """What kind of surface the rays start on (4.7.1.8); unknown once anything was done to them."""
    stated = header.get("start_position")
    return START_POSITIONS.index(stated) if stated in START_POSITIONS and not rays.provenance.steps else 0


def _now() -> bytes:
    """Date, time and time zone after ISO 8601 (4.7.1.7)."""
    return dt.datetime.now().astimezone().isoformat(timespec="seconds").encode("ascii")


def _flags(columns: Columns) -> bytes:
    """The known-data flags (4.7.2)."""
    c = columns
    return FLAGS.pack(True, True, c.radiant, c.wavelength, c.luminous, c.stokes, c.tristimulus, c.index)


def _descriptions(rays: RayStream, header: Mapping[str, Any]) -> bytes:
    """The nine descriptions (4.7.3): what the set's header says, who wrote this file, and what was done before."""
    texts = {name: str(header.get(name, "")) for name in DESCRIPTIONS}
    texts["light_source"] = texts["light_source"] or rays.provenance.source
    texts["creator"] = f"etendue {version()}"
    texts["information"] = "; ".join(part for part in (texts["information"], *rays.provenance.steps) if part)
    return b"".join(encode(texts[name], DESCRIPTION_BYTES) for name in DESCRIPTIONS)


def _tables(spectra: tuple[Spectrum, ...]) -> bytes:
    """The spectral tables (4.7.4), padded once at their end."""
    tables = b"".join(
        struct.pack("<i", len(s.wavelength)) + np.column_stack([s.wavelength, s.weight]).astype("<f4").tobytes()
        for s in spectra
    )
    return tables.ljust(padded(len(tables)), b"\0")


def _labels(header: Mapping[str, Any], count: int) -> bytes:
    """The labels of additional columns (4.7.5)."""
    known = tuple(map(str, header.get("additional_labels", ())))
    labels = known if len(known) == count else tuple(f"additional {i + 1}" for i in range(count))
    return b"".join(encode(label, LABEL_BYTES) for label in labels)


def _text_block(header: Mapping[str, Any]) -> bytes:
    """The additional text (4.7.6), or nothing."""
    text = str(header.get("additional_text", ""))
    return encode(text, padded(4 * (len(text) + 1))) if text else b""
