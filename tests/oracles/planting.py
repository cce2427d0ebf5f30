"""A pytest plugin that plants an error: one estimate, wherever it is made, is multiplied by a factor.

`tests/mutate.py` runs the statistical tests with it, once for each estimate, and lists those that stay green.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from types import CodeType, FunctionType
from typing import Any

import etendue as et
import pytest
from etendue import _core
from etendue.denoising import smoothing
from etendue.goniophotometry import far_field
from etendue.lightfield import fitting
from etendue.lightfield.gridded import fitting as gridded
from etendue.luminance import caustics

Arguments = Mapping[str | int, Any]
"""Of a call: by number those that were given by their place, by name the others."""

Spoil = Callable[[Any, float, Arguments], tuple[Any, bool]]
"""From what was found and a factor to what is off by it, and whether there was anything."""


def _sums(sums: tuple[Any, Any, Any], factor: float, _: Arguments) -> tuple[tuple[Any, Any, Any], bool]:
    """Σ w, Σ w² and counts."""
    return (sums[0] * factor, sums[1] * factor**2, sums[2]), bool(sums[0].any())


def _passes(sums: list[Any], factor: float, _: Arguments) -> tuple[list[Any], bool]:
    """Σ of means, and whatever else is told of them."""
    return [sums[0] * factor, *sums[1:]], bool(sums[0].any())


def _gathered(sums: list[Any], factor: float, arguments: Arguments) -> tuple[list[Any], bool]:
    """The same of lines of sight that end at surfaces whose light is known."""
    known = arguments.get("survey", arguments.get(9))
    return (sums, False) if known is None else _passes(sums, factor, arguments)


def _cells(tallies: Any, factor: float, arguments: Arguments) -> tuple[Any, bool]:
    cells = [_sums(cells, factor, arguments) for cells in tallies["cells"]]
    return {**tallies, "cells": [sums for sums, _ in cells]}, any(lit for _, lit in cells)


def _collected(tallies: Any, factor: float, _: Arguments) -> tuple[Any, bool]:
    scale = [1.0] * 6 + [factor, 1.0]
    records = [rows * scale for rows in tallies["records"]]
    return {**tallies, "records": records}, any(rows.size for rows in records)


def _account(tallies: Any, factor: float, _: Arguments) -> tuple[Any, bool]:
    """All entries but what was emitted, which is known beforehand."""
    ledger = tallies["ledger"]
    ends = {name: ledger[name] for name in ("escaped", "on_face", "in_medium")}
    off = {name: (flux * factor, rays) for name, (flux, rays) in ends.items()}
    return {**tallies, "ledger": {**ledger, **off}}, any(flux.any() for flux, _ in ends.values())


def _cone(found: tuple[list[Any], Any], factor: float, arguments: Arguments) -> tuple[tuple[list[Any], Any], bool]:
    cones = [_sums(sums, factor, arguments) for sums in found[0]]
    return ([sums for sums, _ in cones], found[1]), any(lit for _, lit in cones)


def _indexed(found: list[tuple[Any, int]], factor: float, arguments: Arguments) -> tuple[list[tuple[Any, int]], bool]:
    cones = [(_sums(sums, factor, arguments), looked) for sums, looked in found]
    return [(sums, looked) for (sums, _), looked in cones], any(lit for (_, lit), _ in cones)


def _field(field: et.LightField, factor: float, _: Arguments) -> tuple[et.LightField, bool]:
    return field.replace(
        parts=tuple(dataclasses.replace(part, level=part.level * factor) for part in field.parts)
    ), True


def _values(found: Any, factor: float, _: Arguments) -> tuple[Any, bool]:
    return dataclasses.replace(found, values=found.values * factor), bool(found.values.any())


def _patches(found: Any, factor: float, _: Arguments) -> tuple[Any, bool]:
    return dataclasses.replace(found, values=found.values * factor, flux=found.flux * factor), bool(found.values.any())


def _mass(found: smoothing.Smoothed, factor: float, _: Arguments) -> tuple[smoothing.Smoothed, bool]:
    return dataclasses.replace(found, mass=found.mass * factor), True


ESTIMATES: dict[str, tuple[tuple[Any, str, Spoil], ...]] = {
    "lines-of-sight": ((_core, "look_at_scene", _passes),),
    "gathered-lines": ((_core, "look_at_scene", _gathered),),
    "forward-light": ((caustics.LightImages, "seen", _values),),
    "traced-cells": ((_core, "trace_batches", _cells),),
    "traced-rays": ((_core, "trace_batches", _collected),),
    "flux-account": ((_core, "trace_batches", _account),),
    "scatter-events": ((_core, "look_at_events", _sums),),
    "cone": ((_core, "cone_sums", _cone), (_core, "index_sums", _indexed)),
    "light-field": ((fitting, "fit_counts", _field),),
    "intensity": ((far_field, "intensity_distribution", _values),),
    "patches": ((gridded, "patches_of", _patches),),
    "smoothing": ((smoothing, "smooth_counts", _mass),),
}
"""Where each estimate is made: owners of functions, their names, and how what they return is spoilt."""

VERDICTS = {"SIGNIFICANCE", "LARGEST_Z", "chi2", "standard_error"}
"""Names without one of which no test judges what errs by chance."""

READ = {"traced-rays": {"flux", "total_flux"}, "flux-account": {"ledger"}}
"""What every trace makes besides: names by which a test reads it."""


def names_in(test: Callable[..., None]) -> set[str]:
    """All names in a test, and in those functions of the tests that it calls."""
    seen: set[CodeType] = set()
    found: set[str] = set()

    def look(code: CodeType, known: Mapping[str, Any]) -> None:
        if code in seen:
            return
        seen.add(code)
        found.update(code.co_names, code.co_freevars)
        for inner in (part for part in code.co_consts if isinstance(part, CodeType)):
            look(inner, known)
        for value in (known[name] for name in code.co_names if callable(known.get(name))):
            function = inspect.unwrap(value)
            if isinstance(function, FunctionType) and function.__module__.split(".")[0] != "etendue":
                look(function.__code__, function.__globals__)

    plain = inspect.unwrap(test)
    assert isinstance(plain, FunctionType)
    look(plain.__code__, plain.__globals__)
    return found


@dataclasses.dataclass
class Run:
    """One test: what became of it, and on which estimates it gives a verdict."""

    outcome: str
    judged: frozenset[str]


class Planting:
    """Spoils one estimate, if any, during all tests, and notes which tests made which and what became of them."""

    def __init__(self, estimate: str | None, factor: float) -> None:
        self.estimate, self.factor = estimate, factor
        self.patch = pytest.MonkeyPatch()
        self.found: dict[str, Run] = {}
        # Estimates made so far by the test, or by fixtures inside each other; and those of each fixture that was kept.
        self.open: list[set[str]] = [set()]
        self.fixtures: dict[tuple[str, str], frozenset[str]] = {}

    def pytest_sessionstart(self) -> None:
        """Listen at every estimate, and plant the error in one."""
        for estimate, places in ESTIMATES.items():
            for owner, name, spoil in places:
                self._wrap(estimate, owner, name, spoil)

    def _wrap(self, estimate: str, owner: Any, name: str, spoil: Spoil) -> None:
        sound = getattr(owner, name)

        @functools.wraps(sound)
        def heard(*arguments: Any, **options: Any) -> Any:
            result = sound(*arguments, **options)
            off, moved = spoil(result, self.factor, {**dict(enumerate(arguments)), **options})
            if moved:
                self.open[-1].add(estimate)
            return off if moved and estimate == self.estimate else result

        self.patch.setattr(owner, name, heard)
        for module in [m for n, m in sys.modules.items() if n.startswith("etendue.") or n == "etendue"]:
            if vars(module).get(name) is sound:
                self.patch.setattr(module, name, heard)

    def pytest_sessionfinish(self) -> None:
        """Put the sound ones back."""
        self.patch.undo()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: pytest.FixtureRequest) -> Iterator[None]:
        """Note what a fixture makes: whoever uses it uses that."""
        self.open.append(set())
        try:
            return (yield)
        finally:
            made = self.open.pop()
            self.fixtures[fixturedef.argname, request.node.nodeid] = frozenset(made)
            self.open[-1] |= made

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Begin anew; values that functions of a module keep are made again, so that each test makes its own."""
        self.open = [set()]
        for value in vars(getattr(item, "module", None) or object).copy().values():
            if hasattr(value, "cache_clear"):
                value.cache_clear()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
        """Note the outcome of a test; one that is not even begun because a fixture fails has failed."""
        report: Any = yield
        if (call.when == "call" or report.outcome == "failed") and isinstance(item, pytest.Function):
            nodes = [node.nodeid for node in item.listchain()]
            kept = (self.fixtures.get((name, node), frozenset()) for name in item.fixturenames for node in nodes)
            names = names_in(item.function)
            made = frozenset(self.open[0]).union(*kept) if names & VERDICTS else frozenset()
            judged = frozenset(estimate for estimate in made if names & READ.get(estimate, names))
            self.found[item.nodeid] = Run(report.outcome, judged)
        return report
