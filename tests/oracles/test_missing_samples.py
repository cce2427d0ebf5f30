"""Tests that need the sample files are counted where those are not there, and nothing is said where they are."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parents[1] / "conftest.py"


@pytest.fixture
def summary(pytester: pytest.Pytester) -> list[str]:
    """What is printed of three tests, two of which need the files, in a project that has no folder of samples."""
    folder = pytester.path / "project" / "tests"
    folder.mkdir(parents=True)
    (folder / "conftest.py").write_text(CONFTEST.read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "test_files.py").write_text(
        "import pytest\ndef test_a(samples): pass\ndef test_b(samples): pass\ndef test_c(): pytest.skip('not today')\n",
        encoding="utf-8",
    )
    return pytester.runpytest_inprocess("-p", "no:cacheprovider", "project/tests").outlines


def test_the_last_lines_count_those_that_were_skipped(summary: list[str]) -> None:
    assert "2 tests were skipped because the sample files are not there" in summary[-2:]


def test_nothing_is_said_where_the_files_are(pytester: pytest.Pytester, summary: list[str]) -> None:
    assert summary
    samples = pytester.path / "shared" / "samples"  # beside the project
    samples.mkdir(parents=True)
    lines = pytester.runpytest_inprocess("-p", "no:cacheprovider", "project/tests").outlines
    assert "2 passed, 1 skipped" in lines[-1]
    assert not any("sample files" in line for line in lines)
