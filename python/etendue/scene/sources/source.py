"""What all sources share: flux with its unit, colours, and a place."""

from __future__ import annotations

import abc
import dataclasses
from typing import Annotated, Any, Self

import numpy as np
import numpy.typing as npt
from annotated_types import MaxLen, MinLen
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import AsRow, FirstMistake, NotNegative, Wavelength
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.scene.placement import Placement
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
    spectrum : Spectrum, SpectralLines or None
        What a file says of the colours of all the light together.
    name : str
        Within the source, if it is made of several.
    notes : tuple of str
        What the user should know of the colours.
    flux_notes : tuple of str
        What the user should know of the flux.
    range : tuple of float or None
        Shortest and longest wavelength of the light [nm], where the lines of `spectrum` are means.
    mean : bool
        Whether `spectrum` is that of all the light though the colour may differ between places and directions.

    Examples
    --------
    >>> Emitter({"kind": "beam", "flux": 1.0}, "lm").name
    ''
    """

    record: Record
    flux_unit: FluxUnit
    spectrum: Spectrum | SpectralLines | None = None
    name: str = ""
    notes: tuple[str, ...] = ()
    flux_notes: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    mean: bool = False


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
    spectrum: Annotated[tuple[Line, ...], MinLen(1), MaxLen(1 << 16), FirstMistake, AsRow] | None = None

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

    @property
    def states_colours(self) -> bool:
        """Whether the user states the colours, whatever a file says."""
        return self.wavelength is not None or self.spectrum is not None

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
            return emitter.spectrum.lines(emitter.flux_unit)
        return np.array([default]), np.array([1.0])
