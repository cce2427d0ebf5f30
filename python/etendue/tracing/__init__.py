"""Tracing light forwards through a scene: detectors, the flux ledger, results that can be kept and continued."""

from __future__ import annotations

from etendue.tracing.ledger import Ledger, TraceWarning
from etendue.tracing.result import TraceResult
from etendue.tracing.running import trace, trace_rounds
from etendue.tracing.work import TraceWork, trace_work

__all__ = ["Ledger", "TraceResult", "TraceWarning", "TraceWork", "trace", "trace_rounds", "trace_work"]
