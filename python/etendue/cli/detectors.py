"""The detector that ``--detector`` names, among all those of a trace."""

from __future__ import annotations

from collections.abc import Container

from etendue.errors import ArgumentError, UnknownNameError
from etendue.tracing.result import TraceResult


def check_detector(result: TraceResult, detector: str, fitting: Container[str], what: str) -> None:
    """Refuse a name that no detector of a trace has, or one whose detector keeps nothing that fits.

    Parameters
    ----------
    result : TraceResult
        Of the trace.
    detector : str
        The name.
    fitting : container of str
        The names of the detectors that fit.
    what : str
        What these keep, e.g. ``"rays"``.

    Raises
    ------
    UnknownNameError
        If no detector has the name; all of them are listed, and the nearest is suggested.
    ArgumentError
        If it keeps something else.
    """
    kinds = {detection.name: detection.KIND for detection in result.plan.detections}
    if not kinds:
        raise ArgumentError(f"--detector {detector}: the scene of this trace has no detectors; leave it out.")
    if detector not in kinds:
        raise UnknownNameError("detector", detector, kinds)
    if detector not in fitting:
        others = [name for name in kinds if name in fitting]
        instead = f"name one that does: {', '.join(others)}" if others else "none of this trace does"
        raise ArgumentError(
            f"--detector {detector}: it is of the kind {kinds[detector]} and keeps no {what}; {instead}."
        )
