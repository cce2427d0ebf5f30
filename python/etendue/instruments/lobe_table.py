"""Lobes of two dimensions as a table of a BSDF: as they were measured, or without the instrument."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]

AZIMUTHS = 120
"""About the specular direction."""

GROWTH = 0.06
"""By which share of its distance the next radial coordinate is further out, where that is more than a cell."""

NEAR_RIM = 0.98
"""Direction cosine of a position from which on a scan is one of the hemisphere, and f goes on to its rim."""


@runtime_checkable
class Lobe(Protocol):
    """What tables are made of."""

    def slice(self) -> BsdfSlice:
        """As a slice of a table."""

    @property
    def regular_share(self) -> float:
        """What of the light is mirrored or goes straight on."""


LOBES = (
    "scans or deconvolutions in a sequence: of a file et.read_directional_scan(path), or et.deconvolve_directions(scan)"
)
"""What to give where lobes are wanted."""


def bsdf_table(lobes: Sequence[Lobe], *, isotropic: bool = True, name: str = "") -> BsdfTable:
    """A table of one or more incidences.

    Parameters
    ----------
    lobes : sequence of DirectionalScan or DirectionalDeconvolution
        One of each incidence.
    isotropic : bool
        Whether turning the sample about its normal changes nothing.
    name : str
        Of the table.

    Returns
    -------
    BsdfTable
        What is mirrored in a single direction is a component of it, the mean of all incidences.

    Raises
    ------
    ArgumentError
        If there is none, or one scatters more than 101 % of the light.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer()
    >>> sample = et.bsdf.Gaussian(peak=6.0, sigma=0.08)
    >>> scan = goniometer.measure_window(sample, 30, step=2.5, span=20, method="quadrature")
    >>> table = bsdf_table([scan])
    >>> bool(abs(float(table.reflectance(30)) / float(sample.reflectance(30)) - 1) < 0.02)
    True
    """
    require(lobes, Sequence, "bsdf_table: lobes", LOBES)
    for one in lobes:
        require(one, Lobe, "bsdf_table: one of the lobes", LOBES)
    if not lobes:
        raise ArgumentError("a table is made of one scan or more")
    slices = [one.slice() for one in lobes]
    share = float(np.mean([one.regular_share for one in lobes]))
    components = []
    if share > 0.0:
        behind = slices[0].transmitted
        components.append(
            {"kind": "transmitter", "transmittance": share} if behind else {"kind": "mirror", "reflectance": share}
        )
    return BsdfTable(BsdfData(tuple(slices), tuple(components), isotropic=isotropic, mirrored=False, name=name))


def polar_slice(
    f: Callable[[Array], tuple[Array, Array | None]], incident: Array, *, behind: bool, cell: float, farthest: float
) -> BsdfSlice:
    """A lobe on a polar grid about the specular direction in direction cosines.

    Parameters
    ----------
    f : callable
        From directions of shape (k, 3) to f [1/sr] and its standard error or None; NaN where it is not known.
    incident : array, shape (3,)
        To where light comes from.
    behind : bool
        Whether it is transmitted.
    cell : number
        Detail of f, in direction cosines.
    farthest : number
        |β − β₀| beyond which nothing is known.

    Returns
    -------
    BsdfSlice
        Beyond a window f is 0: what was not measured is taken for absorbed. Beyond the last position of a hemisphere it is
        that of the last.
    """
    radial = [0.0]
    while radial[-1] < farthest:
        radial.append(radial[-1] + max(cell, GROWTH * radial[-1]))
    # One more, where nothing is known: tables go on with their last value.
    radial.append(radial[-1] + cell)
    grid = PolarGrid("cosines", np.array(radial), np.linspace(0.0, 360.0, AZIMUTHS, endpoint=False))
    to = grid.directions(incident, transmitted=behind)
    there = ~np.isnan(to[..., 0])
    values, errors = np.full(grid.shape, np.nan), np.full(grid.shape, np.nan)
    values[there], error = f(to[there])
    if error is not None:
        errors[there] = error
    known = ~np.isnan(values) & (grid.radial <= farthest)
    # Along each azimuth: gaps hold what was before them, and so does what is beyond the last position near the rim.
    last = np.maximum.accumulate(np.where(known, np.arange(grid.radial.size), -1), axis=1)
    outermost = last[:, -1]
    rim = np.hypot(*np.take_along_axis(to[..., :2], np.maximum(outermost, 0)[:, None, None], axis=1)[:, 0].T) > NEAR_RIM
    held = (last >= 0) & ((np.arange(grid.radial.size) <= outermost[:, None]) | rim[:, None])
    filled = np.where(held, np.take_along_axis(values, np.maximum(last, 0), axis=1), 0.0)
    values = np.where(there, filled, np.nan)
    if error is not None:
        errors = np.where(there, np.where(held, np.take_along_axis(errors, np.maximum(last, 0), axis=1), 0.0), np.nan)
    known = None if error is None else errors
    return BsdfSlice(incident, values, behind, grid=grid, standard_error=known, interpolated=True)
