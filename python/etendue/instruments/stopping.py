"""When to stop an iteration that first finds the lobe, and then the noise: four rules, one registry."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MOST = 200
"""Iterations that are looked at: those of figs. 5.4 and 5.8."""

DISTURBED = 1e-3
"""By which share E may rise above the least so far before noise is what is being fitted."""

LEVEL = 1e-3
"""Of the residual from one iteration to the next: below, it is a plateau."""


@dataclasses.dataclass(frozen=True, eq=False)
class Course:
    """What is known of iterations 1 to n.

    Parameters
    ----------
    error : array, shape (n,)
        E(i) of eq. 5.7.
    deviance : array, shape (n,), optional
        Mean Poisson deviance of the counts; 1 if all that is left is noise.
    held_out : array, shape (n, positions), optional
        Poisson deviance of counts that were kept back, by position.
    """

    error: Array
    deviance: Array | None = None
    held_out: Array | None = None


def thesis(course: Course) -> tuple[int, str]:
    """The last minimum of E(i) before disturbances from noise: section 5.4.4.

    Read so: of the minima one after the other, each lower than those before it; the first rise by more than 0.1 % above the
    least so far is the disturbance. If E falls to the end, or has risen from the start, it is the last or the first one.

    Examples
    --------
    >>> thesis(Course(np.array([3.0, 2.0, 1.0, 1.5, 0.5])))[0]
    3
    """
    least = np.minimum.accumulate(course.error)
    risen = np.flatnonzero(course.error > (1.0 + DISTURBED) * least)
    end = int(risen[0]) if risen.size else course.error.size
    at = int(np.argmin(course.error[:end])) + 1
    why = "before it rises" if risen.size else f"of all {course.error.size} iterations"
    return at, f"the last minimum of E(i) {why}"


def discrepancy(course: Course) -> tuple[int, str]:
    """The first iteration whose residuals are no larger than the noise of the counts."""
    assert course.deviance is not None  # noqa: S101 - `deconvolve` has counts
    below = np.flatnonzero(course.deviance <= 1.0)
    if below.size:
        return int(below[0]) + 1, "the residuals are down to the noise of the counts"
    at = int(np.argmin(course.deviance)) + 1
    return at, f"the least deviance, {course.deviance[at - 1]:.3g}; it never gets down to that of noise, 1"


def plateau(course: Course) -> tuple[int, str]:
    """The first iteration that changes E(i) by less than 0.1 %."""
    still = np.flatnonzero(np.abs(np.diff(course.error)) < LEVEL * course.error[:-1])
    at = int(still[0]) + 2 if still.size else course.error.size
    return at, "E(i) changes by less than 0.1 %" if still.size else "no plateau was reached"


def held_out(course: Course) -> tuple[int, str]:
    """Twice the first iteration that predicts held-out counts as well as the best: it had half of the counts to learn from.

    As well: the score is worse by no more than its own standard error, from the differences position by position. Beyond
    it, iterations add what the counts do not ask for.
    """
    assert course.held_out is not None  # noqa: S101 - `deconvolve` has counts
    scores = course.held_out
    worse = scores - scores[int(np.argmin(scores.sum(axis=1)))]
    error = worse.std(axis=1) * np.sqrt(worse.shape[1])
    good = int(np.flatnonzero(worse.sum(axis=1) <= error)[0]) + 1
    return (
        2 * good,
        f"half of the counts predicts the other half as well after {good} as it ever does; all deserve twice as many",
    )


RULES: dict[str, Callable[[Course], tuple[int, str]]] = {
    "held-out": held_out,
    "discrepancy": discrepancy,
    "plateau": plateau,
    "thesis": thesis,
}
"""By name; the first is the default where counts are known, the last where they are not."""

NEEDS_COUNTS = ("held-out", "discrepancy")
"""Rules that need the noise of the scan."""
