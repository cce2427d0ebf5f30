"""A ray set: positions, directions and fluxes, from a file or from arrays, and all that can be done with them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities import ray_colours, ray_merge, ray_operations, ray_units
from etendue.quantities.arguments import as_numbers, require
from etendue.quantities.notebook import InNotebook
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RayRecords, RaySetMeaning
from etendue.quantities.ray_stream import FloatArray, Progress, RayBatch
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import FluxUnit


class RaySet(RayRecords, InNotebook):
    """A sample of a source's light: rays with position, direction and flux.

    The rays stay where they are, in memory or in their file; properties copy what is asked for, `batches` streams.

    Parameters
    ----------
    position : array_like, shape (n, 3)
        Start points [mm].
    direction : array_like, shape (n, 3)
        Directions; normalised on use.
    flux : array_like, shape (n,)
        Flux of each ray [`flux_unit`], ≥ 0.
    flux_unit : {"lm", "W"}
    wavelength : array_like, shape (n,), optional
        [nm]
    spectra : sequence of Spectrum
        One for all rays.

    Raises
    ------
    ArgumentError
        If shapes disagree.

    Examples
    --------
    >>> rays = RaySet([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 3, 4]], [1.0, 2.0])
    >>> len(rays), rays.total_flux, rays.direction[1].tolist()
    (2, 3.0, [0.0, 0.6, 0.8])
    """

    def __init__(
        self,
        position: npt.ArrayLike,
        direction: npt.ArrayLike,
        flux: npt.ArrayLike,
        *,
        flux_unit: FluxUnit = "lm",
        wavelength: npt.ArrayLike | None = None,
        spectra: tuple[Spectrum, ...] = (),
        provenance: Provenance | None = None,
    ) -> None:
        columns = {"position": position, "direction": direction, "flux": flux}
        if wavelength is not None:
            columns["wavelength"] = wavelength
        arrays = {name: as_numbers(value, f"RaySet: {name}") for name, value in columns.items()}
        n = arrays["flux"].size
        for name, array in arrays.items():
            expected = (n, 3) if name in ("position", "direction") else (n,)
            if array.shape != expected:
                raise ArgumentError(f"RaySet: {name} has shape {array.shape}; with {n} rays it must be {expected}.")
        records = np.zeros(n, dtype=[(name, "<f8", array.shape[1:]) for name, array in arrays.items()])
        for name, array in arrays.items():
            records[name] = array
        require(spectra, Sequence, "RaySet: spectra", "a sequence of et.Spectrum")
        for one in spectra:
            require(one, Spectrum, "RaySet: one of the spectra", "an et.Spectrum(wavelength, weight)")
        meaning = RaySetMeaning(
            flux_unit=flux_unit, spectra=tuple(spectra), provenance=Provenance() if provenance is None else provenance
        )
        self._adopt(records, meaning)

    _colours: ray_colours.Colours | None = None

    def subset(self, n: int, seed: int) -> RaySet:
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
        return ray_operations.subset(self, n, seed)

    def thin(self, parts: int, seed: int) -> tuple[RaySet, ...]:
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
        return ray_operations.thin(self, parts, seed)

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
            the spectrum of every ray, by ``spectrum_index``, if each set does; where some have wavelengths, 4096 different
            ones at most, and others spectra, each wavelength becomes a spectrum of one line. The complaints name sets that
            hold the same rays, which are not independent of each other.

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
        return ray_merge.merged(sets, flux, unit)

    def with_total_flux(self, flux: float, unit: FluxUnit | None = None) -> RaySet:
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
            If `flux` is not finite or not above 0, or the rays carry none.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [0, 0, 1]], [1.0, 3.0])
        >>> rays.with_total_flux(337).flux.tolist()
        [84.25, 252.75]
        """
        return ray_operations.with_total_flux(self, flux, unit)

    def scaled(self, factor: float) -> RaySet:
        """Positions multiplied by `factor` (> 0); directions and flux stay, so luminance falls by its square."""
        return ray_operations.scaled(self, factor)

    def moved(self, offset: Sequence[float]) -> RaySet:
        """Positions shifted by `offset`, three components [mm].

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[1, 2, 3]], [[0, 0, 1]], [1.0]).moved((0, 0, -3)).position.tolist()
        [[1.0, 2.0, 0.0]]
        """
        return ray_operations.moved(self, offset)

    def rotated(self, axis: Sequence[float], angle: float) -> RaySet:
        """Turned about an axis through the origin by `angle` [°], right-handed.

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[1, 0, 0]], [[1, 0, 0]], [1.0]).rotated((0, 0, 1), 90).position.round(12).tolist()
        [[0.0, 1.0, 0.0]]
        """
        return ray_operations.rotated(self, axis, angle)

    def propagated_to_plane(self, point: Sequence[float], normal: Sequence[float] = (0.0, 0.0, 1.0)) -> RaySet:
        """Start points moved along the rays, forwards or backwards, onto the plane through `point` [mm].

        Rays parallel to the plane never meet it: they are left out, and the number and flux are complained about.
        """
        return ray_operations.propagated_to_plane(self, point, normal)

    def propagated_to_sphere(self, centre: Sequence[float], radius: float) -> RaySet:
        """Start points moved along the rays, forwards or backwards, to where they leave a sphere [mm].

        Rays whose line misses the sphere are left out, and the number and flux are complained about.
        """
        return ray_operations.propagated_to_sphere(self, centre, radius)

    @property
    def virtual_focus(self) -> ray_operations.VirtualFocus:
        """The point F with the least Σ w |distance of F to the ray's line|² ([Muschaweck2019]_).

        The normal equations (theory eq. 24) A F = b with A = Σ w (1 - k kᵀ), b = Σ w (1 - k kᵀ) x; vendors print F in their
        data sheets.
        """
        return ray_operations.virtual_focus(self)

    # --- units and colours

    def in_unit(self, unit: FluxUnit) -> RaySet:
        """The set with its flux in lumens or watts, through its spectrum: Φ_v = K_m ∫ Φ_e,λ V(λ) dλ.

        If no spectrum is known, but the header of the rays' file states the total in both units, their ratio is taken for
        all rays. The last step of the provenance says how it was done.

        Raises
        ------
        UnitError
            If the set knows neither the spectrum of its rays nor both totals; the message says what would help.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], flux_unit="W", wavelength=[555.0])
        >>> round(rays.in_unit("lm").total_flux, 6)
        683.0
        """
        return ray_units.in_unit(self, unit)

    @property
    def knows_spectrum(self) -> bool:
        """Whether every ray has a wavelength or a spectrum, so that watts and lumens can be converted."""
        return ray_units.knows_spectrum(self)

    def without_spectrum(self) -> RaySet:
        """The same rays with nothing known of their spectra, wavelengths and polarisation.

        Examples
        --------
        >>> import etendue as et
        >>> et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], wavelength=[450.0]).without_spectrum().knows_spectrum
        False
        """
        return ray_units.without_spectrum(self)

    def with_spectrum(self, spectrum: Spectrum) -> RaySet:
        """The same rays with one spectrum for all, in place of whatever was known of their spectra and wavelengths.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1.0], flux_unit="W", wavelength=[450.0])
        >>> round(rays.with_spectrum(et.Spectrum([555.0], [1.0])).in_unit("lm").total_flux)
        683
        """
        return ray_units.with_spectrum(self, spectrum)

    @property
    def colour_column(self) -> str | None:
        """The column that tells the colour of each ray, if there is one: ``wavelength`` or ``spectrum_index``."""
        return ray_colours.colour_column(self)

    def coloured_source(self) -> Any:
        """The records as the compiled core takes them, with the column that tells the colours of the rays, if any.

        Raises
        ------
        ArgumentError
            If that column is of a type that no ray file has.
        """
        return ray_colours.coloured_source(self)

    def wavelength_of(self, batch: RayBatch) -> FloatArray | None:
        """Wavelength of each ray of a batch [nm], shape (k,); None if the set does not know it."""
        return ray_colours.wavelength_of(self, batch)

    def colours(self, progress: Progress | None = None, threads: int | None = None) -> ray_colours.Colours | None:
        """What the rays' own colours amount to, by one pass the first time; None if they have none of their own."""
        if self._colours is None:
            self._colours = ray_colours.scan_colours(self, progress, threads)
        return self._colours

    def total_spectrum(
        self, progress: Progress | None = None, threads: int | None = None
    ) -> Spectrum | SpectralLines | None:
        """The spectrum of all rays together, whatever their places and directions; None if it is not known.

        Rays with a wavelength or a spectrum each take one pass the first time. Flux of rays that state none is left out.
        """
        if self.colour_column is None:
            return ray_colours.shared_spectrum(self)
        colours = self.colours(progress, threads)
        return None if colours is None else colours.lines
