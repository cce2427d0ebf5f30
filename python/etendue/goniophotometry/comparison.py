"""How well one intensity distribution agrees with another."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.intensity import Intensity

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class IntensityComparison:
    """The agreement of a distribution with a reference; made by `compare_intensities`.

    Parameters
    ----------
    ncc : float
        Eq. 3.5 of [Audenaert2014]_ over the nodes, each of the same weight: a table in steps of C and γ has most of its
        nodes near the poles, which therefore count most. NaN if a distribution is constant.
    nrmse_thesis : float
        Eq. 3.6 as printed, over the nodes: Σ|Is - Im| / (N · max of both), a mean *absolute* error.
    nrmse : float
        √(mean (Is - Im)²) / max of the reference, over the nodes.
    ncc_sphere, nrmse_sphere : float
        The same as `ncc` and `nrmse` with every node weighted by its solid angle: means over directions, which do not
        depend on how the table is cut.
    flux_ratio : float
        Flux of the test over that of the reference; NaN if the latter is 0.
    nodes : int
        N, the number of directions compared.

    Examples
    --------
    >>> a = Intensity(c=[0], gamma=[0, 90, 180], values=[[1.0, 1.0, 0.0]])
    >>> compare_intensities(a.scaled(2), a).flux_ratio
    2.0
    """

    ncc: float
    nrmse_thesis: float
    nrmse: float
    ncc_sphere: float
    nrmse_sphere: float
    flux_ratio: float
    nodes: int

    def summary(self) -> str:
        """The result in two lines of text."""
        return (
            f"over {self.nodes:,} nodes: NCC {100 * self.ncc:.3f} %, NRMSE {100 * self.nrmse:.3f} % "
            f"(true RMSE / max of the reference), {100 * self.nrmse_thesis:.3f} % (eq. 3.6)\n"
            f"over the sphere: NCC {100 * self.ncc_sphere:.3f} %, NRMSE {100 * self.nrmse_sphere:.3f} %, "
            f"flux ratio {self.flux_ratio:.4g}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Every number as plain data for JSON; undefined numbers are None."""
        return {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in dataclasses.asdict(self).items()
        }


def compare_intensities(test: Intensity, reference: Intensity) -> IntensityComparison:
    """Compare two distributions over the nodes of both tables together, where both functions are known exactly.

    Parameters
    ----------
    test : Intensity
        The one to be judged, Is.
    reference : Intensity
        The one it is judged by, Im.

    Raises
    ------
    ArgumentError
        If one is in candela and the other in watts per steradian.

    Examples
    --------
    >>> lobe = Intensity(c=[0, 90, 180, 270], gamma=[0, 45, 90], values=[[9, 5, 0], [9, 7, 1], [9, 5, 0], [9, 4, 0]])
    >>> turned = compare_intensities(lobe.rotated_about_axis(90), lobe)
    >>> round(turned.ncc, 3), round(turned.nrmse_thesis, 4), round(turned.flux_ratio, 9)
    (0.962, 0.0741, 1.0)
    """
    if test.flux_unit != reference.flux_unit:
        raise ArgumentError(
            f"compare_intensities: the test is in {test.unit}, the reference in {reference.unit}. Convert the rays first."
        )
    c, gamma = np.union1d(test.c, reference.c), np.union1d(test.gamma, reference.gamma)
    ours, theirs = (each.at(c[:, None], gamma) for each in (test, reference))
    even = np.full(ours.shape, 1.0 / ours.size)
    sphere = Intensity(c, gamma, ours).node_solid_angle
    sphere = sphere / sphere.sum()
    peak = float(theirs.max())
    return IntensityComparison(
        ncc=_ncc(ours, theirs, even),
        nrmse_thesis=_ratio(float(np.abs(ours - theirs).mean()), max(float(ours.max()), peak)),
        nrmse=_ratio(_root_mean_square(ours - theirs, even), peak),
        ncc_sphere=_ncc(ours, theirs, sphere),
        nrmse_sphere=_ratio(_root_mean_square(ours - theirs, sphere), peak),
        flux_ratio=_ratio(test.flux, reference.flux),
        nodes=int(ours.size),
    )


def _ncc(ours: Array, theirs: Array, weight: Array) -> float:
    """Eq. 3.5 with weights that sum to 1; NaN if either is constant."""
    if ours.min() == ours.max() or theirs.min() == theirs.max():
        return math.nan
    a, b = (values - (weight * values).sum() for values in (ours, theirs))
    # Scaled to 1 first, so that no square overflows or vanishes.
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    product, norms = (weight * a * b).sum(), (weight * a * a).sum() * (weight * b * b).sum()
    return float(np.clip(product / math.sqrt(norms), -1.0, 1.0)) if norms > 0.0 else math.nan


def _root_mean_square(error: Array, weight: Array) -> float:
    largest = float(np.abs(error).max())
    return largest * math.sqrt((weight * (error / largest) ** 2).sum()) if largest > 0.0 else 0.0


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else math.nan
