"""A pytest plugin that keeps the marker ``slow`` honest: a test without it that takes long fails, and so does one with it
that does not.

What counts is the processor time of the test itself (of all threads and of the processes that it started), without its
fixtures, and in seconds of a machine that does a fixed piece of work in a fixed time: neither a busy machine nor a slow one
makes a test slow.

``@pytest.mark.slow`` is for all cases of a test, ``@pytest.mark.slow(only=["torus"])`` for those whose name in brackets has
one of these words. Examples in docstrings cannot be marked; `SLOW_EXAMPLES` names those that are slow.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import pytest

FAST_MOST = 2.0
"""Seconds that a test may take without the marker."""

SLOW_LEAST = 0.5
"""Seconds that a test with the marker takes at least."""

STEPS, SECONDS = 400_000, 0.02
"""Additions of a loop, and how long they take on the machine whose seconds these are."""


SLOW_EXAMPLES: frozenset[str] = frozenset()
"""Docstrings whose examples are slow."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave the marker on the cases that it is for, so that ``-m "not slow"`` runs the others."""
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            if item.name in SLOW_EXAMPLES:
                item.add_marker("slow")
            continue
        case = item.name.partition("[")[2]
        for marker in list(item.iter_markers("slow")):
            if "only" in marker.kwargs and not any(word in case for word in marker.kwargs["only"]):
                item.own_markers.remove(marker)


def processor_time() -> float:
    """Seconds that this process and the ones that it waited for have worked."""
    return sum(os.times()[:4])


def slowness() -> float:
    """How many seconds of this machine are one of the other; at least 1."""

    def loop() -> float:
        start, total = time.thread_time(), 0
        for number in range(STEPS):
            total += number
        return time.thread_time() - start

    return max(1.0, min(loop() for _ in range(3)) / SECONDS)


def complaint(seconds: float, *, slow: bool) -> str | None:
    """What is wrong with a test that took so long.

    Examples
    --------
    >>> complaint(1.9, slow=False), complaint(0.6, slow=True)
    (None, None)
    >>> complaint(2.1, slow=False)
    'it took 2.1 s of processor time, more than 2: mark it slow, or make it fast'
    """
    if not slow and seconds > FAST_MOST:
        return f"it took {seconds:.1f} s of processor time, more than {FAST_MOST:g}: mark it slow, or make it fast"
    if slow and seconds < SLOW_LEAST:
        return f"it is marked slow and took {seconds:.2f} s of processor time, less than {SLOW_LEAST:g}: unmark it"
    return None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measure a test that passes."""
    start = processor_time()
    yield
    seconds, slow = processor_time() - start, item.get_closest_marker("slow") is not None
    # The machine is looked at only where that decides: it takes a while.
    if complaint(seconds, slow=slow) and (wrong := complaint(seconds / slowness(), slow=slow)):
        pytest.fail(wrong, pytrace=False)
