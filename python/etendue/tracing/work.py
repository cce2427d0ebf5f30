"""A trace in work units: batches of a run, which can be worked on anywhere and are joined in their order."""

from __future__ import annotations

import dataclasses
import math
import numbers
import os
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from types import NoneType
from typing import Any

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.arguments import require
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.memory import require_memory
from etendue.quantities.ray_stream import RayStream, checked_threads
from etendue.scatter.building import core_scene
from etendue.scene import Scene, compile_scene
from etendue.tracing.far_fields import far_field_nodes
from etendue.tracing.plan import Plan, make_plan
from etendue.tracing.result import TraceResult
from etendue.tracing.sums import Sums

BATCHES = 16
"""Batches of a work unit. Fixed, and counted from the first of the run: sums are formed for each work unit, and their bits
depend on it."""

MOST_EVENTS = 10_000

CELL_BYTES = 100
"""Of a cell of a detector in memory while it is counted in: 97 were measured, of illuminance."""


@dataclasses.dataclass(frozen=True, repr=False)
class TraceWork:
    """A trace cut into work units of about a million rays.

    Called with the number of a unit, it works on that unit: a function of nothing but the plan and the number, so that units
    can be worked on in any order, by other processes and on other machines. `join` adds them up in their order, to the bits
    of `etendue.trace`. It pickles as its plan; ray files that the scene names are read where the work is done, and have to
    be the same there.

    Parameters
    ----------
    plan : Plan
        What is traced.
    core : _core.Scene, optional
        The scene as the tracer takes it, if it is at hand; else it is compiled when it is needed.

    Examples
    --------
    >>> import etendue as et, pickle
    >>> lamp = {"kind": "point", "flux": 1}
    >>> scene = et.Scene(sources=[lamp])
    >>> work = et.trace_work(scene, rays=1.1e6, seed=3)
    >>> there = pickle.loads(pickle.dumps(work))                   # in another process
    >>> last, first = there(1), work(0)
    >>> result = work.join([first, last])
    >>> len(work), result.complete, result.ledger == et.trace(scene, rays=1.1e6, seed=3).ledger
    (2, True, True)
    """

    plan: Plan
    core: _core.Scene | None = dataclasses.field(default=None, compare=False)

    @cached_property
    def _scene(self) -> _core.Scene:
        """The scene as the tracer takes it."""
        if self.core is not None:
            return self.core
        if self.plan.scene is None:
            raise ArgumentError(
                "the scene of this trace is known by its text only: load the scene, and use trace_work."
            )
        compiled = compile_scene(self.plan.scene)
        if fingerprint(compiled.record) != self.plan.fingerprint:
            name = self.plan.scene_name or "the scene"
            raise ArgumentError(f"{name}: a file that the scene names is not the one that the trace was planned with.")
        return core_scene(compiled.record).with_far_fields([nodes.core() for nodes in self.plan.far_fields])

    def __reduce__(self) -> tuple[type[TraceWork], tuple[Plan]]:
        """For pickle: the compiled scene is made anew."""
        return TraceWork, (self.plan,)

    def __repr__(self) -> str:
        """Units and rays."""
        return f"<TraceWork of {len(self)} units, {self.plan.rays:,} rays, seed {self.plan.seed}>"

    def __len__(self) -> int:
        """Number of work units."""
        return math.ceil(self.plan.rays / (BATCHES * _core.batch_size()))

    def __call__(self, number: int, threads: int | None = None) -> _core._WorkSums:
        """What a work unit amounts to, as a dictionary of numbers and arrays, which pickles.

        Parameters
        ----------
        number : int
            From 0 on.
        threads : int, optional
            All cores if None. The same bits for any number.

        Raises
        ------
        ArgumentError
            If there is no such unit, or a file of the scene is another one than that of the plan.
        KeyboardInterrupt
            Upon Ctrl-C.
        """
        require(number, numbers.Integral, "TraceWork: the number of a work unit", "a whole number")
        if not 0 <= number < len(self):
            raise ArgumentError(f"there is no work unit {number!r}; they are 0 to {len(self) - 1}.")
        plan, first = self.plan, number * BATCHES
        last = min(first + BATCHES, -(-plan.rays // _core.batch_size()))
        how = plan.rays, plan.seed, plan.most_events, first, last
        return _core.work_unit(self._scene, *how, checked_threads(threads))

    def join(self, units: Iterable[_core._WorkSums], start: TraceResult | None = None) -> TraceResult:
        """The result of work units, which come in their order.

        Parameters
        ----------
        units : iterable of dict
            Of this trace.
        start : TraceResult, optional
            Of the units before; none are missing between.

        Raises
        ------
        ArgumentError
            If there are no units, or they are not in their order.
        """
        require(start, (TraceResult, NoneType), "TraceWork.join: start", "the TraceResult of the units before, or None")
        require(units, Iterable, "TraceWork.join: units", "a list of what the work was called for")
        plan = self.plan
        sums = None if start is None else start.sums
        for unit in units:
            require(unit, Mapping, "TraceWork.join: one of the units", "what the work gives when called")
            if sums is None:
                sums = Sums.nothing(unit, plan.dealing, [detection.most_events for detection in plan.detections])
            sums = sums.then(unit, plan.dealing)
        if sums is None:
            raise ArgumentError("there are no work units to join; give at least the first.")
        return TraceResult(plan, sums)


def trace_work(
    scene: Scene | str | os.PathLike[str],
    rays: float | None = None,
    seed: int = 1,
    *,
    most_events: int = MOST_EVENTS,
    threads: int | None = None,
    before: Plan | None = None,
) -> TraceWork:
    """A trace in work units, for whoever shares it out to processes or machines; `etendue.trace` does all of it here.

    Parameters
    ----------
    scene, rays, seed, most_events
        As of `etendue.trace`.
    threads : int, optional
        For the rays that are traced beforehand where far fields have to be framed. All cores if None.
    before : Plan, optional
        Of a trace that is gone on with: far fields keep their nodes.

    Returns
    -------
    TraceWork

    Raises
    ------
    SceneError, ArgumentError, MemoryLimitError
        As `etendue.trace`.

    Examples
    --------
    Four processes, and the same bits as one:

    >>> import etendue as et
    >>> from concurrent.futures import ProcessPoolExecutor
    >>> def shared_out(scene, rays):
    ...     work = et.trace_work(scene, rays)
    ...     with ProcessPoolExecutor(4) as pool:
    ...         return work.join(pool.map(work, range(len(work)), chunksize=4))
    """
    if isinstance(scene, str | os.PathLike):
        scene = Scene.load(Path(scene))
    given: Any = scene
    if not isinstance(given, Scene):
        hint = "rays are put in a source: et.Scene(sources=[{'kind': 'rays', 'rays': rays}])"
        advice = hint if isinstance(given, RayStream) else "give an et.Scene, or the path of one"
        raise ArgumentError(f"a {type(given).__name__} is no scene; {advice}.")
    require(before, (Plan, NoneType), "trace_work: before", "the plan of the trace that is gone on with, or None")
    threads = checked_threads(threads)
    compiled = compile_scene(scene)
    core = core_scene(compiled.record)
    plan = make_plan(
        scene,
        compiled,
        rays,
        seed,
        most_events,
        lambda count: far_field_nodes(core, compiled, count, seed, most_events, threads),
        before,
    )
    cells = sum(detection.judged for detection in plan.detections)
    held = f"{scene.name or 'the scene'}: detectors with {cells:,} cells"
    require_memory(CELL_BYTES * cells * plan.dealing.strata, held)
    return TraceWork(plan, core.with_far_fields([nodes.core() for nodes in plan.far_fields]))
