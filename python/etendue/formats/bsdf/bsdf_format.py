"""What a module of this package offers: one format of files that hold a BSDF."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Protocol

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_data import BsdfData

Array = npt.NDArray[np.float64]


class Tabulated(Protocol):
    """What a writer asks of any BSDF, measured or modelled, to make a table of it."""

    name: str
    isotropic: bool
    """Whether turning the sample about its normal changes nothing."""
    reflects: bool
    """Whether light is scattered back."""
    transmits: bool
    """Whether light is scattered to the other side."""
    both_sides: bool
    """Whether light that meets the back is treated as light that meets the front."""
    wavelengths: tuple[float, ...]
    """At which it is known [nm]; empty: it is the same at all."""
    incidences: tuple[float, ...]
    """Angles [°] at which it is known, in order, or a fair choice of them for a model."""

    @property
    def turns(self) -> tuple[float, ...]:
        """Azimuths [°] to where the light of a table goes, in order: 0 alone if it is isotropic."""
        ...

    def evaluate(self, incident: npt.ArrayLike, scattered: npt.ArrayLike, *, wavelength: float | None = None) -> Array:
        """Return f [1/sr] for pairs of unit vectors, shapes (…, 3) that broadcast, in the frame of `bsdf_directions`."""
        ...


@dataclasses.dataclass(frozen=True, eq=False)
class ShareTables:
    """Shares of light that is mirrored, goes straight on, or is scattered to each side: evenly, or about these directions.

    Parameters
    ----------
    name : str
    angle : array
        Angles of incidence [°], rising.
    wavelength : array
        [nm], rising.
    specular, diffuse : array, shape (2, angles, wavelengths)
        Reflected and transmitted.
    lobe : array, shape (2, angles, wavelengths), optional
        The same of lobes whose intensity is Gaussian in the angle from the mirrored and the straight direction.
    width : array, shape (2, 2, angles, wavelengths), optional
        Their full widths at half maximum [°], in the plane of incidence and across it, reflected and transmitted.
    """

    name: str
    angle: Array
    wavelength: Array
    specular: Array
    diffuse: Array
    lobe: Array | None = None
    width: Array | None = None


@dataclasses.dataclass(frozen=True)
class BsdfFormat:
    """A format of BSDF files.

    Parameters
    ----------
    name : str
        As users write it: ``format="klems"``.
    title : str
        For people.
    extensions : tuple of str
        Those usual for it, with their dot; the first is the one that stands for the format when a file is written.
    recognise : callable
        Whether a file is of this format, from its first `SNIFFED_BYTES` bytes.
    read : callable
        The file as `BsdfData`, with all complaints.
    fits : callable, optional
        Whether `write` can hold data as they are, without a new table.
    tabulate : callable, optional
        A BSDF in the layout of this format.
    write : callable, optional
        Writes data of that layout; None: the format holds no tables, or is read only. Returns what is lost, in sentences.
    write_shares : callable, optional
        Writes shares, for formats that hold no tables. Raises ArgumentError for what they cannot hold.
    holds_regular : bool
        Whether light that is mirrored or goes straight on has a place beside tables: as a component with shares by angle.
    holds_errors : bool
        Whether standard errors of the values have a place in it.
    """

    name: str
    title: str
    extensions: tuple[str, ...]
    recognise: Callable[[bytes], bool]
    read: Callable[[Path], BsdfData]
    fits: Callable[[BsdfData], bool] | None = None
    tabulate: Callable[[Tabulated], BsdfData] | None = None
    write: Callable[[BsdfData, BinaryIO], tuple[str, ...]] | None = None
    write_shares: Callable[[ShareTables, BinaryIO], None] | None = None
    holds_regular: bool = False
    holds_errors: bool = False


SNIFFED_BYTES = 4096
"""What `recognise` is given of a file."""

NO_ERRORS = "the format has no place for standard errors"
"""What is lost of a measured table in most formats."""
