"""Where a value comes from."""

from __future__ import annotations

import dataclasses
import functools
import importlib
from typing import Any


@functools.cache
def version() -> str:
    """Version of the installed package."""
    # Its module takes a quarter of the time that the whole package does, and is seldom needed.
    metadata: Any = importlib.import_module("importlib.metadata")
    return str(metadata.version("etendue"))


@dataclasses.dataclass(frozen=True)
class Provenance:
    """The origin of a value and what was done to it since, oldest first.

    Parameters
    ----------
    source : str
        File name, or the name of the synthetic source.
    format : str
        Name of the file's format, or ``"synthetic"`` or ``"memory"``.
    fingerprint : str
        Digest that changes when the input changes; empty for values made in memory.
    steps : tuple of str
        One line per operation.
    software : str
        Package and version that made the value.

    Examples
    --------
    >>> Provenance(source="led.ray", format="lighttools").then("subset of 10 rays, seed 1").steps
    ('subset of 10 rays, seed 1',)
    """

    source: str = "memory"
    format: str = "memory"
    fingerprint: str = ""
    steps: tuple[str, ...] = ()
    software: str = dataclasses.field(default_factory=lambda: f"etendue {version()}")

    def then(self, step: str) -> Provenance:
        """A copy with one more step."""
        return dataclasses.replace(self, steps=(*self.steps, step))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON headers."""
        return dataclasses.asdict(self) | {"steps": list(self.steps)}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Provenance:
        """Inverse of `to_dict`."""
        return cls(**{**data, "steps": tuple(data.get("steps", ()))})
