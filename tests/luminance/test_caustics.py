"""Light that smooth surfaces send to diffuse ones, in maps by default: seeds against a long run, and a closed form."""

from __future__ import annotations

import math
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.luminance import scene_map
from etendue.luminance.caustics import MOST_SEGMENTS, at_least_nearby
from etendue.quantities.luminance_map import LuminanceMap
from etendue.scene import compile_scene
from etendue.units import MM2_PER_M2
from oracles.luminaires import corner, lens_and_mirror
from oracles.verdicts import LARGEST_Z, REVERSE, SIGNIFICANCE, assert_agree
from scipy.stats import binom, chi2, norm, t

SEEDS = 12
WHITE = {"kind": "lambertian", "reflectance": 1.0}


def ball_over_paper() -> dict[str, Any]:
    """A glass ball throws a lamp's light on paper; the lamp is so large that no pixel misses its image in the ball."""
    return {
        "sources": [{"kind": "surface", "shape": {"kind": "disk", "radius": 0.5}, "flux": 100, "at": [4, 2, 30],
                     "toward": [-0.1, -0.05, -1]}],
        "solids": [{"shape": {"kind": "ball", "radius": 5}, "medium": "BK7", "at": [1, 0.5, 10]}],
        "surfaces": [{"shape": {"kind": "rectangle", "width": 40, "height": 34}, "finish": {"kind": "lambertian",
                      "reflectance": 0.8}}],
        "observers": [{"name": "eye", "theta": 55, "phi": 20, "distance": 300,
                       "screen": {"width": 30, "height": 18, "columns": 15, "rows": 9}}],
    }  # fmt: skip


SCENES = {"ball over paper": ball_over_paper(), "lens and mirror": lens_and_mirror()}


def long_run(name: str) -> LuminanceMap:
    (lmap,) = et.luminance_map(et.Scene(**SCENES[name]), rays_per_pixel=1 << 13, seed=1 << 40, forward_rays=1.5e6)
    return lmap


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_default_maps_are_unbiased_with_errors_that_hold(name: str) -> None:
    """Of 12 seeds: the light of each map, and of their mean, is that of the long run; in the bulk of the pixels no error is
    too small; and 1 % of the pixels at most, where a few lines of sight found a lamp behind glass, is off by 4 errors."""
    scene, truth = et.Scene(**SCENES[name]), long_run(name)
    maps = [et.luminance_map(scene, rays_per_pixel=64, seed=seed)[0] for seed in range(1, SEEDS + 1)]
    light = np.array([lmap.values.sum() for lmap in maps])
    error = np.array([math.sqrt((lmap.standard_error**2).sum()) for lmap in maps])
    known = math.sqrt((truth.standard_error**2).sum())
    z = (light - truth.values.sum()) / np.hypot(error, known)
    assert chi2.sf((z**2).sum(), SEEDS) > SIGNIFICANCE
    mean = (light.mean() - truth.values.sum()) / math.hypot(light.std(ddof=1) / math.sqrt(SEEDS), known)
    assert abs(mean) < t.isf(SIGNIFICANCE / 2, SEEDS - 1)
    # An error of 5 % would be seen.
    assert np.hypot(light.std(ddof=1) / math.sqrt(SEEDS), known) < 0.05 * truth.values.sum() / 5.5
    off = np.array([lmap.values - truth.values for lmap in maps])
    sure = np.hypot([lmap.standard_error for lmap in maps], truth.standard_error)
    assert (sure[:, truth.values > 0] > 0).all()
    deviates = np.abs(off[sure > 0] / sure[sure > 0])
    for bound in (1.0, 2.0):
        beyond, expected = (deviates > bound).sum(), 2 * t.sf(bound, REVERSE)
        assert binom.sf(beyond - 1, deviates.size, expected) > SIGNIFICANCE, (bound, beyond / deviates.size)
    assert (deviates > 4.0).mean() < 0.01


def test_a_lens_over_a_white_floor_in_an_even_surround() -> None:
    """What the lens takes from the floor it gives elsewhere: L ≡ 1 in every pixel, whichever route has which light. Rays
    forwards alone could not show it: nearly none of them meets the lens."""
    sky = {"kind": "surface", "shape": {"kind": "sphere", "radius": 50}, "side": "back",
           "flux": math.pi * 4 * math.pi * 50**2}  # fmt: skip
    lens = {"shape": {"kind": "ball", "radius": 2.5}, "medium": "BK7", "at": [3, 2, 3.5]}
    leaf = {"shape": {"kind": "rectangle", "width": 30, "height": 24}, "finish": WHITE}
    scene = et.Scene(sources=[sky], solids=[lens], surfaces=[leaf])
    eye, screen = et.Observer(40, 15, 40, target=(3, 2, 2)), et.Screen(12, 10, 6, 5)
    for rays in (None, 3e5):
        lmap = et.luminance_map(scene, eye, screen, rays_per_pixel=512, seed=3, forward_rays=rays)
        assert np.median(lmap.standard_error) < 0.02e6
        noisy = lmap.standard_error > 1.0
        assert np.allclose(lmap.values[~noisy], 1e6, rtol=1e-6)
        assert_agree(
            values=lmap.values[noisy],
            expected=1e6,
            standard_error=lmap.standard_error[noisy],
            degrees=REVERSE,
        )


def test_the_same_bits_for_any_number_of_threads() -> None:
    scene = et.Scene(**ball_over_paper())
    maps = [et.luminance_map(scene, rays_per_pixel=32, seed=2, until=0.2, threads=n)[0] for n in (1, 2, 7)]
    for other in maps[1:]:
        assert np.array_equal(maps[0].values, other.values)
        assert np.array_equal(maps[0].standard_error, other.standard_error)


def test_both_routes_go_on_until_the_error_is_reached() -> None:
    """The floor beside the lens is noisy by rays forwards, what the lens shows by lines of sight."""
    scene = et.Scene(**ball_over_paper())

    def error(lmap: LuminanceMap) -> float:
        assert lmap.relative_error is not None
        return lmap.relative_error.flux_weighted

    (first,) = et.luminance_map(scene, rays_per_pixel=16)
    wanted = 0.4 * error(first)
    (more,) = et.luminance_map(scene, rays_per_pixel=16, until=wanted)
    assert error(more) < wanted
    assert more.rays[0, 0] > 16

    def forwards(lmap: LuminanceMap) -> int:
        (note,) = (note for note in lmap.notes if "rays forwards, and" in note)
        assert note.endswith(f", beside {lmap.rays.sum():,} lines of sight")
        return int(note.split()[0].replace(",", ""))

    # Rays come in whole runs, one for every 16 passes or fewer.
    assert forwards(more) == forwards(first) * -(-int(more.rays[0, 0]) // 16)


def test_none_is_told_and_none_is_needed() -> None:
    scene = et.Scene(**ball_over_paper())
    (without,) = et.luminance_map(scene, rays_per_pixel=16, forward_rays=0)
    assert any("forward_rays is 0" in note and "too low" in note for note in without.notes)
    (asked,) = et.luminance_map(scene, rays_per_pixel=16, forward_rays=12_345)
    assert any(note.startswith("12,345 rays forwards") for note in asked.notes)
    plain = et.Scene(**corner())
    assert not _core.Scene({**compile_scene(plain).record, "detectors": []}).may_focus()
    (lmap,) = et.luminance_map(plain, rays_per_pixel=16)
    assert not any("forwards" in note for note in lmap.notes)


@pytest.mark.slow
def test_trapped_light_costs_a_small_map_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the light goes to and fro in a clear block for ever. The rays forwards of a map of 16 lines of sight end
    within the effort that is stated for a pilot; and they are no less right: I = Σ L A⊥ of a wall beside, seen from afar, is
    ρ Φ cos θ/π of the flux that reaches it, by traces that give trapped rays up early."""
    scene = et.Scene(
        sources=[{"kind": "point", "flux": 100, "at": [0.3, 0.2, 1.2]}],
        solids=[{"shape": {"kind": "block", "width": 4, "height": 4, "depth": 2}, "medium": "PMMA"}],
        surfaces=[{"name": "wall", "shape": {"kind": "rectangle", "width": 10, "height": 10}, "at": [-8, 0, 0],
                   "toward": [1, 0, 0], "finish": {"kind": "lambertian", "reflectance": 0.5}}],
    )  # fmt: skip
    segments, work_unit = [], _core.work_unit

    def counted(*how: Any) -> _core._WorkSums:
        segments.append((unit := work_unit(*how))["ledger"]["segments"])
        return unit

    eye, screen = et.Observer(45, 0, 1e6, target=(-8, 0, 0)), et.Screen(14, 14, 2, 2)
    with monkeypatch.context() as counting:
        counting.setattr(_core, "work_unit", counted)
        lmap = et.luminance_map(scene, eye, screen, rays_per_pixel=4)
    assert len(segments) == 4  # scouts, pilot, bright places, light image
    assert sum(segments) < MOST_SEGMENTS
    assert any("rays forwards, and 4,096 beforehand" in note for note in lmap.notes)
    # Where rays are given up sooner, more of them are the same effort; they still outlast those of a pilot.
    monkeypatch.setattr(scene_map, "MOST_EVENTS", 600)
    lmap = et.luminance_map(scene, eye, screen, rays_per_pixel=4)
    trace = et.trace(scene, rays=30_000, seed=5, most_events=100)
    absorbed = trace.ledger.by_surface["wall"]
    assert trace.ledger.terminated.flux > 20.0
    expected = absorbed.flux / math.pi * math.cos(math.pi / 4)
    area = 14**2 / 4 * screen.cosine(eye) / MM2_PER_M2
    error = math.sqrt(((lmap.standard_error * area) ** 2).sum())
    assert error < 0.1 * expected
    z = ((lmap.values * area).sum() - expected) / math.hypot(error, expected / math.sqrt(absorbed.rays))
    assert abs(z) < LARGEST_Z


def test_a_pixel_that_found_nothing_errs_as_its_neighbours() -> None:
    """Poisson counts of one mean μ, a weight of 2 each: (2 N − 2 μ)² is what the variances say, on average, and no pixel is
    sure of nothing."""
    rng = np.random.default_rng(5)
    possible = np.ones((60, 50), dtype=bool)
    for mean in (0.05, 0.7, 6.0, 40.0):
        count = rng.poisson(mean, possible.shape)
        own: npt.NDArray[np.float64] = 4.0 * count
        held = at_least_nearby(own, count, possible)
        assert (held > 0).all()
        assert (held >= own).all()
        assert np.array_equal(held[count >= 10], own[count >= 10])
        # Means of a few squares of Poisson numbers are skew: a tenth for those of the rarest.
        expected = 4.0 * mean
        assert expected * (1 - 3.9 * math.sqrt(1 / (mean * count.size))) < held.mean() < 2.6 * expected
        z = (2.0 * count - 2.0 * mean) / np.sqrt(held)
        assert (np.abs(z) > 2).mean() < 2 * norm.sf(2) + LARGEST_Z * math.sqrt(0.05 / count.size)
    dark = possible.copy()
    dark[:30] = False
    count = np.where(dark, 3, 0)
    assert (at_least_nearby(count * 1.0, count, dark)[:30] == 0).all()


def test_a_dim_pixel_beside_a_bright_spot_errs_by_what_it_may_have_missed() -> None:
    """Poisson counts of mean 0.7 beside such of mean 2000: a dim pixel's variance is 0.7. The stated one is k at least, and
    k + 1 + 2 √(k + 1) of one contribution's square at most, whatever is beside it; neighbours alone say up to 1300.
    """
    rng, dim, bright = np.random.default_rng(8), 0.7, 2000.0
    rate = np.full((60, 90), dim)
    rate[:, 1::4] = bright
    rate[17:19, :50] = bright
    count = rng.poisson(rate)
    weight = 3.0
    held = at_least_nearby(count * weight**2, count, np.ones(count.shape, dtype=bool)) / weight**2
    beside = rate == dim
    k = count[beside]
    assert len(k) > 3000
    assert (held[beside] <= k + 1 + 2 * np.sqrt(k + 1)).all()
    assert (held[beside] >= k).all()
    off = np.abs(k - dim)
    # Of pixels that are off by more than twice their error there are fewer than of normal deviates.
    assert np.mean(off > 2 * np.sqrt(held[beside])) < 0.05
    assert (held[~beside] == count[~beside]).all()
