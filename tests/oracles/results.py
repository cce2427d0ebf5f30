"""What the result of a trace holds, bit by bit."""

from __future__ import annotations

from typing import Any

from etendue.tracing import TraceResult


def bits(result: TraceResult) -> list[Any]:
    """Everything that a result holds, as bytes."""
    sums = result.sums
    arrays = [a for entry in sums.ledger.values() for a in entry]
    arrays += [a for cells in (*sums.cells, sums.sources, *sums.open_units) for a in cells]
    return [
        sums.batches, sums.rays, sums.segments, sums.imbalance, sums.lost_at,
        *(a.tobytes() for a in arrays), *(held.array().tobytes() for held in sums.collected),
        *((held.level, held.array().tobytes()) for held in sums.scattered),
    ]  # fmt: skip
