"""What an instrument shows of a lobe in two dimensions, as a sparse matrix from its geometry."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.extras import scipy_part
from etendue.instruments.bench import Sight
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.lobe_splines import LobeSplines, splines_for
from etendue.quantities.arguments import require_number

Array = npt.NDArray[np.float64]

FINENESS = (3, 4)
"""Nodes across beam and aperture."""

WIDTH_OF_A_CELL = 0.3
"""Of the reach of an instrument function: cells are no wider, since a lobe may be as narrow as what it shows."""

UNSEEN = 1e-3
"""Of what the detector sees of a spline, relative to the one that it sees most of: below, the spline is left out."""


class Instrument(Protocol):
    """What is asked of an instrument: `Bench` knows its geometry, `RoundBlur` its instrument function alone."""

    @property
    def solid_angle(self) -> float:
        """Of the aperture [sr]."""

    @property
    def reach(self) -> float:
        """Of the instrument function [°]."""

    def sights(self, arms: Array, theta: float, beam: int, aperture: int) -> Iterator[Sight]:
        """Lines of sight of positions."""

    def bare(self, arms: Array, axis: Array) -> Array:
        """Share of the bare beam in the aperture."""


@dataclasses.dataclass(frozen=True, eq=False)
class ForwardModel:
    """From a lobe to the flux at each position.

    Parameters
    ----------
    splines : LobeSplines
        m of them, all of which the instrument sees.
    matrix : scipy.sparse.csr_array, shape (n, m)
        From their weights to the share of the beam in the aperture.
    at_positions : scipy.sparse.csr_array, shape (n, m)
        From their weights to f [1/sr].
    bare : array, shape (n,)
        What a perfect mirror (or no sample) would show.
    cell : number
        Width of the finest splines [°].
    """

    splines: LobeSplines
    matrix: Any
    at_positions: Any
    bare: Array
    cell: float


def forward_model(instrument: Instrument, scan: DirectionalScan, cell: float | None = None) -> ForwardModel:
    """The forward model of a scan.

    Parameters
    ----------
    instrument : Instrument
        That took it.
    scan : DirectionalScan
        Of at least two positions.
    cell : number, optional
        Width of the finest splines [°]; if left out, the step of the scan, or three tenths of the reach of the instrument
        function if that is less.

    Raises
    ------
    ArgumentError
        If a cell is impossible.
    """
    if cell is not None:
        require_number(cell, "cell", "the width of the finest splines in °, or None")
    step = float(np.quantile(scan.spacing, 0.1))
    width = min(step, WIDTH_OF_A_CELL * instrument.reach) if cell is None else float(cell)
    if not 0.01 <= width <= 30.0:
        raise ArgumentError(f"cells of {width:g}°; give 0.01 to 30°")
    splines = splines_for(scan.direction, scan.regular, scan.spacing, width, instrument.reach)
    matrix = matrix_of(instrument, scan.direction, scan.incidence, splines)
    weight = np.asarray(matrix.sum(axis=0)).ravel()
    kept = np.zeros(splines.count, bool)
    for level in splines.levels:
        own = level.number[level.number >= 0]
        kept[own] = weight[own] > UNSEEN * weight[own].max()
    splines = splines.only(kept)
    bare = instrument.bare(scan.direction, scan.regular)
    return ForwardModel(splines, matrix[:, kept], splines.matrix(scan.direction), bare, width)


def matrix_of(
    instrument: Instrument,
    arms: Array,
    theta: float,
    splines: LobeSplines,
    fineness: tuple[int, int] = FINENESS,
) -> Any:
    """From weights of splines to the share of the beam in the aperture at each position, a sparse matrix.

    Each element is the integral of a spline over beam and aperture: the spot is an ellipse at an angle of incidence, seen
    from each position in its own way, and the étendue of each line holds |cos θₛ|. f is a function of β − β₀: a ray that
    comes from another direction sees the lobe moved.

    Parameters
    ----------
    instrument : Instrument
        That measures.
    arms : array, shape (n, 3)
        Positions.
    theta : number
        Angle of incidence [°].
    splines : LobeSplines
        m of them.
    fineness : (int, int)
        Nodes across beam and aperture.

    Returns
    -------
    scipy.sparse.csr_array, shape (n, m)
    """
    sparse = scipy_part("sparse")
    m = splines.count
    blocks = []
    for sight in instrument.sights(arms, theta, *fineness):
        i = len(sight.scattered)
        # β − β₀ of this ray, from β₀ of the axis of the beam.
        shift = sight.incident[:, :2] + np.array([np.sin(np.radians(theta)), 0.0])
        beta = sight.scattered[..., :2] + shift[None, :, None]
        numbers, values = splines.rows(beta.reshape(-1, 2))
        weights = sight.weights.reshape(-1)
        row = np.repeat(np.arange(i), weights.size // i)
        numbers += (row * (m + 1) + 1)[:, None]
        dense = np.bincount(numbers.ravel(), (values * weights[:, None]).ravel(), i * (m + 1)).reshape(i, m + 1)
        blocks.append(sparse.csr_array(dense[:, 1:]))
    return sparse.csr_array(sparse.vstack(blocks, format="csr"))
