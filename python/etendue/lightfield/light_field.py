"""The light field: luminance at every point of a carrier surface, in every direction."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, UnitError, UnknownNameError
from etendue.formats.input import as_path
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.surfaces import Surface
from etendue.quantities.intensity import Intensity
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, checked_threads
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import FLUX_UNITS, INTENSITY_UNIT, MM2_PER_M2, FluxUnit

if TYPE_CHECKING:
    from etendue.lightfield.field_rays import FieldRays

INTENSITY_SIDE = 96
"""Points along each coordinate of a part over which an intensity is summed: 9216 per part and direction."""


@dataclasses.dataclass(frozen=True, eq=False)
class PartField:
    """The light that leaves one part: L = level · B_s(s₁, s₂) · B_d(a, b) · r(s₁, s₂, a, b), theory eq. 38.

    Parameters
    ----------
    ratio : array of float32, shape (n₁, n₂, n₃, n₄)
        r at the centres of equal cells; between them it is linear in each coordinate.
    deviation : array of float32, same shape
        Its standard deviation.
    space : array, shape (n, n), or None
        B_s at the centres of finer cells, bilinear between them; None: 1.
    direction : array, shape (m, m), or None
        B_d, likewise.
    level : float
        [flux unit/(mm² sr)]
    """

    ratio: npt.NDArray[np.float32]
    deviation: npt.NDArray[np.float32]
    space: FloatArray | None
    direction: FloatArray | None
    level: float


@dataclasses.dataclass(frozen=True)
class FitReport:
    """What is known of how a field was fitted, and how well it fits.

    Parameters
    ----------
    rays, unmet_rays : int
        Rays with flux, and those that no part of the surface met.
    unmet_flux : float
        Flux of the latter [flux unit].
    bases : tuple of str
        The base measure of each part: ``"uniform"`` or ``"product"``.
    concentrations : tuple of float
        Of each part's tree.
    log_evidence : float
        ln of the evidence of the trees against their base measures, summed over the parts.
    score : float
        Mean ln of the density in étendue [1/(mm² sr)] that the field gives to held-out rays: the larger the better. Rays
        that do not meet the surface count with an even density over all lines through the source, so that fields of the
        same rays on different surfaces can be compared. It is that of one tree on nine tenths of the rays; the field, an
        average of trees on all rays, is somewhat better.
    score_error : float
        Standard error of the score.
    histogram_score : float
        That of the equal-étendue histogram of the fitted rays, on the same rays.
    effective_cells : float
        Effective degrees of freedom: how many free cells would be as uncertain as the field is.
    symmetry : str
        What the field was folded by: ``"none"``, or the symmetry that was stated or borne out by the rays.
    """

    rays: int
    unmet_rays: int
    unmet_flux: float
    bases: tuple[str, ...]
    concentrations: tuple[float, ...]
    log_evidence: float
    score: float
    score_error: float
    histogram_score: float
    effective_cells: float
    symmetry: str = "none"


@dataclasses.dataclass(frozen=True, eq=False)
class LightField:
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

    surface: Surface
    parts: tuple[PartField, ...]
    flux_unit: FluxUnit
    report: FitReport
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()
    spectrum: Spectrum | SpectralLines | None = None

    def __post_init__(self) -> None:
        charts = self.surface.parts()
        if len(charts) != len(self.parts):
            raise ArgumentError(f"{len(self.parts)} fields for the {len(charts)} parts of {self.surface.spec}.")
        core = _core.LightField([core_part(chart.core(), part) for chart, part in zip(charts, self.parts, strict=True)])
        object.__setattr__(self, "_core", core)

    @property
    def core(self) -> _core.LightField:
        """The field as the compiled core takes it; luminance in [flux unit/(mm² sr)]."""
        core: _core.LightField = self._core  # type: ignore[attr-defined]
        return core

    @property
    def part_flux(self) -> tuple[float, ...]:
        """∫ L dU over each part [flux unit]."""
        return tuple(self.core.flux())

    @property
    def total_flux(self) -> float:
        """∫ L dU over all parts [flux unit]: the flux of the rays that met the surface."""
        return math.fsum(self.part_flux)

    def luminance(
        self, points: npt.ArrayLike, directions: npt.ArrayLike, *, threads: int | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Luminance along lines, and its standard error, each of shape (n,) [cd/m² or W/(m² sr)].

        Parameters
        ----------
        points : array_like, shape (n, 3)
            Any points of the lines outside the source [mm]; luminance is constant along a line.
        directions : array_like, shape (n, 3)
            In which the light travels; normalised on use.
        threads : int, optional
            All cores if None.

        Raises
        ------
        ArgumentError
            If the shapes disagree or a value is not finite.
        """
        x, k = _lines(points, directions)
        value, deviation = self.core.luminance(x, k, checked_threads(threads))
        return value * MM2_PER_M2, deviation * MM2_PER_M2

    def pdf(self, points: npt.ArrayLike, directions: npt.ArrayLike) -> FloatArray:
        """Density of `sample` in étendue along lines [1/(mm² sr)], shape (n,): L/Φ."""
        x, k = _lines(points, directions)
        density: FloatArray = self.core.luminance(x, k)[0] / self.total_flux
        return density

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
        from etendue.lightfield.field_rays import FieldRays  # noqa: PLC0415 - it needs this class

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
        from etendue.lightfield.fitting import fit_light_field  # noqa: PLC0415 - it needs this class

        return fit_light_field(
            rays, surface, symmetry=symmetry, depths=depths, seed=seed, threads=threads, progress=progress
        )

    def in_unit(self, unit: FluxUnit) -> LightField:
        """The field in lumens or watts, by the luminous efficacy of its spectrum: that of all its light together.

        Raises
        ------
        UnitError
            If the field knows no spectrum, or its light has no lumens.
        UnknownNameError
            If there is no such unit.

        Examples
        --------
        >>> import etendue as et
        >>> rays = et.RingSource(rays=100_000).ray_set().replace(flux_unit="W", single_wavelength=555.0)
        >>> field = et.LightField.fit(rays, et.Disk(radius=30), depths=(3, 3, 3, 3))
        >>> round(field.in_unit("lm").total_flux / field.total_flux)
        683
        """
        if unit not in FLUX_UNITS:
            raise UnknownNameError("flux unit", unit, FLUX_UNITS)
        if unit == self.flux_unit:
            return self
        if self.spectrum is None:
            raise UnitError(
                f"{self.provenance.source}: {self.flux_unit} cannot become {unit}: the light field knows no spectrum. Fit "
                "it to rays with wavelengths or a spectrum, or give it one: field.replace(spectrum=Spectrum(...))."
            )
        efficacy = self.spectrum.luminous_efficacy
        if not efficacy > 0.0:
            raise UnitError(
                f"{self.provenance.source}: {self.flux_unit} cannot become {unit}: V(λ) is 0 at the wavelengths of this "
                "light."
            )
        factor = efficacy if unit == "lm" else 1.0 / efficacy
        notes = list(self.notes)
        if self.spectrum_is_mean:
            notes.append(
                f"{self.flux_unit} became {unit} by {efficacy:.5g} lm/W, which all rays have together; where their colour "
                "changes with place or direction, convert the rays before the fit"
            )
        return self.replace(
            parts=tuple(dataclasses.replace(part, level=part.level * factor) for part in self.parts),
            flux_unit=unit,
            report=dataclasses.replace(self.report, unmet_flux=self.report.unmet_flux * factor),
            provenance=self.provenance.then(f"{self.flux_unit} to {unit} through its spectrum"),
            notes=tuple(notes),
        )

    @property
    def spectrum_is_mean(self) -> bool:
        """Whether the rays had different wavelengths, of which the field only knows the distribution."""
        return isinstance(self.spectrum, SpectralLines) and self.spectrum.wavelength.size > 1

    def replace(self, **changes: Any) -> LightField:
        """The same field with some attributes changed."""
        return dataclasses.replace(self, **changes)

    def save(self, path: str | Path) -> None:
        """Write the field to an HDF5 file, whole or not at all; see docs/formats/light-fields.md.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        from etendue.lightfield.storage import save_field  # noqa: PLC0415 - it needs this class

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
        from etendue.lightfield.storage import load_field  # noqa: PLC0415 - it needs this class

        return load_field(as_path(path))


def core_part(chart: _core._Part, part: PartField) -> _core._FieldPart:
    """A part as the compiled core takes it."""
    return {
        "part": chart,
        "cells": part.ratio.shape,
        "ratio": np.ascontiguousarray(part.ratio, dtype=np.float32).ravel(),
        "deviation": np.ascontiguousarray(part.deviation, dtype=np.float32).ravel(),
        "space": part.space,
        "direction": part.direction,
        "level": part.level,
    }


def _lines(points: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    x, k = (np.ascontiguousarray(np.atleast_2d(v), dtype=np.float64) for v in (points, directions))
    if x.shape != k.shape or x.shape[-1] != 3 or x.ndim != 2:
        raise ArgumentError(f"points of shape {x.shape} and directions of shape {k.shape}; give both as (n, 3).")
    if not (np.isfinite(x).all() and np.isfinite(k).all() and (np.abs(k).max(axis=1, initial=0) > 0).all()):
        raise ArgumentError("points and directions must be finite, and no direction may be zero.")
    return x, k
