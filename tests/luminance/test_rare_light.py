"""Light that few lines of sight find: pixels that have not found it must not be sure of it."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.luminance.rare_light import RareLight
from oracles.verdicts import REVERSE, assert_agree
from scipy.stats import binom, t

Array = npt.NDArray[np.float64]

SIDE, PASSES, EVERY = (30, 40), 16, np.ones((30, 40), dtype=bool)


def errors(*, light: Array) -> tuple[Array, Array]:
    """Of the means of passes: by their spread alone, and by no less than rare light has."""
    rare = RareLight(SIDE)
    for values in light:
        rare.add(values)
    own = light.var(axis=0, ddof=1) / len(light)
    return np.sqrt(own), np.sqrt(np.maximum(own, rare.least_variance(EVERY)))


@pytest.mark.parametrize("chance", [0.1, 0.05, 0.03])
def test_pixels_that_found_none_of_it_err_by_the_share_of_their_neighbours(chance: float) -> None:
    """Light of 1 in each pass, and of 1/p in a share p of them: the variance is (1/p − 1)/n, and few pixels are far off.

    Light is rare that was found in one pass or two; so much of the variance is theirs.
    """
    rng = np.random.default_rng(6)
    light = rng.normal(1.0, 0.05, (PASSES, *SIDE)) + (rng.random((PASSES, *SIDE)) < chance) / chance
    own, least = errors(light=light)
    off = np.abs(light.mean(axis=0) - 2.0)
    most = float(t.isf(0.001, PASSES - 1))
    assert np.mean(off > most * own) > 0.1
    # None within a pixel of it: 9 times 16 passes.
    assert np.mean(off > most * least) < 0.005 + 2.0 * (1.0 - chance) ** (9 * PASSES)
    known = (1.0 / chance - 1.0) / PASSES
    share = sum(k * binom.pmf(k, PASSES, chance) for k in (1, 2)) / (PASSES * chance)
    unlucky = own < 0.1
    assert 0.85 * share * known < np.mean(least[unlucky] ** 2) < known


def test_moments_are_those_of_two_passes_over_the_values() -> None:
    """What is updated pass by pass, against sums of powers about the mean."""
    rng = np.random.default_rng(7)
    light = rng.gamma(0.3, 1.0, (PASSES, *SIDE)) * 10.0 ** rng.uniform(-6, 6, SIDE)
    rare = RareLight(SIDE)
    for values in (np.zeros(SIDE), *light):
        rare.add(values)
    off = np.concatenate([np.zeros((1, *SIDE)), light])
    off -= off.mean(axis=0)
    assert rare._moments is not None
    for moment, power in zip(rare._moments[1:], (2, 3, 4), strict=True):
        assert np.allclose(moment, np.sum(off**power, axis=0), rtol=1e-9, atol=0)


def test_regular_light_errs_by_its_own_spread() -> None:
    """Normal passes, a bright half beside a dim one: but for accidents of the spread of a few pixels."""
    rng = np.random.default_rng(8)
    light = rng.normal(1.0, 0.1, (PASSES, *SIDE))
    light[:, :, SIDE[1] // 2 :] *= 1e-3
    own, least = errors(light=light)
    for half in (slice(0, SIDE[1] // 2), slice(SIDE[1] // 2, None)):
        assert np.mean(least[:, half] > 1.001 * own[:, half]) < 0.03
        assert np.mean(least[:, half] ** 2) < 1.01 * np.mean(own[:, half] ** 2)


def test_few_passes_tell_nothing_of_rare_light() -> None:
    """The spread of four passes is held by three at most, whatever they are."""
    rng = np.random.default_rng(9)
    own, least = errors(light=rng.normal(1.0, 0.1, (4, *SIDE)))
    assert np.array_equal(own, least)


LAMP, HIGH, FLUX, WALL, FLOOR = 2.0, 30.0, 100.0, 0.6, 0.001
"""Of a square lamp that faces a wall: side, height [mm], flux [lm]; reflectances, that of the floor so small that light
comes back from it to the wall as a part in 10⁴."""

TARGET, PIXELS, WIDTH = (60.0, 10.0), 8, 10.0


def graded(*, low: float, high: float, about: float, cells: int, gap: float) -> tuple[Array, Array]:
    """Middles and widths of cells that are the finer the nearer they are to a point, by the hyperbolic sine."""
    edges = np.sinh(np.linspace(*(np.arcsinh((end - about) / (gap / 2)) for end in (low, high)), cells + 1))
    edges = about + gap / 2 * edges
    return (edges[1:] + edges[:-1]) / 2, np.diff(edges)


def patches(*, gap: float) -> Iterator[tuple[Array, Array]]:
    """Points of the wall x = 0 and what is sent out around them [cd], by midpoint rules over wall and lamp."""
    y, wide = graded(low=-30.0, high=30.0, about=0.0, cells=100, gap=gap)
    z, high = graded(low=0.0, high=60.0, about=HIGH, cells=100, gap=gap)
    side = ((np.arange(16) + 0.5) / 16 - 0.5) * LAMP
    u, v = (axis.ravel() for axis in np.meshgrid(side, side))
    luminance = FLUX / (np.pi * LAMP**2 * 1e-6)
    for height, tall in zip(z, high, strict=True):
        square = gap**2 + (y[:, None] - u) ** 2 + (height - HIGH - v) ** 2
        irradiance = luminance * gap**2 * np.mean(square**-2.0, axis=1) * LAMP**2
        points = np.column_stack([0 * y, y, 0 * y + height])
        yield points, WALL / np.pi * irradiance * wide * tall


@functools.cache
def floor_luminance(*, gap: float) -> Array:
    """Of the floor z = 0, which sees the wall and not the face of the lamp, in each pixel [cd/m²]."""
    place = ((np.arange(2 * PIXELS) + 0.5) / (2 * PIXELS) - 0.5) * WIDTH
    x, y = np.meshgrid(TARGET[0] + place, TARGET[1] - place)
    seen = np.zeros(x.size)
    for points, sent in patches(gap=gap):
        to = points - np.stack([x, y, 0 * x], axis=-1).reshape(-1, 1, 3)
        seen += FLOOR / np.pi * np.sum(sent * to[..., 2] * -to[..., 0] / np.sum(to**2, axis=-1) ** 2, axis=1)
    return seen.reshape(PIXELS, 2, PIXELS, 2).mean(axis=(1, 3))


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "lines", "seeds"), [(5.0, 64, 10), (5.0, 1024, 4), (1.0, 1024, 4)])
def test_a_floor_that_sees_a_wall_with_a_lamp_close_to_it(gap: float, lines: int, seeds: int) -> None:
    """Nearly all the light comes from a spot of the wall beside the lamp, which lines of sight meet by chance only: with 256
    lines and no more, pixels are 0.8 and 4 times their luminance off. Rays forwards say where to look.
    """
    lamp = {"kind": "surface", "shape": {"kind": "rectangle", "width": LAMP, "height": LAMP}, "flux": FLUX,
            "at": [gap, 0, HIGH], "toward": [-1, 0, 0]}  # fmt: skip
    floor = {"shape": {"kind": "rectangle", "width": 1000, "height": 1000}, "at": [500, 0, 0],
             "finish": {"kind": "lambertian", "reflectance": FLOOR}}  # fmt: skip
    wall = {"shape": {"kind": "rectangle", "width": 60, "height": 60}, "at": [0, 0, 30], "toward": [1, 0, 0],
            "finish": {"kind": "lambertian", "reflectance": WALL}}  # fmt: skip
    scene = et.Scene(sources=[lamp], surfaces=[floor, wall])
    observer, screen = et.Observer(0, 0, 4e6, target=(*TARGET, 0.0)), et.Screen(WIDTH, WIDTH, PIXELS, PIXELS, "xy")
    methods = [et.PathTracing(rays_per_pixel=lines, seed=seed) for seed in range(1, seeds + 1)]
    maps = [et.luminance_map(scene, observer, screen, method=method) for method in methods]
    values, error = (np.array([getattr(lmap, name) for lmap in maps]) for name in ("values", "standard_error"))
    expected = np.broadcast_to(floor_luminance(gap=gap), values.shape)
    assert_agree(values=values, expected=expected, standard_error=error, degrees=REVERSE)
    assert np.sqrt(np.mean((values / expected - 1.0) ** 2)) < 3.0 / np.sqrt(lines)
    assert any("small bright places" in note for note in maps[0].notes)
    one, seven = (et.luminance_map(scene, observer, screen, method=methods[0], threads=n) for n in (1, 7))
    assert np.array_equal(one.values, values[0])
    assert np.array_equal(seven.values, values[0])


def test_even_light_has_no_small_bright_places() -> None:
    """A lamp above a floor, and in a ball: nothing is looked for. Nor does a floor see a bright spot of itself."""
    lamp = {"kind": "surface", "shape": {"kind": "rectangle", "width": 200, "height": 200}, "flux": 3000,
            "at": [0, 0, 2400], "toward": [0, 0, -1]}  # fmt: skip
    paint = {"kind": "lambertian", "reflectance": 0.8}
    floor = {"shape": {"kind": "rectangle", "width": 4000, "height": 4000}, "finish": paint}
    ball = {"shape": {"kind": "sphere", "radius": 4000}, "at": [0, 0, 1000], "finish": paint}
    how = et.PathTracing(rays_per_pixel=16)
    for surfaces in ([floor], [floor, ball]):
        scene = et.Scene(sources=[lamp], surfaces=surfaces)
        seen = et.luminance_map(scene, et.Observer(70, 0, 3000), et.Screen(900, 900, 2, 2), method=how)
        assert not any("bright places" in note for note in seen.notes)
    lamp = lamp | {"at": [3, 1, 2], "shape": {"kind": "disk", "radius": 1}}
    scene, screen = et.Scene(sources=[lamp], surfaces=[floor | {"at": [0, 0, 0]}]), et.Screen(900, 900, 2, 2)
    found, without = (
        et.luminance_map(
            scene, et.Observer(70, 0, 3000), screen, method=et.PathTracing(rays_per_pixel=16, forward_rays=rays)
        )
        for rays in (None, 0)
    )
    assert np.array_equal(found.values, without.values)
