"""What the scripts of this folder measure time with."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def timed(job: Callable[[], T]) -> tuple[float, T]:
    """Wall time of a job [s], and what it gives."""
    start = time.perf_counter()
    result = job()
    return time.perf_counter() - start, result


def best(job: Callable[[], object], repeats: int) -> float:
    """Least wall time of some repeats [s]: what the job takes when nothing else disturbs it."""
    return min(timed(job)[0] for _ in range(repeats))


def cores() -> int:
    """Cores that this process may use: fewer than the machine has under `taskset`."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def load() -> str:
    """How busy the machine was: runnable processes over the last minute, beside its cores."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
