"""A pytest plugin for runs with several workers (``pytest -n auto``).

Tests that share a fixture of their module run on one worker, which makes it once; all others go to whichever worker is
free. Quick ones go there in lots: to hand out one test, xdist counts all that it has handed out before, which for
thousands of tests one by one takes as long as they do. Workers share the cores: each has as many threads as its part,
also where a test leaves the number to the core. They keep memory that is given back.
"""

from __future__ import annotations

import gc
import linecache
import os
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

THREADS = ("RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables that say how many threads there are: of the core, and of libraries that numpy may use."""

ALLOCATOR = {"MALLOC_MMAP_THRESHOLD_": f"{32 << 20}", "MALLOC_TRIM_THRESHOLD_": f"{1 << 30}"}
"""Of glibc: arrays up to its largest limit [bytes] are made of memory that others gave back, which the system need not fill
with zeros again; that halves the system's part of the time. Other allocators do not know these variables."""

LOT = 16
"""Quick tests of a module that are handed out together."""

GARBAGE = (5_000, 20, 50)
"""How many objects are made between searches for garbage, and so on: with those of Python, 4 % of the time of tests goes
there, half of the time of one that reads the syntax of the package."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests together that share a fixture of their module, and quick ones in lots."""
    quick: Counter[str] = Counter()
    for item in items:
        module = item.nodeid.partition("::")[0]
        definitions = getattr(item, "_fixtureinfo", None)
        known = definitions.name2fixturedefs.values() if definitions else ()
        if any(found[-1].scope == "module" and found[-1].baseid == module for found in known):
            item.add_marker(pytest.mark.xdist_group(module))
        elif not item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.xdist_group(f"{module} {quick[module] // LOT}"))
            quick[module] += 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(specs: list[Any]) -> None:
    """Let workers share the cores: each has as many threads as its part. They keep memory for what comes next."""
    threads = max(1, (os.cpu_count() or 1) // len(specs))
    for variable in THREADS:
        os.environ.setdefault(variable, str(threads))
    for variable, most in ALLOCATOR.items():
        os.environ.setdefault(variable, most)


def pytest_configure(config: pytest.Config) -> None:
    """Keep the allocator's limits from programs that tests start, some with little memory: it has read them already."""
    if hasattr(config, "workerinput"):
        for variable, most in ALLOCATOR.items():
            if os.environ.get(variable) == most:
                del os.environ[variable]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collect without Python's search for garbage: next to nothing of what is made is thrown away."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.set_threshold(*GARBAGE)
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Leave what was collected out of the search for garbage: millions of objects that stay to the end, which it would look
    through again and again, for more than 1 % of the time of the tests. Forget the text of all modules: each example in a
    docstring would look whether any of their files has changed, for another 1 %."""
    linecache.clearcache()
    gc.freeze()
