"""What a run of the program leaves: its status, its words, its files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest


class Outcome(NamedTuple):
    """Exit status, standard output, standard error."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output as JSON; it must hold nothing else, and no NaN or Infinity."""
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


Run = Callable[..., Outcome]
"""The fixture `run`: the program, called with its arguments."""


def files(place: Path) -> list[str]:
    """All files and folders in a folder."""
    return sorted(str(p.relative_to(place)) for p in place.rglob("*"))
