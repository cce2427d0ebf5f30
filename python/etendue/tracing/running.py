"""Tracing in rounds: each leaves a valid result, and a trace can go on from any of them to the same bits."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterator
from pathlib import Path

from etendue.description.values import is_number
from etendue.errors import ArgumentError
from etendue.quantities.arguments import require, require_callable
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.scene import Scene
from etendue.tracing.ledger import NOTEWORTHY, TraceWarning
from etendue.tracing.result import TraceResult
from etendue.tracing.work import BATCHES, MOST_EVENTS, TraceWork, trace_work

Resume = TraceResult | str | os.PathLike[str] | None


def trace(
    scene: Scene | str | os.PathLike[str],
    rays: float | None = None,
    seed: int = 1,
    *,
    until: float | None = None,
    most_events: int = MOST_EVENTS,
    threads: int | None = None,
    progress: Progress | None = None,
    resume: Resume = None,
) -> TraceResult:
    """Follow rays from the sources of a scene to its detectors.

    Every ray keeps its flux and has one fate: at a surface it goes on in one of the possible ways, or is absorbed, by
    chance in proportion to their shares; so it is in absorbing media.

    Parameters
    ----------
    scene : Scene or path
        With at least one source; of a path, the scene in that file.
    rays : int or None
        Of all sources together, shared out by their flux. None: as many as of the result that is gone on with; if there is
        none and all sources are ray sets, as many as these have, so that one set alone gives every ray once; else 10⁷.
    seed : int
        0 to 2⁶⁴ − 1.
    until : float, optional
        Stop when the relative standard error is below it for every detector with cells (`TraceResult.relative_error`:
        for each detector the median over its cells, weighted by their flux). `rays` is then the most that are traced;
        the result is scaled to all of them.
    most_events : int
        Surfaces that a ray may meet before it is given up.
    threads : int, optional
        All cores if None. The result has the same bits for any number.
    progress : callable, optional
        Called with the number of rays done, after each round of about a million.
    resume : TraceResult or path, optional
        Go on from this result of the same scene, number of rays and seed, or from a file of one.

    Returns
    -------
    TraceResult

    Raises
    ------
    SceneError
        If the scene has mistakes.
    ArgumentError
        If a number is out of its range, the scene is none or has no sources, or `resume` is the result of something else.
    MemoryLimitError
        If there is no room for the cells of its detectors.
    KeyboardInterrupt
        Upon Ctrl-C; who wants to keep what was done uses `trace_rounds`.

    Warns
    -----
    TraceWarning
        If more than 10⁻⁹ of the flux was lost; says why and where.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "point", "flux": 12.566370614359172}
    >>> desk = {"name": "desk", "kind": "illuminance", "width": 10, "height": 10, "columns": 1, "rows": 1,
    ...         "at": [0, 0, -1000], "toward": [0, 0, 1]}
    >>> seen = et.trace(et.Scene(sources=[lamp], detectors=[desk]), rays=10**6, seed=2).illuminance["desk"]
    >>> bool(abs(seen.mean - 1) < 4 * seen.standard_error[0, 0])      # 1 cd at 1 m
    True
    """
    require_callable(progress)
    result = None
    for result in trace_rounds(scene, rays, seed, until=until, most_events=most_events, threads=threads, resume=resume):
        if progress is not None:
            progress(result.rays_done)
    assert result is not None  # noqa: S101 - there is at least one round
    if result.ledger.lost_share > NOTEWORTHY:
        warnings.warn(result.ledger.notes()[0], TraceWarning, stacklevel=2)
    return result


def trace_rounds(
    scene: Scene | str | os.PathLike[str],
    rays: float | None = None,
    seed: int = 1,
    *,
    until: float | None = None,
    most_events: int = MOST_EVENTS,
    threads: int | None = None,
    resume: Resume = None,
) -> Rounds:
    """Trace, and yield the result so far after each round of about a million rays.

    Each result is complete in itself and does not change any more: keep the last one, whatever stops the loop, and go on
    from it later with ``resume=``. The parameters are those of `trace`; mistakes in them are found at once.

    Returns
    -------
    Rounds
        An iterator of `TraceResult`, the last of which is what `trace` returns; `Rounds.plan` says what will be traced.

    Raises
    ------
    SceneError, ArgumentError, MemoryLimitError
        As `trace`.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "point", "flux": 1}
    >>> rounds = trace_rounds(et.Scene(sources=[lamp]), rays=1.1e6)
    >>> first = next(rounds)
    >>> first.complete, round(first.ledger.escaped.flux, 9)
    (False, 1.0)
    >>> et.trace(et.Scene(sources=[lamp]), 1.1e6, resume=first).complete
    True
    """
    threads = checked_threads(threads)
    if until is not None and not (is_number(until) and math.isfinite(until) and until > 0.0):
        raise ArgumentError(f"until is {until!r}; give the relative error to be reached, e.g. 0.01.")
    start = None
    if resume is not None:
        require(resume, (TraceResult, str, os.PathLike), "resume", "a TraceResult, or the path of one")
        start = resume if isinstance(resume, TraceResult) else TraceResult.load(Path(resume))
    before = None if start is None else start.plan
    if rays is None and start is not None:
        rays = start.rays_asked
    work = trace_work(scene, rays, seed, most_events=most_events, threads=threads, before=before)
    if before is not None:
        work.plan.check_same(before)
    if until is not None and not any(detection.judged for detection in work.plan.detections):
        raise ArgumentError("until: the scene has no detector with cells (intensity, illuminance, image) to judge by.")
    return Rounds(work, start, until, threads)


class Rounds(Iterator[TraceResult]):
    """The rounds of a trace, each a work unit that is worked on when its result is asked for; see `trace_rounds`.

    Parameters
    ----------
    work : TraceWork
        What is traced.
    start : TraceResult, optional
        Where to go on; it comes first.
    until, threads
        As of `trace`.
    """

    def __init__(self, work: TraceWork, start: TraceResult | None, until: float | None, threads: int | None) -> None:
        self.plan = work.plan
        self._work = work
        self._until = until
        self._threads = threads
        # Names and notes are those of here, the sums those of there.
        self._start = None if start is None else TraceResult(work.plan, start.sums)
        self._last: TraceResult | None = None

    def __next__(self) -> TraceResult:
        """The result after one round more."""
        last = self._last
        if last is None and self._start is not None:
            self._last = self._start
            return self._start
        if last is not None and (last.complete or (self._until is not None and last.relative_error < self._until)):
            raise StopIteration
        number = 0 if last is None else last.sums.batches // BATCHES
        result = self._work.join([self._work(number, self._threads)], last)
        self._last = result
        return result
