"""The course of an iteration on a scan and on halves of its counts, and where a rule stops it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.richardson_lucy import deviances, iterations
from etendue.instruments.stopping import MOST, NEEDS_COUNTS, RULES, Course
from etendue.quantities.arguments import as_whole, require, require_known

Array = npt.NDArray[np.float64]

THINNINGS = 4
"""Times that counts are parted into halves."""

PATIENCE = 25
"""Iterations without a better score of held-out counts after which none is looked for."""

FURTHEST = 1000
"""Iterations after which held-out counts are not asked any more."""

LARGEST_ITERATIONS = 1_000_000

MOST_COUNTS = 2.0**53
"""At a position that can be parted: more have errors of rounding, as quadratures do, and go together in lots."""


MOST_REPLICATES = 10_000


def checked_replicates(given: int) -> int:
    """How many scans are drawn that errors are made of.

    Raises
    ------
    ArgumentError
        If it is no whole number, one, which has no spread, or too many.

    Examples
    --------
    >>> checked_replicates(0), checked_replicates(32)
    (0, 32)
    """
    found = as_whole(given, "replicates", 0, MOST_REPLICATES)
    if found == 1:
        raise ArgumentError("replicates is 1, and one scan has no spread; give 2 or more, or 0 for no errors.")
    return found


def rule_of(stop: str | int | None, *, counted: bool) -> str:
    """The name of a rule, or a number of iterations as text; the default where nothing is said.

    Raises
    ------
    ArgumentError
        If the number is impossible, or the rule needs counts and there are none.
    UnknownNameError
        If there is no such rule.

    Examples
    --------
    >>> rule_of(None, counted=True), rule_of(None, counted=False), rule_of(12, counted=True)
    ('held-out', 'thesis', '12 iterations')
    """
    if isinstance(stop, int):
        return f"{as_whole(stop, 'stop: the number of iterations', 1, LARGEST_ITERATIONS)} iterations"
    if stop is None:
        return next(iter(RULES)) if counted else "thesis"
    require(stop, str, "stop", f"a number of iterations, or one of {', '.join(RULES)}")
    require_known(stop, RULES, "rule")
    if not counted and stop in NEEDS_COUNTS:
        raise ArgumentError(f"the rule {stop!r} needs the standard errors of the scan; 'thesis' and 'plateau' do not")
    return stop


def halves_of(measured: Array, gain: float, seed: int) -> tuple[Array, Array]:
    """Counts parted into halves at random, four times: one half as fluxes of the whole, the other half as counts.

    Both of shape (n, 4).
    """
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 0))))
    wanted = np.maximum(measured, 0.0) / gain
    lot = max(1.0, float(wanted.max()) / MOST_COUNTS)
    counts = np.round(wanted / lot).astype(np.int64)
    first = rng.binomial(counts[:, None], 0.5, (counts.size, THINNINGS))
    return np.asarray(2.0 * gain * lot * first), np.asarray(lot * (counts[:, None] - first), dtype=np.float64)


def course_of(
    matrix: Any,
    measured: Array,
    background: float | Array,
    gain: float | None,
    start: Callable[[Array], Array],
    rule: str,
    seed: int,
    shrink: Callable[[Array], Array] | None = None,
    furthest: int = FURTHEST,
) -> tuple[Course, int, str]:
    """Iterate until a rule is sure of its stop.

    Parameters
    ----------
    matrix : array or sparse matrix, shape (n, m)
        A.
    measured : array, shape (n,)
        With the background in it.
    background : number, or array of shape (n,)
        In the same unit.
    gain : number, optional
        What one count stands for; None: the noise is not known.
    start : callable
        From measured values without background, of shape (n, k), to the lobes with which the iteration begins, (m, k).
    rule : str
        Of `rule_of`.
    seed : int
        Of the counts that are kept back.
    shrink : callable, optional
        As of `iterations`.
    furthest : int
        Iterations after which held-out counts are not asked any more.

    Returns
    -------
    Course, int, str
        What happened, the iteration to stop at, and why.
    """
    fixed = 0 if rule in RULES else int(rule.removesuffix(" iterations"))
    b = np.reshape(background, (-1, 1))
    columns, halves = measured[:, None], None
    if gain is not None and rule == "held-out":
        learned, halves = halves_of(measured, gain, seed)
        columns = np.hstack([columns, learned])
    errors, left, scores = [], [], []
    least, since = np.inf, 0
    most = fixed or (furthest if halves is not None else MOST)
    bare = measured - b[:, 0]
    for i, (_, image) in enumerate(iterations(matrix, columns, start(columns - b), background, shrink), 1):
        own = image[:, 0]
        # Where nothing was measured the term is 1, whatever the lobe.
        lit = (own > 0.0) & (bare > 0.0)
        errors.append(float(np.sqrt(np.mean(((own[lit] - bare[lit]) / own[lit]) ** 2))))
        if gain is not None:
            left.append(float(deviances(np.maximum(measured, 0.0) / gain, (own + b[:, 0]) / gain).mean()))
        if halves is not None:
            scores.append(deviances(halves, 0.5 * (image[:, 1:] + b) / gain).mean(axis=1))
            score = float(scores[-1].sum())
            least, since = (score, 0) if score < least else (least, since + 1)
            if since > PATIENCE + len(scores) // 2:
                break
        if i >= most:
            break
    course = Course(
        np.array(errors),
        np.array(left) if left else None,
        np.array(scores) if scores else None,
    )
    if fixed:
        return course, fixed, "as many as were asked for"
    count, why = RULES[rule](course)
    return course, count, why


def after(
    matrix: Any,
    measured: Array,
    start: Array,
    count: int,
    background: float | Array = 0.0,
    shrink: Callable[[Array], Array] | None = None,
) -> Array:
    """What is found after a number of iterations; `measured` of shape (n,) or (n, k).

    Examples
    --------
    >>> after(np.eye(2), np.array([1.0, 4.0]), np.ones(2), 1).tolist()
    [1.0, 4.0]
    """
    steps = iterations(matrix, measured, start, background, shrink)
    for _ in range(count):
        x, _image = next(steps)
    return x
