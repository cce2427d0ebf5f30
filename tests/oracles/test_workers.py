"""With several workers, tests that share a fixture stay together, and threads are no more than cores."""

from __future__ import annotations

import os
from types import SimpleNamespace

import pytest
from xdist.remote import WorkerInteractor
from xdist.scheduler import LoadGroupScheduling

from oracles import workers

pytest_plugins = ["pytester"]


@pytest.mark.parametrize(("shared", "grouped"), [("module", 2), ("function", 0)])
def test_tests_that_share_a_fixture_stay_together(pytester: pytest.Pytester, shared: str, grouped: int) -> None:
    """The tests of a file that ask for its fixture have one group, the other test none; and xdist sends by that group."""
    path = pytester.makepyfile(
        f"import pytest\n@pytest.fixture(scope='{shared}')\ndef field(): return 1\n"
        "def test_a(field): pass\ndef test_b(): pass\ndef test_c(field): pass\n"
    )
    items = pytester.getitems(path.read_text(encoding="utf-8"))
    workers.pytest_collection_modifyitems(items)
    # What a worker does with all tests: the name of the group goes to the end of their names, where the scheduler looks.
    WorkerInteractor.pytest_collection_modifyitems(None, SimpleNamespace(getvalue=lambda _: True), items)
    scopes = [LoadGroupScheduling._split_scope(None, item.nodeid) for item in items]
    assert len(set(scopes)) == len(items) - max(grouped - 1, 0)
    groups = [mark.args[0] for item in items for mark in item.iter_markers("xdist_group")]
    assert len(groups) == grouped
    assert len(set(groups)) <= 1


@pytest.mark.parametrize(("cores", "count", "threads"), [(2, 2, "1"), (16, 4, "4"), (2, 5, "1"), (None, 1, "1")])
def test_workers_share_the_cores(monkeypatch: pytest.MonkeyPatch, cores: int | None, count: int, threads: str) -> None:
    environment = {workers.THREADS[1]: "3"}  # what a user says stays
    monkeypatch.setattr(os, "environ", environment)
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    workers.pytest_xdist_setupnodes([object()] * count)
    assert environment == dict.fromkeys(workers.THREADS, threads) | {workers.THREADS[1]: "3"}
