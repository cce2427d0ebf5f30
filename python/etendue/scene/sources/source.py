"""What all sources share: flux with its unit, colours, and a place."""

from __future__ import annotations

import abc
import dataclasses
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from annotated_types import MaxLen, MinLen
from pydantic import model_validator

from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from etendue.scene.files import Files
from etendue.scene.placement import Placement
from etendue.scene.values import AsRow, NotNegative, Wavelength
from etendue.units import FluxUnit

Array = npt.NDArray[np.float64]
Record = dict[str, Any]
Line = Annotated[tuple[Wavelength, NotNegative], AsRow]


@dataclasses.dataclass(frozen=True, eq=False)
class Emitter:
    """A source as the core takes it, but for its place and its colours.

    Parameters
    ----------
    record : mapping
        Kind, flux, and what belongs to the kind.
    flux_unit : {"lm", "W"}
    spectrum : Spectrum or None
        What a file says of the colours.
    name : str
        Within the source, if it is made of several.
    notes : tuple of str
        What the user should know of the colours, unless they are stated.
    flux_notes : tuple of str
        What the user should know of the flux.

    Examples
    --------
    >>> Emitter({"kind": "beam", "flux": 1.0}, "lm").name
    ''
    """

    record: Record
    flux_unit: FluxUnit
    spectrum: Spectrum | None = None
    name: str = ""
    notes: tuple[str, ...] = ()
    flux_notes: tuple[str, ...] = ()


class Source(Placement, abc.ABC):
    """A source of light.

    Parameters
    ----------
    name : str
        For ledgers and messages.
    wavelength : number, optional
        [nm], of all its light.
    spectrum : rows of 2 numbers, optional
        Wavelengths [nm] and shares of the flux, on any scale.
    """

    name: str = ""
    wavelength: Wavelength | None = None
    spectrum: Annotated[tuple[Line, ...], MinLen(1), MaxLen(1 << 16), AsRow] | None = None

    @model_validator(mode="after")
    def _one_colour(self) -> Self:
        if self.wavelength is not None and self.spectrum is not None:
            raise ValueError("'wavelength' and 'spectrum' are both given; use one of them")
        if self.spectrum is not None:
            lines = np.array(self.spectrum)
            if (np.diff(lines[:, 0]) <= 0.0).any():
                raise ValueError("'spectrum': the wavelengths must rise from row to row")
            if not lines[:, 1].sum() > 0.0:
                raise ValueError("'spectrum': all shares are 0")
        return self

    @abc.abstractmethod
    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The source as the core takes it.

        Raises
        ------
        ArgumentError, UnitError, FormatError, OSError
            If a file cannot be read, or does not fit.
        """

    def colours(self, emitter: Emitter, default: float) -> tuple[Array, Array]:
        """Wavelengths [nm] and shares of the flux, with sum 1.

        What the user states, else what the file states, else `default`.
        """
        if self.wavelength is not None:
            return np.array([self.wavelength]), np.array([1.0])
        if self.spectrum is not None:
            wavelength, shares = np.array(self.spectrum).T
            return wavelength.copy(), shares / shares.sum()
        if emitter.spectrum is not None:
            return lines_of(emitter.spectrum, emitter.flux_unit)
        return np.array([default]), np.array([1.0])


def lines_of(spectrum: Spectrum, flux_unit: FluxUnit) -> tuple[Array, Array]:
    """A spectrum as lines at its nodes: the flux around each node by the trapezoidal rule.

    In lumens each node counts with its V(λ).

    Examples
    --------
    >>> wavelength, shares = lines_of(Spectrum([500, 600, 700], [1, 1, 1]), "W")
    >>> shares.tolist()
    [0.25, 0.5, 0.25]
    """
    wavelength, weight = spectrum.wavelength, spectrum.weight
    if wavelength.size > 1:
        gaps = np.diff(wavelength)
        weight = weight * (np.append(gaps, 0.0) + np.insert(gaps, 0, 0.0))  # twice the trapezoids; only ratios count
    if flux_unit == "lm":
        weight = weight * photopic_efficiency(wavelength)
    kept = weight > 0.0
    if not kept.any():
        return wavelength[:1].copy(), np.array([1.0])
    return wavelength[kept], weight[kept] / weight[kept].sum()
