"""`agreement`: how far lobes of one sample differ that several instruments state."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.deconvolution import Deconvolution
from etendue.instruments.goniometer_scan import GoniometerScan, cubic, full_width, summit
from etendue.instruments.operators import middle_of
from etendue.quantities.arguments import require, require_number

Array = npt.NDArray[np.float64]

STEPS = 200
"""Even angles at which lobes are compared."""

FLOOR = 0.01
"""Part of the peak down to which they are."""


@dataclasses.dataclass(frozen=True, eq=False)
class Agreement:
    """Coefficients of variation of lobes (eq. 5.8) [%].

    Parameters
    ----------
    peak : number
        Of the largest values.
    fwhm : number
        Of the full widths at half maximum.
    angle : array, shape (n,)
        From the middle of each lobe [°], where the mean lobe has more than a part of its peak.
    mean : array, shape (n,)
        Mean lobe [1/sr].
    values : array, shape (n,)
        Coefficient of variation of f at each angle.

    Examples
    --------
    >>> Agreement(9.0, 4.0, np.arange(3.0), np.ones(3), np.array([6.0, 6.0, 6.0]))
    Agreement(peak=9 %, fwhm=4 %, over_angles=6 %)
    """

    peak: float
    fwhm: float
    angle: Array
    mean: Array
    values: Array

    def __repr__(self) -> str:
        """All three."""
        return f"Agreement(peak={self.peak:.3g} %, fwhm={self.fwhm:.3g} %, over_angles={self.over_angles:.3g} %)"

    @property
    def over_angles(self) -> float:
        """Root mean square of `values`: of f over the angles."""
        return float(np.sqrt(np.mean(self.values**2)))


def variation(values: npt.ArrayLike) -> float:
    """Coefficient of variation [%], with N − 1: eq. 5.8 of the thesis.

    Examples
    --------
    >>> variation([9.0, 10.0, 11.0])
    10.0
    """
    x = np.asarray(values, np.float64)
    return 100.0 * float(np.std(x, ddof=1) / np.mean(x))


def agreement(lobes: Sequence[GoniometerScan | Deconvolution], *, floor: float = FLOOR) -> Agreement:
    """How far scans of one sample by several instruments differ, or what `deconvolve` made of each.

    Parameters
    ----------
    lobes : sequence of GoniometerScan or Deconvolution
        Two or more. Each is moved to its own middle: samples are never laid twice the same way.
    floor : number
        Part of the peak of the mean lobe down to which f is compared.

    Returns
    -------
    Agreement

    Raises
    ------
    ArgumentError
        If there are less than two, or they have no angles in common.

    Examples
    --------
    >>> import etendue as et
    >>> sample = et.bsdf.Gaussian(peak=500, sigma=0.016, way="transmitted")
    >>> instruments = [et.ScatterGoniometer(14, d, 886) for d in (16, 25)]
    >>> scans = [one.measure(sample, step=0.2, span=4, method="quadrature") for one in instruments]
    >>> found = [et.deconvolve(s, g.instrument_function(), replicates=0) for s, g in zip(scans, instruments)]
    >>> bool(et.agreement(scans).peak > 4 and et.agreement(found).peak < 0.1)
    True
    """
    what = "scans or what et.deconvolve made of them, in a sequence"
    require(lobes, Sequence, "agreement: lobes", what)
    for one in lobes:
        require(one, (GoniometerScan, Deconvolution), "agreement: one of the lobes", f"{what}; read files first")
    require_number(floor, "agreement: floor", "a part of the peak, above 0 and below 1")
    if len(lobes) < 2:
        raise ArgumentError(f"{len(lobes)} lobe; two are needed at least")
    if not 0.0 < floor < 1.0:
        raise ArgumentError(f"a floor of {floor:g}; give a part of the peak, above 0 and below 1")
    pairs = [_centred(one) for one in lobes]
    low, high = max(a[0] for a, _ in pairs), min(a[-1] for a, _ in pairs)
    if low >= high:
        raise ArgumentError("the lobes have no angles in common")
    at = np.linspace(low, high, STEPS + 1)
    there = np.stack([cubic(a, f, at) for a, f in pairs])
    mean = there.mean(axis=0)
    seen = mean > floor * mean.max()
    spread = 100.0 * there.std(axis=0, ddof=1)[seen] / mean[seen]
    peaks, widths = [summit(a, f) for a, f in pairs], [full_width(a, f) for a, f in pairs]
    return Agreement(variation(peaks), variation(widths), at[seen], mean[seen], spread)


def _centred(lobe: GoniometerScan | Deconvolution) -> tuple[Array, Array]:
    if isinstance(lobe, Deconvolution):
        return lobe.angle - lobe.middle, lobe.values
    return lobe.angle - middle_of(lobe.angle, np.maximum(lobe.flux, 0.0)), lobe.bsdf
