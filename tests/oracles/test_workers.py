"""With several workers, tests that share a fixture stay together, and threads are no more than cores."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from oracles import workers

pytest_plugins = ["pytester"]


def groups_of(pytester: pytest.Pytester, text: str) -> list[str | None]:
    """The group of each test of a file, after the name of its module."""
    path = pytester.makepyfile(text)
    items = pytester.getitems(path.read_text(encoding="utf-8"))
    workers.pytest_collection_modifyitems(items)
    marks = [[mark.args[0] for mark in item.iter_markers("xdist_group")] for item in items]
    assert all(len(groups) <= 1 for groups in marks)
    modules = [item.nodeid.partition("::")[0] for item in items]
    return [groups[0].removeprefix(module) if groups else None for groups, module in zip(marks, modules, strict=True)]


@pytest.mark.parametrize(("shared", "group"), [("module", ""), ("function", None)])
def test_tests_that_share_a_fixture_stay_together(pytester: pytest.Pytester, shared: str, group: str | None) -> None:
    """The tests of a file that ask for its fixture have one group, the other test none."""
    found = groups_of(
        pytester,
        f"import pytest\npytestmark = pytest.mark.slow\n@pytest.fixture(scope='{shared}')\ndef field(): return 1\n"
        "def test_a(field): pass\ndef test_b(): pass\ndef test_c(field): pass\n",
    )
    assert found == [group, None, group]


def test_quick_tests_go_to_workers_in_lots(pytester: pytest.Pytester) -> None:
    """Slow ones between them go one by one, and those that share a fixture stay together."""
    found = groups_of(
        pytester,
        "import pytest\n@pytest.fixture(scope='module')\ndef field(): return 1\n"
        f"@pytest.mark.parametrize('k', range({workers.LOT - 1}))\ndef test_a(k): pass\n"
        "@pytest.mark.slow\ndef test_b(): pass\ndef test_c(field): pass\ndef test_d(): pass\ndef test_e(): pass\n",
    )
    assert found == [" 0"] * (workers.LOT - 1) + [None, "", " 0", " 1"]


@pytest.mark.slow
def test_a_fixture_of_a_module_is_made_once(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """By two workers who both have tests to do: as xdist and pytest work together, not as we think that they do."""
    monkeypatch.setenv("PYTHONPATH", str(Path(workers.__file__).parents[1]))
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    pytester.makepyfile(
        "import pytest\n@pytest.fixture(scope='module')\ndef field():\n    print('made', file=open('made', 'a'))\n"
        "@pytest.mark.parametrize('k', range(8))\ndef test_a(field, k): pass\n"
        "@pytest.mark.parametrize('k', range(8))\ndef test_b(k): print('done', file=open('made', 'a'))\n"
    )
    found = pytester.runpytest_subprocess("-n", "2", "--dist=loadgroup", "-p", "oracles.workers")
    found.assert_outcomes(passed=16)
    assert sorted((pytester.path / "made").read_text(encoding="utf-8").split()) == ["done"] * 8 + ["made"]


@pytest.mark.parametrize(("cores", "count", "threads"), [(2, 2, "1"), (16, 4, "4"), (2, 5, "1"), (None, 1, "1")])
def test_workers_share_the_cores(monkeypatch: pytest.MonkeyPatch, cores: int | None, count: int, threads: str) -> None:
    environment = {workers.THREADS[1]: "3"}  # what a user says stays
    monkeypatch.setattr(os, "environ", environment)
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    workers.pytest_xdist_setupnodes([object()] * count)
    assert environment == dict.fromkeys(workers.THREADS, threads) | {workers.THREADS[1]: "3"} | workers.ALLOCATOR


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what a program began with is read on Linux")
def test_workers_keep_memory_and_programs_that_they_start_do_not(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The allocator reads its limits when a program begins: the worker began with them, and what a test starts without."""
    monkeypatch.setenv("PYTHONPATH", str(Path(workers.__file__).parents[1]))
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    stated = "MALLOC_TRIM_THRESHOLD_"
    monkeypatch.delenv("MALLOC_MMAP_THRESHOLD_", raising=False)
    monkeypatch.setenv(stated, "5000000")  # what a user says stays
    pytester.makepyfile(
        "import os, pathlib, subprocess, sys\n"
        "def test_it():\n"
        "    begun = pathlib.Path('/proc/self/environ').read_text()\n"
        "    assert 'MALLOC_MMAP_THRESHOLD_=33554432' in begun and 'MALLOC_TRIM_THRESHOLD_=5000000' in begun\n"
        "    code = 'import os; print(sorted(name for name in os.environ if name.startswith(\"MALLOC\")))'\n"
        "    told = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True).stdout\n"
        f"    assert told.strip() == \"['{stated}']\"\n"
    )
    found = pytester.runpytest_subprocess("-n", "1", "-p", "oracles.workers")
    found.assert_outcomes(passed=1)
