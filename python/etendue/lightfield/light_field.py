"""The light field: luminance at every point of a carrier surface, in every direction."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any, Literal

import numpy as np

from etendue.errors import ArgumentError
from etendue.formats.input import as_path
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.etendue_density import EtendueDensity
from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.fitting import fit_light_field
from etendue.lightfield.storage import load_field, save_field
from etendue.lightfield.surfaces import Surface
from etendue.quantities.intensity import Intensity
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_threads
from etendue.units import INTENSITY_UNIT

INTENSITY_SIDE = 96
"""Points along each coordinate of a part over which an intensity is summed: 9216 per part and direction."""


@dataclasses.dataclass(frozen=True, eq=False)
class LightField(EtendueDensity):
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
    >>> field = et.LightField.fit(et.RingSource(rays=300_000), et.Disk(radius=30), depths=(4, 4, 3, 3))
    >>> round(field.total_flux, 6)
    600.0
    >>> luminance, error = field.luminance([[0, 0, 0]], [[0, 0.6, 0.8]])
    >>> bool(abs(luminance[0] / 303_964 - 1) < 0.1)
    True
    """

    def __repr__(self) -> str:
        """Surface, rays that it rests on, flux and origin."""
        rests = f"{self.report.rays:,} rays, {self.total_flux:.6g} {self.flux_unit}"
        return f"<LightField on {self.surface.spec} of {rests} from {self.provenance.source}>"

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

    def intensity(self, c_planes: int = 24, gamma_step: float = 5.0, *, threads: int | None = None) -> Intensity:
        """Far-field intensity, I(k) = ∫ L(x, k) n·k dA over the surface, by the midpoint rule.

        Parameters
        ----------
        c_planes : int
            Number of C planes, from C = 0° in equal steps.
        gamma_step : float
            [°], a whole part of 180.
        threads : int, optional
            All cores if None.

        Raises
        ------
        ArgumentError
            If there are no such planes or steps.
        """
        steps = round(180.0 / gamma_step) if math.isfinite(gamma_step) and gamma_step > 0 else 0
        if not (isinstance(c_planes, int) and 1 <= c_planes <= 3600):
            raise ArgumentError(f"c_planes is {c_planes!r}; give a whole number of planes, 1 to 3600.")
        if not (1 <= steps <= 3600 and math.isclose(steps * gamma_step, 180.0, rel_tol=1e-9)):
            raise ArgumentError(f"gamma_step is {gamma_step}°; give a whole part of 180°, 0.05° or more.")
        c: FloatArray = np.arange(c_planes, dtype=np.float64) * (360.0 / c_planes)
        gamma: FloatArray = np.arange(steps + 1, dtype=np.float64) * (180.0 / steps)
        phi, theta = np.radians(c)[:, None], np.radians(gamma)[None, :]
        k = np.stack(
            np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), axis=-1
        )
        values = self.core.intensity(np.ascontiguousarray(k.reshape(-1, 3)), INTENSITY_SIDE, checked_threads(threads))
        return Intensity(
            c=c,
            gamma=gamma,
            values=values.reshape(c_planes, steps + 1),
            flux_unit=self.flux_unit,
            provenance=self.provenance.then(f"intensity [{INTENSITY_UNIT[self.flux_unit]}] of the light field"),
        )

    @staticmethod
    def fit(
        rays: RayStream,
        surface: Surface | Literal["auto"] = "auto",
        *,
        symmetry: str = "none",
        depths: tuple[int, int, int, int] | None = None,
        seed: int = 1,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> LightField:
        """The light field of a ray set: luminance as the density of its rays in étendue, theory section 14.

        Every ray is counted in the cell of étendue that it crosses on the surface. An optional Pólya tree over the cells
        then averages over all ways to merge them, each with its posterior probability. Whatever is open is chosen by how
        well held-out rays are foretold; the field itself rests on all rays.

        Parameters
        ----------
        rays : RayStream
            Any number of rays, of equal or unequal flux.
        surface : Surface or "auto"
            Where the light is carried to, along the rays; ``"auto"``: the surface that foretells held-out rays best.
        symmetry : str
            A symmetry of the source about the surface's axis, which multiplies its rays: ``"none"``, ``"mirror-x"``,
            ``"mirror-y"``, ``"mirror-xy"``, ``"c2"``, ``"c4"``, or ``"auto"``: one of them if the rays bear it out.
        depths : tuple of int, optional
            2^depth cells along s₁, s₂, a and b; None: chosen.
        seed : int
            Decides which rays are held out.
        threads : int, optional
            All cores if None. The result has the same bits for any number.
        progress : callable, optional
            Called with the number of rays done.

        Raises
        ------
        ArgumentError
            If the rays have no position, carry no flux, or none meets the surface.
        UnknownNameError
            If there is no such symmetry.
        """
        density = fit_light_field(
            rays, surface, symmetry=symmetry, depths=depths, seed=seed, threads=threads, progress=progress
        )
        return LightField(**density.content())

    def save(self, path: str | Path) -> None:
        """Write the field to an HDF5 file, whole or not at all; see docs/formats/light-fields.md.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        save_field(self, Path(path))

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
