"""A scan in two dimensions as counts behind its instrument: what all ways of deconvolution work on."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.courses import FURTHEST, after, course_of
from etendue.instruments.directional_operator import ForwardModel
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.shared_rays import together
from etendue.instruments.stopping import Course

Array = npt.NDArray[np.float64]
Shrink = Callable[[Array], Array] | None

SURE = 2.0
"""Standard errors of a flux from which on its error says what a count stands for."""


COARSER_STARTS = 0.1
"""Of the weight of the level before: where both are, the finer one tells the lobe, and elsewhere one step puts it right."""


@dataclasses.dataclass(frozen=True, eq=False)
class CountedScan:
    """Counts, and the matrix that expects them.

    Parameters
    ----------
    model : ForwardModel
        Of the instrument.
    counts : array, shape (n,)
        With the background in them. In units of the flux if the noise is not known.
    per_count : array, shape (n,)
        The flux that one count stands for.
    background : array, shape (n,)
        Expected counts that do not come from the lobe: the dark, and light that is mirrored in a single direction.
    matrix : sparse array, shape (n, m)
        From weights of splines to expected counts.
    counted : bool
        Whether the noise is known.
    regular : number
        Share of the light that is known to go on in a single direction.
    """

    model: ForwardModel
    counts: Array
    per_count: Array
    background: Array
    matrix: Any
    counted: bool
    regular: float = 0.0

    @classmethod
    def of(cls, scan: DirectionalScan, model: ForwardModel) -> CountedScan:
        """A scan behind its instrument."""
        found = flux_per_count(scan)
        per = np.ones(scan.flux.shape) if found is None else found
        matrix = scipy_part("sparse").csr_array(model.matrix.multiply(1.0 / per[:, None]))
        counts = np.maximum(scan.flux + scan.background, 0.0) / per
        return cls(model, counts, per, scan.background / per, matrix, found is not None)

    @property
    def gain(self) -> float | None:
        """What a count stands for: itself, if the noise is known."""
        return 1.0 if self.counted else None

    def with_regular(self, share: float) -> CountedScan:
        """The same, with a share of the beam known to be mirrored, or to go straight on."""
        background = self.background + share * self.model.bare / self.per_count
        return dataclasses.replace(self, background=background, regular=self.regular + share)

    def start(self, measured: Array) -> Array:
        """An even lobe that gives as many counts, most of it in the finest splines where they are.

        `measured` is without background, of shape (n,) or (n, k).
        """
        ones = np.zeros(self.matrix.shape[1])
        for k, level in enumerate(self.model.splines.levels):
            ones[level.number[level.number >= 0]] = COARSER_STARTS**k
        total = np.maximum(measured.sum(axis=0), 1e-9 * self.counts.sum())
        return np.asarray(np.multiply.outer(ones, total / (self.matrix @ ones).sum()))

    def course(self, rule: str, seed: int, shrink: Shrink = None, furthest: int = FURTHEST) -> tuple[Course, int, str]:
        """Where a rule stops: `course_of`."""
        given = (self.matrix, self.counts, self.background, self.gain, self.start, rule, seed, shrink, furthest)
        return course_of(*given)

    def after(self, count: int, shrink: Shrink = None, counts: Array | None = None) -> Array:
        """Weights after a number of iterations, of these counts or of others of shape (n, k)."""
        y = self.counts[:, None] if counts is None else counts
        found = after(self.matrix, y, self.start(y - self.background[:, None]), count, self.background, shrink)
        return found[:, 0] if counts is None else found

    def expected(self, weights: Array) -> Array:
        """Counts that weights of splines would give."""
        return np.asarray(self.matrix @ weights + self.background)


def flux_per_count(scan: DirectionalScan) -> Array | None:
    """Of each position, from the variance of a count, which is itself; None if standard errors are not known.

    Where the flux is too small to tell, as in the middle of all positions. Where positions count the same rays, what is
    smooth over the aperture sees fewer counts (`together`).
    """
    if scan.standard_error is None or not (scan.standard_error > 0.0).any():
        return None
    whole = scan.flux + scan.background
    sure = (whole > SURE * scan.standard_error) & (scan.standard_error > 0.0)
    if not sure.any():
        return None
    per = np.divide(scan.standard_error**2 * together(scan), whole, out=np.zeros_like(whole), where=sure)
    return np.where(sure, per, np.median(per[sure]))
