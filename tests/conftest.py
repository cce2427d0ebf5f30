"""Fixtures that every suite shares."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

# The same examples in every run: a failure is a failure, not a draw.
hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.load_profile("fixed")
# Nor do they hang on which modules were imported before: numbers and texts of their source are among the examples otherwise,
# and to sift thousands of them takes most of the time of some tests. Early versions have no such thing.
with contextlib.suppress(ImportError):
    from hypothesis.internal.conjecture import providers

    providers._get_local_constants = lambda: providers._local_constants

# What a test fits, it fits: only the tests of the cache name a folder.
os.environ["ETENDUE_CACHE_DIR"] = ""

# Thousands of tests make folders and remove them, milliseconds each on a disk. Where there is a file system in memory with
# room for them (a test has some 100 MB at most), and programs may run from it, they are there.
IN_MEMORY, ROOM = Path("/dev/shm"), 4 << 30  # noqa: S108 - each run has a folder of its own there
if "TMPDIR" not in os.environ and os.access(IN_MEMORY, os.W_OK):
    found = os.statvfs(IN_MEMORY)
    if found.f_bavail * found.f_frsize >= ROOM and not found.f_flag & os.ST_NOEXEC:
        os.environ["TMPDIR"] = tempfile.tempdir = str(IN_MEMORY)

pytest_plugins = ["oracles.time_budget", "oracles.workers"]

NO_SAMPLES = "the folder of real sample files is not there"
NO_BROWSER = "no Chromium is installed"
NO_NODE = "no Node is installed"
BROWSERS = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")

COUNTED = {NO_SAMPLES: "the sample files are not there", NO_BROWSER: NO_BROWSER, NO_NODE: NO_NODE}
"""Reasons for which tests are skipped that are counted at the end, and what is said of them."""

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session", autouse=True)
def _no_waiting_for_disks() -> Iterator[None]:
    """What a test writes need not outlive a power cut: `tests/maps/test_output.py` looks that files are flushed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", os.fstat)  # which fails for the same handles
        yield


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of real, freely licensed ray and intensity files, which is kept beside the project."""
    folder = ROOT.parent / "shared" / "samples"
    if not folder.is_dir():
        pytest.skip(NO_SAMPLES)
    return folder


@pytest.fixture(scope="session")
def chromium() -> str:
    """The program of a browser in which pages are tried."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(NO_BROWSER)
    return found


@pytest.fixture(scope="session")
def node() -> str:
    """The program in which the modules of pages are tried without a browser."""
    found = shutil.which("node")
    if found is None:
        pytest.skip(NO_NODE)
    return found


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say last how many tests could not run for want of sample files or of a program."""
    skipped = terminalreporter.stats.get("skipped", [])
    for reason, words in COUNTED.items():
        if missing := sum(reason in str(report.longrepr) for report in skipped):
            terminalreporter.write_line(f"{missing} tests were skipped because {words}")
