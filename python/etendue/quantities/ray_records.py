"""Rays as they are stored, in memory or in a file: columns, their meaning, and the flux account of a pass over them."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.arguments import require, require_fields, require_known
from etendue.quantities.file_records import AnyRecords, FileRecords
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import FloatArray, Progress, RayStream, Tally, checked_threads
from etendue.quantities.repeated_rays import Repeats
from etendue.quantities.report import Complaint, RayFileWarning, Severity
from etendue.quantities.spectrum import Spectrum
from etendue.units import FLUX_UNITS, FluxUnit

GEOMETRY_COLUMNS = {"position": (3,), "direction": (3,), "flux": ()}
"""The columns of every ray, with the shape of each value."""

EXTRA_COLUMNS: dict[str, str] = {
    "wavelength": "nm",
    "radiant_flux": "W",
    "stokes": "1",
    "polarisation_axis": "1",
    "tristimulus_x": "lm",
    "tristimulus_z": "lm",
    "spectrum_index": "1",
    "additional": "1",
}
"""Further columns a ray may have, with their units. ``spectrum_index`` counts from 1 into `RaySet.spectra`; those of
`FLUX_COLUMNS` are stored on the scale of the flux."""

FLUX_COLUMNS = ("radiant_flux", "tristimulus_x", "tristimulus_z")
"""Columns that are stored on the scale of the flux: whatever scales a ray's flux scales them."""

FLUX_TOLERANCE = 1e-3
"""Relative disagreement between a header's total flux and the sum over its rays that becomes a warning."""


@dataclasses.dataclass(frozen=True)
class Moments:
    """What a full pass over a ray set tells beside the tally; see `RaySet.moments`."""

    flux_range: tuple[float, float]
    bounds: FloatArray
    weighted_position: FloatArray
    weighted_direction: FloatArray
    weighted_outer: FloatArray
    focus_rhs: FloatArray


@dataclasses.dataclass(frozen=True)
class RaySetMeaning:
    """What the columns of a ray set's records mean.

    Parameters
    ----------
    flux_unit : {"lm", "W"}
    declared_flux : float or None
        Total flux [`flux_unit`] that the rays share in proportion to their stored flux; None: the stored flux times
        `stored_flux_scale` is absolute.
    relative_by_format : bool
        Whether the format defines its flux values as relative, so that no agreement with `declared_flux` is expected.
    stored_flux_scale : float
        Factor from stored to absolute flux when `declared_flux` is None.
    length_scale : float
        Millimetres per stored unit of length.
    wavelength_scale : float
        Nanometres per stored unit of wavelength.
    spectra : tuple of Spectrum
        One for the whole set, or those that ``spectrum_index`` counts.
    single_wavelength : float or None
        [nm], of all rays.
    header : mapping
        Facts of the file's header under plain names, for people: creator, date, labels, header totals.
    complaints : tuple of Complaint
        What the reader had to say.
    provenance : Provenance
    copies : float
        How many copies of a ray there are on average where they are most, of rays traced from a set with more rays than it
        holds: only rays that are no copies are independent of each other.
    notes : tuple of str
        What all that is made of the rays should tell.
    """

    flux_unit: FluxUnit = "lm"
    declared_flux: float | None = None
    relative_by_format: bool = False
    stored_flux_scale: float = 1.0
    length_scale: float = 1.0
    wavelength_scale: float = 1.0
    spectra: tuple[Spectrum, ...] = ()
    single_wavelength: float | None = None
    header: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    complaints: tuple[Complaint, ...] = ()
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    copies: float = 1.0
    notes: tuple[str, ...] = ()


class RayRecords(RayStream):
    """Rays as they are stored, with what their columns mean."""

    @classmethod
    def from_records(cls, records: AnyRecords, meaning: RaySetMeaning) -> Self:
        """A ray set over structured records, without copying.

        Parameters
        ----------
        records : structured array, shape (n,), contiguous, or FileRecords
            Little-endian fields ``direction`` (3,), ``flux`` and, but for far-field sets, ``position`` (3,), all f4 or
            all f8, and any of `EXTRA_COLUMNS`.
        meaning : RaySetMeaning
            What the fields mean.

        Raises
        ------
        ArgumentError
            If the records are not one contiguous row, or a field is missing or of another type or shape.
        UnknownNameError
            If a field or the flux unit is unknown.
        """
        rays = cls.__new__(cls)
        rays._adopt(records, meaning)  # noqa: SLF001 - an alternative constructor
        return rays

    def _adopt(self, records: AnyRecords, meaning: RaySetMeaning) -> None:
        fields: Mapping[str, Any] = records.dtype.fields or {}
        require_known(meaning.flux_unit, FLUX_UNITS, "flux unit")
        require(meaning.provenance, Provenance, "RaySet: provenance", "a Provenance, or leave it out")
        for name in fields:
            if name not in GEOMETRY_COLUMNS and name not in EXTRA_COLUMNS:
                raise UnknownNameError("ray column", name, (*GEOMETRY_COLUMNS, *EXTRA_COLUMNS))
        if "direction" not in fields or "flux" not in fields:
            raise ArgumentError("RaySet: records need the fields 'direction' and 'flux'.")
        if isinstance(records, np.ndarray) and (records.ndim != 1 or not records.flags.c_contiguous):
            raise ArgumentError(
                f"RaySet: records of shape {records.shape} and strides {records.strides} are not one contiguous row; "
                "copy them with numpy.ascontiguousarray, flat."
            )
        for name, shape in GEOMETRY_COLUMNS.items():
            if name in fields and fields[name][0].shape != shape:
                raise ArgumentError(
                    f"RaySet: the field {name!r} has shape {fields[name][0].shape}; it must be {shape}."
                )
        floats = {fields[name][0].base for name in GEOMETRY_COLUMNS if name in fields}
        if len(floats) != 1 or floats.isdisjoint({np.dtype("<f4"), np.dtype("<f8")}):
            raise ArgumentError("RaySet: position, direction and flux must be all '<f4' or all '<f8'.")
        self._records = records
        self._meaning = meaning
        self._tally: Tally | None = None
        self._moments: Moments | None = None
        self._repeats: Repeats | None = None

    def replace(self, **changes: Any) -> Self:
        """A set over the same records with some fields of its meaning changed."""
        require_fields(changes, RaySetMeaning, "RaySet")
        changed = type(self).from_records(self._records, dataclasses.replace(self._meaning, **changes))
        # The account of the flux as stored depends on the records alone: no second pass for it, and no second warning.
        changed._tally = self._tally  # noqa: SLF001 - its own kind
        changed._repeats = self._repeats  # noqa: SLF001
        return changed

    def __len__(self) -> int:
        """Number of rays, usable or not."""
        return int(self._records.shape[0])

    def __repr__(self) -> str:
        """Say what a person wants to know, without a pass over the rays."""
        return f"<RaySet of {len(self):,} rays in {self.flux_unit} from {self.provenance.source}>"

    # --- what the rays are -------------------------------------------------------------------------------------------

    @property
    def records(self) -> AnyRecords:
        """The structured records as stored, shape (n,); of a binary file, `FileRecords`."""
        return self._records

    @property
    def meaning(self) -> RaySetMeaning:
        """What the records mean."""
        return self._meaning

    @property
    def flux_unit(self) -> FluxUnit:
        """``"lm"`` or ``"W"``."""
        return self._meaning.flux_unit

    @property
    def provenance(self) -> Provenance:
        """Where the rays come from."""
        return self._meaning.provenance

    @property
    def spectra(self) -> tuple[Spectrum, ...]:
        """One spectrum for the whole set, or those that the column ``spectrum_index`` counts from 1; may be empty."""
        return self._meaning.spectra

    @property
    def header(self) -> Mapping[str, Any]:
        """Facts of the file's header under plain names."""
        return self._meaning.header

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns beside position, direction and flux; see `EXTRA_COLUMNS`."""
        return tuple(name for name in self._records.dtype.names or () if name not in GEOMETRY_COLUMNS)

    @property
    def has_position(self) -> bool:
        """False for far-field sets, whose rays have directions only."""
        return "position" in (self._records.dtype.names or ())

    @property
    def position(self) -> FloatArray:
        """Start points [mm], shape (n, 3); zero for far-field sets."""
        if not self.has_position:
            return np.zeros((len(self), 3))
        return self._stored("position") * self._meaning.length_scale

    @property
    def direction(self) -> FloatArray:
        """Unit directions, shape (n, 3); rays whose direction cannot be used keep what is stored."""
        stored = self._stored("direction")
        with np.errstate(over="ignore", invalid="ignore"):
            norm = np.sqrt(np.einsum("ij,ij->i", stored, stored))[:, None]
        usable = (norm >= 1e-6) & np.isfinite(norm)
        unit: FloatArray = np.divide(stored, norm, out=stored, where=True if usable.all() else usable)
        return unit

    @property
    def flux(self) -> FloatArray:
        """Flux of each ray [`flux_unit`], shape (n,), scaled to the total."""
        return self._stored("flux") * self.flux_scale

    @property
    def wavelength(self) -> FloatArray | None:
        """Wavelength of each ray [nm], shape (n,), or None if the set does not know it."""
        if "wavelength" in self.columns:
            return self.column("wavelength")
        if self._meaning.single_wavelength is not None:
            return np.full(len(self), self._meaning.single_wavelength)
        return None

    def column(self, name: str, rows: slice = slice(None)) -> npt.NDArray[Any]:
        """Values of a further column [unit as in `EXTRA_COLUMNS`], shape (n,) or (n, k).

        Those of `FLUX_COLUMNS` are scaled as the flux is: what a ray has in watts for each lumen stays as stored.

        Raises
        ------
        UnknownNameError
            If the set has no such column.
        """
        require_known(name, self.columns, "ray column")
        if name == "spectrum_index":
            return self._field(name, rows).astype(np.int64)
        if name == "wavelength":
            return self._stored(name, rows) * self._meaning.wavelength_scale
        return self._stored(name, rows) * (self.flux_scale if name in FLUX_COLUMNS else 1.0)

    def _stored(self, name: str, rows: slice = slice(None)) -> FloatArray:
        """A field of the records as f8, unscaled; the signalling NaN of damaged files pass in silence."""
        with np.errstate(invalid="ignore"):
            return self._field(name, rows).astype(np.float64)

    def _field(self, name: str, rows: slice) -> npt.NDArray[Any]:
        """A field of some records; all of a file's are never in memory at once."""
        values: npt.NDArray[Any] = self._records[name] if rows == slice(None) else self._records[rows][name]
        return values

    # --- passes over all rays ------------------------------------------------------------------------------------------

    def core_source(self) -> Any:
        """The records as the compiled core takes them."""
        return self.core_table(None)

    def core_table(self, colour: tuple[int, str, float] | None) -> _core.RayTable:
        """The records as the compiled core takes them, with the offset, type and scale of a column of colours, if any."""
        fields = self._records.dtype.fields
        assert fields is not None  # noqa: S101 - checked on adoption
        records = self._records
        return _core.RayTable(
            records.stored if isinstance(records, FileRecords) else records.view(np.uint8).reshape(-1),
            self._records.dtype.itemsize,
            fields["position"][1] if "position" in fields else None,
            fields["direction"][1],
            fields["flux"][1],
            fields["flux"][0] == np.dtype("<f8"),
            self._meaning.length_scale,
            colour,
        )

    def accept_tally(self, tally: Tally) -> float:
        """Take note of a pass over all rays; warns once if the header's total contradicts the rays."""
        first = self._tally is None
        self._tally = tally
        if first:
            for complaint in self._tally_complaints(tally):
                if complaint.severity != "note":
                    warnings.warn(f"{self.provenance.source}: {complaint}", RayFileWarning, stacklevel=3)
        return self.flux_scale

    @property
    def tally(self) -> Tally:
        """The flux account as stored; costs one pass over the rays the first time."""
        return self._tally if self._tally is not None else self.pass_over()

    def moments(self, progress: Progress | None = None, threads: int | None = None) -> Moments:
        """Bounding box, centroid, mean direction and the sums behind the virtual focus; one pass the first time."""
        if self._moments is None:
            tally, moments = _core.scan(self.core_source(), checked_threads(threads), progress)
            self.accept_tally(Tally.from_core(tally))
            arrays = {k: np.array(v) for k, v in moments.items() if k != "flux_range"}
            low, high = moments["flux_range"]
            self._moments = Moments((low, high), **arrays)
        return self._moments

    def repeats(self) -> Repeats:
        """Rays of a set with positions that repeat others; one pass over them, or over many of them, the first time."""
        if self._repeats is None:
            self._repeats = self._compared()
        return self._repeats

    def _compared(self) -> Repeats:
        return Repeats.of(self)

    @property
    def flux_scale(self) -> float:
        """Factor from stored flux to `flux_unit`; costs one pass if the set's total is declared."""
        declared = self._meaning.declared_flux
        if declared is None:
            return self._meaning.stored_flux_scale
        stored = self.tally.flux
        return declared / stored if stored > 0 else 0.0

    @property
    def total_flux(self) -> float:
        """Flux of all usable rays [`flux_unit`]."""
        declared = self._meaning.declared_flux
        if declared is not None and self.tally.flux > 0:
            return declared
        return self.tally.flux * self.flux_scale

    @property
    def notes(self) -> tuple[str, ...]:
        """What all that is made of the rays should tell."""
        copies = self._meaning.copies
        if copies <= 1.0:
            return self._meaning.notes
        found = f"up to {copies:,.4g} of the rays are copies of one ray of a set"
        told = f"errors made as if all were independent are too small, up to {math.sqrt(copies):,.3g} times"
        return (*self._meaning.notes, f"{found}: standard {told}")

    @property
    def complaints(self) -> tuple[Complaint, ...]:
        """All that is to be said of the set: by its reader, and by a pass over its rays."""
        told = (Complaint("note", "rays", note) for note in self.notes)
        return (*self._meaning.complaints, *told, *self._tally_complaints(self.tally))

    def _tally_complaints(self, tally: Tally) -> list[Complaint]:
        return [*self._ray_complaints(tally), *self.total_complaints(tally)]

    def _ray_complaints(self, tally: Tally) -> list[Complaint]:
        found: list[Complaint] = []
        reasons: list[tuple[int, str]] = [
            (tally.not_finite, "have a coordinate, direction or flux that is not finite"),
            (tally.no_direction, "have no direction"),
            (tally.negative_flux, "have negative flux"),
        ]
        found.extend(
            Complaint("error", "rays", f"{count:,} of {tally.rays:,} rays {why}; they are left out")
            for count, why in reasons
            if count
        )
        # Sets made in memory may give directions of any length; a file states unit vectors.
        if tally.norm_error > 1e-3 and self.provenance.format != "memory":
            found.append(
                Complaint(
                    "warning", "rays", f"direction lengths differ from 1 by up to {tally.norm_error:.2g}; normalised"
                )
            )
        return found

    def total_complaints(self, tally: Tally) -> list[Complaint]:
        """Whether the header's total contradicts what a pass over the rays found."""
        stated = self.header.get("total_flux")
        if not (isinstance(stated, float) and math.isfinite(stated) and stated > 0 and tally.flux > 0):
            return []
        stored = tally.flux * self._meaning.stored_flux_scale
        if abs(stated / stored - 1) <= FLUX_TOLERANCE:
            return []
        rule = (
            "the rays' values are relative and are scaled to the header's total"
            if self._meaning.declared_flux is not None
            else "the rays' sum is kept"
        )
        found = f"the header says {stated:.7g} {self.flux_unit}, the rays sum to {stored:.7g}; {rule}"
        severity: Severity = "note" if self._meaning.relative_by_format else "warning"
        return [Complaint(severity, "total flux", found)]
