"""A spectrum as a function of wavelength, and what turns watts into lumens."""

from __future__ import annotations

import dataclasses
import functools
import importlib.resources

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, require_known
from etendue.units import FLUX_UNITS, LUMINOUS_EFFICACY_MAX, FluxUnit

FloatArray = npt.NDArray[np.float64]

LINE_STEP = 1.0
"""Widest step between the lines that stand for a spectrum [nm]: that of the table of V(λ)."""

MOST_LINES = 4096
"""Lines that stand for a spectrum beyond its own nodes at most: from 0.4 µm to 4 µm by the nanometre."""


@dataclasses.dataclass(frozen=True, eq=False)
class Spectrum:
    """Relative spectral radiant flux: linear between the tabulated wavelengths, 0 outside them.

    A table of one pair is a line: all flux at that wavelength.

    Parameters
    ----------
    wavelength : array, shape (n,)
        Rising wavelengths [nm].
    weight : array, shape (n,)
        Spectral radiant flux per nm, on any scale, ≥ 0.

    Raises
    ------
    ArgumentError
        If the arrays differ in length, are empty or not finite, wavelengths do not rise, or a weight is negative.

    Examples
    --------
    >>> line = Spectrum([555.0], [1.0])
    >>> round(line.luminous_efficacy)
    683
    """

    wavelength: FloatArray
    weight: FloatArray

    def __post_init__(self) -> None:
        wavelength = as_numbers(self.wavelength, "Spectrum: wavelength", copy=True)
        weight = as_numbers(self.weight, "Spectrum: weight", copy=True)
        if wavelength.ndim != 1 or wavelength.shape != weight.shape or wavelength.size == 0:
            raise ArgumentError(
                f"Spectrum: {wavelength.shape} wavelengths and {weight.shape} weights; give two equally long rows."
            )
        if not (np.isfinite(wavelength).all() and np.isfinite(weight).all()):
            raise ArgumentError("Spectrum: a wavelength or weight is not finite.")
        if wavelength[0] <= 0 or (np.diff(wavelength) <= 0).any() or (weight < 0).any():
            raise ArgumentError("Spectrum: wavelengths must be above 0 nm and rise, weights must not be negative.")
        for name, array in (("wavelength", wavelength), ("weight", weight)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def total(self) -> float:
        """∫ of the weight over wavelength; for a line its weight."""
        if self.wavelength.size == 1:
            return float(self.weight[0])
        return float(np.sum(np.diff(self.wavelength) * (self.weight[1:] + self.weight[:-1])) / 2)

    @property
    def luminous_efficacy(self) -> float:
        """K = K_m ∫ S V dλ / ∫ S dλ [lm/W] (theory eq. 25) (CIE S 017, 17-21-090).

        The product of the two piecewise linear functions is integrated exactly, by Simpson's rule between the union of
        their nodes.
        """
        if self.total == 0.0:
            return 0.0
        if self.wavelength.size == 1:
            return LUMINOUS_EFFICACY_MAX * float(photopic_efficiency(self.wavelength)[0])
        nodes, _ = _photopic_table()
        at = np.union1d(self.wavelength, nodes)
        # Only where both are defined: at the ends of its table V steps to 0, and Simpson's rule must not straddle a step.
        low, high = max(nodes[0], self.wavelength[0]), min(nodes[-1], self.wavelength[-1])
        at = at[(at >= low) & (at <= high)]
        middle = (at[1:] + at[:-1]) / 2
        product = np.interp(at, self.wavelength, self.weight) * photopic_efficiency(at)
        product_middle = np.interp(middle, self.wavelength, self.weight) * photopic_efficiency(middle)
        integral = float(np.sum(np.diff(at) / 6 * (product[1:] + 4 * product_middle + product[:-1])))
        return LUMINOUS_EFFICACY_MAX * integral / self.total

    def lines(self, flux_unit: FluxUnit) -> tuple[FloatArray, FloatArray]:
        """The spectrum as lines: wavelengths [nm], and the share of the flux around each, by the trapezoidal rule.

        The lines are the nodes of the table, and more between nodes that are further apart than `LINE_STEP`: refraction
        and V(λ) change in between. In lumens each line counts with its V(λ). The efficacy of lines by the nanometre is
        that of the spectrum to a few parts in 10⁵: the rule is exact for the table itself, and V(λ) is tabulated by 1 nm.

        Examples
        --------
        >>> wavelength, shares = Spectrum([500, 501, 502], [1, 1, 1]).lines("W")
        >>> shares.tolist()
        [0.25, 0.5, 0.25]
        >>> wavelength, shares = Spectrum([450, 650], [1, 1]).lines("lm")
        >>> wavelength.size, round(float(wavelength @ shares))
        (201, 559)
        """
        require_known(flux_unit, FLUX_UNITS, "flux unit")
        wavelength = self._refined()
        weight = np.interp(wavelength, self.wavelength, self.weight)
        if wavelength.size > 1:
            gaps = np.diff(wavelength)
            weight = weight * (
                np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0)
            )  # twice the trapezoids; only ratios count
        if flux_unit == "lm":
            weight = weight * photopic_efficiency(wavelength)
        kept = weight > 0.0
        if not kept.any():
            return wavelength[:1].copy(), np.array([1.0])
        return wavelength[kept], weight[kept] / weight[kept].sum()

    def _refined(self) -> FloatArray:
        """The nodes, and more that divide each gap evenly into steps of `LINE_STEP` at most."""
        gaps = np.diff(self.wavelength)
        step = max(LINE_STEP, float(gaps.sum()) / MOST_LINES)
        # What rounding leaves above a whole number of steps is no further one.
        pieces = np.maximum(np.ceil(gaps / step - 1e-6), 1.0).astype(np.int64)
        if (pieces == 1).all():
            return self.wavelength
        piece = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        inner = np.repeat(self.wavelength[:-1], pieces) + piece * np.repeat(gaps / pieces, pieces)
        return np.append(inner, self.wavelength[-1])


def photopic_efficiency(wavelength: npt.ArrayLike) -> FloatArray:
    """V(λ), the CIE 1924 spectral luminous efficiency function for photopic vision (CIE 018:2019).

    Linear between the table's 1 nm steps, 0 outside 360 nm to 830 nm.

    Parameters
    ----------
    wavelength : array_like, shape (n,)
        [nm]

    Examples
    --------
    >>> photopic_efficiency([555.0, 300.0]).tolist()
    [1.0, 0.0]
    """
    nodes, values = _photopic_table()
    return np.interp(np.asarray(wavelength, dtype=np.float64), nodes, values, left=0.0, right=0.0)


@functools.cache
def _photopic_table() -> tuple[FloatArray, FloatArray]:
    table = importlib.resources.files("etendue.quantities").joinpath("photopic_efficiency.csv")
    with table.open(encoding="utf-8") as lines:
        wavelength, value = np.loadtxt(lines, delimiter=",", unpack=True)
    return wavelength, value
