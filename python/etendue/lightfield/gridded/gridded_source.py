"""A ray file as surface sources, each with an intensity distribution of its own: chapter 3 of the thesis."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.formats.patch_folder import write_patch_folder
from etendue.lightfield.carrier import Surface
from etendue.lightfield.gridded import angular
from etendue.lightfield.gridded.fitting import Account, all_batches, fill_bins, lit_pixels, patches_of
from etendue.lightfield.gridded.pixelated import CentreOn, PixelatedSurface
from etendue.lightfield.gridded.pixels import Array
from etendue.lightfield.gridded.reading import read_gridded
from etendue.lightfield.gridded.sampling import RECORD, sampled_records
from etendue.lightfield.gridded.summing import summed_intensity
from etendue.lightfield.pilot_sample import check_near_field
from etendue.quantities.arguments import SURFACE, as_numbers, as_whole, require, require_callable, require_number
from etendue.quantities.intensity import Intensity
from etendue.quantities.patches import Patches
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_seed
from etendue.quantities.spool import spool
from etendue.units import MM2_PER_M2, FluxUnit

LINES = 1 << 18
"""Lines that `GriddedSource.luminance` follows at once."""

MOST_RAYS = (1 << 50) - 1
"""Rays that may be drawn at once."""

RAYS_OF_ERROR = 10.0
"""A threshold suits a number of rays if it is the flux of so many of a patch's own: found by sweeps over the threshold."""

FINEST_THRESHOLD, COARSEST_THRESHOLD = 0.01, 5.0
"""Of thresholds that are chosen [%]."""


@dataclasses.dataclass(frozen=True, eq=False)
class GriddedSource:
    """A ray file sampled into surface sources: sections 3.2.2 and 3.3.2 of [Audenaert2014]_; made by `fit`.

    Parameters
    ----------
    surface : PixelatedSurface
        The carrier surface and its pixels.
    patches : Patches
        The pixels that light comes from, each with its table.
    account : Account
        Where the rays went.
    pixel : float
        Δd [mm].
    threshold : float
        Of E [%].
    stated_flux : float, optional
        Total flux [`flux_unit`] that overrides that of the rays on patches; see `emitting`.
    suited : bool
        Whether the threshold was chosen from the number of rays: `suited_threshold`.

    Notes
    -----
    Tables of wide bins do not integrate to the flux of the rays that they were made of. The tables stay as the thesis
    has them; all light of the source is theirs times one `factor`, so that the source has the flux of its rays and its
    distribution is that of the tables. `as_printed` is the source with the light of its tables alone.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> rays = et.RingSource(rays=100_000, seed=3)
    >>> grid = GriddedSource.fit(rays, Disk(radius=30), pixel=10, threshold=2.1)
    >>> len(grid.patches), round(grid.total_flux, 6)
    (36, 600.0)
    >>> seen = grid.luminance([[4, 4, 0], [40, 4, 0]], [[0.5, 0, 1], [0.5, 0, 1]])      # [cd/m²]
    >>> bool(seen[0] > 1e5), float(seen[1])
    (True, 0.0)
    """

    surface: PixelatedSurface
    patches: Patches
    account: Account
    pixel: float
    threshold: float
    stated_flux: float | None = None
    suited: bool = False

    def __repr__(self) -> str:
        """Surface, patches and flux."""
        flux = counted(self.total_flux, self.patches.flux_unit)
        return f"<GriddedSource of {len(self.patches):,} patches on {self.surface.surface.told}, {flux}>"

    @classmethod
    def fit(
        cls,
        rays: RayStream,
        surface: Surface,
        pixel: float = 1.0,
        threshold: float | None = None,
        parallels: int | None = None,
        progress: Progress | None = None,
        *,
        centre_on: CentreOn = "auto",
        coarsest_bins: tuple[int, int] = angular.COARSEST,
        finest_bins: tuple[int, int] = angular.FINEST,
    ) -> GriddedSource:
        """Sample rays into surface sources.

        Every pixel of the surface gets the intensities of its own rays in angular bins, which are made finer, step by
        step from Δθ = 30° and Δφ = 90° to 1° and 1° unless others are stated, until the flux that eq. 3.2 integrates from
        them agrees with that of the rays. The rays are read twice, in batches; memory holds 1.4 kB for each lit pixel, and
        the bins.

        Parameters
        ----------
        rays : RayStream
            With positions. A ray belongs to the first part of the surface that its line crosses outwards.
        surface : Surface
            Open dimensions are taken from the rays.
        pixel : float
            Δd [mm], the side of the squares on flat parts.
        threshold : float, optional
            The largest E that is good enough, in percent: 0.021 means 0.021 %, which the thesis found best for 10⁹ rays of
            one of its lamps. None: what suits the number of rays, by `suited_threshold`; the notes tell it.
        parallels : int, optional
            N, that divide a hemisphere into (2N - 1)² cells. None: as many as give cells the area of Δd² most nearly.
        progress : callable, optional
            Called with the number of rays done, counted over both passes together.
        centre_on : {"auto", "corner", "pixel"}
            What of the squares on flat parts lies at the centre that the surface states, or at the origin of x and y where
            it states none, so that no ray moves them: a corner, or the middle of a pixel. 23 × 23 mm are 576 squares of
            1 mm about a corner, and 529 about a pixel. ``"auto"``: a pixel where it makes a whole number of squares fit,
            as here, else a corner.
        coarsest_bins, finest_bins : tuple of int
            Δθ and Δφ of the first and of the last step, whole degrees that divide 90° and 360°.

        Returns
        -------
        GriddedSource

        Raises
        ------
        UnknownNameError
            If `centre_on` is something else.
        ArgumentError
            If a number is out of its domain, the rays have no positions or no near field, none of them leaves the surface,
            or there are too many pixels or bins.
        """
        if threshold is not None:
            check_threshold(threshold)
        require(rays, RayStream, "GriddedSource.fit: rays", "rays, of a file et.read_rays(path)")
        require(surface, Surface, "GriddedSource.fit: surface", SURFACE)
        require_callable(progress)
        check_near_field(rays)
        batches = all_batches(rays, 2, progress)
        sequence = angular.sequence(coarsest_bins, finest_bins)
        lit = lit_pixels(batches, pixels_for(rays, surface, pixel, parallels, centre_on), sequence)
        chosen = suited_threshold(lit.rays_per_patch) if threshold is None else float(threshold)
        steps = angular.first_within(lit.errors, chosen)
        bins = fill_bins(batches, lit, steps == np.arange(len(sequence))[:, None])
        step = f"sampled on {lit.surface.surface.spec}, pixel {pixel:g} mm, threshold {chosen:g} %"
        patches = patches_of(lit, bins, steps, rays.flux_unit, rays.provenance.then(step))
        return cls(lit.surface, patches, lit.account, float(pixel), chosen, suited=threshold is None)

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> GriddedSource:
        """The source that `save_patches` wrote.

        Parameters
        ----------
        folder : path
            With a manifest and the intensity files that it names.

        Returns
        -------
        GriddedSource
            Tables have the digits of the intensity files; flux and factor are those of the manifest.

        Raises
        ------
        FormatError
            If the manifest or an intensity file is damaged, missing, or does not fit the others.

        Examples
        --------
        >>> import tempfile
        >>> import etendue as et
        >>> grid = GriddedSource.fit(et.RingSource(rays=20_000), et.Disk(radius=30), pixel=20, threshold=2.1)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     grid.save_patches(f"{folder}/patches")
        ...     again = GriddedSource.load(f"{folder}/patches")
        >>> len(again.patches) == len(grid.patches), round(again.total_flux, 6)
        (True, 600.0)
        """
        return cls(**read_gridded(folder))

    @property
    def flux_unit(self) -> FluxUnit:
        """``"lm"`` or ``"W"``."""
        return self.patches.flux_unit

    @property
    def total_flux(self) -> float:
        """Of the rays on patches [`flux_unit`]."""
        return float(self.patches.flux.sum())

    @property
    def table_flux(self) -> float:
        """What the tables integrate to, exactly [`flux_unit`]."""
        return float(self.patches.table_flux.sum())

    @property
    def emitted_flux(self) -> float:
        """Of all that shows the source's light [`flux_unit`]: that of the rays on patches, unless another is stated."""
        return self.total_flux if self.stated_flux is None else self.stated_flux

    @property
    def factor(self) -> float:
        """What multiplies all tables alike in the light of the source: `emitted_flux` over `table_flux`."""
        return self.emitted_flux / self.table_flux

    def emitting(self, flux: float) -> GriddedSource:
        """The same patches with another total flux.

        Parameters
        ----------
        flux : float
            [`flux_unit`], above 0.

        Returns
        -------
        GriddedSource

        Raises
        ------
        ArgumentError
            If the flux is not a number above 0.
        """
        require_number(flux, "flux", f"a number of {self.flux_unit} above 0")
        if not (math.isfinite(flux) and flux > 0.0):
            raise ArgumentError(f"flux is {flux!r}; give a number of {self.flux_unit} above 0.")
        return dataclasses.replace(self, stated_flux=float(flux))

    @property
    def as_printed(self) -> GriddedSource:
        """The same patches with the light of their tables alone, as chapter 3 of the thesis prints them: factor 1."""
        return self.emitting(self.table_flux)

    @property
    def flux_note(self) -> str:
        """The flux of the rays, of the tables and of what is made of them, with the factor between."""
        unit, given = self.flux_unit, counted(self.emitted_flux, self.flux_unit)
        share = f"{self.table_flux / self.total_flux - 1:+.3%}".replace("-", "−")
        rays, tables = counted(self.total_flux, unit), counted(self.table_flux, unit)
        found = f"the rays on patches have {rays}, the tables {tables} ({share})"
        if self.factor == 1.0:
            return f"{found}; the light is as the tables have it"
        stated = "" if self.stated_flux is None else " as stated"
        return f"{found}; all light is theirs multiplied by {self.factor:.4g}, to {given}{stated}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know."""
        patches = self.patches
        finest = int((patches.error > self.threshold).sum())
        bins = f"{patches.bins.mean():,.0f} bins in the mean, {patches.bins.min():,} to {patches.bins.max():,}"
        found = [f"{len(patches):,} patches with {bins}"]
        if self.surface.parallels is not None:
            n = self.surface.parallels
            found.append(f"hemispheres in {(2 * n - 1) ** 2:,} cells of equal area by {n} parallels")
        if self.suited:
            found.append(f"threshold {self.threshold:g} %, chosen from the number of rays")
        if finest:
            found.append(f"{finest:,} patches do not reach E = {self.threshold:g} % even with the finest bins")
        return (*found, self.flux_note, *self.account.notes(self.flux_unit))

    def luminance(self, points: npt.ArrayLike, directions: npt.ArrayLike) -> Array:
        """Luminance of the light that leaves along lines, as a reverse ray tracer finds it.

        Each line is followed to the patches that it leaves through, one on each part of the surface at most, and their
        I(θ, φ) / (A cos θ) are added up, times `factor`: light from a window passes the dome above it.

        Parameters
        ----------
        points : array_like, shape (m, 3)
            Any point of each line [mm].
        directions : array_like, shape (m, 3)
            In which the light travels, of any length above 0.

        Returns
        -------
        array, shape (m,)
            [cd/m²], or W/(m² sr) when `flux_unit` is ``"W"``; 0 where no patch is.

        Raises
        ------
        ArgumentError
            If the shapes are others, a number is not finite, or a direction has no length.
        """
        points, directions = as_numbers(points, "luminance: points"), as_numbers(directions, "luminance: directions")
        if points.ndim != 2 or points.shape[1] != 3 or points.shape != directions.shape:
            raise ArgumentError(
                f"luminance: points {points.shape} and directions {directions.shape}; give (m, 3) of each."
            )
        length = np.linalg.norm(directions, axis=1)
        if not (np.isfinite(points).all() and np.isfinite(length).all() and (length > 0.0).all()):
            raise ArgumentError("luminance: a point or direction is not finite, or a direction has no length.")
        return np.concatenate(
            [
                self._seen(points[some], directions[some] / length[some, None])
                for some in (slice(start, start + LINES) for start in range(0, max(1, len(points)), LINES))
            ]
        )

    def _seen(self, points: Array, directions: Array) -> Array:
        patches, total = self.patches, np.zeros(len(points))
        for pixel in self.surface.passed(points, directions):
            place = np.searchsorted(patches.pixel, pixel)
            lit = np.flatnonzero(patches.pixel[np.minimum(place, len(patches) - 1)] == pixel)
            patch = place[lit]
            local = patches.local(patch, directions[lit])
            # Before 90° the intensity falls to 0 as the cosine does.
            cosine = np.where(local[:, 2] > 0.0, local[:, 2], np.inf)
            total[lit] += patches.at_local(patch, local) / (patches.projected_area[patch] * cosine)
        return total * (MM2_PER_M2 * self.factor)

    def intensity(self, c_planes: int = 36, gamma_step: float = 2.5) -> Intensity:
        """Far-field intensity of all patches together.

        Parameters
        ----------
        c_planes : int
            Half planes C, from 0° in equal steps.
        gamma_step : float
            [°], a whole part of 180.

        Returns
        -------
        Intensity
            Means over the cells around the nodes, to be compared with `etendue.intensity_distribution`; of the flux
            `emitted_flux`, within the error of such means.

        Raises
        ------
        ArgumentError
            If there are no such planes or steps.
        """
        found = summed_intensity(self.patches, c_planes, gamma_step)
        return dataclasses.replace(found, values=found.values * self.factor, notes=(*found.notes, self.flux_note))

    def sample(self, n: int, seed: int = 1) -> RaySet:
        """Draw rays of equal flux, patch by patch by the flux of its table, directions exactly from the table.

        On a flat patch the density of rays is that of `luminance`. On a curved one rays leave each point in proportion to
        the cosine there, so that the patch as a whole has the intensities of its table; the two differ where a patch is
        partly beyond its own horizon.

        Parameters
        ----------
        n : int
            Number of rays. Sets beyond 64 MB wait in a temporary file, not in memory.
        seed : int
            0 to 2⁶⁴ - 1; ray i depends on n, the seed and i alone.

        Returns
        -------
        RaySet
            Of the flux `emitted_flux`; its notes tell the factor.

        Raises
        ------
        ArgumentError
            If `n` or the seed is no whole number, or out of its range.
        """
        n, seed = as_whole(n, "sample: n", 1, MOST_RAYS), checked_seed(seed)
        records = spool(sampled_records(self.surface, self.patches, self.emitted_flux, n, seed), RECORD)
        provenance = self.patches.provenance.then(f"{n} rays drawn from {len(self.patches)} patches, seed {seed}")
        meaning = RaySetMeaning(flux_unit=self.flux_unit, provenance=provenance, notes=(self.flux_note,))
        return RaySet.from_records(records, meaning)

    @property
    def facts(self) -> dict[str, Any]:
        """The source in figures, as plain data [`flux_unit`, mm, %]."""
        return {
            "surface": self.surface.surface.spec,
            "pixel": self.pixel,
            "centre_on": self.surface.centre_on,
            "origin": self.surface.origin,
            "parallels": self.surface.parallels,
            "threshold": self.threshold,
            "flux": self.total_flux,
            "table_flux": self.table_flux,
            "factor": self.factor,
            "account": dataclasses.asdict(self.account),
            "notes": list(self.notes),
        }

    def save_patches(self, folder: str | os.PathLike[str], format: str = "ies", scenes: Iterable[str] = ()) -> None:
        """Write one intensity file per patch and a manifest from which other ray tracers can be driven.

        Parameters
        ----------
        folder : path
            To be made, whole or not at all; see docs/formats/patches.md. A folder of patches of that name is replaced, if
            it holds nothing else.
        format : {"ies", "ldt"}
            Of the intensity files.
        scenes : iterable of str
            ``"radiance"``, ``"mitsuba"``: scenes that are added. They give the light of the source, the tables times
            `factor`; the intensity files hold the tables alone.

        Raises
        ------
        UnknownNameError
            If there is no such format or ray tracer.
        ArgumentError
            If the folder cannot be written or holds something else, or the format does not know the unit of flux.
        """
        write_patch_folder(folder, self.patches, self.facts, format, scenes, self.factor)


def pixels_for(
    rays: RayStream, surface: Surface, pixel: float, parallels: int | None, centre_on: CentreOn = "auto"
) -> PixelatedSurface:
    """The pixels of a surface whose open dimensions are those of the rays: squares lie where no ray moves them.

    Raises
    ------
    UnknownNameError, ArgumentError
        As of `PixelatedSurface.cut`.

    Examples
    --------
    >>> import etendue as et
    >>> pixels_for(et.RingSource(rays=5000), et.Plane(z=0), 5.0, None).count       # the rings are 60 mm wide
    144
    """
    origin = (0.0, 0.0, 0.0) if getattr(surface, "centre", None) is None else None
    return PixelatedSurface.cut(surface.sized_for(rays), pixel, parallels, centre_on=centre_on, origin=origin)


def suited_threshold(rays_per_patch: float) -> float:
    """The threshold of E that suits a number of rays [%]: the finer the bins, the fewer rays each of them has.

    1000 % over the rays per patch, from 5 % down to 0.01 %, the smallest of the thesis, rounded to two digits. Of three
    lamps, each with 10⁵ to 10⁷ rays, it gave rays that were kept back a score that was at most 0.03 nat per ray below that
    of the best of nine thresholds; docs/chapter-3.md shows the sweeps.

    Parameters
    ----------
    rays_per_patch : float
        In the mean by flux; see `LitPixels.rays_per_patch`.

    Examples
    --------
    >>> [suited_threshold(rays) for rays in (20, 1638, 16_380, 2.5e6)]
    [5.0, 0.61, 0.061, 0.01]
    """
    return float(f"{min(max(RAYS_OF_ERROR * 100.0 / rays_per_patch, FINEST_THRESHOLD), COARSEST_THRESHOLD):.2g}")


def check_threshold(threshold: float) -> None:
    """Refuse what is no threshold.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> check_threshold(0.021)
    """
    require_number(threshold, "threshold", "the largest flux error of a patch in percent, 0 or more")
    if not (math.isfinite(threshold) and threshold >= 0.0):
        raise ArgumentError(
            f"threshold is {threshold!r}; give the largest flux error of a patch in percent, 0 or more."
        )
