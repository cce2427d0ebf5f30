"""Calls into the compiled core that can take long end upon a signal, wherever they are."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue import _core
from etendue.lightfield.carrier import Disk
from etendue.scene import compile_scene

PROMPT = 1.0
"""Seconds of processor time from a signal to the end of a call: of one thread, so no more than have passed."""

SPHERE: dict[str, Any] = {
    "sources": [{"name": "led", "kind": "point", "flux": 100}],
    "surfaces": [
        {
            "name": "wall",
            "shape": {"kind": "sphere", "radius": 50},
            "finish": {"kind": "lambertian", "reflectance": 0.999999},
        }
    ],
}
"""A ray meets its wall a million times."""

Call = Callable[[], Any]


@pytest.fixture(scope="module")
def calls() -> dict[str, Call]:
    """Each would take minutes."""
    field = et.LightField.fit(et.RingSource(rays=20_000, seed=1), Disk(radius=40), depths=(3, 3, 3, 3)).core
    view = et.Screen(60, 60, 1024, 1024).core_view(et.Observer(20, 10, 300))
    rng = np.random.default_rng(1)
    points = rng.normal(0, 20, (2_000_000, 3))
    directions = np.abs(rng.normal(size=(2_000_000, 3)))
    counts = rng.integers(0, 5, 1 << 22).astype(np.float64)
    sphere = _core.Scene(compile_scene(et.Scene(**SPHERE)).record)
    scattering = {**SPHERE, "detectors": [{"name": "scatter", "kind": "scatter"}]}
    events = et.trace(et.Scene(**scattering), 4000, most_events=100).events["scatter"]
    words, brought = events.rows.view("<u8").reshape(len(events), -1), events.rows["flux"].copy()
    return {
        "map of a field": lambda: field.look(view, 2048, 1),
        "luminance of a field": lambda: [field.luminance(points, directions, 1) for _ in range(100)],
        "intensity of a field": lambda: field.intensity(directions[:20_000], 512, 1),
        "evidence of a tree": lambda: _core.polya_evidence([6, 6, 5, 5], counts, None, None, 1.0, 1),
        "posterior of a tree": lambda: _core.polya_posterior([6, 6, 5, 5], counts, None, None, 1.0, 1),
        "map of events": lambda: [_core.look_at_events(events.core, words, brought, view, 1) for _ in range(100)],
        "trails": lambda: _core.trace_trails(sphere, 1000, 1, 100_000_000, 10.0),
    }


@pytest.fixture
def alarm() -> Iterator[Callable[[float], None]]:
    def strike(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, strike)
    try:
        yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds) and None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="the system has no alarms")
@pytest.mark.parametrize(
    "name",
    [
        "map of a field",
        "luminance of a field",
        "intensity of a field",
        "evidence of a tree",
        "posterior of a tree",
        "map of events",
        "trails",
    ],
)
def test_a_long_call_ends_within_a_second_of_a_signal(
    name: str, calls: dict[str, Call], alarm: Callable[[float], None]
) -> None:
    begun, after = time.process_time(), 0.2
    alarm(after)
    with pytest.raises(KeyboardInterrupt):
        calls[name]()
    assert time.process_time() - begun < after + PROMPT
