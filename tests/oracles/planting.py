"""A pytest plugin that plants an error: one estimate, wherever it is made, is multiplied by a factor.

`tests/mutate.py` runs the statistical tests with it, once for each estimate, and lists those that stay green.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from typing import Any

import etendue as et
import pytest
from etendue import _core
from etendue.lightfield import fitting

Spoil = Callable[[Any, float], tuple[Any, bool]]
"""From what was found and a factor to what is off by it, and whether there was anything."""


def _sums(sums: tuple[Any, Any, Any], factor: float) -> tuple[tuple[Any, Any, Any], bool]:
    """Σ w, Σ w² and counts."""
    return (sums[0] * factor, sums[1] * factor**2, sums[2]), bool(sums[0].any())


def _passes(sums: list[Any], factor: float) -> tuple[list[Any], bool]:
    """Σ of means, and whatever else is told of them."""
    return [sums[0] * factor, *sums[1:]], bool(sums[0].any())


def _harvest(harvest: Any, factor: float) -> tuple[Any, bool]:
    cells = [_sums(cells, factor) for cells in harvest["cells"]]
    return {**harvest, "cells": [sums for sums, _ in cells]}, any(lit for _, lit in cells)


def _cone(found: tuple[list[Any], Any], factor: float) -> tuple[tuple[list[Any], Any], bool]:
    return ([_sums(sums, factor)[0] for sums in found[0]], found[1]), True


def _field(field: et.LightField, factor: float) -> tuple[et.LightField, bool]:
    return field.replace(
        parts=tuple(dataclasses.replace(part, level=part.level * factor) for part in field.parts)
    ), True


def _intensity(found: et.Intensity, factor: float) -> tuple[et.Intensity, bool]:
    return found.replace(values=found.values * factor), True


ESTIMATES: dict[str, tuple[Any, str, Spoil]] = {
    "lines-of-sight": (_core, "look_at_scene", _passes),
    "traced-cells": (_core, "trace_batches", _harvest),
    "scatter-events": (_core, "look_at_events", _sums),
    "cone": (_core, "cone_sums", _cone),
    "light-field": (fitting, "fit_counts", _field),
    "intensity": (et, "intensity_distribution", _intensity),
}
"""Where each estimate is made: the owner of a function, its name, and how what it returns is spoilt."""


class Planting:
    """Spoils one estimate during all tests, and notes which tests made it and what became of them."""

    def __init__(self, estimate: str, factor: float) -> None:
        self.estimate, self.factor, self.calls = estimate, factor, 0
        self.patch = pytest.MonkeyPatch()
        self.found: dict[str, tuple[int, str]] = {}

    def pytest_sessionstart(self) -> None:
        """Plant the error."""
        owner, name, spoil = ESTIMATES[self.estimate]
        sound = getattr(owner, name)

        @functools.wraps(sound)
        def spoilt(*arguments: Any, **options: Any) -> Any:
            result, moved = spoil(sound(*arguments, **options), self.factor)
            self.calls += moved
            return result

        self.patch.setattr(owner, name, spoilt)

    def pytest_sessionfinish(self) -> None:
        """Put the sound one back."""
        self.patch.undo()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
        """Note the outcome of a test, with the number of estimates made up to its end."""
        report = yield
        if call.when == "call":
            self.found[item.nodeid] = (self.calls, report.outcome)
        return report
