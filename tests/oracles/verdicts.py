"""Verdicts on values with standard errors, at a significance of 1e-4."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import binomtest, chi2, norm, t

Array = npt.NDArray[np.float64]
SIGNIFICANCE = 1e-4
LARGEST_Z = float(norm.isf(SIGNIFICANCE / 2))

REVERSE = 15.0
"""Degrees of freedom of the errors of a map of a scene: of the spread of 16 passes."""


def assert_drawn_with(*, share: float, hits: int, rays: int) -> None:
    """`hits` of `rays` independent rays, each with probability `share`: the normal limit of the binomial."""
    z = (hits - rays * share) / np.sqrt(rays * share * (1.0 - share))
    assert abs(z) < LARGEST_Z, f"{hits / rays} of the rays, {share} expected: z = {z:.2f}"


def assert_agree(
    *,
    values: Array,
    expected: Array | float,
    standard_error: Array,
    degrees: float | Array = np.inf,
    least: float = 0.9,
) -> None:
    """χ² over cells with independent errors, two-sided, so that errors too large are found as well.

    Errors that come from a spread have `degrees` of freedom, so that deviations are Student's t; each is turned into the
    normal deviate of the same probability. `least` is the share of the cells that must have an error.
    """
    known = np.isfinite(standard_error) & (standard_error > 0.0)
    assert known.sum() >= max(8, least * known.size)
    z = (values[known] - np.broadcast_to(expected, values.shape)[known]) / standard_error[known]
    freedom = np.broadcast_to(degrees, known.shape)[known]
    z = np.where(np.isfinite(freedom), norm.isf(t.sf(z, freedom)), z)
    told = f"mean z² is {(z**2).mean():.2f}, largest |z| {np.abs(z).max():.1f} in {z.size} cells"
    assert chi2.sf((z**2).sum(), z.size) > SIGNIFICANCE, told
    assert chi2.cdf((z**2).sum(), z.size) > SIGNIFICANCE, told


def assert_differ(*, values: Array, other: Array, standard_error: Array) -> None:
    """The other does not agree: what is compared is lopsided enough to tell a mirror image."""
    known = np.isfinite(standard_error) & (standard_error > 0.0)
    z = (values[known] - other[known]) / standard_error[known]
    assert chi2.sf((z**2).sum(), z.size) < SIGNIFICANCE


def assert_covers(*, deviations: Array) -> None:
    """Deviations from the truth, each independent and over its own error, lie within the 68 % and the 95 % of the normal as
    often as that: binomial, two-sided, so that errors too large are found as well.
    """
    assert np.isfinite(deviations).all()
    for level in (0.68, 0.95):
        within = int((np.abs(deviations) < norm.isf((1.0 - level) / 2.0)).sum())
        told = f"{within} of {deviations.size} within {level:.0%}; deviations spread by {deviations.std():.2f}"
        assert binomtest(within, deviations.size, level).pvalue > SIGNIFICANCE, told
