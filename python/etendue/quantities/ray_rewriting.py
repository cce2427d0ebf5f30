"""New ray sets from old ones: the records are streamed through a change and spooled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.ray_records import FLUX_COLUMNS, RayRecords
from etendue.quantities.ray_stream import FloatArray, RayBatch
from etendue.quantities.report import Complaint
from etendue.quantities.spool import spool
from etendue.units import FluxUnit

Records = npt.NDArray[Any]
Rays = TypeVar("Rays", bound=RayRecords)

CHUNK = 1 << 18
"""Records per stretch of a streamed operation."""


def column_of(rays: RayRecords, batch: RayBatch, name: str) -> Records:
    """A further column of a batch's usable rays."""
    return rays.column(name, slice(batch.start, batch.start + len(batch.usable)))[batch.usable]


def without(rays: Rays, *columns: str) -> Rays:
    """The set less some columns, not copied."""
    names = list(rays.records.dtype.names or ())
    kept = [name for name in names if name not in columns]
    return rays if kept == names else type(rays).from_records(rays.records[kept], rays.meaning)


def with_records(rays: Rays, records: Records, step: str, **changes: Any) -> Rays:
    """A set of the same meaning over other records, which remembers the step that led to them."""
    # The header's total is that of the old rays: the new ones are not measured by it, but its contradiction stays.
    header = {k: v for k, v in rays.header.items() if k != "total_flux"}
    contradiction = rays.total_complaints(rays.tally) if "total_flux" in rays.header else []
    facts: dict[str, Any] = {
        "header": header,
        "complaints": (*rays.meaning.complaints, *contradiction),
        "provenance": rays.provenance.then(step),
    }
    return type(rays).from_records(records, dataclasses.replace(rays.meaning, **(facts | changes)))


def with_flux(rays: Rays, flux: Callable[[RayBatch], FloatArray], unit: FluxUnit, how: str) -> Rays:
    """The set with another flux for each usable ray; the others stay as they are, and out."""
    dtype = _double(rays.records.dtype)
    scale = rays.flux_scale

    def parts() -> Iterator[Records]:
        for batch in rays.batches(CHUNK):
            rows = rays.records[batch.start : batch.start + len(batch.usable)]
            # Damaged records may hold signalling NaN, which pass in silence.
            with np.errstate(invalid="ignore"):
                part = _on_scale(rows.astype(dtype), scale)
            part["flux"][batch.usable] = flux(batch)
            yield part

    return with_records(
        rays,
        spool(parts(), dtype),
        f"{rays.flux_unit} to {unit} through {how}",
        flux_unit=unit,
        declared_flux=None,
        stored_flux_scale=1.0,
    )


def transformed(
    rays: Rays,
    move: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    step: str,
    rotation: FloatArray | None = None,
) -> Rays:
    """Rays with new positions and directions; a NaN position leaves a ray out. `rotation` turns other vectors."""
    if not rays.has_position:
        raise ArgumentError(f"{rays.provenance.source}: far-field rays have no position and cannot be moved.")
    dtype = _double(rays.records.dtype)
    scale = rays.flux_scale
    lost_rays, lost_flux = 0, 0.0

    def parts() -> Iterator[Records]:
        nonlocal lost_rays, lost_flux
        for batch in rays.batches(CHUNK):
            part = rays.records[batch.start : batch.start + CHUNK][batch.usable].astype(dtype)
            part = _on_scale(part, scale)
            part["position"], part["direction"] = move(batch.position, batch.direction)
            part["flux"] = batch.flux
            if rotation is not None and "polarisation_axis" in rays.columns:
                part["polarisation_axis"] = part["polarisation_axis"] @ rotation.T
            kept = np.isfinite(part["position"]).all(axis=1)
            lost_rays += int((~kept).sum())
            lost_flux += float(batch.flux[~kept].sum())
            yield part[kept]

    records = spool(parts(), dtype)
    # Rays that cannot be used are not among the new records, which therefore cannot tell of them.
    complaints = rays.complaints
    if lost_rays:
        share = lost_flux / rays.total_flux if lost_flux > 0 else 0.0
        found = f"{lost_rays:,} rays with {share:.3%} of the flux never meet it; they are left out"
        complaints = (*complaints, Complaint("error", step, found))
    return with_records(
        rays, records, step, declared_flux=None, stored_flux_scale=1.0, length_scale=1.0, complaints=complaints
    )


def _double(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """The record type with f8 for position, direction and flux; other columns keep theirs."""
    wide = {"position", "direction", "flux"}
    return np.dtype([(n, "<f8" if n in wide else dtype[n].base, dtype[n].shape) for n in dtype.names or ()])


def _on_scale(part: Records, scale: float) -> Records:
    """Own records with the columns that share the flux's scale made absolute."""
    for name in FLUX_COLUMNS:
        if name in (part.dtype.names or ()):
            part[name] *= scale
    return part
