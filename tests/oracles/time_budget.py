"""A pytest plugin that keeps the marker ``slow`` honest: it lists tests without it that take long, and tests with it that do
not; with ``--strict-times`` these fail the run.

What counts is the processor time of all cases of a test together, with all threads and the processes that they started;
of fixtures, that of those which tests with the marker ask for, and it counts for all of these in their file. Seconds
are those of the machine that CI has, by a fixed piece of work. On a machine that others share, the time of one test was
seen to differ by a factor of three between two runs: that is why not every run is strict. Examples in docstrings cannot
be marked; `SLOW_EXAMPLES` names those that are slow.
"""

from __future__ import annotations

import os
import time
from collections import defaultdict
from collections.abc import Iterator

import pytest

FAST_MOST = 2.0
"""Seconds that a test may take without the marker."""

SLOW_LEAST = 0.5
"""Seconds that a test with the marker takes at least."""

STEPS, SECONDS = 400_000, 0.04
"""Additions of a loop, and how long they take on the machine whose seconds these are."""

SLOW_EXAMPLES: frozenset[str] = frozenset(
    {
        "etendue",
        "etendue.denoising.smoothing.smooth_counts",
        "etendue.goniophotometry.far_field.intensity_distribution",
        "etendue.goniophotometry.threshold_sweep.threshold_sweep",
        "etendue.instruments.directional_deconvolution.DirectionalDeconvolution",
        "etendue.instruments.directional_deconvolution.deconvolve_directions",
        "etendue.instruments.lobe_table.bsdf_table",
        "etendue.instruments.near_field.goniophotometer.NearFieldGoniophotometer",
        "etendue.instruments.near_field.run.NearFieldRun",
        "etendue.lightfield.characteristic.characteristic_curve",
        "etendue.lightfield.close_lines.crowding",
        "etendue.lightfield.diagnostics.diagnose",
        "etendue.lightfield.etendue_density.EtendueDensity.in_unit",
        "etendue.lightfield.far_field.field_intensity",
        "etendue.lightfield.field_rays.FieldRays",
        "etendue.lightfield.fit_cache.fit_or_recall",
        "etendue.lightfield.focusing.focused",
        "etendue.lightfield.light_field.LightField",
        "etendue.lightfield.light_field.LightField.intensity",
        "etendue.lightfield.resolution.resolution",
        "etendue.lightfield.selection.search.choose_surface",
        "etendue.luminance.denoising.denoise_map",
        "etendue.luminance.methods.FromField",
        "etendue.luminance.source_report.SourceReport",
        "etendue.luminance.source_report.report_source",
        "etendue.plot.characteristic_picture.plot_characteristic",
        "etendue.plot.directional_picture.plot_directions",
        "etendue.plot.near_field_picture.plot_near_field",
        "etendue.plot.report_page.plot_report",
        "etendue.plot.report_page.report_html",
    }
)
"""Docstrings whose examples are slow."""

PROPERTY = "processor time [s]"

FIXTURES = "processor time of fixtures [s]"


def processor_time() -> float:
    """Seconds that this process and the ones that it waited for have worked."""
    return sum(os.times()[:4])


def slowness() -> float:
    """How many seconds of this machine are one of the other."""

    def loop() -> float:
        start, total = time.thread_time(), 0
        for number in range(STEPS):
            total += number
        return time.thread_time() - start

    return min(loop() for _ in range(3)) / SECONDS


def complaint(seconds: float, *, slow: bool, whole: bool = True) -> str | None:
    """What is wrong with a test whose cases took so long; `whole`: none of them was left out.

    Examples
    --------
    >>> complaint(1.9, slow=False), complaint(0.6, slow=True), complaint(0.1, slow=True, whole=False)
    (None, None, None)
    >>> complaint(2.14, slow=False)
    'took 2.1 s of processor time, more than 2: mark it slow, or make it fast'
    """
    if not slow and seconds > FAST_MOST:
        return f"took {seconds:.1f} s of processor time, more than {FAST_MOST:g}: mark it slow, or make it fast"
    if slow and whole and seconds < SLOW_LEAST:
        return f"is marked slow and took {seconds:.2f} s of processor time, less than {SLOW_LEAST:g}: unmark it"
    return None


class TimeBudget:
    """The times of all tests of a run, where it is reported on.

    Parameters
    ----------
    whole : bool
        Whether tests run with all their cases.
    strict : bool
        Whether a wrong marker fails the run.
    """

    def __init__(self, *, whole: bool, strict: bool) -> None:
        self.whole = whole
        self.strict = strict
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.slow: dict[str, bool] = {}
        self.fixtures: defaultdict[str, float] = defaultdict(float)
        self.wrong: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up the cases of a test. One that did not pass says nothing."""
        if report.when == "call" and report.passed:
            test = report.nodeid.partition("@")[0].partition("[")[0]
            times = dict(report.user_properties)
            self.seconds[test] += float(times[PROPERTY])
            self.slow[test] = "slow" in report.keywords
            if self.slow[test]:
                self.fixtures[test.partition("::")[0]] += float(times[FIXTURES])

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Judge."""
        scale = slowness()
        whole = self.whole and not session.testsfailed
        for test, own in sorted(self.seconds.items()):
            slow = self.slow[test]
            seconds = own + (self.fixtures[test.partition("::")[0]] if slow else 0.0)
            if wrong := complaint(seconds / scale, slow=slow, whole=whole):
                self.wrong.append(f"{test} {wrong}")
        if self.strict and self.wrong and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which tests are wrong."""
        if self.wrong:
            terminalreporter.section("time budget")
            for line in self.wrong:
                terminalreporter.write_line(line)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that makes a run strict."""
    parser.addoption("--strict-times", action="store_true", help="fail if the marker slow is missing or out of place")


def pytest_configure(config: pytest.Config) -> None:
    """Judge where the run is reported on: not in the workers of one."""
    if not hasattr(config, "workerinput"):
        chosen = any("::" in argument for argument in config.args) or config.option.keyword
        config.pluginmanager.register(TimeBudget(whole=not chosen, strict=config.option.strict_times), "time-budget")


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark the examples that are slow, before anybody asks which tests are."""
    if isinstance(item, pytest.DoctestItem) and item.name in SLOW_EXAMPLES:
        item.add_marker("slow")


def measured(item: pytest.Item, name: str) -> Iterator[None]:
    start = processor_time()
    try:
        yield
    finally:
        item.user_properties.append((name, processor_time() - start))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Measure the fixtures that are made for a test."""
    yield from measured(item, FIXTURES)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measure a test."""
    yield from measured(item, PROPERTY)
