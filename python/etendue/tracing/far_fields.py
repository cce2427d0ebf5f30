"""Which nodes the far fields of a scene deserve: a few rays are traced to see where its light goes."""

from __future__ import annotations

from typing import Any

import numpy as np

from etendue import _core
from etendue.quantities.node_choice import Choice, choose_nodes
from etendue.scene import Compiled

SHARE = 8
"""One batch is traced beforehand for so many of the trace, one at least."""

MOST_BATCHES = 8

OTHER_SEED = 1 << 63
"""Turned in the seed, so that nodes do not depend on the rays that they are filled with."""


def far_field_nodes(
    core: _core.Scene, compiled: Compiled, rays: int, seed: int, most_events: int, threads: int | None
) -> list[Choice]:
    """The nodes of each far-field detector, in their order; they depend on scene, rays and seed alone.

    Parameters
    ----------
    core : _core.Scene
        Of `compiled`, without nodes.
    compiled : Compiled
        With at least one detector of the far field.
    rays, seed, most_events, threads
        Of the trace that they are for.
    """
    size = _core.batch_size()
    number = min(rays, _distinct(compiled.record["sources"]), size * min(MOST_BATCHES, max(1, rays // (SHARE * size))))
    tallies = _core.trace_batches(core, number, seed ^ OTHER_SEED, most_events, 0, -(-number // size), threads)
    detectors = compiled.record["detectors"]
    looks = [i for i, record in enumerate(detectors) if record["kind"] == "intensity"]
    rows = tallies["records"][looks[0]]
    direction, flux = np.ascontiguousarray(rows[:, 3:6]), np.ascontiguousarray(rows[:, 6])
    meant = len(rows) * (rays / number)
    return [choose_nodes(direction, flux, meant, detectors[i]["c_planes"], detectors[i]["gamma_step"]) for i in looks]


def _distinct(sources: list[dict[str, Any]]) -> int:
    """Rays that can be traced before a ray set begins anew: copies of a ray would pass for a beam."""
    total = sum(source["flux"] for source in sources)
    sets = [int(len(s["rays"]) * (total / s["flux"])) for s in sources if s["kind"] == "rays"]
    return max(1, min(sets, default=1 << 62))
