"""Flux at single wavelengths: what the rays of a set that differ in colour have together."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnitError
from etendue.quantities.arguments import require_known
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.units import FLUX_UNITS, LUMINOUS_EFFICACY_MAX, FluxUnit

FloatArray = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class SpectralLines:
    """Flux at wavelengths, nothing between them.

    Parameters
    ----------
    wavelength : array, shape (n,)
        Rising wavelengths [nm].
    weight : array, shape (n,)
        Flux at each of them, on any scale, ≥ 0 and not 0 everywhere.
    flux_unit : {"lm", "W"}
        What the flux is counted in.

    Raises
    ------
    ArgumentError
        If the arrays differ in length, are empty or not finite, wavelengths do not rise, or there is no flux.
    UnknownNameError
        If there is no such unit.

    Examples
    --------
    >>> lines = SpectralLines([450.0, 550.0, 633.0], [1.0, 1.0, 1.0])
    >>> round(lines.luminous_efficacy, 1), lines.lines("W")[1].round(3).tolist()
    (288.7, [0.333, 0.333, 0.333])
    """

    wavelength: FloatArray
    weight: FloatArray
    flux_unit: FluxUnit = "W"

    def __post_init__(self) -> None:
        require_known(self.flux_unit, FLUX_UNITS, "flux unit")
        # The same conditions as for a table over wavelength, which tells what is wrong.
        table = Spectrum(self.wavelength, self.weight)
        if not table.weight.any():
            raise ArgumentError("SpectralLines: no line has flux.")
        object.__setattr__(self, "wavelength", table.wavelength)
        object.__setattr__(self, "weight", table.weight)

    @property
    def is_mean(self) -> bool:
        """Whether these are the colours of several rays together, each of which may have another one."""
        return self.wavelength.size > 1

    @property
    def luminous_efficacy(self) -> float:
        """K = K_m Σ Φ_e V(λ) / Σ Φ_e [lm/W] (theory eq. 25); 0 if lumens are stated where V(λ) is 0."""
        efficacy = LUMINOUS_EFFICACY_MAX * photopic_efficiency(self.wavelength)
        if self.flux_unit == "W":
            return float(self.weight @ efficacy / self.weight.sum())
        with np.errstate(divide="ignore"):
            watts = np.divide(self.weight, efficacy, out=np.zeros_like(self.weight), where=self.weight > 0.0)
        return float(self.weight.sum() / watts.sum())

    def lines(self, flux_unit: FluxUnit) -> tuple[FloatArray, FloatArray]:
        """Wavelengths [nm], and the share of the flux [`flux_unit`] at each of them, as `Spectrum.lines` gives them."""
        share = self.in_unit(flux_unit).weight
        kept = share > 0.0
        return self.wavelength[kept], share[kept] / share.sum()

    def in_unit(self, flux_unit: FluxUnit) -> SpectralLines:
        """The same lines with their flux counted in another unit: each watt is K_m V(λ) lumens.

        Raises
        ------
        UnitError
            If there are no lumens at any of the wavelengths, or lumens where V(λ) is 0.
        UnknownNameError
            If there is no such unit.
        """
        require_known(flux_unit, FLUX_UNITS, "flux unit")
        if flux_unit == self.flux_unit:
            return self
        efficacy = LUMINOUS_EFFICACY_MAX * photopic_efficiency(self.wavelength)
        if flux_unit == "lm":
            if not (self.weight * efficacy).any():
                raise UnitError("V(λ) is 0 at every wavelength of this light: it has no lumens.")
            return SpectralLines(self.wavelength, self.weight * efficacy, "lm")
        if (self.weight[efficacy == 0.0] > 0.0).any():
            raise UnitError(
                "lumens are stated at a wavelength at which V(λ) is 0: their radiant flux is not determined."
            )
        watts = np.divide(self.weight, efficacy, out=np.zeros_like(self.weight), where=self.weight > 0.0)
        return SpectralLines(self.wavelength, watts, "W")

    @classmethod
    def mixed(cls, parts: list[tuple[FloatArray, FloatArray, float]], flux_unit: FluxUnit) -> SpectralLines:
        """Several lights together: wavelengths, shares of the flux at them, and the flux [`flux_unit`] of each light."""
        wavelength = np.unique(np.concatenate([part[0] for part in parts]))
        weight = np.zeros(wavelength.size)
        for at, share, flux in parts:
            weight[np.searchsorted(wavelength, at)] += share * flux
        return cls(wavelength, weight, flux_unit)
