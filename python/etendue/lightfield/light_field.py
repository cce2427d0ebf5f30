"""The light field: luminance at every point of a carrier surface, in every direction."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Literal

from etendue.formats.input import as_path
from etendue.lightfield.carrier import Surface
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.far_field import field_intensity
from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.fitting import fit_light_field
from etendue.lightfield.resolution import Resolution, resolution
from etendue.lightfield.storage import load_field, save_field
from etendue.quantities.intensity import Intensity
from etendue.quantities.notebook import InNotebook
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream


@dataclasses.dataclass(frozen=True, eq=False)
class LightField(EtendueDensity, InNotebook):
    """Luminance as flux density in étendue, on a carrier surface, with its standard error.

    Make one with `LightField.fit`, keep it with `save`, get it back with `LightField.load`.

    Parameters
    ----------
    surface : Surface
        With all its dimensions.
    parts : tuple of PartField
        One for each part of the surface.
    flux_unit : {"lm", "W"}
    report : FitReport
    provenance : Provenance
    notes : tuple of str
        What the user should know.
    spectrum : Spectrum, SpectralLines or None
        Of all the light together, the same for every place and direction: lines where the rays have a wavelength each.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=100_000), et.Disk(radius=30), depths=(4, 4, 3, 3))
    >>> round(field.total_flux, 6)
    600.0
    >>> luminance, error = field.luminance([[0, 0, 0]], [[0, 0.6, 0.8]])
    >>> bool(abs(luminance[0] / 303_964 - 1) < 0.1)
    True
    """

    def __repr__(self) -> str:
        """Surface, rays that it rests on, flux and origin."""
        rests = f"{self.report.rays:,} rays, {counted(self.total_flux, self.flux_unit)}"
        return f"<LightField on {self.surface.told} of {rests} from {self.provenance.source}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the compiled part is made anew."""
        return LightField, tuple(self.content().values())

    def rays(self, n: int, seed: int = 1) -> FieldRays:
        """`n` rays of equal flux drawn from the field, as a stream that needs no memory.

        Parameters
        ----------
        n : int
            Number of rays, which together carry the field's flux.
        seed : int
            0 to 2⁶⁴ - 1.

        Raises
        ------
        ArgumentError
            If there are no rays to be drawn, or there is no such seed.
        """
        return FieldRays(self, n, seed)

    def sample(self, n: int, seed: int = 1) -> RaySet:
        """The same rays as those of `rays`, as a ray set in memory: 56 bytes each."""
        return self.rays(n, seed).ray_set()

    def intensity(
        self, c_planes: int | None = None, gamma_step: float | None = None, *, threads: int | None = None
    ) -> Intensity:
        """Far-field intensity, I(k) = ∫ L(x, k) n·k dA over the surface, as a table that holds the field's flux.

        The value of a node is the mean of I around it, weighted by its hat as in `etendue.intensity_distribution`, by
        quadrature over directions and over the surface (midpoint rule). So the integral of the table is the flux.

        Parameters
        ----------
        c_planes : int, optional
            Half planes C, from 0° in equal steps; None: chosen from the field, for each γ.
        gamma_step : float, optional
            [°], a whole part of 180; None: chosen from the field.
        threads : int, optional
            All cores if None.

        Returns
        -------
        Intensity
            Its `standard_error` is that of another route than the error bars of the field, whose correlation from cell to
            cell is not known: √(Φ/n ∫φ² I dΩ)/∫φ dΩ, the counting error that n equal rays of the field's flux Φ have in a
            node of hat φ, and that of one ray more, n being those that the field rests on with the images of its symmetry.
            The field smooths and is mostly better than that; where it broadens a beam, a note says that the peak is too low.
            The field's notes are among the table's.

        Raises
        ------
        ArgumentError
            If there are no such planes or steps.

        Examples
        --------
        >>> import etendue as et
        >>> field = et.LightField.fit(et.RingSource(rays=30_000), et.Disk(radius=30), depths=(3, 3, 3, 3))
        >>> far = field.intensity()
        >>> round(far.flux, 6), bool(abs(far.at(0, 0) / (600 / 3.14159265) - 1) < 0.1)
        (600.0, True)
        """
        return field_intensity(self, c_planes, gamma_step, threads)

    def resolution(self, *, seed: int = 1, threads: int | None = None) -> Resolution:
        """What the field resolves: the pitch of spots, in mm and in degrees, that it would show with half their contrast.

        See `etendue.lightfield.resolution.resolution`.

        Examples
        --------
        >>> import etendue as et
        >>> field = et.LightField.fit(et.RingSource(rays=4000), et.Disk(radius=30), depths=(3, 3, 2, 2))
        >>> field.resolution().place_limit
        'rays'
        """
        return resolution(self, seed=seed, threads=threads)

    @staticmethod
    def fit(
        rays: RayStream,
        surface: Surface | Literal["auto"] = "auto",
        *,
        symmetry: str = "none",
        depths: tuple[int, int, int, int] | None = None,
        max_resolution: float | None = None,
        seed: int = 1,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> LightField:
        """The light field of a ray set: luminance as the density of its rays in étendue, theory section 14.

        Every ray is counted in the cell of étendue that it crosses on the surface. An optional Pólya tree over the cells
        then averages over all ways to merge them, each with its posterior probability. Whatever is open is chosen by how
        well held-out rays are predicted; the field itself rests on all rays.

        Parameters
        ----------
        rays : RayStream
            Any number of rays, of equal or unequal flux. Rays that a set holds several times count as one, up to some 8
            million rays; the notes say so.
        surface : Surface or "auto"
            Where the light is carried to, along the rays; ``"auto"``: the surface that predicts held-out rays best. Of a
            plane the focus is found where it is left out, and, if all its dimensions are, a window with frames about it.
        symmetry : str
            A symmetry of the source about the surface's axis, which multiplies its rays: ``"none"``, ``"mirror-x"``,
            ``"mirror-y"``, ``"mirror-xy"``, ``"c2"``, ``"c4"``, or ``"auto"``: one of them if the rays bear it out. A note
            tells if they refute the one that is stated.
        depths : tuple of int, optional
            2^depth cells along s₁, s₂, a and b, but on frames with few rays; None: chosen.
        max_resolution : float, optional
            Longer side of the finest cells over place [mm]: at most 4096 × 4096 on the surface or, of a plane with frames,
            on its window, and no more than there are rays. None: 512 × 512. `resolution` tells what the field resolves.
        seed : int
            Decides which rays are held out.
        threads : int, optional
            All cores if None. The result has the same bits for any number.
        progress : callable, optional
            Called with rising numbers of rays, up to all of them, as the fit goes on; its other stages count as the rays
            that might be read meanwhile.

        Raises
        ------
        ArgumentError
            If the rays have no position, carry no flux, none meets the surface, or there is no such seed.
        UnknownNameError
            If there is no such symmetry.
        """
        density = fit_light_field(
            rays,
            surface,
            symmetry=symmetry,
            depths=depths,
            max_resolution=max_resolution,
            seed=seed,
            threads=threads,
            progress=progress,
        )
        return LightField(**density.content())

    def save(self, path: str | Path) -> None:
        """Write the field to an HDF5 file, whole or not at all; see docs/formats/light-fields.md.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        save_field(self, as_path(path))

    @staticmethod
    def load(path: str | Path) -> LightField:
        """Read a field that `save` has written.

        Raises
        ------
        FormatError
            If the file is no light field, is damaged, or was written by a later version.
        OSError
            If there is no such file.
        """
        return LightField(**load_field(as_path(path)).content())
