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
from etendue.errors import UnitError
from etendue.quantities.ray_set import RaySet
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

    def stated_in_unit(self, flux: float, unit: FluxUnit) -> float:
        """A flux in lumens or watts as the other, `unit`, by the colours that the user states.

        Raises
        ------
        UnitError
            If their light has no lumens.

        Examples
        --------
        >>> from etendue.scene.sources import Rays
        >>> round(Rays(file="led.tm25ray", wavelength=555).stated_in_unit(2.0, "lm"), 6)
        1366.0
        """
        rows = self.spectrum if self.wavelength is None else ((self.wavelength, 1.0),)
        assert rows is not None  # noqa: S101 - asked for where colours are stated
        # Shares are those of the flux that the source sends out.
        wavelength, shares = np.array(rows).T
        efficacy = SpectralLines(wavelength, shares, unit).luminous_efficacy
        if not efficacy > 0.0:
            raise UnitError(f"lm and W cannot become each other: V(λ) is 0 at wavelengths of {wavelength.tolist()} nm")
        return flux * efficacy if unit == "lm" else flux / efficacy

    @abc.abstractmethod
    def emitters(self, files: Files) -> tuple[Emitter, ...]:
        """The source as the core takes it.

        Raises
        ------
        ArgumentError, UnitError, FormatError, OSError
            If a file cannot be read, or does not fit.
        """

    def some_rays(self, files: Files, most: int) -> RaySet | None:  # noqa: ARG002 - of most sources there are none
        """Some of its rays, in its own frame, if these alone tell its extent; else None.

        Raises
        ------
        ArgumentError, UnitError, FormatError, OSError
            As `emitters`.
        """
        return None

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
