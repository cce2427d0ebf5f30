"""Complaints about a file: every one of them, with severity, place and clause."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

Severity = Literal["note", "warning", "error"]


class RayFileWarning(UserWarning):
    """A ray file contradicts itself; reading went on because the meaning is certain."""


class ChangedFileWarning(RayFileWarning):
    """Somebody wrote to a file while it was in use."""


@dataclasses.dataclass(frozen=True)
class Complaint:
    """One thing that is not as it should be.

    Parameters
    ----------
    severity : {"note", "warning", "error"}
        ``note``: good to know. ``warning``: contradicts the format or itself, meaning still certain.
        ``error``: data was lost (a truncated tail, rays that cannot be used).
    place : str
        Byte offset, line, or field.
    found : str
        What was found and what was made of it.
    clause : str
        The clause of the standard, or the section of the format's page, that it offends; may be empty.

    Examples
    --------
    >>> print(Complaint("warning", "byte 4", "version 7, not 2013 or 2020", "TM-25 4.7.1.2"))
    warning: byte 4: version 7, not 2013 or 2020 [TM-25 4.7.1.2]
    """

    severity: Severity
    place: str
    found: str
    clause: str = ""

    def __str__(self) -> str:
        clause = f" [{self.clause}]" if self.clause else ""
        return f"{self.severity}: {self.place}: {self.found}{clause}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return dataclasses.asdict(self)
