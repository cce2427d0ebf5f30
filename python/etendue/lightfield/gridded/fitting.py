"""Rays into bins: steps 3 and 4 of section 3.2.2 of [Audenaert2014]_, in two passes over rays of any number.

The first pass counts the flux of every pixel in half degrees of θ, which is all that the error E depends on
(`angular.quadrature_errors`); every pixel then knows its Δθ and Δφ, and the second pass fills the bins. Memory holds
180 numbers for each lit pixel and the bins that were chosen, whatever the number of rays.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator

import numpy as np

from etendue.errors import ArgumentError
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.lightfield.gridded.pixels import Array, Cells, Indices
from etendue.quantities.patches import AngularGrid, Patches
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import Progress, RayBatch, RayStream
from etendue.units import FluxUnit

MOST_PATCHES = 1 << 18
"""Lit pixels: their half degrees take 1440 bytes each."""

MOST_BINS = 1 << 28
"""Bins of all patches together: two gigabytes."""

Batches = Callable[[], Iterator[RayBatch]]
"""Gives the same rays every time it is called."""


@dataclasses.dataclass(frozen=True)
class Account:
    """Where the rays went: every ray and its flux stand in exactly one place.

    Parameters
    ----------
    rays : int
        Rays that can be used.
    flux : float
        Theirs [flux unit].
    missed, missed_flux : int, float
        Those whose line does not cross the surface outwards.
    hidden, hidden_flux : int, float
        Those that leave a curved pixel at 90° or more from the normal of its middle, for which a patch has no bin.
    """

    rays: int = 0
    flux: float = 0.0
    missed: int = 0
    missed_flux: float = 0.0
    hidden: int = 0
    hidden_flux: float = 0.0

    def notes(self, unit: FluxUnit) -> list[str]:
        """What the user should know."""
        found = []
        for rays, flux, why in (
            (self.missed, self.missed_flux, "never cross the surface outwards"),
            (self.hidden, self.hidden_flux, "leave their pixel below the horizon of its middle"),
        ):
            if rays:
                share = flux / self.flux if self.flux > 0 else 0.0
                found.append(f"{rays:,} of {self.rays:,} rays ({counted(flux, unit)}, {share:.3%}) {why}: left out")
        return found


@dataclasses.dataclass(frozen=True, eq=False)
class LitPixels:
    """What the first pass finds.

    Parameters
    ----------
    surface : PixelatedSurface
    pixel : array of int, shape (n,)
        Numbers of the pixels that light comes from, rising.
    rings : array, shape (n, RINGS)
        Their flux in each half degree of θ [flux unit].
    account : Account
    sequence : tuple of AngularGrid
        Angular bins that are tried one after the other.
    """

    surface: PixelatedSurface
    pixel: Indices
    rings: Array
    account: Account
    sequence: tuple[AngularGrid, ...] = angular.SEQUENCE

    @functools.cached_property
    def errors(self) -> Array:
        """E [%] of each pixel at every step, shape (n, len(sequence))."""
        return angular.quadrature_errors(self.rings, self.sequence)

    @property
    def rays_per_patch(self) -> float:
        """Rays on the patch of a ray, in the mean over the flux: what noise depends on where the light is."""
        flux = self.rings.sum(axis=1)
        rays = self.account.rays - self.account.missed - self.account.hidden
        return float(rays * (flux**2).sum() / flux.sum() ** 2)

    @functools.cached_property
    def cells(self) -> Cells:
        """What they look like."""
        return self.surface.cells(self.pixel)

    @functools.cached_property
    def slots(self) -> Indices:
        """Place of each of the surface's pixels in `pixel`, -1 for dark ones."""
        result = np.full(self.surface.count, -1, dtype=np.intp)
        result[self.pixel] = np.arange(len(self.pixel))
        return result


class _Accumulator:
    """Flux of half degrees for pixels that turn up one after the other."""

    def __init__(self, count: int) -> None:
        self.slot = np.full(count, -1, dtype=np.int32)
        self.pixels = np.zeros(0, dtype=np.intp)
        self.rings = np.zeros((64, angular.RINGS))

    def add(self, pixel: Indices, ring: Indices, flux: Array) -> None:
        new = np.unique(pixel[self.slot[pixel] < 0])
        self.slot[new] = len(self.pixels) + np.arange(len(new))
        self.pixels = np.concatenate([self.pixels, new])
        if len(self.pixels) > MOST_PATCHES:
            raise ArgumentError(f"light comes from more than {MOST_PATCHES:,} pixels; give larger ones.")
        if len(self.pixels) > len(self.rings):
            self.rings = np.pad(self.rings, ((0, 2 * len(self.pixels) - len(self.rings)), (0, 0)))
        np.add.at(self.rings.reshape(-1), self.slot[pixel].astype(np.intp) * angular.RINGS + ring, flux)


def lit_pixels(
    batches: Batches, surface: PixelatedSurface, sequence: tuple[AngularGrid, ...] = angular.SEQUENCE
) -> LitPixels:
    """The first pass: steps 3, 4a and 4d for half degrees of θ.

    Raises
    ------
    ArgumentError
        If no ray has light for the surface, or too many pixels are lit.
    """
    found = _Accumulator(surface.count)
    counts, fluxes = np.zeros(3, dtype=np.int64), np.zeros(3)
    for batch in batches():
        pixel, ring, _ = _placed(surface, batch)
        place = np.where(pixel < 0, 1, np.where(ring >= angular.RINGS, 2, 0))
        counts += np.bincount(place, minlength=3)
        fluxes += np.bincount(place, batch.flux, minlength=3)
        used = (place == 0) & (batch.flux > 0.0)
        found.add(pixel[used], ring[used], batch.flux[used])
    account = Account(
        int(counts.sum()), float(fluxes.sum()), int(counts[1]), float(fluxes[1]), int(counts[2]), float(fluxes[2])
    )
    if not len(found.pixels):
        raise ArgumentError(
            f"no light crosses {surface.surface.told} outwards: {account.missed:,} of {account.rays:,} rays miss it. "
            "Look at the rays with `etendue info`, and choose a surface around the source."
        )
    order = np.argsort(found.pixels)
    return LitPixels(surface, found.pixels[order], found.rings[order], account, sequence)


@dataclasses.dataclass(frozen=True, eq=False)
class Bins:
    """Flux of the bins of lit pixels, for some steps of the sequence each.

    Parameters
    ----------
    start : array of int, shape (steps, n)
        Where the bins of a pixel begin in `flux`, for each step; -1 for steps that it was not counted in.
    flux : array
        Of all bins [flux unit].
    sequence : tuple of AngularGrid
        The steps.
    """

    start: Indices
    flux: Array
    sequence: tuple[AngularGrid, ...]

    def of(self, step: int, slot: int) -> Array:
        """Flux of the bins of a pixel in one of its steps, shape (bins,)."""
        first = self.start[step, slot]
        return self.flux[first : first + self.sequence[step].bins]


def fill_bins(batches: Batches, lit: LitPixels, wanted: Array) -> Bins:
    """The second pass: steps 4a to 4d, for the steps of the sequence that each pixel wants.

    Parameters
    ----------
    batches : callable
        The rays.
    lit : LitPixels
        From the first pass; rays of other pixels are passed over.
    wanted : array of bool, shape (len(lit.sequence), n)
        The steps of each pixel.

    Raises
    ------
    ArgumentError
        If the bins would not fit into memory.
    """
    sizes = wanted * np.array([grid.bins for grid in lit.sequence])[:, None]
    total = int(sizes.sum())
    if total > MOST_BINS:
        raise ArgumentError(
            f"{total:,} bins on {len(lit.pixel):,} patches, at most {MOST_BINS:,}; give larger pixels or a higher threshold."
        )
    start = np.where(wanted, (np.cumsum(sizes) - sizes.ravel()).reshape(sizes.shape), -1)
    flux, slots, steps = np.zeros(total), lit.slots, np.flatnonzero(wanted.any(axis=1))
    for batch in batches():
        pixel, ring, sector = _placed(lit.surface, batch)
        slot = np.where((pixel < 0) | (ring >= angular.RINGS), -1, slots[pixel])
        for step in steps:
            first = np.where(slot < 0, -1, start[step, slot])
            used = first >= 0
            index = first[used] + angular.bin_of(lit.sequence[step], ring[used], sector[used])
            np.add.at(flux, index, batch.flux[used])
    return Bins(start, flux, lit.sequence)


def patches_of(lit: LitPixels, bins: Bins, steps: Indices, flux_unit: FluxUnit, provenance: Provenance) -> Patches:
    """Step 4i: the patches with the tables of one step each.

    Parameters
    ----------
    lit : LitPixels
        From the first pass.
    bins : Bins
        From the second one.
    steps : array of int, shape (n,)
        Number of the step of each pixel.
    flux_unit : {"lm", "W"}
        Of the rays.
    provenance : Provenance
        Of the result.
    """
    grids = [lit.sequence[step] for step in steps]
    start = np.concatenate([[0], np.cumsum([grid.shape[0] * grid.shape[1] for grid in grids])])
    values = np.zeros(start[-1])
    for slot, grid in enumerate(grids):  # one by one: the bins may be most of the memory there is
        table = angular.intensities(grid, bins.of(int(steps[slot]), slot))
        values[start[slot] : start[slot + 1]] = table.ravel()
    cells, surface = lit.cells, lit.surface
    return Patches(
        shapes=tuple(pixels.SHAPE for pixels in surface.pixels),
        parts=tuple(pixels.part.name for pixels in surface.pixels),
        part=surface.part_of(lit.pixel),
        pixel=lit.pixel,
        **{field.name: getattr(cells, field.name) for field in dataclasses.fields(cells)},
        flux=lit.rings.sum(axis=1),
        theta_step=np.array([grid.theta_step for grid in grids]),
        phi_step=np.array([grid.phi_step for grid in grids]),
        error=lit.errors[np.arange(len(steps)), steps],
        start=start,
        values=values,
        flux_unit=flux_unit,
        provenance=provenance,
    )


def all_batches(rays: RayStream, passes: int, progress: Progress | None, done: int = 0) -> Batches:
    """The rays of a stream, again and again; `progress` sees one run over them, spread over so many passes.

    Parameters
    ----------
    rays : RayStream
        With positions.
    passes : int
        Times that they are read in all.
    progress : callable, optional
        Called with the number of rays read, over the number of passes.
    done : int
        Rays that were read before.

    Raises
    ------
    ArgumentError
        If the rays have no positions.
    """
    if not rays.has_position:
        raise ArgumentError("these rays have no positions (a far-field set), so no surface can carry them.")

    def batches() -> Iterator[RayBatch]:
        nonlocal done
        before = done
        for batch in rays.batches():
            yield batch
            if progress is not None:
                progress((before + batch.start + len(batch.usable)) // passes)
        done = before + len(rays)

    return batches


def _placed(surface: PixelatedSurface, batch: RayBatch) -> tuple[Indices, Indices, Indices]:
    """Pixel of each ray, -1 if it misses the surface, and ring and sector in the axes of its pixel (eqs. 3.7, 3.8)."""
    pixel = surface.owner(batch.position, batch.direction)
    local = surface.local_directions(pixel, batch.direction)
    return (pixel, *angular.rings_and_sectors(local))
