"""Progress of fits."""

from __future__ import annotations

import itertools

import etendue as et
import numpy as np
import pytest
from oracles.sources import PrismaticFilm


@pytest.mark.slow
@pytest.mark.parametrize("surface", [et.Disk(radius=30), "auto"])
def test_progress_moves_from_the_start_to_the_end(surface: et.Disk | str) -> None:
    seen: list[int] = []
    position, direction = PrismaticFilm().rays(2_000, seed=1)
    rays = et.RaySet(position, direction, np.ones(2_000))
    et.LightField.fit(rays, surface, progress=seen.append)
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0, 2_000)
    assert len(set(seen)) >= 10
    assert max(b - a for a, b in itertools.pairwise(seen)) < 0.5 * 2_000
