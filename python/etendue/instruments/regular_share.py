"""The share of light that is mirrored in a single direction, or goes straight on, apart from the lobe."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.counted_scan import CountedScan

Array = npt.NDArray[np.float64]

EVALUATIONS = 16
"""Of the score, on the way to the best share."""

FURTHEST = 300
"""Iterations at most for each of them: where more are needed, what is left is far from smooth."""

SIGNIFICANT = 4.0
"""Standard errors by which a scan must be predicted better with such light than without."""

SEEN = 0.5
"""Of the bare beam that some position must show."""


class RegularShare(NamedTuple):
    """What was found.

    Parameters
    ----------
    share : float
        Of the beam.
    error : float
        Its standard error; 0 if there is no such light.
    why : str
        How sure it is.
    """

    share: float
    error: float
    why: str


def regular_share(counted: CountedScan, seed: int) -> RegularShare:
    """The share with which the rest of the light predicts held-out counts best.

    Richardson and Lucy's iteration alone cannot tell a narrow lobe from a single direction: from an even start it gets there
    slowly or not at all. But it stops early where the lobe is smooth, and what is smooth predicts counts that were kept back
    best if just that is left which is smooth. No share is told unless it does so by four standard errors.

    Parameters
    ----------
    counted : CountedScan
        Noise is known.
    seed : int
        Of the counts that are kept back.
    """
    model = counted.model
    if not counted.counted:
        return RegularShare(0.0, 0.0, "not looked for: the noise of the scan is not known")
    at = int(np.argmax(model.bare))
    if not model.bare[at] >= SEEN:
        return RegularShare(0.0, 0.0, "not looked for: no position is near the regular direction")
    most = float((counted.counts[at] - counted.background[at]) * counted.per_count[at] / model.bare[at])
    if not most > 0.0:
        return RegularShare(0.0, 0.0, "not looked for: there is no light in the regular direction")
    known: dict[float, Array] = {}

    def score(share: float) -> float:
        if share not in known:
            course, _, _ = counted.with_regular(share).course("held-out", seed, furthest=FURTHEST)
            assert course.held_out is not None  # noqa: S101 - there are counts
            known[share] = course.held_out[int(np.argmin(course.held_out.sum(axis=1)))]
        return float(known[share].sum())

    optimize = scipy_part("optimize")
    # Close to 0, and close to all of the light, only this much matters: where counts can tell.
    within = float(np.sqrt(max(counted.counts[at], 1.0)) / max(counted.counts[at], 1.0)) * most
    found = optimize.minimize_scalar(
        score, bounds=(0.0, 1.05 * most), method="bounded", options={"maxiter": EVALUATIONS, "xatol": 0.2 * within}
    )
    share = float(found.x)
    gain = known[share] - (score(0.0), known[0.0])[1]
    error = float(gain.std() * np.sqrt(gain.size))
    sure = -float(gain.sum()) / error if error > 0.0 else 0.0
    if sure < SIGNIFICANT:
        return RegularShare(
            0.0, 0.0, f"none: counts kept back are predicted better with it by {sure:.1f} standard errors"
        )
    return RegularShare(
        share, _error(known, share), f"counts kept back are predicted better by {sure:.1f} standard errors"
    )


def _error(known: dict[float, Array], share: float) -> float:
    """From the parabola through the scores: the deviance of all counts rises by 1 at one standard error of their noise.

    Twice that is told: on known samples the share comes out too large by one to three of these, since an iteration that
    stops early leaves a lobe lower than it is.
    """
    shares = np.array(sorted(known, key=lambda one: abs(one - share))[:5])
    scores = np.array([known[one].sum() for one in shares])
    scale = float(np.ptp(shares)) or 1.0
    # Half of the counts makes the scores.
    bend = 2.0 * float(np.polyfit((shares - share) / scale, scores, 2)[0]) / scale**2
    return 2.0 * float(np.sqrt(1.0 / bend)) if bend > 0.0 else scale
