"""What can be done to a ray set. Every operation streams, and returns a new set."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import numbers
from collections.abc import Iterator, Sequence

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError, UnitError
from etendue.quantities.arguments import as_numbers, as_whole, require, require_known, require_number
from etendue.quantities.ray_records import FLUX_COLUMNS, RayRecords
from etendue.quantities.ray_rewriting import CHUNK, Rays, Records, transformed, with_records, without
from etendue.quantities.ray_stream import FloatArray
from etendue.quantities.ray_units import in_unit, knows_spectrum
from etendue.quantities.spool import spool
from etendue.units import FLUX_UNITS, FluxUnit

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


def subset(rays: Rays, n: int, seed: int) -> Rays:
    """`n` rays drawn at random without replacement, in file order, rescaled to the total flux of the whole set."""
    total = len(rays)
    n = as_whole(n, "subset: the number of rays", 1, total)
    _check_seed(seed)

    def parts() -> Iterator[Records]:
        taken = 0
        for start in range(0, total, CHUNK):
            stop = min(start + CHUNK, total)
            chosen = _core.select_subset(start, stop, total, n, taken, seed)
            taken += len(chosen)
            yield rays.records[start:stop][(chosen - np.uint64(start)).astype(np.intp)]

    return with_records(
        rays,
        spool(parts(), rays.records.dtype),
        f"random subset of {n} of {total} rays, seed {seed}",
        declared_flux=rays.total_flux,
    )


def thin(rays: Rays, parts: int, seed: int) -> tuple[Rays, ...]:
    """Deal the rays at random into independent parts, each scaled by `parts` to stand for the whole."""
    parts = as_whole(parts, "thin: parts", 2, (1 << 32) - 1)
    _check_seed(seed)
    scale = rays.flux_scale * parts

    def part(index: int) -> Iterator[Records]:
        for start in range(0, len(rays), CHUNK):
            stop = min(start + CHUNK, len(rays))
            yield rays.records[start:stop][_core.deal_parts(start, stop, parts, seed) == index]

    return tuple(
        with_records(
            rays,
            spool(part(index), rays.records.dtype),
            f"part {index + 1} of {parts} by thinning, seed {seed}",
            declared_flux=None,
            stored_flux_scale=scale,
        )
        for index in range(parts)
    )


def with_total_flux(rays: Rays, flux: float, unit: FluxUnit | None = None) -> Rays:
    """The same rays sharing a total flux, in proportion to what they carry now. See `etendue.RaySet.with_total_flux`."""
    require_number(flux, "total flux", "a finite flux > 0")
    if not (math.isfinite(flux) and flux > 0):
        raise ArgumentError(f"total flux {flux}; give a finite flux > 0.")
    unit = rays.flux_unit if unit is None else unit
    require_known(unit, FLUX_UNITS, "flux unit")
    if unit != rays.flux_unit and knows_spectrum(rays):
        # Lumens of rays that the eye does not see cannot become watts; then the statement below is all there is.
        with contextlib.suppress(UnitError):
            return with_total_flux(without(in_unit(rays, unit), *FLUX_COLUMNS), flux)
    # The header's total has been overruled by its user: it must not be complained about any more.
    header = {("overruled_total_flux" if k == "total_flux" else k): v for k, v in rays.header.items()}
    changes = {
        "declared_flux": float(flux),
        "flux_unit": unit,
        "header": header,
        "provenance": rays.provenance.then(
            f"total flux set to {flux:.9g} {unit}"
            + (
                ""
                if unit == rays.flux_unit
                else f", shared by the rays as their {rays.flux_unit}: one spectrum for all"
            )
        ),
    }
    same = unit == rays.flux_unit
    given = (rays if same else without(rays, *FLUX_COLUMNS)).replace(**changes)
    # Asked of the new set: the old one would warn of the total that is overruled.
    if given.tally.flux == 0.0:
        raise ArgumentError(
            f"{rays.provenance.source}: its rays carry no flux, so {flux:.9g} {unit} cannot be shared in proportion to it."
        )
    return given


def scaled(rays: Rays, factor: float) -> Rays:
    """Positions multiplied by `factor` (> 0); directions and flux stay, so luminance falls by its square."""
    require_number(factor, "scale factor", "a finite factor > 0")
    if not (math.isfinite(factor) and factor > 0):
        raise ArgumentError(f"scale factor {factor}; give a finite factor > 0.")
    meaning = rays.meaning
    return rays.replace(
        length_scale=meaning.length_scale * factor, provenance=rays.provenance.then(f"scaled by {factor:.9g}")
    )


def moved(rays: Rays, offset: Sequence[float]) -> Rays:
    """Positions shifted by `offset`, three components [mm]. See `etendue.RaySet.moved`."""
    shift = _vector(offset, "offset")
    return transformed(rays, lambda x, k: (x + shift, k), f"moved by {shift.tolist()} mm")


def rotated(rays: Rays, axis: Sequence[float], angle: float) -> Rays:
    """Turned about an axis through the origin by `angle` [°], right-handed. See `etendue.RaySet.rotated`."""
    a = _vector(axis, "axis")
    norm = float(np.linalg.norm(a))
    if norm == 0:
        raise ArgumentError("rotated: the axis has no length.")
    require_number(angle, "rotated: angle", "a number of degrees")
    if not math.isfinite(angle):
        raise ArgumentError(f"rotated: angle is {angle}°.")
    a = a / norm
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    # Rodrigues' rotation formula.
    rotation = c * np.eye(3) + s * cross + (1 - c) * np.outer(a, a)
    return transformed(
        rays, lambda x, k: (x @ rotation.T, k @ rotation.T), f"rotated by {angle:.9g}° about {a.tolist()}", rotation
    )


def propagated_to_plane(rays: Rays, point: Sequence[float], normal: Sequence[float] = (0.0, 0.0, 1.0)) -> Rays:
    """Start points moved along the rays, forwards or backwards, onto the plane through `point` [mm]."""
    p, n = _vector(point, "point"), _vector(normal, "normal")
    if not n.any():
        raise ArgumentError("propagated_to_plane: the normal has no length.")

    def move(x: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray]:
        slope = k @ n
        parallel = np.abs(slope) < 1e-12 * np.linalg.norm(n)
        t = ((p - x) @ n) / np.where(parallel, np.nan, slope)
        return x + t[:, None] * k, k

    return transformed(rays, move, f"propagated to the plane through {p.tolist()} mm with normal {n.tolist()}")


def propagated_to_sphere(rays: Rays, centre: Sequence[float], radius: float) -> Rays:
    """Start points moved along the rays, forwards or backwards, to where they leave a sphere [mm]."""
    c = _vector(centre, "centre")
    require_number(radius, "propagated_to_sphere: radius", "a finite radius > 0 in mm")
    if not (math.isfinite(radius) and radius > 0):
        raise ArgumentError(f"propagated_to_sphere: radius is {radius} mm; give a finite radius > 0.")

    def move(x: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray]:
        along = np.einsum("ij,ij->i", c - x, k)
        foot = x + along[:, None] * k
        # Measured at the foot of the perpendicular: no cancellation for start points far away.
        half_chord2 = radius**2 - np.einsum("ij,ij->i", foot - c, foot - c)
        half_chord = np.sqrt(np.where(half_chord2 >= 0, half_chord2, np.nan))
        return foot + half_chord[:, None] * k, k

    return transformed(rays, move, f"propagated to the sphere about {c.tolist()} mm of radius {radius:.9g} mm")


def virtual_focus(rays: RayRecords) -> VirtualFocus:
    """The point F with the least Σ w |distance of F to the ray's line|² ([Muschaweck2019]_)."""
    moments = rays.moments()
    flux = rays.tally.flux
    if flux <= 0 or not rays.has_position:
        return VirtualFocus((0.0, 0.0, 0.0), determined=False)
    xx, xy, xz, yy, yz, zz = moments.weighted_outer
    a = flux * np.eye(3) - np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    values = np.linalg.eigvalsh(a)
    if values[0] <= SINGULAR * values[-1]:
        x, y, z = moments.weighted_position / flux
        return VirtualFocus((float(x), float(y), float(z)), determined=False)
    x, y, z = np.linalg.solve(a, moments.focus_rhs)
    return VirtualFocus((float(x), float(y), float(z)), determined=True)


def _check_seed(seed: int) -> None:
    require(seed, numbers.Integral, "seed", "a whole number from 0 to 2^64 - 1")
    if not 0 <= seed < 2**64:
        raise ArgumentError(f"seed {seed}; give 0 to 2^64 - 1.")


def _vector(value: Sequence[float], name: str) -> FloatArray:
    vector = as_numbers(value, name, "three finite components")
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ArgumentError(f"{name} is {value}; give three finite components.")
    return vector
