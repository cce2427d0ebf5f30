"""Fixtures that every suite shares."""

from __future__ import annotations

import os
from pathlib import Path

import hypothesis
import pytest

# The same examples in every run: a failure is a failure, not a draw.
hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.load_profile("fixed")

# What a test fits, it fits: only the tests of the cache name a folder.
os.environ["ETENDUE_CACHE_DIR"] = ""

pytest_plugins = ["oracles.time_budget", "oracles.workers"]

NO_SAMPLES = "the folder of real sample files is not there"

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of real, freely licensed ray and intensity files, which is kept beside the project."""
    folder = ROOT.parent / "shared" / "samples"
    if not folder.is_dir():
        pytest.skip(NO_SAMPLES)
    return folder


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say last how many tests could not run for want of sample files."""
    skipped = terminalreporter.stats.get("skipped", [])
    if missing := sum(NO_SAMPLES in str(report.longrepr) for report in skipped):
        terminalreporter.write_line(f"{missing} tests were skipped because the sample files are not there")
