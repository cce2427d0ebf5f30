"""Rays of any number in half degrees, pixel by pixel: one pass, from which the sources of every threshold follow.

`GriddedSource.fit` reads its rays twice, because the bins of a pixel are known only once its rays are counted. A thousand
million rays that are traced for the purpose would have to be traced twice. All bin edges of the thesis lie on multiples of
half a degree, in θ and in φ; so counted in these, rays need to be traced once.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import etendue as et
import numpy as np
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.fitting import Account, Bins, LitPixels, patches_of
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.quantities.provenance import Provenance
from scipy.spatial import cKDTree

CELLS = angular.RINGS * angular.SECTORS
AT_ONCE = 1 << 22
"""Rays of one trace; its seed is its number."""

Trace = Callable[[int, int], et.RaySet]
"""Rays that leave a lamp, for a number of rays traced and a seed."""


@dataclasses.dataclass(eq=False)
class GriddedCounts:
    """Flux of rays by pixel, ring and sector.

    Parameters
    ----------
    surface : PixelatedSurface
    flux : array, shape (pixels, 180 · 720)
        Flux times rays traced. Divided by `traced` it is what leaves the lamp [lm].
    traced : int
        Rays that started in the lamp.
    left : int
        Rays that left it.
    lost : array, shape (2, 2)
        Number and flux times rays traced of those that miss the surface, and of those below the horizon of their pixel.
    """

    surface: PixelatedSurface
    flux: np.ndarray
    traced: int = 0
    left: int = 0
    lost: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((2, 2)))

    @classmethod
    def on(cls, surface: et.Surface, pixel: float, parallels: int | None = None) -> GriddedCounts:
        """No rays yet, on the pixels that `GriddedSource.fit` would make."""
        pixels = PixelatedSurface.cut(surface, pixel, parallels)
        return cls(pixels, np.zeros((pixels.count, CELLS), dtype=np.float32))

    def add(self, rays: et.RaySet, traced: int) -> None:
        """Count the rays of one trace."""
        for batch in rays.batches():
            pixel = self.surface.owner(batch.position, batch.direction)
            ring, sector = angular.rings_and_sectors(self.surface.local_directions(pixel, batch.direction))
            place = np.where(pixel < 0, 1, np.where(ring >= angular.RINGS, 2, 0))
            weight = batch.flux * traced
            self.lost[:, 0] += np.bincount(place, minlength=3)[1:]
            self.lost[:, 1] += np.bincount(place, weight, minlength=3)[1:]
            used = place == 0
            index = pixel[used] * CELLS + ring[used] * angular.SECTORS + sector[used]
            np.add.at(self.flux.reshape(-1), index, weight[used].astype(np.float32))
            self.left += len(batch.flux)
        self.traced += traced

    def mirrored(self, *normals: tuple[float, float, float]) -> GriddedCounts:
        """With the images of all rays in planes through the origin, one after the other: of a lamp that is its own image.

        Parameters
        ----------
        normals : tuple of float
            Unit vectors. Pixels have to be images of pixels.
        """
        cells = self.surface.cells(np.arange(self.surface.count))
        flux = self.flux
        for normal in normals:
            mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
            off, image = cKDTree(cells.centre).query(cells.centre @ mirror)
            if off.max() > 1e-9:
                raise ValueError(f"the image of a pixel is none, by {off.max():g} mm; give another plane.")
            # A reflection turns φ round: it becomes that of the image of the x axis, less φ.
            axis = np.einsum("nij,nj->ni", cells.axes[image], cells.axes[:, 0] @ mirror)
            turn = np.rint(np.degrees(np.arctan2(axis[:, 1], axis[:, 0])) * 2.0).astype(np.intp)
            images = np.zeros_like(flux)
            for pixel in np.flatnonzero(flux.any(axis=1)):
                # Sector s reaches from s/2 to (s + 1)/2 degrees.
                sector = (turn[pixel] - 1 - np.arange(angular.SECTORS)) % angular.SECTORS
                table = flux[pixel].reshape(angular.RINGS, angular.SECTORS)
                images[image[pixel]] = table[:, sector].reshape(-1)
            flux = flux + images
        times = 2 ** len(normals)
        return GriddedCounts(self.surface, flux, times * self.traced, times * self.left, times * self.lost)

    @functools.cached_property
    def lit(self) -> LitPixels:
        """What `etendue.lightfield.gridded.fitting.lit_pixels` would find."""
        rings = self.flux.reshape(-1, angular.RINGS, angular.SECTORS).sum(axis=2, dtype=np.float64) / self.traced
        pixel = np.flatnonzero(rings.sum(axis=1) > 0.0)
        (missed, missed_flux), (hidden, hidden_flux) = self.lost
        missed_flux, hidden_flux = missed_flux / self.traced, hidden_flux / self.traced
        total = float(rings.sum()) + missed_flux + hidden_flux
        account = Account(self.left, total, int(missed), missed_flux, int(hidden), hidden_flux)
        return LitPixels(self.surface, pixel, rings[pixel], account)

    def source(self, threshold: float) -> et.GriddedSource:
        """What `GriddedSource.fit` makes of the same rays."""
        steps = angular.first_within(self.lit.errors, threshold)
        sizes = np.array([angular.SEQUENCE[step].bins for step in steps])
        start = np.full((len(angular.SEQUENCE), len(steps)), -1)
        start[steps, np.arange(len(steps))] = np.cumsum(sizes) - sizes
        found = [
            np.bincount(_bins(int(step)), self.flux[pixel], minlength=size)
            for pixel, step, size in zip(self.lit.pixel, steps, sizes, strict=True)
        ]
        bins = Bins(start, np.concatenate(found) / self.traced, angular.SEQUENCE)
        patches = patches_of(self.lit, bins, steps, "lm", Provenance(f"{self.traced:,} rays traced"))
        side = next(part.side for part in self.surface.pixels if hasattr(part, "side"))
        return et.GriddedSource(self.surface, patches, self.lit.account, side, threshold)

    def save(self, path: Path) -> None:
        """Cells that are lit, for a run that is gone on with, or looked at again."""
        index = np.flatnonzero(self.flux)
        if len(index) > self.flux.size // 2:
            index = np.zeros(0, dtype=np.int64)
        values = self.flux.reshape(-1)[index] if len(index) else self.flux
        np.savez(path, index=index, values=values, traced=self.traced, left=self.left, lost=self.lost)

    def load(self, path: Path) -> None:
        """What `save` wrote, on the same pixels."""
        with np.load(path) as held:
            index, values = held["index"], held["values"]
            if len(index):
                self.flux.reshape(-1)[index] = values
            else:
                self.flux[:] = values
            self.traced, self.left, self.lost = int(held["traced"]), int(held["left"]), held["lost"]


@functools.cache
def _bins(step: int) -> np.ndarray:
    """The bin of each ring and sector."""
    ring, sector = np.divmod(np.arange(CELLS), angular.SECTORS)
    return angular.bin_of(angular.SEQUENCE[step], ring, sector)


def counted(counts: GriddedCounts, trace: Trace, marks: list[int], folder: Path) -> Iterator[int]:
    """Trace rays and count them until as many as each mark says are counted; then the mark is given out.

    While one trace runs, the rays of the one before are counted. What was counted at a mark is kept in the folder, and not
    traced again.
    """
    folder.mkdir(exist_ok=True)
    seed = 1
    with ThreadPoolExecutor(1) as pool:
        for before, mark in itertools.pairwise([0, *marks]):
            kept, traces = folder / f"{mark}.npz", -(-(mark - before) // AT_ONCE)
            if kept.exists():
                counts.load(kept)
            else:
                counting: Future[None] | None = None
                for number in range(traces):
                    some = min(AT_ONCE, mark - before - number * AT_ONCE)
                    rays = trace(some, seed + number)
                    if counting is not None:
                        counting.result()
                    counting = pool.submit(counts.add, rays, some)
                if counting is not None:
                    counting.result()
                counts.save(kept)
            seed += traces
            counts.__dict__.pop("lit", None)
            yield mark
