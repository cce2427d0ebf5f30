"""Flux density in étendue on a carrier surface: what a light field is made of, and what it answers."""

from __future__ import annotations

import dataclasses
import math
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, UnitError
from etendue.lightfield.carrier import Surface
from etendue.lightfield.counting import FloatArray
from etendue.quantities.arguments import as_numbers, require_fields, require_known
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import checked_threads
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import FLUX_UNITS, MM2_PER_M2, FluxUnit


@dataclasses.dataclass(frozen=True, eq=False)
class FineErrors:
    """What is known of a part's errors beside those of its cells: within the cells, and of averages over pixels.

    Parameters
    ----------
    space, direction : array, shape (n, n), or None
        Relative standard deviation of B_s against its mean over a cell, at the centres of fine cells, bilinear between
        them, and the same of B_d; None: 0.
    cells_left : tuple of float
        What is left of the standard deviation of cells where their errors are averaged over squares of 1, 2, 4, … cells
        along either side of the place.
    within_left : tuple of float
        The same for `space`, in its own cells.
    """

    space: FloatArray | None = None
    direction: FloatArray | None = None
    cells_left: tuple[float, ...] = (1.0,)
    within_left: tuple[float, ...] = (1.0,)


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
    errors : FineErrors
        Beside `deviation`.
    """

    ratio: npt.NDArray[np.float32]
    deviation: npt.NDArray[np.float32]
    space: FloatArray | None
    direction: FloatArray | None
    level: float
    errors: FineErrors = dataclasses.field(default_factory=FineErrors)


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
    effective_rays : float
        (Σ w)²/Σ w² of the rays' flux: as many equal ones have the same error; NaN in fields of before it was kept.
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
    effective_rays: float = math.nan

    @property
    def score_text(self) -> str:
        """The score with its error, for people; a single ray that was held out says nothing of the error."""
        error = f" ± {self.score_error:.4f}" if math.isfinite(self.score_error) else ""
        return f"{self.score:.4f}{error} nat per ray"


@dataclasses.dataclass(frozen=True, eq=False)
class EtendueDensity:
    """What `etendue.LightField` holds, and the questions that it answers from it."""

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
            raise ArgumentError(f"{len(self.parts)} fields for the {len(charts)} parts of {self.surface.told}.")
        core = _core.LightField([core_part(chart.core(), part) for chart, part in zip(charts, self.parts, strict=True)])
        object.__setattr__(self, "_core", core)

    @property
    def core(self) -> _core.LightField:
        """The field as the compiled core takes it; luminance in [flux unit/(mm² sr)]."""
        core: _core.LightField = self._core  # type: ignore[attr-defined]
        return core

    @cached_property
    def part_flux(self) -> tuple[float, ...]:
        """∫ L dU over each part [flux unit]; worked out once, as every map asks for it."""
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

    def in_unit(self, unit: FluxUnit) -> Self:
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
        require_known(unit, FLUX_UNITS, "flux unit")
        if unit == self.flux_unit:
            return self
        if self.spectrum is None:
            raise UnitError(
                f"{self.provenance.source}: {self.flux_unit} cannot become {unit}: the light field knows no spectrum. Fit "
                "it to rays with wavelengths or a spectrum, or give it one in Python: field.replace(spectrum=Spectrum(...))."
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
                f"{self.flux_unit} became {unit} by {efficacy:.4g} lm/W, which all rays have together; where their colour "
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
        return isinstance(self.spectrum, SpectralLines) and self.spectrum.is_mean

    def content(self) -> dict[str, Any]:
        """The attributes by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def replace(self, **changes: Any) -> Self:
        """The same field with some attributes changed."""
        require_fields(changes, type(self))
        return dataclasses.replace(self, **changes)


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
        "space_error": part.errors.space,
        "direction_error": part.errors.direction,
        "cells_left": part.errors.cells_left,
        "within_left": part.errors.within_left,
    }


def _lines(points: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    given = (("points", points), ("directions", directions))
    x, k = (np.ascontiguousarray(np.atleast_2d(as_numbers(v, name, "rows of (n, 3)"))) for name, v in given)
    if x.shape != k.shape or x.shape[-1] != 3 or x.ndim != 2:
        raise ArgumentError(f"points of shape {x.shape} and directions of shape {k.shape}; give both as (n, 3).")
    if not (np.isfinite(x).all() and np.isfinite(k).all() and (np.abs(k).max(axis=1, initial=0) > 0).all()):
        raise ArgumentError("points and directions must be finite, and no direction may be zero.")
    return x, k
