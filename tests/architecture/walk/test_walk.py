"""A stranger's walk: where `ARCHITECTURE.md` says that a new member of a family goes, one is added to a copy of the tree.

It takes four files at most, and the tests of the tree hold for it unasked. Those that need no compiler are added here, the
others by `compiled.py`, by hand.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from architecture.walk.additions import ADDITIONS, ROOT, copy_tree

MOST_FILES = 4
INTERPRETED = [family for family, addition in ADDITIONS.items() if not any("crates/" in f for f in addition.counted)]


def places(family: str) -> set[str]:
    """The files in the row of a family in the table of `ARCHITECTURE.md`."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    (cell,) = re.findall(rf"^\| an? {family} \| ([^|]*) \|", text, re.MULTILINE)
    return set(re.findall(r"`([^`/]+/[^`]+)`", cell))


@pytest.mark.parametrize("family", ADDITIONS)
def test_the_plan_names_the_files_and_they_are_few(family: str) -> None:
    addition = ADDITIONS[family]
    named = {Path(file).with_stem("x").as_posix() if file in addition.files else file for file in addition.counted}
    assert named == places(family)
    assert len(addition.counted) <= MOST_FILES
    assert all(page.file.startswith("docs/") or page.file == "ARCHITECTURE.md" for page in addition.pages)


def test_every_addition_still_fits(tmp_path: Path) -> None:
    """All of them at once: each finds the lines that it stands behind."""
    copy_tree(tmp_path)
    for addition in ADDITIONS.values():
        addition.apply(tmp_path)
        for test in addition.unasked:
            file, _, function = test.partition("[")[0].partition("::")
            assert f"def {function}(" in (tmp_path / file).read_text(encoding="utf-8"), test


def test_there_are_some_of_either_kind() -> None:
    assert INTERPRETED == ["source", "ray format", "verb"]


def passed(root: Path, *tests: str) -> set[str]:
    """Those of the named tests that passed in a copy of the tree."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-o", "addopts=", "-q", "-rA", "--tb=short"]
    command += ["--doctest-modules", "--import-mode=importlib", f"--basetemp={root / 'scratch'}", *tests]
    environment = {**os.environ, "PYTHONPATH": str(root / "python"), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("PYTEST_ADDOPTS", None)
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
    return set(re.findall(r"^PASSED (.+)$", done.stdout, re.MULTILINE))


@pytest.mark.slow
def test_the_tests_of_the_tree_hold_for_it_unasked(tmp_path: Path) -> None:
    copy_tree(tmp_path)
    tests = []
    for family in INTERPRETED:
        ADDITIONS[family].apply(tmp_path)
        tests += ADDITIONS[family].unasked
        tests.append(f"tests/architecture/walk/checks.py::test_{family.replace(' ', '_')}")
    assert passed(tmp_path, *tests) == set(tests)
