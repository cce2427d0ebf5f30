"""`revolved`: a scan in one plane as a table for scenes, of a lobe that is round about the light that goes straight on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.goniometer_scan import GoniometerScan, cubic
from etendue.instruments.operators import middle_of
from etendue.quantities.arguments import as_numbers, require, require_number
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]

PER_STEP = 8
"""Rings of the table in a step of the scan: linear between its positions, a lobe of six steps has 1 % too much light."""


def revolved(
    scan: GoniometerScan, values: npt.ArrayLike | None = None, *, middle: float | None = None, name: str = "scan"
) -> BsdfTable:
    """A table of a round lobe from a scan at normal incidence: both sides averaged, cubic between the positions.

    Values below 0 are taken for 0; beyond the scan there is no light. The table says as much of light from either side.

    Parameters
    ----------
    scan : GoniometerScan
        Of a sample, at normal incidence.
    values : array, shape (n,), optional
        f [1/sr] at its positions in place of what it measured, as `Deconvolution.values`.
    middle : number, optional
        Of the lobe [°]; found by its symmetry if left out.
    name : str
        Of the table.

    Returns
    -------
    BsdfTable

    Raises
    ------
    ArgumentError
        If the scan is of a slanted sample or of none, there is another number of values than positions, or it has no light.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer()
    >>> sample = et.bsdf.Gaussian(peak=500, sigma=0.016, way="transmitted")
    >>> scan = goniometer.measure(sample, step=0.2, span=5, method="quadrature")
    >>> found = et.deconvolve(scan, goniometer.instrument_function(), replicates=0)
    >>> blurred, sharp = et.revolved(scan), et.revolved(scan, found.values, middle=found.middle)
    >>> [round(float(one.evaluate([0, 0, 1], [0, 0, -1])), -1) for one in (blurred, sharp, sample)]
    [390.0, 500.0, 500.0]
    """
    require(scan, GoniometerScan, "revolved: scan", "a GoniometerScan: of a file et.read_goniometer_scan(path)")
    if middle is not None:
        require_number(middle, "revolved: middle", "an angle in °, or None")
    if not scan.sample or scan.incidence:
        what = f"a sample at {scan.incidence:g}°" if scan.sample else "the bare beam"
        raise ArgumentError(
            f"a scan of {what}; only at normal incidence is a lobe round: `etendue bsdf fit` makes tables of others"
        )
    f = scan.bsdf if values is None else as_numbers(values, "revolved: values", "f at each position")
    if f.shape != scan.angle.shape:
        raise ArgumentError(f"{f.size} values for {scan.angle.size} positions")
    if scan.angle.size < 5 or not (f > 0.0).any():
        raise ArgumentError("a lobe needs five positions, and some light")
    at = middle_of(scan.angle, np.maximum(f * scan.cosine, 0.0)) if middle is None else float(middle)
    reach = min(at - scan.angle[0], scan.angle[-1] - at)
    if not reach > 0.0:
        raise ArgumentError(f"the middle of the lobe, {at:g}°, is outside the scan")
    ring = scan.step / PER_STEP
    radial = np.arange(0.0, reach + 1e-9, ring)
    both = 0.5 * (cubic(scan.angle, f, at + radial) + cubic(scan.angle, f, at - radial))
    # One ring further all is dark; a table is linear between its rings.
    radial = np.append(radial, radial[-1] + ring)
    both = np.append(np.maximum(both, 0.0), 0.0)
    grid = PolarGrid("specular", radial, np.zeros(1))
    behind = scan.way == "transmitted"
    one = BsdfSlice(light_from(0.0, 180.0), both[None, :], behind, grid=grid)
    return BsdfTable(BsdfData((one,), name=name))
