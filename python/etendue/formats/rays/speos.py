"""Speos binary ray files (``.ray``): 28 bytes of header, then records of 32 bytes.

The header is the total radiant flux [W], five markers of 2.0, and the total luminous flux [lm]. A record is a position
[mm], a direction, a wavelength [nm] and a relative energy. There is no number of rays: it follows from the file's size.
All values are little-endian 32-bit floats.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from etendue.errors import ArgumentError, FormatError, UnsupportedFormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.rays.ray_format import RayFormat, stored_records
from etendue.formats.rays.shared import (
    LARGEST_FLOAT,
    RayColour,
    Records,
    losses,
    read_bytes,
    stated_total,
    wavelength_complaints,
    write_records,
)
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint

CLAUSE = "Ansys Speos help, Contents of Ray Files"

HEADER = struct.Struct("<7f")
MARKER = 2.0
"""Each of the five floats that tell an unpolarised Speos file."""

LARGEST_MARKER = 9.0
RECORD = np.dtype([("position", "<f4", 3), ("direction", "<f4", 3), ("wavelength", "<f4"), ("flux", "<f4")])


def recognise(head: Head) -> bool:
    """By the five markers: small whole numbers between two totals. Other numbers than 2 are refused on reading."""
    if len(head.data) < HEADER.size:
        return False
    watts, *markers, lumens = HEADER.unpack_from(head.data)
    totals = all(np.isfinite(value) and value >= 0 for value in (watts, lumens))
    return totals and all(1.0 <= marker <= LARGEST_MARKER and marker == int(marker) for marker in markers)


def read(path: Path) -> RaySet:
    """Map a Speos binary ray file. The rays' energies are relative and are scaled to the header's watts.

    Raises
    ------
    UnsupportedFormatError
        If the markers are not those of an unpolarised file.
    FormatError
        If there is not one whole ray.
    """
    data = read_bytes(path, 0, HEADER.size, "header")
    markers = HEADER.unpack(data)[1:6]
    if any(marker != MARKER for marker in markers):
        raise UnsupportedFormatError(
            path, "byte 4", f"the format markers are {markers}, not 2.0 each: a polarised or unknown Speos format",
            "Export it without polarisation, or as TM-25.",
        )  # fmt: skip
    size = path.stat().st_size
    count, stray = divmod(size - HEADER.size, RECORD.itemsize)
    if count < 1:
        raise FormatError(path, f"byte {size}", "there is not one whole ray", "The file is empty or truncated.")
    records = stored_records(path, RECORD, HEADER.size, count)
    watts, lumens = stated_total(data[0:4]), stated_total(data[24:28])
    complaints = []
    if stray:
        found = (
            f"the file ends {stray} bytes into ray {count + 1:,}: it is truncated; how many rays are missing is unknown"
        )
        complaints.append(Complaint("error", f"byte {size}", found, CLAUSE))
    if watts is None:
        found = (
            "the header does not know the total flux; the rays' energies are relative: give the total, --flux 0.7W, "
            "or flux= in Python"
        )
        complaints.append(Complaint("warning", "byte 0", found, CLAUSE))
    header = {name: value for name, value in (("total_flux", watts), ("luminous_flux", lumens)) if value is not None}
    meaning = RaySetMeaning(
        flux_unit="W",
        declared_flux=watts,
        relative_by_format=True,
        header=header,
        complaints=(*complaints, *wavelength_complaints(records, CLAUSE)),
        provenance=file_provenance(path, "speos"),
    )
    return RaySet.from_records(records, meaning)


def write(rays: RayStream, path: Path) -> tuple[str, ...]:
    """Write a Speos binary ray file; the header carries the totals in watts and lumens."""
    rays, notes = in_watts(rays, "'lighttools', which Speos reads as well and gives a spectrum")
    colour = RayColour.of(rays)
    # Energies lie between 0 and 1. Watts that do so already are left as they are: then they also sum to the header's.
    largest = largest_flux(rays)
    scale = 1 / largest if largest > 1 else 1.0
    lumens = 0.0

    def fill(batch: RayBatch, records: Records) -> None:
        nonlocal lumens
        records["wavelength"] = colour.wavelength(batch)
        lumens += float(batch.flux @ colour.efficacy(batch))

    with path.open("wb") as file:
        file.write(bytes(HEADER.size))
        written = write_records(file, rays, RECORD, fill, scale)
        file.seek(0)
        file.write(HEADER.pack(written.totals["flux"] / scale, *(MARKER,) * 5, min(lumens, LARGEST_FLOAT)))
    notes += losses(rays, written, colour, colour_kept=True, kept=("radiant_flux",))
    return tuple(notes)


def largest_flux(rays: RayStream) -> float:
    """Flux of the strongest ray [`flux_unit`]; costs one pass, the first time of a ray set."""
    if isinstance(rays, RaySet):
        return rays.moments().flux_range[1] * rays.flux_scale
    return max(float(batch.flux.max(initial=0.0)) for batch in rays.batches())


def in_watts(rays: RayStream, instead: str) -> tuple[RayStream, list[str]]:
    """The rays as a Speos file, binary or text, holds them: in watts, with a wavelength each; and what was done.

    Raises
    ------
    ArgumentError
        If they have no wavelengths, or are drawn in lumens; says what to do instead.
    UnitError
        If they carry lumens at wavelengths where V(λ) is 0.
    """
    colour = RayColour.of(rays)
    if not colour.has_wavelengths:
        raise ArgumentError(
            f"{rays.provenance.source}: a Speos file holds the wavelength of every ray, but this set has rays with "
            f"{colour.kind.value}. Write {instead}; or, if all rays have one wavelength, say so in Python: "
            "RaySet.with_spectrum(Spectrum([wavelength], [1]))."
        )
    if rays.flux_unit == "W":
        return rays, []
    if not isinstance(rays, RaySet):
        raise ArgumentError(
            f"{rays.provenance.source}: a Speos file holds watts, and these rays are drawn in lumens. Fit the light field "
            f"to rays in watts (etendue fit --unit W), or write {instead}."
        )
    return rays.in_unit("W"), ["Lumens were turned into watts through the wavelengths: Speos energies are radiant."]


FORMAT = RayFormat("speos", "Speos binary ray file", (".ray",), recognise, read, write, unit="W")
"""Speos binary ray files."""
