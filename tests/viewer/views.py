"""Views without symmetry, for pages and for maps of the core alike."""

from __future__ import annotations

from typing import Any, NamedTuple

import etendue as et
import numpy as np


class PageView(NamedTuple):
    """A view as the page takes it, and as the core does."""

    page: dict[str, Any]
    observer: et.Observer
    screen: et.Screen


def page_views(*, count: int, columns: int, rows: int, seed: int, closer: float = 1.0) -> list[PageView]:
    """From above and below, near and far, of all and of a part; or of so much less of it."""
    rng = np.random.default_rng(seed)
    views = []
    for _ in range(count):
        theta, phi = float(rng.uniform(0, 120)), float(rng.uniform(-180, 180))
        distance, width = float(rng.choice([12.0, 70.0, 1000.0])), float(rng.uniform(0.8, 4.0)) / closer
        target = tuple(float(x) for x in rng.uniform(-0.3, 0.6, 3))
        page = {"theta": theta, "phi": phi, "distance": distance, "target": list(target), "width": width}
        screen = et.Screen(width, width / columns * rows, columns, rows)
        views.append(PageView(page, et.Observer(theta, phi, distance, target), screen))  # type: ignore[arg-type]
    return views
