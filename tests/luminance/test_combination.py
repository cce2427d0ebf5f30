"""Maps of independent runs joined into one."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError

VIEW = (et.Observer(20, 40, 150), et.Screen(70, 50, 14, 10))


def test_runs_joined_equal_the_source_with_all_runs() -> None:
    """Second route: the core draws the same rays as one source of three runs, with a third of the flux each."""
    runs = [et.luminance_map(et.RingSource(rays=300_000, seed=s), *VIEW, method="cone") for s in (5, 6, 7)]
    joined = et.combine_maps(runs)
    whole = et.luminance_map(et.RingSource(rays=300_000, runs=3, seed=5), *VIEW, method="cone")
    np.testing.assert_array_equal(joined.rays, whole.rays)
    np.testing.assert_allclose(joined.values, whole.values, rtol=1e-12)
    np.testing.assert_allclose(joined.standard_error, whole.standard_error, rtol=1e-12)
    assert np.isnan(joined.values).sum() == joined.dead_pixels < sum(m.dead_pixels for m in runs) / 3


def test_other_views_are_refused() -> None:
    a = et.luminance_map(et.RingSource(rays=1000), *VIEW, method="cone")
    with pytest.raises(ArgumentError, match="observer differs"):
        et.combine_maps([a, a.replace(observer=et.Observer(21, 40, 150))])
    with pytest.raises(ArgumentError, match="no maps"):
        et.combine_maps([])
    with pytest.raises(ArgumentError, match="maps 1 and 2 are of the same rays"):
        et.combine_maps([a, a.replace(notes=())])


@pytest.mark.slow
def test_the_same_rays_are_refused_however_they_were_looked_at() -> None:
    """By another cone, or by the field of them, filtered or not: no such mean has the error that independent ones have.
    Parts of a set are independent, and so are lines of sight of other seeds."""
    rays = et.RingSource(rays=5000, seed=3).ray_set()
    ways = (et.Cone(acceptance=3), et.Cone(acceptance=5), et.FromField(surface=et.Disk(radius=30)))
    cone, wide, field = (et.luminance_map(rays, *VIEW, method=way) for way in ways)
    other = et.luminance_map(et.RingSource(rays=5000, seed=4), *VIEW, method=ways[0])
    for same in (wide, field, et.filter_map(field, "average")):
        with pytest.raises(ArgumentError, match="maps 1 and 3 are of the same rays"):
            et.combine_maps([cone, other, same])
    parts = [et.luminance_map(part, *VIEW, method=ways[0]) for part in rays.thin(2, seed=1)]
    assert et.combine_maps([*parts, other]).notes
    lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 10}, "flux": 100}
    paint = {"kind": "lambertian", "reflectance": 0.5}
    wall = {"shape": {"kind": "disk", "radius": 40}, "at": [0, 0, -20], "finish": paint}
    scene = et.Scene(sources=[lamp], surfaces=[wall])
    drawn = [et.luminance_map(scene, *VIEW, rays_per_pixel=4, seed=seed) for seed in (1, 2)]
    assert et.combine_maps(drawn).notes
    with pytest.raises(ArgumentError, match="maps 1 and 2"):
        et.combine_maps([drawn[0], drawn[0]])


def test_what_is_unknown_stays_unknown() -> None:
    a, b = (et.luminance_map(et.RingSource(rays=300_000, seed=s), *VIEW, method="cone") for s in (1, 2))
    live = ~np.isnan(a.values)
    unknown = a.replace(standard_error=np.full(a.values.shape, np.nan), rays=np.full(a.values.shape, -1))
    both = et.combine_maps([unknown, b])
    assert np.isnan(both.standard_error[live]).all()
    assert (both.rays == -1).all()
    dead_in_a = ~live & ~np.isnan(b.values)
    assert dead_in_a.any()
    np.testing.assert_allclose(both.standard_error[dead_in_a], b.standard_error[dead_in_a] / 2)
