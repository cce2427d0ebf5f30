"""Verdicts on values with standard errors, at a significance of 1e-4."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import betainc
from scipy.stats import chi2, norm, t

Array = npt.NDArray[np.float64]
SIGNIFICANCE = 1e-4
LARGEST_Z = float(norm.isf(SIGNIFICANCE / 2))

REVERSE = 15.0
"""Degrees of freedom of the errors of a map of a scene: of the spread of 16 passes."""


Share = float | tuple[float, float]
"""A probability, or the two between which it lies."""

WITHIN_ONE, WITHIN_TWO = (float(1 - 2 * norm.sf(z)) for z in (1.0, 2.0))
"""Shares of normal deviates within one and within two standard errors."""


def assert_drawn_with(*, share: Share, hits: float, rays: float) -> None:
    """`hits` of `rays` independent rays, each with probability `share`: binomial, exact, two-sided.

    By the incomplete beta function, which is the binomial's distribution function between whole numbers as well, for
    numbers of rays that are effective ones.
    """
    least, most = share if isinstance(share, tuple) else (share, share)
    assert 0.0 < least <= most < 1.0
    assert 0.0 <= hits <= rays
    as_many = float(betainc(hits, rays - hits + 1.0, most)) if hits > 0.0 else 1.0
    as_few = float(betainc(rays - hits, hits + 1.0, 1.0 - least)) if hits < rays else 1.0
    told = f"{hits:.8g} of {rays:.8g}, a share of {hits / rays:.4f}, where {share} is expected"
    assert min(as_many, as_few) > SIGNIFICANCE / 2, f"{told}: a probability of {min(as_many, as_few):.1e}"


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


def assert_covers(
    *, deviations: Array, effective: float | None = None, one: Share = WITHIN_ONE, two: Share = WITHIN_TWO
) -> None:
    """Deviations from the truth, each over its own error, lie within one error as often as `one`, within two as often as
    `two`: binomial, two-sided, so that errors too large are found as well.

    Deviations of one smoothed map err together, so that their number tells no significance. They are worth p (1 - p)/v
    independent ones, where v is the variance of the share p between maps of other seeds: that is `effective`, of all
    deviations together, the lesser one of both shares. Errors that are calibrated to a few per cent have an interval for
    the share: what they promise, to which the verdict adds the sampling error.
    """
    assert np.isfinite(deviations).all()
    trials = float(deviations.size if effective is None else effective)
    assert 0.0 < trials <= deviations.size
    for errors, share in ((1.0, one), (2.0, two)):
        within = float((np.abs(deviations) < errors).mean())
        assert_drawn_with(share=share, hits=within * trials, rays=trials)
