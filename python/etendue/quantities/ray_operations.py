"""What can be done to a ray set. Every operation streams, and returns a new set."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, UnitError, UnknownNameError
from etendue.quantities.ray_merge import merged
from etendue.quantities.ray_stream import RayBatch
from etendue.quantities.report import Complaint
from etendue.quantities.spool import spool
from etendue.units import FLUX_UNITS, FluxUnit

if TYPE_CHECKING:
    from etendue.quantities.ray_set import RaySet

Records = npt.NDArray[Any]
FloatArray = npt.NDArray[np.float64]

CHUNK = 1 << 18
"""Records per stretch of a streamed operation."""

FLUX_COLUMNS = ("radiant_flux", "tristimulus_x", "tristimulus_z")
"""Columns that are stored on the scale of the flux: whatever scales a ray's flux scales them."""

SINGULAR = 1e-6
"""Smallest eigenvalue, as a fraction of the largest, below which a virtual focus is not determined."""


@dataclasses.dataclass(frozen=True)
class VirtualFocus:
    """The point that the rays, prolonged backwards, come closest to.

    Parameters
    ----------
    point : tuple of 3 floats
        [mm]
    determined : bool
        False if the rays are collimated, so that no point is preferred along them; `point` is then the flux-weighted
        centroid of the start points.
    """

    point: tuple[float, float, float]
    determined: bool


class RayOperations:
    """The operations of `etendue.RaySet`."""

    def subset(self: RaySet, n: int, seed: int) -> RaySet:  # type: ignore[misc]
        """`n` rays drawn at random without replacement, in file order, rescaled to the total flux of the whole set.

        Never the first n: vendors' files may be sorted. Every n-subset is equally likely (Knuth, TAOCP 2, 3.4.2,
        algorithm S); choice i is a function of (seed, i).

        Raises
        ------
        ArgumentError
            If `n` is below 1 or above the number of rays, or the seed is not in 0..2⁶⁴ - 1.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RingSource(rays=1000).ray_set()
        >>> part = rays.subset(10, seed=1)
        >>> len(part), round(part.total_flux, 9)
        (10, 600.0)
        """
        total = len(self)
        if not 1 <= n <= total:
            raise ArgumentError(f"subset: {n} rays of {total:,}; ask for 1 to {total:,}.")
        _check_seed(seed)

        def parts() -> Iterator[Records]:
            taken = 0
            for start in range(0, total, CHUNK):
                stop = min(start + CHUNK, total)
                chosen = _core.select_subset(start, stop, total, n, taken, seed)
                taken += len(chosen)
                yield self.records[start:stop][(chosen - np.uint64(start)).astype(np.intp)]

        return self._with_records(
            spool(parts(), self.records.dtype),
            f"random subset of {n} of {total} rays, seed {seed}",
            declared_flux=self.total_flux,
        )

    def thin(self: RaySet, parts: int, seed: int) -> tuple[RaySet, ...]:  # type: ignore[misc]
        """Deal the rays at random into independent parts, each scaled by `parts` to stand for the whole.

        If the set is a sample of a Poisson process, the parts are independent samples of the same luminance, each with
        1/`parts` of the rays (thinning, [Neufeld2024]_). The factor is `parts`, not what would restore the total: a
        part's total varies as a Poisson count does, and that variation is its error.

        Raises
        ------
        ArgumentError
            If `parts` is below 2 or above 2³² - 1, or the seed is not in 0..2⁶⁴ - 1.

        Examples
        --------
        >>> import etendue as et
        >>> a, b = et.RingSource(rays=1000).ray_set().thin(2, seed=1)
        >>> len(a) + len(b)
        1000
        """
        if not 2 <= parts < 2**32:
            raise ArgumentError(f"thin: {parts} parts; ask for 2 to 4294967295.")
        _check_seed(seed)
        scale = self.flux_scale * parts

        def part(index: int) -> Iterator[Records]:
            for start in range(0, len(self), CHUNK):
                stop = min(start + CHUNK, len(self))
                yield self.records[start:stop][_core.deal_parts(start, stop, parts, seed) == index]

        return tuple(
            self._with_records(
                spool(part(index), self.records.dtype),
                f"part {index + 1} of {parts} by thinning, seed {seed}",
                declared_flux=None,
                stored_flux_scale=scale,
            )
            for index in range(parts)
        )

    def with_total_flux(self: RaySet, flux: float, unit: FluxUnit | None = None) -> RaySet:  # type: ignore[misc]
        """The same rays sharing a total flux, in proportion to what they carry now.

        Parameters
        ----------
        flux : float
            New total [`unit`], > 0.
        unit : {"lm", "W"}, optional
            The set's own if None. For another unit the rays are converted first (`in_unit`) if their spectrum is known.
            If it is not, the call states that the flux is distributed over the rays in the same way in both units, which
            is true if they all have the same spectrum; columns of `FLUX_COLUMNS` are then left out.

        Raises
        ------
        ArgumentError
            If `flux` is not finite or not above 0.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0, 1]], [1.0, 3.0])
        >>> rays.with_total_flux(337).flux.tolist()
        [84.25, 252.75]
        """
        if not (math.isfinite(flux) and flux > 0):
            raise ArgumentError(f"total flux {flux}; give a finite flux > 0.")
        unit = unit or self.flux_unit
        if unit not in FLUX_UNITS:
            raise UnknownNameError("flux unit", unit, FLUX_UNITS)
        if unit != self.flux_unit and self.knows_spectrum:
            # Lumens of rays that the eye does not see cannot become watts; then the statement below is all there is.
            with contextlib.suppress(UnitError):
                return self.in_unit(unit)._without(*FLUX_COLUMNS).with_total_flux(flux)  # noqa: SLF001 - its own kind
        # The header's total has been overruled by its user: it must not be complained about any more.
        header = {("overruled_total_flux" if k == "total_flux" else k): v for k, v in self.header.items()}
        changes = {
            "declared_flux": float(flux),
            "flux_unit": unit,
            "header": header,
            "provenance": self.provenance.then(
                f"total flux set to {flux:.9g} {unit}"
                + (
                    ""
                    if unit == self.flux_unit
                    else f", shared by the rays as their {self.flux_unit}: one spectrum for all"
                )
            ),
        }
        if unit == self.flux_unit:
            return self.replace(**changes)
        return self._without(*FLUX_COLUMNS).replace(**changes)

    def scaled(self: RaySet, factor: float) -> RaySet:  # type: ignore[misc]
        """Positions multiplied by `factor` (> 0); directions and flux stay, so luminance falls by its square."""
        if not (math.isfinite(factor) and factor > 0):
            raise ArgumentError(f"scale factor {factor}; give a finite factor > 0.")
        meaning = self.meaning
        return self.replace(
            length_scale=meaning.length_scale * factor, provenance=self.provenance.then(f"scaled by {factor:.9g}")
        )

    def moved(self: RaySet, offset: Sequence[float]) -> RaySet:  # type: ignore[misc]
        """Positions shifted by `offset`, three components [mm].

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[1, 2, 3]], [[0, 0, 1]], [1.0]).moved((0, 0, -3)).position.tolist()
        [[1.0, 2.0, 0.0]]
        """
        shift = _vector(offset, "offset")
        return self._transformed(lambda x, k: (x + shift, k), f"moved by {shift.tolist()} mm")

    def rotated(self: RaySet, axis: Sequence[float], angle: float) -> RaySet:  # type: ignore[misc]
        """Turned about an axis through the origin by `angle` [°], right-handed.

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[1, 0, 0]], [[1, 0, 0]], [1.0]).rotated((0, 0, 1), 90).position.round(12).tolist()
        [[0.0, 1.0, 0.0]]
        """
        a = _vector(axis, "axis")
        norm = float(np.linalg.norm(a))
        if norm == 0:
            raise ArgumentError("rotated: the axis has no length.")
        if not math.isfinite(angle):
            raise ArgumentError(f"rotated: angle is {angle}°.")
        a = a / norm
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        # Rodrigues' rotation formula.
        rotation = c * np.eye(3) + s * cross + (1 - c) * np.outer(a, a)
        return self._transformed(
            lambda x, k: (x @ rotation.T, k @ rotation.T), f"rotated by {angle:.9g}° about {a.tolist()}", rotation
        )

    def propagated_to_plane(  # type: ignore[misc]
        self: RaySet, point: Sequence[float], normal: Sequence[float] = (0.0, 0.0, 1.0)
    ) -> RaySet:
        """Start points moved along the rays, forwards or backwards, onto the plane through `point` [mm].

        Rays parallel to the plane never meet it: they are left out, and the number and flux are complained about.
        """
        p, n = _vector(point, "point"), _vector(normal, "normal")
        if not n.any():
            raise ArgumentError("propagated_to_plane: the normal has no length.")

        def move(x: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray]:
            slope = k @ n
            parallel = np.abs(slope) < 1e-12 * np.linalg.norm(n)
            t = ((p - x) @ n) / np.where(parallel, np.nan, slope)
            return x + t[:, None] * k, k

        return self._transformed(move, f"propagated to the plane through {p.tolist()} mm with normal {n.tolist()}")

    def propagated_to_sphere(self: RaySet, centre: Sequence[float], radius: float) -> RaySet:  # type: ignore[misc]
        """Start points moved along the rays, forwards or backwards, to where they leave a sphere [mm].

        Rays whose line misses the sphere are left out, and the number and flux are complained about.
        """
        c = _vector(centre, "centre")
        if not (math.isfinite(radius) and radius > 0):
            raise ArgumentError(f"propagated_to_sphere: radius is {radius} mm; give a finite radius > 0.")

        def move(x: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray]:
            along = np.einsum("ij,ij->i", c - x, k)
            foot = x + along[:, None] * k
            # Measured at the foot of the perpendicular: no cancellation for start points far away.
            half_chord2 = radius**2 - np.einsum("ij,ij->i", foot - c, foot - c)
            half_chord = np.sqrt(np.where(half_chord2 >= 0, half_chord2, np.nan))
            return foot + half_chord[:, None] * k, k

        return self._transformed(move, f"propagated to the sphere about {c.tolist()} mm of radius {radius:.9g} mm")

    @property
    def virtual_focus(self: RaySet) -> VirtualFocus:  # type: ignore[misc]
        """The point F with the least Σ w |distance of F to the ray's line|² ([Muschaweck2019]_).

        The normal equations (theory eq. 24) A F = b with A = Σ w (1 - k kᵀ), b = Σ w (1 - k kᵀ) x; vendors print F in their
        data sheets.
        """
        moments = self.moments()
        flux = self.tally.flux
        if flux <= 0 or not self.has_position:
            return VirtualFocus((0.0, 0.0, 0.0), determined=False)
        xx, xy, xz, yy, yz, zz = moments.weighted_outer
        a = flux * np.eye(3) - np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        values = np.linalg.eigvalsh(a)
        if values[0] <= SINGULAR * values[-1]:
            x, y, z = moments.weighted_position / flux
            return VirtualFocus((float(x), float(y), float(z)), determined=False)
        x, y, z = np.linalg.solve(a, moments.focus_rhs)
        return VirtualFocus((float(x), float(y), float(z)), determined=True)

    # --- how the above is done -------------------------------------------------------------------------------------------

    def _column_of(self: RaySet, batch: RayBatch, name: str) -> Records:  # type: ignore[misc]
        """A further column of a batch's usable rays."""
        return self.column(name, slice(batch.start, batch.start + len(batch.usable)))[batch.usable]

    def _without(self: RaySet, *columns: str) -> RaySet:  # type: ignore[misc]
        """The set less some columns, not copied."""
        names = list(self.records.dtype.names or ())
        kept = [name for name in names if name not in columns]
        return self if kept == names else type(self).from_records(self.records[kept], self.meaning)

    def _with_records(self: RaySet, records: Records, step: str, **changes: Any) -> RaySet:  # type: ignore[misc]
        # The header's total is that of the old rays: the new ones are not measured by it, but its contradiction stays.
        header = {k: v for k, v in self.header.items() if k != "total_flux"}
        contradiction = self._total_complaints(self.tally) if "total_flux" in self.header else []
        facts: dict[str, Any] = {
            "header": header,
            "complaints": (*self.meaning.complaints, *contradiction),
            "provenance": self.provenance.then(step),
        }
        return type(self).from_records(records, dataclasses.replace(self.meaning, **(facts | changes)))

    def _with_flux(self: RaySet, flux: Callable[[RayBatch], FloatArray], unit: FluxUnit, how: str) -> RaySet:  # type: ignore[misc]
        """The set with another flux for each usable ray; the others stay as they are, and out."""
        dtype = _double(self.records.dtype)
        scale = self.flux_scale

        def parts() -> Iterator[Records]:
            for batch in self.batches(CHUNK):
                rows = self.records[batch.start : batch.start + len(batch.usable)]
                # Damaged records may hold signalling NaN, which pass in silence.
                with np.errstate(invalid="ignore"):
                    part = _on_scale(rows.astype(dtype), scale)
                part["flux"][batch.usable] = flux(batch)
                yield part

        return self._with_records(
            spool(parts(), dtype),
            f"{self.flux_unit} to {unit} through {how}",
            flux_unit=unit,
            declared_flux=None,
            stored_flux_scale=1.0,
        )

    def _transformed(  # type: ignore[misc]
        self: RaySet,
        move: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
        step: str,
        rotation: FloatArray | None = None,
    ) -> RaySet:
        """Rays with new positions and directions; a NaN position leaves a ray out. `rotation` turns other vectors."""
        if not self.has_position:
            raise ArgumentError(f"{self.provenance.source}: far-field rays have no position and cannot be moved.")
        dtype = _double(self.records.dtype)
        scale = self.flux_scale
        lost_rays, lost_flux = 0, 0.0

        def parts() -> Iterator[Records]:
            nonlocal lost_rays, lost_flux
            for batch in self.batches(CHUNK):
                part = self.records[batch.start : batch.start + CHUNK][batch.usable].astype(dtype)
                part = _on_scale(part, scale)
                part["position"], part["direction"] = move(batch.position, batch.direction)
                part["flux"] = batch.flux
                if rotation is not None and "polarisation_axis" in self.columns:
                    part["polarisation_axis"] = part["polarisation_axis"] @ rotation.T
                kept = np.isfinite(part["position"]).all(axis=1)
                lost_rays += int((~kept).sum())
                lost_flux += float(batch.flux[~kept].sum())
                yield part[kept]

        records = spool(parts(), dtype)
        # Rays that cannot be used are not among the new records, which therefore cannot tell of them.
        complaints = self.complaints
        if lost_rays:
            share = lost_flux / self.total_flux if lost_flux > 0 else 0.0
            found = f"{lost_rays:,} rays with {share:.3%} of the flux never meet it; they are left out"
            complaints = (*complaints, Complaint("error", step, found))
        return self._with_records(
            records, step, declared_flux=None, stored_flux_scale=1.0, length_scale=1.0, complaints=complaints
        )

    @classmethod
    def merge(cls, sets: Sequence[RaySet], flux: Sequence[float] | None = None, unit: FluxUnit | None = None) -> RaySet:
        """One set of all rays: a white LED from its blue and its yellow file.

        Parameters
        ----------
        sets : sequence of RaySet
            In the same coordinates.
        flux : sequence of float, optional
            Total flux of each set [`unit`]; their own if None.
        unit : {"lm", "W"}, optional
            Of the merged set, and of `flux`; sets in the other unit are converted (`with_total_flux`, else `in_unit`). That
            of the sets if None.

        Returns
        -------
        RaySet
            Columns that all sets have are kept. The merged set knows the wavelength of every ray if each set does, and
            the spectrum of every ray, by ``spectrum_index``, if each set does.

        Raises
        ------
        ArgumentError
            If units differ and none is stated, a set is a far-field set, or the numbers of sets and fluxes differ.
        UnitError
            If a set cannot be converted.

        Examples
        --------
        >>> import etendue as et
        >>> blue = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0])
        >>> yellow = et.RaySet([[0, 0, 0]], [[0, 1, 0]], [1.0])
        >>> et.RaySet.merge([blue, yellow], flux=[23.0, 314.0]).flux.tolist()
        [23.0, 314.0]
        """
        return merged(sets, flux, unit)


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


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**64:
        raise ArgumentError(f"seed {seed}; give 0 to 2^64 - 1.")


def _vector(value: Sequence[float], name: str) -> FloatArray:
    vector = np.asarray(value, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ArgumentError(f"{name} is {value}; give three finite components.")
    return vector
