"""What ray formats share: totals that may be unknown, counts that must fit the file, records written in stretches.

Also what the colour of rays is, and the account of what a file does not say.
"""

from __future__ import annotations

import dataclasses
import enum
import math
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, FormatError
from etendue.quantities.file_records import AnyRecords
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.units import LUMINOUS_EFFICACY_MAX

FloatArray = npt.NDArray[np.float64]
Records = npt.NDArray[Any]

SWAPPED_NAN = 0x0100807F
"""The signalling NaN 0x7F800001 with its bytes reversed, as one LED maker writes it: 2.36e-38, and still unknown."""

GEOMETRY_BYTES = 28
"""Bytes of seven 32-bit columns, x y z, direction and flux: the shortest record a format with positions has."""

LARGEST_FLOAT = float(np.finfo(np.float32).max)
"""Largest value that a column or a header can hold."""

CHECKED_RAYS = 1 << 18
"""Rays whose wavelengths are looked at when a file is opened; all of them may be 28 GB."""

STRETCH = 1 << 18
"""Rays per stretch of a pass over one column."""


# --- reading ---------------------------------------------------------------------------------------------------------


def read_bytes(path: Path, offset: int, count: int, what: str) -> bytes:
    """`count` bytes from `offset`.

    Raises
    ------
    FormatError
        If the file ends before; found before anything is allocated.
    """
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        data = b""
        if offset + count <= size:
            file.seek(offset)
            data = file.read(count)
    if len(data) < count:
        raise FormatError(
            path, f"byte {size}", f"the file ends inside its {what}, which reaches to byte {offset + count:,}",
            "The file is truncated; ask for it again.",
        )  # fmt: skip
    return data


def stated_total(data: bytes) -> float | None:
    """The total flux in four bytes of a header, or None if they say that it is unknown.

    Unknown are NaN of any payload, 0 (LightTools), negative and infinite values, and the NaN that Lumileds writes with
    its bytes reversed, which is told by its exact bit pattern.

    Examples
    --------
    >>> stated_total(bytes.fromhex("0000803f")), stated_total(bytes.fromhex("7f800001"))
    (1.0, None)
    """
    (bits,) = struct.unpack("<I", data)
    (value,) = struct.unpack("<f", data)
    return float(value) if bits != SWAPPED_NAN and math.isfinite(value) and value > 0 else None


def text(data: bytes) -> str:
    """The text in a fixed field of 8-bit characters that is padded with NULs or blanks."""
    return data.split(b"\0", 1)[0].decode("latin-1").strip()


def whole_records(path: Path, start: int, width: int, stated: int, clause: str) -> tuple[int, tuple[Complaint, ...]]:
    """How many records there are, from what the header states and what the file's size allows.

    A file that ends early keeps the whole records that are there, and a complaint of severity ``error`` tells what is
    lost. A file whose size fits another record width is refused: its columns are not those that the header describes.

    Parameters
    ----------
    path : Path
        For the size and for errors.
    start, width : int
        First byte of the records, bytes of each.
    stated : int
        Number of records according to the header.
    clause : str
        For the complaints.

    Returns
    -------
    count : int
        Whole records that are there, at least 1.
    complaints : tuple of Complaint
        Empty if the header is right.

    Raises
    ------
    FormatError
        If the size contradicts the header otherwise than by truncation, or not one whole record is there.
    """
    size = path.stat().st_size
    body = size - start
    described = f"{stated:,} records of {width} bytes from byte {start:,}"
    if stated < 1 or body < width:
        raise FormatError(
            path, f"byte {size}", f"the header describes {described}; not one is there",
            "The file is empty or truncated; ask for it again.",
        )  # fmt: skip
    if body == stated * width:
        return stated, ()
    other, rest = divmod(body, stated)
    surplus = body - stated * width
    if (rest == 0 and other % 4 == 0 and other >= GEOMETRY_BYTES) or surplus >= width:
        raise FormatError(
            path, f"byte {start}", f"the header describes {described}, but {body:,} bytes follow",
            "The columns or the number of rays are not those of the header; ask the file's author to export it again.",
        )  # fmt: skip
    if surplus > 0:
        found = f"{surplus} surplus bytes after the last of {described}; they are ignored"
        return stated, (Complaint("warning", f"byte {start + stated * width}", found, clause),)
    count, stray = divmod(body, width)
    found = (
        f"the header describes {described}, but the file ends after {count:,} of them and {stray} bytes of the next; "
        f"rays missing: {stated - count:,}"
    )
    return count, (Complaint("error", f"byte {size}", found, clause),)


def wavelength_complaints(records: AnyRecords, clause: str) -> tuple[Complaint, ...]:
    """A complaint if among the first `CHECKED_RAYS` rays there are wavelengths that are none."""
    if "wavelength" not in (records.dtype.names or ()):
        return ()
    head = records[:CHECKED_RAYS]["wavelength"]
    bad = int((~(np.isfinite(head) & (head > 0))).sum())
    if not bad:
        return ()
    found = f"{bad:,} of the first {len(head):,} rays have a wavelength that is not above 0; their colour is unknown"
    return (Complaint("warning", "rays", found, clause),)


# --- writing ---------------------------------------------------------------------------------------------------------


@dataclasses.dataclass
class Written:
    """What was written, as stored in 32-bit floats.

    Parameters
    ----------
    rays : int
    dark_rays : int
        Rays without flux among them.
    totals, lowest, highest : dict
        Sum and extremes of each scalar column of floats by its name.
    """

    rays: int = 0
    dark_rays: int = 0
    totals: dict[str, float] = dataclasses.field(default_factory=dict)
    lowest: dict[str, float] = dataclasses.field(default_factory=dict)
    highest: dict[str, float] = dataclasses.field(default_factory=dict)

    def add(self, records: Records) -> None:
        """Account for one more stretch."""
        self.rays += len(records)
        self.dark_rays += int((records["flux"] == 0).sum())
        for name in records.dtype.names or ():
            values = records[name]
            if values.ndim == 1 and values.dtype.kind == "f" and len(values):
                self.totals[name] = self.totals.get(name, 0.0) + float(values.sum(dtype=np.float64))
                self.lowest[name] = min(self.lowest.get(name, math.inf), float(values.min()))
                self.highest[name] = max(self.highest.get(name, -math.inf), float(values.max()))


def write_records(
    file: BinaryIO,
    rays: RayStream,
    dtype: np.dtype[Any],
    fill: Callable[[RayBatch, Records], None] = lambda _batch, _records: None,
    flux_scale: float = 1.0,
) -> Written:
    """Write the usable rays of a stream, stretch by stretch.

    Parameters
    ----------
    file : binary file
        At the first byte of the records.
    rays : RayStream
        What to write.
    dtype : structured dtype
        Of a record as stored. Its fields ``position`` (if there), ``direction`` and ``flux`` are set here.
    fill : callable
        Sets the other fields of a stretch.
    flux_scale : float
        Stored flux per flux of the stream.

    Returns
    -------
    Written

    Raises
    ------
    ArgumentError
        If there is no usable ray, or a value does not fit into the 32-bit floats of the format.
    """
    written, exact = Written(), 0.0
    for batch in rays.batches():
        records = np.zeros(len(batch.flux), dtype)
        try:
            with np.errstate(over="raise"):
                if "position" in (dtype.names or ()):
                    records["position"] = batch.position
                records["direction"], records["flux"] = batch.direction, batch.flux * flux_scale
                fill(batch, records)
        except FloatingPointError as error:
            raise ArgumentError(
                f"{rays.provenance.source}: beyond ray {batch.start:,} a value is above 3.4e38, the largest 32-bit "
                "float, which is what the file holds. Check the set's units."
            ) from error
        exact += float(batch.flux.sum())
        written.add(records)
        file.write(records.tobytes())
    if written.rays == 0:
        raise ArgumentError(
            f"{rays.provenance.source}: not one of {len(rays):,} rays is usable; there is nothing to write."
        )
    _require_total(rays, exact, written.totals["flux"] / flux_scale)
    return written


def _require_total(rays: RayStream, exact: float, stored: float) -> None:
    """Refuse a total flux that a 32-bit header cannot say, or that 32-bit rays have lost."""
    header = float(np.float32(min(stored, LARGEST_FLOAT)))
    if stored > LARGEST_FLOAT or abs(header - exact) > 1e-4 * exact:
        wrong = "large" if stored > LARGEST_FLOAT else "small"
        raise ArgumentError(
            f"{rays.provenance.source}: a flux of {exact:.4g} {rays.flux_unit} is too {wrong} for 32-bit floats, which "
            "is what the file holds. Give another total: --flux 54.6lm, or RaySet.with_total_flux in Python."
        )


def batch_rows(batch: RayBatch) -> slice:
    """The stretch of records that a batch was made of; its `usable` tells which of them it holds."""
    return slice(batch.start, batch.start + len(batch.usable))


def own_rows(batch: RayBatch, rays: RaySet, name: str) -> npt.NDArray[Any]:
    """The stored values of a column that belong to a batch's usable rays, as f64 if they are floats."""
    values: npt.NDArray[Any] = rays.records[batch_rows(batch)][name][batch.usable]
    with np.errstate(invalid="ignore"):  # a signalling NaN is as good as a quiet one
        return values.astype(np.float64) if values.dtype.kind == "f" else values


class Colour(enum.Enum):
    """What a stream knows of the spectrum of its rays; the value completes the sentence "rays with …"."""

    UNKNOWN = "no known spectrum"
    PER_RAY = "a wavelength each"
    SINGLE = "a single wavelength"
    ONE_SPECTRUM = "one spectrum for all"
    INDEXED = "spectra by index"


@dataclasses.dataclass(frozen=True)
class RayColour:
    """What a stream knows of the spectrum of its rays, and how to get at it.

    Parameters
    ----------
    rays : RayStream
    kind : Colour
    notes : tuple of str
        What was wrong with knowledge that is therefore not used.
    single : float or None
        The wavelength [nm] that all rays share, if that is the `kind`; a spectrum of one line is one, too.
    """

    rays: RayStream
    kind: Colour
    notes: tuple[str, ...] = ()
    single: float | None = None

    @classmethod
    def of(cls, rays: RayStream) -> RayColour:
        """Look at a stream. Columns are checked in one pass: a single impossible wavelength makes them unusable."""
        if not isinstance(rays, RaySet):
            return cls._of_drawn(rays)
        if "wavelength" in rays.columns:
            if all((np.isfinite(part) & (part > 0)).all() for part in _stretches(rays, "wavelength")):
                return cls(rays, Colour.PER_RAY)
            return cls(rays, Colour.UNKNOWN, ("Some wavelengths are not above 0; the column is not written.",))
        one = rays.spectra[0] if len(rays.spectra) == 1 and "spectrum_index" not in rays.columns else None
        if rays.meaning.single_wavelength is not None:
            return cls(rays, Colour.SINGLE, single=rays.meaning.single_wavelength)
        if one is not None and one.wavelength.size == 1:
            return cls(rays, Colour.SINGLE, single=float(one.wavelength[0]))
        if "spectrum_index" in rays.columns and rays.spectra:
            known = len(rays.spectra)
            if all(((part >= 1) & (part <= known)).all() for part in _stretches(rays, "spectrum_index")):
                return cls(rays, Colour.INDEXED)
            note = f"Some rays point to a spectrum outside 1..{known}; spectra and indices are not written."
            return cls(rays, Colour.UNKNOWN, (note,))
        return cls(rays, Colour.UNKNOWN if one is None else Colour.ONE_SPECTRUM)

    @classmethod
    def _of_drawn(cls, rays: RayStream) -> RayColour:
        """Of a stream that draws its rays."""
        spectrum = rays.total_spectrum()
        if spectrum is None:
            return cls(rays, Colour.UNKNOWN)
        if spectrum.wavelength.size == 1:
            return cls(rays, Colour.SINGLE, single=float(spectrum.wavelength[0]))
        return cls(rays, Colour.ONE_SPECTRUM if isinstance(spectrum, Spectrum) else Colour.PER_RAY)

    @property
    def spectra(self) -> tuple[Spectrum, ...]:
        """The spectrum of all rays, or those that their indices count."""
        if isinstance(self.rays, RaySet):
            return self.rays.spectra
        spectrum = self.rays.total_spectrum()
        return (spectrum,) if isinstance(spectrum, Spectrum) else ()

    @property
    def has_wavelengths(self) -> bool:
        """Whether each ray has a known wavelength."""
        return self.kind in (Colour.PER_RAY, Colour.SINGLE)

    def wavelength(self, batch: RayBatch) -> FloatArray:
        """Wavelength [nm] of a batch's rays, shape (k,); only if `has_wavelengths`."""
        if self.single is not None:
            return np.full(len(batch.flux), self.single)
        wavelength = self.rays.wavelength_of(batch)
        assert wavelength is not None  # noqa: S101 - see `has_wavelengths`
        return wavelength

    def efficacy(self, batch: RayBatch) -> FloatArray:
        """Luminous efficacy of radiation [lm/W] of a batch's rays, shape (k,); only if the `kind` is known."""
        if self.has_wavelengths:
            return LUMINOUS_EFFICACY_MAX * photopic_efficiency(self.wavelength(batch))
        table = np.array([spectrum.luminous_efficacy for spectrum in self.spectra])
        if self.kind is Colour.ONE_SPECTRUM:
            return np.full(len(batch.flux), table[0])
        rays = self.rays
        assert isinstance(rays, RaySet)  # noqa: S101 - other streams have no spectra by index
        values: FloatArray = table[rays.column("spectrum_index", batch_rows(batch))[batch.usable] - 1]
        return values


def _stretches(rays: RaySet, column: str) -> Iterator[npt.NDArray[Any]]:
    return (rays.column(column, slice(start, start + STRETCH)) for start in range(0, len(rays), STRETCH))


def losses(
    rays: RayStream, written: Written, colour: RayColour, *, colour_kept: bool, kept: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """What a file does not say that the stream knew, one sentence each.

    Parameters
    ----------
    rays : RayStream
        What was to be written.
    written : Written
        What was written.
    colour : RayColour
        Of the stream.
    colour_kept : bool
        Whether the file says what `colour` knows.
    kept : tuple of str
        Further columns that the file holds.
    """
    notes = list(colour.notes)
    unusable = len(rays) - written.rays
    if unusable:
        notes.append(
            f"{unusable:,} of {len(rays):,} rays are not written: a value is not finite, the direction is missing or "
            "the flux is negative."
        )
    if not colour_kept and colour.kind is not Colour.UNKNOWN:
        notes.append(f"The set has rays with {colour.kind.value}; the file does not say so.")
    of_colour = ("wavelength", "spectrum_index")
    lost = [c for c in (rays.columns if isinstance(rays, RaySet) else ()) if c not in (*kept, *of_colour)]
    if lost:
        notes.append(f"Not written, because the format has no place for it: {', '.join(lost)}.")
    return tuple(notes)
